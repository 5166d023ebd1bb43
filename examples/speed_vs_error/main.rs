//! Speed against error: every kernel, shipped and textbook, on every family of hard cases, against exact arithmetic.
//!
//! `cargo run --release --example speed_vs_error` writes docs/speed-vs-error.md, the CSV behind it and its plots, in
//! about a minute; `--full` takes forty times the cases.
#![allow(missing_docs, unreachable_pub)]

#[path = "../../tests/support/mod.rs"]
mod support;

#[path = "../../tests/meshes/mod.rs"]
mod meshes;

mod aftermath;
mod block;
mod fallbacks;
mod kernels;
mod page;
mod peers;
mod pictures;
mod plots;
mod readme;
mod rows;
mod svg;
mod sweeps;
mod table;
mod tables;
mod timing;
mod watertight;

use indicatif::{ProgressBar, ProgressStyle};
use kernels::Entry;
use rows::{Row, Sheet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use support::cases::{Family, Kernel};
use support::rng;

const USAGE: &str = "speed_vs_error [--full] [--cases N] [--rounds N] [--kernel NAME] [--out DIR]
  --full         20000 cases a family instead of 500, and finer plots; to target/speed-vs-error-full, and its CSV to
                 docs/speed-vs-error-full.csv, which the next plain run sums up
  --cases N      of each family
  --rounds N     timed passes over 2048 rays; medians and quartiles of them [9]
  --kernel NAME  only this shape's kernels (and no plots)
  --out DIR      [docs; with --full see there]";

/// What tests read of this.
const WORST_CASES: &str = "tests/worst-cases.txt";

struct Options {
    cases: usize,
    rounds: usize,
    full: bool,
    kernel: Option<String>,
    out: Option<PathBuf>,
}

fn options() -> Result<Options, lexopt::Error> {
    use lexopt::{Arg, ValueExt};
    let mut o = Options { cases: 500, rounds: 9, full: false, kernel: None, out: None };
    let mut parser = lexopt::Parser::from_env();
    while let Some(arg) = parser.next()? {
        match arg {
            Arg::Long("full") => (o.full, o.cases) = (true, 20_000),
            Arg::Long("cases") => o.cases = parser.value()?.parse::<usize>()?.max(20),
            Arg::Long("rounds") => o.rounds = parser.value()?.parse::<usize>()?.max(3),
            Arg::Long("kernel") => {
                let (name, names) = (parser.value()?.string()?, Kernel::ALL.map(Kernel::name));
                if !names.contains(&name.as_str()) {
                    return Err(format!("{name:?} is none of {}", names.join(", ")).into());
                }
                o.kernel = Some(name);
            }
            Arg::Long("out") => o.out = Some(parser.value()?.into()),
            Arg::Short('h') | Arg::Long("help") => {
                println!("{USAGE}");
                std::process::exit(0);
            }
            _ => return Err(arg.unexpected()),
        }
    }
    Ok(o)
}

/// Rays that are timed: enough that branches cannot be learnt by heart. Meshes are large.
fn timed(kernel: Kernel) -> usize {
    if kernel == Kernel::Mesh { 256 } else { 2048 }
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let (started, machine) = (std::time::Instant::now(), page::machine());
    let options = options()?;
    // Only whole runs with nothing said about where they go leave traces in the repository.
    let kept = options.out.is_none() && options.kernel.is_none();
    if kept && !Path::new(WORST_CASES).exists() {
        return Err("run this in the repository, or say where to write: --out DIR".into());
    }
    let out = options.out.clone().unwrap_or_else(|| match (options.kernel.is_none(), options.full) {
        (true, false) => "docs".into(),
        (true, true) => "target/speed-vs-error-full".into(),
        (false, _) => "target/speed-vs-error".into(),
    });
    let entries = table::all();
    let wanted = |kernel: Kernel| options.kernel.as_ref().is_none_or(|k| k == kernel.name());
    let families: Vec<_> = support::families::all().into_iter().filter(|f| wanted(f.kernel)).collect();

    let bar = ProgressBar::new(2 * families.len() as u64 + 9);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg} [{elapsed}, {eta} left]")?);
    let mut rows = answers(&families, &entries, options.cases, &bar);
    times(&mut rows, &families, options.rounds, &bar);

    bar.set_message("fallbacks on ordinary rays");
    let ordinary: Vec<_> = families
        .iter()
        .filter(|f| f.number == 0)
        .map(|f| fallbacks::of(f, &entries, if options.full { 1_000_000 } else { 100_000 }))
        .collect();
    bar.inc(1);

    bar.set_message("closed meshes");
    let sieves = if wanted(Kernel::Mesh) { watertight::all(options.cases) } else { Vec::new() };
    bar.inc(1);

    std::fs::create_dir_all(out.join("pictures"))?;
    if options.kernel.is_none() {
        let n = if options.full { 200 } else { 24 };
        let save = |name: &str, make: &dyn Fn() -> String| {
            bar.set_message(name.to_owned());
            let written = std::fs::write(out.join("pictures").join(name), make());
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
        save("wrong-by-scale.svg", &|| plots::heat(&entries, n))?;
        bar.set_message("far-view.png");
        pictures::far_view(&out.join("pictures/far-view.png"))?;
        bar.inc(1);
    }
    bar.finish_and_clear();

    let page = page::Page {
        rows: &rows,
        ordinary: &ordinary,
        sieves: &sieves,
        cases: options.cases,
        full: options.full,
        machine,
        took: started.elapsed(),
    };
    let csv = tables::csv(&page.provenance(), &rows);
    if kept && options.full {
        std::fs::write(page::FULL_CSV, &csv)?;
    }
    if kept && !options.full {
        std::fs::write(WORST_CASES, tables::worst_cases(&rows))?;
        readme::update(&page)?;
    }
    std::fs::write(out.join("speed-vs-error.csv"), csv)?;
    std::fs::write(out.join("speed-vs-error.md"), page.markdown())?;
    summary(&rows, &sieves);
    println!("written: {0}/speed-vs-error.md, {0}/speed-vs-error.csv, {0}/pictures/", out.display());
    Ok(())
}

/// Every kernel on every family but for its speed, in the families' order; on all cores, since nothing is timed.
fn answers(families: &[Family], entries: &[Entry], cases: usize, bar: &ProgressBar) -> Vec<Row> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some((i, family)) =
            Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|i| Some((i, families.get(i)?)))
        {
            bar.set_message(format!("{} {} {}", family.kernel.name(), family.number, family.name));
            let sheet = Sheet::new(family, cases);
            let of = |e: &Entry| Row::new(e, family, &sheet, cases.div_ceil(4).min(1000));
            let rows: Vec<Row> = entries.iter().filter(|e| e.kernel == family.kernel).map(of).collect();
            done.lock().expect("no panic").push((i, rows));
            bar.inc(1);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().expect("no panic");
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().flat_map(|(_, rows)| rows).collect()
}

