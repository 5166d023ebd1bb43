//! Ray and sphere.
//!
//! With f = origin − center: A = |d|², b = f·d, D = r²A − |f × d|² (Lagrange's form of b² − AC, whose error grows with
//! |f|, not with |f|²), λ = (−b ∓ √D)/A, then one Newton step with the residual |f + λd|² − r² in double-double, whose
//! slope at the root is ∓2√D. Rays that start next to the sphere have a way of their own, `near.rs`, and so have those
//! that graze it, `grazing.rs`. docs/numerics.md §5 proves every constant.
//!
//! Close to Haines, Günther, Akenine-Möller 2019 (Ray Tracing Gems ch. 7) in the discriminant; the step, the bounds and
//! the exact refinement are this crate's.

mod grazing;
mod near;

use super::bound::U;
use super::cpu;
use super::eft::{Fused, Product, Split, quick_two_sum};
use super::number::{Number, cross, difference, dot, vector};
use super::pair::{Pair, plain_cross, plain_dot, taxicab};
use super::section::{End, Quadratic, Undecided, fine, nearest, precise, refined, sign};
use super::tally;
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// |error of D| ≤ this·A·r·(r + |f|₁), wherever D and its rounded value are not both clearly negative.
const DISCRIMINANT: f64 = 12.0 * U;
/// |error of the first λ| ≤ this·z, z = u·r·(r + |f|₁)/√D.
const FIRST: f64 = 23.0;
/// After the step: |error of λ| ≤ z·(`SQUARED`·A·z/√D + `RESIDUAL`), besides its last rounding.
const SQUARED: f64 = 560.0;
/// See [`SQUARED`].
const RESIDUAL: f64 = 176.0 * U;
/// |f|₁ + r below this many radii keeps second-order terms within the constants.
const FARTHEST: f64 = (1u64 << 46) as f64;

/// The nearest hit of `ray` with the sphere |p − `center`| = `radius` inside `within`.
///
/// Decided as exact arithmetic on these numbers would: a tangent hits, once. λ is within one ulp of the exact λ (an ulp
/// of 2⁻⁴⁰ of the largest coordinate over |direction| if that is larger), and `error` bounds what it is off.
/// A ray that is not [valid](Ray::is_valid) misses, and so does everything if `center` or `radius` is not finite or
/// `radius` is not above zero.
#[must_use]
#[inline]
pub fn intersect(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
    cpu::dispatch(
        #[inline(always)]
        move || fast::<Fused>(ray, center, radius, within),
        #[inline(always)]
        move || fast::<Split>(ray, center, radius, within),
    )
}

/// The same bits for either [`Product`].
#[inline(always)]
fn fast<P: Product>(ray: &Ray, center: DVec3, r: f64, within: Interval) -> Option<Hit> {
    let cold = || refine(ray, center.x, center.y, center.z, r, within.min, within.max);
    let (f, d) = (Pair::difference(ray.origin, center), ray.direction);
    let (value, error) = discriminant(f.hi, d, r);
    if !(is_ordinary(f.hi, d, r) & (value.abs() > error)) {
        return cold();
    }
    if value < 0.0 {
        return None;
    }
    let (a, b) = (plain_dot(d, d), plain_dot(f.hi, d));
    // Of a ray that starts inside, next to the sphere.
    let mut entry_is_behind = false;
    // b² − D = A·C
    if (b * b - value).abs() <= near::NEXT * (a * r * r) {
        if !((within.min >= 0.0) & near::is_behind(f.hi, d, b, r)) {
            return near::intersect(ray, center.x, center.y, center.z, r, within.min, within.max);
        }
        if b > 0.0 {
            return None;
        }
        entry_is_behind = true;
    }
    let root = value.sqrt();
    // One over A while the root is taken.
    let inverse = 1.0 / a;
    let (z, rest) = bounds(f.hi, d, r, root);
    // The root at which the polynomial falls (the sphere is entered), then the one at which it rises.
    for (slope, is_behind) in [(-1.0, entry_is_behind), (1.0, false)] {
        let first = (slope * root - b) * inverse;
        if (first + FIRST * z <= within.min) | is_behind {
            continue;
        }
        // `rest` is far above `FIRST`·u·z: then λ is `first` to within a part of it, and known. Not where the ray
        // grazes.
        let known = rest <= 0.4 * U * first.abs();
        if !known {
            return cold();
        }
        let (lambda, lo) = step::<P>(&f, d, r, root, slope, first);
        let error = (lo.abs() + rest) * (1.0 + 8.0 * U);
        if (lambda - error > within.min) & (lambda + error < within.max) {
            return Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 });
        }
        if lambda + error < within.min {
            continue;
        }
        if lambda - error > within.max {
            return None;
        }
        return settle(ray, center.x, center.y, center.z, r, within.min, within.max);
    }
    None
}

