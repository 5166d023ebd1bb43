//! A triangle, decided exactly.
//!
//! The three edge functions of Möller and Trumbore 1997 in the arrangement that shares d×(o−a), their signs certified
//! by one filter; λ is the plane's quotient with a normal in double-double, its bound proved beforehand. Where the
//! filter is silent the signs are found in double-double, in integers or by [`Dyadic`]s. docs/numerics.md §4.

use crate::kernel::bound::{
    LARGEST, TRIANGLE_CLOSE, TRIANGLE_CONDITION, TRIANGLE_LAMBDA, TRIANGLE_SIDES, U, UNDERFLOW, VANISHED,
};
use crate::kernel::bounded::Bounded;
use crate::kernel::cpu;
use crate::kernel::dyadic::Dyadic;
use crate::kernel::eft::{Fused, Product, Split, two_diff, two_sum};
use crate::kernel::fixed;
use crate::kernel::float::power;
use crate::kernel::lanes::{Double, Lanes, Two};
use crate::kernel::number::{self, Number, cross, difference, dot, vector};
use crate::kernel::ratio::{self, Ratio};
use crate::kernel::tally;
use crate::{Hit, Interval, Ray};
use fearless_simd::{Simd, f64x4};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;
use std::hint::black_box;

pub mod eight;
mod surface;

pub use surface::{departs, normal, point, side};

/// Where `ray` meets the closed triangle of the three `vertices`, if λ lies inside `within`.
///
/// Edges and vertices belong to the triangle; a ray in its plane misses, and so does every ray of a triangle whose
/// vertices lie on one line. Hit or miss, and inside the interval or not, are decided as real arithmetic on the floats
/// given would; λ is within 4 ulp and `error` is proved. `uv` holds the weights of the second and third vertex, to 2⁻²⁴
/// or better.
#[inline]
#[must_use]
pub fn intersect(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    // By reference: limits in registers would be moved to memory.
    let within = &within;
    cpu::dispatch_function!(fast(ray: &Ray, vertices: &[DVec3; 3], within: &Interval) -> Option<Hit>)
}

/// [`intersect`] with products' rounding errors found in the way of `P`: for callers that are inside
/// [`cpu::dispatch`] already.
#[inline(always)]
#[must_use]
pub fn intersect_with<P: Product>(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    fast::<P>(P::cpu(), ray, vertices, &within)
}

#[inline(always)]
fn fast<P: Product>(cpu: <P::Lanes as Lanes>::Cpu, ray: &Ray, vertices: &[DVec3; 3], within: &Interval) -> Option<Hit> {
    let products = Products::<P>::new::<true>(cpu, ray, vertices.map(|v| P::Lanes::of(cpu, v)), false);
    let &Products { det, su, sv, ref sizes, .. } = &products;
    let uncertain = || closely(ray, vertices, within);
    if !sizes.are_ordinary() {
        return uncertain();
    }
    let bound = TRIANGLE_SIDES * sizes.of_sides() + VANISHED;
    let agreement = agreement(su, sv, (det - su) - sv);
    if agreement < -bound {
        return None;
    }
    let agreed = agreement > bound;
    if !agreed {
        return uncertain();
    }
    // Begun early: what follows waits for it.
    let inverse = 1.0 / det;
    if !products.are_known() || bound * inverse.abs() > WEIGHT {
        return uncertain();
    }
    let hit = products.hit(inverse);
    let (from, to) = (hit.lambda - hit.error, hit.lambda + hit.error);
    if (from > within.min) & (to < within.max) {
        return Some(hit);
    }
    if (to < within.min) | (from > within.max) {
        return None;
    }
    uncertain()
}

/// How far all three are from zero on one side of it; below zero by how far they are on both. NaN if the third is.
#[inline(always)]
fn agreement(u: f64, v: f64, w: f64) -> f64 {
    let (least, most) = extremes(u, v, w);
    // Without a branch on the orientation, which would be foretold by nothing.
    if least > -most { least } else { -most }
}

