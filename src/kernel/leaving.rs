//! Whether a ray leaves the plane that it starts next to: the two signs that spawned rays of flat shapes are judged by.
//!
//! How high the origin lies over the plane takes double-doubles, since it is a few units in the last place; whether the
//! direction leads away is an ordinary dot product. Where one of the two is not certain the exact test has to say:
//! docs/numerics.md §11.

use super::bound::{LARGEST, LEAVING_HEIGHT as HEIGHT, LEAVING_SLOPE as SLOPE, VANISHED};
use super::cpu;
use super::eft::{Product, two_sum};
use super::lanes::{Double, Lanes};
use crate::Ray;
use glam::DVec3;
use std::cmp::Ordering;

/// Whether a ray that starts strictly on the side of the plane that n points to (`outward`), or on the other, moves
/// away from it: then it never meets the plane. `None` where that is not certain. The plane goes through `point`; its
/// normal is a double-double.
#[inline]
#[must_use]
pub(super) fn plane(ray: &Ray, point: &DVec3, normal: &[DVec3; 2], outward: bool) -> Option<bool> {
    cpu::dispatch_function!(of_plane(ray: &Ray, point: &DVec3, normal: &[DVec3; 2], outward: bool) -> Option<bool>)
}

/// The same of a triangle's plane, whose normal is (b − a) × (c − a).
#[inline]
#[must_use]
pub(super) fn triangle(ray: &Ray, vertices: &[DVec3; 3], outward: bool) -> Option<bool> {
    cpu::dispatch_function!(of_triangle(ray: &Ray, vertices: &[DVec3; 3], outward: bool) -> Option<bool>)
}

/// The sign of an `outward` height over the surface.
pub(super) fn side(outward: bool) -> Ordering {
    if outward { Ordering::Greater } else { Ordering::Less }
}

#[inline(always)]
fn of_plane<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    &[hi, lo]: &[DVec3; 2],
    outward: bool,
) -> Option<bool> {
    let n = Double { hi: P::Lanes::of(cpu, hi), lo: P::Lanes::of(cpu, lo) };
    leaves::<P>(cpu, ray, point, n, hi.abs().max_element(), outward)
}

#[inline(always)]
fn of_triangle<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    vertices: &[DVec3; 3],
    outward: bool,
) -> Option<bool> {
    let (n, size) = normal::<P>(cpu, vertices);
    leaves::<P>(cpu, ray, &vertices[0], n, size, outward)
}

/// (b − a) × (c − a), off by at most 28u²M in each component, and M.
#[inline(always)]
pub(super) fn normal<P: Product>(cpu: <P::Lanes as Lanes>::Cpu, vertices: &[DVec3; 3]) -> (Double<P::Lanes>, f64) {
    let [a, b, c] = vertices.map(|v| P::Lanes::of(cpu, v));
    let (e1, e2) = (Double::difference(b, a), Double::difference(c, a));
    let [m1, m2, ..] = P::Lanes::largest([e1.hi, e2.hi, e1.hi, e2.hi]).to_array();
    // So large that they might not even be multiplied: no size at all.
    (e1.cross(e2), if m1 + m2 < LARGEST { m1 * m2 } else { f64::INFINITY })
}

#[inline(always)]
fn leaves<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    n: Double<P::Lanes>,
    size: f64,
    outward: bool,
) -> Option<bool> {
    let ([sum, rest], slope) = height_and_slope::<P>(cpu, ray, point, n);
    let height = sum + rest;
    let (m_s, m_d) = ((ray.origin - *point).abs().max_element(), ray.direction.abs().max_element());
    // A NaN is certain of nothing.
    let ordinary = size + m_s + m_d < LARGEST;
    if !(ordinary & (height.abs() > HEIGHT * size * m_s + VANISHED)) {
        return None;
    }
    if (height > 0.0) != outward {
        return Some(false);
    }
    let away = if outward { slope } else { -slope };
    (away > SLOPE * size * m_d + VANISHED).then_some(true)
}

/// n·(o − p) as an unevaluated sum, and n·d.
#[inline(always)]
fn height_and_slope<P: Product>(
    cpu: <P::Lanes as Lanes>::Cpu,
    ray: &Ray,
    point: &DVec3,
    n: Double<P::Lanes>,
) -> ([f64; 2], f64) {
    let s = Double::difference(P::Lanes::of(cpu, ray.origin), P::Lanes::of(cpu, *point));
    let products = n.times(s);
    let ([x, y, z, _], [x_lo, y_lo, z_lo, _]) = (products.hi.to_array(), products.lo.to_array());
    let (xy, rounding) = two_sum(x, y);
    let (sum, more_rounding) = two_sum(xy, z);
    let rest = (rounding + more_rounding) + ((x_lo + y_lo) + z_lo);
    let [x, y, z, _] = (n.hi * P::Lanes::of(cpu, ray.direction)).to_array();
    ([sum, rest], (x + y) + z)
}

