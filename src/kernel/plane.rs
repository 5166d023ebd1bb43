//! A plane: one quotient, N/D = n·(p−o)/n·d, to the last bit.
//!
//! Both dot products are compensated (Ogita, Rump, Oishi 2005) with the rounding errors of p−o; one remainder step makes
//! the quotient of the double-doubles. docs/numerics.md §3.

use super::bound::{LARGE, PLANE_QUOTIENT, SMALL, U, UNDERFLOW};
use super::cpu;
use super::eft::{Fused, Product, Split, two_diff, two_sum};
use super::float::{exponent_of, ldexp};
use super::number::{self, Number, difference, dot, vector};
use super::ratio::{self, Ratio};
use crate::{Hit, Interval, Ray};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// Where `ray` meets the plane n·(x − `point`) = 0, n = `normal` exactly as given and of any non-zero length, if λ lies
/// inside `within`.
///
/// A ray along the plane, n·d = 0 exactly, misses, in the plane or beside it. λ is within 1 ulp and `error` is proved.
#[inline]
#[must_use]
pub fn intersect(ray: &Ray, point: DVec3, normal: DVec3, within: Interval) -> Option<Hit> {
    cpu::dispatch(
        #[inline(always)]
        || intersect_with::<Fused>(ray, point, normal, within),
        #[inline(always)]
        || intersect_with::<Split>(ray, point, normal, within),
    )
}

/// [`intersect`] with products' rounding errors found in the way of `P`: for callers that are inside
/// [`cpu::dispatch`] already.
#[inline(always)]
#[must_use]
pub fn intersect_with<P: Product>(ray: &Ray, point: DVec3, normal: DVec3, within: Interval) -> Option<Hit> {
    match quotient::<P>(ray, point, [normal, DVec3::ZERO], within) {
        Quotient::Outside => None,
        Quotient::Inside { lambda, error } => Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 }),
        Quotient::Uncertain => refine(ray, point, normal, within),
    }
}

/// What the fast path says of N/D.
#[derive(Clone, Copy, Debug)]
pub(super) enum Quotient {
    /// λ is certain to lie outside the interval.
    Outside,
    /// λ is certain to lie inside.
    Inside { lambda: f64, error: f64 },
    /// Neither is certain, or λ is not known well enough.
    Uncertain,
}

/// n·(p−o)/n·d, the normal a double-double that is off by at most 2u² of each component.
#[inline(always)]
pub(super) fn quotient<P: Product>(ray: &Ray, point: DVec3, [n, n_lo]: [DVec3; 2], within: Interval) -> Quotient {
    let (o, d) = (ray.origin, ray.direction);
    let ((sx, tx), (sy, ty), (sz, tz)) = (two_diff(point.x, o.x), two_diff(point.y, o.y), two_diff(point.z, o.z));
    let (s, s_lo) = (DVec3::new(sx, sy, sz), DVec3::new(tx, ty, tz));
    let (num, num_lo, num_size) = dot2::<P>(n, s, n.dot(s_lo) + n_lo.dot(s));
    let (den, den_lo, den_size) = dot2::<P>(n, d, n_lo.dot(d));
    let inverse = 1.0 / den;
    let q = num * inverse;
    let (t, t_lo) = P::two_product(q, den);
    let remainder = ((num - t) - t_lo) + (num_lo - q * den_lo);
    let lambda = q + remainder * inverse;

    let kappa = den_size * inverse.abs();
    let vanished = UNDERFLOW * inverse.abs();
    let sizes = n.abs().element_sum() + d.abs().element_sum() + s.abs().element_sum();
    let beyond_rounding = PLANE_QUOTIENT * (kappa * (num_size * inverse.abs() + q.abs() * kappa))
        + vanished * (1.0 + q.abs()) * (1.0 + sizes);
    let error = (U * lambda.abs() + beyond_rounding) * (1.0 + 8.0 * U);
    // A NaN anywhere makes one of these false.
    let usable = (kappa < 1.0 / (64.0 * U))
        & (vanished < 1.0)
        & (sizes + den.abs() + q.abs() < LARGE)
        & (lambda.abs() > SMALL)
        & ((beyond_rounding < 0.5 * U * lambda.abs()) || (beyond_rounding * largest(d) < FLOOR * largest(s)));
    if !usable {
        return Quotient::Uncertain;
    }
    if (lambda - error > within.min) & (lambda + error < within.max) {
        return Quotient::Inside { lambda, error };
    }
    if (lambda + error < within.min) | (lambda - error > within.max) {
        return Quotient::Outside;
    }
    Quotient::Uncertain
}

