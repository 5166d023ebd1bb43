//! A generator for every family of hard cases that is about a kernel.

mod affine;
mod box_;
mod flat;
mod frustum;
mod mesh;
mod polygon;
mod sphere;

use super::cases::{Case, Family, Kernel, Solid};
use super::oracle::truth;
use super::rng::{Rng, nudged};
use truehit::glam::DVec3;
use truehit::{Interval, Ray};

/// The ordinary rays of a kernel.
pub fn ordinary(kernel: Kernel) -> Family {
    *all().iter().find(|f| f.kernel == kernel && f.number == 0).expect("every kernel has ordinary rays")
}

/// Every family of every kernel.
pub fn all() -> Vec<Family> {
    let mut families: Vec<Family> = [
        flat::planes(),
        flat::triangles(),
        polygon::polygons(),
        sphere::spheres(),
        frustum::cylinders(),
        frustum::cones(),
        box_::boxes(),
        mesh::FAMILIES.to_vec(),
        affine::FAMILIES.to_vec(),
    ]
    .concat();
    for (kernel, ordinary) in [
        (Kernel::Plane, flat::ordinary_plane as fn(&mut Rng, usize) -> Case),
        (Kernel::Triangle, flat::ordinary_triangle),
        (Kernel::Polygon, polygon::ordinary),
        (Kernel::Sphere, sphere::ordinary),
        (Kernel::Cylinder, frustum::ordinary_cylinder),
        (Kernel::Cone, frustum::ordinary_cone),
        (Kernel::Slab, box_::ordinary),
    ] {
        families.push(Family { number: 0, name: "ordinary", kernel, generate: ordinary });
    }
    families.sort_by_key(|f| (f.kernel, f.number));
    families
}

/// The families of every kernel that only rescale, turn or limit its ordinary rays: a macro, since a generator is a
/// plain function.
macro_rules! shared_families {
    ($kernel:expr, $ordinary:path) => {{
        use super::super::cases::{Case, Family};
        use super::super::rng::Rng;
        const fn family(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
            Family { number, name, kernel: $kernel, generate }
        }
        [
            family(15, "scaled by 2^±300", |rng, i| {
                let (k, l) = (rng.integer(-300, 300), rng.integer(-300, 300));
                super::scaled($ordinary(rng, i), k as i32, l as i32)
            }),
            family(16, "coordinates 1e150, |d| 1e5", |rng, i| super::scaled($ordinary(rng, i), 498, 17)),
            family(17, "coordinates 1e155", |rng, i| super::scaled($ordinary(rng, i), 515, 0)),
            family(18, "coordinates 1e-150", |rng, i| super::scaled($ordinary(rng, i), -498, 0)),
            family(19, "coordinates 1e-160", |rng, i| super::scaled($ordinary(rng, i), -531, 0)),
            family(21, "subnormal d", |rng, i| {
                // Near coordinates of 1e-30, or λ would overflow.
                let k = rng.integer(-1060, -1030);
                super::scaled($ordinary(rng, i), -100, k as i32)
            }),
            family(22, "|d| 1e±150", |rng, i| {
                let k = 498 * rng.sign() as i32;
                super::with_direction_scaled($ordinary(rng, i), k)
            }),
            family(58, "axes and signed zeros", |rng, i| super::along_an_axis(rng, $ordinary, i)),
            family(63, "limits at the exact λ", |rng, i| {
                let case = $ordinary(rng, i);
                super::limited(rng, case)
            }),
            family(64, "max = ∞, min = −0 and negative", |rng, i| super::unlimited(rng, $ordinary, i)),
        ]
    }};
}
use shared_families;

const fn family(kernel: Kernel, number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    Family { number, name, kernel, generate }
}

