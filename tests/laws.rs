//! What holds for every shape, on ordinary rays and on hard ones.

mod support;

use proptest::prelude::*;
use proptest::test_runner::{Config, TestCaseError, TestRunner};
use std::cell::Cell;
use std::sync::Arc;
use support::big::Big3;
use support::cases::{Case, Family, Solid};
use support::families;
use support::rng::Rng;
use support::shapes::shape;
use truehit::glam::{DAffine3, DMat3, DVec2, DVec3};
use truehit::kernel::map::Map;
use truehit::{Aabb, Affine, Hit, Interval, Ray, Shape, SurfacePoint, Tangent};

/// Runs `law` on `cases` random cases of all families whose solid is a shape; half of them ordinary rays. At least a
/// third must hit.
fn for_all(name: &str, cases: u32, law: impl Fn(&Family, &Case, &dyn Shape, &mut Rng) -> Result<bool, TestCaseError>) {
    let families: Vec<Family> =
        families::all().into_iter().filter(|f| matches!(shape(&f.case(0).solid), Some(Ok(_)))).collect();
    let ordinary: Vec<usize> = (0..families.len()).filter(|&k| families[k].number == 0).collect();
    let (tried, hits) = (Cell::new(0), Cell::new(0));
    let all = 0..families.len();
    let strategy = (prop_oneof![all, prop::sample::select(ordinary)], 0..1_000_000usize, any::<u64>());
    let mut runner = TestRunner::new(Config { failure_persistence: None, ..Config::with_cases(cases) });
    let result = runner.run(&strategy, |(k, i, seed)| {
        let case = families[k].case(i);
        if let Some(Ok(shape)) = shape(&case.solid) {
            tried.set(tried.get() + 1);
            if law(&families[k], &case, &*shape, &mut Rng::new(seed))? {
                hits.set(hits.get() + 1);
            }
        }
        Ok(())
    });
    println!("{name}: {} cases, {} hits", tried.get(), hits.get());
    if let Err(e) = result {
        panic!("{name}: {e}");
    }
    assert!(3 * hits.get() > tried.get(), "{name}: only {} hits of {}", hits.get(), tried.get());
}

#[test]
fn occludes_is_intersect() {
    for_all("occludes", 20_000, |_, case, shape, _| {
        let hit = shape.intersect(&case.ray, case.within);
        prop_assert_eq!(hit.is_some(), shape.occludes(&case.ray, case.within));
        Ok(hit.is_some())
    });
}

#[test]
fn a_hit_lies_in_its_interval_and_its_point_in_the_bounds() {
    for_all("bounds", 20_000, |family, case, shape, _| {
        let Some(hit) = shape.intersect(&case.ray, case.within) else { return Ok(false) };
        prop_assert!(hit.lambda.is_finite() && hit.error >= 0.0);
        prop_assert!(hit.lambda + hit.error >= case.within.min && hit.lambda - hit.error <= case.within.max);
        let SurfacePoint { position, error } = shape.point(&case.ray, &hit);
        let bounds = shape.bounds();
        prop_assert!(!bounds.is_empty());
        let grown = Aabb { min: bounds.min - error, max: bounds.max + error };
        prop_assert!(grown.contains(position), "{} {position} off {bounds:?} by more than {error:e}", family.name);
        // Neither is the box wasteful: a point is no further off than a few roundings of the largest coordinate.
        let size = case.ray.origin.abs().max(position.abs()).max_element();
        prop_assert!(error <= 1e-9 * size || family.number != 0, "{} error {error:e} of {size:e}", family.name);
        Ok(true)
    });
}

/// The exact direction of the exact normal, in floats, where the shape has one that needs no point.
fn flat_normal(solid: &Solid) -> Option<DVec3> {
    let exact = match solid {
        Solid::Plane { normal, .. } => Big3::from(*normal),
        Solid::Triangle([a, b, c]) => {
            let a = Big3::from(*a);
            Big3::from(*b).minus(&a).cross(&Big3::from(*c).minus(&a))
        }
        _ => return None,
    };
    exact.direction()
}

