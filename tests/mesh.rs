//! A mesh answers what a loop over its triangles answers, to the bit, and nothing slips through.

mod meshes;
mod support;

use glam::DVec3;
use meshes::{Parts, grid_cube, icosphere, moved, soup, torus};
use std::cmp::Ordering;
use support::rng::{self, Rng};
use support::sweep::on_all_cores;
use truehit::bvh::Level;
use truehit::kernel::triangle;
use truehit::{Hit, Interval, Mesh, Ray, Shape, glam};

/// The definition: every triangle, the nearest exactly, the lowest of equals.
fn brute_force(mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for part in 0..mesh.triangles().len() as u32 {
        let vertices = mesh.vertices(part);
        if let Some(hit) = triangle::intersect(ray, &vertices, within) {
            let hit = Hit { part, ..hit };
            let first =
                best.is_none_or(|b| triangle::compare(ray, &vertices, &mesh.vertices(b.part)) == Ordering::Less);
            if first {
                best = Some(hit);
            }
        }
    }
    best
}

/// A ray at something of the mesh, from somewhere around it: (ray, interval).
fn aimed(mesh: &Mesh, random: &mut Rng) -> (Ray, Interval) {
    let [a, b, c] = mesh.vertices(random.index(mesh.triangles().len()) as u32);
    let target = match random.index(5) {
        0 => a,
        1 => 0.5 * (a + b),
        2 => a + random.fraction() * (c - a),
        3 => 0.25 * a + 0.5 * b + 0.25 * c,
        _ => a + random.in_cube(1.0) * (b - a).length(),
    };
    let (middle, size) = (mesh.bounds().center(), mesh.bounds().size().length());
    let origin = match random.index(6) {
        0 => middle + 0.5 * size * random.in_cube(1.0),
        1 => middle + size * random.in_cube(1.0),
        2 => middle + 1e3 * size * random.in_cube(1.0),
        3 => middle + 1e7 * size * random.in_cube(1.0),
        4 => b, // on the surface
        _ => target + size * DVec3::AXES[random.index(3)],
    };
    let mut direction = target - origin;
    match random.index(9) {
        0 => direction *= 2f64.powi(random.index(600) as i32 - 300),
        // Too flat for a slope of their own, of either sign, zeros included.
        3 => direction[random.index(3)] *= [-0.0, 0.0, -1e-30, 1e-30, -1e-300][random.index(5)],
        1 => direction = direction.normalize_or(DVec3::X),
        2 => direction = DVec3::AXES[random.index(3)],
        _ => {}
    }
    let within = match random.index(8) {
        0 => Interval::LINE,
        // Next to where the target is.
        4 => Interval::new(-1e300, 1f64.next_up()),
        5 => Interval::new([1f64.next_down(), 1.0, 1e-310][random.index(3)], 1e300),
        1 => Interval::new(-1.0, 2.0),
        2 => Interval::new(0.0, 1.0),
        3 => Interval::new(0.5, 1.0 + random.fraction()),
        _ => Interval::FORWARD,
    };
    (Ray::new(origin, direction), within)
}

/// (rays, hits) compared on every level.
fn compare(name: &str, (positions, triangles): Parts, rays: usize, random: &mut Rng) -> (usize, usize) {
    let mut mesh = Mesh::new(positions, triangles).unwrap();
    let mut hits = 0;
    for _ in 0..rays {
        let (ray, within) = aimed(&mesh, random);
        let expected = brute_force(&mesh, &ray, within);
        hits += usize::from(expected.is_some());
        for (level, simd) in Level::all() {
            mesh.set_level(simd);
            let hit = mesh.intersect(&ray, within);
            assert_eq!(hit, expected, "{name} {level} {ray:?} {within:?}");
            assert_eq!(mesh.occludes(&ray, within), expected.is_some(), "{name} {level} {ray:?} {within:?}");
        }
    }
    (rays, hits)
}

#[test]
fn answers_are_those_of_a_loop() {
    let mut random = Rng::new(1);
    let (mut rays, mut hits) = (0, 0);
    let mut run = |name: &str, parts: Parts, n: usize| {
        let (r, h) = compare(name, parts, n, &mut random);
        rays += r;
        hits += h;
    };
    let mut seed = Rng::new(2);
    for n in [1, 2, 7, 8, 9, 60, 600] {
        for size in [1e-3, 0.1, 1.0] {
            run("soup", soup(&mut seed, n, size), 400);
        }
    }
    for exponent in [-300, -140, -40, 40, 140, 250] {
        let parts = moved(soup(&mut seed, 100, 0.3), 2f64.powi(exponent), DVec3::ZERO);
        run("scaled soup", parts, 400);
    }
    for offset in [64.0, 1e4, 1e6, 1e12] {
        let offset = offset * seed.in_cube(1.0);
        run("far soup", moved(soup(&mut seed, 100, 0.3), 1.0, offset), 400);
        run("far sphere", moved(icosphere(2), 1.0, offset), 400);
    }
    run("sphere", icosphere(3), 1000);
    run("torus", torus(20), 1000);
    run("grid", grid_cube(5), 2000);
    println!("{rays} rays, {hits} hits, {} levels, 0 differences", Level::all().len());
    assert!(hits > rays / 4, "{hits} of {rays}");
}

