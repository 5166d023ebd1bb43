//! Shapes under maps: what is decided, for which ray, and what a chain of maps costs.

mod support;

use std::sync::atomic::{AtomicUsize, Ordering};
use support::cases::{Case, Family, Kernel, Solid};
use support::families;
use support::measure::{measure, scale};
use support::oracle::{Line, innermost, solid, truth};
use support::rng::Rng;
use support::shapes::{as_stored, object_ray, shape};
use truehit::glam::{DAffine3, DMat3, DQuat, DVec3};
use truehit::{Aabb, Affine, Hit, Interval, Ray, Shape, Sphere, Tangent};

fn family(number: u32) -> Family {
    families::all().into_iter().find(|f| f.kernel == Kernel::Affine && f.number == number).unwrap()
}

/// Hit or miss is what exact arithmetic says of the rounded image; where that is not what it says of the exact image,
/// both are within the documented rounding of each other (`object_ray` panics otherwise).
#[test]
fn decisions_are_exact_for_the_object_ray() {
    for number in [0, 1, 66, 67, 68, 70, 71, 72, 73, 85] {
        let (mut hits, mut differ) = (0, 0);
        for i in 0..600 {
            let case = as_stored(family(number).case(i));
            let affine = shape(&case.solid).unwrap().unwrap();
            let answer = affine.intersect(&case.ray, case.within);
            let (inner, ..) = innermost(&case);
            let rounded = solid(inner, &Line::from(&object_ray(&case)), case.within);
            assert_eq!(answer.map(|h| h.part), rounded.as_ref().map(|t| t.parts[0]), "{number}: {}", case.hex());
            hits += usize::from(answer.is_some());
            differ += usize::from(answer.is_some() != truth(&case).is_some());
        }
        println!("{number}: {hits} hits, {differ} otherwise than the exact image");
        assert!(hits > 150);
        assert_eq!(differ > 0, number == 1, "only rays that graze");
    }
}

/// A ray that starts on the surface: its rounded image may start on the other side. Which λ lies in the interval is
/// nevertheless what exact arithmetic says of the exact image, and the bound is of that λ.
#[test]
fn limits_are_compared_with_the_exact_images_lambda() {
    let (mut hits, mut flipped) = (0, 0);
    for i in 0..2500 {
        let mut case = as_stored(family(46).case(i));
        let check = |case: &Case| {
            let affine = shape(&case.solid).unwrap().unwrap();
            let (exact, answer) = (truth(case), affine.intersect(&case.ray, case.within));
            assert_eq!(answer.is_some(), affine.occludes(&case.ray, case.within));
            assert_eq!(exact.is_some(), answer.is_some(), "{}", case.hex());
            if let (Some(exact), Some(hit)) = (&exact, &answer) {
                assert!(!measure(hit, &exact.lambda.enclosure(), scale(case)).violated, "{hit:?}: {}", case.hex());
            }
            let (inner, ..) = innermost(case);
            let rounded = solid(inner, &Line::from(&object_ray(case)), case.within);
            let of = |t: &Option<support::oracle::Truth>| t.as_ref().map(|t| t.lambda.enclosure().to_f64());
            let same = match (of(&exact), of(&rounded)) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-3,
                (a, b) => a.is_some() == b.is_some(),
            };
            (answer.is_some(), !same)
        };
        let (hit, flip) = check(&case);
        hits += usize::from(hit);
        flipped += usize::from(flip);
        // Any limit, not only zero.
        let along = 0.5 + (i % 7) as f64;
        case.ray.origin -= case.ray.direction * along;
        case.within = Interval::new(along, f64::INFINITY);
        flipped += usize::from(check(&case).1);
        case.within = Interval::new(0.0, along);
        flipped += usize::from(check(&case).1);
    }
    println!("{hits} hits; the rounded image alone would have answered {flipped} otherwise");
    assert!(hits > 1200 && flipped > 120);
}

