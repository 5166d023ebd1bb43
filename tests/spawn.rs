//! Rays that leave a surface: none meets again what it left, and none skips a neighbour a 1e-12th of the scene away.

mod support;

use support::cases::{Case, Kernel, Solid};
use support::families;
use support::rng::Rng;
use support::shapes::shape;
use support::sweep::on_all_cores;
use truehit::glam::{DAffine3, DMat3, DQuat, DVec3};
use truehit::{Affine, Hit, Interval, Plane, Ray, Shape, Surface};

/// What became of the spawned rays of one shape at one scale.
#[derive(Clone, Debug, Default)]
struct Tally {
    spawned: usize,
    outward: usize,
    shadows: usize,
    /// Rays that met the surface they had left.
    rehits: usize,
    /// Rays that started beyond a neighbouring surface.
    skipped: usize,
    /// Rays into a solid that did not come out on its far side.
    lost: usize,
    first: Option<String>,
}

/// The shapes, each with the ordinary rays of its kernel.
const KERNELS: [Kernel; 7] =
    [Kernel::Plane, Kernel::Triangle, Kernel::Polygon, Kernel::Sphere, Kernel::Cylinder, Kernel::Cone, Kernel::Mesh];

/// Where the shape is: its scale as a power of two, and whether it is seen through an affine map.
#[derive(Clone, Copy, Debug)]
struct Place {
    name: &'static str,
    exponent: i32,
    affine: bool,
}

/// Rays spawned from each hit.
const SPAWNS: usize = 10;

const PLACES: [Place; 4] = [
    Place { name: "scale 1", exponent: 0, affine: false },
    Place { name: "planet scale", exponent: 22, affine: false },
    Place { name: "scale 1e-6", exponent: -20, affine: false },
    Place { name: "through an affine map", exponent: 0, affine: true },
];

/// The solid grown outward by `gap`; a plane beside a flat one.
fn neighbour(solid: &Solid, gap: f64, point: DVec3, normal: DVec3) -> Box<dyn Shape> {
    match solid {
        Solid::Sphere { center, radius } => {
            shape(&Solid::Sphere { center: *center, radius: radius + gap }).unwrap().unwrap()
        }
        Solid::Frustum { base, top, base_radius, top_radius } => {
            let axis = (top - base).normalize() * gap;
            // Off a leaning wall by more than the gap.
            let lean = 1.0 + (top_radius - base_radius).abs() / (top - base).length();
            let grown = |r: f64| r + gap * lean * 2.0;
            let (base_radius, top_radius) = (grown(*base_radius), grown(*top_radius));
            shape(&Solid::Frustum { base: base - axis, top: top + axis, base_radius, top_radius }).unwrap().unwrap()
        }
        _ => Box::new(Plane::new(point + normal * gap, normal).unwrap()),
    }
}

fn is_solid(solid: &Solid) -> bool {
    matches!(solid, Solid::Sphere { .. } | Solid::Frustum { .. })
}

fn largest(v: DVec3) -> f64 {
    v.abs().max_element()
}

impl Tally {
    fn fail(&mut self, what: &str, case: &Case, map: Option<&DAffine3>, direction: DVec3) {
        if self.first.is_none() {
            self.first = Some(format!("{what}: {} spawned along {direction:?} under {map:?}", case.hex()));
        }
    }