/// The hit of a ray that a mesh's filter has proved to meet the triangle at a λ that counts, to the bit as
/// [`intersect_with`] has it; `None` where that would leave its fast path. That the edge functions would satisfy it
/// follows from the margins of the filter and of this file: docs/numerics.md §4. `plain`: b − a and c − a are vectors
/// of floats. `least`: that |D| and |N| are large enough if they are above these, where the filter knows it; else their
/// sizes are found here. For code that was dispatched to the instructions of `simd`.
#[inline(always)]
#[must_use]
pub fn passed<S: Simd>(
    simd: S,
    ray: &Ray,
    vertices: [f64x4<S>; 3],
    plain: bool,
    least: Option<[f64; 2]>,
) -> Option<Hit> {
    let vertices = [vertices[0].into(), vertices[1].into(), vertices[2].into()];
    match cpu::fused_lanes_of(simd) {
        Some(cpu) => hit_of_passed::<Fused>(cpu, ray, &vertices, plain, least),
        None => hit_of_passed::<Split>((), ray, &vertices, plain, least),
    }
}

#[inline(always)]
fn hit_of_passed<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    [a, b, c]: &[[f64; 4]; 3],
    plain: bool,
    least: Option<[f64; 2]>,
) -> Option<Hit> {
    let vertices = [P::Lanes::new(cpu, *a), P::Lanes::new(cpu, *b), P::Lanes::new(cpu, *c)];
    let products = Products::<P>::new::<false>(cpu, ray, vertices, plain);
    let inverse = 1.0 / products.det;
    let known = if let Some([of_det, of_height]) = least {
        (products.det.abs() > of_det) & (products.height.abs() > of_height)
    } else {
        let bound = TRIANGLE_SIDES * products.sizes.of_sides() + VANISHED;
        products.sizes.are_ordinary() & (bound * inverse.abs() <= WEIGHT) && products.are_known()
    };
    known.then(|| products.hit(inverse))
}

/// Whether b − a and c − a are vectors of floats.
#[cfg(test)]
pub(crate) fn has_plain_edges(&[a, b, c]: &[DVec3; 3]) -> bool {
    [b, c].into_iter().all(|v| (0..3).all(|i| two_diff(v[i], a[i]).1 == 0.0))
}

/// The triple products D, n·s, s(c,a), s(a,b).
struct Products<P: Product> {
    det: f64,
    height: f64,
    su: f64,
    sv: f64,
    /// What D and n·s have beyond that.
    low: <P::Lanes as Lanes>::Half,
    /// |D| and |n·s|.
    present: <P::Lanes as Lanes>::Half,
    sizes: Sizes,
    /// The largest components of d and s.
    m_d_s: <P::Lanes as Lanes>::Half,
}

impl<P: Product> Products<P> {
    /// `DECIDE`: there will be a branch on them. What n is made of would be kept in memory till after it, and takes
    /// longer there than n's low part does now.
    #[inline(always)]
    fn new<const DECIDE: bool>(
        cpu: <P::Lanes as Lanes>::Cpu,
        ray: &Ray,
        [a, b, c]: [P::Lanes; 3],
        plain: bool,
    ) -> Self {
        // u·e₁ + v·e₂ − λ·d = s. Crossing leaves components turned: what is multiplied with n is turned as n is.
        let (o, d) = (P::Lanes::turned_back(cpu, ray.origin), P::Lanes::turned_back(cpu, ray.direction));
        let (e1, e2, s) =
            (Double::difference(b, a), Double::difference(c, a), Double::difference(o, a.turned().turned()));
        let n = e1.cross_turned_back(e2, plain);
        let n = if DECIDE { Double { hi: n.hi, lo: black_box(n.lo) } } else { n };
        let (nd, ns) = (n.times_float(d), n.times(s));
        // (y, z, x), as the edges are turned for n.
        let q = d * s.hi.turned() - P::Lanes::of(cpu, ray.direction) * s.hi;
        let ([z, x, y], [v, w, u]) = (nd.hi.rows(ns.hi), (q * e2.hi.turned()).rows(q * e1.hi.turned()));
        let (xy, rounding) = two_sum(d.joined(x, u), d.joined(y, v));
        let (forms, more_rounding) = two_sum(xy, d.joined(z, w));
        let [det, height, su, minus_sv] = forms.to_array();
        let [lz, lx, ly] = nd.lo.rows(ns.lo);
        let low = (rounding + more_rounding).low() + ((lx + ly) + lz);
        let (sizes, m_d_s) = Sizes::new([d, s.hi, e1.hi, e2.hi]);
        Self { det, height, su, sv: -minus_sv, low, present: forms.low().abs(), sizes, m_d_s }
    }

