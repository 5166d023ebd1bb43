//! Nanoseconds a ray.

use crate::kernels::{Answer, Entry, Prepared, Timer};
use std::hint::black_box;
use std::time::Instant;

/// Medians with the quartiles around them, in ns a ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    pub low: f64,
    pub median: f64,
    pub high: f64,
}

impl Spread {
    fn of(mut samples: Vec<f64>) -> Self {
        samples.sort_by(f64::total_cmp);
        let at = |q: f64| samples[((samples.len() - 1) as f64 * q).round() as usize];
        Self { low: at(0.25), median: at(0.5), high: at(0.75) }
    }
}

/// What is known of a kernel's speed on a family.
#[derive(Clone, Debug, Default)]
pub struct Speed {
    /// Independent rays, one after the other.
    pub throughput: Spread,
    /// Each ray waits for the answer to the one before.
    pub latency: Spread,
    /// Each ray alone, least of some repetitions.
    pub single: Vec<f64>,
}

impl Speed {
    /// The share of rays that take more than `limit` ns: how a refined ray shows from outside, at no cost inside.
    pub fn slower_than(&self, limit: f64) -> f64 {
        self.single.iter().filter(|&&t| t > limit).count() as f64 / self.single.len().max(1) as f64
    }

    pub fn typical(&self) -> f64 {
        Spread::of(self.single.clone()).median
    }
}

struct Pass {
    linked: bool,
}

impl Timer<f64> for Pass {
    fn time(self, count: usize, mut call: impl FnMut(usize, u64) -> Answer) -> f64 {
        let mask = black_box(0u64);
        let mut link = 0;
        let start = Instant::now();
        for i in 0..count {
            let answer = black_box(call(i, link & mask));
            if self.linked {
                link = answer.map_or(0, |hit| hit.lambda.to_bits());
            }
        }
        start.elapsed().as_nanos() as f64 / count as f64
    }
}

struct Singles;

impl Timer<Vec<f64>> for Singles {
    fn time(self, count: usize, mut call: impl FnMut(usize, u64) -> Answer) -> Vec<f64> {
        const REPEATED: u32 = 12;
        let one = |i| {
            let run = |call: &mut dyn FnMut(usize, u64) -> Answer| {
                let start = Instant::now();
                for _ in 0..REPEATED {
                    black_box(call(i, 0));
                }
                start.elapsed().as_nanos() as f64 / f64::from(REPEATED)
            };
            (0..4).map(|_| run(&mut call)).fold(f64::INFINITY, f64::min)
        };
        (0..count).map(one).collect()
    }
}

/// Times a kernel on prepared cases. Small families are run through several times in a pass.
pub fn speed(entry: &Entry, prepared: &Prepared, rounds: usize) -> Speed {
    let pass = |linked| entry.each(prepared, Pass { linked });
    pass(false);
    let throughput = (0..rounds).map(|_| pass(false)).collect();
    let latency = (0..rounds).map(|_| pass(true)).collect();
    Speed { throughput: Spread::of(throughput), latency: Spread::of(latency), single: entry.each(prepared, Singles) }
}
