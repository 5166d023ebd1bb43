//! Rays that start next to the sphere, as those do that leave it: both roots from C and b in double-double, without the
//! square root that the sphere's other rays need.
//!
//! With B = b as a pair, ε = A·C/B²: the root next to the origin is −C/2B·2/(1 + √(1 − ε)), and the two roots add up to
//! −2B/A. docs/numerics.md §5, "Next to the origin".

use super::super::bound::{INFLATE, U};
use super::super::bounded::Bounded;
use super::super::cpu;
use super::super::eft::{Fused, Product, Split, quick_two_sum, two_sum};
use super::super::float::power;
use super::super::number::{Number, difference, dot};
use super::super::pair::{Pair, close_dot, plain_dot, taxicab};
use super::super::section::FINE;
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::{DVec2, DVec3};

/// A ray starts next to the sphere if |A·C| ≤ this·A·r².
pub(super) const NEXT: f64 = power(-30);
/// It does not graze the sphere if |b| ≥ this·r·|d|₁; then ε < 2⁻⁹.
const STEEP: f64 = power(-10);
/// |error of C in plain arithmetic| ≤ this·r².
const PLAIN_C: f64 = 8.0 * U;
/// |error of b in plain arithmetic| ≤ this·r·|d|₁.
const PLAIN_B: f64 = 8.0 * U;
/// |error of C in double-double| ≤ this·r².
const CLOSE_C: f64 = 32.0 * U * U;
/// |error of the root next to the origin, beside what C's brings| ≤ this·|λ|.
const NEAR: f64 = U / 64.0;
/// |error of the other root, beside that one's| ≤ this·r·|d|₁/A.
const FAR: f64 = 256.0 * U * U;

/// Whether plain arithmetic is certain that the root next to the origin lies behind it: what is left then is the far root
/// if b is below zero, none if it is not. So it is with rays that were spawned where a ray left the sphere.
#[inline(always)]
pub(super) fn is_behind(f: DVec3, d: DVec3, b: f64, r: f64) -> bool {
    let c = plain_dot(f, f) - r * r;
    (c * b > 0.0) & (c.abs() > PLAIN_C * (r * r)) & (b.abs() > PLAIN_B * (r * taxicab(d)))
}

/// The nearest hit inside `within`. The ray is ordinary and |A·C| ≤ [`NEXT`]·A·r². Scalars, so that the caller's vectors
/// stay in registers.
#[inline(never)]
pub(super) fn intersect(ray: &Ray, x: f64, y: f64, z: f64, r: f64, min: f64, max: f64) -> Option<Hit> {
    cpu::dispatch(
        #[inline(always)]
        move || roots::<Fused>(ray, DVec3::new(x, y, z), r, Interval { min, max }),
        #[inline(always)]
        move || roots::<Split>(ray, DVec3::new(x, y, z), r, Interval { min, max }),
    )
}

#[inline(always)]
fn roots<P: Product>(ray: &Ray, center: DVec3, r: f64, within: Interval) -> Option<Hit> {
    let cold = || super::refine(ray, center.x, center.y, center.z, r, within.min, within.max);
    let (f, d) = (Pair::difference(ray.origin, center), ray.direction);
    let (b, reach) = (slope::<P>(&f, d), r * taxicab(d));
    let mut c = Excess::new::<P>(&f, r);
    let steep = b.0.abs() >= STEEP * reach;
    let certain = c.hi.abs() > c.error;
    if !steep || !certain && c.on_it(ray, center, r).is_none() {
        return cold();
    }
    // The far root lies behind the origin if b is above zero; the near one if C has the sign of b, or on it if C is zero.
    let (forward, behind, near_behind) = (within.min >= 0.0, b.0 > 0.0, c.hi * b.0 >= 0.0);
    if forward & near_behind & behind {
        return None;
    }
    let near_first = if forward { !near_behind } else { !behind };
    for is_near in [near_first, !near_first] {
        if forward & if is_near { near_behind } else { behind } {
            continue;
        }
        let (lambda, lo, rest) = if is_near { c.root::<P>(b, d) } else { c.other_root::<P>(b, d, reach) };
        let error = (lo.abs() + rest) * INFLATE;
        // What is promised: the last bit, or that of 2⁻⁴⁰ of the coordinates. Mostly the radius is large enough.
        let fine = |size: f64| rest * (1.75 * taxicab(d)) <= 0.5 * U * FINE * size;
        let known = rest <= 0.4 * U * lambda.abs() || fine(r) || fine(ray.origin.abs().max(center.abs()).max_element());
        if !known {
            return cold();
        }
        if (lambda - error > within.min) & (lambda + error < within.max) {
            return Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 });
        }
        if lambda - error > within.max {
            return None;
        }
        let before = lambda + error < within.min;
        if !before {
            return cold();
        }
    }
    None
}