    fn spawn(&mut self, place: Place, kernel: Kernel, rng: &mut Rng, i: usize) {
        let mut case = families::scaled(families::ordinary(kernel).case(i), place.exponent, place.exponent);
        if kernel == Kernel::Sphere && place.exponent == 22 {
            // A planet with millimetre relief, seen from 1e7 away.
            let radius = 6.371e6 + 1e-3 * rng.uniform(-1.0, 1.0);
            let (u, target) = (rng.unit(), rng.unit() * 6.371e6 * rng.uniform(0.0, 1.0));
            case = Case::new(target - u * 1e7, u * rng.length(), Solid::Sphere { center: DVec3::ZERO, radius });
        }
        let map = place.affine.then(|| DAffine3 {
            matrix3: DMat3::from_quat(DQuat::from_axis_angle(rng.unit(), rng.uniform(0.0, 6.0)))
                * DMat3::from_diagonal(DVec3::new(rng.log(0.3, 3.0), -rng.log(0.3, 3.0), rng.log(0.3, 3.0))),
            translation: rng.in_cube(5.0),
        });
        let under = |inner: Box<dyn Shape>| match map {
            Some(map) => Box::new(Affine::new(inner, map).unwrap()) as Box<dyn Shape>,
            None => inner,
        };
        let Ok(inner) = shape(&case.solid).unwrap() else { return };
        let Some(object_hit) = inner.intersect(&case.ray, case.within) else { return };
        let (object_point, object_normal) =
            (inner.point(&case.ray, &object_hit).position, inner.normal(&case.ray, &object_hit));
        let body = under(inner);
        let ray = map.map_or(case.ray, |m| Ray {
            origin: m.transform_point3(case.ray.origin),
            direction: m.transform_vector3(case.ray.direction),
        });
        let Some(hit) = body.intersect(&ray, case.within) else { return };
        let surface = Surface::new(&*body, &ray, &hit);
        let n = surface.normal();
        // The neighbour outside, a 1e-12th of the scene away: coordinates of the world, in lengths of the object.
        let scene = largest(surface.point()).max(largest(ray.origin)).max(largest(object_point));
        let gap = 1e-12 * scene * if place.affine { 3.5 } else { 1.0 };
        let other = under(neighbour(&case.solid, gap, object_point, object_normal));
        for k in 0..SPAWNS {
            // Any direction, and every third nearly along the surface.
            let mut direction = rng.unit();
            if k.is_multiple_of(3) {
                direction = rng.across(n) + n * rng.sign() * rng.log(1e-16, 1e-3);
            }
            direction *= rng.length();
            let outward = direction.dot(n) >= 0.0;
            let spawned = surface.spawn(direction);
            self.spawned += 1;
            self.outward += usize::from(outward);
            let again = body.intersect(&spawned, Interval::FORWARD);
            // A few units in the last place of the coordinates, not as far as it takes.
            let coordinates = largest(surface.point()).max(largest(ray.origin)).max(largest(object_point));
            let off = spawned.origin.distance(surface.point());
            if off.is_nan() || off > 1e-12 * coordinates {
                self.skipped += 1;
                self.fail("far off", &case, map.as_ref(), direction);
            }
            let same = |again: &Hit| kernel != Kernel::Mesh || again.part == hit.part;
            if (outward || !is_solid(&case.solid)) && again.as_ref().is_some_and(same) {
                self.rehits += 1;
                self.fail("re-hit", &case, map.as_ref(), direction);
            }
            if !outward && is_solid(&case.solid) && again.is_none() {
                self.lost += 1;
                self.fail("lost", &case, map.as_ref(), direction);
            }
            // Into a sphere: the far side is a chord away.
            if let (Solid::Sphere { radius, .. }, false, None) = (&case.solid, outward, map) {
                let chord = 2.0 * radius * direction.dot(n).abs() / direction.length();
                let run = again.map_or(0.0, |h| h.lambda * direction.length());
                if chord > 1e-3 * radius && (run - chord).abs() > 1e-6 * chord {
                    self.rehits += 1;
                    self.fail("re-hit from inside", &case, map.as_ref(), direction);
                }
            }
            // A shadow ray to a point that is outside for certain.
            let light = surface.point() + direction * 3.0;
            if (light - surface.point()).dot(n) > 1e-12 * coordinates.max(largest(light)) {
                self.shadows += 1;
                let shadow = surface.spawn_to(light);
                let blocked = body.intersect(&shadow, Interval::new(0.0, 1.0));
                if blocked.as_ref().is_some_and(same) {
                    self.rehits += 1;
                    self.fail("shadow ray re-hit", &case, map.as_ref(), direction);
                }
            }
            let steep = direction.dot(n) > 1e-3 * direction.length();
            if outward && steep && !other.occludes(&spawned, Interval::FORWARD) {
                self.skipped += 1;
                self.fail("skipped", &case, map.as_ref(), direction);
            }
        }
    }

