//! A search for inputs that drive an error towards its bound, for the tests of filter constants: what is proved must
//! hold on them, and a constant that is far too large shows as well.

use dashu::rational::RBig;
use glam::DVec3;

pub(crate) type Rational = RBig;

/// A finite vector, exactly.
pub(super) fn exact(v: DVec3) -> [Rational; 3] {
    v.to_array().map(|x| RBig::try_from(x).unwrap())
}

pub(super) fn minus(a: DVec3, b: DVec3) -> [Rational; 3] {
    let (a, b) = (exact(a), exact(b));
    [0, 1, 2].map(|i| &a[i] - &b[i])
}

pub(super) fn dot3(a: &[Rational; 3], b: &[Rational; 3]) -> Rational {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

pub(super) fn cross3(a: &[Rational; 3], b: &[Rational; 3]) -> [Rational; 3] {
    let minor = |i: usize, j: usize| &a[i] * &b[j] - &a[j] * &b[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// SplitMix64.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// (−1, 1)
    pub(crate) fn number(&mut self) -> f64 {
        (self.next() >> 11) as f64 / 4_503_599_627_370_496.0 - 1.0
    }

    fn numbers(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.number()).collect()
    }
}

/// `visit` with `n` random points of (−1, 1)^dimension.
pub(super) fn each(n: usize, dimension: usize, mut visit: impl FnMut(&[f64])) {
    let mut random = Random::new(7);
    for _ in 0..n {
        visit(&random.numbers(dimension));
    }
}

/// The largest `ratio` found: random starts, then steps of every size from the best of them, uphill.
pub(crate) fn climb(name: &str, dimension: usize, ratio: impl Fn(&[f64]) -> Option<f64>) -> f64 {
    let mut random = Random::new(1);
    let (mut best, mut tried) = (0.0, 0);
    for _ in 0..12 {
        let starts = (0..250).map(|_| random.numbers(dimension)).filter_map(|x| ratio(&x).map(|r| (r, x)));
        let starts: Vec<_> = starts.collect();
        tried += starts.len();
        let Some((mut here, mut x)) = starts.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        for _ in 0..400 {
            let mut y = x.clone();
            let i = random.next() as usize % dimension;
            // From a new number to a few units in the last place.
            let size = 2f64.powi(-((random.next() % 54) as i32));
            y[i] = (y[i] + size * random.number()).clamp(-1.0, 1.0);
            if let Some(r) = ratio(&y) {
                tried += 1;
                if r > here {
                    (here, x) = (r, y);
                }
            }
        }
        best = f64::max(best, here);
    }
    println!("{name}: |error|/bound up to {best:.3} in {tried} tries");
    assert!(tried > 1000, "{name}: hardly any input was tried");
    best
}
