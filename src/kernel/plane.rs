//! A plane: one quotient, N/D = n·(p−o)/n·d, to the last bit.
//!
//! Both dot products are compensated (Ogita, Rump, Oishi 2005) with the rounding errors of p−o; one remainder step
//! makes the quotient of the double-doubles. docs/numerics.md §3.

use super::bound::{LARGE, PLANE_CONDITION, PLANE_LAMBDA, PLANE_QUOTIENT, U, UNDERFLOW};
use super::cpu;
use super::eft::{Fused, Product, Split, two_diff, two_sum};
use super::float::{exponent_of, ldexp, power};
use super::lanes::{Double, Lanes, Two};
use super::leaving;
use super::number::{self, Number, difference, dot, vector};
use super::ratio::{self, Ratio};
use super::tally;
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
    let (point, normal, within) = (&point, &normal, &within);
    cpu::dispatch_function!(fast(ray: &Ray, point: &DVec3, normal: &DVec3, within: &Interval) -> Option<Hit>)
}

/// [`intersect`] with products' rounding errors found in the way of `P`: for callers that are inside
/// [`cpu::dispatch`] already.
#[inline(always)]
#[must_use]
pub fn intersect_with<P: Product>(ray: &Ray, point: DVec3, normal: DVec3, within: Interval) -> Option<Hit> {
    fast::<P>(P::cpu(), ray, &point, &normal, &within)
}

#[inline(always)]
fn fast<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    normal: &DVec3,
    within: &Interval,
) -> Option<Hit> {
    match quotient::<P>(cpu, ray, point, normal, None, within) {
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

/// n·d and n·(p − o) side by side, in this order.
#[derive(Clone, Copy, Debug)]
struct Dots<H> {
    /// The products of components, x, z, y: of x + y the compiler would make a horizontal sum, which takes longer.
    terms: [H; 3],
    /// Their sums, rounded.
    sums: H,
    /// What is to be added.
    low: H,
}

/// λ = `q` + `correction`, before it is rounded.
#[derive(Clone, Copy, Debug)]
struct Solved {
    q: f64,
    correction: f64,
    /// 1/D
    inverse: f64,
}

/// The normal is a float vector, or a double-double that is off by at most 2u² of each component.
#[inline(always)]
fn dots<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    n: &DVec3,
    n_lo: Option<&DVec3>,
) -> Dots<<P::Lanes as Lanes>::Half> {
    let lanes = |v: &DVec3| P::Lanes::of(cpu, *v);
    let (d, s) = (lanes(&ray.direction), Double::difference(lanes(point), lanes(&ray.origin)));
    let (nd, ns) = match n_lo {
        None => (Double::product(lanes(n), d), s.times_float(lanes(n))),
        Some(n_lo) => {
            let n = Double { hi: lanes(n), lo: lanes(n_lo) };
            (n.times_float(d), n.times(s))
        }
    };
    let ([x, y, z], [x_lo, y_lo, z_lo]) = (nd.hi.rows(ns.hi), nd.lo.rows(ns.lo));
    let (xz, rounding) = two_sum(x, z);
    let (sums, more_rounding) = two_sum(xz, y);
    Dots { terms: [x, z, y], sums, low: (rounding + more_rounding) + ((x_lo + z_lo) + y_lo) }
}

impl<H: Two> Dots<H> {
    /// Neither sum has lost more than 18 of its bits, nor anything that counts to underflow. An overflow is not seen
    /// here.
    #[inline(always)]
    fn are_known(&self) -> bool {
        let &Self { terms: [x, z, _], sums, .. } = self;
        // The third term is no larger than the sum and the first two.
        let least = (x.abs() + z.abs()) * sums.splat(4.0 / PLANE_CONDITION) + sums.splat(PRESENT);
        !sums.abs().any_le(least)
    }

    /// Of sums that are known: whether λ is below zero, before anything is divided.
    #[inline(always)]
    fn are_behind(&self) -> bool {
        let [den, num] = self.sums.to_array();
        // After an overflow the sign of a sum may be wrong.
        den * num < 0.0 && den * num > -LARGE
    }

    #[inline(always)]
    fn solve<P: Product>(&self) -> Solved {
        let ([den, num], [den_lo, num_lo]) = (self.sums.to_array(), self.low.to_array());
        let inverse = 1.0 / den;
        let q = num * inverse;
        let remainder = P::remainder(num, q, den) + (num_lo - q * den_lo);
        Solved { q, correction: remainder * inverse, inverse }
    }

    /// A sharp bound on what λ is off before it is rounded, if that is little enough.
    #[inline(always)]
    fn beyond_rounding(&self, &Solved { q, inverse, .. }: &Solved, ray: &Ray, point: &DVec3) -> Option<f64> {
        let [x, z, y] = self.terms;
        let [den_size, num_size] = ((x.abs() + z.abs()) + y.abs()).to_array();
        let (over, size) = (inverse.abs(), num_size + q.abs() * den_size);
        let kappa = den_size * over;
        let beyond_rounding = PLANE_QUOTIENT * kappa * (over * size);
        let [md, ms] = [ray.direction, *point - ray.origin].map(|v| v.abs().max_element());
        let tiny = beyond_rounding * md < FLOOR * ms;
        let known = ((beyond_rounding < 0.25 * U * q.abs()) | tiny) & (kappa < 1.0 / (64.0 * U));
        let [den, _] = self.sums.to_array();
        (known & (den.abs() > PRESENT) & (q.abs() > PRESENT)).then_some(beyond_rounding)
    }
}

/// λ against the interval.
#[inline(always)]
pub(super) fn quotient<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    n: &DVec3,
    n_lo: Option<&DVec3>,
    within: &Interval,
) -> Quotient {
    let dots = dots::<P>(cpu, ray, point, n, n_lo);
    if !dots.are_known() {
        return Quotient::Uncertain;
    }
    // Half of all rays, and a branch that nothing foretells: it is not kept waiting for the division.
    if dots.are_behind() && within.min >= 0.0 {
        return Quotient::Outside;
    }
    let Solved { q, correction, .. } = dots.solve::<P>();
    let error = (U + PLANE_LAMBDA) * q.abs();
    if error > (U + PLANE_LAMBDA) * PRESENT { place(q + correction, error, within) } else { Quotient::Uncertain }
}

