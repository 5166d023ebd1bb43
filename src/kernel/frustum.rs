//! Ray and frustum of a cone, with its caps: cylinder, cone and truncated cone are one solid.
//!
//! With v = top − base, x = p − base and t = x·v the body is {0 ≤ t ≤ |v|², |v|²·|x × v|² ≤ (r₀|v|² + Δr·t)²}: a
//! polynomial in the inputs, without the axis's length. Which of its ends a line meets on a cap and which on the wall
//! is told by signs alone, before any λ is known; docs/numerics.md §6.

use super::bound::{U, UNDERFLOW};
use super::cpu;
use super::eft::{Fused, Product, Split, two_diff, two_sum};
use super::number::{Number, Vector, cross, difference, dot, vector};
use super::section::{End, Quadratic, Undecided, fine, nearest, precise, refined, sign};
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// [`Hit::part`] on the wall, and at an apex.
pub const WALL: u32 = 0;
/// [`Hit::part`] on the base cap, its rim included.
pub const BASE: u32 = 1;
/// [`Hit::part`] on the top cap, its rim included.
pub const TOP: u32 = 2;

/// The nearest hit of `ray` with the capped frustum from `base` with `base_radius` to `top` with `top_radius` inside
/// `within`; equal radii make a cylinder, one zero radius a cone.
///
/// The body is closed and convex: a line meets it from where it enters to where it leaves, and the hits are these two
/// points, or one where they coincide (tangent, rim, apex). This also settles lines in a cap's plane, along the wall
/// and through the apex. All of it is decided as exact arithmetic on these numbers would. λ is within 4 ulp of the
/// exact λ (an ulp of 2⁻⁴⁰ of the largest coordinate over |direction| if that is larger), and `error` bounds what it is
/// off. `part` is [`WALL`], [`BASE`] or [`TOP`]: a rim belongs to its cap (but to the wall for a ray in the cap's plane),
/// an apex to the wall.
///
/// A ray that is not [valid](Ray::is_valid) misses, and so does everything if the solid is none: a number that is not
/// finite, equal points, a negative radius or both zero.
#[must_use]
#[inline]
pub fn intersect(
    ray: &Ray,
    base: DVec3,
    top: DVec3,
    base_radius: f64,
    top_radius: f64,
    within: Interval,
) -> Option<Hit> {
    cpu::dispatch(
        #[inline(always)]
        || fast::<Fused>(ray, base, top, base_radius, top_radius, within),
        #[inline(always)]
        || fast::<Split>(ray, base, top, base_radius, top_radius, within),
    )
}

// Bounds of the signs' errors, with |·|₁ lengths d, v, x, size = x + v + r₀ + r₁, X = d·v·size, Y = (v + |Δr|)·X.
/// d·v: this·d·v.
const RATE: f64 = 4.5 * U;
/// r²(d·v)² − |w × v|²: u·X·(20·r|d·v| + 256u·X).
const CROSSING: [f64; 2] = [20.0 * U, 256.0 * U * U];
/// A: this·(h² + Δr²)·(d·v)².
const LEADING: f64 = 32.0 * U;
/// D/h⁴: u·Y·(66·v·|g|₁ + 640u·Y).
const DISCRIMINANT: [f64; 2] = [66.0 * U, 640.0 * U * U];
/// The slopes at the caps' planes: this·d·v·Y.
const TURN: f64 = 32.0 * U;

// Bounds of the residuals' errors.
/// Of a cap's plane: this·v·size.
const PLANE_RESIDUAL: f64 = 128.0 * U * U;
/// Of the wall, |q|² − R²: this·size·(|q|₁ + R)·(1 + |Δr|·v/h²), besides what q is off the perpendicular.
const WALL_RESIDUAL: f64 = 256.0 * U * U;
/// Of the wall's slope: this·d·(|q|₁ + R·|Δr|·v/h²).
const SLOPE: f64 = 24.0 * U;

/// An exact difference: hi + lo.
#[derive(Clone, Copy)]
struct Pair {
    hi: DVec3,
    lo: DVec3,
}

