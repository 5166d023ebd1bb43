//! Speed against error: every kernel, shipped and textbook, on every family of hard cases, against exact arithmetic.
//!
//! `cargo run --release --example speed_vs_error` writes docs/speed-vs-error.md, the CSV behind it and its plots, in
//! under two minutes; `--full` takes forty times the cases.
#![allow(missing_docs, unreachable_pub)]

#[path = "../../tests/support/mod.rs"]
mod support;

#[path = "../../tests/meshes/mod.rs"]
mod meshes;

mod kernels;
mod page;
mod pictures;
mod plots;
mod rows;
mod surfaces;
mod svg;
mod sweeps;
mod table;
mod timing;
mod watertight;

use indicatif::{ProgressBar, ProgressStyle};
use kernels::Origin;
use rows::{Accuracy, Row, Sheet};
use std::path::PathBuf;
use support::cases::Kernel;
use support::rng;

const USAGE: &str = "speed_vs_error [--full] [--cases N] [--rounds N] [--kernel NAME] [--out DIR]
  --full         20000 cases a family instead of 500, and finer plots
  --cases N      of each family
  --rounds N     timed passes; medians and quartiles of them [9]
  --kernel NAME  only this shape's kernels (and no plots)
  --out DIR      [docs]";

struct Options {
    cases: usize,
    rounds: usize,
    full: bool,
    kernel: Option<String>,
    out: PathBuf,
}

fn options() -> Result<Options, lexopt::Error> {
    use lexopt::{Arg, ValueExt};
    let mut o = Options { cases: 500, rounds: 9, full: false, kernel: None, out: PathBuf::from("docs") };
    let mut parser = lexopt::Parser::from_env();
    while let Some(arg) = parser.next()? {
        match arg {
            Arg::Long("full") => (o.full, o.cases) = (true, 20_000),
            Arg::Long("cases") => o.cases = parser.value()?.parse::<usize>()?.max(20),
            Arg::Long("rounds") => o.rounds = parser.value()?.parse::<usize>()?.max(3),
            Arg::Long("kernel") => o.kernel = Some(parser.value()?.string()?),
            Arg::Long("out") => o.out = parser.value()?.into(),
            Arg::Short('h') | Arg::Long("help") => {
                println!("{USAGE}");
                std::process::exit(0);
            }
            _ => return Err(arg.unexpected()),
        }
    }
    Ok(o)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = options().map_err(|e| format!("{e}\n{USAGE}"))?;
    let entries = table::all();
    let wanted = |kernel: Kernel| options.kernel.as_ref().is_none_or(|k| k == kernel.name());
    let families: Vec<_> = support::families::all().into_iter().filter(|f| wanted(f.kernel)).collect();

    let bar = ProgressBar::new(families.len() as u64 + 9);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg} [{elapsed}]")?);
    let mut rows = Vec::new();
    for family in &families {
        bar.set_message(format!("{} {} {}", family.kernel.name(), family.number, family.name));
        let sheet = Sheet::new(family, options.cases);
        for entry in entries.iter().filter(|e| e.kernel == family.kernel) {
            rows.push(Row {
                entry: *entry,
                number: family.number,
                family: family.name,
                cases: sheet.cases.len(),
                truth_hits: sheet.hits(),
                accuracy: Accuracy::of(entry, &sheet),
                speed: timing::speed(entry, &entry.prepare(&sheet.cases), options.rounds),
                slow: 0.0,
            });
        }
        bar.inc(1);
    }
    mark_slow(&mut rows);

    bar.set_message("points, normals, spawned rays");
    let surfaces = surfaces::all(options.cases, &wanted);
    bar.inc(1);

    bar.set_message("closed meshes");
    let sieves = if wanted(Kernel::Mesh) { watertight::all(options.cases) } else { Vec::new() };
    bar.inc(1);

    std::fs::create_dir_all(options.out.join("pictures"))?;
    if options.kernel.is_none() {
        let n = if options.full { 200 } else { 24 };
        let save = |name: &str, make: &dyn Fn() -> String| {
            bar.set_message(name.to_owned());
            let written = std::fs::write(options.out.join("pictures").join(name), make());
            bar.inc(1);
            written
        };
        // No textbook kernel for meshes to compare with; and no bound on a box.
        let shown: Vec<Kernel> = Kernel::ALL.into_iter().filter(|k| *k != Kernel::Mesh).collect();
        let bounded: Vec<Kernel> = Kernel::ALL.into_iter().filter(|k| *k != Kernel::Slab).collect();
        save("pareto.svg", &|| plots::pareto(&rows, &shown))?;
        save("error-distance.svg", &|| plots::distance(&entries, n))?;
        save("error-grazing.svg", &|| plots::grazing(&entries, n))?;
        save("error-cdf.svg", &|| plots::cdf(&rows, &shown))?;
        save("tightness.svg", &|| plots::tightness(&rows, &bounded))?;
        save("wrong-by-scale.svg", &|| plots::heat(&entries, n / 2))?;
        bar.set_message("far-view.png");
        pictures::far_view(&options.out.join("pictures/far-view.png"))?;
        bar.inc(1);
    }
    bar.finish_and_clear();

    let page =
        page::Page { rows: &rows, surfaces: &surfaces, sieves: &sieves, cases: options.cases, full: options.full };
    std::fs::write(options.out.join("speed-vs-error.md"), page.markdown())?;
    std::fs::write(options.out.join("speed-vs-error.csv"), page.csv())?;
    if options.kernel.is_none() {
        std::fs::write("tests/worst-cases.txt", page.worst_cases())?;
    }
    let broken: Vec<&Row> =
        rows.iter().filter(|r| r.entry.origin == Origin::Shipped && page::breaks_contract(r)).collect();
    println!(
        "{} rows, {} of them truehit's, of which {} break their contract",
        rows.len(),
        rows.iter().filter(|r| r.entry.origin == Origin::Shipped).count(),
        broken.len()
    );
    for row in broken {
        println!("  {} {} {}: {}", row.entry.kernel.name(), row.number, row.family, page::shortcoming(row));
    }
    for s in sieves.iter().filter(|s| s.shipped && !s.is_tight()) {
        println!("  {} is not tight: {:?} leaks, {:?} on other triangles", s.name, s.leaks, s.others);
    }
    println!("written: {0}/speed-vs-error.md, {0}/speed-vs-error.csv, {0}/pictures/", options.out.display());
    Ok(())
}

/// A ray is slow that takes more than four times the kernel's typical ordinary ray.
fn mark_slow(rows: &mut [Row]) {
    let typical: Vec<(Kernel, &str, f64)> =
        rows.iter().filter(|r| r.number == 0).map(|r| (r.entry.kernel, r.entry.name, r.speed.typical())).collect();
    for row in rows {
        let of = typical.iter().find(|t| (t.0, t.1) == (row.entry.kernel, row.entry.name));
        // Kernels without ordinary rays of their own (mesh, affine) are held against their own typical ray.
        let limit = 4.0 * of.map_or_else(|| row.speed.typical(), |t| t.2);
        row.slow = row.speed.slower_than(limit);
    }
}