/// [`quotient`] with a sharper bound, which knows planes that are nearly grazed, and origins next to them.
pub(super) fn quotient_closely(
    ray: &Ray,
    point: &DVec3,
    n: &DVec3,
    n_lo: Option<&DVec3>,
    within: Interval,
) -> Quotient {
    cpu::dispatch_lanes(
        #[inline(always)]
        |cpu| closely::<Fused>(cpu, ray, point, n, n_lo, within),
        #[inline(always)]
        || closely::<Split>((), ray, point, n, n_lo, within),
    )
}

#[inline(always)]
fn closely<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    n: &DVec3,
    n_lo: Option<&DVec3>,
    within: Interval,
) -> Quotient {
    let dots = dots::<P>(cpu, ray, point, n, n_lo);
    let solved = dots.solve::<P>();
    let Some(beyond_rounding) = dots.beyond_rounding(&solved, ray, point) else { return Quotient::Uncertain };
    let error = (U * solved.q.abs() + beyond_rounding) * (1.0 + 8.0 * U);
    place(solved.q + solved.correction, error, &within)
}

#[inline(always)]
fn place(lambda: f64, error: f64, within: &Interval) -> Quotient {
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

/// Denominators and quotients above this, and with them numerators, lose nothing that counts by underflow.
const PRESENT: f64 = power(-450);

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

/// By references, so that the caller's vectors stay in registers, and the limits in memory till they are compared with.
#[cold]
#[inline(never)]
fn refine(ray: &Ray, point: &DVec3, normal: &DVec3, within: &Interval) -> Option<Hit> {
    tally::refined();
    let within = *within;
    if !ray.is_valid() || within.is_empty() || !point.is_finite() || !normal.is_finite() {
        return None;
    }
    // Axis-parallel rays along axis-parallel planes are common.
    if (0..3).all(|i| normal[i] == 0.0 || ray.direction[i] == 0.0) {
        return None;
    }
    match quotient_closely(ray, point, normal, None, within) {
        Quotient::Outside => None,
        Quotient::Inside { lambda, error } => Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 }),
        Quotient::Uncertain => {
            let (lambda, error) = ratio::refine(
                || ratio(ray, *point, *normal),
                || ratio(ray, *point, *normal),
                within,
                ratio::floor(ray, *point),
            )?;
            Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 })
        }
    }
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

