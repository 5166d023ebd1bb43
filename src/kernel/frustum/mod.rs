//! Ray and frustum of a cone, with its caps: cylinder, cone and truncated cone are one solid.
//!
//! With v = top − base, x = p − base and t = x·v the body is {0 ≤ t ≤ |v|², |v|²·|x × v|² ≤ (r₀|v|² + Δr·t)²}: a
//! polynomial in the inputs, without the axis's length. Which of its ends a line meets on a cap and which on the wall
//! is told by signs alone, before any λ is known; docs/numerics.md §6.

mod fast;
mod leaving;

use super::cpu;
use super::eft::{Fused, Split};
use super::number::{Number, Vector, cross, difference, dot, vector};
use super::section::{End, Quadratic, Undecided, fine, nearest, precise, refined, sign};
use super::tally;
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::DVec3;
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
/// off. `part` is [`WALL`], [`BASE`] or [`TOP`]: a rim belongs to its cap (but to the wall for a ray in the cap's
/// plane), an apex to the wall.
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
        || fast::intersect::<Fused>(ray, base, top, base_radius, top_radius, within),
        #[inline(always)]
        || fast::intersect::<Split>(ray, base, top, base_radius, top_radius, within),
    )
}

/// By references and scalars, so that the caller's vectors stay in registers.
#[cold]
#[inline(never)]
fn refine(ray: &Ray, base: &DVec3, top: &DVec3, r0: f64, r1: f64, min: f64, max: f64) -> Option<Hit> {
    tally::refined();
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

/// Whether `ray` starts strictly outside the solid and does not meet it, or for `outward` = false starts strictly
/// inside: both exactly. A solid that [`intersect`] accepts.
#[must_use]
pub fn departs(ray: &Ray, base: DVec3, top: DVec3, base_radius: f64, top_radius: f64, outward: bool) -> bool {
    let solid = Solid { base, top, base_radius, top_radius };
    ray.is_valid()
        && (leaving::is_certain(ray, &solid, outward) || {
            let side = side(ray.origin, base, top, base_radius, top_radius);
            let misses = || intersect(ray, base, top, base_radius, top_radius, Interval::FORWARD).is_none();
            if outward { side.is_gt() && misses() } else { side.is_lt() }
        })
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