/// Tiles of a camera's rays at a point of the mesh, some exactly at a vertex, a few of them spoiled.
fn tile(mesh: &Mesh, random: &mut Rng) -> Vec<(Ray, Interval)> {
    let size = mesh.bounds().size().length();
    let corners = mesh.vertices(random.index(mesh.triangles().len()) as u32);
    let target = corners[random.index(3)];
    let eye = mesh.bounds().center() + (0.2 + random.fraction()) * size * random.unit();
    let step = (target - eye).length() * 0.1f64.powi(1 + random.index(4) as i32);
    let (right, up) = (step * random.unit(), step * random.unit());
    let spoiled = random.index(8);
    // Along an axis: components that are zero, and of either sign beside each other.
    let axis = [DVec3::X, DVec3::Y, DVec3::Z][random.index(3)];
    let (eye, right, up) = if spoiled >= 6 {
        (target + size * axis, step * axis.any_orthogonal_vector(), step * axis.cross(axis.any_orthogonal_vector()))
    } else {
        (eye, right, up)
    };
    let to_light = random.index(3) == 0;
    // Lights in the plane of a triangle, at a vertex, and on the surface but for roundings; and rays that f32 has
    // rounded.
    let eye = match random.index(8) {
        0 => corners[0] + 1.5 * (corners[1] - corners[0]) + 0.7 * (corners[2] - corners[0]),
        1 => corners[random.index(3)],
        2 => (corners[0] + corners[1] + corners[2]) / 3.0,
        _ => eye,
    };
    let ends = [[0.0, 1.0], [0.0, 2.0], [0.5, 1.0], [-1.0, 1.0], [0.0, 1.0 + 1e-9], [1.0 - 1e-9, 1.0]][random.index(6)];
    let narrow = random.index(2) == 0;
    (0..96)
        .map(|i| {
            let (x, y) = (f64::from(i % 4) - 1.0, f64::from(i / 4 % 8) - 1.0);
            let at = target + x * right + y * up;
            let ray = if to_light { Ray::new(at, eye - at) } else { Ray::new(eye, at - eye) };
            let round = |v: DVec3| if narrow { v.as_vec3().as_dvec3() } else { v };
            let ray = Ray { origin: round(ray.origin), direction: round(ray.direction) };
            let within = if to_light { Interval::new(ends[0], ends[1]) } else { Interval::FORWARD };
            match (spoiled, i) {
                (0, 20) => (Ray::new(ray.origin, -ray.direction), within),
                (1, 21) => (Ray::new(ray.origin, DVec3::NAN), within),
                (2, 22) => (ray, Interval::new(1.0, 1.0)),
                (3, 23) => (Ray::new(1e9 * ray.origin, ray.direction), within),
                (4, _) => (ray, Interval::new(0.0, 0.9 + 0.01 * f64::from(i))),
                (7, _) => (Ray::new(at + size * axis, -axis), Interval::FORWARD),
                _ => (ray, within),
            }
        })
        .collect()
}

/// Asserts that a slice is answered as its rays are one by one, nearest and any hit, with every instruction set; how
/// many hit.
fn answered_alike(mesh: &mut Mesh, rays: &[(Ray, Interval)]) -> usize {
    let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
    for (level, simd) in Level::all() {
        mesh.set_level(simd);
        mesh.intersect_each(rays, &mut hits);
        mesh.occludes_each(rays, &mut occluded);
        for (i, (ray, within)) in rays.iter().enumerate() {
            let alone = mesh.intersect(ray, *within);
            assert_eq!(hits[i], alone, "{level}: ray {i}, {ray:?} {within:?}");
            assert_eq!(occluded[i], alone.is_some(), "{level}: ray {i}, {ray:?} {within:?}");
            assert_eq!(mesh.occludes(ray, *within), alone.is_some(), "{level}: ray {i}, {ray:?} {within:?}");
        }
    }
    hits.iter().flatten().count()
}

#[test]
fn slices_are_answered_as_their_rays_are() {
    let mut random = Rng::new(21);
    let (mut rays_in_all, mut hits_in_all) = (0, 0);
    let meshes = [icosphere(3), torus(30), grid_cube(6), soup(&mut Rng::new(22), 500, 0.2), icosphere(5)];
    let far = moved(torus(12), 1e-3, DVec3::new(1e5, 2e5, -3e5));
    for (positions, triangles) in meshes.into_iter().chain([far]) {
        let mut mesh = Mesh::new(positions, triangles).unwrap();
        for _ in 0..400 {
            // Whole bundles, and what is left of a slice.
            let rays = &tile(&mesh, &mut random)[..96 - random.index(32)];
            rays_in_all += rays.len();
            hits_in_all += answered_alike(&mut mesh, rays);
        }
    }
    println!("{rays_in_all} rays in slices, {hits_in_all} hits, {} levels, 0 differences", Level::all().len());
    assert!(hits_in_all > rays_in_all / 2);
}

