//! A closed box in f64, decided exactly: the interval of λ in which the line is inside all three slabs (Kay, Kajiya
//! 1986).
//!
//! docs/numerics.md §9.

use super::bound::{LARGE, U, UNDERFLOW};
use super::number::{Number, sign_of};
use super::ratio::Ratio;
use super::tally;
use crate::{Interval, Ray};
use glam::DVec3;
use std::cmp::Ordering;

/// Where the line of `ray` enters and leaves the closed box from `min` to `max`, if some λ of that stretch lies inside
/// `within`, or touches it from both sides.
///
/// Flat boxes and single points are boxes; one with `min` above `max` on any axis, or with a NaN, holds nothing.
/// Infinite limits are legal. The decision is exact; the two λ are within 4 ulp, infinite where the box is.
#[inline]
#[must_use]
pub fn intersect(ray: &Ray, min: DVec3, max: DVec3, within: Interval) -> Option<(f64, f64)> {
    let (o, d) = (ray.origin, ray.direction);
    let (mut enter, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut sound = o.is_finite() & min.cmple(max).all();
    for i in 0..3 {
        let inverse = 1.0 / d[i];
        // 1/d keeps its digits.
        sound &= (d[i] == 0.0) | ((inverse.abs() < LARGE) & (d[i].abs() < LARGE));
        let (near, far) = if inverse > 0.0 { (min[i], max[i]) } else { (max[i], min[i]) };
        let (near, far) = (crossing(near, o[i], inverse), crossing(far, o[i], inverse));
        // 0·∞: the origin on a face that the ray runs along, which is inside. NaN loses both comparisons.
        enter = if near > enter { near } else { enter };
        exit = if far < exit { far } else { exit };
    }
    let (a, b) = (ROUNDED * enter.abs() + UNDERFLOW, ROUNDED * exit.abs() + UNDERFLOW);
    if sound & (enter + a < exit - b) & (exit - b > within.min) & (enter + a < within.max) & !within.is_empty() {
        return Some((enter, exit));
    }
    if sound & ((enter - a > exit + b) | (exit + b < within.min) | (enter - a > within.max)) {
        return None;
    }
    decide(ray, min, max, within)
}

/// A crossing has three roundings: |error| ≤ this·|crossing|.
const ROUNDED: f64 = 4.0 * U;

#[inline(always)]
fn crossing(limit: f64, origin: f64, inverse: f64) -> f64 {
    (limit - origin) * inverse
}

/// (limit − o)/d on one axis.
#[derive(Clone, Copy)]
struct Crossing {
    limit: f64,
    origin: f64,
    direction: f64,
}

impl Crossing {
    fn ratio<N: Number>(self) -> Ratio<N> {
        Ratio { numerator: N::difference(self.limit, self.origin), denominator: N::exactly(self.direction) }
    }

    fn infinity(self) -> Option<f64> {
        self.limit.is_infinite().then_some(self.limit * self.direction.signum())
    }

    fn compare(self, other: Self) -> Ordering {
        fn difference<N: Number>(a: Crossing, b: Crossing) -> N {
            let (a, b) = (a.ratio::<N>(), b.ratio::<N>());
            a.numerator.times(&b.denominator).minus(&b.numerator.times(&a.denominator))
        }
        match (self.infinity(), other.infinity()) {
            (None, None) => {
                let order = sign_of(|| difference(self, other), || difference(self, other));
                if (self.direction < 0.0) == (other.direction < 0.0) { order } else { order.reverse() }
            }
            (a, b) => a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)),
        }
    }

    fn compare_limit(self, limit: f64) -> Ordering {
        match self.infinity() {
            Some(infinity) => infinity.total_cmp(&limit),
            None => self
                .ratio::<super::bounded::Bounded>()
                .compare(limit)
                .or_else(|| {
                    tally::exact();
                    self.ratio::<super::dyadic::Dyadic>().compare(limit)
                })
                .unwrap_or(Ordering::Equal),
        }
    }

    fn lambda(self) -> f64 {
        let exactly = || {
            tally::exact();
            Some(self.ratio::<super::dyadic::Dyadic>().lambda(0.0)?.0)
        };
        self.infinity().or_else(exactly).unwrap_or(f64::NAN)
    }
}

#[cold]
#[inline(never)]
fn decide(ray: &Ray, min: DVec3, max: DVec3, within: Interval) -> Option<(f64, f64)> {
    tally::refined();
    if !ray.is_valid() || within.is_empty() || !min.cmple(max).all() {
        return None;
    }
    let mut stretch: Option<(Crossing, Crossing)> = None;
    for i in 0..3 {
        let (origin, direction) = (ray.origin[i], ray.direction[i]);
        if direction == 0.0 {
            if origin < min[i] || origin > max[i] {
                return None;
            }
            continue;
        }
        let crossing = |limit| Crossing { limit, origin, direction };
        let (near, far) = if direction > 0.0 { (min[i], max[i]) } else { (max[i], min[i]) };
        let (near, far) = (crossing(near), crossing(far));
        stretch = Some(stretch.map_or((near, far), |(enter, exit)| {
            (if near.compare(enter).is_gt() { near } else { enter }, if far.compare(exit).is_lt() { far } else { exit })
        }));
    }
    let (enter, exit) = stretch?;
    let meets = enter.compare(exit).is_le()
        && exit.compare_limit(within.min).is_gt()
        && enter.compare_limit(within.max).is_lt();
    meets.then(|| (enter.lambda(), exit.lambda()))
}

#[cfg(test)]
mod tests {
    use super::super::search::{Rational, climb};
    use super::*;

    #[test]
    fn no_input_reaches_the_bound() {
        let worst = climb("box: crossings", 3, |x| {
            let [limit, origin, direction] = [x[0], x[1], x[2]].map(|x| Rational::try_from(x).unwrap());
            let rounded = crossing(x[0], x[1], 1.0 / x[2]);
            let off = (limit - origin) / direction - Rational::try_from(rounded).ok()?;
            (rounded != 0.0).then(|| off.to_f64().value().abs() / (ROUNDED * rounded.abs()))
        });
        assert!((0.5..1.0).contains(&worst));
    }
}