/// Whether `ray` starts strictly on the side of the plane that `normal` points to, or for `outward` = false on the
/// other, and does not meet the plane on its way: both exactly. `point` and `normal` finite.
#[must_use]
pub fn departs(ray: &Ray, point: DVec3, normal: DVec3, outward: bool) -> bool {
    leaving::plane(ray, &point, &[normal, DVec3::ZERO], outward).unwrap_or_else(|| {
        ray.is_valid()
            && side(point, normal, ray.origin) == leaving::side(outward)
            && intersect(ray, point, normal, Interval::FORWARD).is_none()
    })
}

/// `x`, which lies near the plane through `point` with the normal `n` + `n_lo` of any length, moved onto it along the
/// normal, and a bound on its distance from the plane: little more than what rounding the three coordinates costs.
/// docs/numerics.md §3.
#[must_use]
pub fn project(point: DVec3, [n, n_lo]: [DVec3; 2], x: DVec3) -> (DVec3, f64) {
    // Powers of two make the normal short enough to be squared, and keep the largest coordinates from overflowing.
    let (length, far) = (n.abs().max_element(), x.abs().max(point.abs()).max_element() > power(900));
    // Of a longer one a subnormal multiple would lose more than `UNDERFLOW`, which a shorter one would make more of.
    if (power(-10)..power(60)).contains(&length) && !far {
        return foot(point, [n, n_lo], x);
    }
    let scaled = |v: DVec3| v.map(|x| ldexp(x, -exponent_of(length)));
    let (down, up) = if far { (power(-200), power(200)) } else { (1.0, 1.0) };
    let (moved, off) = foot(point * down, [scaled(n), scaled(n_lo)], x * down);
    (moved * up, off * up)
}

/// [`project`] where nothing overflows.
fn foot(point: DVec3, normal: [DVec3; 2], x: DVec3) -> (DVec3, f64) {
    // Products so small that their low parts vanish would have other bits.
    let vanishing = |x: f64| x != 0.0 && x.abs() < power(-850);
    if (x - point).to_array().into_iter().any(vanishing) {
        return foot_with::<Split>(point, normal, x);
    }
    cpu::dispatch(
        #[inline(always)]
        move || foot_with::<Fused>(point, normal, x),
        #[inline(always)]
        move || foot_with::<Split>(point, normal, x),
    )
}

#[inline(always)]
fn foot_with<P: Product>(point: DVec3, [n, n_lo]: [DVec3; 2], x: DVec3) -> (DVec3, f64) {
    let ((sx, tx), (sy, ty), (sz, tz)) = (two_diff(x.x, point.x), two_diff(x.y, point.y), two_diff(x.z, point.z));
    let (s, s_lo) = (DVec3::new(sx, sy, sz), DVec3::new(tx, ty, tz));
    let (h, h_lo, size) = dot2::<P>(n, s, n.dot(s_lo) + n_lo.dot(s));
    let (h, length) = (h + h_lo, n.length());
    let moved = x - n * (h / (length * length));
    let off = (34.0 * U * U * size + 10.0 * U * h.abs() + UNDERFLOW) / length + UNDERFLOW;
    let rounding = U * n.abs().dot(moved.abs()) / length;
    (moved, (off + rounding) * (1.0 + 16.0 * U))
}