/// Rays that start, or end, next to one point of a surface, but for the spread that still counts as one place: what a
/// leaf seen from there may be off by decides which side of it they start on.
#[test]
fn slices_from_a_surface_are_answered_as_their_rays_are() {
    let mut random = Rng::new(5);
    let (mut rays_in_all, mut hits_in_all) = (0, 0);
    let far = moved(icosphere(3), 1e-3, DVec3::new(1e5, 2e5, -3e5));
    for (positions, triangles) in [icosphere(2), icosphere(4), grid_cube(5), soup(&mut Rng::new(3), 300, 0.3), far] {
        let mut mesh = Mesh::new(positions, triangles).unwrap();
        let size = mesh.bounds().size().max_element();
        for round in 0..300 {
            let [a, b, c] = mesh.vertices(random.index(mesh.triangles().len()) as u32);
            let place = [a, a + random.fraction() * (b - a), 0.3 * a + 0.3 * b + 0.4 * c][round % 3];
            let spread = size * [0.0, 1e-14, 1e-8, 6e-8, 1.2e-7, 2.4e-7, 3.5e-7][random.index(7)];
            let (way, step) = (size * random.unit(), 0.2 * random.fraction());
            let rays: Vec<(Ray, Interval)> = (0..64)
                .map(|_| {
                    let p = place + spread * random.in_cube(1.0);
                    let d = way + way.length() * step * random.in_cube(1.0);
                    match round % 5 {
                        0 => (Ray::new(p, d), Interval::FORWARD),
                        1 => (Ray::new(p, d), Interval::new(-1e-7, 1e-7)),
                        2 => (Ray::new(p - d, d), Interval::new(0.0, 1.0)),
                        3 => (Ray::new(p - d, d), Interval::new(0.9, 1.0 + 1e-7)),
                        _ => (Ray::new(p - d, 8.0 * d), Interval::new(-5.0, 0.125)),
                    }
                })
                .collect();
            rays_in_all += rays.len();
            hits_in_all += answered_alike(&mut mesh, &rays);
        }
    }
    println!("{rays_in_all} rays at one place of a surface, {hits_in_all} hits, 0 differences");
    assert!(hits_in_all > rays_in_all / 4);
}

/// Rays to a light inside of what they start from, so that they come from all sides and from near and far, in runs of
/// neighbours.
#[test]
fn slices_to_a_light_in_the_middle_are_answered_as_their_rays_are() {
    let mut random = Rng::new(31);
    let (mut rays_in_all, mut hits_in_all) = (0, 0);
    let meshes = [icosphere(3), torus(20), grid_cube(6), soup(&mut Rng::new(32), 500, 0.2)];
    let far = moved(icosphere(3), 1e-3, DVec3::new(1e5, 2e5, -3e5));
    for (positions, triangles) in meshes.into_iter().chain([far]) {
        let mut mesh = Mesh::new(positions, triangles).unwrap();
        let size = mesh.bounds().size().max_element();
        for round in 0..200 {
            let light = mesh.bounds().center() + 0.3 * size * random.in_cube(1.0);
            let run = [6, 11, 32, 64][round % 4];
            let mut way = DVec3::ZERO;
            let rays: Vec<(Ray, Interval)> = (0..96 + round % 32)
                .map(|i| {
                    if i % run == 0 {
                        way = size * random.unit() * [0.02, 0.4, 1.5][random.index(3)];
                    }
                    let from = light + way + 0.1 * way.length() * random.in_cube(1.0);
                    (Ray::new(from, light - from), Interval::new(1e-9, 1.0))
                })
                .collect();
            rays_in_all += rays.len();
            hits_in_all += answered_alike(&mut mesh, &rays);
        }
    }
    println!("{rays_in_all} rays to a light, {hits_in_all} hits, 0 differences");
    assert!(hits_in_all > rays_in_all / 10 && hits_in_all < rays_in_all * 9 / 10);
}