/// Whether nothing over- or underflows that counts; a NaN does.
#[inline(always)]
fn is_ordinary(f: DVec3, d: DVec3, r: f64) -> bool {
    // 2⁻²⁵⁶ ≤ x < 2²⁵⁶ for both at once: what is out of range, negative or not a number has one of the upper three
    // bits.
    let above = |x: f64| x.to_bits().wrapping_sub((1023 - 256) << 52);
    ((above(r) | above(plain_dot(d, d) * r * r)) < 512 << 52) & (r + taxicab(f) < FARTHEST * r)
}

/// D and a bound on its error.
#[inline(always)]
fn discriminant(f: DVec3, d: DVec3, r: f64) -> (f64, f64) {
    let (w, ar) = (plain_cross(f, d), plain_dot(d, d) * r);
    (ar * r - plain_dot(w, w), DISCRIMINANT * ar * (r + taxicab(f)))
}

/// z, and the bound on λ's error after the step.
#[inline(always)]
fn bounds(f: DVec3, d: DVec3, r: f64, root: f64) -> (f64, f64) {
    let over = 1.0 / root;
    let z = U * r * (r + taxicab(f)) * over;
    (z, z * (SQUARED * plain_dot(d, d) * z * over + RESIDUAL))
}

/// λ + lo after one Newton step from `first`, with the slope at the root.
#[inline(always)]
fn step<P: Product>(f: &Pair, d: DVec3, r: f64, root: f64, slope: f64, first: f64) -> (f64, f64) {
    let residual = f.moved::<P>(first, d).residual::<P>(r);
    quick_two_sum(first, -slope * 0.5 * (1.0 / root) * residual)
}

/// What is left: mostly rays that graze. Scalars, so that the caller's vectors stay in registers.
#[cold]
#[inline(never)]
fn refine(ray: &Ray, x: f64, y: f64, z: f64, radius: f64, min: f64, max: f64) -> Option<Hit> {
    let (center, within) = (DVec3::new(x, y, z), Interval { min, max });
    if is_ordinary(ray.origin - center, ray.direction, radius) {
        let answer = cpu::dispatch(
            #[inline(always)]
            move || grazing::nearest::<Fused>(ray, center, radius, within),
            #[inline(always)]
            move || grazing::nearest::<Split>(ray, center, radius, within),
        );
        if let Ok(answer) = answer {
            tally::refined();
            return answer;
        }
    }
    settle(ray, x, y, z, radius, min, max)
}

/// By polynomials alone: any range, and λ next to a limit.
#[cold]
#[inline(never)]
fn settle(ray: &Ray, x: f64, y: f64, z: f64, radius: f64, min: f64, max: f64) -> Option<Hit> {
    tally::refined();
    let (center, within) = (DVec3::new(x, y, z), Interval { min, max });
    if !accepts(ray, center, radius) || within.is_empty() {
        return None;
    }
    refined!(decide(ray, center, radius, within)).unwrap_or(None)
}

/// Where `point` is: `Less` inside, `Equal` on the sphere, `Greater` outside; exactly. Finite input.
#[must_use]
pub fn side(point: DVec3, center: DVec3, radius: f64) -> Ordering {
    refined!(locate(point, center, radius)).unwrap_or(Ordering::Greater)
}