    /// Proved before λ is computed: neither D nor N has lost more than 18 of its bits.
    #[inline(always)]
    fn are_known(&self) -> bool {
        let Self { present, m_d_s, ref sizes, .. } = *self;
        let least = m_d_s * m_d_s.splat(sizes.m12);
        let least = least + least.splat(TRIANGLE_CONDITION * PRESENT);
        (present * present.splat(TRIANGLE_CONDITION)).is_between(least, TRIANGLE_CONDITION / PRESENT)
    }

    /// λ, its error and the weights; `inverse` is 1/D.
    #[inline(always)]
    fn hit(&self, inverse: f64) -> Hit {
        let &Self { det, height, su, sv, low, .. } = self;
        let first = -height * inverse;
        let error = (U + TRIANGLE_LAMBDA) * first.abs();
        let [det_lo, height_lo] = low.to_array();
        let remainder = P::remainder(height, -first, det) + (height_lo + first * det_lo);
        let lambda = first - remainder * inverse;
        // Positive, and rounded above one at most.
        Hit { lambda, error, uv: DVec2::new(su * inverse, sv * inverse).min(DVec2::ONE), part: 0 }
    }
}

/// The largest components of e₁ and e₂, together and times each other, of s and of d.
struct Sizes {
    sum: f64,
    m12: f64,
    s: f64,
    d: f64,
}

impl Sizes {
    /// Of d, s, e₁, e₂; and d's and s's side by side.
    #[inline(always)]
    fn new<L: Lanes>(vectors: [L; 4]) -> (Self, L::Half) {
        let sizes = L::largest(vectors);
        let [d, s, m1, m2] = sizes.to_array();
        (Self { sum: m1 + m2, m12: m1 * m2, s, d }, sizes.low())
    }

    /// Nothing overflows, and underflow costs less than [`VANISHED`].
    #[inline(always)]
    fn are_ordinary(&self) -> bool {
        (self.sum + self.s) + self.d < LARGEST
    }

    /// What an edge function's error is proportional to.
    #[inline(always)]
    fn of_sides(&self) -> f64 {
        self.d * (self.m12 + self.s * self.sum)
    }
}

/// Between this and its inverse quotients have no range to mind either.
const PRESENT: f64 = power(-450);
/// How far off the weights may be that the fast path gives.
const WEIGHT: f64 = power(-24);

/// The least and the largest; the third if it is NaN.
#[inline(always)]
fn extremes(u: f64, v: f64, w: f64) -> (f64, f64) {
    let (least, most) = (if u < v { u } else { v }, if u > v { u } else { v });
    (if least < w { least } else { w }, if most > w { most } else { w })
}

/// All four triple products in double-double, for near-ties, thin or grazed triangles and origins next to the plane.
#[cold]
#[inline(never)]
fn closely(ray: &Ray, vertices: &[DVec3; 3], within: &Interval) -> Option<Hit> {
    tally::refined();
    let forms = Forms::of(ray, vertices);
    if !forms.is_hit().unwrap_or_else(|| is_hit(ray, vertices)) {
        return None;
    }
    let [lambda, error] = forms.lambda();
    let inside = (lambda - error > within.min) & (lambda + error < within.max);
    if inside {
        return Some(Hit { lambda, error, uv: weights(forms.uv[0], forms.uv[1]), part: 0 });
    }
    if (lambda + error < within.min) | (lambda - error > within.max) {
        return None;
    }
    refine(ray, vertices, *within)
}

/// The triple products, normalised, and the quotients that follow.
struct Forms {
    sides: [f64; 3],
    uv: [f64; 2],
    /// An unevaluated sum.
    lambda: [f64; 2],
    inverse: f64,
    sizes: Sizes,
}

impl Forms {
    fn of(ray: &Ray, vertices: &[DVec3; 3]) -> Self {
        cpu::dispatch_lanes(
            #[inline(always)]
            |cpu| Self::new::<Fused>(cpu, ray, vertices),
            #[inline(always)]
            || Self::new::<Split>((), ray, vertices),
        )
    }