impl Pair {
    #[inline(always)]
    fn difference(a: DVec3, b: DVec3) -> Self {
        let ((x, xe), (y, ye), (z, ze)) = (two_diff(a.x, b.x), two_diff(a.y, b.y), two_diff(a.z, b.z));
        Self { hi: DVec3::new(x, y, z), lo: DVec3::new(xe, ye, ze) }
    }

    /// self + s·d, to about 2u² of what is added.
    #[inline(always)]
    fn moved<P: Product>(&self, s: f64, d: DVec3) -> Self {
        let ((px, pxe), (py, pye), (pz, pze)) =
            (P::two_product(s, d.x), P::two_product(s, d.y), P::two_product(s, d.z));
        let ((x, xe), (y, ye), (z, ze)) = (two_sum(self.hi.x, px), two_sum(self.hi.y, py), two_sum(self.hi.z, pz));
        let lo = DVec3::new(xe + (pxe + self.lo.x), ye + (pye + self.lo.y), ze + (pze + self.lo.z));
        Self { hi: DVec3::new(x, y, z), lo }
    }

    /// self · other as an unevaluated sum.
    #[inline(always)]
    fn dot<P: Product>(&self, other: &Self) -> (f64, f64) {
        let (a, b) = (self, other);
        let (x, xe) = P::two_product(a.hi.x, b.hi.x);
        let (y, ye) = P::two_product(a.hi.y, b.hi.y);
        let (z, ze) = P::two_product(a.hi.z, b.hi.z);
        let (s, se) = two_sum(x, y);
        let (t, te) = two_sum(s, z);
        let mixed = plain_dot(a.hi, b.lo) + plain_dot(a.lo, b.hi);
        (t, (se + te) + ((xe + ye) + ze) + mixed)
    }
}

#[inline(always)]
fn plain_dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[inline(always)]
fn plain_cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