/// Whether `ray` starts strictly outside the sphere and does not meet it, or for `outward` = false starts strictly
/// inside: both exactly. A sphere that [`intersect`] accepts.
#[must_use]
pub fn departs(ray: &Ray, center: DVec3, radius: f64, outward: bool) -> bool {
    ray.is_valid()
        && (near::is_leaving(ray, center, radius, outward) || {
            let misses = || intersect(ray, center, radius, Interval::FORWARD).is_none();
            let side = side(ray.origin, center, radius);
            if outward { side.is_gt() && misses() } else { side.is_lt() }
        })
}

/// λ of the hit at about `lambda`, to a hundred bits, as an unevaluated sum.
#[must_use]
pub fn precise_lambda(ray: &Ray, center: DVec3, radius: f64, lambda: f64) -> [f64; 2] {
    if !accepts(ray, center, radius) {
        return [lambda, 0.0];
    }
    refined!(sharpen(ray, center, radius, lambda)).unwrap_or([lambda, 0.0])
}

fn accepts(ray: &Ray, center: DVec3, radius: f64) -> bool {
    ray.is_valid() && center.is_finite() && radius > 0.0 && radius.is_finite()
}

/// |f + λd|² − r² with f = origin − center, if it has roots. By Lagrange's identity its discriminant is |d|²r² − |f × d|²,
/// which does not cancel as b² − ac does from afar.
#[inline(always)]
fn quadratic<N: Number>(ray: &Ray, center: DVec3, radius: f64) -> Result<Option<Quadratic<N>>, Undecided> {
    let (f, d) = (difference::<N>(ray.origin, center), vector::<N>(ray.direction));
    let r2 = N::exactly(radius).squared();
    let w = cross(&f, &d);
    let a = dot(&d, &d);
    let discriminant = a.times(&r2).minus(&dot(&w, &w));
    if sign(&discriminant)?.is_lt() {
        return Ok(None);
    }
    Ok(Some(Quadratic { b: dot(&f, &d), c: dot(&f, &f).minus(&r2), a, discriminant }))
}

