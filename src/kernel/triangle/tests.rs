//! The constants driven to their limits, and the paths against each other.

use super::*;
use crate::bvh::Level;
use crate::kernel::lanes::Plain;
use crate::kernel::search::{Rational, climb, cross3, dot3, each, exact, minus};
use crate::kernel::tally::Tally;
use fearless_simd::{dispatch, prelude::*};

/// From near and far, thin and plump, steep and grazing: vertices, and a ray at a point of their plane.
pub(super) fn setting(x: &[f64]) -> (Ray, [DVec3; 3]) {
    let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
    let (a, e1) = (v(0), v(3));
    let e2 = e1 * x[17] + v(6) * x[15].powi(7);
    let target = a + x[18].abs() * 0.5 * e1 + x[19].abs() * 0.5 * e2;
    let n = e1.cross(e2).normalize_or(DVec3::Z);
    let across = n.cross(v(9));
    let direction = across + n * x[16].powi(9) + 1e-3 * x[14] * v(12);
    (Ray { origin: target - direction * 2f64.powf(12.0 * x[13]), direction }, [a, a + e1, a + e2])
}

pub(super) const DIMENSION: usize = 20;

/// The hit, if the fast path has it.
pub(super) fn fast_path(ray: &Ray, t: &[DVec3; 3]) -> Option<Hit> {
    let before = Tally::now();
    intersect(ray, t, Interval::LINE).filter(|_| Tally::now() == before)
}

/// D, s(c,a), s(a,b), s(b,c) and n·s, exactly.
fn exact_products(ray: &Ray, &[a, b, c]: &[DVec3; 3]) -> [Rational; 5] {
    let (e1, e2, s, d) = (minus(b, a), minus(c, a), minus(ray.origin, a), exact(ray.direction));
    let (n, q) = (cross3(&e1, &e2), cross3(&d, &s));
    let (det, su, sv) = (dot3(&n, &d), dot3(&q, &e2), -dot3(&q, &e1));
    let sw = &det - &su - &sv;
    [det, su, sv, sw, dot3(&n, &s)]
}

fn distance(exact: &Rational, parts: [f64; 2]) -> f64 {
    let [hi, lo] = parts.map(|x| Rational::try_from(x).unwrap());
    (exact - hi - lo).to_f64().value().abs()
}

#[test]
fn no_input_reaches_the_bounds_of_the_sides() {
    let worst = climb("triangle: edge filter", DIMENSION, |x| {
        let (ray, t) = setting(x);
        let (d, e1, e2, s) = (ray.direction, t[1] - t[0], t[2] - t[0], ray.origin - t[0]);
        let (q, det) = (d.cross(s), e1.cross(e2).dot(d));
        let (su, sv) = (q.dot(e2), -q.dot(e1));
        let lanes = [d, s, e1, e2].map(|v| Plain::of((), v));
        let bound = TRIANGLE_SIDES * Sizes::new(lanes).0.of_sides();
        let exact = exact_products(&ray, &t);
        let sides = [su, sv, det - su - sv].into_iter();
        let off = sides.zip(&exact[1..]).map(|(f, e)| distance(e, [f, 0.0]) / bound);
        Some(off.fold(0.0, f64::max))
    });
    assert!((0.01..1.0).contains(&worst));
    let worst = climb("triangle: edge functions in double-double", DIMENSION, |x| {
        let (ray, t) = setting(x);
        let (products, sizes) = Forms::products::<Split>((), &ray, &t);
        let (hi, lo) = (products.hi.to_array(), products.lo.to_array());
        let [det, su, sv, ..] = exact_products(&ray, &t);
        let off = |i: usize, exact: &Rational| distance(exact, [hi[i], lo[i]]);
        let off = off(0, &det).max(off(1, &su)).max(off(2, &(-sv)));
        Some(off / (TRIANGLE_CLOSE * sizes.of_sides()))
    });
    assert!((0.003..1.0).contains(&worst));
}