    /// D, s(c,a), −s(a,b) and n·s, normalised.
    #[inline(always)]
    fn products<P: Product>(
        cpu: <P::Lanes as Lanes>::Cpu,
        ray: &Ray,
        vertices: &[DVec3; 3],
    ) -> (Double<P::Lanes>, Sizes) {
        let lanes = |v: DVec3| P::Lanes::of(cpu, v);
        let (o, d, [a, b, c]) = (lanes(ray.origin), lanes(ray.direction), vertices.map(lanes));
        let (e1, e2, s) = (Double::difference(b, a), Double::difference(c, a), Double::difference(o, a));
        let (n, q) = (e1.cross(e2), s.crossed_by(d));
        let products = [n.times_float(d), q.times(e2), q.times(e1), n.times(s)];
        (Double::sums(products), Sizes::new([d, s.hi, e1.hi, e2.hi]).0)
    }

    #[inline(always)]
    fn new<P: Product>(cpu: <P::Lanes as Lanes>::Cpu, ray: &Ray, vertices: &[DVec3; 3]) -> Self {
        let (products, sizes) = Self::products::<P>(cpu, ray, vertices);
        let ([det, su, minus_sv, _], [det_lo, su_lo, minus_sv_lo, _]) =
            (products.hi.to_array(), products.lo.to_array());
        let (rest, rounding) = two_diff(det, su);
        let (sw, more_rounding) = two_sum(rest, minus_sv);
        let sw = sw + ((rounding + more_rounding) + ((det_lo - su_lo) + minus_sv_lo));
        let (quotients, inverse) = products.over_first();
        let [_, u, minus_v, _] = (quotients.hi + quotients.lo).to_array();
        let ([.., q], [.., correction]) = (quotients.hi.to_array(), quotients.lo.to_array());
        let sides = [su + su_lo, -(minus_sv + minus_sv_lo), sw];
        Self { sides, uv: [u, -minus_v], lambda: [-q, -correction], inverse, sizes }
    }

    /// Whether the triangle is hit, if the edge functions are certain.
    fn is_hit(&self) -> Option<bool> {
        let bound = TRIANGLE_CLOSE * self.sizes.of_sides() + VANISHED;
        let [su, sv, sw] = self.sides;
        let (least, most) = extremes(su, sv, sw);
        let certain = self.sizes.are_ordinary() & ((least > bound) | (most < -bound));
        if certain {
            return Some(true);
        }
        (self.sizes.are_ordinary() & (least < -bound) & (most > bound)).then_some(false)
    }

    /// λ and its error; NaN where it is not known as well as is promised.
    fn lambda(&self) -> [f64; 2] {
        let lambda = self.lambda[0] + self.lambda[1];
        let beyond_rounding = self.beyond_rounding();
        let sharp =
            (beyond_rounding < 3.0 * U * lambda.abs()) | (beyond_rounding * self.sizes.d < FLOOR * self.sizes.s);
        // 1/|D| and |N|/|D|: neither D nor N has vanished.
        let over = self.inverse.abs();
        let present = (over < 1.0 / VANISHED) & (lambda.abs() > VANISHED * over);
        if sharp & present & self.sizes.are_ordinary() {
            [lambda, (U * lambda.abs() + beyond_rounding) * (1.0 + 4.0 * U)]
        } else {
            [f64::NAN; 2]
        }
    }

    /// How far off λ is as an unevaluated sum.
    fn beyond_rounding(&self) -> f64 {
        let Sizes { m12, s, d, .. } = self.sizes;
        TRIANGLE_CLOSE * (m12 * self.inverse.abs() * (s + self.lambda[0].abs() * d))
    }
}

/// λ need not be better known than to 4u·2⁻⁴⁰ of the largest coordinate over the direction's length, here in largest
/// components of o−a, which is at most twice that coordinate, and d.
const FLOOR: f64 = 3.0 * U / (1u64 << 42) as f64;

