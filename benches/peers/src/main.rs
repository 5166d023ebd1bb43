//! truehit raced against its peers: see README.md.

mod embree;
mod engine;
mod engines;
mod mesh;
mod race;
mod rays;
mod reference;
mod table;

use embree::Embree;
use engine::Found;
use indicatif::{ProgressBar, ProgressStyle};
use lexopt::{Arg, ValueExt};
use mesh::Mesh;
use peak_alloc::PeakAlloc;
use race::Figure;
use std::path::PathBuf;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

struct Options {
    meshes: Vec<PathBuf>,
    embree: Option<PathBuf>,
    engines: Vec<String>,
    triangles: usize,
    rays: usize,
    rounds: usize,
    builds: usize,
    aimed: usize,
    sample: usize,
    out: PathBuf,
}

const USAGE: &str = "peers [OPTIONS] [MESH.obj[.zst]...]
Without meshes: a bumpy sphere, a terrain and a torus knot are generated.
  --embree PATH     Embree 4's library, or a directory that holds it; else $TRUEHIT_EMBREE, else where the loader looks
  --engine NAME     only engines whose name contains NAME (may be repeated); the first Embree stays the reference
  --triangles N     of each generated mesh [100000]
  --rays N          of each set [262144]
  --rounds N        interleaved; the median counts [7]
  --builds N        of each engine; the median counts [3]
  --aimed N         rays at vertices, edges and faces from inside closed meshes, N of each [80000]
  --sample N        rays of each set checked against exact arithmetic, beside all contested ones [64]
  --out DIR         for peers.md and peers.csv [results, beside this package's manifest]";

fn options() -> Result<Options, lexopt::Error> {
    let mut o = Options {
        meshes: Vec::new(),
        embree: std::env::var_os("TRUEHIT_EMBREE").map(Into::into),
        engines: Vec::new(),
        triangles: 100_000,
        rays: 1 << 18,
        rounds: 7,
        builds: 3,
        aimed: 80_000,
        sample: 64,
        out: PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/results")),
    };
    let mut parser = lexopt::Parser::from_env();
    while let Some(arg) = parser.next()? {
        match arg {
            Arg::Long("embree") => o.embree = Some(parser.value()?.into()),
            Arg::Long("engine") => o.engines.push(parser.value()?.string()?),
            Arg::Long("triangles") => o.triangles = parser.value()?.parse()?,
            Arg::Long("rays") => o.rays = parser.value()?.parse()?,
            Arg::Long("rounds") => o.rounds = parser.value()?.parse::<usize>()?.max(1),
            Arg::Long("builds") => o.builds = parser.value()?.parse::<usize>()?.max(1),
            Arg::Long("aimed") => o.aimed = parser.value()?.parse()?,
            Arg::Long("sample") => o.sample = parser.value()?.parse::<usize>()?.max(1),
            Arg::Long("out") => o.out = parser.value()?.into(),
            Arg::Short('h') | Arg::Long("help") => {
                println!("{USAGE}");
                std::process::exit(0);
            }
            Arg::Value(path) => o.meshes.push(path.into()),
            _ => return Err(arg.unexpected()),
        }
    }
    Ok(o)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = options().map_err(|e| format!("{e}\n{USAGE}"))?;
    // One thread for everybody.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let embree = match Embree::load(options.embree.as_deref()) {
        Ok(embree) => Some(embree),
        Err(reason) => {
            eprintln!("{}\n({reason})", embree::HOW_TO_GET);
            None
        }
    };
    let meshes: Vec<Mesh> = if options.meshes.is_empty() {
        let n = options.triangles;
        vec![Mesh::bumpy_sphere(n), Mesh::terrain(n), Mesh::knot(n)]
    } else {
        options.meshes.iter().map(|p| Mesh::load(p)).collect::<Result<_, _>>()?
    };
    let mut makers = engines::all(embree.as_ref());
    let wanted = |name: &str| options.engines.is_empty() || options.engines.iter().any(|e| name.contains(e.as_str()));
    let mut first = true;
    makers.retain(|m| std::mem::take(&mut first) && embree.is_some() || wanted(m.name));

    let mut figures = Vec::new();
    let mut notes = vec![table::machine(embree.as_ref().map(|e| e.describe()))];
    for mesh in &meshes {
        one_mesh(mesh, &makers, &options, &mut figures, &mut notes);
    }
    let names: Vec<&str> = makers.iter().map(|m| m.name).collect();
    let markdown = table::markdown(&figures, &names, &notes);
    println!("{markdown}");
    std::fs::create_dir_all(&options.out)?;
    std::fs::write(options.out.join("peers.md"), &markdown)?;
    std::fs::write(options.out.join("peers.csv"), table::csv(&figures))?;
    eprintln!("written: {}/peers.{{md,csv}}", options.out.display());
    Ok(())
}

