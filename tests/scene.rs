//! The scene's own promises, on a user's shape: nearest, ties, odd boxes, emptiness.

#[path = "support/rng.rs"]
mod rng;

mod meshes;

use rng::Rng;
use std::sync::Arc;
use truehit::glam::{DAffine3, DQuat, DVec2, DVec3};
use truehit::{Aabb, Affine, Camera, Hit, Interval, Mesh, Plane, Ray, Scene, Shape, Sphere, Triangle};

/// A sphere of triangles, quartered so often.
fn globe(times: u32) -> Mesh {
    let (positions, triangles) = meshes::icosphere(times);
    Mesh::new(positions, triangles).unwrap()
}

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

/// A camera's rays in tiles and in rows, rays without order, rays to a light: what many rays are answered together is
/// what each is answered alone.
#[test]
fn slices_are_answered_like_their_rays() {
    let mut r = Rng::new(5);
    let mut builder = Scene::builder();
    let shared = Arc::new(globe(3));
    builder.push(Plane::new([0.0, 0.0, -2.0], [0.1, 0.0, 1.0]).unwrap(), ());
    builder.push(globe(4), ());
    builder.push(Sphere::new([1.5, 0.5, 0.2], 0.7).unwrap(), ());
    builder.push(wall(-1.9), ());
    for i in 0..40 {
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.3) + 0.2 * r.in_cube(1.0).abs(),
            DQuat::from_axis_angle(r.unit(), 2.0),
            3.0 * r.in_cube(1.0),
        );
        if i % 4 == 0 {
            builder.push(Affine::new(Sphere::UNIT, place).unwrap(), ());
        } else {
            builder.push(Affine::new(shared.clone(), place).unwrap(), ());
        }
    }
    // Twice the same: the first is answered.
    builder.push(globe(4), ());
    let scene = builder.build();

    let camera = Camera::look_at([0.0, -9.0, 2.0], [0.0; 3], [0.0, 0.0, 1.0], 0.7, [64, 64]).unwrap();
    let pixel = |i: u32, j: u32| (camera.pixel(i, j), Interval::FORWARD);
    let rows: Vec<_> = (0..64 * 64).map(|at| pixel(at % 64, at / 64)).collect();
    let tiles: Vec<_> = (0..64 * 64).map(|at| pixel(at / 16 % 16 * 4 + at % 4, at / 256 * 4 + at / 4 % 4)).collect();
    let anyhow: Vec<_> = (0..2000)
        .map(|_| (Ray::new(6.0 * r.in_cube(1.0), r.unit()), Interval::new(0.0, r.uniform(1.0, 20.0))))
        .collect();
    let lamp = DVec3::new(4.0, -5.0, 6.0);
    let to_lamp = rows.iter().filter_map(|(ray, within)| {
        let hit = scene.intersect(ray, *within)?;
        Some((scene.surface(ray, &hit).spawn_to(lamp), Interval::new(0.0, 1.0)))
    });
    let to_lamp: Vec<_> = to_lamp.collect();
    let mut odd = rows[1000..1100].to_vec();
    odd[40].0.direction = DVec3::NAN;
    odd[41].1 = Interval::new(2.0, 1.0);
    odd[77].0.origin = DVec3::splat(1e300);

    for (name, rays) in
        [("rows", &rows), ("tiles", &tiles), ("anyhow", &anyhow), ("to the lamp", &to_lamp), ("odd", &odd)]
    {
        let alone: Vec<_> = rays.iter().map(|(ray, within)| scene.intersect(ray, *within)).collect();
        let hits = alone.iter().flatten().count();
        println!("{name}: {hits} of {} rays hit", rays.len());
        assert!(5 * hits > rays.len(), "{name}");
        for length in [rays.len(), 100, 32, 9] {
            for (rays, alone) in rays.chunks(length).zip(alone.chunks(length)) {
                let (mut together, mut dark) = (vec![None; rays.len()], vec![false; rays.len()]);
                scene.intersect_each(rays, &mut together);
                scene.occludes_each(rays, &mut dark);
                for (i, (ray, within)) in rays.iter().enumerate() {
                    assert_eq!(together[i], alone[i], "{name}, {length} at a time: {ray:?} {within:?}");
                    assert_eq!(dark[i], alone[i].is_some(), "{name}, {length} at a time: {ray:?} {within:?}");
                }
            }
        }
    }
    scene.intersect_each(&[], &mut []);
}

/// Slivers in the plane of a large triangle, seen at a slant: objects that all but tie, and kernels that look closer
/// next to the limit that the others set. What is answered is what the object answers by itself, in whatever order they
/// were met.
#[test]
fn answers_do_not_depend_on_what_was_met_before() {
    let mut r = Rng::new(11);
    let (mut rays_in_all, mut hits_in_all) = (0, 0);
    for round in 0..100 {
        let (width, slant) = (r.log(1e-15, 1e-11), [0.0, 0.3, 2.0, -1.0][round % 4]);
        let p = |x: f64, y: f64| DVec3::new(x, y, slant * x + 0.5 * slant * y);
        let mut builder = Scene::builder();
        let mut slivers = Vec::new();
        for i in 0..7 {
            if i == round % 7 {
                builder.push(Triangle::new(p(-0.4, -0.4), p(0.5, -0.4), p(0.0, 0.6)).unwrap(), ());
                continue;
            }
            let (x, y) = (r.uniform(-0.3, 0.3), r.uniform(-0.3, 0.3));
            let sliver = [p(-x, -y), p(x, y), p(x + width, y - width)];
            if let Ok(triangle) = Triangle::new(sliver[0], sliver[1], sliver[2]) {
                builder.push(triangle, ());
            }
            slivers.push(sliver);
        }
        let scene = builder.build();
        let eye = DVec3::new(0.5, -3.0, r.uniform(4.0, 7.0));
        let ray = |i: usize| {
            let ([a, b, c], t) = (slivers[i % slivers.len()], r.uniform(0.2, 0.4));
            (Ray::new(eye, a * t + (b + c) * (0.5 * (1.0 - t)) - eye), Interval::FORWARD)
        };
        let rays: Vec<_> = (0..256).map(ray).collect();
        let mut together = vec![None; rays.len()];
        scene.intersect_each(&rays, &mut together);
        for ((ray, within), together) in rays.iter().zip(together) {
            let alone = scene.intersect(ray, *within);
            assert_eq!(alone, together, "{ray:?}");
            let itself = alone.and_then(|hit| scene.shape(hit.object).intersect(ray, *within));
            assert_eq!(itself, alone.map(|hit| hit.hit), "{ray:?}");
            hits_in_all += usize::from(alone.is_some());
        }
        rays_in_all += rays.len();
    }
    println!("{hits_in_all} of {rays_in_all} rays hit");
    assert!(2 * hits_in_all > rays_in_all);
}