#[inline(always)]
fn taxicab(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// λ = `lambda` + `lo` to within `rest`; a `rest` of NaN where nothing is proved.
#[derive(Clone, Copy)]
struct Solved {
    lambda: f64,
    lo: f64,
    rest: f64,
}

/// The same bits for either [`Product`].
#[inline(always)]
fn fast<P: Product>(ray: &Ray, base: DVec3, top: DVec3, r0: f64, r1: f64, within: Interval) -> Option<Hit> {
    let (o, d) = (ray.origin, ray.direction);
    let cold = || refine(ray, &base, &top, r0, r1, within.min, within.max);
    let (x, y, v) = (Pair::difference(o, base), Pair::difference(o, top), Pair::difference(top, base));
    let growth = r1 - r0;
    let (dl, vl) = (taxicab(d), taxicab(v.hi));
    let size = taxicab(x.hi) + vl + (r0 + r1);
    let scale = dl * vl * size;
    let rate = plain_dot(d, v.hi);
    let w = plain_cross(x.hi, d);
    let n = plain_cross(d, v.hi);
    let w1 = w + n;
    // Where the line crosses the planes of the caps.
    let crossing = |moment: DVec3, r: f64| {
        let reach = r * rate;
        let across = plain_cross(moment, v.hi);
        let value = reach * reach - plain_dot(across, across);
        (value, scale * (CROSSING[0] * reach.abs() + CROSSING[1] * scale))
    };
    let ((at_base, base_error), (at_top, top_error)) = (crossing(w, r0), crossing(w1, r1));
    // NaN fails every one of these.
    let ordinary = in_range(dl, 100) & in_range(vl, 100) & (size < TOO_LARGE) & (r0 >= 0.0) & (r1 >= 0.0);
    let told = (at_base.abs() > base_error) & (at_top.abs() > top_error) & (rate.abs() > RATE * dl * vl);
    if !(ordinary & told) {
        return cold();
    }
    let h2 = plain_dot(v.hi, v.hi);
    let on_wall = (at_base < 0.0) & (at_top < 0.0);
    let wide = (vl + growth.abs()) * scale;
    let g = r0 * n - growth * w;
    let (vw, slope) = (plain_dot(v.hi, w), growth * rate);
    let leading = h2 * plain_dot(n, n) - slope * slope;
    let discriminant = h2 * plain_dot(g, g) - (h2 + growth * growth) * (vw * vw);
    if on_wall {
        let leading_error = LEADING * (h2 + growth * growth) * ((dl * vl) * (dl * vl));
        let discriminant_error = wide * (DISCRIMINANT[0] * vl * taxicab(g) + DISCRIMINANT[1] * wide);
        let turn_error = TURN * dl * vl * wide;
        let from_base = h2 * plain_dot(n, w) - growth * r0 * (rate * rate);
        let from_top = h2 * plain_dot(n, w1) - growth * r1 * (rate * rate);
        if (discriminant < -discriminant_error)
            | (leading < -leading_error)
            | (from_base > turn_error)
            | (from_top < -turn_error)
        {
            return None;
        }
        let hits = (discriminant > discriminant_error)
            & (leading > leading_error)
            & (from_base < -turn_error)
            & (from_top > turn_error);
        if !hits {
            return cold();
        }
    }
    let over_h2 = 1.0 / h2;
    let wall = |turn: f64| {
        let m = plain_cross(x.hi, v.hi);
        let radius = r0 * h2 + growth * plain_dot(x.hi, v.hi);
        let b = h2 * plain_dot(m, n) - radius * slope;
        // A rounded negative one is a tangent; what comes of it is checked below.
        let root = h2 * (if discriminant > 0.0 { discriminant } else { 0.0 }).sqrt();
        let q = b.abs() + root;
        let first = if b * turn > 0.0 {
            let c = h2 * plain_dot(m, m) - radius * radius;
            -turn * c / q
        } else {
            turn * q / leading
        };
        wall_step::<P>(first, turn, &x, &v, d, [r0, r1, growth], [dl, vl, size, rate, over_h2])
    };
    let plane = |from: &Pair| plane_step::<P>(from, &v, d, rate, dl * vl, vl * size);
    let forward = rate > 0.0;
    let (first, last) = if forward { ((at_base, BASE), (at_top, TOP)) } else { ((at_top, TOP), (at_base, BASE)) };
    for ((crossing, part), turn) in [(first, -1.0), (last, 1.0)] {
        let on_cap = crossing > 0.0;
        let Solved { lambda, lo, rest } = if on_cap { plane(if part == BASE { &x } else { &y }) } else { wall(turn) };
        let error = (lo.abs() + rest) * (1.0 + 8.0 * U);
        if lambda + error < within.min {
            continue;
        }
        if lambda - error > within.max {
            return None;
        }
        let inside = (lambda - error > within.min) & (lambda + error < within.max);
        // Next to the origin an ulp of 2⁻⁴⁰ of the largest coordinate counts; that is size/14 or more.
        let sharp = (rest <= U * lambda.abs()) | (rest <= size / dl * (U / (14.0 * (1u64 << 40) as f64)));
        if inside & sharp {
            return Some(Hit { lambda, error, uv: DVec2::ZERO, part: if on_cap { part } else { WALL } });
        }
        return cold();
    }
    None
}

/// Lengths stay below this, so that forms of degree eight do not overflow.
const TOO_LARGE: f64 = (1u128 << 100) as f64;

/// One step from the rounded λ of a plane through `from`'s foot, perpendicular to v.
#[inline(always)]
fn plane_step<P: Product>(from: &Pair, v: &Pair, d: DVec3, rate: f64, dv: f64, reach: f64) -> Solved {
    let over_rate = 1.0 / rate;
    let first = -plain_dot(from.hi, v.hi) * over_rate;
    let (t, t_lo) = from.moved::<P>(first, d).dot::<P>(v);
    let step = -(t + t_lo) * over_rate;
    let (lambda, lo) = two_sum(first, step);
    let over = over_rate.abs();
    let rest = (PLANE_RESIDUAL * reach + UNDERFLOW) * over + step.abs() * (1.1 * RATE * dv * over + 4.0 * U);
    Solved { lambda, lo, rest }
}

/// One Newton step towards the root at which the wall's polynomial rises (`turn` 1) or falls (−1), from any λ near it.
///
/// With s a float near the foot's height, q = p − s·v and R the radius at the exact height: the residual |q|² − R².
#[inline(always)]
fn wall_step<P: Product>(
    first: f64,
    turn: f64,
    x: &Pair,
    v: &Pair,
    d: DVec3,
    [r0, r1, growth]: [f64; 3],
    [dl, vl, size, rate, over_h2]: [f64; 5],
) -> Solved {
    let p = x.moved::<P>(first, d);
    let s = plain_dot(p.hi, v.hi) * over_h2;
    let q = p.moved::<P>(-s, v.hi);
    let q = Pair { hi: q.hi, lo: q.lo - s * v.lo };
    let rounded = q.hi + q.lo;
    let (height, radius, radius_lo) = if growth == 0.0 {
        (plain_dot(rounded, v.hi) * over_h2, r0, 0.0)
    } else {
        let (qv, qv_lo) = q.dot::<P>(v);
        let height = (qv + qv_lo) * over_h2;
        // r₀ + Δr·(s + height)
        let (k, k_lo) = two_diff(r1, r0);
        let (grown, grown_lo) = P::two_product(k, s);
        let (radius, radius_lo) = two_sum(r0, grown);
        (height, radius, radius_lo + (grown_lo + (k * height + k_lo * s)))
    };
    let ((x2, x2_lo), (y2, y2_lo)) = (P::two_product(q.hi.x, q.hi.x), P::two_product(q.hi.y, q.hi.y));
    let ((z2, z2_lo), (r2, r2_lo)) = (P::two_product(q.hi.z, q.hi.z), P::two_product(radius, radius));
    let ((a, a_lo), (b, b_lo)) = (two_sum(x2, y2), two_diff(z2, r2));
    let (residual, residual_lo) = two_sum(a, b);
    let mixed = plain_dot(q.lo, 2.0 * q.hi + q.lo) - radius_lo * (2.0 * radius + radius_lo);
    let residual = residual + ((residual_lo + (a_lo + b_lo)) + ((x2_lo + y2_lo) + (z2_lo - r2_lo)) + mixed);
    let growth_rate = growth * rate * over_h2;
    let slope = plain_dot(rounded, d) - height * rate - (radius + radius_lo) * growth_rate;
    let half = 0.5 / slope;
    let step = -residual * half;
    let (lambda, lo) = two_sum(first, step);
    // What is not known.
    let (off, steep) = (taxicab(rounded), growth.abs() * vl * over_h2);
    let askew = height.abs() * vl + 16.0 * U * off;
    let residual_error = WALL_RESIDUAL * size * (off + radius.abs()) * (1.0 + steep) + askew * askew + UNDERFLOW;
    let slope_error = SLOPE * dl * (off + radius.abs() * steep) + UNDERFLOW;
    let bend = dl * dl + growth_rate * growth_rate;
    let (half, step) = (half.abs(), step.abs());
    let rest = half * (residual_error + 1.3 * bend * (step * step)) + step * (2.2 * half * slope_error + 8.0 * U);
    // The step must be small against the bend, and the slope known, and of the right sign.
    let proved = (32.0 * bend * step * half < 1.0) & (128.0 * slope_error * half < 1.0) & (slope * turn > 0.0);
    Solved { lambda, lo, rest: if proved { rest } else { f64::NAN } }
}

/// 2⁻ᵉ ≤ x < 2ᵉ
#[inline(always)]
fn in_range(x: f64, e: u64) -> bool {
    let least = (1023 - e) << 52;
    x.to_bits().wrapping_sub(least) < (2 * e) << 52
}

/// By references and scalars, so that the caller's vectors stay in registers.
#[cold]
#[inline(never)]
fn refine(ray: &Ray, base: &DVec3, top: &DVec3, r0: f64, r1: f64, min: f64, max: f64) -> Option<Hit> {
    let within = Interval { min, max };
    let solid = Solid { base: *base, top: *top, base_radius: r0, top_radius: r1 };
    if !ray.is_valid() || !solid.is_valid() || within.is_empty() {
        return None;
    }
    refined!(decide(ray, &solid, within)).unwrap_or(None)
}

/// Where `point` is: `Less` inside, `Equal` on the surface, `Greater` outside; exactly. Finite input.
#[must_use]
pub fn side(point: DVec3, base: DVec3, top: DVec3, base_radius: f64, top_radius: f64) -> Ordering {
    let solid = Solid { base, top, base_radius, top_radius };
    refined!(locate(point, &solid)).unwrap_or(Ordering::Greater)
}

/// λ of the hit at about `lambda`, to a hundred bits, as an unevaluated sum.
#[must_use]
pub fn precise_lambda(ray: &Ray, base: DVec3, top: DVec3, base_radius: f64, top_radius: f64, lambda: f64) -> [f64; 2] {
    let solid = Solid { base, top, base_radius, top_radius };
    if !ray.is_valid() || !solid.is_valid() {
        return [lambda, 0.0];
    }
    refined!(sharpen(ray, &solid, lambda)).unwrap_or([lambda, 0.0])
}

#[derive(Clone, Copy, Debug)]
struct Solid {
    base: DVec3,
    top: DVec3,
    base_radius: f64,
    top_radius: f64,
}

impl Solid {
    /// The largest coordinate or radius.
    fn extent(&self) -> f64 {
        self.base.abs().max(self.top.abs()).max_element().max(self.base_radius).max(self.top_radius)
    }

    fn is_valid(&self) -> bool {
        let Self { base, top, base_radius: r0, top_radius: r1 } = *self;
        base.is_finite()
            && top.is_finite()
            && base != top
            && r0 >= 0.0
            && r1 >= 0.0
            && r0.is_finite()
            && r1.is_finite()
            && (r0 > 0.0 || r1 > 0.0)
    }
}

/// The line in the solid's terms: p(λ) = origin + λd; x and y are the origin from base and top.
struct Line<N> {
    d: Vector<N>,
    v: Vector<N>,
    x: Vector<N>,
    y: Vector<N>,
    /// d·v
    rate: N,
    /// |v|²
    h2: N,
    r0: N,
    r1: N,
}

impl<N: Number> Line<N> {
    #[inline(always)]
    fn new(ray: &Ray, solid: &Solid) -> Self {
        let v = difference::<N>(solid.top, solid.base);
        let d = vector::<N>(ray.direction);
        Self {
            x: difference(ray.origin, solid.base),
            y: difference(ray.origin, solid.top),
            rate: dot(&d, &v),
            h2: dot(&v, &v),
            r0: N::exactly(solid.base_radius),
            r1: N::exactly(solid.top_radius),
            d,
            v,
        }
    }

    /// Whether the line crosses a cap's plane inside its circle (`Greater`), on it, or outside: with w the moment
    /// (from the cap's centre) × d, the sign of r²(d·v)² − |w × v|².
    #[inline(always)]
    fn crossing(&self, moment: &Vector<N>, r: &N) -> Result<Ordering, Undecided> {
        let across = cross(moment, &self.v);
        sign(&r.times(&self.rate).squared().minus(&dot(&across, &across)))
    }

    /// The wall: h²|(x + λd) × v|² − (r₀h² + Δr·t)², its discriminant in Lagrange's form, which grows with the moment
    /// x × d only: h⁴·(h²|r₀ d×v − Δr x×d|² − (h² + Δr²)(v·(x×d))²).
    #[inline(always)]
    fn wall(&self, moment: &Vector<N>, n: &Vector<N>, growth: &N) -> Quadratic<N> {
        let Self { v, x, h2, r0, rate, .. } = self;
        let m = cross(x, v);
        let radius = r0.times(h2).plus(&growth.times(&dot(x, v)));
        let slope = growth.times(rate);
        let a = h2.times(&dot(n, n)).minus(&slope.squared());
        let b = h2.times(&dot(&m, n)).minus(&radius.times(&slope));
        let c = h2.times(&dot(&m, &m)).minus(&radius.squared());
        let g = combined(r0, n, &growth.negated(), moment);
        let spread = h2.times(&dot(&g, &g));
        let offset = h2.plus(&growth.squared()).times(&dot(v, moment).squared());
        Quadratic { a, b, c, discriminant: h2.squared().times(&spread.minus(&offset)) }
    }
}

/// s·a + t·b
#[inline(always)]
fn combined<N: Number>(s: &N, a: &Vector<N>, t: &N, b: &Vector<N>) -> Vector<N> {
    [s.times(&a[0]).plus(&t.times(&b[0])), s.times(&a[1]).plus(&t.times(&b[1])), s.times(&a[2]).plus(&t.times(&b[2]))]
}

/// Finds the two ends of the line's section of the solid, and answers what is asked of them.
#[inline(always)]
fn with_section<N: Number, R>(
    ray: &Ray,
    solid: &Solid,
    miss: R,
    answer: impl FnOnce([(End<N>, u32); 2]) -> Result<R, Undecided>,
) -> Result<R, Undecided> {
    let line = Line::<N>::new(ray, solid);
    let Line { d, v, x, y, rate, .. } = &line;
    let growth = N::difference(solid.top_radius, solid.base_radius);
    let moment = cross(x, d);
    let n = cross(d, v);
    let along = sign(rate)?;
    if along.is_eq() {
        // Perpendicular to the axis: a chord of one circle.
        if sign(&dot(x, v))?.is_lt() || sign(&dot(y, v))?.is_gt() {
            return Ok(miss);
        }
        let wall = line.wall(&moment, &n, &growth);
        if sign(&wall.discriminant)?.is_lt() {
            return Ok(miss);
        }
        return answer([(End::Falling(&wall), WALL), (End::Rising(&wall), WALL)]);
    }
    let top_moment = [moment[0].plus(&n[0]), moment[1].plus(&n[1]), moment[2].plus(&n[2])];
    let at_base = line.crossing(&moment, &line.r0)?;
    let at_top = line.crossing(&top_moment, &line.r1)?;
    let wall = line.wall(&moment, &n, &growth);
    if at_base.is_lt() && at_top.is_lt() {
        // Outside in both planes: it must dip into the wall between them, where the polynomial is convex, falls at the
        // plane it comes from and rises at the other.
        if sign(&wall.a)?.is_le() || sign(&wall.discriminant)?.is_lt() {
            return Ok(miss);
        }
        let turn = |w: &Vector<N>, r: &N| line.h2.times(&dot(&n, w)).minus(&growth.times(r).times(&rate.squared()));
        if sign(&turn(&moment, &line.r0))?.is_ge() || sign(&turn(&top_moment, &line.r1))?.is_le() {
            return Ok(miss);
        }
        return answer([(End::Falling(&wall), WALL), (End::Rising(&wall), WALL)]);
    }
    let cap = |crossing: Ordering, from: &Vector<N>, part: u32| {
        crossing.is_ge().then(|| (End::Plane { value: dot(from, v), rate }, part))
    };
    let base = cap(at_base, x, if solid.base_radius > 0.0 { BASE } else { WALL });
    let top = cap(at_top, y, if solid.top_radius > 0.0 { TOP } else { WALL });
    let (first, last) = if along.is_gt() { (base, top) } else { (top, base) };
    answer([first.unwrap_or((End::Falling(&wall), WALL)), last.unwrap_or((End::Rising(&wall), WALL))])
}

#[inline(always)]
fn decide<N: Number>(ray: &Ray, solid: &Solid, within: Interval) -> Result<Option<Hit>, Undecided> {
    let fine = fine(ray, solid.extent());
    with_section::<N, _>(ray, solid, None, |ends| nearest(ends, within, fine))
}

#[inline(always)]
fn sharpen<N: Number>(ray: &Ray, solid: &Solid, lambda: f64) -> Result<[f64; 2], Undecided> {
    with_section::<N, _>(ray, solid, [lambda, 0.0], |[(enter, _), (exit, _)]| precise(&[enter, exit], lambda))
}

#[inline(always)]
fn locate<N: Number>(point: DVec3, solid: &Solid) -> Result<Ordering, Undecided> {
    let v = difference::<N>(solid.top, solid.base);
    let (x, y) = (difference::<N>(point, solid.base), difference::<N>(point, solid.top));
    let (t, from_top, h2) = (dot(&x, &v), dot(&y, &v), dot(&v, &v));
    let growth = N::difference(solid.top_radius, solid.base_radius);
    let radius = N::exactly(solid.base_radius).times(&h2).plus(&growth.times(&t));
    let m = cross(&x, &v);
    let below = sign(&t)?.reverse();
    let above = sign(&from_top)?;
    let beside = sign(&h2.times(&dot(&m, &m)).minus(&radius.squared()))?;
    // Outside one is outside; else on one is on it.
    Ok(below.max(above).max(beside))
}
