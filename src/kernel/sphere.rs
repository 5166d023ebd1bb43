//! Ray and sphere.
//!
//! With f = origin − center: A = |d|², b = f·d, D = r²A − |f × d|² (Lagrange's form of b² − AC, whose error grows with
//! |f|, not with |f|²), λ = (−b ∓ √D)/A, then one Newton step with the residual |f + λd|² − r² in double-double, whose
//! slope at the root is ∓2√D. docs/numerics.md §5 proves every constant.
//!
//! Close to Haines, Günther, Akenine-Möller 2019 (Ray Tracing Gems ch. 7) in the discriminant; the step, the bounds and
//! the exact refinement are this crate's.

use super::bound::U;
use super::cpu;
use super::eft::{Fused, Product, Split, two_diff, two_sum};
use super::number::{Number, cross, difference, dot, vector};
use super::section::{End, Quadratic, Undecided, fine, nearest, precise, refined, sign};
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// |error of D| ≤ this·A·r·(r + |f|₁), wherever D and its rounded value are not both clearly negative.
const DISCRIMINANT: f64 = 12.0 * U;
/// |error of the first λ| ≤ this·z, z = u·r·(r + |f|₁)/√D.
const FIRST: f64 = 22.0;
/// After the step: |error of λ| ≤ z·(`SQUARED`·A·z/√D + `RESIDUAL`), besides its last rounding.
const SQUARED: f64 = 520.0;
/// See [`SQUARED`].
const RESIDUAL: f64 = 144.0 * U;
/// |f|₁ + r below this many radii keeps second-order terms within the constants.
const FAR: f64 = (1u64 << 46) as f64;

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
        || fast::<Fused>(ray, center, radius, within),
        #[inline(always)]
        || fast::<Split>(ray, center, radius, within),
    )
}

/// The same bits for either [`Product`].
#[inline(always)]
fn fast<P: Product>(ray: &Ray, center: DVec3, r: f64, within: Interval) -> Option<Hit> {
    let (o, d) = (ray.origin, ray.direction);
    let cold = || refine(ray, center.x, center.y, center.z, r, within.min, within.max);
    let ((fx, ex), (fy, ey), (fz, ez)) = (two_diff(o.x, center.x), two_diff(o.y, center.y), two_diff(o.z, center.z));
    let a = d.x * d.x + d.y * d.y + d.z * d.z;
    let b = fx * d.x + fy * d.y + fz * d.z;
    let (wx, wy, wz) = (fy * d.z - fz * d.y, fz * d.x - fx * d.z, fx * d.y - fy * d.x);
    let size = r + (fx.abs() + fy.abs() + fz.abs());
    let ar = a * r;
    let discriminant = ar * r - (wx * wx + wy * wy + wz * wz);
    // NaN fails every one of these.
    let ordinary = in_range(r, 225) & in_range(ar * r, 500) & (size < FAR * r);
    if !(ordinary & (discriminant.abs() > DISCRIMINANT * ar * size)) {
        return cold();
    }
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let over_root = 1.0 / root;
    let z = U * r * size * over_root;
    let rest = z * (SQUARED * a * z * over_root + RESIDUAL);
    // λ + lo after the step from λ₀; `slope` is the sign of the polynomial's slope at the root.
    let step = |first: f64, slope: f64| {
        let component = |f: f64, e: f64, d: f64| {
            let (p, p_lo) = P::two_product(first, d);
            let (h, h_lo) = two_sum(f, p);
            (h, h_lo + (p_lo + e))
        };
        let (hx, lx) = component(fx, ex, d.x);
        let (hy, ly) = component(fy, ey, d.y);
        let (hz, lz) = component(fz, ez, d.z);
        let ((x2, x2_lo), (y2, y2_lo)) = (P::two_product(hx, hx), P::two_product(hy, hy));
        let ((z2, z2_lo), (r2, r2_lo)) = (P::two_product(hz, hz), P::two_product(r, r));
        let ((s, s_lo), (t, t_lo)) = (two_sum(x2, y2), two_diff(z2, r2));
        let (residual, residual_lo) = two_sum(s, t);
        let cross = lx * (2.0 * hx + lx) + ly * (2.0 * hy + ly) + lz * (2.0 * hz + lz);
        let low = (residual_lo + (s_lo + t_lo)) + ((x2_lo + y2_lo) + (z2_lo - r2_lo)) + cross;
        two_sum(first, -slope * 0.5 * over_root * (residual + low))
    };
    for slope in [-1.0, 1.0] {
        let first = (slope * root - b) / a;
        if slope < 0.0 && first + FIRST * z <= within.min {
            continue;
        }
        let (lambda, lo) = step(first, slope);
        let error = (lo.abs() + rest) * (1.0 + 8.0 * U);
        let inside = (lambda - error > within.min) & (lambda + error < within.max);
        if inside & (rest <= 0.5 * U * lambda.abs()) {
            return Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 });
        }
        if lambda + error < within.min {
            continue;
        }
        if lambda - error > within.max {
            return None;
        }
        // Next to the origin an ulp of 2⁻⁴⁰ of the largest coordinate is what counts; that is size/7 or more.
        let near = size / (7.0 * (d.x.abs() + d.y.abs() + d.z.abs())) * (1.0 / (1u64 << 40) as f64);
        if inside & (rest <= 0.5 * U * near) {
            return Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 });
        }
        return cold();
    }
    None
}

/// 2⁻ᵉ ≤ x < 2ᵉ
#[inline(always)]
fn in_range(x: f64, e: u64) -> bool {
    let least = (1023 - e) << 52;
    x.to_bits().wrapping_sub(least) < (2 * e) << 52
}

/// Scalars, so that the caller's vectors stay in registers.
#[cold]
#[inline(never)]
fn refine(ray: &Ray, x: f64, y: f64, z: f64, radius: f64, min: f64, max: f64) -> Option<Hit> {
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

/// |f + λd|² − r² with f = origin − center. By Lagrange's identity its discriminant is |d|²r² − |f × d|², which does
/// not cancel as b² − ac does from afar.
#[inline(always)]
fn quadratic<N: Number>(ray: &Ray, center: DVec3, radius: f64) -> Quadratic<N> {
    let (f, d) = (difference::<N>(ray.origin, center), vector::<N>(ray.direction));
    let r2 = N::exactly(radius).squared();
    let w = cross(&f, &d);
    let a = dot(&d, &d);
    let discriminant = a.times(&r2).minus(&dot(&w, &w));
    Quadratic { b: dot(&f, &d), c: dot(&f, &f).minus(&r2), a, discriminant }
}

#[inline(always)]
fn decide<N: Number>(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Result<Option<Hit>, Undecided> {
    let q = quadratic::<N>(ray, center, radius);
    if sign(&q.discriminant)?.is_lt() {
        return Ok(None);
    }
    let fine = fine(ray, center.abs().max_element().max(radius));
    nearest([(End::Falling(&q), 0), (End::Rising(&q), 0)], within, fine)
}

#[inline(always)]
fn sharpen<N: Number>(ray: &Ray, center: DVec3, radius: f64, lambda: f64) -> Result<[f64; 2], Undecided> {
    let q = quadratic::<N>(ray, center, radius);
    if sign(&q.discriminant)?.is_lt() {
        return Ok([lambda, 0.0]);
    }
    precise(&[End::Falling(&q), End::Rising(&q)], lambda)
}

#[inline(always)]
fn locate<N: Number>(point: DVec3, center: DVec3, radius: f64) -> Result<Ordering, Undecided> {
    let f = difference::<N>(point, center);
    sign(&dot(&f, &f).minus(&N::exactly(radius).squared()))
}
