//! The plots of the report.

use crate::kernels::{Entry, Origin};
use crate::rows::{Row, Sheet};
use crate::support::cases::{Case, Kernel};
use crate::svg::{Axis, COLOURS, Mark, Panel, Svg, legend, power_of_ten};
use crate::sweeps;

fn colour(origin: Origin) -> &'static str {
    match origin {
        Origin::TextbookF32 => COLOURS[0],
        Origin::TextbookF64 => COLOURS[1],
        Origin::Shipped => COLOURS[2],
    }
}

fn mark(origin: Origin) -> Mark {
    match origin {
        Origin::TextbookF32 => Mark::Square,
        Origin::TextbookF64 => Mark::Circle,
        Origin::Shipped => Mark::Diamond,
    }
}

/// The origins' names, and what else there is to say.
fn key<'a>(more: &[(&'a str, Mark, &'a str, bool)]) -> Vec<(&'a str, Mark, &'a str, bool)> {
    let origins =
        [("textbook f32", Origin::TextbookF32), ("textbook f64", Origin::TextbookF64), ("truehit", Origin::Shipped)];
    origins.iter().map(|(name, o)| (*name, mark(*o), colour(*o), true)).chain(more.iter().copied()).collect()
}

/// How the textbook's kernels of one shape are told apart.
fn dash(name: &str) -> &'static str {
    match name.split(" f").next() {
        Some("Algorithm 1") => "8 3",
        Some("Algorithm 2") => "2 3",
        Some("Woop" | "RT Gems 7") => "5 3",
        _ => "",
    }
}

/// ns against the largest error, a point for each kernel and family, a panel for each shape; the front drawn.
pub fn pareto(rows: &[Row], kernels: &[Kernel]) -> String {
    let columns = 4;
    let lines = kernels.len().div_ceil(columns);
    let (w, h) = (200.0, 190.0);
    let width = 20.0 + columns as f64 * (w + 62.0);
    let mut svg = Svg::new(
        width,
        62.0 + lines as f64 * (h + 62.0),
        "Speed against error: each point a kernel on a family of rays",
    );
    let front = "line: the front of those never wrong (lowest points: exact)";
    let more = [
        ("hollow: some hits or misses are wrong", Mark::Circle, COLOURS[5], false),
        (front, Mark::Circle, COLOURS[3], true),
    ];
    legend(&mut svg, 60.0, 42.0, &key(&more));
    for (i, &kernel) in kernels.iter().enumerate() {
        let at = (56.0 + (i % columns) as f64 * (w + 62.0), 76.0 + (i / columns) as f64 * (h + 62.0));
        let points: Vec<(&Row, f64, f64)> = rows
            .iter()
            .filter(|r| r.entry.kernel == kernel && !r.accuracy.ulps.is_empty())
            .map(|r| (r, r.speed.throughput.median.max(0.1), r.accuracy.max().unwrap_or(0.0).clamp(0.15, 1e20)))
            .collect();
        let x = Axis::decades("ns a ray", 10.0, 100_000.0);
        let y = Axis::decades("largest λ error, ulp", 0.1, 1e20);
        let panel = Panel::draw(&mut svg, at, (w, h), kernel.name(), x, y);
        for (row, ns, ulp) in &points {
            let hint = format!(
                "{}, {}: {ns:.1} ns, {ulp:.1e} ulp, {} wrong",
                row.entry.name,
                row.family,
                row.accuracy.wrong()
            );
            let origin = row.entry.origin;
            svg.mark(panel.at(*ns, *ulp), mark(origin), colour(origin), row.accuracy.wrong() == 0, &hint);
        }
        // Nothing on the front is both slower and less exact than another point; a wrong decision keeps off it.
        let mut right: Vec<_> = points.iter().filter(|p| p.0.accuracy.wrong() == 0).map(|p| (p.1, p.2)).collect();
        right.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut front: Vec<(f64, f64)> = Vec::new();
        for p in right {
            match front.last() {
                Some(last) if p.1 >= last.1 => {}
                Some(last) => {
                    front.push((p.0, last.1));
                    front.push(p);
                }
                None => front.push(p),
            }
        }
        let pixels: Vec<(f64, f64)> = front.iter().map(|p| panel.at(p.0, p.1)).collect();
        svg.polyline(&pixels, COLOURS[3], "");
    }
    svg.finish()
}