/// Kept: two rays that start on the surface of which the rounded image alone would have answered with the other end,
/// and one that hardly leaves it: λ = 1.3e-12 where the rounded image's is 2.6e-12.
const STARTS_ON_THE_SURFACE: [&str; 3] = [
    "origin [-0x1.26900d4be46b6p0, 0x1.ce2d2e3803606p1, 0x1.209ec15603da0p0] direction [-0x1.ad203d5bdf893p-6, -0x1.7eb21123d6258p-7, -0x1.83d0128a22f30p-3] within (0.0, inf) affine [-0x1.37294b56d4900p-2, 0x1.4ef93fd68592ap0, -0x1.b4fc8b7722864p0] [0x1.e222d45eaccfcp-3, 0x1.070326fd69f0cp-1, 0x1.4dd3f6e083e0ap-3] [0x1.025ead62675b7p-2, -0x1.22f5efd2a3c02p0, -0x1.7c800179160e7p-2] [-0x1.7fc5b466ecf96p-1, 0x1.8c55e41128e3cp-1, -0x1.decbf3925f2b4p0] sphere [-0x1.3a435d64f6712p1, 0x1.07167dc7568f2p1, -0x1.4d2829f592a20p1] 0x1.18a31adcf8575p1",
    "origin [-0x1.4f5dcf7340808p-2, -0x1.cf1083f8719bep-1, -0x1.5775e34db830ap1] direction [-0x1.fdf89538c3917p2, -0x1.3de06ecfa15e6p2, 0x1.1602bf8158644p-1] within (0.0, inf) affine [0x1.5385ba2e5177dp0, 0x1.3b8134c1d04d3p-1, 0x1.688b94d1c62e8p-2] [0x1.1099aac4fde80p-8, -0x1.5d4640d71654ep-1, 0x1.bddfbd3d981cdp-3] [0x1.af8871e0308d3p-2, -0x1.04a99d01cdef0p-1, -0x1.e1a0ba00ace51p-2] [0x1.ef58e58161960p0, 0x1.cf64bec4682f4p-1, 0x1.289e2482fae40p0] sphere [-0x1.7d8b290189ab8p1, -0x1.9ce7e1ae03102p1, 0x1.0c0d15a469870p2] 0x1.9a1a2aa534046p-3",
    "origin [-0x1.8e84a3678707dp2, -0x1.2479fb5389529p2, -0x1.6840ef29537a1p0] direction [-0x1.a0f4b29d91c77p-2, 0x1.9f3a1680f0f70p-2, -0x1.4b0b49988a312p-1] within (0.0, inf) affine [0x1.817aa9c4e0f34p0, -0x1.40f1a4f8fcab2p0, -0x1.4d9cf19b38e60p-4] [-0x1.e7471fc9002b0p-3, -0x1.265cafa1982d6p-2, -0x1.c73d55392b4d8p0] [0x1.472fcd5f3a2e3p0, 0x1.499032eccd1a0p0, -0x1.c4e32dc873217p-2] [-0x1.118d20a42c5c7p0, -0x1.117746fb30c7cp0, 0x1.51c7187df3089p0] sphere [0x1.b4c405b3340e0p-3, 0x1.4adf15afd2710p1, -0x1.5ea0f626d423ep0] 0x1.bd57ac08f1c9bp0",
];

#[test]
fn counter_examples_stay_right() {
    for text in STARTS_ON_THE_SURFACE {
        let case = as_stored(Case::from_hex(text));
        assert_eq!(case.hex(), text);
        let affine = shape(&case.solid).unwrap().unwrap();
        let (exact, answer) = (truth(&case), affine.intersect(&case.ray, case.within));
        let (inner, ..) = innermost(&case);
        let rounded = solid(inner, &Line::from(&object_ray(&case)), case.within);
        let rounded = rounded.map(|t| t.lambda.enclosure().to_f64());
        println!("exact {:?}, rounded image {rounded:?}", exact.as_ref().map(|t| t.lambda.enclosure().to_f64()));
        assert_eq!(answer.is_some(), exact.is_some());
        if let (Some(exact), Some(hit)) = (exact, answer) {
            assert!(!measure(&hit, &exact.lambda.enclosure(), scale(&case)).violated);
            // And the rounded image's own λ is not within it.
            assert!(rounded.is_none_or(|r| (r - hit.lambda).abs() > hit.error));
        }
    }
}