#[cfg(test)]
mod tests {
    use super::super::search::{Rational, climb, dot3, each, exact, minus};
    use super::super::tally::Tally;
    use super::*;

    /// Origin, direction, point, normal: from steep to grazing by x₁₂, from far to next to the plane by x₁₃.
    fn setting(x: &[f64]) -> (Ray, DVec3, DVec3) {
        let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
        let (point, normal) = (v(0), v(3));
        let across = normal.cross(v(6)).normalize_or(DVec3::X);
        let direction = across + normal * x[12].powi(9);
        let origin = point + v(9).cross(normal) + normal * 2f64.powf(20.0 * x[13]);
        (Ray { origin, direction }, point, normal)
    }

    /// |error of λ before its rounding|/bound, for the answers that are given.
    fn off<const CLOSE: bool>(x: &[f64]) -> Option<f64> {
        let (ray, point, normal) = setting(x);
        let dots = dots::<Split>((), &ray, &point, &normal, None);
        let solved @ Solved { q, correction, .. } = dots.solve::<Split>();
        let beyond_rounding = if CLOSE {
            dots.beyond_rounding(&solved, &ray, &point)?
        } else {
            dots.are_known().then_some(PLANE_LAMBDA * q.abs())?
        };
        let n = exact(normal);
        let lambda = dot3(&n, &minus(point, ray.origin)) / dot3(&n, &exact(ray.direction));
        let [q, correction] = [q, correction].map(|x| Rational::try_from(x).unwrap());
        Some((lambda - q - correction).to_f64().value().abs() / beyond_rounding)
    }

    #[test]
    fn no_input_reaches_the_bounds() {
        // The first constant is as large as λ's accuracy allows.
        let worst = climb("plane: λ", 14, off::<false>);
        assert!(worst < 1.0);
        let worst = climb("plane: λ, closely", 14, off::<true>);
        assert!((0.003..1.0).contains(&worst));
    }

    /// p − o overflows to +∞, n·(p − o) does not and is below zero.
    #[test]
    fn an_overflow_is_not_taken_for_a_miss() {
        let (point, normal) = (DVec3::new(-1e10, 1.7e308, 0.0), DVec3::new(1.0, 1e-300, 0.0));
        let ray = Ray { origin: DVec3::new(0.0, -1.7e308, 0.0), direction: -DVec3::X };
        let hit = intersect(&ray, point, normal, Interval::FORWARD).expect("a hit");
        assert_eq!(hit.lambda, 1e10 - 3.4e8);
    }

    /// Nor does a long normal cost digits where coordinates are tiny.
    #[test]
    fn points_of_tiny_planes_are_as_good_as_they_say() {
        let mut worst = 0.0;
        each(20_000, 9, |x| {
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            for (length, size) in [(90, -980), (59, -1000), (-59, -1000), (70, 950), (0, 0)] {
                let (n, point) = (power(length) * v(0), power(size) * v(3));
                let near = point + power(size) * (v(6).cross(v(0)) + x[3] * v(0));
                let (moved, error) = project(point, [n, DVec3::ZERO], near);
                let height = dot3(&exact(v(0)), &minus(moved, point)) / Rational::try_from(v(0).length()).unwrap();
                let ratio = height / Rational::try_from(error).unwrap();
                worst = f64::max(worst, ratio.to_f64().value().abs());
            }
        });
        println!("plane: points off by {worst:.3} of their bound at most");
        assert!((0.3..1.0).contains(&worst));
    }

    #[test]
    fn ordinary_rays_hardly_ever_need_the_cold_path() {
        let (mut cases, mut hits, before) = (0, 0, Tally::now());
        each(400_000, 12, |x| {
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            let ray = Ray { origin: 5.0 * v(0), direction: v(3) };
            cases += 1;
            hits += usize::from(intersect(&ray, v(6), v(9), Interval::FORWARD).is_some());
        });
        let cold = Tally::now().since(before).refined;
        println!("plane: {cold} of {cases} ordinary rays, {hits} hits");
        assert!(cold * 10_000 < cases && hits * 3 > cases);
    }
}