/// One kernel's errors along a parameter.
fn curves(svg: &mut Svg, panel: &Panel, entries: &[Entry], values: &[f64], n: u64, make: impl Fn(f64, u64) -> Case) {
    let mut lines: Vec<Vec<(f64, f64)>> = vec![Vec::new(); entries.len()];
    for &value in values {
        let cases: Vec<Case> = (0..n).map(|seed| make(value, seed)).collect();
        let sheet = Sheet::of(cases);
        for (entry, line) in entries.iter().zip(&mut lines) {
            let point = sweeps::point(entry, &sheet);
            // Of a few hits the largest error says little.
            if 4 * point.hits < sheet.hits() {
                line.push((f64::NAN, f64::NAN));
                continue;
            }
            let at = panel.at(value, point.max.clamp(0.1, 1e20));
            // Hollow where some decision was wrong.
            let hint = format!("{}: {:.1e} ulp", entry.name, point.max);
            svg.mark(at, mark(entry.origin), colour(entry.origin), point.wrong == 0.0, &hint);
            line.push(at);
        }
    }
    for (entry, line) in entries.iter().zip(&lines) {
        for part in line.split(|p| p.0.is_nan()).filter(|p| p.len() > 1) {
            svg.polyline(part, colour(entry.origin), dash(entry.name));
        }
    }
}

const SWEPT: [Kernel; 4] = [Kernel::Sphere, Kernel::Triangle, Kernel::Cylinder, Kernel::Cone];

/// The kernels that stand for a shape in a sweep: few enough to be told apart.
fn representatives(entries: &[Entry], kernel: Kernel) -> Vec<Entry> {
    entries.iter().filter(|e| e.kernel == kernel && !e.name.starts_with("Algorithm")).copied().collect()
}

fn sweep_plot(
    entries: &[Entry],
    title: &str,
    label: &str,
    kernels: &[Kernel],
    values: &[f64],
    n: u64,
    make: impl Fn(Kernel, f64, u64) -> Case,
) -> String {
    let (w, h) = (230.0, 200.0);
    let mut svg = Svg::new(20.0 + kernels.len() as f64 * (w + 66.0), 316.0, title);
    let more = "hollow: wrong decisions; none: most hits missed; dashed: RT Gems 7, Woop";
    legend(&mut svg, 60.0, 42.0, &key(&[(more, Mark::Circle, COLOURS[5], false)]));
    for (i, &kernel) in kernels.iter().enumerate() {
        let at = (60.0 + i as f64 * (w + 66.0), 76.0);
        let x = Axis::decades(label, values[0], values[values.len() - 1]);
        let y = Axis::decades("largest λ error, ulp", 0.1, 1e20);
        let panel = Panel::draw(&mut svg, at, (w, h), kernel.name(), x, y);
        curves(&mut svg, &panel, &representatives(entries, kernel), values, n, |v, seed| make(kernel, v, seed));
    }
    svg.finish()
}

fn powers(low: i32, high: i32) -> Vec<f64> {
    (low..=high).map(|e| 10f64.powi(e)).collect()
}

pub fn distance(entries: &[Entry], n: u64) -> String {
    let title = "Error against distance: rays towards a shape of unit size";
    sweep_plot(entries, title, "distance / size", &SWEPT, &powers(0, 12), n, |kernel, d, seed| {
        sweeps::from_distance(kernel, 1.0, d, 0.9, seed)
    })
}

pub fn grazing(entries: &[Entry], n: u64) -> String {
    let title = "Error against grazing angle: rays from three units away";
    sweep_plot(entries, title, "angle to the surface, rad", &SWEPT[..3], &powers(-9, 0), n, |kernel, angle, seed| {
        sweeps::at_angle(kernel, angle, seed)
    })
}