/// λ of a ray whose direction is 2ᵉ as long is 2⁻ᵉ as large, however short that is: how far beside the interval hits
/// are looked for does not overflow.
#[test]
fn the_shortest_directions_lose_nothing() {
    let mut rng = Rng::new(73);
    let (mut hits, mut near) = (0, 0);
    for _ in 0..2_000 {
        let ball = Affine::new(Sphere::UNIT, stretched(&mut rng)).unwrap();
        let start = ball.world_from_object().transform_point3(rng.unit());
        let inward = rng.in_cube(1.0) * 0.3 + ball.world_from_object().translation - start;
        let long = Ray::new(start, inward);
        let whole = ball.intersect(&long, Interval::FORWARD);
        for e in [-900, -1003, -1005, -1010, -1015] {
            let by = DVec3::splat(2f64.powi(e / 2));
            let short = Ray::new(start, inward * by * DVec3::splat(2f64.powi(e - e / 2)));
            let back = short.direction * DVec3::splat(2f64.powi(-(e / 2))) * DVec3::splat(2f64.powi(e / 2 - e));
            if back != inward {
                continue;
            }
            let hit = ball.intersect(&short, Interval::FORWARD);
            hits += usize::from(hit.is_some());
            near += usize::from(whole.is_some_and(|h| h.lambda < 1e-9));
            let long_again = |x: f64| x * 2f64.powi(e / 2) * 2f64.powi(e - e / 2);
            let same = match (hit, whole) {
                (Some(hit), Some(whole)) => {
                    (long_again(hit.lambda) - whole.lambda).abs() <= long_again(hit.error) + whole.error
                }
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same, "2^{e}: {hit:?}, {whole:?}: {short:?} {ball:?}");
        }
    }
    println!("{hits} hits of short directions, {near} next to their origin");
    assert!(hits > 2_000 && near > 200);
}

/// Counts what is asked of it.
#[derive(Debug, Default)]
struct Counted {
    intersected: AtomicUsize,
    normals: AtomicUsize,
}

impl Shape for Counted {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        self.intersected.fetch_add(1, Ordering::Relaxed);
        Sphere::UNIT.intersect(ray, within)
    }
    fn normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        self.normals.fetch_add(1, Ordering::Relaxed);
        Sphere::UNIT.normal(ray, hit)
    }
    fn bounds(&self) -> Aabb {
        Sphere::UNIT.bounds()
    }
    fn tangent(&self, ray: &Ray, hit: &Hit) -> Tangent {
        self.normals.fetch_add(1, Ordering::Relaxed);
        Sphere::UNIT.tangent(ray, hit)
    }
}

fn stretched(rng: &mut Rng) -> DAffine3 {
    let turn = |rng: &mut Rng| DMat3::from_quat(DQuat::from_axis_angle(rng.unit(), rng.uniform(0.0, 6.0)));
    let scale = DVec3::new(rng.log(0.5, 2.0), -rng.log(0.5, 2.0), rng.log(0.5, 2.0));
    DAffine3 { matrix3: turn(rng) * DMat3::from_diagonal(scale) * turn(rng), translation: rng.in_cube(3.0) }
}

#[test]
fn a_chain_costs_what_one_map_does() {
    let mut rng = Rng::new(72);
    let mut asked = Vec::new();
    for depth in [1, 2, 20] {
        let counted = Counted::default();
        let mut map = DAffine3::IDENTITY;
        let mut chain: Box<dyn Shape> = Box::new(&counted);
        for _ in 0..depth {
            let next = stretched(&mut rng);
            map = next * map;
            chain = Box::new(Affine::new(chain, next).unwrap());
        }
        let made = [&counted.intersected, &counted.normals].map(|c| c.load(Ordering::Relaxed));
        let mut hits = 0;
        for _ in 0..100 {
            let (target, from) = (rng.in_cube(0.5), rng.unit() * 3.0);
            let ray = Ray::new(map.transform_point3(from), map.transform_vector3(target - from));
            let Some(hit) = chain.intersect(&ray, Interval::FORWARD) else { continue };
            hits += 1;
            chain.normal(&ray, &hit);
            chain.point(&ray, &hit);
        }
        let now = [&counted.intersected, &counted.normals].map(|c| c.load(Ordering::Relaxed));
        asked.push((hits, now[0] - made[0], now[1] - made[1]));
    }
    println!("(hits, intersect, normal) of 100 rays through 1, 2, 20 maps: {asked:?}");
    for (hits, intersected, normals) in asked {
        assert!(hits > 50 && intersected <= 100 && normals <= 6 * hits);
    }
}