/// From a point inside of closed meshes to vertices, points of edges and of faces, and from behind these back to that
/// point.
#[test]
fn slices_do_not_leak() {
    let mut random = Rng::new(77);
    let mut asked = 0;
    for (positions, triangles) in [icosphere(3), icosphere(5), moved(icosphere(4), 1e-3, DVec3::new(1e5, 2e5, -3e5))] {
        let mesh = Mesh::new(positions, triangles).unwrap();
        let size = mesh.bounds().size().max_element();
        for _ in 0..1000 {
            let eye = mesh.bounds().center() + 0.2 * size * random.in_cube(1.0);
            let first = random.index(mesh.triangles().len());
            let (mut out, mut back) = (Vec::new(), Vec::new());
            for i in 0..170 {
                // Neighbours have neighbouring numbers, mostly.
                let [a, b, c] = mesh.vertices(((first + i / 16) % mesh.triangles().len()) as u32);
                let target = match i % 3 {
                    0 => a,
                    1 => a + random.fraction() * (b - a),
                    _ => (a + b + c) / 3.0,
                };
                out.push((Ray::new(eye, target - eye), Interval::FORWARD));
                let behind = eye + (1.5 + 0.5 * random.fraction()) * (target - eye);
                back.push((Ray::new(behind, eye - behind), Interval::new(0.0, 1.0)));
            }
            let (mut hits, mut met) = (vec![None; out.len()], vec![false; out.len()]);
            mesh.intersect_each(&out, &mut hits);
            assert!(hits.iter().all(Option::is_some), "from {eye} out");
            asked += out.len();
            for rays in [&out, &back] {
                mesh.occludes_each(rays, &mut met);
                assert!(met.iter().all(|&met| met), "from {eye}");
                asked += rays.len();
            }
        }
    }
    println!("{asked} rays, 0 leaks");
    assert!(asked > 1_000_000);
}

