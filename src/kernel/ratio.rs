//! λ = N/D of a flat surface in the refined tiers: compared with the interval exactly, rounded once.
//!
//! docs/numerics.md §3.

use super::bound::U;
use super::bounded::Bounded;
use super::dyadic::Dyadic;
use super::number::Number;
use super::scaled::{SCALED_ERROR, Scaled};
use super::tally;
use crate::{Interval, Ray};
use glam::DVec3;
use std::cmp::Ordering;

/// λ = numerator/denominator.
#[derive(Clone, Copy, Debug)]
pub struct Ratio<N> {
    /// N.
    pub numerator: N,
    /// D.
    pub denominator: N,
}

/// The most that N/D in double-double may be off for λ to be taken from it: far below the half ulp of its rounding.
const ENOUGH: f64 = 1.0 / (1u64 << 60) as f64 / (1 << 10) as f64;

impl<N: Number> Ratio<N> {
    /// The exact λ compared with `limit`, which may be infinite; `None` where this arithmetic cannot tell.
    #[must_use]
    pub fn compare(&self, limit: f64) -> Option<Ordering> {
        if limit.is_infinite() {
            return Some(0f64.total_cmp(&limit));
        }
        // sign(N/D − m) = sign(N − m·D)·sign(D)
        let difference = self.numerator.minus(&N::exactly(limit).times(&self.denominator)).sign()?;
        Some(if self.denominator.sign()? == Ordering::Less { difference.reverse() } else { difference })
    }

    /// Whether the exact λ lies inside the open interval; `None` where this arithmetic cannot tell.
    #[must_use]
    pub fn is_inside(&self, within: Interval) -> Option<bool> {
        Some(self.compare(within.min)? == Ordering::Greater && self.compare(within.max)? == Ordering::Less)
    }

    /// λ and a bound on its relative error.
    #[must_use]
    pub fn value(&self) -> (Scaled, f64) {
        let (n, n_error) = self.numerator.rounded();
        let (d, d_error) = self.denominator.rounded();
        if d.is_zero() {
            return (Scaled::ZERO, f64::INFINITY);
        }
        // (1 + n)/(1 − d) ≤ 1 + n + 2d + … for d ≤ ¼; beyond it nobody trusts the bound anyway.
        (n.over(d), 2.0 * (n_error + d_error) + SCALED_ERROR)
    }

    /// λ as a float with a bound on its error, if this arithmetic gives it to the last bit or nearly, or is off by no
    /// more than `tolerated`.
    #[must_use]
    pub fn lambda(&self, tolerated: f64) -> Option<(f64, f64)> {
        let (value, relative) = self.value();
        let (lambda, rounding) = value.to_f64();
        let known = relative <= ENOUGH || relative * lambda.abs() <= tolerated;
        if !known {
            return None;
        }
        if lambda.is_infinite() {
            // No float is near it: the largest stands for it, and claims nothing.
            return Some((f64::MAX.copysign(lambda), f64::INFINITY));
        }
        Some((lambda, rounding + lambda.abs() * relative.max(ENOUGH)))
    }
}

impl Ratio<Dyadic> {
    /// λ₁ compared with λ₂, exactly.
    #[must_use]
    pub fn compare_exactly(&self, other: &Self) -> Ordering {
        let (a, b) = (self.numerator.times(&other.denominator), other.numerator.times(&self.denominator));
        let negative = |r: &Self| r.denominator.sign() == Some(Ordering::Less);
        let difference = a.minus(&b).sign().unwrap_or(Ordering::Equal);
        if negative(self) == negative(other) { difference } else { difference.reverse() }
    }
}

/// λ and its error bound where the exact λ lies in `within`: from double-doubles where they will do, exactly otherwise.
/// A miss where D is zero. λ may be off by `tolerated`, beside its last rounding, where it is too small to be known to
/// the last bit.
#[cold]
pub fn refine(
    bounded: impl FnOnce() -> Ratio<Bounded>,
    exact: impl FnOnce() -> Ratio<Dyadic>,
    within: Interval,
    tolerated: f64,
) -> Option<(f64, f64)> {
    let ratio = bounded();
    if ratio.denominator.sign() == Some(Ordering::Equal) {
        return None;
    }
    match ratio.is_inside(within) {
        Some(false) => return None,
        Some(true) => {
            if let Some(answer) = ratio.lambda(tolerated) {
                return Some(answer);
            }
        }
        None => {}
    }
    tally::exact();
    let ratio = exact();
    if ratio.denominator.is_zero() || !ratio.is_inside(within)? {
        return None;
    }
    ratio.lambda(tolerated)
}

/// λ to about a hundred bits, as an unevaluated sum.
#[cold]
pub fn precise(bounded: impl FnOnce() -> Ratio<Bounded>, exact: impl FnOnce() -> Ratio<Dyadic>) -> [f64; 2] {
    let (value, relative) = bounded().value();
    let value = if relative <= ENOUGH * ENOUGH.sqrt() { value } else { exact().value().0 };
    let (hi, lo) = value.to_pair();
    [hi, lo]
}

/// Half an ulp of 2⁻⁴⁰ times a distance from the ray's origin over the direction's length, or less: what λ need not be
/// better known than, near the origin.
#[must_use]
pub fn floor(ray: &Ray, point: DVec3) -> f64 {
    let distance = (point - ray.origin).abs().max_element();
    let floor = U * (0.125 / (1u64 << 40) as f64) * distance / ray.direction.abs().max_element();
    if floor.is_finite() { floor } else { 0.0 }
}
