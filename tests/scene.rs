//! The scene's own promises, on a user's shape: nearest, ties, odd boxes, emptiness.

use truehit::glam::{DVec2, DVec3};
use truehit::{Aabb, Hit, Interval, Plane, Ray, Scene, Shape};

/// The plane z = `z`, as a user might write it: it claims `error`, and knows its λ to `low` more.
#[derive(Debug)]
struct Wall {
    z: f64,
    low: f64,
    error: f64,
    bounds: Aabb,
}

fn wall(z: f64) -> Wall {
    Wall { z, low: 0.0, error: 0.0, bounds: Aabb::new([-1e9, -1e9, z], [1e9, 1e9, z]) }
}

impl Shape for Wall {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        let lambda = (self.z - ray.origin.z) / ray.direction.z;
        let inside = within.min < lambda && lambda < within.max;
        inside.then_some(Hit { lambda, error: self.error, uv: DVec2::ZERO, part: 0 })
    }
    fn normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        DVec3::Z
    }
    fn bounds(&self) -> Aabb {
        self.bounds
    }
    fn precise_lambda(&self, _: &Ray, hit: &Hit) -> [f64; 2] {
        [hit.lambda, self.low]
    }
}

const DOWN: Ray = Ray { origin: DVec3::ZERO, direction: DVec3::NEG_Z };

fn nearest(walls: impl IntoIterator<Item = Wall>) -> Option<usize> {
    let mut builder = Scene::builder();
    for (index, wall) in walls.into_iter().enumerate() {
        assert_eq!(builder.push(wall, index), index);
    }
    let scene = builder.build();
    let found = scene.intersect(&DOWN, Interval::FORWARD);
    assert_eq!(scene.occludes(&DOWN, Interval::FORWARD), found.is_some());
    found.map(|found| {
        assert_eq!(*scene.tag(found.object), found.object);
        found.object
    })
}

#[test]
fn an_empty_scene_is_legal_and_everything_misses() {
    let scene = Scene::<()>::builder().build();
    assert!(scene.is_empty());
    assert_eq!(scene.len(), 0);
    assert!(scene.bounds().is_empty());
    assert_eq!(scene.intersect(&DOWN, Interval::FORWARD), None);
    assert!(!scene.occludes(&DOWN, Interval::FORWARD));
}

#[test]
fn one_unbounded_plane_is_a_scene() {
    let mut builder = Scene::builder();
    builder.push(Plane::new([0.0, 0.0, -2.0], [0.0, 0.0, 1.0]).unwrap(), ());
    let scene = builder.build();
    assert!(!scene.bounds().is_finite());
    assert_eq!(scene.intersect(&DOWN, Interval::FORWARD).map(|found| found.hit.lambda), Some(2.0));
    assert!(scene.occludes(&DOWN, Interval::FORWARD) && !scene.occludes(&DOWN, Interval::new(0.0, 2.0)));
}

#[test]
fn the_nearest_wins_in_any_order() {
    assert_eq!(nearest([wall(-3.0), wall(-1.0), wall(-2.0), wall(4.0)]), Some(1));
    assert_eq!(nearest([wall(-1.0), wall(-2.0), wall(-3.0)]), Some(0));
    assert_eq!(nearest([wall(1.0), wall(2.0)]), None);
}

#[test]
fn of_equal_hits_the_lowest_object_wins_whether_bounded_or_not() {
    assert_eq!(nearest([wall(-2.0), wall(-1.0), wall(-1.0)]), Some(1));
    let unbounded = |z| Wall { bounds: Aabb::EVERYTHING, ..wall(z) };
    assert_eq!(nearest([wall(-1.0), unbounded(-1.0)]), Some(0));
    assert_eq!(nearest([unbounded(-1.0), wall(-1.0)]), Some(0));
}

#[test]
fn hits_within_their_bounds_are_compared_by_precise_lambda() {
    let coarse = |low| Wall { low, error: 1e-3, ..wall(-1.0) };
    assert_eq!(nearest([coarse(0.0), coarse(-1e-20), coarse(1e-20)]), Some(1));
    assert_eq!(nearest([coarse(1e-20), coarse(0.0), coarse(-1e-20)]), Some(2));
    // The rounded λ of the second is smaller; the true one of the first is.
    let a = Wall { low: -1e-4, ..coarse(0.0) };
    let b = Wall { z: -1.0 + 1e-5, ..coarse(0.0) };
    assert_eq!(nearest([b, a]), Some(1));
}

#[test]
fn a_shape_that_claims_nothing_is_compared_by_its_lambda() {
    for error in [f64::INFINITY, f64::NAN] {
        let vague = |z| Wall { error, ..wall(z) };
        assert_eq!(nearest([vague(-2.0), vague(-1.0), vague(-3.0), vague(-1.0)]), Some(1));
    }
}

#[test]
fn odd_boxes_lose_no_hit() {
    for (min, max) in [(f64::NAN, f64::NAN), (f64::NAN, 0.0), (0.0, f64::INFINITY), (1.0, -1.0)] {
        let bounds = Aabb { min: DVec3::splat(min), max: DVec3::splat(max) };
        assert_eq!(nearest([wall(-5.0), Wall { bounds, ..wall(-1.0) }]), Some(1), "{bounds:?}");
    }
    let mut builder = Scene::builder();
    builder.push(Wall { bounds: Aabb { min: DVec3::NAN, max: DVec3::NAN }, ..wall(-1.0) }, ());
    assert_eq!(builder.build().bounds(), Aabb::EVERYTHING);
}

#[test]
fn rays_and_intervals_that_hold_nothing_miss() {
    let mut builder = Scene::builder();
    builder.push(wall(-1.0), ());
    let scene = builder.build();
    assert_eq!(scene.bounds(), Aabb::new([-1e9, -1e9, -1.0], [1e9, 1e9, -1.0]));
    let nan = Ray { origin: DVec3::NAN, direction: DVec3::NEG_Z };
    assert_eq!(scene.intersect(&nan, Interval::FORWARD), None);
    for (min, max) in [(f64::NAN, 2.0), (0.0, f64::NAN), (2.0, 0.0), (1.0, 2.0), (0.0, 1.0)] {
        assert_eq!(scene.intersect(&DOWN, Interval::new(min, max)), None, "({min}, {max})");
    }
    assert!(scene.intersect(&DOWN, Interval::new(-5.0, 1.0_f64.next_up())).is_some());
}

#[test]
fn scenes_cross_threads() {
    fn assert_send_sync<T: Send + Sync + 'static>() {}
    assert_send_sync::<Scene<u32>>();
}