#[test]
fn no_input_reaches_the_bounds_of_lambda() {
    let exact_lambda = |ray: &Ray, t: &[DVec3; 3]| {
        let [det, .., height] = exact_products(ray, t);
        -height / det
    };
    let worst = climb("triangle: λ and its rounding", DIMENSION, |x| {
        let (ray, t) = setting(x);
        let hit = fast::<Split>((), &ray, &t, &Interval::LINE)?;
        Some(distance(&exact_lambda(&ray, &t), [hit.lambda, 0.0]) / hit.error)
    });
    assert!((0.9..1.0).contains(&worst));
    let worst = climb("triangle: λ in double-double", DIMENSION, |x| {
        let (ray, t) = setting(x);
        let forms = Forms::new::<Split>((), &ray, &t);
        let known = !forms.lambda()[0].is_nan();
        known.then(|| distance(&exact_lambda(&ray, &t), forms.lambda) / forms.beyond_rounding())
    });
    assert!((0.003..1.0).contains(&worst));
}

#[test]
fn ordinary_rays_hardly_ever_need_the_cold_path() {
    let (mut cases, mut hits, before) = (0, 0, Tally::now());
    each(400_000, 14, |x| {
        let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
        let (origin, t) = (5.0 * v(0), [v(3), v(6), v(9)]);
        let target = t[0] + x[12].abs() * (t[1] - t[0]) + x[13].abs() * (t[2] - t[0]);
        let ray = Ray { origin, direction: target - origin };
        cases += 1;
        hits += usize::from(intersect(&ray, &t, Interval::FORWARD).is_some());
    });
    let cold = Tally::now().since(before).refined;
    println!("triangle: {cold} of {cases} ordinary rays, {hits} hits");
    assert!(cold * 10_000 < cases && hits * 3 > cases);
}

/// What is known to be hit, and how: by the fast path with the same bits, or not at all.
#[test]
fn hits_known_beforehand_have_the_same_bits() {
    let (mut fast, mut left, mut plain) = (0, 0, 0);
    each(60_000, DIMENSION + 1, |x| {
        let (mut ray, mut t) = setting(x);
        if x[DIMENSION] > 0.0 {
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            (ray.origin, t) = (5.0 * v(9), [v(0), v(3), v(6)]);
            t = t.map(|v| if x[DIMENSION] > 0.7 { v.as_vec3().as_dvec3() } else { v / 3.0 });
            ray.direction = t[0] + 0.5 * x[12].abs() * (t[1] - t[0]) + 0.5 * (t[2] - t[0]) - ray.origin;
        }
        if intersect(&ray, &t, Interval::LINE).is_none() {
            return;
        }
        let expected = fast_path(&ray, &t);
        let has_plain_edges = has_plain_edges(&t);
        for (level, detected) in Level::all() {
            let of = |plain, least| {
                dispatch!(detected.token(), simd => {
                    let vertices = t.map(|v| f64x4::simd_from(simd, [v.x, v.y, v.z, v.z]));
                    passed(simd, &ray, vertices, plain, least)
                })
            };
            let enough = expected.map(|_| [0.0; 2]);
            for (plain, least) in [(false, None), (has_plain_edges, None), (has_plain_edges, enough)] {
                let (hit, found) = (expected, of(plain, least));
                if hit.is_some() {
                    assert_eq!(found, hit, "{level}: {ray:?} {t:?}");
                } else if let Some(found) = found {
                    // On an edge, for all that the fast path can tell.
                    let hit = intersect(&ray, &t, Interval::LINE).unwrap();
                    assert!((found.lambda - hit.lambda).abs() <= found.error + hit.error, "{level}: {ray:?} {t:?}");
                }
            }
        }
        fast += usize::from(expected.is_some());
        left += usize::from(expected.is_none());
        plain += usize::from(has_plain_edges && expected.is_some());
    });
    println!("triangle: {fast} hits known beforehand, {plain} with plain edges; {left} left to the close path");
    assert!(plain > 3000 && fast > plain + 3000 && left > 3000);
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