#[test]
fn normals_are_unit_vectors_and_outward() {
    for_all("normals", 20_000, |family, case, shape, _| {
        let Some(hit) = shape.intersect(&case.ray, case.within) else { return Ok(false) };
        let n = shape.normal(&case.ray, &hit);
        prop_assert!((n.length() - 1.0).abs() < 1e-15, "{} |n| = 1 + {:e}", family.name, n.length() - 1.0);
        prop_assert_eq!(shape.shading_normal(&case.ray, &hit), n);
        if let Some(exact) = flat_normal(&case.solid) {
            prop_assert!((n - exact).abs().max_element() < 1e-15, "{} {n} for {exact}", family.name);
        }
        if let Solid::Sphere { center, radius } = &case.solid
            && (1e-100..1e100).contains(radius)
            && case.ray.origin.length() < 1e10 * radius
        {
            let out = (shape.point(&case.ray, &hit).position - *center) / *radius;
            let size = center.length() / radius + 1.0;
            prop_assert!((n - out).length() < 1e-14 * size, "{} {n} for {out}", family.name);
        }
        Ok(true)
    });
}

/// Whether every coordinate leaves room for factors of 2^±100.
fn is_ordinary(case: &Case) -> bool {
    let mut all = vec![case.ray.origin, case.ray.direction];
    match &case.solid {
        Solid::Plane { point, normal } => all.extend([*point, *normal]),
        Solid::Triangle(v) => all.extend(v),
        Solid::Sphere { center, radius } => all.extend([*center, DVec3::splat(*radius)]),
        Solid::Frustum { base, top, base_radius, top_radius } => {
            all.extend([*base, *top, DVec3::new(*base_radius, *top_radius, 1.0)]);
        }
        _ => return false,
    }
    all.iter().flat_map(DVec3::to_array).all(|x| x == 0.0 || (1e-50..1e50).contains(&x.abs()))
}

#[test]
fn powers_of_two_scale_lambda_exactly() {
    let scaled = |solid: &Solid, s: f64| match solid.clone() {
        Solid::Plane { point, normal } => Solid::Plane { point: point * s, normal },
        Solid::Triangle(v) => Solid::Triangle(v.map(|p| p * s)),
        Solid::Sphere { center, radius } => Solid::Sphere { center: center * s, radius: radius * s },
        Solid::Frustum { base, top, base_radius, top_radius } => {
            Solid::Frustum { base: base * s, top: top * s, base_radius: base_radius * s, top_radius: top_radius * s }
        }
        other => other,
    };
    for_all("scaling", 20_000, |family, case, s, rng| {
        if !is_ordinary(case) {
            return Ok(s.intersect(&case.ray, case.within).is_some());
        }
        let (j, k) = (2f64.powi(rng.integer(-60, 60) as i32), 2f64.powi(rng.integer(-60, 60) as i32));
        let larger = shape(&scaled(&case.solid, j)).unwrap().unwrap();
        // Coordinates by j, the direction by k: λ by j/k.
        let ray = Ray { origin: case.ray.origin * j, direction: case.ray.direction * k };
        let within = Interval::new(case.within.min * j / k, case.within.max * j / k);
        let (hit, other) = (s.intersect(&case.ray, case.within), larger.intersect(&ray, within));
        prop_assert_eq!(hit.map(|h| (h.lambda, h.part)), other.map(|h| (h.lambda * k / j, h.part)), "{}", family.name);
        Ok(hit.is_some())
    });
}

#[test]
fn a_reversed_direction_mirrors() {
    for_all("reversed", 20_000, |family, case, shape, _| {
        let back = Ray { direction: -case.ray.direction, ..case.ray };
        let within = Interval::new(-case.within.max, -case.within.min);
        let (hit, other) = (shape.intersect(&case.ray, case.within), shape.intersect(&back, within));
        prop_assert_eq!(hit.is_some(), other.is_some(), "{}", family.name);
        let (Some(hit), Some(other)) = (hit, other) else { return Ok(false) };
        // Other ends and triangles come first: the one meant is further on, unless no float lies between them.
        let off = |other: &Hit| (hit.lambda + other.lambda).abs() - (hit.error + other.error);
        let mut least = off(&other);
        let mut last = other;
        while least > 0.0 {
            let rest = Interval::new((last.lambda + last.error).next_up(), within.max);
            let Some(next) = shape.intersect(&back, rest) else {
                least -= 4.0 * f64::EPSILON * hit.lambda.abs();
                break;
            };
            least = least.min(off(&next));
            last = next;
        }
        prop_assert!(least <= 0.0, "{} {} {}", family.name, hit.lambda, other.lambda);
        Ok(true)
    });
}