fn one_mesh(
    mesh: &Mesh,
    makers: &[engine::Maker],
    options: &Options,
    figures: &mut Vec<Figure>,
    notes: &mut Vec<String>,
) {
    let bar = ProgressBar::new((makers.len() * (7 + options.rounds * 6)) as u64);
    let style = ProgressStyle::with_template("{prefix:>16} {bar:40} {pos}/{len} {msg} [{elapsed}]");
    bar.set_style(style.expect("template"));
    bar.set_prefix(mesh.name.clone());
    let triangles = mesh.triangles.len() as f64;
    let mut record = |engine, what: &str, value| {
        figures.push(Figure { mesh: mesh.name.clone(), engine, what: what.to_owned(), value });
    };

    let mut engines: Vec<_> = makers
        .iter()
        .map(|maker| {
            bar.set_message(format!("build {}", maker.name));
            let built = race::build(maker, mesh, options.builds);
            bar.inc(1);
            record(built.name, "build Mtri/s", triangles / built.build.as_secs_f64() / 1e6);
            record(built.name, "bytes/triangle", built.live as f64 / triangles);
            record(built.name, "peak bytes/triangle", built.peak as f64 / triangles);
            built
        })
        .collect();

    // The first hits that secondary rays start from: of an f64 engine, that all engines get the same rays.
    let tracer = makers.iter().position(|m| m.double).unwrap_or(0);
    let sets = rays::sets(mesh, engines[tracer].engine.as_mut(), options.rays, 1);
    let mut rates = Vec::new();
    for set in &sets {
        bar.set_message(set.name);
        let (times, answers) = race::run(&mut engines, set, options.rounds, &bar);
        let hits = answers.0[tracer].iter().filter(|f| f.is_hit()).count();
        rates.push(format!("{} {:.0} %", set.name, 100.0 * hits as f64 / set.rays.len() as f64));
        assert!(hits * 50 > set.rays.len(), "{}: {} rays hit next to nothing", mesh.name, set.name);
        let (wrong, checked, contested) = race::check(mesh, set, &answers, options.sample, 200);
        record("–", &format!("{} contested", set.name), contested as f64);
        record("–", &format!("{} checked", set.name), checked as f64);
        for (at, built) in engines.iter().enumerate() {
            let seconds = race::median(&mut times[at].clone()).as_secs_f64();
            record(built.name, &format!("{} Mray/s", set.name), set.rays.len() as f64 / seconds / 1e6);
            // Round by round, since a disturbance lasts longer than a round.
            let mut ratios: Vec<f64> =
                times[0].iter().zip(&times[at]).map(|(r, t)| r.as_secs_f64() / t.as_secs_f64()).collect();
            record(built.name, &format!("{} ratio", set.name), race::median(&mut ratios));
            record(built.name, &format!("{} missed", set.name), wrong[at].missed as f64);
            record(built.name, &format!("{} invented", set.name), wrong[at].invented as f64);
            record(built.name, &format!("{} other triangle", set.name), wrong[at].other as f64);
            if !set.any_hit {
                record(built.name, &format!("{} λ error", set.name), wrong[at].lambda);
            }
        }
    }
    let kind = match (mesh.closed, mesh.interior) {
        (true, _) => "closed, seen from outside",
        (false, true) => "interior",
        (false, false) => "open, seen from outside",
    };
    notes.push(format!("{}: {} triangles, {kind}; hits: {}.", mesh.name, mesh.triangles.len(), rates.join(", ")));

    if mesh.closed && options.aimed > 0 {
        for set in rays::aimed(mesh, options.aimed, 2) {
            bar.set_message(format!("aimed at {}", set.name));
            record("–", &format!("rays aimed at {}", set.name), set.rays.len() as f64);
            let mut found = vec![Found::MISS; set.rays.len()];
            let mut hit = vec![false; set.rays.len()];
            for built in &mut engines {
                built.engine.closest(&set, &mut found);
                let leaks = found.iter().filter(|f| !f.is_hit()).count();
                record(built.name, &format!("leaks at {}", set.name), leaks as f64);
                built.engine.any(&set, &mut hit);
                let leaks = hit.iter().filter(|h| !**h).count();
                record(built.name, &format!("any-hit leaks at {}", set.name), leaks as f64);
            }
        }
    }
    bar.finish_and_clear();
}
