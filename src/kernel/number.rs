//! One formula, two arithmetics: the ring that [`Bounded`](super::bounded::Bounded) and
//! [`Dyadic`](super::dyadic::Dyadic) share, and the vector products over it.
//!
//! A cold path writes its polynomial once over `N: Number`, evaluates it in `Bounded` and, where that leaves the sign
//! open, again in `Dyadic`, which never does.

use super::scaled::Scaled;
use glam::DVec3;
use std::cmp::Ordering;

/// A ring with a sign that may be unknown.
pub trait Number: Clone {
    /// Exactly `value`, which must be finite.
    fn exactly(value: f64) -> Self;
    /// a − b of two finite floats, exactly where the range allows.
    fn difference(a: f64, b: f64) -> Self;
    /// self + other.
    #[must_use]
    fn plus(&self, other: &Self) -> Self;
    /// self − other.
    #[must_use]
    fn minus(&self, other: &Self) -> Self;
    /// self · other.
    #[must_use]
    fn times(&self, other: &Self) -> Self;
    /// −self.
    #[must_use]
    fn negated(&self) -> Self;
    /// Compared with zero; `None` where this arithmetic cannot tell.
    fn sign(&self) -> Option<Ordering>;
    /// The value as a double-double with a binary exponent of its own, and a bound on its *relative* error: infinite
    /// where nothing is known.
    fn rounded(&self) -> (Scaled, f64);

    /// self².
    #[must_use]
    fn squared(&self) -> Self {
        self.times(self)
    }
}

/// A vector of numbers.
pub type Vector<N> = [N; 3];

/// `v`, exactly.
pub fn vector<N: Number>(v: DVec3) -> Vector<N> {
    [N::exactly(v.x), N::exactly(v.y), N::exactly(v.z)]
}

/// a − b of two float vectors.
pub fn difference<N: Number>(a: DVec3, b: DVec3) -> Vector<N> {
    [N::difference(a.x, b.x), N::difference(a.y, b.y), N::difference(a.z, b.z)]
}

/// a · b.
pub fn dot<N: Number>(a: &Vector<N>, b: &Vector<N>) -> N {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

/// a × b.
pub fn cross<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    let minor = |i: usize, j: usize| a[i].times(&b[j]).minus(&a[j].times(&b[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}
