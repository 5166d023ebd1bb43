//! The tree over boxes, against a loop over them, for boxes of every kind.

#[path = "support/rng.rs"]
mod rng;

use rng::Rng;
use std::ops::ControlFlow;
use truehit::bvh::{Bvh, Level};
use truehit::glam::DVec3;
use truehit::kernel::slab;
use truehit::{Aabb, Interval, Ray};

fn at(center: DVec3, half: DVec3) -> Aabb {
    Aabb { min: center - half, max: center + half }
}

/// Boxes that make trouble, by name.
fn families(n: usize, random: &mut Rng) -> Vec<(&'static str, Vec<Aabb>)> {
    let mut family =
        |name, f: &mut dyn FnMut(&mut Rng, usize) -> Aabb| (name, (0..n).map(|i| f(random, i)).collect::<Vec<_>>());
    let size = |r: &mut Rng, e: f64| 10f64.powf(e * r.fraction());
    vec![
        family("cubes", &mut |r, _| at(r.in_cube(1.0), DVec3::splat(0.1 * r.fraction()))),
        family("points", &mut |r, _| at(r.in_cube(1.0), DVec3::ZERO)),
        family("one centre", &mut |r, _| at(DVec3::ONE, r.in_cube(1.0).abs())),
        family("one box", &mut |_, _| Aabb::new([0.0; 3], [1.0; 3])),
        family("needles", &mut |r, _| at(r.in_cube(1.0), DVec3::new(0.5 * r.fraction(), 1e-9, 1e-9))),
        family("1e9 to 1", &mut |r, _| at(DVec3::new(1e9, 1.0, 1.0) * r.in_cube(1.0), r.in_cube(1.0).abs())),
        family("of all sizes", &mut |r, _| at(size(r, -12.0) * r.in_cube(1.0), size(r, -12.0) * DVec3::ONE)),
        family("beyond f32", &mut |r, _| at(1e200 * r.in_cube(1.0), 1e199 * DVec3::splat(r.fraction()))),
        family("subnormal", &mut |r, _| at(1e-310 * r.in_cube(1.0), 1e-311 * DVec3::splat(r.fraction()))),
        family("far away", &mut |r, _| at(1e12 + r.in_cube(1.0), DVec3::splat(0.1 * r.fraction()))),
        family("halving", &mut |_, i| at(DVec3::splat(0.5f64.powi(i as i32)), DVec3::splat(0.5f64.powi(i as i32 + 3)))),
        family("odd ones among them", &mut |r, i| match i % 7 {
            0 => Aabb::EMPTY,
            1 => Aabb::EVERYTHING,
            2 => Aabb { min: DVec3::NAN, max: DVec3::ONE },
            3 => Aabb { min: DVec3::ZERO, max: DVec3::new(f64::INFINITY, 1.0, 1.0) },
            _ => at(r.in_cube(1.0), DVec3::splat(0.1)),
        }),
    ]
}

/// Towards a point of one of the boxes, and some that are parallel to an axis.
fn aimed(boxes: &[Aabb], random: &mut Rng) -> (Ray, Interval) {
    let finite = |b: &Aabb| b.is_finite() && !b.is_empty();
    let mut pick = || loop {
        let b = boxes[random.index(boxes.len())];
        if finite(&b) {
            let w = DVec3::new(random.fraction(), random.fraction(), random.fraction());
            break b.min + w * (b.max - b.min);
        }
    };
    let (a, b) = (pick(), pick());
    let size = (b - a).abs().max_element().max(a.abs().max_element() * 1e-3).max(1e-320);
    let mut direction = b - a + 0.1 * size * random.in_cube(1.0);
    if random.index(4) == 0 {
        direction[random.index(3)] = 0.0;
    }
    let origin = if random.index(2) == 0 { a } else { a - 3.0 * direction };
    let within = match random.index(3) {
        0 => Interval::FORWARD,
        1 => Interval::new(-1.0, 0.75),
        _ => Interval::new(0.5, 2.0),
    };
    (Ray::new(origin, direction), within)
}

/// Where a ray enters a box, or where it begins inside.
fn met(b: &Aabb, ray: &Ray, within: Interval) -> Option<f64> {
    if b.min.is_nan() || b.max.is_nan() || (!b.is_empty() && !b.is_finite()) {
        return Some(within.min);
    }
    if b.is_empty() {
        return None;
    }
    slab::intersect(ray, b.min, b.max, within).map(|(enter, _)| enter.max(within.min))
}

