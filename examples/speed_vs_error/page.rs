//! The page, the CSV, the worst cases.

use crate::kernels::Origin;
use crate::rows::{Row, per_million, quantile};
use crate::support::cases::Kernel;
use crate::surfaces::SurfaceRow;
use crate::watertight::{AIMS, Sieve};
use std::fmt::Write;

pub struct Page<'a> {
    pub rows: &'a [Row],
    pub surfaces: &'a [SurfaceRow],
    pub sieves: &'a [Sieve],
    pub cases: usize,
    pub full: bool,
}

/// Whether a row of the crate's own is less than promised.
pub fn breaks_contract(row: &Row) -> bool {
    let a = &row.accuracy;
    let largest = a.quantile(1.0).unwrap_or(0.0);
    let bounded = row.entry.kernel != Kernel::Slab;
    a.wrong() > 0 || a.wrong_parts > 0 || (bounded && a.violations > 0) || largest > contract(row.entry.kernel)
}

/// λ's contract in ulps; an affine shape promises a bound and no more, and a box is only passed through.
pub fn contract(kernel: Kernel) -> f64 {
    match kernel {
        Kernel::Affine => f64::INFINITY,
        k => k.contract(),
    }
}

pub fn shortcoming(row: &Row) -> String {
    let a = &row.accuracy;
    let mut parts = Vec::new();
    let mut count = |n: usize, what: &str| {
        if n > 0 {
            parts.push(format!("{n} {what} of {}", a.answered));
        }
    };
    count(a.false_misses, "false misses");
    count(a.false_hits, "false hits");
    count(a.wrong_parts, "wrong parts");
    count(a.violations, "violated bounds");
    let largest = a.quantile(1.0).unwrap_or(0.0);
    if largest > contract(row.entry.kernel) {
        parts.push(format!("{} ulp", ulps(Some(largest))));
    }
    parts.join(", ")
}

fn ulps(x: Option<f64>) -> String {
    match x {
        None => "–".to_owned(),
        Some(x) if x.is_infinite() => "∞".to_owned(),
        Some(x) if x >= 1000.0 => format!("{x:.0e}"),
        Some(x) if x >= 10.0 => format!("{x:.0}"),
        Some(x) => format!("{x:.2}"),
    }
}

fn ns(x: f64) -> String {
    if x >= 100.0 { format!("{x:.0}") } else { format!("{x:.1}") }
}

fn command(program: &str, arguments: &[&str]) -> String {
    let output = std::process::Command::new(program).args(arguments).output();
    output
        .ok()
        .and_then(|o| String::from_utf8(o.stdout).ok())
        .map_or_else(|| "unknown".to_owned(), |s| s.trim().to_owned())
}

fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": ")).map_or("unknown CPU", |m| m.1);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let flags = std::env::var("RUSTFLAGS").unwrap_or_default();
    let flags = if flags.is_empty() { "default flags (no target-cpu)".to_owned() } else { flags };
    format!(
        "{cpu}, {threads} hardware threads, one used; {}; {flags}, profile release; SIMD level detected: {:?}; truehit {}",
        command("rustc", &["-V"]),
        fearless_simd::Level::new(),
        command("git", &["describe", "--always", "--dirty"]),
    )
}

/// All families of one kernel, summed.
struct Sum {
    cases: usize,
    wrong: usize,
    parts: usize,
    hits: usize,
    violations: usize,
    p99: Option<f64>,
    max: Option<f64>,
    ordinary: Option<(f64, f64)>,
    hard: f64,
}