/// The share of hits at most so far off, over all families of a shape.
pub fn cdf(rows: &[Row], kernels: &[Kernel]) -> String {
    let columns = 4;
    let (w, h) = (200.0, 170.0);
    let lines = kernels.len().div_ceil(columns);
    let mut svg = Svg::new(
        20.0 + columns as f64 * (w + 62.0),
        62.0 + lines as f64 * (h + 62.0),
        "λ error over all families: the share of hits that are at most so far off",
    );
    legend(&mut svg, 60.0, 42.0, &key(&[]));
    svg.text(
        330.0,
        42.0,
        "dashed: RT Gems 7, Woop; long dashes: Algorithm 1; dots: Algorithm 2; at the left edge: exact",
        "start",
        "",
    );
    for (i, &kernel) in kernels.iter().enumerate() {
        let at = (56.0 + (i % columns) as f64 * (w + 62.0), 76.0 + (i / columns) as f64 * (h + 62.0));
        let x = Axis::decades("λ error, ulp", 1e-3, 1e20);
        let y = Axis::linear("share of hits", 0.0, 1.0);
        let panel = Panel::draw(&mut svg, at, (w, h), kernel.name(), x, y);
        let mut names: Vec<&str> = rows.iter().filter(|r| r.entry.kernel == kernel).map(|r| r.entry.name).collect();
        names.dedup();
        names.sort_unstable();
        names.dedup();
        for name in names {
            let of = rows.iter().filter(|r| r.entry.kernel == kernel && r.entry.name == name);
            let mut ulps: Vec<f64> = of.clone().flat_map(|r| r.accuracy.ulps.iter().copied()).collect();
            let Some(origin) = of.map(|r| r.entry.origin).next() else { continue };
            ulps.sort_by(f64::total_cmp);
            if ulps.is_empty() {
                continue;
            }
            let points: Vec<(f64, f64)> = (0..=160)
                .map(|k| {
                    let q = f64::from(k) / 160.0;
                    panel.at(crate::rows::quantile(&ulps, q).unwrap_or(0.0).clamp(1e-3, 1e20), q)
                })
                .collect();
            svg.polyline(&points, colour(origin), dash(name));
        }
    }
    svg.finish()
}

/// How many times larger the bound is than the error.
pub fn tightness(rows: &[Row], kernels: &[Kernel]) -> String {
    let (w, h) = (200.0, 150.0);
    let columns = 4;
    let lines = kernels.len().div_ceil(columns);
    let mut svg = Svg::new(
        20.0 + columns as f64 * (w + 62.0),
        40.0 + lines as f64 * (h + 64.0),
        "Tightness: the bound of a hit over its error (left of 1 it would not hold)",
    );
    for (i, &kernel) in kernels.iter().enumerate() {
        let at = (56.0 + (i % columns) as f64 * (w + 62.0), 56.0 + (i / columns) as f64 * (h + 64.0));
        let all: Vec<f64> = rows
            .iter()
            .filter(|r| r.entry.kernel == kernel && r.entry.origin == Origin::Shipped)
            .flat_map(|r| r.accuracy.tightness.iter().copied())
            .collect();
        // Exact hits have no such ratio. Four bins a decade.
        let mut bins = [0usize; 32];
        for t in &all {
            bins[((4.0 * t.log10()).floor().clamp(-8.0, 23.0) + 8.0) as usize] += 1;
        }
        let x = Axis::decades("bound / error", 1e-2, 1e6);
        let y = Axis::linear("share of inexact hits", 0.0, 1.0);
        let panel = Panel::draw(&mut svg, at, (w, h), &format!("{} ({} hits)", kernel.name(), all.len()), x, y);
        for (bin, &count) in bins.iter().enumerate() {
            let share = count as f64 / all.len().max(1) as f64;
            let left = panel.at(10f64.powf((bin as f64 - 8.0) / 4.0), share);
            let right = panel.at(10f64.powf((bin as f64 - 7.0) / 4.0), 0.0);
            if count > 0 {
                svg.rectangle(left.0, left.1, right.0 - left.0, right.1 - left.1, COLOURS[2], 0.85);
            }
        }
    }
    svg.finish()
}

