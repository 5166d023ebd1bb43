//! Kernels beside the textbook's: shipped (exact decision, λ to the last bit or nearly, proved bound) and textbook f64,
//! on the same rays, half of which hit. `cargo bench --bench kernels`

#[path = "../tests/support/rng.rs"]
mod rng;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use rng::Rng;
use std::hint::black_box;
use truehit::glam::{DAffine3, DVec3};
use truehit::kernel::{plane, polygon, slab, textbook, triangle};
use truehit::{Affine, Hit, Interval, Ray, Shape, Triangle};

const RAYS: usize = 4096;
const FORWARD: Interval = Interval::FORWARD;

type Case = (Ray, [DVec3; 3]);

/// Rays from `distance` at points a + u·e₁ + v·e₂, u and v below `spread`: all hit for 0.5, half of them for 1.
fn triangles(distance: f64, spread: f64) -> Vec<Case> {
    let mut r = Rng::new(1);
    let case = |_| {
        let [a, b, c] = [r.in_cube(1.0), r.in_cube(1.0), r.in_cube(1.0)];
        let origin = distance * r.in_cube(1.0);
        let target = a + spread * r.fraction() * (b - a) + spread * r.fraction() * (c - a);
        (Ray::new(origin, target - origin), [a, b, c])
    };
    (0..RAYS).map(case).collect()
}

fn each<T>(group: &mut BenchmarkGroup<WallTime>, name: &str, cases: &[T], f: impl Fn(&T) -> Option<Hit>) {
    // Rays that all miss would measure an early way out.
    let hits = cases.iter().filter(|c| f(c).is_some()).count();
    assert!(5 * hits > cases.len(), "{name}: {hits} of {} rays hit", cases.len());
    group.throughput(Throughput::Elements(cases.len() as u64));
    let sum = |cases: &[T]| cases.iter().filter_map(&f).map(|hit| hit.lambda).sum::<f64>();
    group.bench_function(name, |b| b.iter(|| sum(black_box(cases))));
}