/// λ need not be better known than to ½u·2⁻⁴⁴ of the distance to `point` over the direction's length.
const FLOOR: f64 = 0.5 * U / (1u64 << 44) as f64;

fn largest(v: DVec3) -> f64 {
    v.abs().max_element()
}

/// a·b + low in double-double, and Σ|aᵢbᵢ|; |low| ≤ 2u·Σ|aᵢbᵢ|.
#[inline(always)]
fn dot2<P: Product>(a: DVec3, b: DVec3, low: f64) -> (f64, f64, f64) {
    let (x, x_lo) = P::two_product(a.x, b.x);
    let (y, y_lo) = P::two_product(a.y, b.y);
    let (z, z_lo) = P::two_product(a.z, b.z);
    let (xy, e) = two_sum(x, y);
    let (sum, f) = two_sum(xy, z);
    (sum, (e + f) + (((x_lo + y_lo) + z_lo) + low), (x.abs() + y.abs()) + z.abs())
}

fn ratio<N: Number>(ray: &Ray, point: DVec3, normal: DVec3) -> Ratio<N> {
    let n = vector(normal);
    Ratio { numerator: dot(&n, &difference(point, ray.origin)), denominator: dot(&n, &vector(ray.direction)) }
}

#[cold]
#[inline(never)]
fn refine(ray: &Ray, point: DVec3, normal: DVec3, within: Interval) -> Option<Hit> {
    if !ray.is_valid() || within.is_empty() || !point.is_finite() || !normal.is_finite() {
        return None;
    }
    // Axis-parallel rays along axis-parallel planes are common.
    if (0..3).all(|i| normal[i] == 0.0 || ray.direction[i] == 0.0) {
        return None;
    }
    let (lambda, error) =
        ratio::refine(|| ratio(ray, point, normal), || ratio(ray, point, normal), within, ratio::floor(ray, point))?;
    Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 })
}

/// λ to about a hundred bits, as an unevaluated sum of two floats; zero where the ray lies along the plane.
#[must_use]
pub fn precise_lambda(ray: &Ray, point: DVec3, normal: DVec3) -> [f64; 2] {
    ratio::precise(|| ratio(ray, point, normal), || ratio(ray, point, normal))
}

/// The exact sign of n·(x − `point`): on which side of the plane `x` lies. All arguments finite.
#[must_use]
pub fn side(point: DVec3, normal: DVec3, x: DVec3) -> Ordering {
    fn form<N: Number>(point: DVec3, normal: DVec3, x: DVec3) -> N {
        dot(&vector(normal), &difference(x, point))
    }
    number::sign_of(|| form(point, normal, x), || form(point, normal, x))
}

/// `x`, which lies near the plane through `point` with the normal `n` + `n_lo` of any length, moved onto it along the
/// normal, and a bound on its distance from the plane: little more than what rounding the three coordinates costs.
/// docs/numerics.md §3.
#[must_use]
pub fn project(point: DVec3, [n, n_lo]: [DVec3; 2], x: DVec3) -> (DVec3, f64) {
    // A power of two makes the normal short enough to be squared.
    let k = -exponent_of(n.abs().max_element());
    let scaled = |v: DVec3| DVec3::from(v.to_array().map(|x| ldexp(x, k)));
    let (n, n_lo) = (scaled(n), scaled(n_lo));
    let ((sx, tx), (sy, ty), (sz, tz)) = (two_diff(x.x, point.x), two_diff(x.y, point.y), two_diff(x.z, point.z));
    let (s, s_lo) = (DVec3::new(sx, sy, sz), DVec3::new(tx, ty, tz));
    let (h, h_lo, size) = dot2::<Split>(n, s, n.dot(s_lo) + n_lo.dot(s));
    let (h, length) = (h + h_lo, n.length());
    let moved = x - n * (h / (length * length));
    let off = (34.0 * U * U * size + 8.0 * U * h.abs() + UNDERFLOW) / length;
    let rounding = U * n.abs().dot(moved.abs()) / length;
    (moved, (off + rounding) * (1.0 + 16.0 * U))
}
