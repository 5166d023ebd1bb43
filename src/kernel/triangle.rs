//! A triangle, decided exactly.
//!
//! The three edge functions of Möller and Trumbore 1997 in the arrangement that shares d×(o−a), their signs certified
//! by one filter; then one step of iterative refinement, with the residual to twice the precision, gives λ and the
//! weights to the last bit, and its size is the proof. Where the filter is silent the signs are found in integers,
//! double-doubles or [`Dyadic`]s. docs/numerics.md §4.

use super::bound::{LARGE, SMALL, TRIANGLE_SIDES, TRIANGLE_STEP, U, UNDERFLOW};
use super::bounded::Bounded;
use super::cpu;
use super::dyadic::Dyadic;
use super::eft::{Fused, Product, Split, two_diff, two_sum};
use super::fixed;
use super::number::{self, Number, cross, difference, dot, vector};
use super::ratio::{self, Ratio};
use crate::{Hit, Interval, Ray};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// Where `ray` meets the closed triangle of the three `vertices`, if λ lies inside `within`.
///
/// Edges and vertices belong to the triangle; a ray in its plane misses, and so does every ray of a triangle whose
/// vertices lie on one line. Hit or miss, and inside the interval or not, are decided as real arithmetic on the floats
/// given would; λ is within 4 ulp and `error` is proved. `uv` holds the weights of the second and third vertex.
#[inline]
#[must_use]
pub fn intersect(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    cpu::dispatch(
        #[inline(always)]
        || intersect_with::<Fused>(ray, vertices, within),
        #[inline(always)]
        || intersect_with::<Split>(ray, vertices, within),
    )
}

/// [`intersect`] with products' rounding errors found in the way of `P`: for callers that are inside
/// [`cpu::dispatch`] already.
#[inline(always)]
#[must_use]
pub fn intersect_with<P: Product>(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    let (o, d) = (ray.origin, ray.direction);
    let [a, b, c] = *vertices;
    // u·e₁ + v·e₂ − λ·d = s
    let (e1, e2, s) = (b - a, c - a, o - a);
    let n = e1.cross(e2);
    let q = d.cross(s);
    let det = n.dot(d);
    let (su, sv) = (q.dot(e2), -q.dot(e1));
    let sw = det - su - sv;

    let (m1, m2, ms, md) = (largest(e1), largest(e2), largest(s), largest(d));
    let m12 = m1 * m2;
    // NaN or infinite wherever anything is, and then nothing below is certain.
    let underflow = UNDERFLOW * (1.0 + m1 + m2 + ms + md);
    let bound = TRIANGLE_SIDES * (md * (m12 + ms * (m1 + m2))) + underflow + 0.0 * sw;
    let positive = (su > bound) | (sv > bound) | (sw > bound);
    let negative = (su < -bound) | (sv < -bound) | (sw < -bound);
    if positive & negative {
        return None;
    }
    let certain = (su.abs() > bound) & (sv.abs() > bound) & (sw.abs() > bound);
    if !certain && !is_hit(ray, vertices) {
        return None;
    }

    let inverse = 1.0 / det;
    let (mut u, mut v, mut lambda) = (su * inverse, sv * inverse, -n.dot(s) * inverse);
    let condition = (m12 * inverse).abs(); // κ/|d|∞
    let kappa = condition * md;
    let vanished = underflow * inverse.abs();
    let usable = (kappa < 1.0 / (256.0 * U))
        & (vanished < 1.0)
        & (lambda.abs() + det.abs() + md + m1 + m2 + ms < LARGE)
        & !within.is_empty();
    if !usable {
        return refine(ray, vertices, within);
    }
    // Far outside already?
    let off = 64.0 * U * condition * (ms + lambda.abs() * md) + vanished + SMALL;
    if (lambda + off < within.min) | (lambda - off > within.max) {
        return None;
    }
    // One step is enough unless the triangle is thin or met at a grazing angle.
    for _ in 0..STEPS {
        let r = DVec3::new(
            residual::<P>([o.x, d.x, a.x, b.x, c.x], [lambda, u, v]),
            residual::<P>([o.y, d.y, a.y, b.y, c.y], [lambda, u, v]),
            residual::<P>([o.z, d.z, a.z, b.z, c.z], [lambda, u, v]),
        );
        let size = ms + lambda.abs() * md + u.abs() * m1 + v.abs() * m2;
        let qr = d.cross(r);
        u += qr.dot(e2) * inverse;
        v -= qr.dot(e1) * inverse;
        lambda -= n.dot(r) * inverse;
        let (step, least) = (largest(r) * (TRIANGLE_STEP[0] + TRIANGLE_STEP[1] * kappa), TRIANGLE_STEP[2] * (U * size));
        let beyond_rounding = condition * (U * (step + least)) + vanished * (1.0 + m12 + size);
        let error = (U * lambda.abs() + beyond_rounding) * (1.0 + 4.0 * U);
        let tolerated = 3.0 * U * lambda.abs();
        if (beyond_rounding < tolerated) | (beyond_rounding * md < FLOOR * ms) {
            if (lambda - error > within.min) & (lambda + error < within.max) & (lambda.abs() > SMALL) {
                return Some(Hit { lambda, error, uv: weights(u, v), part: 0 });
            }
            if (lambda + error < within.min) | (lambda - error > within.max) {
                return None;
            }
            break;
        }
        if step < least {
            break;
        }
    }
    refine(ray, vertices, within)
}

