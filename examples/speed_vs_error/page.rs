//! The page.

use crate::aftermath::Aftermath;
use crate::fallbacks::Fallbacks;
use crate::kernels::Origin;
use crate::peers;
use crate::rows::{BINS, Row, has_parts_of, histogram, per_million, quantile};
use crate::support::cases::Kernel;
use crate::tables::{self, cell};
use crate::watertight::{AIMS, Sieve};
use std::fmt::Write;

/// Where the long run leaves its figures for this page.
pub const FULL_CSV: &str = "docs/speed-vs-error-full.csv";

pub struct Page<'a> {
    pub rows: &'a [Row],
    pub ordinary: &'a [Fallbacks],
    pub sieves: &'a [Sieve],
    pub cases: usize,
    pub full: bool,
    pub machine: String,
    pub took: std::time::Duration,
}

pub fn ulps(x: Option<f64>) -> String {
    match x {
        None => "–".to_owned(),
        Some(x) if x.is_infinite() => "∞".to_owned(),
        Some(x) if x >= 1000.0 => format!("{x:.0e}"),
        Some(x) if x >= 10.0 => format!("{x:.0}"),
        Some(x) => format!("{x:.2}"),
    }
}

pub fn ns(x: f64) -> String {
    if x >= 100.0 { format!("{x:.0}") } else { format!("{x:.1}") }
}

fn command(program: &str, arguments: &[&str]) -> String {
    let output = std::process::Command::new(program).args(arguments).output();
    output
        .ok()
        .and_then(|o| String::from_utf8(o.stdout).ok())
        .map_or_else(|| "unknown".to_owned(), |s| s.trim().to_owned())
}

/// The machine, the compiler, the commit: asked for before pictures are written over.
pub fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": ")).map_or("unknown CPU", |m| m.1);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let flags = std::env::var("RUSTFLAGS").unwrap_or_default();
    let flags = if flags.is_empty() { "default flags (no target-cpu)".to_owned() } else { flags };
    let level = format!("{:?}", fearless_simd::Level::new());
    format!(
        "{cpu}, {threads} hardware threads, times on one; {}; {flags}, profile release; SIMD level detected: {}; truehit {}",
        command("rustc", &["-V"]),
        level.split('(').next().unwrap_or_default(),
        command("git", &["describe", "--always", "--dirty"]),
    )
}

/// All families of one kernel, summed.
pub struct Sum {
    pub cases: usize,
    pub truth_hits: usize,
    pub wrong: usize,
    pub edges: usize,
    pub parts: usize,
    pub hits: usize,
    pub violations: usize,
    pub refined: usize,
    pub ulps: Vec<f64>,
    pub ordinary: Option<(f64, f64)>,
    pub hard: f64,
}