/// x + t if that is exact in every coordinate.
fn moved(v: DVec3, t: DVec3) -> Option<DVec3> {
    let sum = v + t;
    let exact = Big3::from(v).plus(&t.into()).minus(&sum.into()).is_zero();
    exact.then_some(sum)
}

fn moved_solid(solid: &Solid, t: DVec3) -> Option<Solid> {
    Some(match solid.clone() {
        Solid::Plane { point, normal } => Solid::Plane { point: moved(point, t)?, normal },
        Solid::Triangle([a, b, c]) => Solid::Triangle([moved(a, t)?, moved(b, t)?, moved(c, t)?]),
        Solid::Sphere { center, radius } => Solid::Sphere { center: moved(center, t)?, radius },
        Solid::Frustum { base, top, base_radius, top_radius } => {
            Solid::Frustum { base: moved(base, t)?, top: moved(top, t)?, base_radius, top_radius }
        }
        _ => return None,
    })
}

#[test]
fn exact_translations_change_nothing() {
    let compared = Cell::new(0);
    for_all("translated", 40_000, |family, case, s, rng| {
        let hit = s.intersect(&case.ray, case.within);
        let t = rng.small(512);
        let (Some(origin), Some(solid)) = (moved(case.ray.origin, t), moved_solid(&case.solid, t)) else {
            return Ok(hit.is_some());
        };
        compared.set(compared.get() + 1);
        let other = shape(&solid).unwrap().unwrap().intersect(&Ray { origin, ..case.ray }, case.within);
        prop_assert_eq!(hit.map(|h| h.part), other.map(|h| h.part), "{}", family.name);
        if let (Some(hit), Some(other)) = (hit, other) {
            prop_assert!((hit.lambda - other.lambda).abs() <= hit.error + other.error, "{}", family.name);
        }
        Ok(hit.is_some())
    });
    println!("{} moved exactly", compared.get());
    assert!(compared.get() > 1000);
}

#[test]
fn the_identity_map_changes_nothing_and_exact_maps_nest() {
    let (identical, compared) = (Cell::new(0), Cell::new(0));
    for_all("identity, nested", 10_000, |family, case, s, rng| {
        let hit = s.intersect(&case.ray, case.within);
        let same = Affine::new(s, DAffine3::IDENTITY).unwrap();
        let mapped = same.intersect(&case.ray, case.within);
        // An image's bound allows for underflow, which a λ next to the smallest float is not above.
        let [o, d] = [case.ray.origin, case.ray.direction].map(|v| v.to_array());
        if o.iter().chain(&d).any(|x| *x != 0.0 && x.abs() < 1e-200) {
            return Ok(hit.is_some());
        }
        identical.set(identical.get() + 1);
        prop_assert_eq!(hit.map(|h| (h.lambda, h.part)), mapped.map(|h| (h.lambda, h.part)), "{}", family.name);
        if let (Some(hit), Some(mapped)) = (hit, mapped) {
            prop_assert!(mapped.error >= hit.error);
            let (n, m) = (s.normal(&case.ray, &hit), same.normal(&case.ray, &hit));
            prop_assert!((n - m).length() < 1e-15, "{} {n} {m}", family.name);
        }
        // A permutation with signs and powers of two, there and back: the ray's image is exact, and so is each map.
        let k = 2f64.powi(rng.integer(-20, 20) as i32);
        let turn = DMat3::from_cols(DVec3::Y * k, DVec3::Z * -k, DVec3::X * k * rng.sign());
        let map = DAffine3::from_mat3(turn);
        if is_ordinary(case) {
            let inner = Affine::new(s, map).unwrap();
            let nested = Affine::new(&inner, map.inverse()).unwrap();
            let nested = nested.intersect(&case.ray, case.within);
            prop_assert_eq!(hit.map(|h| (h.lambda, h.part)), nested.map(|h| (h.lambda, h.part)), "{}", family.name);
            let outer = Ray { origin: turn * case.ray.origin, direction: turn * case.ray.direction };
            let once = inner.intersect(&outer, case.within);
            prop_assert_eq!(hit.map(|h| (h.lambda, h.part)), once.map(|h| (h.lambda, h.part)), "{}", family.name);
            compared.set(compared.get() + 1);
        }
        Ok(hit.is_some())
    });
    println!("{} by the identity, {} nested", identical.get(), compared.get());
    assert!(identical.get() > 8000 && compared.get() > 1000);
}