/// b as hi + lo, |lo| ≤ u|hi|; not for rays that graze.
#[inline(always)]
fn slope<P: Product>(f: &Pair, d: DVec3) -> (f64, f64) {
    let (b, b_lo) = f.dot_float::<P>(d);
    quick_two_sum(b, b_lo)
}

/// C = |f|² − r² as hi + lo, off by at most `error`.
struct Excess {
    hi: f64,
    lo: f64,
    error: f64,
}

impl Excess {
    #[inline(always)]
    fn new<P: Product>(f: &Pair, r: f64) -> Self {
        let (hi, lo) = f.squared_less_pair::<P>(r);
        Self { hi, lo, error: CLOSE_C * (r * r) }
    }

    /// Where double-double cannot tell its sign: on the sphere it is zero.
    #[cold]
    #[inline(never)]
    fn on_it(&mut self, ray: &Ray, center: DVec3, r: f64) -> Option<()> {
        let f = difference::<Bounded>(ray.origin, center);
        let c = dot(&f, &f).minus(&Bounded::exactly(r).squared());
        c.sign()?;
        *self = Self { hi: c.hi, lo: c.lo, error: c.error };
        Some(())
    }

    /// −C/2b, and what is to be added in proportion for λ: 2/(1 + √(1 − ε)) = 1 + ε/(1 + √(1 − ε))².
    #[inline(always)]
    fn first(&self, half: f64, d: DVec3) -> (f64, f64) {
        let epsilon = plain_dot(d, d) * (self.hi * (4.0 * (half * half)));
        let curved = if epsilon.abs() <= power(-20) {
            0.25 + 0.125 * epsilon
        } else {
            let s = 1.0 + (1.0 - epsilon).sqrt();
            1.0 / (s * s)
        };
        (-self.hi * half, epsilon * curved)
    }

    /// λ next to the origin as hi + lo, and a bound on what that is off.
    #[inline(always)]
    fn root<P: Product>(&self, (b, b_lo): (f64, f64), d: DVec3) -> (f64, f64, f64) {
        let half = 0.5 / b;
        let (first, more) = self.first(half, d);
        // One step of the division.
        let rest = P::remainder(-self.hi, first, 2.0 * b) - (self.lo + 2.0 * (first * b_lo));
        let (hi, lo) = two_sum(first, rest * half + first * more);
        // Zero is that of no sign.
        (hi + 0.0, lo, 1.01 * (self.error * half.abs()) + NEAR * hi.abs())
    }