/// Wrong decisions by scale and distance.
pub fn heat(entries: &[Entry], n: u64) -> String {
    let scales: Vec<i32> = (-6..=6).map(|k| 25 * k).collect();
    let distances: Vec<i32> = (0..=12).collect();
    let cell = 13.0;
    let mut svg = Svg::new(1000.0, 560.0, "Wrong hits and misses by scale and distance, rays at and beside the shape");
    let kernels = [Kernel::Sphere, Kernel::Triangle];
    for (line, &kernel) in kernels.iter().enumerate() {
        let shown: Vec<Entry> = entries
            .iter()
            .filter(|e| {
                e.kernel == kernel
                    && (e.origin == Origin::Shipped
                        || [
                            "slide formula f32",
                            "slide formula f64",
                            "RT Gems 7 f64",
                            "Möller–Trumbore f32",
                            "Möller–Trumbore f64",
                            "Woop f64",
                        ]
                        .contains(&e.name))
            })
            .copied()
            .collect();
        let grid: Vec<Vec<Sheet>> = scales
            .iter()
            .map(|&s| {
                distances
                    .iter()
                    .map(|&d| {
                        let cases: Vec<Case> = (0..n)
                            .map(|seed| sweeps::from_distance(kernel, 10f64.powi(s), 10f64.powi(d), 1.1, seed))
                            .collect();
                        Sheet::of(cases)
                    })
                    .collect()
            })
            .collect();
        for (column, entry) in shown.iter().enumerate() {
            let (left, top) = (70.0 + column as f64 * 236.0, 62.0 + line as f64 * 240.0);
            svg.text(left + cell * 6.5, top - 8.0, &format!("{}: {}", kernel.name(), entry.name), "middle", "");
            for (j, row) in grid.iter().enumerate() {
                for (i, sheet) in row.iter().enumerate() {
                    let wrong = sweeps::point(entry, sheet).wrong;
                    shade(&mut svg, (left + i as f64 * cell, top + (12 - j) as f64 * cell), cell - 1.0, wrong);
                }
            }
            for (i, &d) in distances.iter().enumerate().step_by(3) {
                svg.text(left + (i as f64 + 0.5) * cell, top + 13.0 * cell + 12.0, &power_of_ten(d), "middle", "small");
            }
            for (j, &s) in scales.iter().enumerate().step_by(3) {
                svg.text(left - 5.0, top + (12.5 - j as f64) * cell + 3.0, &power_of_ten(s), "end", "small");
            }
            svg.text(left + cell * 6.5, top + 13.0 * cell + 27.0, "distance / size", "middle", "small");
            svg.upright((left - 40.0, top + cell * 6.5), "size, units of length");
        }
    }
    let mut x = 70.0;
    for (wrong, label) in [(0.0, "none wrong"), (0.01, "1 %"), (0.1, "10 %"), (0.5, "50 %"), (1.0, "all wrong")] {
        shade(&mut svg, (x, 534.0), cell - 1.0, wrong);
        svg.text(x + 18.0, 545.0, label, "start", "");
        x += 40.0 + 6.5 * label.len() as f64;
    }
    svg.text(x, 545.0, &format!("of {n} rays at or beside the shape, a cell"), "start", "");
    svg.finish()
}

/// A cell of a heat map by the share that is wrong.
fn shade(svg: &mut Svg, (x, y): (f64, f64), size: f64, wrong: f64) {
    if wrong == 0.0 {
        svg.rectangle(x, y, size, size, COLOURS[2], 0.45);
    } else {
        svg.rectangle(x, y, size, size, COLOURS[0], 0.3 + 0.7 * wrong.sqrt());
    }
}