impl Page<'_> {
    fn of<'a>(&'a self, kernel: Kernel, name: &'a str) -> impl Iterator<Item = &'a Row> + Clone {
        self.rows.iter().filter(move |r| r.entry.kernel == kernel && r.entry.name == name)
    }

    fn sum(&self, kernel: Kernel, name: &str) -> Sum {
        let rows = || self.of(kernel, name);
        let mut all: Vec<f64> = rows().flat_map(|r| r.accuracy.ulps.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        let mut times: Vec<f64> = rows().map(|r| r.speed.throughput.median).collect();
        times.sort_by(f64::total_cmp);
        Sum {
            cases: rows().map(|r| r.accuracy.answered).sum(),
            wrong: rows().map(|r| r.accuracy.wrong()).sum(),
            parts: rows().map(|r| r.accuracy.wrong_parts).sum(),
            hits: rows().map(|r| r.accuracy.hits).sum(),
            violations: rows().map(|r| r.accuracy.violations).sum(),
            p99: quantile(&all, 0.99),
            max: quantile(&all, 1.0),
            ordinary: rows().find(|r| r.number == 0).map(|r| (r.speed.throughput.median, r.speed.latency.median)),
            hard: quantile(&times, 0.5).unwrap_or(f64::NAN),
        }
    }

    fn kernels(&self) -> Vec<(Kernel, Vec<(&'static str, Origin)>)> {
        let mut kernels: Vec<(Kernel, Vec<(&'static str, Origin)>)> = Vec::new();
        for row in self.rows {
            // Rows come shape by shape.
            if kernels.last().is_none_or(|k| k.0 != row.entry.kernel) {
                kernels.push((row.entry.kernel, Vec::new()));
            }
            let name = (row.entry.name, row.entry.origin);
            if let Some((_, names)) = kernels.last_mut()
                && !names.contains(&name)
            {
                names.push(name);
            }
        }
        kernels
    }

    pub fn markdown(&self) -> String {
        let mut out = String::new();
        self.head(&mut out);
        self.summary(&mut out);
        pictures(&mut out);
        self.losses(&mut out);
        self.surfaces(&mut out);
        meshes(&mut out);
        self.sieves(&mut out);
        self.details(&mut out);
        out
    }

    fn head(&self, out: &mut String) {
        let _ = write!(
            out,
            "# Speed against error\n\n\
             Generated by `cargo run --release --example speed_vs_error{}`; do not edit. {} cases a family, seeds fixed in\n\
             `tests/support`: the counts below come out the same on every machine, the times do not.\n\n\
             {}.\n\n\
             Truth is exact: the inputs are floats, so every sign is decided in big integers and every λ is enclosed to 250\n\
             bits (docs/numerics.md §12). Shipped and textbook kernels run through one table of function pointers over the\n\
             same cases. An ulp is one of f64 at max(|λ|, 2⁻⁴⁰ s), s the largest coordinate over |d|; f32 kernels get their\n\
             input rounded to f32 and are measured with the same ruler. A count of zero in n cases is given as `0 (< 3/n)`,\n\
             its bound with 95 % confidence, per million.\n\n",
            if self.full { " -- --full" } else { "" },
            self.cases,
            machine(),
        );
    }

    fn summary(&self, out: &mut String) {
        out.push_str(
            "## In short\n\n\
             *ordinary*: ns a ray on ordinary rays, independent / each waiting for the last. *hard*: the median family's\n\
             ns. Errors and counts over all families, most of them hard.\n\n\
             | kernel | | ordinary, ns | hard, ns | λ ulp p99 | max | wrong hit or miss, ppm | wrong part, ppm | bound broken, ppm |\n\
             |---|---|---:|---:|---:|---:|---:|---:|---:|\n",
        );
        for (kernel, names) in self.kernels() {
            for (name, origin) in names {
                let s = self.sum(kernel, name);
                let ordinary = s.ordinary.map_or("–".to_owned(), |(t, l)| format!("{} / {}", ns(t), ns(l)));
                let bound = match origin {
                    Origin::Shipped if kernel != Kernel::Slab => per_million(s.violations, s.hits),
                    _ => "none given".to_owned(),
                };
                let bold = if origin == Origin::Shipped { "**" } else { "" };
                let _ = writeln!(
                    out,
                    "| {} | {bold}{name}{bold} | {ordinary} | {} | {} | {} | {} | {} | {bound} |",
                    kernel.name(),
                    ns(s.hard),
                    ulps(s.p99),
                    ulps(s.max),
                    per_million(s.wrong, s.cases),
                    per_million(s.parts, s.hits),
                );
            }
        }
        out.push('\n');
    }

    /// Where the crate's kernels are not the fastest, or not as good as promised.
    fn losses(&self, out: &mut String) {
        out.push_str("## Where truehit loses\n\n");
        let broken: Vec<&Row> =
            self.rows.iter().filter(|r| r.entry.origin == Origin::Shipped && breaks_contract(r)).collect();
        if broken.is_empty() {
            out.push_str(
                "No row breaks its contract: no wrong decision, no wrong part, no broken bound, λ within its ulps.\n\n",
            );
        } else {
            out.push_str("Rows that break their contract:\n\n| kernel | family | |\n|---|---|---|\n");
            for r in &broken {
                let _ = writeln!(out, "| {} | {} {} | {} |", r.entry.kernel.name(), r.number, r.family, shortcoming(r));
            }
            out.push('\n');
            if broken.iter().any(|r| r.entry.kernel == Kernel::Affine) {
                out.push_str(
                    "An affine shape decides for the ray's image with each component rounded once (`Affine::object_ray`); counted\n\
                     here is against the exact image. tests/exact.rs holds that nothing but this rounding makes the difference.\n\n",
                );
            }
        }
        out.push_str(
            "Time, as a multiple of the fastest textbook kernel of the same shape on the same rays (right or wrong), and of\n\
             the fastest among those with no wrong decision on that family:\n\n\
             | kernel | ordinary | median family | worst family | which | median against the right ones | families where none is right |\n\
             |---|---:|---:|---:|---|---:|---:|\n",
        );
        for (kernel, _) in self.kernels() {
            let mut all = Vec::new();
            let (mut right, mut alone) = (Vec::new(), 0);
            for row in self.rows.iter().filter(|r| r.entry.kernel == kernel && r.entry.origin == Origin::Shipped) {
                let textbook = |only_right: bool| {
                    self.rows
                        .iter()
                        .filter(|r| r.entry.kernel == kernel && r.number == row.number && r.family == row.family)
                        .filter(|r| r.entry.origin != Origin::Shipped && (!only_right || r.accuracy.wrong() == 0))
                        .map(|r| r.speed.throughput.median)
                        .fold(f64::INFINITY, f64::min)
                };
                let own = row.speed.throughput.median;
                if textbook(false).is_finite() {
                    all.push((own / textbook(false), row));
                }
                if textbook(true).is_finite() {
                    right.push(own / textbook(true));
                } else {
                    alone += 1;
                }
            }
            if all.is_empty() {
                continue;
            }
            let ordinary = all.iter().find(|(_, r)| r.number == 0).map_or("–".to_owned(), |(x, _)| format!("{x:.2}"));
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            right.sort_by(f64::total_cmp);
            let (worst, row) = all[all.len() - 1];
            let _ = writeln!(
                out,
                "| {} | {ordinary} | {:.2} | {worst:.1} | {} {} | {} | {alone} of {} |",
                kernel.name(),
                all[all.len() / 2].0,
                row.number,
                row.family,
                quantile(&right, 0.5).map_or("–".to_owned(), |x| format!("{x:.2}")),
                all.len(),
            );
        }
        out.push('\n');
    }

    fn surfaces(&self, out: &mut String) {
        out.push_str(
            "## Points, normals, spawned rays\n\n\
             At exact hits of all families of a shape. *point*: distance of the point given from the surface, in ulps of the\n\
             largest coordinate of point and shape. *normal*: angle to the exact normal at the exact hit, in units of 2⁻⁵³ rad.\n\
             *re-hits*: rays that leave the point outward and meet the same shape again (of a mesh, the same triangle),\n\
             which is wrong. Affine shapes are those that their stored maps define. Cones' walls within 1e-9 of an apex,\n\
             where normals have no direction, are left out.\n\
             Textbook: o + λd, the normal from it, and the ray from it as it is.\n\n\
             | shape | | hits | point, ulp p50 / max | bound broken | normal p50 / max | re-hits of n |\n\
             |---|---|---:|---:|---:|---:|---:|\n",
        );
        for s in self.surfaces {
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} / {} | {} | {} / {} | {} of {} |",
                s.kernel.name(),
                s.name,
                s.points.len(),
                ulps(quantile(&s.points, 0.5)),
                ulps(quantile(&s.points, 1.0)),
                s.violations.map_or("none given".to_owned(), |v| v.to_string()),
                ulps(quantile(&s.normals, 0.5)),
                ulps(quantile(&s.normals, 1.0)),
                s.rehits,
                s.spawned,
            );
        }
        out.push('\n');
    }

    /// Closed meshes, from this run: what leaks, what counts twice.
    fn sieves(&self, out: &mut String) {
        let Some(some) = self.sieves.first() else { return };
        let n: usize = some.rays.iter().sum();
        let _ = write!(
            out,
            "### Leaks and double hits\n\n\
             From this run: {n} rays from inside four closed convex meshes (a unit sphere, here and at\n\
             (148376, 1234, −223423), one of radius 1e-3 twice as far, a cube of integer squares), a third each at\n\
             {}.\n\
             Each must hit (else *leak*) and leaves through one triangle (more counted: *double*). Triangles are closed\n\
             sets, so an edge met exactly belongs to both sides of it: who counts, to tell inside from outside, asks\n\
             `triangle::crosses` as well. *Other*: hits on a triangle that exact arithmetic does not meet, or not first.\n\n\
             | | leaks: {} | double: {} | other |\n|---|{}\n",
            AIMS.join(", "),
            AIMS.join(" | "),
            AIMS.join(" | "),
            "---:|".repeat(7),
        );
        for s in self.sieves {
            let doubles = s.doubles.map_or_else(|| ["–"; 3].map(str::to_owned), |d| d.map(|n| n.to_string()));
            let others = s.others.map_or("–".to_owned(), |n| format!("{n} of {}", s.checked));
            let (leaks, bold) = (s.leaks.map(|n| n.to_string()), if s.shipped { "**" } else { "" });
            let _ = writeln!(
                out,
                "| {bold}{}{bold} | {} | {} | {others} |",
                s.name,
                leaks.join(" | "),
                doubles.join(" | "),
            );
        }
        out.push('\n');
    }

    fn details(&self, out: &mut String) {
        out.push_str(
            "## Every family\n\n\
             ns: independent rays, median [quartiles] / chained. *slow*: rays that take more than four times the kernel's\n\
             typical ordinary ray, each timed alone. It is a proxy, by time, for the share that leaves the fast path: that is\n\
             counted in test builds only, so that it costs nothing here, and `cargo test --lib ordinary_rays -- --nocapture`\n\
             prints it for ordinary rays of plane, triangle, sphere and frustum, and holds it below one in 10,000. *near 0*: of hits with\n\
             |λ| < 2⁻²⁰ s, the largest error of λ·|d| in ulps of the largest coordinate. Wrong: missed + invented, of n cases; hits by exact count.\n\n",
        );
        for (kernel, names) in self.kernels() {
            let _ = writeln!(out, "<details><summary>{}</summary>\n", kernel.name());
            for (name, origin) in names {
                let _ = writeln!(
                    out,
                    "**{} {name}**\n\n| family | n (hits) | ns | slow (proxy) | λ ulp p50 | p99 | max | near 0 | wrong | part | bound broken | bound/error p50 |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
                    kernel.name(),
                );
                for r in self.of(kernel, name) {
                    let a = &r.accuracy;
                    let bounded = origin == Origin::Shipped && kernel != Kernel::Slab;
                    let refused = if a.refused > 0 { format!(", {} refused", a.refused) } else { String::new() };
                    let t = &r.speed.throughput;
                    let _ = writeln!(
                        out,
                        "| {} {} | {} ({}{refused}) | {} [{}–{}] / {} | {:.1} % | {} | {} | {} | {} | {} + {} | {} | {} | {} |",
                        r.number,
                        r.family,
                        r.cases,
                        r.truth_hits,
                        ns(t.median),
                        ns(t.low),
                        ns(t.high),
                        ns(r.speed.latency.median),
                        100.0 * r.slow,
                        ulps(a.quantile(0.5)),
                        ulps(a.quantile(0.99)),
                        ulps(a.quantile(1.0)),
                        if a.near_zero > 0 { ulps(Some(a.coordinate_ulps)) } else { "–".to_owned() },
                        a.false_misses,
                        a.false_hits,
                        a.wrong_parts,
                        if bounded { a.violations.to_string() } else { "–".to_owned() },
                        if bounded { ulps(quantile(&a.tightness, 0.5)) } else { "–".to_owned() },
                    );
                }
                out.push('\n');
            }
            out.push_str("</details>\n\n");
        }
    }

    pub fn csv(&self) -> String {
        let mut out = String::from(
            "shape,kernel,origin,family number,family,cases,hits,refused,false misses,false hits,wrong parts,bounds broken,\
             ulp p50,ulp p99,ulp max,coordinate ulp max,bound/error p50,ns,ns low quartile,ns high quartile,ns chained,slow share\n",
        );
        for r in self.rows {
            let (a, t) = (&r.accuracy, &r.speed.throughput);
            let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.4e}"));
            let _ = writeln!(
                out,
                "{},{},{:?},{},\"{}\",{},{},{},{},{},{},{},{},{},{},{:.4e},{},{:.2},{:.2},{:.2},{:.2},{:.4}",
                r.entry.kernel.name(),
                r.entry.name,
                r.entry.origin,
                r.number,
                r.family,
                r.cases,
                r.truth_hits,
                a.refused,
                a.false_misses,
                a.false_hits,
                a.wrong_parts,
                a.violations,
                number(a.quantile(0.5)),
                number(a.quantile(0.99)),
                number(a.quantile(1.0)),
                a.coordinate_ulps,
                number(quantile(&a.tightness, 0.5)),
                t.median,
                t.low,
                t.high,
                r.speed.latency.median,
                r.slow,
            );
        }
        out
    }

    /// The ten worst cases of each of the crate's own rows, for `tests/worst_cases.rs`; of meshes, which are long, three.
    pub fn worst_cases(&self) -> String {
        let mut out =
            String::from("# Written by examples/speed_vs_error: shape, family, how far λ is off, the case.\n");
        for r in self.rows.iter().filter(|r| r.entry.origin == Origin::Shipped) {
            let kept = if r.entry.kernel == Kernel::Mesh { 3 } else { 10 };
            for (_, text) in r.accuracy.worst.iter().take(kept) {
                let _ = writeln!(out, "{} {} {text}", r.entry.kernel.name(), r.number);
            }
        }
        out
    }
}