/// Rays that start on a face of a box, or leave it there, with limits next to zero and next to the hit.
#[test]
fn limits_next_to_zero_and_to_the_hit_lose_nothing() {
    let (mut asked, mut hits) = (0, 0);
    let tiny = f64::from_bits(1);
    for size in [1.0, 3.0, 1e-9, 1e12] {
        // A cube's faces, so that boxes have triangles in their faces, and the rays' origins lie in them too.
        let (positions, triangles) = grid_cube(4);
        let mut mesh = Mesh::new(positions.iter().map(|p| size * *p).collect(), triangles).unwrap();
        let bounds = mesh.bounds();
        let (low, high) = (bounds.min, bounds.max);
        for (axis, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            for side in [-1.0, 1.0] {
                for at in [0.0, 0.25, 0.3, 0.5, 1.0] {
                    for step in [0.0, tiny, 1e-300, 1e-30, 1e-9, 0.5, 1.0, 2.0] {
                        let mut origin = low + at * (high - low);
                        origin[axis] = if side > 0.0 { low[axis] } else { high[axis] };
                        let toward = side * unit * size;
                        // Before, on, and behind the face that it starts at.
                        for origin in [origin - step * toward, origin, origin + step * toward] {
                            let ray = Ray::new(origin, toward);
                            for min in [-0.0, 0.0, tiny, 1e-300] {
                                for max in
                                    [tiny, 1e-300, step, step.next_up(), 1.0, 4.0, 4.0f64.next_up(), f64::INFINITY]
                                {
                                    let within = Interval::new(min, max);
                                    let truth = brute_force(&mesh, &ray, within);
                                    for (level, simd) in Level::all() {
                                        mesh.set_level(simd);
                                        assert_eq!(mesh.intersect(&ray, within), truth, "{level}: {ray:?} {within:?}");
                                        assert_eq!(
                                            mesh.occludes(&ray, within),
                                            truth.is_some(),
                                            "{level}: {ray:?} {within:?}"
                                        );
                                    }
                                    asked += 1;
                                    hits += usize::from(truth.is_some());
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    println!("{hits} hits of {asked}");
    assert!(hits > asked / 4 && hits < asked);
}

/// Small triangles in a mesh 2⁴⁰ times as large, unit directions: in f32 the products of edges and direction vanish.
#[test]
fn products_that_vanish_lose_nothing() {
    let mut random = Rng::new(41);
    let wide = 0.75 * 2f64.powi(40);
    let (mut asked, mut hits) = (0, 0);
    for _ in 0..1000 {
        let size = 2f64.powf(-12.0 * random.fraction());
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let mut push = |corners: [DVec3; 3]| {
            let at = positions.len() as u32;
            positions.extend(corners);
            triangles.push([at, at + 1, at + 2]);
        };
        for i in 0..40 {
            let (a, b, z) = (1.0 + random.fraction(), 1.0 + random.fraction(), f64::from(i) * wide * 1e-3);
            push([[0.0, 0.0, z], [a * size, 0.0, z], [0.0, b * size, z]].map(DVec3::from));
        }
        // Slanted walls that the ray meets a little behind the first of them, in boxes that begin far earlier.
        for i in 0..40 {
            let gap = wide * (1e-5 + 1e-6 * f64::from(i));
            push([[-wide, -wide, gap - wide], [-wide, wide, gap - wide], [wide, 0.0, wide]].map(DVec3::from));
        }
        let mut mesh = Mesh::new(positions, triangles).unwrap();
        let ray = Ray::new([0.2 * size, 0.2 * size, -wide], [0.0, 0.0, 1.0]);
        for max in [f64::INFINITY, wide + 7e8, wide + 1e6, wide + 1e3, wide, 0.999 * wide] {
            let within = Interval::new(0.0, max);
            let nearest =
                (0..80).filter_map(|part| Some((triangle::intersect(&ray, &mesh.vertices(part), within)?, part)));
            let truth = nearest.min_by(|a, b| a.0.lambda.total_cmp(&b.0.lambda)).map(|(hit, part)| (hit.lambda, part));
            for (level, simd) in Level::all() {
                mesh.set_level(simd);
                let found = mesh.intersect(&ray, within).map(|hit| (hit.lambda, hit.part));
                assert_eq!(found, truth, "{level}: triangles of {size}, to {max}");
                assert_eq!(mesh.occludes(&ray, within), truth.is_some(), "{level}: triangles of {size}, to {max}");
                let mut each = [None; 64];
                mesh.intersect_each(&[(ray, within); 64], &mut each);
                assert!(
                    each.iter().all(|hit| hit.map(|hit| (hit.lambda, hit.part)) == truth),
                    "{level}: {size}, to {max}"
                );
                asked += 1;
            }
            hits += usize::from(truth.is_some());
        }
    }
    println!("{asked} rays, {hits} of 6000 settings hit, 0 lost");
    assert_eq!(hits, 4000);
}

#[test]
fn degenerate_meshes_answer_too() {
    let mut random = Rng::new(3);
    let ray = Ray::new([0.1, 0.2, 5.0], [0.0, 0.0, -1.0]);
    // Empty.
    let empty = Mesh::new(vec![], vec![]).unwrap();
    assert_eq!(empty.intersect(&ray, Interval::LINE), None);
    assert!(!empty.occludes(&ray, Interval::LINE) && empty.bounds().is_empty());
    // All kinds of flatness, among sound triangles.
    let mut parts = soup(&mut random, 50, 0.5);
    let p = parts.0.clone();
    for i in 0..50u32 {
        let (a, b) = (p[random.index(150)], p[random.index(150)]);
        let at = parts.0.len() as u32;
        parts.0.extend([a, b, 0.5 * (a + b), a]);
        parts.1.extend([[at, at + 1, at + 2], [at, at, at + 1], [at, at, at], [at, at + 1, at + 3], [i, i, at]]);
    }
    compare("flat", parts, 3000, &mut random);
    // Needles.
    let mut parts = soup(&mut random, 300, 0.5);
    for t in parts.0.chunks_exact_mut(3) {
        t[2] = t[0] + 1e-9 * (t[2] - t[0]);
    }
    let (rays, hits) = compare("needles", parts, 3000, &mut random);
    println!("needles: {hits} of {rays} rays hit");
    assert!(hits > 500);
    // One flat box of aspect 1e9 in each axis.
    for stretch in [DVec3::new(1e9, 1.0, 1.0), DVec3::new(1.0, 1.0, 1e-9), DVec3::new(1.0, 0.0, 1.0)] {
        let mut parts = soup(&mut random, 200, 0.5);
        parts.0.iter_mut().for_each(|p| *p *= stretch);
        compare("stretched", parts, 1000, &mut random);
    }
    // Coincident triangles, in any order: the lowest index.
    let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    let stack = Mesh::new(corners, [[0, 1, 2], [2, 0, 1], [1, 2, 0], [0, 2, 1]].repeat(5000)).unwrap();
    let hit = stack.intersect(&Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]), Interval::FORWARD).unwrap();
    assert_eq!((hit.part, hit.lambda), (0, 1.0));
}

#[test]
fn identical_centroids_and_deep_trees_end() {
    // 1e5 triangles around one centre, and a series in which each is a tenth of the one before.
    let mut random = Rng::new(4);
    let mut parts = (vec![], vec![]);
    for i in 0..100_000u32 {
        let (u, v) = (random.in_cube(1.0), random.in_cube(1.0));
        parts.0.extend([u, v, -(u + v)]);
        parts.1.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let mesh = Mesh::new(parts.0, parts.1).unwrap();
    let mut hits = 0;
    for _ in 0..20 {
        let ray = Ray::new(3.0 * random.unit(), random.in_cube(1.0));
        let expected = brute_force(&mesh, &ray, Interval::LINE);
        hits += usize::from(expected.is_some());
        assert_eq!(mesh.intersect(&ray, Interval::LINE), expected);
    }
    let mut parts = (vec![], vec![]);
    for i in 0..1000u32 {
        let s = 2f64.powi(-(i as i32));
        parts.0.extend([DVec3::new(s, 0.0, 0.0), DVec3::new(0.0, s, 0.0), DVec3::new(0.0, 0.0, s)]);
        parts.1.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let mesh = Mesh::new(parts.0, parts.1).unwrap();
    for i in 0..200 {
        let scale = 2f64.powi(-(random.index(1000) as i32));
        let origin = scale * DVec3::new(random.fraction(), random.fraction(), random.fraction());
        let ray = Ray::new(origin, DVec3::splat(if i % 2 == 0 { 1.0 } else { -1.0 }));
        let expected = brute_force(&mesh, &ray, Interval::FORWARD);
        hits += usize::from(expected.is_some());
        assert_eq!(mesh.intersect(&ray, Interval::FORWARD), expected);
    }
    println!("{hits} hits");
    assert!(hits > 100);
}

#[test]
fn boxes_of_images_hold_the_vertices() {
    let mut random = Rng::new(31);
    let (mut tightest, mut loosest) = (f64::INFINITY, 0.0f64);
    for offset in [0.0, 1.0, 1e6] {
        let (positions, triangles) = moved(torus(20), 0.7, offset * random.in_cube(1.0));
        let mesh = Mesh::new(positions, triangles).unwrap();
        for _ in 0..200 {
            let mut column = || random.in_cube(1.0);
            let map = glam::DAffine3::from_cols(column(), column(), column(), column());
            let (whole, exact) = (mesh.bounds_under(&map), truehit::Aabb::around_images(mesh.positions(), &map));
            for &p in mesh.positions() {
                let p = map.transform_point3(p);
                assert!(whole.min.cmple(p).all() && whole.max.cmpge(p).all());
            }
            let ratio = (whole.size() / exact.size()).max_element();
            (tightest, loosest) = (tightest.min(ratio), loosest.max(ratio));
        }
    }
    println!("boxes of a torus' images are {tightest:.2} to {loosest:.2} times the least");
    assert!(loosest < 1.8);
}

/// How many of `rays` rays from inside a closed mesh at its vertices, edges and faces leave it unseen: all must hit.
fn leaks(mesh: &Mesh, inside: DVec3, rays: usize, random: &mut Rng) -> usize {
    let mut leaks = 0;
    for i in 0..rays {
        let [a, b, c] = mesh.vertices(random.index(mesh.triangles().len()) as u32);
        let target = match i % 6 {
            0 => a,
            1 => 0.5 * (a + b),
            2 => b + random.fraction() * (c - b),
            3 => 0.5 * (a + 0.5 * (b + c)),
            4 => 0.5 * (c + a),
            _ => inside + random.unit(),
        };
        let mut direction = target - inside;
        if i % 4 == 3 {
            direction = direction.normalize();
        }
        let ray = Ray::new(inside, direction);
        let closest = mesh.intersect(&ray, Interval::FORWARD);
        leaks += usize::from(closest.is_none() || !mesh.occludes(&ray, Interval::FORWARD));
    }
    leaks
}

/// `rays` rays and a few more, evenly over closed meshes at offsets to 1e6 times their size.
fn watertight(rays: usize) {
    const CHUNK: usize = 10_000;
    let spheres = [
        (icosphere(5), DVec3::ZERO),
        (torus(96), DVec3::X),
        (moved(grid_cube(32), 1.0 / 16.0, DVec3::splat(-1.0)), DVec3::ZERO),
    ];
    let mut random = Rng::new(5);
    let mut settings = Vec::new();
    for (parts, inside) in &spheres {
        for distance in [0.0, 1.0, 64.0, 1e3, 1e4, 1e6] {
            let offset = distance * DVec3::new(1.0, -0.7, 0.3);
            let (positions, triangles) = moved(parts.clone(), 1.0, offset);
            settings.push((Mesh::new(positions, triangles).unwrap(), *inside + offset + 0.01 * random.in_cube(1.0)));
        }
    }
    // All settings side by side, so that what a run has done so far is a fair part of it.
    let jobs = rays.div_ceil(CHUNK * settings.len()) * settings.len();
    let (mut finished, mut leaked) = (0, 0);
    on_all_cores(
        jobs,
        |i| {
            let (mesh, inside) = &settings[i % settings.len()];
            leaks(mesh, *inside, CHUNK, &mut Rng::new((5 << 40) + i as u64))
        },
        |_, found| {
            finished += 1;
            leaked += found;
            if finished % 1000 == 0 {
                eprintln!("{} of {} aimed rays, {leaked} leaks so far", finished * CHUNK, jobs * CHUNK);
            }
        },
    );
    println!("{} aimed rays, {leaked} leaks", finished * CHUNK);
    assert_eq!((finished, leaked), (jobs, 0));
}

#[test]
fn closed_meshes_are_watertight() {
    watertight(1_080_000);
}

/// `cargo test --release --test mesh billion -- --ignored --nocapture`; other numbers of rays by the environment
/// variable `TRUEHIT_CASES`.
#[test]
#[ignore = "a billion rays take half an hour"]
fn a_billion_rays_do_not_leak() {
    watertight(support::cases_wanted(1_000_000_000));
}

/// An axis-parallel grid of rays down on an integer grid mesh: every ray meets a vertex or an edge.
#[test]
fn grids_of_rays_meet_grids_of_triangles() {
    let n = 24;
    let (positions, triangles) = grid_cube(n);
    let mesh = Mesh::new(positions, triangles).unwrap();
    let mut rays = 0;
    for i in 0..=2 * n {
        for j in 0..=2 * n {
            for axis in 0..3 {
                let at = DVec3::from([f64::from(i) / 2.0, f64::from(j) / 2.0, -3.0]);
                let turned = |v: DVec3| DVec3::from([v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]]);
                let ray = Ray::new(turned(at), turned(DVec3::Z));
                let hit = mesh.intersect(&ray, Interval::FORWARD);
                assert_eq!(hit.map(|h| (h.lambda, h.error < 1e-14)), Some((3.0, true)), "{ray:?}");
                assert!(mesh.occludes(&ray, Interval::FORWARD));
                // From inside: the far face only.
                let hit = mesh.intersect(&ray, Interval::new(3.0, f64::INFINITY)).unwrap();
                let on_a_wall = [i, j].iter().any(|&k| k == 0 || k == 2 * n);
                assert!(on_a_wall || hit.lambda == 3.0 + f64::from(n), "{ray:?} {hit:?}");
                rays += 1;
            }
        }
    }
    println!("{rays} rays through vertices, edges and faces: all hit");
}

/// Two triangles below an edge whose middle vertex they share, one above: closed if the vertex is on the edge exactly.
fn t_junction(middle: DVec3, a: DVec3, b: DVec3) -> Mesh {
    let up = DVec3::new(0.3, 0.2, 1.0);
    Mesh::new(vec![a, b, middle, a + b + up, a - b - up], vec![[0, 1, 3], [0, 4, 2], [4, 1, 2]]).unwrap()
}

#[test]
fn t_junctions_crack_only_where_they_really_do() {
    let mut random = Rng::new(6);
    let (mut met, mut cracked, mut through) = (0, 0, 0);
    for _ in 0..2000 {
        // 20-bit coordinates: the middle is a float. Then a third of the way, which is not.
        let coarse = |v: DVec3| (v * 1_048_576.0).round() / 1_048_576.0;
        let (a, b) = (coarse(random.in_cube(1.0)), coarse(random.in_cube(1.0)));
        let whole = t_junction(0.5 * (a + b), a, b);
        let third = a + (b - a) / 3.0;
        let torn = t_junction(third, a, b);
        for i in 0..32 {
            let target = a + f64::from(i + 1) / 32.0 * (b - a);
            let d = coarse(random.in_cube(1.0)) * 8.0;
            // Exactly at the edge: every term is a short dyadic.
            let ray = Ray::new(target - d, d);
            met += usize::from(whole.intersect(&ray, Interval::FORWARD).is_some());
            through += 1;
            let hit = torn.intersect(&ray, Interval::FORWARD);
            assert_eq!(hit, brute_force(&torn, &ray, Interval::FORWARD));
            cracked += usize::from(hit.is_none());
        }
    }
    println!("{met} of {through} rays at sound T-junctions met; {cracked} passed torn ones");
    // The upper triangle owns the whole edge: rays exactly at it never miss, whatever lies below.
    assert_eq!((met, cracked), (through, 0));
}

/// Where the middle was rounded away from the upper triangle, the input has a gap less than an ulp wide: rays through
/// it miss, as they should, and no others do.
#[test]
fn a_torn_t_junctions_gap_is_seen() {
    let mut random = Rng::new(8);
    let side = |p: DVec3, a: DVec3, b: DVec3, d: DVec3| (b - a).cross(p - a).dot(d);
    let (mut rays, mut through) = ([0; 2], [0; 2]);
    for _ in 0..400 {
        let coarse = |v: DVec3| (v * 1_048_576.0).round() / 1_048_576.0;
        let (a, b) = (coarse(random.in_cube(1.0)), coarse(random.in_cube(1.0)));
        let middles = [0.5 * (a + b), a + (b - a) / 3.0];
        for (torn, middle) in middles.into_iter().enumerate() {
            let mesh = t_junction(middle, a, b);
            for _ in 0..50 {
                // From so near that the directions tell points inside the gap apart; not along the surface.
                let d = 1e-3 * random.unit();
                if side(a + b + DVec3::new(0.3, 0.2, 1.0), a, b, d) * side(a - b - DVec3::new(0.3, 0.2, 1.0), a, b, d)
                    >= 0.0
                {
                    continue;
                }
                let ray = Ray::new(middle - d, d);
                let hit = mesh.intersect(&ray, Interval::FORWARD);
                assert_eq!(hit, brute_force(&mesh, &ray, Interval::FORWARD));
                rays[torn] += 1;
                through[torn] += usize::from(hit.is_none());
            }
        }
    }
    println!("missed: {} of {} at sound junctions, {} of {} at torn ones", through[0], rays[0], through[1], rays[1]);
    assert!(rays[0] > 5000 && rays[1] > 5000);
    assert!(through[0] == 0 && through[1] > 50);
}

#[test]
fn a_quads_diagonal_holds() {
    let corners =
        [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]].map(|p| 4.0 * DVec3::from(p));
    let quad = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let d = [0.304_584_47, 0.304_584_47, -0.902_472_5];
    assert!(quad.intersect(&Ray::new([0.0, 0.0, 10.0], d), Interval::FORWARD).is_some());
}

#[test]
fn a_sphere_far_from_the_origin_is_met_at_its_vertices() {
    let offset = DVec3::new(148_376.0, 1234.0, -223_423.0);
    let (positions, triangles) = moved(icosphere(4), 1.0, offset);
    let mesh = Mesh::new(positions.clone(), triangles).unwrap();
    let eye = offset + DVec3::new(0.1, -3.0, 0.2);
    for &p in &positions {
        for from in [offset, eye] {
            assert!(mesh.intersect(&Ray::new(from, p - from), Interval::FORWARD).is_some(), "{p}");
        }
    }
    println!("{} vertices, twice: all met", positions.len());
}

/// A flat, axis-aligned triangle has a flat box: met edge-on at its edge it is missed (the ray lies in its plane), met
/// at any slope it is hit, and so on its border.
#[test]
fn flat_boxes_hold_what_is_in_them() {
    let mesh = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).unwrap();
    let hit = |o: [f64; 3], d: [f64; 3]| mesh.intersect(&Ray::new(o, d), Interval::FORWARD).is_some();
    assert!(!hit([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]));
    for k in 1..60 {
        let slope = 2f64.powi(-k);
        assert!(hit([-1.0, 0.25, -1.25 * slope], [1.0, 0.0, slope]), "{k}");
        assert!(hit([-1.0, 0.0, -slope], [1.0, 0.0, slope]), "{k}: corner");
    }
    assert!(hit([0.5, 0.5, 1.0], [0.0, 0.0, -1.0]) && hit([0.0, 1.0, 1.0], [-0.0, -0.0, -1.0]));
}

#[test]
fn shading_normals_never_cancel_to_nan() {
    let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    let mesh = Mesh::new(corners, vec![[0, 1, 2]]).unwrap();
    let ray = Ray::new([0.25, 0.5, 1.0], [0.0, 0.0, -1.0]);
    let hit = mesh.intersect(&ray, Interval::FORWARD).unwrap();
    let face = mesh.normal(&ray, &hit);
    assert_eq!(face, DVec3::Z);
    // Weights ¼, ¼, ½: these cancel; tiny and huge ones do not; zero ones are none.
    for (normals, expected) in [
        ([DVec3::X, DVec3::X, -DVec3::X], face),
        ([DVec3::ZERO; 3], face),
        ([1e-300 * DVec3::Y; 3], DVec3::Y),
        ([1e300 * DVec3::Y; 3], DVec3::Y),
        ([5e-324 * DVec3::Y, DVec3::ZERO, 5e-324 * DVec3::Y], DVec3::Y),
    ] {
        let smooth = mesh.clone().with_normals(normals.to_vec()).unwrap();
        assert_eq!(smooth.shading_normal(&ray, &hit), expected, "{normals:?}");
    }
    let textured = mesh.with_uvs(vec![glam::DVec2::ZERO, glam::DVec2::X, glam::DVec2::new(0.5, 2.0)]).unwrap();
    assert_eq!(textured.texture_coordinates(&ray, &hit), glam::DVec2::new(0.5, 1.0));
}

#[test]
fn bad_meshes_are_refused_by_name() {
    use truehit::InvalidShape;
    let p = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    let e = Mesh::new(p.clone(), vec![[0, 1, 2], [0, 1, 3]]).unwrap_err();
    assert_eq!(e, InvalidShape::IndexOutOfRange { field: "triangles", at: 1, index: 3, count: 3 });
    let e = Mesh::new(vec![DVec3::NAN], vec![]).unwrap_err();
    assert_eq!(e, InvalidShape::NotFinite { field: "positions" });
    let mesh = Mesh::new(p.clone(), vec![[0, 1, 2]]).unwrap();
    let e = mesh.clone().with_normals(vec![DVec3::X]).unwrap_err();
    assert_eq!(e, InvalidShape::LengthMismatch { field: "normals", needed: 3, given: 1 });
    let e = mesh.clone().with_normals(vec![DVec3::X, DVec3::INFINITY, DVec3::X]).unwrap_err();
    assert_eq!(e, InvalidShape::NotFinite { field: "normals" });
    let e = mesh.with_uvs(vec![]).unwrap_err();
    assert_eq!(e, InvalidShape::LengthMismatch { field: "uvs", needed: 3, given: 0 });
}

/// The same tree at any number of threads: the same memory and the same answers to the bit.
#[test]
#[cfg(feature = "rayon")]
fn threads_do_not_change_the_tree() {
    let (mut positions, triangles) = soup(&mut Rng::new(8), 20_000, 0.05);
    // Coordinates of f64, then of f32.
    for _ in 0..2 {
        let build = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| format!("{:?}", Mesh::new(positions.clone(), triangles.clone()).unwrap()))
        };
        let one = build(1);
        assert!(one.len() > 1_000_000);
        assert!([2, 3, 8].into_iter().all(|threads| build(threads) == one));
        positions = positions.iter().map(|v| v.as_vec3().as_dvec3()).collect();
    }
}