#[test]
fn no_box_that_a_ray_meets_is_left_out() {
    let mut random = Rng::new(1);
    let (mut rays, mut boxes_met, mut visited_in_all) = (0, 0, 0);
    for n in [1, 2, 3, 8, 9, 65, 700] {
        for (name, boxes) in families(n, &mut random) {
            if !boxes.iter().any(|b| b.is_finite() && !b.is_empty()) {
                continue;
            }
            let mut tree = Bvh::build(&boxes);
            for _ in 0..60 {
                let (ray, within) = aimed(&boxes, &mut random);
                if !ray.is_valid() {
                    continue;
                }
                rays += 1;
                let expected: Vec<Option<f64>> = boxes.iter().map(|b| met(b, &ray, within)).collect();
                for (level, simd) in Level::all() {
                    let context = || format!("{name} {n} {level} {ray:?} {within:?}");
                    tree.set_level(simd);
                    let mut visits = vec![0; n];
                    tree.closest(&ray, within, |object, bound| {
                        visits[object as usize] += 1;
                        bound
                    });
                    assert!(visits.iter().all(|&v| v <= 1), "{}", context());
                    let mut asked = vec![0; n];
                    assert!(!tree.any(&ray, within, |object| {
                        asked[object as usize] += 1;
                        false
                    }));
                    for (i, e) in expected.iter().enumerate() {
                        assert!(e.is_none() || visits[i] + asked[i] == 2, "{} box {i} {:?}", context(), boxes[i]);
                        assert!(boxes[i] != Aabb::EMPTY || visits[i] + asked[i] == 0, "{}", context());
                    }
                    // The walk that shortens the ray finds the same nearest box.
                    let mut nearest = f64::INFINITY;
                    tree.closest(&ray, within, |object, bound| {
                        if let Some(enter) = expected[object as usize] {
                            nearest = nearest.min(enter);
                        }
                        bound.min(nearest)
                    });
                    let least = expected.iter().flatten().fold(f64::INFINITY, |a, &b| a.min(b));
                    assert_eq!(nearest, least, "{}", context());
                    boxes_met += expected.iter().flatten().count();
                    visited_in_all += visits.iter().sum::<usize>();
                }
            }
        }
    }
    println!("{rays} rays, {boxes_met} boxes met, {visited_in_all} visited, none left out");
    assert!(rays > 3000 && boxes_met > 10 * rays);
}

/// Among many boxes few are visited: the tree prunes.
#[test]
fn most_boxes_are_not_visited() {
    let mut random = Rng::new(2);
    let boxes: Vec<Aabb> = (0..20_000).map(|_| at(random.in_cube(1.0), DVec3::splat(0.01))).collect();
    let tree = Bvh::build(&boxes);
    let mut visits = 0;
    for _ in 0..1000 {
        tree.closest(&Ray::new(random.in_cube(1.0), random.unit()), Interval::FORWARD, |_, bound| {
            visits += 1;
            bound
        });
    }
    println!("{visits} visits of 20 000 boxes by 1000 rays");
    assert!((1000..30_000).contains(&visits));
}

/// The same tree at any number of threads, and with an observer.
#[test]
fn neither_threads_nor_observers_change_the_tree() {
    let mut random = Rng::new(3);
    let boxes: Vec<Aabb> = (0..30_000).map(|_| at(random.in_cube(1.0), 0.02 * random.in_cube(1.0).abs())).collect();
    let alone = format!("{:?}", Bvh::build(&boxes));
    assert!(alone.len() > 1_000_000);
    let observed = Bvh::build_observed(&boxes, &mut |_| ControlFlow::Continue(())).expect("nobody stops it");
    assert!(format!("{observed:?}") == alone);
    #[cfg(feature = "rayon")]
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| format!("{:?}", Bvh::build(&boxes))) == alone, "{threads} threads");
    }
}

#[test]
fn observers_see_a_build_advance_and_can_end_it() {
    let mut random = Rng::new(4);
    let boxes: Vec<Aabb> = (0..50_000).map(|_| at(random.in_cube(1.0), DVec3::splat(0.01))).collect();
    let mut shares = Vec::new();
    let tree = Bvh::build_observed(&boxes, &mut |share| {
        shares.push(share);
        ControlFlow::Continue(())
    });
    assert!(tree.is_some());
    println!("{} calls", shares.len());
    assert!(shares.len() > 20 && shares[0] == 0.0 && shares.last() == Some(&1.0));
    assert!(shares.is_sorted_by(|a, b| a < b));
    for limit in [0.0, 0.1, 0.3, 0.7, 0.95, 1.0] {
        let mut calls_after = 0;
        let tree = Bvh::build_observed(&boxes, &mut |share| {
            if share < limit {
                return ControlFlow::Continue(());
            }
            calls_after += 1;
            ControlFlow::Break(())
        });
        assert!(tree.is_none(), "{limit}");
        assert_eq!(calls_after, 1, "{limit}");
    }
    // Nothing to build is built, too.
    assert!(Bvh::build_observed(&[], &mut |_| ControlFlow::Continue(())).is_some());
}

/// Where eight boxes are met at each of six levels or more, more wait than have room on one stack.
#[test]
fn all_that_are_met_are_visited_once_however_many_wait() {
    let n = 300_000;
    let x = |i: usize| i as f64;
    let boxes: Vec<_> = (0..n).map(|i| Aabb::new([x(i), -1.0, -1.0], [x(i) + 0.5, 1.0, 1.0])).collect();
    let mut tree = Bvh::build(&boxes);
    for (name, level) in Level::all() {
        tree.set_level(level);
        for (from, to) in [(-1.0, 1.0), (x(n), -1.0)] {
            let ray = Ray::new([from, 0.0, 0.0], [to, 0.0, 0.0]);
            let mut visits = vec![0; n];
            tree.closest(&ray, Interval::FORWARD, |i, bound| {
                visits[i as usize] += 1;
                bound
            });
            assert!(visits.iter().all(|&v| v == 1), "{name}");
            assert!(!tree.any(&ray, Interval::FORWARD, |i| {
                visits[i as usize] += 1;
                false
            }));
            assert!(visits.iter().all(|&v| v == 2), "{name}");
        }
        println!("{name}: {n} of {n} boxes visited once by each query, from both ends");
    }
}