    fn counts(&self) -> String {
        let Self { spawned, outward, shadows, rehits, skipped, lost, .. } = self;
        format!(
            "{spawned} spawned ({outward} outward), {shadows} shadow rays, {rehits} re-hits, {skipped} skipped, {lost} lost"
        )
    }

    fn merge(&mut self, other: Self) {
        self.spawned += other.spawned;
        self.outward += other.outward;
        self.shadows += other.shadows;
        self.rehits += other.rehits;
        self.skipped += other.skipped;
        self.lost += other.lost;
        self.first = self.first.take().or(other.first);
    }
}

/// `rays` rays at each shape at each place; from what of them hits [`SPAWNS`] are spawned.
fn sweep(rays: usize) {
    const CHUNK: usize = 1000;
    let jobs: Vec<(Place, Kernel)> = PLACES.iter().flat_map(|&p| KERNELS.map(|k| (p, k))).collect();
    let mut tallies = vec![Tally::default(); jobs.len()];
    let mut finished = 0;
    // All shapes and places side by side, so that what a run has done so far is a fair part of it.
    on_all_cores(
        jobs.len() * rays.div_ceil(CHUNK),
        |n| {
            let (job, first) = (n % jobs.len(), n / jobs.len() * CHUNK);
            let mut tally = Tally::default();
            for i in first..(first + CHUNK).min(rays) {
                tally.spawn(jobs[job].0, jobs[job].1, &mut Rng::new(((job as u64) << 40) + i as u64), i);
            }
            tally
        },
        |n, tally| {
            tallies[n % jobs.len()].merge(tally);
            finished += 1;
            if finished % 2000 == 0 {
                let mut total = Tally::default();
                for t in &tallies {
                    total.merge(t.clone());
                }
                eprintln!("so far: {}", total.counts());
            }
        },
    );
    let mut total = Tally::default();
    for ((place, kernel), t) in jobs.iter().zip(&tallies) {
        println!(
            "{:<22} {:<9} {:>10} spawned {:>10} outward {:>10} shadow rays {:>4} re-hits {:>4} skipped {:>4} lost",
            place.name,
            kernel.name(),
            t.spawned,
            t.outward,
            t.shadows,
            t.rehits,
            t.skipped,
            t.lost
        );
        total.merge(t.clone());
    }
    println!("{}", total.counts());
    for ((place, kernel), t) in jobs.iter().zip(&tallies) {
        assert!(t.spawned * 5 > rays * SPAWNS, "{} {}: only {} spawned", place.name, kernel.name(), t.spawned);
        assert_eq!((t.rehits, t.skipped, t.lost), (0, 0, 0), "{} {}: {:?}", place.name, kernel.name(), t.first);
    }
}

#[test]
fn spawned_rays_leave() {
    sweep(1000);
}

/// `cargo test --release --test spawn -- --ignored --nocapture`: 1e8 spawned rays and half as many shadow rays; other
/// numbers of rays at each shape by the environment variable `TRUEHIT_CASES`.
#[test]
#[ignore = "a quarter of an hour"]
fn a_hundred_million_spawned_rays_leave() {
    sweep(support::cases_wanted(700_000));
}

#[test]
fn a_target_at_the_origin_itself_is_left_for() {
    let floor = Plane::new([0.0; 3], [0.0, 1.0, 0.0]).unwrap();
    let down = Ray::new([1.0, 1.0, 0.0], [0.0, -1.0, 0.0]);
    let hit = floor.intersect(&down, Interval::FORWARD).unwrap();
    let surface = Surface::new(&floor, &down, &hit);
    let mut steps = Vec::new();
    for k in 0..200 {
        let target = DVec3::new(1.0, f64::from(k) * 2f64.powi(-54), 0.0);
        let ray = surface.spawn_to(target);
        assert!(ray.is_valid(), "{k}");
        steps.push(ray.origin.y);
    }
    let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let same = steps.iter().filter(|&&y| y == least).count();
    println!("{} targets: {same} rays start {least:e} above the floor, the others farther up", steps.len());
    assert!(same > 100 && same < steps.len());
}