#[cfg(test)]
mod tests {
    use super::super::eft::Split;
    use super::super::search::{Rational, climb, cross3, dot3, each, exact, minus};
    use super::super::{plane, triangle};
    use super::*;
    use crate::Interval;

    /// A ray from x₁₃, a triangle from x₀, next to its plane by x₁₂.
    fn setting(x: &[f64]) -> (Ray, [DVec3; 3]) {
        let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
        let vertices = [v(0), v(0) + v(3), v(0) + v(3) * x[15] + v(6) * x[14].powi(5)];
        let n = v(3).cross(v(6)).normalize_or(DVec3::Z);
        let height = x[12].signum() * 2f64.powf(60.0 * x[12].abs() - 56.0);
        let origin = vertices[0] + x[13] * v(3) + x[15] * v(6) + height * n;
        (Ray { origin, direction: v(9) + n * x[16].powi(9) }, vertices)
    }

    const DIMENSION: usize = 17;

    #[test]
    fn no_input_reaches_the_bounds() {
        let off = |x: &[f64]| {
            let (ray, vertices) = setting(x);
            let (n, size) = normal::<Split>((), &vertices);
            let [a, b, c] = vertices;
            let (exact_n, s) = (cross3(&minus(b, a), &minus(c, a)), minus(ray.origin, a));
            let (height, slope) = height_and_slope::<Split>((), &ray, &a, n);
            let exact = [dot3(&exact_n, &s), dot3(&exact_n, &exact(ray.direction))];
            let found = [height, [slope, 0.0]].map(|parts| parts.map(|x| Rational::try_from(x).unwrap()));
            let sizes = [(ray.origin - a).abs().max_element(), ray.direction.abs().max_element()];
            [0, 1].map(|i| {
                let [sum, rest] = &found[i];
                let bound = [HEIGHT, SLOPE][i] * size * sizes[i] + VANISHED;
                (&exact[i] - sum - rest).to_f64().value().abs() / bound
            })
        };
        let worst = climb("leaving: height", DIMENSION, |x| Some(off(x)[0]));
        assert!((0.003..1.0).contains(&worst));
        let worst = climb("leaving: slope", DIMENSION, |x| Some(off(x)[1]));
        assert!((0.01..1.0).contains(&worst));
    }

    /// Edges that overflow in splitting are not ordinary, whatever their product is.
    #[test]
    fn edges_too_long_to_be_split_are_left_to_others() {
        let long = DVec3::new(2f64.powi(995), 2f64.powi(994), 2f64.powi(1000));
        let vertices = [DVec3::ZERO, long, 2f64.powi(-700) * DVec3::new(0.3, 1.0, 1.0)];
        let (_, size) = normal::<Split>((), &vertices);
        assert_eq!(size, f64::INFINITY);
        assert!((triangle::normal(&vertices).length() - 1.0).abs() < 1e-15);
        let ray = Ray { origin: long, direction: DVec3::Y };
        assert_eq!(of_triangle::<Split>((), &ray, &vertices, true), None);
    }

    /// The quick answer is that of the two exact questions, and nearly always there is one.
    #[test]
    fn what_is_certain_is_true() {
        let (mut certain, mut departed, mut open) = (0, 0, 0);
        each(40_000, DIMENSION, |x| {
            let (ray, vertices) = setting(x);
            let n = triangle::normal(&vertices);
            let as_plane = plane::intersect(&ray, vertices[0], n, Interval::FORWARD).is_none();
            for outward in [false, true] {
                let beyond = side(outward);
                let exactly = triangle::side(&vertices, ray.origin) == beyond
                    && triangle::intersect(&ray, &vertices, Interval::FORWARD).is_none();
                assert_eq!(triangle::departs(&ray, &vertices, outward), exactly, "{ray:?} {vertices:?}");
                match super::triangle(&ray, &vertices, outward) {
                    Some(departs) => assert_eq!(departs, exactly, "{ray:?} {vertices:?}"),
                    None => open += 1,
                }
                let exactly = plane::side(vertices[0], n, ray.origin) == beyond && as_plane;
                assert_eq!(plane::departs(&ray, vertices[0], n, outward), exactly, "{ray:?} {vertices:?}");
                certain += usize::from(super::plane(&ray, &vertices[0], &[n, DVec3::ZERO], outward).is_some());
                departed += usize::from(exactly);
            }
        });
        println!("{certain} planes of 80000 at once, {departed} left; {open} triangles not");
        assert!(certain > 40_000 && departed > 10_000 && open > 1_000 && open < 50_000);
    }
}
