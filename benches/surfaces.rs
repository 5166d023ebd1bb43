//! What comes after a hit: the surface there (its point and normal), and a ray that leaves it. Each row asks both of
//! the same hits; that all spawned rays leave is asserted. `cargo bench --bench surfaces`

#[path = "../tests/support/rng.rs"]
mod rng;

#[path = "../tests/meshes/mod.rs"]
mod meshes;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rng::Rng;
use std::hint::black_box;
use truehit::glam::{DAffine3, DVec3};
use truehit::{
    Affine, Cone, Cylinder, Hit, Interval, InvalidShape, Mesh, Plane, Polygon, Ray, Shape, Sphere, Triangle,
};

const HITS: usize = 4096;

type Named = (&'static str, Box<dyn Shape>);

/// Shapes around the origin, of a size of about one.
fn shapes() -> Result<Vec<Named>, InvalidShape> {
    let tilted = DVec3::new(0.3, -0.2, 0.9);
    let corners = [[-2.0, -1.5, 0.1], [2.0, -1.4, -0.2], [0.1, 2.0, 0.3]].map(DVec3::from);
    let [a, b, c] = corners;
    let rim = [[-1.0, -1.0], [1.0, -1.0], [1.2, 0.3], [0.4, 1.1], [-0.8, 0.9]].map(|[x, y]| DVec3::new(x, y, 0.25));
    // Vertices in f32, as files have them.
    let (positions, triangles) = meshes::icosphere(4);
    let positions: Vec<DVec3> = positions.iter().map(|p| p.as_vec3().as_dvec3()).collect();
    let map = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0)
        * DAffine3::from_scale(DVec3::new(1.0, 1.3, 0.7))
        * DAffine3::from_translation(DVec3::splat(0.1));
    Ok(vec![
        ("plane", Box::new(Plane::new([0.1, 0.2, 0.0], tilted)?)),
        ("triangle", Box::new(Triangle::new(a, b, c)?)),
        ("polygon", Box::new(Polygon::new(&rim)?)),
        ("sphere", Box::new(Sphere::new([0.1, 0.0, -0.1], 1.1)?)),
        ("cylinder", Box::new(Cylinder::new([0.0, 0.1, -1.0], [0.1, 0.0, 1.0], 0.8)?)),
        ("cone", Box::new(Cone::new([0.0, 0.1, -1.0], [0.1, 0.0, 1.0], 0.8)?)),
        ("mesh of 5,120 triangles", Box::new(Mesh::new(positions.clone(), triangles.clone())?)),
        ("sphere under a map", Box::new(Affine::new(Sphere::new([0.1, 0.0, -0.1], 1.1)?, map)?)),
        ("cylinder under a map", Box::new(Affine::new(Cylinder::new([0.0, 0.1, -1.0], [0.1, 0.0, 1.0], 0.8)?, map)?)),
        ("cone under a map", Box::new(Affine::new(Cone::new([0.0, 0.1, -1.0], [0.1, 0.0, 1.0], 0.8)?, map)?)),
        ("mesh under a map", Box::new(Affine::new(Mesh::new(positions, triangles)?, map)?)),
    ])
}

fn surfaces(criterion: &mut Criterion) {
    for (name, shape) in shapes().expect("shapes") {
        let mut r = Rng::new(1);
        let mut hits: Vec<(Ray, Hit, DVec3)> = Vec::new();
        while hits.len() < HITS {
            let origin = 4.0 * r.unit();
            let ray = Ray::new(origin, 0.7 * r.in_cube(1.0) - origin);
            if let Some(hit) = shape.intersect(&ray, Interval::FORWARD) {
                hits.push((ray, hit, r.unit()));
            }
        }
        let surface = |ray: &Ray, hit: &Hit| truehit::Surface::new(&*shape, ray, hit);
        for (ray, hit, direction) in &hits {
            let leaving = surface(ray, hit).spawn(*direction);
            assert!(shape.departs(&leaving, hit, direction.dot(shape.normal(ray, hit)) >= 0.0), "{name}: {ray:?}");
        }
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(HITS as u64));
        group.bench_function("surface", |b| {
            b.iter(|| {
                let of = |(ray, hit, _): &(Ray, Hit, DVec3)| {
                    let surface = surface(ray, hit);
                    surface.point() + surface.normal() * surface.error()
                };
                black_box(&hits).iter().map(of).sum::<DVec3>()
            });
        });
        group.bench_function("surface and spawned ray", |b| {
            b.iter(|| {
                let of = |(ray, hit, direction): &(Ray, Hit, DVec3)| surface(ray, hit).spawn(*direction).origin;
                black_box(&hits).iter().map(of).sum::<DVec3>()
            });
        });
        group.finish();
    }
}

criterion_group!(benches, surfaces);
criterion_main!(benches);
