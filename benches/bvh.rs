//! Trees: building, and walking with rays of six kinds, on every instruction level. Hit rates are asserted, so that no
//! figure is of rays that miss.

#[path = "../tests/meshes/mod.rs"]
mod meshes;
#[path = "../tests/support/rng.rs"]
mod rng;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use meshes::{icosphere, moved, torus};
use rng::Rng;
use std::hint::black_box;
use std::ops::ControlFlow;
use truehit::bvh::Level;
use truehit::{Interval, Mesh, Ray, Shape, glam};

const RAYS: usize = 4096;

struct RaySet {
    name: &'static str,
    any: bool,
    rays: Vec<(Ray, Interval)>,
    /// The share that must hit.
    least: f64,
}

/// Camera rays at a torus in rows, rays that leave its surface, rays anywhere, and shadow rays to a light.
fn rays(mesh: &Mesh) -> Vec<RaySet> {
    let mut random = Rng::new(1);
    let eye = DVec3::new(0.5, -2.6, 1.7);
    let forward = (-eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let camera: Vec<_> = (0..RAYS)
        .map(|i| {
            let (x, y) = ((i % 64) as f64 / 64.0 - 0.5, (i / 64) as f64 / 64.0 - 0.5);
            (Ray::new(eye, forward + 0.7 * (x * right + y * up)), Interval::FORWARD)
        })
        .collect();
    let points: Vec<(DVec3, DVec3)> = camera
        .iter()
        .filter_map(|(ray, within)| {
            let hit = mesh.intersect(ray, *within)?;
            let normal = mesh.normal(ray, &hit);
            Some((mesh.point(ray, &hit).position + 1e-6 * normal, normal))
        })
        .collect();
    let at = |i: usize| points[i % points.len()];
    let bounce: Vec<_> = (0..RAYS).map(|i| (Ray::new(at(i).0, at(i).1 + random.unit()), Interval::FORWARD)).collect();
    let anywhere: Vec<_> =
        (0..RAYS).map(|_| (Ray::new(1.2 * random.in_cube(1.0), random.unit()), Interval::FORWARD)).collect();
    let light = DVec3::new(3.0, 1.0, 2.0);
    let shadow = (0..RAYS).map(|i| (Ray::new(at(i).0, light - at(i).0), Interval::new(0.0, 1.0))).collect();
    let set = |name, any, rays, least| RaySet { name, any, rays, least };
    vec![
        set("primary", false, camera, 0.9),
        set("bounce", false, bounce.clone(), 0.9),
        set("random", false, anywhere.clone(), 0.9),
        set("shadow", true, shadow, 0.05),
        set("bounce any", true, bounce, 0.9),
        set("random any", true, anywhere, 0.9),
    ]
}

fn traversal(c: &mut Criterion) {
    // In a spherical room, so that rays that leave the torus meet something too.
    let (mut positions, mut triangles) = torus(220);
    let room = moved(icosphere(4), 4.0, DVec3::ZERO);
    let base = positions.len() as u32;
    positions.extend(room.0);
    // Facing inward.
    triangles.extend(room.1.into_iter().map(|[a, b, c]| [a + base, c + base, b + base]));
    let mut mesh = Mesh::new(positions, triangles).expect("a torus in a room");
    for set in rays(&mesh) {
        let hits = set.rays.iter().filter(|(ray, within)| mesh.occludes(ray, *within)).count();
        let share = hits as f64 / set.rays.len() as f64;
        assert!(share >= set.least, "{}: {share}", set.name);
        let mut group = c.benchmark_group(format!("traversal/{} ({:.0} % hit)", set.name, 100.0 * share));
        group.throughput(Throughput::Elements(set.rays.len() as u64));
        for (name, level) in Level::all() {
            mesh.set_level(level);
            group.bench_function(name, |b| {
                b.iter(|| {
                    let met = |(ray, within): &(Ray, Interval)| {
                        if set.any {
                            mesh.occludes(black_box(ray), *within)
                        } else {
                            mesh.intersect(black_box(ray), *within).is_some()
                        }
                    };
                    set.rays.iter().filter(|r| met(r)).count()
                });
            });
        }
        mesh.set_level(Level::detect());
        let (mut nearest, mut occluded) = (vec![None; set.rays.len()], vec![false; set.rays.len()]);
        group.bench_function("in one call", |b| {
            b.iter(|| {
                if set.any {
                    mesh.occludes_each(black_box(&set.rays), &mut occluded);
                } else {
                    mesh.intersect_each(black_box(&set.rays), &mut nearest);
                }
            });
        });
        group.finish();
    }
}

/// One node and one leaf: a mesh of eight triangles, met by every ray.
fn leaf(c: &mut Criterion) {
    let (positions, triangles) = icosphere(0);
    let mesh = Mesh::new(positions, triangles[..8].to_vec()).expect("eight triangles");
    let mut random = Rng::new(2);
    let rays: Vec<_> = std::iter::repeat_with(|| Ray::new(0.05 * random.in_cube(1.0), random.unit()))
        .filter(|ray| mesh.occludes(ray, Interval::FORWARD))
        .take(RAYS)
        .collect();
    let mut group = c.benchmark_group("leaf");
    group.throughput(Throughput::Elements(RAYS as u64));
    group.bench_function("closest", |b| {
        b.iter(|| rays.iter().filter(|r| mesh.intersect(black_box(r), Interval::FORWARD).is_some()).count());
    });
    group.bench_function("any", |b| {
        b.iter(|| rays.iter().filter(|r| mesh.occludes(black_box(r), Interval::FORWARD)).count());
    });
    group.finish();
}

/// On one thread, on all, and with an observer that only looks.
fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    group.sample_size(10);
    for n in [22, 70, 220] {
        let (positions, triangles) = torus(n);
        let n = triangles.len();
        group.throughput(Throughput::Elements(n as u64));
        let mesh = || Mesh::new(positions.clone(), triangles.clone());
        group.bench_function(format!("{n} triangles"), |b| b.iter(mesh));
        group.bench_function(format!("{n} triangles, observed"), |b| {
            b.iter(|| Mesh::new_observed(positions.clone(), triangles.clone(), &mut |_| ControlFlow::Continue(())));
        });
        #[cfg(feature = "rayon")]
        group.bench_function(format!("{n} triangles, one thread"), |b| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
            pool.install(|| b.iter(mesh));
        });
    }
    group.finish();
}

criterion_group!(benches, traversal, leaf, build);
criterion_main!(benches);