/// What `benches/peers` found, if it has been run.
fn meshes(out: &mut String) {
    let _ = writeln!(out, "## Meshes\n");
    let Ok(csv) = std::fs::read_to_string("benches/peers/results/peers.csv") else {
        out.push_str("`benches/peers` has not been run here: its results/peers.csv is missing.\n\n");
        return;
    };
    // mesh,"engine",what,value
    let records: Vec<(&str, &str, &str, f64)> = csv
        .lines()
        .skip(1)
        .filter_map(|line| {
            let (mesh, rest) = line.split_once(",\"")?;
            let (engine, rest) = rest.split_once("\",")?;
            let (what, value) = rest.rsplit_once(',')?;
            Some((mesh, engine, what, value.parse().ok()?))
        })
        .collect();
    let mut engines: Vec<&str> = Vec::new();
    let mut meshes: Vec<&str> = Vec::new();
    for r in &records {
        if !meshes.contains(&r.0) {
            meshes.push(r.0);
        }
        if r.1 != "–" && !engines.contains(&r.1) {
            engines.push(r.1);
        }
    }
    let sum = |engine: &str, what: &dyn Fn(&str) -> bool| -> f64 {
        records.iter().filter(|r| r.1 == engine && what(r.2)).map(|r| r.3).sum()
    };
    let aimed = sum("–", &|w| w.starts_with("rays aimed"));
    let checked = sum("–", &|w| w.ends_with("checked"));
    let _ = writeln!(
        out,
        "From `benches/peers` ({}): speed as ratios to {}, geometric means over the meshes; leaks of {aimed} rays from inside\n\
         closed meshes at vertices, edges and faces; and answers that exact arithmetic contradicts among {checked} rays\n\
         (contested ones and an even sample).\n",
        meshes.join(", "),
        engines.first().unwrap_or(&"–"),
    );
    let sets = ["primary", "bounce", "random", "shadow", "bounce any", "random any"];
    let _ = writeln!(
        out,
        "| | {} | leaks: vertices | edges | faces | missed | invented | other triangle |",
        sets.join(" | ")
    );
    let _ = writeln!(out, "|---|{}", "---:|".repeat(12));
    for engine in &engines {
        let cells: Vec<String> = sets
            .iter()
            .map(|set| {
                let what = format!("{set} ratio");
                let logs: Vec<f64> =
                    records.iter().filter(|r| r.1 == *engine && r.2 == what).map(|r| r.3.ln()).collect();
                if logs.is_empty() {
                    "–".to_owned()
                } else {
                    format!("{:.2}", (logs.iter().sum::<f64>() / logs.len() as f64).exp())
                }
            })
            .collect();
        let leaks = ["vertices", "edges", "faces"].map(|k| sum(engine, &|w| w == format!("leaks at {k}")).to_string());
        let wrong = ["missed", "invented", "other triangle"].map(|k| sum(engine, &|w| w.ends_with(k)).to_string());
        let _ = writeln!(out, "| {engine} | {} | {} | {} |", cells.join(" | "), leaks.join(" | "), wrong.join(" | "));
    }
    out.push('\n');
}

fn pictures(out: &mut String) {
    out.push_str(
        "## Pictures\n\n\
         ![Speed against error](pictures/pareto.svg)\n\n\
         ![Error against distance](pictures/error-distance.svg)\n\n\
         ![Error against grazing angle](pictures/error-grazing.svg)\n\n\
         ![Error, cumulative](pictures/error-cdf.svg)\n\n\
         ![Tightness of bounds](pictures/tightness.svg)\n\n\
         ![Wrong decisions by scale and distance](pictures/wrong-by-scale.svg)\n\n\
         ![A view from far away](pictures/far-view.png)\n\n\
         Sphere, cylinder and cone of unit size through a telescope, from 1e6, 2e7 and 1e8 away: left the textbook\n\
         kernels in f64, right truehit.\n\n",
    );
}
