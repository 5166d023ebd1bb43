//! One mesh: build every engine, run every ray set in interleaved rounds, check every answer that is contested.

use crate::engine::{Built, Found, Maker, RaySet};
use crate::mesh::Mesh;
use crate::reference;
use cpu_time::{ProcessTime, ThreadTime};
use indicatif::ProgressBar;
use std::collections::HashMap;
use std::time::Duration;

/// One figure: of an engine on a mesh.
pub struct Figure {
    pub mesh: String,
    pub engine: &'static str,
    /// Such as "primary Mray/s".
    pub what: String,
    pub value: f64,
}

/// Builds the engine `times` times; CPU time of the whole process, all of whose work is one thread's.
pub fn build(maker: &Maker, mesh: &Mesh, times: usize) -> Built {
    let mut spent = Vec::new();
    loop {
        crate::ALLOCATOR.reset_peak_usage();
        let before = crate::ALLOCATOR.current_usage();
        let start = ProcessTime::now();
        let engine = (maker.make)(mesh);
        spent.push(start.elapsed());
        if spent.len() == times {
            let (live, peak) = engine.foreign_bytes();
            let live = live + crate::ALLOCATOR.current_usage().saturating_sub(before);
            let peak = peak + crate::ALLOCATOR.peak_usage().saturating_sub(before);
            return Built { name: maker.name, engine, build: median(&mut spent), live, peak };
        }
    }
}

pub fn median<T: PartialOrd + Copy>(values: &mut [T]) -> T {
    values.sort_by(|a, b| a.partial_cmp(b).expect("ordered"));
    values[values.len() / 2]
}

/// What the engines answered to a set: triangles and λ, or for any-hit sets a triangle of 0 for every hit.
pub struct Answers(pub Vec<Vec<Found>>);

/// The CPU time of each engine in each round, and the answers. Each round starts with another engine.
pub fn run(engines: &mut [Built], set: &RaySet, rounds: usize, bar: &ProgressBar) -> (Vec<Vec<Duration>>, Answers) {
    let n = set.rays.len();
    let mut times = vec![Vec::new(); engines.len()];
    let mut answers = Vec::new();
    let (mut found, mut hit) = (vec![Found::MISS; n], vec![false; n]);
    // The first round warms the caches up and keeps the answers.
    for round in 0..=rounds {
        for turn in 0..engines.len() {
            let at = if round == 0 { turn } else { (turn + round) % engines.len() };
            let start = ThreadTime::now();
            if set.any_hit {
                engines[at].engine.any(set, &mut hit);
            } else {
                engines[at].engine.closest(set, &mut found);
            }
            let spent = start.elapsed();
            if round > 0 {
                times[at].push(spent);
            } else if set.any_hit {
                let as_found = |&h: &bool| if h { Found { triangle: 0, lambda: 0.0 } } else { Found::MISS };
                answers.push(hit.iter().map(as_found).collect());
            } else {
                answers.push(found.clone());
            }
            bar.inc(1);
        }
    }
    (times, Answers(answers))
}

/// Answers that are wrong, of `checked`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wrong {
    pub missed: usize,
    pub invented: usize,
    /// Hits on a triangle that is not the nearest. On edges any of the triangles that meet there will do.
    pub other: usize,
    /// The largest relative error of λ where the triangle is right.
    pub lambda: f64,
}

/// Checks `sample` rays in even steps against the exact answer, and of the rest those on which the engines differ in
/// hit or miss, up to `contested`. Returns what each engine got wrong, and how many were checked and contested.
pub fn check(
    mesh: &Mesh,
    set: &RaySet,
    answers: &Answers,
    sample: usize,
    contested_limit: usize,
) -> (Vec<Wrong>, usize, usize) {
    let n = set.rays.len();
    let contested: Vec<usize> =
        (0..n).filter(|&i| answers.0.iter().any(|a| a[i].is_hit() != answers.0[0][i].is_hit())).collect();
    let step = contested.len().div_ceil(contested_limit).max(1);
    let mut checked: Vec<usize> = contested.iter().copied().step_by(step).collect();
    checked.extend((0..n).step_by((n / sample).max(1)));
    checked.sort_unstable();
    checked.dedup();
    let truths: HashMap<usize, _> = checked.iter().map(|&i| (i, reference::trace(mesh, &set.rays[i]))).collect();
    let judge = |answers: &Vec<Found>| {
        let mut wrong = Wrong::default();
        for (&i, truth) in &truths {
            let answer = answers[i];
            match (truth.nearest.is_hit(), answer.is_hit()) {
                (true, false) => wrong.missed += 1,
                (false, true) => wrong.invented += 1,
                (true, true) if !set.any_hit => {
                    if truth.ties.contains(&answer.triangle) {
                        let exact = truth.nearest.lambda;
                        wrong.lambda = wrong.lambda.max(((answer.lambda - exact) / exact).abs());
                    } else {
                        wrong.other += 1;
                    }
                }
                _ => {}
            }
        }
        wrong
    };
    (answers.0.iter().map(judge).collect(), checked.len(), contested.len())
}