#[inline(always)]
fn decide<N: Number>(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Result<Option<Hit>, Undecided> {
    let Some(q) = quadratic::<N>(ray, center, radius)? else { return Ok(None) };
    let fine = fine(ray, center.abs().max_element().max(radius));
    nearest([(End::Falling(&q), 0), (End::Rising(&q), 0)], within, fine)
}

#[inline(always)]
fn sharpen<N: Number>(ray: &Ray, center: DVec3, radius: f64, lambda: f64) -> Result<[f64; 2], Undecided> {
    let Some(q) = quadratic::<N>(ray, center, radius)? else { return Ok([lambda, 0.0]) };
    precise(&[End::Falling(&q), End::Rising(&q)], lambda)
}

#[inline(always)]
fn locate<N: Number>(point: DVec3, center: DVec3, radius: f64) -> Result<Ordering, Undecided> {
    let f = difference::<N>(point, center);
    sign(&dot(&f, &f).minus(&N::exactly(radius).squared()))
}

#[cfg(test)]
mod tests {
    use super::super::search::{Rational, climb, cross3, dot3, each, exact, minus};
    use super::super::tally::Tally;
    use super::*;

    /// f = x₀..₂ over 2^(10·x₇), d = x₃..₅, r from |f × d|/|d| and x₆: from clear hits to grazing ones.
    pub(super) fn setting(x: &[f64]) -> Option<(DVec3, DVec3, DVec3, f64)> {
        let (c, d) = (DVec3::new(x[8], x[9], x[10]), DVec3::new(x[3], x[4], x[5]));
        let o = c + DVec3::new(x[0], x[1], x[2]) * 2f64.powf(10.0 * x[7]);
        let r = (o - c).cross(d).length() / d.length() * (1.0 + x[6].abs().powi(6));
        (is_ordinary(o - c, d, r)).then_some((o, c, d, r))
    }

    /// A, b, C, D exactly.
    pub(super) fn polynomial(o: DVec3, c: DVec3, d: DVec3, r: f64) -> [Rational; 4] {
        let (f, d, r) = (minus(o, c), exact(d), Rational::try_from(r).unwrap());
        let w = cross3(&f, &d);
        let (a, r2) = (dot3(&d, &d), &r * &r);
        [a.clone(), dot3(&f, &d), dot3(&f, &f) - &r2, a * r2 - dot3(&w, &w)]
    }

    #[test]
    fn no_input_reaches_the_bounds() {
        let worst = climb("sphere: D", 11, |x| {
            let (o, c, d, r) = setting(x)?;
            let (value, error) = discriminant(Pair::difference(o, c).hi, d, r);
            let [.., exact] = polynomial(o, c, d, r);
            Some(((exact - Rational::try_from(value).ok()?).to_f64().value() / error).abs())
        });
        assert!((0.02..1.0).contains(&worst));
        for (name, after) in [("sphere: first λ", false), ("sphere: λ after the step", true)] {
            let worst = climb(name, 11, |x| {
                let (o, c, d, r) = setting(x)?;
                let f = Pair::difference(o, c);
                let (value, error) = discriminant(f.hi, d, r);
                if value <= error {
                    return None;
                }
                let slope = x[6].signum();
                let root = value.sqrt();
                let first = (slope * root - plain_dot(f.hi, d)) * (1.0 / plain_dot(d, d));
                let (z, rest) = bounds(f.hi, d, r, root);
                let [a, b, cc, _] = polynomial(o, c, d, r);
                let (lambda, lo) = if after { step::<Split>(&f, d, r, root, slope, first) } else { (first, 0.0) };
                let bound = if after { rest } else { FIRST * z };
                if after && rest > 0.5 * U * lambda.abs() {
                    return None;
                }
                let l = Rational::try_from(lambda).ok()? + Rational::try_from(lo).ok()?;
                let off = ((&a * &l + &b + &b) * &l + cc) / (Rational::from(2) * (a * l + b));
                Some((off.to_f64().value() / bound).abs())
            });
            assert!((0.005..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    #[test]
    fn ordinary_rays_hardly_ever_need_the_cold_path() {
        let (mut cases, mut hits, before) = (0, 0, Tally::now());
        each(400_000, 9, |x| {
            let (f, u, across) = (DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5]), x[6]);
            let (Some(u), Some(side)) = (u.try_normalize(), u.cross(f).try_normalize()) else { return };
            let (center, radius) = (5.0 * f, 2f64.powf(3.0 * x[7]));
            let origin = center + side * radius * across.abs().sqrt() * 1.4 - u * radius * (6.0 + 4.0 * x[8]);
            cases += 1;
            hits += usize::from(intersect(&Ray { origin, direction: u }, center, radius, Interval::FORWARD).is_some());
        });
        let cold = Tally::now().since(before).refined;
        println!("sphere: {cold} of {cases} ordinary rays, {hits} hits");
        assert!(cold * 10_000 < cases && hits * 3 > cases);
    }

    #[test]
    fn both_products_answer_with_the_same_bits() {
        let mut seen = [0; 2];
        each(20_000, 11, |x| {
            let Some((o, c, d, r)) = setting(x) else { return };
            let ray = Ray { origin: o, direction: d };
            let answers = [fast::<Fused>(&ray, c, r, Interval::FORWARD), fast::<Split>(&ray, c, r, Interval::FORWARD)];
            assert_eq!(answers[0], answers[1]);
            seen[usize::from(answers[0].is_some())] += 1;
            let tiers = [
                decide::<super::super::bounded::Bounded<Fused>>(&ray, c, r, Interval::LINE),
                decide::<super::super::bounded::Bounded<Split>>(&ray, c, r, Interval::LINE),
            ];
            assert_eq!(tiers[0].as_ref().ok(), tiers[1].as_ref().ok());
        });
        println!("{seen:?} misses and hits");
        assert!(seen[0] > 1000 && seen[1] > 1000);
    }
}
