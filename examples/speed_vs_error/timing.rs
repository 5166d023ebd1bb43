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
#[derive(Clone, Copy, Debug, Default)]
pub struct Speed {
    /// Independent rays, one after the other.
    pub throughput: Spread,
    /// Each ray waits for the answer to the one before.
    pub latency: Spread,
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

/// Times kernels on the same cases, in turns, so that what disturbs one disturbs all.
pub fn race(runners: &[(&Entry, Prepared)], rounds: usize) -> Vec<Speed> {
    let mut samples = vec![[Vec::new(), Vec::new()]; runners.len()];
    for round in 0..=rounds {
        for ((entry, prepared), samples) in runners.iter().zip(&mut samples) {
            for (linked, samples) in [false, true].into_iter().zip(samples) {
                let time = entry.each(prepared, Pass { linked });
                // The first round warms up.
                if round > 0 {
                    samples.push(time);
                }
            }
        }
    }
    let speed = |[throughput, latency]: [Vec<f64>; 2]| Speed {
        throughput: Spread::of(throughput),
        latency: Spread::of(latency),
    };
    samples.into_iter().map(speed).collect()
}