/// No method of this shape answers as the trait's defaults would.
#[derive(Debug)]
struct Probe(Map);

impl Shape for Probe {
    fn intersect(&self, _: &Ray, _: Interval) -> Option<Hit> {
        Some(Hit { lambda: 1.0, error: 2.0, uv: DVec2::new(3.0, 4.0), part: 5 })
    }
    fn normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        DVec3::splat(6.0)
    }
    fn bounds(&self) -> Aabb {
        Aabb::new([7.0; 3], [8.0; 3])
    }
    fn occludes(&self, _: &Ray, _: Interval) -> bool {
        false
    }
    fn shading_normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        DVec3::splat(9.0)
    }
    fn texture_coordinates(&self, _: &Ray, _: &Hit) -> DVec2 {
        DVec2::splat(10.0)
    }
    fn point(&self, _: &Ray, _: &Hit) -> SurfacePoint {
        SurfacePoint { position: DVec3::splat(11.0), error: 12.0 }
    }
    fn departs(&self, _: &Ray, _: &Hit, _: bool) -> bool {
        false
    }
    fn tangent(&self, _: &Ray, _: &Hit) -> Tangent {
        Tangent { normal: DVec3::splat(13.0), normal_error: 18.0, curvature: 19.0 }
    }
    fn precise_lambda(&self, _: &Ray, _: &Hit) -> [f64; 2] {
        [14.0, 15.0]
    }
    fn bounds_under(&self, _: &DAffine3) -> Aabb {
        Aabb::new([16.0; 3], [17.0; 3])
    }
    fn seen_through(&self) -> Option<(&dyn Shape, &Map)> {
        Some((self, &self.0))
    }
}

fn everything(shape: impl Shape) -> String {
    let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
    let hit = shape.intersect(&ray, Interval::FORWARD).unwrap();
    format!(
        "{hit:?} {} {:?} {} {} {} {:?} {} {:?} {:?} {:?} {:?}",
        shape.normal(&ray, &hit),
        shape.bounds(),
        shape.occludes(&ray, Interval::FORWARD),
        shape.shading_normal(&ray, &hit),
        shape.texture_coordinates(&ray, &hit),
        shape.point(&ray, &hit),
        shape.departs(&ray, &hit, true),
        shape.tangent(&ray, &hit),
        shape.precise_lambda(&ray, &hit),
        shape.bounds_under(&DAffine3::IDENTITY),
        shape.seen_through(),
    )
}

#[test]
fn pointers_forward_every_method() {
    let probe = || Probe(DAffine3::IDENTITY.into());
    let (borrowed, value) = (probe(), everything(probe()));
    assert_eq!(everything(&borrowed), value);
    assert_eq!(everything(Box::new(probe())), value);
    assert_eq!(everything(Arc::new(probe())), value);
    assert_eq!(everything(Box::new(probe()) as Box<dyn Shape>), value);
    assert_eq!(everything(Arc::new(probe()) as Arc<dyn Shape>), value);
    assert_eq!(everything(&borrowed as &dyn Shape), value);
    assert_eq!(everything(Arc::new(Box::new(probe()) as Box<dyn Shape>)), value);
}