#[inline(always)]
fn largest(v: DVec3) -> f64 {
    let (x, y, z) = (v.x.abs(), v.y.abs(), v.z.abs());
    let m = if x > y { x } else { y };
    if m > z { m } else { z }
}

/// Weights as they are handed out: what rounding took below zero or above one is put back.
#[inline(always)]
fn weights(u: f64, v: f64) -> DVec2 {
    DVec2::new(u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
}

/// The edge functions s(c,a), s(a,b), s(b,c): the weights of b, c, a times D.
fn sides<N: Number>(ray: &Ray, &[a, b, c]: &[DVec3; 3]) -> [N; 3] {
    let d: [N; 3] = vector(ray.direction);
    let (e1, e2) = (difference(b, a), difference(c, a));
    let q = cross(&d, &difference(ray.origin, a));
    let (su, sv) = (dot(&q, &e2), dot(&q, &e1).negated());
    let sw = dot(&cross(&e1, &e2), &d).minus(&su).minus(&sv);
    [su, sv, sw]
}

/// Whether the three edge functions agree: none against another, not all zero. The sum of the three is n·d, so that
/// a ray in the plane, and a degenerate triangle, miss.
#[cold]
#[inline(never)]
fn is_hit(ray: &Ray, vertices: &[DVec3; 3]) -> bool {
    if !ray.is_valid() || !vertices.iter().all(|v| v.is_finite()) {
        return false;
    }
    if let Some(signs) = fixed::sides(ray, vertices) {
        return agree(signs);
    }
    let signs = sides::<Bounded>(ray, vertices).map(|s| s.sign());
    if let [Some(u), Some(v), Some(w)] = signs {
        return agree([u, v, w]);
    }
    if signs.contains(&Some(Ordering::Less)) && signs.contains(&Some(Ordering::Greater)) {
        return false;
    }
    tally::exact();
    agree(sides::<Dyadic>(ray, vertices).map(|s| s.sign().unwrap_or(Ordering::Equal)))
}

fn agree(signs: [Ordering; 3]) -> bool {
    signs.contains(&Ordering::Less) != signs.contains(&Ordering::Greater)
}

/// −n·(o − a) over n·d.
fn plane<N: Number>(ray: &Ray, &[a, b, c]: &[DVec3; 3]) -> Ratio<N> {
    let n = cross(&difference(b, a), &difference::<N>(c, a));
    Ratio { numerator: dot(&n, &difference(a, ray.origin)), denominator: dot(&n, &vector(ray.direction)) }
}

/// The hit of a ray that is known to meet the triangle, if λ is inside.
#[cold]
#[inline(never)]
fn refine(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    if within.is_empty() {
        return None;
    }
    let (lambda, error) =
        ratio::refine(|| plane(ray, vertices), || plane(ray, vertices), within, ratio::floor(ray, vertices[0]))?;
    let [su, sv, sw] = sides::<Bounded>(ray, vertices);
    let (sides, det) = ([su, sv], su.plus(&sv).plus(&sw));
    let weight = |i: usize| {
        let (value, relative) = Ratio { numerator: sides[i], denominator: det }.value();
        if relative < U {
            return value.to_f64().0;
        }
        let [su, sv, sw] = self::sides::<Dyadic>(ray, vertices);
        let denominator = su.plus(&sv).plus(&sw);
        Ratio { numerator: [su, sv][i].clone(), denominator }.value().0.to_f64().0
    };
    Some(Hit { lambda, error, uv: weights(weight(0), weight(1)), part: 0 })
}

/// λ of the triangle's plane to about a hundred bits, as an unevaluated sum of two floats; zero where the ray lies
/// along the plane.
#[must_use]
pub fn precise_lambda(ray: &Ray, vertices: &[DVec3; 3]) -> [f64; 2] {
    ratio::precise(|| plane(ray, vertices), || plane(ray, vertices))
}

/// The exact λ of two triangles' planes on one ray, compared. Both must be met: n·d ≠ 0.
///
/// What decides between two hits whose bounds overlap; [`Ordering::Equal`] on a shared edge, on a shared vertex and on
/// coincident triangles.
#[cold]
#[inline(never)]
#[must_use]
pub fn compare(ray: &Ray, first: &[DVec3; 3], second: &[DVec3; 3]) -> Ordering {
    tally::refined();
    if fixed::in_one_plane(first, second) || meet_in_common(ray, first, second) {
        return Ordering::Equal;
    }
    let (x, y): (Ratio<Bounded>, _) = (plane(ray, first), plane::<Bounded>(ray, second));
    let difference = x.numerator.times(&y.denominator).minus(&y.numerator.times(&x.denominator));
    if let (Some(sign), Some(x), Some(y)) = (difference.sign(), x.denominator.sign(), y.denominator.sign()) {
        return if x == y { sign } else { sign.reverse() };
    }
    tally::exact();
    plane::<Dyadic>(ray, first).compare_exactly(&plane(ray, second))
}

/// Whether the ray, which meets both planes in one point each, meets both in one point of a vertex or an edge that they
/// share.
fn meet_in_common(ray: &Ray, first: &[DVec3; 3], second: &[DVec3; 3]) -> bool {
    let on = |a: usize, b: usize| edge_sign(ray, first[a], first[b]) == Ordering::Equal;
    match first.map(|v| second.contains(&v)) {
        [true, true, true] => true,
        [true, true, false] => on(0, 1),
        [false, true, true] => on(1, 2),
        [true, false, true] => on(2, 0),
        [true, false, false] => on(0, 1) && on(0, 2),
        [false, true, false] => on(1, 2) && on(1, 0),
        [false, false, true] => on(2, 0) && on(2, 1),
        [false, false, false] => false,
    }
}

/// The exact sign of the edge function s(a, b) = d·((a−o)×(b−o)): on which side of the edge the ray passes.
///
/// Positive for all three edges of a triangle, or negative for all three, where the ray passes through it; zero where
/// it meets the edge's line. Antisymmetric, and a function of the two vertices and the ray alone, so that two
/// triangles that share an edge always agree about it. All arguments finite.
#[must_use]
pub fn edge_sign(ray: &Ray, a: DVec3, b: DVec3) -> Ordering {
    fn form<N: Number>(ray: &Ray, a: DVec3, b: DVec3) -> N {
        // (a−o)×(b−o) = (a−o)×(b−a)
        dot(&cross(&vector(ray.direction), &difference(a, ray.origin)), &difference(b, a))
    }
    let (s, e, d) = (a - ray.origin, b - a, ray.direction);
    let value = d.cross(s).dot(e);
    let (ms, me, md) = (largest(s), largest(e), largest(d));
    let bound = TRIANGLE_SIDES * (md * (ms * me)) + UNDERFLOW * (1.0 + ms + me + md) + 0.0 * value;
    if value.abs() > bound {
        return value.total_cmp(&0.0);
    }
    if let Some(sign) = fixed::edge(ray, a, b) {
        return sign;
    }
    number::sign_of(|| form(ray, a, b), || form(ray, a, b))
}

/// [`edge_sign`] of the direction d + (ε, ε², ε³) for an ε too small to matter otherwise: never zero, unless the
/// origin lies on the edge's line or the vertices coincide (simulation of simplicity, Edelsbrunner and Mücke 1990).
///
/// The *crossing rule*, for counting: of the triangles around an edge or a vertex of a closed surface, a ray through
/// it crosses exactly as many as a ray that just misses it.
#[must_use]
pub fn crossing_sign(ray: &Ray, a: DVec3, b: DVec3) -> Ordering {
    let sign = edge_sign(ray, a, b);
    if sign != Ordering::Equal {
        return sign;
    }
    let w = cross::<Dyadic>(&difference(a, ray.origin), &difference(b, ray.origin));
    let signs = w.map(|w| w.sign().unwrap_or(Ordering::Equal));
    signs.into_iter().find(|s| s.is_ne()).unwrap_or(Ordering::Equal)
}

/// Whether the line of `ray` crosses the triangle by the crossing rule: on the boundary as [`crossing_sign`] has it.
#[must_use]
pub fn crosses(ray: &Ray, &[a, b, c]: &[DVec3; 3]) -> bool {
    let sign = crossing_sign(ray, a, b);
    sign != Ordering::Equal && sign == crossing_sign(ray, b, c) && sign == crossing_sign(ray, c, a)
}

#[cfg(test)]
mod tests;
