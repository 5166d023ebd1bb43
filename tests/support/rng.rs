//! Seeded random numbers (`SplitMix64`, Steele et al. 2014): the same cases on every machine.
#![allow(dead_code, unreachable_pub, reason = "each test uses some")]

use truehit::glam::DVec3;

#[derive(Clone, Debug)]
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A stream of its own for each name.
    pub fn named(name: &str) -> Self {
        Self(name.bytes().fold(7, |h, b| h * 31 % 1_000_003 + u64::from(b)))
    }

    /// [0, n)
    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// [0, n), to index with.
    pub fn index(&mut self, n: usize) -> usize {
        self.below(n as u64) as usize
    }

    /// lo..=hi
    pub fn integer(&mut self, lo: i64, hi: i64) -> i64 {
        lo + self.below((hi - lo + 1) as u64) as i64
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.index(from.len())]
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.uniform(0.0, 1.0) < p
    }

    pub fn sign(&mut self) -> f64 {
        if self.next() & 1 == 0 { 1.0 } else { -1.0 }
    }

    pub fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.next() >> 11) as f64 / 9_007_199_254_740_992.0)
    }

    /// [0, 1)
    pub fn fraction(&mut self) -> f64 {
        self.uniform(0.0, 1.0)
    }

    /// 10^uniform(lo, hi): as far as subnormals.
    pub fn decades(&mut self, lo: f64, hi: f64) -> f64 {
        10f64.powf(self.uniform(lo, hi))
    }

    /// A whole number of magnitude at most `n`.
    pub fn whole(&mut self, n: i64) -> f64 {
        self.integer(-n, n) as f64
    }

    /// A point of the integer grid.
    pub fn grid(&mut self, n: i64) -> DVec3 {
        DVec3::new(self.whole(n), self.whole(n), self.whole(n))
    }

    /// Log-uniform; both limits above zero.
    pub fn log(&mut self, lo: f64, hi: f64) -> f64 {
        self.uniform(lo.ln(), hi.ln()).exp()
    }

    /// A multiple of 2⁻³ of magnitude at most `size`: few bits, so that products stay exact.
    pub fn eighths(&mut self, size: i64) -> f64 {
        self.integer(-8 * size, 8 * size) as f64 / 8.0
    }

    pub fn small(&mut self, size: i64) -> DVec3 {
        DVec3::new(self.eighths(size), self.eighths(size), self.eighths(size))
    }

    pub fn in_cube(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.uniform(-size, size), self.uniform(-size, size), self.uniform(-size, size))
    }

    /// Uniform on the unit sphere.
    pub fn unit(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube(1.0);
            let l = v.length();
            if l > 0.1 && l <= 1.0 {
                return v / l;
            }
        }
    }

    /// A unit vector perpendicular to `v`, nearly.
    pub fn across(&mut self, v: DVec3) -> DVec3 {
        loop {
            let w = self.unit().cross(v.normalize());
            if w.length() > 0.1 {
                return w.normalize();
            }
        }
    }

    /// The length of a direction on ordinary rays.
    pub fn length(&mut self) -> f64 {
        self.log(0.1, 10.0)
    }
}

/// `x` moved by `n` floats.
pub fn nudged(x: f64, n: i64) -> f64 {
    let mut x = x;
    for _ in 0..n.abs() {
        x = if n > 0 { x.next_up() } else { x.next_down() };
    }
    x
}

pub fn nudged_each(v: DVec3, n: i64, rng: &mut Rng) -> DVec3 {
    DVec3::new(nudged(v.x, rng.integer(-n, n)), nudged(v.y, rng.integer(-n, n)), nudged(v.z, rng.integer(-n, n)))
}