/// Adds the speed, one family after the other, its kernels in turns.
fn times(rows: &mut [Row], families: &[Family], rounds: usize, bar: &ProgressBar) {
    for family in families {
        bar.set_message(format!("{} {} {}: time", family.kernel.name(), family.number, family.name));
        let cases = rows::cases(family, timed(family.kernel));
        let mut own: Vec<&mut Row> =
            rows.iter_mut().filter(|r| r.entry.kernel == family.kernel && r.number == family.number).collect();
        let entries: Vec<Entry> = own.iter().map(|r| r.entry).collect();
        let runners: Vec<_> = entries.iter().map(|e| (e, e.prepare(&cases))).collect();
        for (row, speed) in own.iter_mut().zip(timing::race(&runners, rounds)) {
            row.speed = speed;
        }
        bar.inc(1);
    }
}

fn summary(rows: &[Row], sieves: &[watertight::Sieve]) {
    let shipped: Vec<&Row> = rows.iter().filter(|r| r.is_shipped()).collect();
    let broken: Vec<_> = shipped.iter().map(|r| (r, r.shortcomings())).filter(|(_, s)| !s.is_empty()).collect();
    println!(
        "{} rows, {} of them truehit's, of which {} break their contract",
        rows.len(),
        shipped.len(),
        broken.len()
    );
    for (row, shortcomings) in broken {
        println!("  {} {} {}: {}", row.entry.kernel.name(), row.number, row.family, shortcomings.join(", "));
    }
    for s in sieves.iter().filter(|s| s.shipped && !s.is_tight()) {
        println!("  {} is not tight: {:?} leaks, {:?} on other triangles", s.name, s.leaks, s.others);
    }
}