/// What a triangle may need at most: each step leaves less than a quarter of the error, as a rule 10⁻¹⁰ of it.
const STEPS: usize = 4;

/// λ need not be better known than to 4u·2⁻⁴⁰ of the largest coordinate over the direction's length, here in largest
/// components of o−a, which is at most twice that coordinate, and d.
const FLOOR: f64 = 3.0 * U / (1u64 << 42) as f64;

#[inline(always)]
fn largest(v: DVec3) -> f64 {
    let (x, y, z) = (v.x.abs(), v.y.abs(), v.z.abs());
    let m = if x > y { x } else { y };
    if m > z { m } else { z }
}

/// One component of o + λd − a − u(b−a) − v(c−a), off by 2u of itself and 18u² of the terms.
#[inline(always)]
fn residual<P: Product>([o, d, a, b, c]: [f64; 5], [lambda, u, v]: [f64; 3]) -> f64 {
    let (s, s_lo) = two_diff(o, a);
    let (e1, e1_lo) = two_diff(b, a);
    let (e2, e2_lo) = two_diff(c, a);
    let (p, p_lo) = P::two_product(lambda, d);
    let (f, f_lo) = P::two_product(u, e1);
    let (g, g_lo) = P::two_product(v, e2);
    let (x, x_lo) = two_sum(s, p);
    let (y, y_lo) = two_sum(f, g);
    let low = ((x_lo - y_lo) + (s_lo + p_lo)) - ((f_lo + g_lo) + (u * e1_lo + v * e2_lo));
    (x - y) + low
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
    if first == second {
        return Ordering::Equal;
    }
    let (x, y): (Ratio<Bounded>, _) = (plane(ray, first), plane::<Bounded>(ray, second));
    let difference = x.numerator.times(&y.denominator).minus(&y.numerator.times(&x.denominator));
    if let (Some(sign), Some(x), Some(y)) = (difference.sign(), x.denominator.sign(), y.denominator.sign()) {
        return if x == y { sign } else { sign.reverse() };
    }
    plane::<Dyadic>(ray, first).compare_exactly(&plane(ray, second))
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

/// The unit normal (b−a)×(c−a)/|…|, each component to a few ulps of the largest however thin the triangle; zero if it is
/// degenerate. All vertices finite.
#[must_use]
pub fn normal(vertices: &[DVec3; 3]) -> DVec3 {
    fn form<N: Number>(&[a, b, c]: &[DVec3; 3]) -> [N; 3] {
        cross(&difference(b, a), &difference(c, a))
    }
    number::unit(&form::<Bounded>(vertices))
        .unwrap_or_else(|| number::unit(&form::<Dyadic>(vertices)).unwrap_or_default())
}

/// The point a + u·(b−a) + v·(c−a), and a bound on its distance from the triangle's plane; u, v ≥ 0.
#[must_use]
pub fn point(&[a, b, c]: &[DVec3; 3], uv: DVec2) -> (DVec3, f64) {
    let (f, g) = (uv.x * (b - a), uv.y * (c - a));
    let position = a + (f + g);
    // Each of b−a, its multiple and their sum is rounded, then the sum with a; underflow is below the last place.
    let off = 3.0 * (f.abs() + g.abs()) + position.abs();
    (position, U * off.length() * (1.0 + 8.0 * U) + f64::MIN_POSITIVE)
}

/// On which side of the triangle's plane `point` lies, exactly: the sign of n·(point − a), n = (b−a)×(c−a).
/// [`Ordering::Equal`] also for a degenerate triangle. All arguments finite.
#[must_use]
pub fn side(vertices: &[DVec3; 3], point: DVec3) -> Ordering {
    fn form<N: Number>(&[a, b, c]: &[DVec3; 3], point: DVec3) -> N {
        dot(&cross(&difference(b, a), &difference(c, a)), &difference(point, a))
    }
    number::sign_of(|| form(vertices, point), || form(vertices, point))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};

    /// The largest |error|/(u·size) of the edge functions in plain f64, by hill climbing from random rays.
    #[test]
    fn the_filter_holds_against_an_adversary() {
        let ratio = |x: &[f64]| {
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            let (ray, t) = (Ray::new(v(0), v(3)), [v(6), v(9), v(12)]);
            let (d, e1, e2, s) = (ray.direction, t[1] - t[0], t[2] - t[0], ray.origin - t[0]);
            let (q, det) = (d.cross(s), e1.cross(e2).dot(d));
            let (su, sv) = (q.dot(e2), -q.dot(e1));
            let (m1, m2, ms) = (largest(e1), largest(e2), largest(s));
            let size = U * (largest(d) * (m1 * m2 + ms * (m1 + m2)));
            let exact = sides::<Dyadic>(&ray, &t);
            let off = |i: usize, f: f64| exact[i].minus(&f.into()).approximately().abs() / size;
            off(0, su).max(off(1, sv)).max(off(2, det - su - sv))
        };
        let mut runner = TestRunner::new_with_rng(
            Config::default(),
            proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
        );
        let mut draw = |n: usize| {
            let strategy = prop::collection::vec(-1.0..1.0f64, n);
            proptest::strategy::ValueTree::current(&strategy.new_tree(&mut runner).unwrap())
        };
        let mut worst: f64 = 0.0;
        for _ in 0..40 {
            let mut x = draw(15);
            let mut best = ratio(&x);
            for k in 0..400 {
                let (step, mut y) = (draw(15), x.clone());
                let scale = 0.5f64.powi(k / 10);
                for i in 0..15 {
                    y[i] += scale * step[i];
                }
                let r = ratio(&y);
                if r > best {
                    (x, best) = (y, r);
                }
            }
            worst = worst.max(best);
        }
        println!("largest |error|/bound of the edge filter: {:.3}", worst * U / TRIANGLE_SIDES);
        assert!(worst > 1.0 && worst * U < TRIANGLE_SIDES);
    }

    /// A ray through an edge or a vertex of a closed surface crosses an even number of triangles.
    #[test]
    fn crossings_of_a_closed_surface_are_even() {
        let p = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let cube: Vec<[DVec3; 3]> =
            quads.iter().flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]]).collect();
        let (mut through, mut touching) = (0, 0);
        for i in 0..125 {
            let target = DVec3::new(f64::from(i % 5), f64::from(i / 5 % 5), f64::from(i / 25)) * 0.25;
            for j in 0..27 {
                let direction = DVec3::new(f64::from(j % 3) - 1.0, f64::from(j / 3 % 3) - 1.0, f64::from(j / 9) - 1.0);
                if direction == DVec3::ZERO {
                    continue;
                }
                let ray = Ray::new(target - 7.0 * direction, direction);
                let crossed = cube.iter().filter(|t| crosses(&ray, t)).count();
                let hit = cube.iter().filter(|t| intersect(&ray, t, Interval::LINE).is_some()).count();
                assert!(crossed == 0 || crossed == 2, "{ray:?} crosses {crossed}");
                through += usize::from(crossed == 2);
                touching += usize::from(hit > crossed);
            }
        }
        println!("{through} rays cross, {touching} touch edges or vertices");
        assert!(through > 1000 && touching > 500);
    }
}