/// 2^k times a shape, exactly where nothing underflows.
fn scaled_solid(solid: Solid, k: i32) -> Solid {
    let s = |x: f64| ldexp(x, k);
    let v = |p: DVec3| DVec3::new(s(p.x), s(p.y), s(p.z));
    match solid {
        Solid::Plane { point, normal } => Solid::Plane { point: v(point), normal },
        Solid::Triangle(t) => Solid::Triangle(t.map(v)),
        Solid::Polygon(c) => Solid::Polygon(c.into_iter().map(|c| c.into_iter().map(v).collect()).collect()),
        Solid::Sphere { center, radius } => Solid::Sphere { center: v(center), radius: s(radius) },
        Solid::Frustum { base, top, base_radius, top_radius } => {
            Solid::Frustum { base: v(base), top: v(top), base_radius: s(base_radius), top_radius: s(top_radius) }
        }
        Solid::Slab { min, max } => Solid::Slab { min: v(min), max: v(max) },
        Solid::Mesh { positions, triangles } => {
            Solid::Mesh { positions: positions.into_iter().map(v).collect(), triangles }
        }
        Solid::Affine { .. } => unreachable!("an affine shape is scaled through its map"),
    }
}

fn ldexp(x: f64, k: i32) -> f64 {
    truehit::kernel::float::ldexp(x, k)
}

/// Coordinates times 2^k, direction times 2^l.
pub fn scaled(case: Case, k: i32, l: i32) -> Case {
    let v = |p: DVec3, k: i32| DVec3::new(ldexp(p.x, k), ldexp(p.y, k), ldexp(p.z, k));
    let ray = Ray { origin: v(case.ray.origin, k), direction: v(case.ray.direction, l) };
    Case { ray, within: case.within, solid: scaled_solid(case.solid, k) }
}

fn with_direction_scaled(case: Case, k: i32) -> Case {
    scaled(case, 0, k)
}

/// A direction along an axis, often from a dyadic origin, zeros of either sign; aimed where the ordinary ray hit.
fn along_an_axis(rng: &mut Rng, ordinary: fn(&mut Rng, usize) -> Case, i: usize) -> Case {
    let mut case = ordinary(rng, i);
    let lambda = truth(&case).map_or(1.0, |t| t.lambda.enclosure().to_f64());
    let target = case.ray.at(lambda);
    let axis = rng.below(3) as usize;
    let mut d = [0.0 * rng.sign(), 0.0 * rng.sign(), 0.0 * rng.sign()];
    d[axis] = rng.sign() * 2f64.powi(rng.integer(-2, 2) as i32);
    let mut o =
        if i.is_multiple_of(2) { target.to_array() } else { target.to_array().map(|x| (8.0 * x).round() / 8.0) };
    o[axis] -= d[axis].signum() * rng.eighths(8).abs();
    case.ray = Ray::new(o, d);
    case
}

/// An interval with one limit at the nearest hit's λ, rounded, or one float beside it.
fn limited(rng: &mut Rng, mut case: Case) -> Case {
    if let Some(t) = truth(&case) {
        let limit = nudged(t.lambda.enclosure().to_f64(), rng.integer(-1, 2));
        case.within = if rng.chance(0.5) { Interval::new(limit, f64::INFINITY) } else { Interval::new(0.0, limit) };
    }
    case
}

/// Rays that start behind, in or after the shape, over the whole line and over intervals with signed zeros.
fn unlimited(rng: &mut Rng, ordinary: fn(&mut Rng, usize) -> Case, i: usize) -> Case {
    let mut case = ordinary(rng, i);
    let along = rng.uniform(0.0, 12.0) / case.ray.direction.length();
    case.ray.origin = case.ray.at(along);
    case.within = match i % 4 {
        0 => Interval::new(-0.0, f64::INFINITY),
        1 => Interval::LINE,
        2 => Interval::new(-along, 0.0),
        _ => Interval::new(f64::NEG_INFINITY, -0.0),
    };
    case
}

/// A ray towards `target` from `distance` away in a random direction; origin and direction both rounded.
fn towards(rng: &mut Rng, target: DVec3, distance: f64, solid: Solid) -> Case {
    let u = rng.unit();
    let origin = target - u * distance;
    let direction = if rng.chance(0.5) { u * rng.length() } else { (target - origin) / distance * rng.length() };
    Case::new(origin, direction, solid)
}

/// A ray exactly through `target`: a dyadic origin offset, the direction a power of two times the exact difference
/// where that is exact (it is for targets of few bits).
fn exactly_towards(rng: &mut Rng, target: DVec3, solid: Solid) -> Case {
    let mut offset = DVec3::ZERO;
    while offset == DVec3::ZERO {
        offset = rng.small(4);
    }
    let origin = target - offset;
    Case::new(origin, (target - origin) * 2f64.powi(rng.integer(-3, 3) as i32), solid)
}
