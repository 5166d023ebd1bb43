//! One formula, two arithmetics: the ring that [`Bounded`] and
//! [`Dyadic`] share, and the vector products over it.
//!
//! A cold path writes its polynomial once over `N: Number`, evaluates it in `Bounded` and, where that leaves the sign
//! open, again in `Dyadic`, which never does.

use super::bounded::Bounded;
use super::dyadic::Dyadic;
use super::scaled::Scaled;
use super::tally;
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
    #[inline(always)]
    fn squared(&self) -> Self {
        self.times(self)
    }
}

/// A vector of numbers.
pub type Vector<N> = [N; 3];

/// `v`, exactly.
#[inline(always)]
pub fn vector<N: Number>(v: DVec3) -> Vector<N> {
    [N::exactly(v.x), N::exactly(v.y), N::exactly(v.z)]
}

/// a − b of two float vectors.
#[inline(always)]
pub fn difference<N: Number>(a: DVec3, b: DVec3) -> Vector<N> {
    [N::difference(a.x, b.x), N::difference(a.y, b.y), N::difference(a.z, b.z)]
}

/// a · b.
#[inline(always)]
pub fn dot<N: Number>(a: &Vector<N>, b: &Vector<N>) -> N {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

/// a × b.
#[inline(always)]
pub fn cross<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    [minor(a, b, 1, 2), minor(a, b, 2, 0), minor(a, b, 0, 1)]
}

#[inline(always)]
fn minor<N: Number>(a: &Vector<N>, b: &Vector<N>, i: usize, j: usize) -> N {
    a[i].times(&b[j]).minus(&a[j].times(&b[i]))
}

/// v/|v|, if its components are known to more than the last place of the largest; zero for the zero vector.
pub fn unit<N: Number>(v: &Vector<N>) -> Option<DVec3> {
    let parts = [v[0].rounded(), v[1].rounded(), v[2].rounded()];
    let largest = parts.iter().filter(|(x, _)| !x.is_zero()).map(|(x, _)| x.exponent()).max();
    let Some(top) = largest else {
        return parts.iter().all(|(_, error)| *error == 0.0).then_some(DVec3::ZERO);
    };
    let mut unit = DVec3::ZERO;
    for (i, (value, relative)) in parts.into_iter().enumerate() {
        let x = value.shifted(-top).to_f64().0;
        // A component with no digits of its own is known well enough only if it is zero; NaN is not.
        let known = relative * x.abs() < super::bound::U || v[i].sign() == Some(Ordering::Equal);
        if !known {
            return None;
        }
        unit[i] = x;
    }
    Some(unit.normalize())
}

/// The exact sign of a polynomial: by double-doubles where they can tell, exactly otherwise.
pub fn sign_of(bounded: impl FnOnce() -> Bounded, exact: impl FnOnce() -> Dyadic) -> Ordering {
    bounded().sign().unwrap_or_else(|| {
        tally::exact();
        exact().sign().unwrap_or(Ordering::Equal)
    })
}