    /// The other λ: both add up to −2b/A.
    #[inline(always)]
    fn other_root<P: Product>(&self, (b, b_lo): (f64, f64), d: DVec3, reach: f64) -> (f64, f64, f64) {
        let (half, (a, a_lo)) = (0.5 / b, close_dot::<P>(d, d));
        let inverse = 1.0 / a;
        let (near, more) = self.first(half, d);
        let first = -2.0 * (b * inverse);
        let rest = P::remainder(-2.0 * b, first, a) - (2.0 * b_lo + first * a_lo);
        let (hi, lo) = two_sum(first, rest * inverse - (near + near * more));
        (hi, lo, FAR * (reach * inverse) + 1.01 * (self.error * half.abs()) + 8.0 * U * near.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::dyadic::Dyadic;
    use super::super::super::search::{Rational, climb, dot3, each, exact, minus};
    use super::super::super::tally::Tally;
    use super::*;

    /// A ray that starts within 2⁻³⁰ radii of a sphere, mostly within a few ulps.
    fn setting(x: &[f64]) -> Option<(Ray, DVec3, f64)> {
        let (center, d) = (DVec3::new(x[6], x[7], x[8]) * 2f64.powf(8.0 * x[9]), DVec3::new(x[3], x[4], x[5]));
        let origin = center + DVec3::new(x[0], x[1], x[2]);
        let gap = 2f64.powf(-44.0 + 13.0 * x[10]) * x[11];
        let r = (origin - center).length() * (1.0 + if gap.abs() < 2f64.powi(-50) { 0.0 } else { gap });
        let (f, a) = (origin - center, plain_dot(d, d));
        let (value, error) = super::super::discriminant(f, d, r);
        let b = plain_dot(f, d);
        let next = super::super::is_ordinary(f, d, r) && value > error && (b * b - value).abs() <= NEXT * (a * r * r);
        next.then_some((Ray { origin, direction: d }, center, r))
    }

    fn rational(x: f64) -> Rational {
        Rational::try_from(x).unwrap()
    }

    /// A, b, C.
    fn polynomial(ray: &Ray, center: DVec3, r: f64) -> [Rational; 3] {
        let (f, d, r) = (minus(ray.origin, center), exact(ray.direction), rational(r));
        [dot3(&d, &d), dot3(&f, &d), dot3(&f, &f) - &r * &r]
    }

    #[test]
    fn no_input_reaches_the_bounds() {
        let ratio = |off: Rational, bound: f64| Some((off.to_f64().value() / bound).abs());
        let worst = climb("sphere, start: C, b in plain", 12, |x| {
            let (ray, center, r) = setting(x)?;
            let (f, d) = (ray.origin - center, ray.direction);
            let [_, b, c] = polynomial(&ray, center, r);
            let off_c = ratio(c - rational(plain_dot(f, f) - r * r), PLAIN_C * (r * r))?;
            Some(off_c.max(ratio(b - rational(plain_dot(f, d)), PLAIN_B * (r * taxicab(d)))?))
        });
        assert!((0.05..1.0).contains(&worst));
        let worst = climb("sphere, start: C", 12, |x| {
            let (ray, center, r) = setting(x)?;
            let c = Excess::new::<Split>(&Pair::difference(ray.origin, center), r);
            let [.., exact] = polynomial(&ray, center, r);
            ratio(exact - rational(c.hi) - rational(c.lo), c.error)
        });
        assert!((0.02..1.0).contains(&worst));
        // The whole bound, C's share included, and the part of it that is not C's: C as it is, exactly.
        for (name, other, sharp) in [
            ("sphere, start: λ", false, false),
            ("sphere, start: λ but for C", false, true),
            ("sphere, start: other λ", true, false),
        ] {
            let worst = climb(name, 12, |x| {
                let (ray, center, r) = setting(x)?;
                let (f, d) = (Pair::difference(ray.origin, center), ray.direction);
                let (b, reach) = (slope::<Split>(&f, d), r * taxicab(d));
                let mut c = Excess::new::<Split>(&f, r);
                let [a, bb, mut cc] = polynomial(&ray, center, r);
                if c.hi.abs() <= c.error || b.0.abs() < STEEP * reach {
                    return None;
                }
                if sharp {
                    c.error = 0.0;
                    cc = rational(c.hi) + rational(c.lo);
                }
                let (hi, lo, rest) = if other { c.other_root::<Split>(b, d, reach) } else { c.root::<Split>(b, d) };
                let l = rational(hi) + rational(lo);
                let off = ((&a * &l + &bb + &bb) * &l + cc) / (Rational::from(2) * (a * l + bb));
                ratio(off, rest)
            });
            assert!((0.002..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    /// Answers are the exact tier's, whatever the interval; few rays need it.
    #[test]
    fn rays_next_to_the_sphere_are_answered_as_exactly_as_others() {
        use super::super::{decide, fast};
        let (mut rays, mut hits, mut cold) = (0, 0, 0);
        each(60_000, 12, |x| {
            let Some((ray, center, r)) = setting(x) else { return };
            let limit = x[0] * 2f64.powf(-30.0 + 30.0 * x[1]);
            for within in [Interval::FORWARD, Interval::LINE, Interval { min: limit.abs(), max: 1.0 }] {
                rays += 1;
                let before = Tally::now();
                let fused = fast::<Fused>(&ray, center, r, within);
                cold += Tally::now().since(before).refined;
                assert_eq!(fused, fast::<Split>(&ray, center, r, within));
                let exact = decide::<Dyadic>(&ray, center, r, within).unwrap();
                assert_eq!(fused.is_some(), exact.is_some(), "{ray:?} {center} {r:e} {within:?}");
                if let (Some(hit), Some(exact)) = (fused, exact) {
                    hits += 1;
                    assert!((hit.lambda - exact.lambda).abs() <= hit.error + exact.error);
                }
            }
        });
        println!("{rays} rays that start next to a sphere, {hits} hits, {cold} refined");
        assert!(rays > 50_000 && 3 * hits > rays && 20 * cold < rays);
    }

    /// On the sphere exactly: zero is found without integers.
    #[test]
    fn origins_exactly_on_the_sphere() {
        let (mut rays, before) = (0, Tally::now());
        each(20_000, 6, |x| {
            let (d, s) = (DVec3::new(x[0], x[1], x[2]), 2f64.powf(20.0 * x[3]));
            let radius = if x[4] > 0.0 { s } else { 7.0 * 2f64.powi((9.0 * x[3]) as i32) };
            let origin = if x[4] > 0.0 { DVec3::Y * s } else { radius / 7.0 * DVec3::new(2.0, -3.0, 6.0) };
            let (ray, inward) = (Ray { origin, direction: d }, d.dot(origin));
            if inward.abs() < 1e-2 * radius * d.length() {
                return;
            }
            rays += 1;
            let hit = super::super::intersect(&ray, DVec3::ZERO, radius, Interval::FORWARD);
            assert_eq!(hit.is_some(), inward < 0.0);
            let both = super::super::intersect(&ray, DVec3::ZERO, radius, Interval { min: -1e-9, max: 1e-9 }).unwrap();
            assert_eq!((both.lambda.to_bits(), both.error), (0, 0.0));
        });
        let counted = Tally::now().since(before);
        println!("{rays} rays from exactly on a sphere, {counted:?}");
        assert!(rays > 10_000 && counted == Tally::default());
    }
}