fn flat_kernels(criterion: &mut Criterion) {
    for (name, distance, spread) in [("ordinary", 5.0, 1.0), ("all hit", 5.0, 0.5), ("from 1e6", 1e6, 1.0)] {
        let cases = triangles(distance, spread);
        let mut group = criterion.benchmark_group(format!("triangle, {name}"));
        each(&mut group, "Algorithm 1", &cases, |(ray, t)| textbook::algorithm_1::<f64>(ray, t, FORWARD));
        each(&mut group, "Algorithm 2", &cases, |(ray, t)| textbook::algorithm_2::<f64>(ray, t, FORWARD));
        each(&mut group, "Möller–Trumbore", &cases, |(ray, t)| textbook::moller_trumbore::<f64>(ray, t, FORWARD));
        each(&mut group, "Woop", &cases, |(ray, t)| textbook::woop::<f64>(ray, t, FORWARD));
        each(&mut group, "shipped", &cases, |(ray, t)| triangle::intersect(ray, t, FORWARD));
    }
    let mut r = Rng::new(2);
    let grid = |v: DVec3| (64.0 * v).round() / 8.0;
    let on_edge = |_| {
        let [a, b, c] = [grid(r.in_cube(1.0)), grid(r.in_cube(1.0)), grid(r.in_cube(1.0))];
        let origin = grid(5.0 * r.in_cube(1.0));
        (Ray::new(origin, a + 0.25 * (b - a) - origin), [a, b, c])
    };
    let on_edges: Vec<Case> = (0..RAYS).map(on_edge).collect();
    let mut group = criterion.benchmark_group("triangle, exactly on an edge");
    each(&mut group, "Möller–Trumbore", &on_edges, |(ray, t)| textbook::moller_trumbore::<f64>(ray, t, FORWARD));
    each(&mut group, "shipped", &on_edges, |(ray, t)| triangle::intersect(ray, t, FORWARD));
    group.finish();

    let cases = triangles(5.0, 1.0);
    // Aimed at points beside the plane, which nearly all rays meet in front of them; or every other ray turned away.
    let either_way: Vec<Case> = cases
        .iter()
        .map(|(ray, t)| (Ray::new(ray.origin, if r.fraction() < 0.5 { -ray.direction } else { ray.direction }), *t))
        .collect();
    for (name, cases) in [("plane, half hit", &either_way), ("plane, nearly all hit", &cases)] {
        let mut group = criterion.benchmark_group(name);
        each(&mut group, "textbook", cases, |(ray, t)| textbook::plane::<f64>(ray, t[0], t[1], FORWARD));
        each(&mut group, "shipped", cases, |(ray, t)| plane::intersect(ray, t[0], t[1], FORWARD));
    }

    let boxes: Vec<(Ray, [DVec3; 2])> = cases.iter().map(|(ray, t)| (*ray, [t[0].min(t[1]), t[0].max(t[1])])).collect();
    let entry = |(lambda, _)| Hit { lambda, error: 0.0, uv: truehit::glam::DVec2::ZERO, part: 0 };
    let mut group = criterion.benchmark_group("box");
    each(&mut group, "textbook", &boxes, |(ray, b)| textbook::slab::<f64>(ray, b[0], b[1], FORWARD).map(entry));
    each(&mut group, "shipped", &boxes, |(ray, b)| slab::intersect(ray, b[0], b[1], FORWARD).map(entry));
    group.finish();

    let comb =
        [[-5.0, -4.0], [5.0, -4.0], [5.0, 4.0], [3.0, -2.0], [1.0, 4.0], [-1.0, -2.0], [-3.0, 4.0], [-5.0, -2.0]];
    let comb = comb.map(|[x, y]| DVec3::new(x, y, 1.0));
    let contours = polygon::Contours::new(&[&comb]).expect("a polygon");
    let mut r = Rng::new(3);
    let ray = |_| {
        let (origin, target) = (50.0 * r.in_cube(1.0), DVec3::new(6.0, 5.0, 0.0) * r.in_cube(1.0) + DVec3::Z);
        Ray::new(origin, target - origin)
    };
    let rays: Vec<Ray> = (0..RAYS).map(ray).collect();
    let mut group = criterion.benchmark_group("polygon of 8 vertices");
    each(&mut group, "textbook", &rays, |ray| textbook::polygon::<f64>(ray, &[&comb], FORWARD));
    each(&mut group, "shipped", &rays, |ray| polygon::intersect(ray, &contours, FORWARD));
    group.finish();

    let map = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0) * DAffine3::from_translation(DVec3::ONE);
    let placed: Vec<(Ray, Ray, Affine<Triangle>, Triangle)> = cases
        .iter()
        .map(|(ray, [a, b, c])| {
            let triangle = Triangle::new(*a, *b, *c).expect("a triangle");
            let world = Ray::new(map.transform_point3(ray.origin), map.transform_vector3(ray.direction));
            (*ray, world, Affine::new(triangle, map).expect("a rotation"), triangle)
        })
        .collect();
    let mut group = criterion.benchmark_group("affine triangle");
    each(&mut group, "itself", &placed, |(ray, _, _, triangle)| triangle.intersect(ray, FORWARD));
    let inverse = map.inverse();
    each(&mut group, "Möller–Trumbore, mapped ray", &placed, |(_, world, _, triangle)| {
        let origin = inverse.transform_point3(world.origin);
        let ray = Ray::new(origin, inverse.transform_vector3(world.direction));
        textbook::moller_trumbore::<f64>(&ray, triangle.vertices(), FORWARD)
    });
    each(&mut group, "through a map", &placed, |(_, world, affine, _)| affine.intersect(world, FORWARD));
    group.finish();
}

criterion_group!(kernels, flat_kernels);
criterion_main!(kernels);
