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
use truehit::{Aabb, Affine, Hit, Interval, Ray, Shape, Sphere};

fn family(number: u32) -> Family {
    families::all().into_iter().find(|f| f.kernel == Kernel::Affine && f.number == number).unwrap()
}

/// Hit or miss is what exact arithmetic says of the rounded image; where that is not what it says of the exact image, both
/// are within the documented rounding of each other (`object_ray` panics otherwise).
#[test]
fn decisions_are_exact_for_the_object_ray() {
    for number in [0, 1, 66, 67, 68, 70, 71, 72, 73, 85] {
        let (mut hits, mut differ) = (0, 0);
        for i in 0..1500 {
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
        assert!(hits > 400);
        assert_eq!(differ > 0, number == 1, "only rays that graze");
    }
}

/// A ray that starts on the surface: its rounded image may start on the other side. Which λ lies in the interval is
/// nevertheless what exact arithmetic says of the exact image, and the bound is of that λ.
#[test]
fn limits_are_compared_with_the_exact_images_lambda() {
    let (mut hits, mut flipped) = (0, 0);
    for i in 0..8000 {
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
    assert!(hits > 4000 && flipped > 400);
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
    fn curvature(&self, ray: &Ray, hit: &Hit) -> f64 {
        Sphere::UNIT.curvature(ray, hit)
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
    for _ in 0..1500 {
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
    assert!(hits > 500 && worst <= 4.0);
}
