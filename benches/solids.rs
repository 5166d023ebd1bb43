//! Sphere, cylinder, cone beside the textbook's kernels, on the same rays: ordinary ones, of which about half hit, and
//! those that cost more. `cargo bench --bench solids`

#[path = "../tests/support/rng.rs"]
mod rng;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use rng::Rng;
use std::hint::black_box;
use truehit::glam::DVec3;
use truehit::kernel::{frustum, sphere, textbook};
use truehit::{Hit, Interval, Ray, Shape, Sphere, Surface};

const RAYS: usize = 4096;
const FORWARD: Interval = Interval::FORWARD;

/// Times `f`; its hit rate must lie in `hits`.
fn each<T>(
    group: &mut BenchmarkGroup<WallTime>,
    name: &str,
    cases: &[T],
    hits: std::ops::Range<f64>,
    f: impl Fn(&T) -> Option<Hit>,
) {
    let rate = cases.iter().filter_map(&f).count() as f64 / cases.len() as f64;
    assert!(hits.contains(&rate), "{name}: {rate} of the rays hit");
    group.throughput(Throughput::Elements(cases.len() as u64));
    let sum = |cases: &[T]| cases.iter().filter_map(&f).map(|hit| hit.lambda + hit.error).sum::<f64>();
    group.bench_function(name, |b| b.iter(|| sum(black_box(cases))));
}

struct Ball {
    ray: Ray,
    center: DVec3,
    radius: f64,
}

fn balls(seed: u64, ray: impl Fn(&mut Rng, DVec3, f64) -> Ray) -> Vec<Ball> {
    let mut r = Rng::new(seed);
    let ball = |_| {
        let (center, radius) = (5.0 * r.in_cube(1.0), r.log(0.1, 10.0));
        Ball { ray: ray(&mut r, center, radius), center, radius }
    };
    (0..RAYS).map(ball).collect()
}

fn spheres(criterion: &mut Criterion) {
    let aimed = |distance: f64| {
        balls(1, move |r, center, radius| {
            let u = r.unit();
            let impact = radius * (2.0 * r.uniform(0.0, 1.0)).sqrt();
            Ray::new(center + r.across(u) * impact - u * distance * radius, u * r.log(0.1, 10.0))
        })
    };
    let grazing = balls(2, |r, center, radius| {
        let (u, g) = (r.unit(), r.log(1e-16, 1e-4));
        let impact = radius * if r.uniform(0.0, 1.0) < 0.5 { 1.0 + g } else { 1.0 - g };
        Ray::new(center + r.across(u) * impact - u * 3.0 * radius, u)
    });
    let left = balls(3, |r, center, radius| Ray::new(center + r.unit() * radius, r.unit()));
    let mut on_it = balls(6, |r, _, _| Ray::new((8.0 * r.in_cube(1.0)).round(), r.unit()));
    for (i, b) in on_it.iter_mut().enumerate() {
        let (p, radius) = [
            (DVec3::new(3.0, 4.0, 0.0), 5.0),
            (DVec3::new(1.0, -2.0, 2.0), 3.0),
            (DVec3::new(-2.0, 3.0, 6.0), 7.0),
            (DVec3::new(0.0, 0.0, 1.0), 1.0),
        ][i % 4];
        (b.center, b.radius) = (b.ray.origin, radius);
        b.ray = Ray::new(b.center + p, b.ray.direction);
    }
    let leaving = |sign: f64| {
        balls(7, move |r, center, radius| {
            let u = r.unit();
            let aimed = Ray::new(center + r.across(u) * radius * r.fraction().sqrt() - u * 5.0 * radius, u);
            let sphere = Sphere::new(center, radius).expect("a sphere");
            let hit = sphere.intersect(&aimed, FORWARD).expect("an aimed ray");
            let (surface, d) = (Surface::new(&sphere, &aimed, &hit), r.unit());
            surface.spawn(if sign * d.dot(surface.normal()) < 0.0 { -d } else { d })
        })
    };
    let mut tangents = balls(4, |r, _, _| Ray::new((8.0 * r.in_cube(1.0)).round(), DVec3::X));
    for (i, b) in tangents.iter_mut().enumerate() {
        let (o, d, radius) = [
            (DVec3::new(3.0, 4.0, -7.0), DVec3::Z, 5.0),
            (DVec3::new(5.0, 12.0, -1e3), 3.0 * DVec3::Z, 13.0),
            (DVec3::new(-3.0, 4.0, 2.0), DVec3::new(2.0, -1.0, 0.0), 3.0),
        ][i % 3];
        b.center = b.ray.origin;
        b.ray = Ray::new(b.center + o, d);
        b.radius = radius;
    }
    let half = 0.4..0.6;
    for (name, cases, hits) in [
        ("ordinary", aimed(5.0), half.clone()),
        ("from 1e8 radii", aimed(1e8), half.clone()),
        ("grazed", grazing, half),
        ("origin rounded onto it", left, 0.6..0.9),
        ("origin exactly on it", on_it, 0.4..0.6),
        ("spawned outward", leaving(1.0), 0.0..0.01),
        ("spawned inward", leaving(-1.0), 0.99..1.01),
        ("exact tangents", tangents, 0.6..1.1),
    ] {
        let mut group = criterion.benchmark_group(format!("sphere, {name}"));
        // What the textbook makes of rays that graze or leave differs.
        each(&mut group, "textbook", &cases, 0.0..1.1, |b| {
            textbook::sphere::<f64>(&b.ray, b.center, b.radius, FORWARD)
        });
        each(&mut group, "Ray Tracing Gems 7", &cases, 0.0..1.1, |b| {
            textbook::sphere_gems::<f64>(&b.ray, b.center, b.radius, FORWARD)
        });
        each(&mut group, "shipped", &cases, hits, |b| sphere::intersect(&b.ray, b.center, b.radius, FORWARD));
    }
}

struct Trunk {
    ray: Ray,
    base: DVec3,
    top: DVec3,
    radii: [f64; 2],
}

fn frusta(criterion: &mut Criterion) {
    let mut r = Rng::new(5);
    for name in ["cylinder", "cone", "truncated cone"] {
        let trunk = |_| {
            let (base, axis, radius) = (5.0 * r.in_cube(1.0), r.unit() * r.log(0.1, 10.0), r.log(0.1, 10.0));
            let radii = match name {
                "cylinder" => [radius; 2],
                "cone" => [radius, 0.0],
                _ => [radius, r.log(0.1, 10.0)],
            };
            let size = radii[0].max(radii[1]).max(axis.length());
            let target = base + axis * r.uniform(0.0, 1.0) + r.unit() * size * r.uniform(0.0, 1.2);
            let u = r.unit();
            let origin = target - u * r.uniform(2.0, 10.0) * size;
            Trunk { ray: Ray::new(origin, u * r.log(0.1, 10.0)), base, top: base + axis, radii }
        };
        let cases: Vec<Trunk> = (0..RAYS).map(trunk).collect();
        let mut group = criterion.benchmark_group(format!("{name}, ordinary"));
        each(&mut group, "textbook", &cases, 0.4..0.7, |t| {
            let kernel = if name == "cylinder" { textbook::cylinder::<f64> } else { textbook::cone::<f64> };
            kernel(&t.ray, t.base, t.top, t.radii[0], t.radii[1], FORWARD)
        });
        each(&mut group, "shipped", &cases, 0.4..0.7, |t| {
            frustum::intersect(&t.ray, t.base, t.top, t.radii[0], t.radii[1], FORWARD)
        });
    }
}

criterion_group!(benches, spheres, frusta);
criterion_main!(benches);