impl Page<'_> {
    fn of<'a>(&'a self, kernel: Kernel, name: &'a str) -> impl Iterator<Item = &'a Row> + Clone {
        self.rows.iter().filter(move |r| r.entry.kernel == kernel && r.entry.name == name)
    }

    fn shipped(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|r| r.is_shipped())
    }

    /// The textbook's kernels on the same family.
    fn textbook(&self, row: &Row) -> impl Iterator<Item = &Row> {
        let (kernel, number) = (row.entry.kernel, row.number);
        self.rows.iter().filter(move |r| r.entry.kernel == kernel && r.number == number && !r.is_shipped())
    }

    pub fn sum(&self, kernel: Kernel, name: &str) -> Sum {
        let rows = || self.of(kernel, name);
        let mut all: Vec<f64> = rows().flat_map(|r| r.accuracy.ulps.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        let mut times: Vec<f64> = rows().map(|r| r.speed.throughput.median).collect();
        times.sort_by(f64::total_cmp);
        Sum {
            cases: rows().map(|r| r.accuracy.answered).sum(),
            truth_hits: rows().map(|r| r.truth_hits).sum(),
            wrong: rows().map(|r| r.accuracy.wrong()).sum(),
            edges: rows().map(|r| r.accuracy.edges).sum(),
            parts: rows().map(|r| r.accuracy.wrong_parts).sum(),
            hits: rows().map(|r| r.accuracy.hits).sum(),
            violations: rows().map(|r| r.accuracy.violations).sum(),
            refined: rows().map(|r| r.accuracy.refined).sum(),
            ulps: all,
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

    /// What a figure means nothing without.
    pub fn provenance(&self) -> String {
        format!(
            "{} cases a family, seeds of tests/support; {}; took {} min {} s",
            self.cases,
            self.machine,
            self.took.as_secs() / 60,
            self.took.as_secs() % 60
        )
    }

    pub fn markdown(&self) -> String {
        let mut out = String::new();
        self.head(&mut out);
        self.summary(&mut out);
        pictures(&mut out);
        self.losses(&mut out);
        self.fallbacks(&mut out);
        self.histograms(&mut out);
        self.aftermath(&mut out);
        peers::section(&mut out);
        self.sieves(&mut out);
        if !self.full {
            long_run(&mut out);
        }
        tables::details(&mut out, self.rows, &self.kernels());
        out
    }

    fn head(&self, out: &mut String) {
        let _ = write!(
            out,
            "# Speed against error\n\n\
             Generated by `cargo run --release --example speed_vs_error{}`; do not edit. Seeds are fixed in `tests/support`: the\n\
             counts below come out the same on every machine, the times do not. {}.\n\n\
             Truth is exact: the inputs are floats, so every sign is decided in big integers and every λ is enclosed to 250\n\
             bits (docs/numerics.md §12). Shipped and textbook kernels run through one table of function pointers over the\n\
             same cases. An ulp is one of f64 at max(|λ|, 2⁻⁴⁰ s), s the largest coordinate over |d|; f32 kernels get their\n\
             input rounded to f32 and are measured with the same ruler. A count of zero in n cases is given as `0 (< 3/n)`,\n\
             its bound with 95 % confidence.\n\n",
            if self.full { " -- --full" } else { "" },
            self.provenance(),
        );
    }

    fn summary(&self, out: &mut String) {
        out.push_str(
            "## In short\n\n\
             *ordinary*: ns a ray on ordinary rays, independent / each waiting for the last. *hard*: the median family's\n\
             ns. Errors and counts over all families, most of them hard; ppm: per million.\n\n\
             | kernel | | n (hits) | ordinary, ns | hard, ns | λ ulp p99 | max | wrong hit or miss, ppm | wrong part, ppm | bound broken, ppm | fast path left, ppm |\n\
             |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        );
        for (kernel, names) in self.kernels() {
            for (name, origin) in names {
                let s = self.sum(kernel, name);
                let ordinary = s.ordinary.map_or("–".to_owned(), |(t, l)| format!("{} / {}", ns(t), ns(l)));
                let shipped = origin == Origin::Shipped;
                let bound = match kernel {
                    Kernel::Slab => "none given".to_owned(),
                    _ if shipped => per_million(s.violations, s.hits),
                    _ => "none given".to_owned(),
                };
                let bold = if shipped { "**" } else { "" };
                let edges = if s.edges > 0 { "¹" } else { "" };
                let _ = writeln!(
                    out,
                    "| {} | {bold}{name}{bold} | {} ({}) | {ordinary} | {} | {} | {} | {}{edges} | {} | {bound} | {} |",
                    kernel.name(),
                    s.cases,
                    s.truth_hits,
                    ns(s.hard),
                    ulps(quantile(&s.ulps, 0.99)),
                    ulps(s.ulps.last().copied()),
                    per_million(s.wrong, s.cases),
                    if has_parts_of(kernel) { per_million(s.parts, s.hits) } else { "–".to_owned() },
                    if shipped { per_million(s.refined, s.cases) } else { "–".to_owned() },
                );
            }
        }
        let (differ, exact): (Vec<usize>, Vec<usize>) =
            self.shipped().map(|r| (r.accuracy.wrong(), r.accuracy.edges)).filter(|(_, edges)| *edges > 0).unzip();
        if !differ.is_empty() {
            let _ = write!(
                out,
                "\n¹ Against the exact image of the ray. An affine shape decides, exactly, for that image with each component\n\
                 rounded once (`Affine::object_ray`): {} of these {} decisions are right for it, and how far it is from the\n\
                 exact image is checked in each. See *Where truehit loses*.\n",
                exact.iter().sum::<usize>(),
                differ.iter().sum::<usize>(),
            );
        }
        out.push('\n');
    }

    /// Where the crate's kernels are not the fastest, or not as good as promised.
    fn losses(&self, out: &mut String) {
        out.push_str("## Where truehit loses\n\n");
        let broken: Vec<_> = self.shipped().map(|r| (r, r.shortcomings())).filter(|(_, s)| !s.is_empty()).collect();
        if broken.is_empty() {
            out.push_str(
                "No row breaks its contract: no wrong decision, no wrong part, no broken bound on λ or a point, λ within its\n\
                 ulps (1 for plane and sphere, 4 for the others; the bound alone where a ray grazes an affine shape or starts on\n\
                 it), no ray that leaves a surface and meets it again.\n\n",
            );
        } else {
            out.push_str("Rows that break their contract:\n\n| kernel | family | |\n|---|---|---|\n");
            for (r, shortcomings) in &broken {
                let shortcomings = shortcomings.join(", ");
                let _ =
                    writeln!(out, "| {} | {} {} | {shortcomings} |", r.entry.kernel.name(), r.number, cell(r.family));
            }
            out.push('\n');
        }
        for r in self.shipped().filter(|r| r.accuracy.edges > 0) {
            let a = &r.accuracy;
            let _ = write!(
                out,
                "Not the exact image's decision, though the rounded one's, as promised: {} {} {}, {} of {} rays (missed {},\n\
                 invented {}).\n\n",
                r.entry.kernel.name(),
                r.number,
                r.family,
                a.edges,
                a.answered,
                a.false_misses,
                a.false_hits,
            );
        }
        self.neither(out);
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
                cell(row.family),
                quantile(&right, 0.5).map_or("–".to_owned(), |x| format!("{x:.2}")),
                all.len(),
            );
        }
        out.push('\n');
    }
    /// Rows in which somebody is faster and truehit is not exact.
    fn neither(&self, out: &mut String) {
        let rows: Vec<_> = self
            .shipped()
            .filter_map(|r| {
                let time = |r: &&Row| r.speed.throughput.median;
                let fastest = self.textbook(r).min_by(|a, b| time(a).total_cmp(&time(b)))?;
                (time(&fastest) < time(&r) && !r.accuracy.is_exact()).then_some((r, fastest))
            })
            .collect();
        if rows.is_empty() {
            out.push_str(
                "In every row truehit is the fastest or exact: all decided rightly, each λ the nearest float.\n\n",
            );
            return;
        }
        let _ = write!(
            out,
            "Neither the fastest nor exact (all decided rightly, each λ the nearest float): {} of {} rows. A box is passed\n\
             through: its decision is exact, its λ are rounded quotients. Under a map λ is corrected, then rounded again.\n\n\
             | kernel | family | ns | largest λ error, ulp | wrong | fastest | its ns | its λ error | wrong |\n\
             |---|---|---:|---:|---:|---|---:|---:|---:|\n",
            rows.len(),
            self.shipped().count(),
        );
        for (r, fastest) in rows {
            let figures = |r: &Row| {
                let a = &r.accuracy;
                (ns(r.speed.throughput.median), ulps(a.max()), a.wrong() + a.wrong_parts)
            };
            let (own, other) = (figures(r), figures(fastest));
            let _ = writeln!(
                out,
                "| {} | {} {} | {} | {} | {} | {} | {} | {} | {} |",
                r.entry.kernel.name(),
                r.number,
                cell(r.family),
                own.0,
                own.1,
                own.2,
                fastest.entry.name,
                other.0,
                other.1,
                other.2,
            );
        }
        out.push('\n');
    }

    fn fallbacks(&self, out: &mut String) {
        out.push_str(
            "## How often a fast path does not do\n\n\
             Of ordinary rays, counted by the kernels themselves: *refined* left a fast path, *exact* went on in integers, since\n\
             double-double could not settle them either. By family: below.\n\n\
             | kernel | rays | hits | refined | ppm | exact | ppm |\n|---|---:|---:|---:|---:|---:|---:|\n",
        );
        for f in self.ordinary {
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} | {} | {} |",
                f.kernel.name(),
                f.rays,
                f.hits,
                f.refined,
                per_million(f.refined, f.rays),
                f.exact,
                per_million(f.exact, f.rays),
            );
        }
        out.push('\n');
    }

    fn histograms(&self, out: &mut String) {
        let mut head = String::from("| kernel | | hits | λ exact |");
        for pair in BINS.windows(2) {
            let _ = write!(
                head,
                " ≤ {} |",
                if pair[1] < 1000.0 { pair[1].to_string() } else { format!("{:.0e}", pair[1]) }
            );
        }
        let _ = write!(
            out,
            "## λ error, by size\n\n\
             Hits of all families by |λ − exact λ| in ulps; each column without what is in those before it.\n\n\
             {head} more |\n|---|---|{}\n",
            "---:|".repeat(BINS.len() + 2)
        );
        for (kernel, names) in self.kernels() {
            for (name, origin) in names {
                let ulps = self.sum(kernel, name).ulps;
                let counts = histogram(&ulps).map(|c| c.to_string());
                let bold = if origin == Origin::Shipped { "**" } else { "" };
                let _ = writeln!(
                    out,
                    "| {} | {bold}{name}{bold} | {} | {} |",
                    kernel.name(),
                    ulps.len(),
                    counts.join(" | ")
                );
            }
        }
        out.push('\n');
    }

    fn aftermath(&self, out: &mut String) {
        out.push_str(
            "## Points, normals, spawned rays\n\n\
             At exact hits, in a quarter of the cases of all families of a shape. *point*: distance of the point given from the\n\
             surface, in ulps of the largest coordinate of point and shape. *normal*: angle to the exact normal at the exact hit,\n\
             in units of 2⁻⁵³ rad. *re-hits*: rays that leave the point outward and meet the same shape again (of a mesh, the\n\
             same triangle), which is wrong. Affine shapes are those that their stored maps define. Cones' walls within 1e-9 of\n\
             an apex, where normals have no direction, are left out. A box is made a solid of its kernel's crossings, as a user would\n\
             (examples/speed_vs_error/block.rs), and counts where it is entered; at an edge either normal is right.\n\
             Textbook: o + λd, the normal there, the ray from there as it is, all in the kernel's precision.\n\n\
             | shape | | hits | point, ulp p50 / max | bound broken | normal p50 / max | re-hits | ppm |\n\
             |---|---|---:|---:|---:|---:|---:|---:|\n",
        );
        for (kernel, names) in self.kernels() {
            for (name, origin) in names {
                let mut f = Aftermath::default();
                self.of(kernel, name).for_each(|r| f.merge(&r.aftermath));
                let shipped = origin == Origin::Shipped;
                let bold = if shipped { "**" } else { "" };
                let _ = writeln!(
                    out,
                    "| {} | {bold}{name}{bold} | {} | {} / {} | {} | {} / {} | {} of {} | {} |",
                    kernel.name(),
                    f.points.len(),
                    ulps(quantile(&f.points, 0.5)),
                    ulps(f.points.last().copied()),
                    if shipped { f.violations.to_string() } else { "none given".to_owned() },
                    ulps(quantile(&f.normals, 0.5)),
                    ulps(f.normals.last().copied()),
                    f.rehits,
                    f.spawned,
                    per_million(f.rehits, f.spawned),
                );
            }
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
}

/// What `--full` has found, from the CSV that it left.
fn long_run(out: &mut String) {
    let Ok(csv) = std::fs::read_to_string(FULL_CSV) else { return };
    let mut lines = csv.lines();
    let provenance = lines.next().unwrap_or_default().trim_start_matches("# ");
    let header = lines.next().unwrap_or_default();
    if !header.starts_with(tables::COLUMNS) {
        let _ = writeln!(out, "## The long run\n\n{FULL_CSV} is of another version of this report.\n");
        return;
    }
    // Names of families are in quotes and may hold commas.
    let records: Vec<Vec<&str>> = lines
        .filter_map(|line| {
            let (before, rest) = line.split_once('"')?;
            let (_, after) = rest.split_once("\",")?;
            Some(before.trim_end_matches(',').split(',').chain(["family"]).chain(after.split(',')).collect())
        })
        .collect();
    let names: Vec<&str> = header.split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name);
    let number = |r: &[&str], name: &str| column(name).and_then(|c| r.get(c)?.parse::<f64>().ok());
    let _ = write!(
        out,
        "## The long run\n\n\
         `cargo run --release --example speed_vs_error -- --full`, by its CSV (speed-vs-error-full.csv): {provenance}.\n\n\
         | kernel | | cases | hits | wrong hit or miss | exact for the rounded ray | wrong part | bound broken | λ ulp max | refined | exact | re-hits of n |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n"
    );
    let mut kernels: Vec<[&str; 3]> = records.iter().map(|r| [r[0], r[1], r[2]]).collect();
    kernels.dedup();
    let mut seen = Vec::new();
    kernels.retain(|k| !seen.contains(k) && (seen.push(*k), k[2] != "TextbookF32").1);
    for [shape, kernel, origin] in kernels {
        let rows = || records.iter().filter(|r| r[0] == shape && r[1] == kernel);
        let sum = |name: &str| rows().filter_map(|r| number(r, name)).sum::<f64>() as u64;
        let most = rows().filter_map(|r| number(r, "ulp max")).reduce(f64::max);
        let shipped = origin == "Shipped";
        let own = |name: &str| if shipped { sum(name).to_string() } else { "–".to_owned() };
        let bold = if shipped { "**" } else { "" };
        let _ = writeln!(
            out,
            "| {shape} | {bold}{kernel}{bold} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} of {} |",
            sum("answered"),
            sum("right hits"),
            sum("false misses") + sum("false hits"),
            own("exact for the rounded ray"),
            sum("wrong parts"),
            own("bounds broken"),
            ulps(most),
            own("refined"),
            own("exact"),
            sum("re-hits"),
            sum("spawned"),
        );
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