/// What a chain leaves unknown grows with its length, not by a factor a link.
#[test]
fn long_chains_keep_their_bound() {
    let shift = DAffine3::from_translation(DVec3::splat(1.0 / 1024.0));
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.3), DVec3::new(0.01, 0.0, -0.01));
    for (name, map) in [("shifts", shift), ("turns", turn)] {
        let (mut whole, mut chain): (_, Box<dyn Shape>) = (DAffine3::IDENTITY, Box::new(Sphere::UNIT));
        for link in 1..=500 {
            chain = Box::new(Affine::new(chain, map).unwrap());
            whole = map * whole;
            if link % 100 == 0 {
                let from = whole.translation + DVec3::new(0.0, 0.3, 3.0);
                let ray = Ray::new(from, DVec3::new(0.0, 0.0, -1.0));
                let Hit { lambda, error, .. } = chain.intersect(&ray, Interval::FORWARD).unwrap();
                println!("{link} {name}: λ {lambda} ± {error:e}");
                assert!((lambda - (3.0 - 0.91f64.sqrt())).abs() < 1e-10 && error < 2e-15, "{link} {name}: {error:e}");
            }
        }
    }
}

/// Twenty turns by 18 degrees are one full turn: the box is that of the shape itself, not twenty boxes around boxes.
#[test]
fn a_chains_box_is_tight() {
    let turn = DAffine3::from_rotation_z(std::f64::consts::TAU / 20.0);
    let mut chain: Box<dyn Shape> = Box::new(Sphere::UNIT);
    for _ in 0..20 {
        chain = Box::new(Affine::new(chain, turn).unwrap());
    }
    let (bounds, unit) = (chain.bounds(), Sphere::UNIT.bounds());
    assert!((bounds.min - unit.min).length() < 1e-13 && (bounds.max - unit.max).length() < 1e-13, "{bounds:?}");
    // Maps whose product leaves the range of floats are refused.
    let large = DAffine3::from_scale(DVec3::splat(1e200));
    assert!(Affine::new(Affine::new(Sphere::UNIT, large).unwrap(), large).is_err());
}

/// A chain is exactly its maps one after the other: the oracle multiplies them without rounding.
#[test]
fn a_chains_bound_holds_where_its_maps_all_but_cancel() {
    let mut rng = Rng::new(20);
    let (mut hits, mut worst) = (0, 0.0f64);
    for _ in 0..400 {
        let mut solid = Solid::Sphere { center: rng.in_cube(1.0), radius: rng.log(0.3, 2.0) };
        let (mut map, mut maps) = (DAffine3::IDENTITY, Vec::new());
        for _ in 0..10 {
            let next = DAffine3 { translation: rng.in_cube(1e5), ..stretched(&mut rng) };
            maps.push(next);
        }
        // There and back, nearly: offsets of 1e5 come and go.
        let back: Vec<DAffine3> = maps.iter().rev().map(DAffine3::inverse).collect();
        for next in maps.into_iter().chain(back) {
            map = next * map;
            let object_from_world = DAffine3::IDENTITY;
            solid = Solid::Affine { world_from_object: next, object_from_world, inner: Box::new(solid) };
        }
        let (target, from) = (rng.in_cube(1.0), rng.unit() * 5.0);
        let case = as_stored(Case::new(from, (target - from) * rng.length(), solid));
        let answer = shape(&case.solid).unwrap().unwrap().intersect(&case.ray, case.within);
        let exact = truth(&case);
        object_ray(&case);
        assert_eq!(answer.is_some(), exact.is_some());
        if let (Some(hit), Some(exact)) = (answer, exact) {
            let m = measure(&hit, &exact.lambda.enclosure(), scale(&case));
            assert!(!m.violated, "{}", case.hex());
            worst = worst.max(m.ulps);
            hits += 1;
        }
    }
    println!("{hits} hits, at most {worst:.3} ulp");
    assert!(hits > 130 && worst <= 4.0);
}

#[test]
fn images_that_overflow_are_anywhere() {
    let map = DAffine3::from_cols(DVec3::splat(1e10), DVec3::splat(-1e10), DVec3::Z, DVec3::ZERO);
    let points = [DVec3::new(5.0, 0.0, 0.0), DVec3::new(1e300, 1e300, 0.0), DVec3::ZERO];
    assert!(Aabb::around_images(&points[..1], &map).contains(DVec3::splat(5e10)));
    assert_eq!(Aabb::around_images(&points, &map), Aabb::EVERYTHING);
}
