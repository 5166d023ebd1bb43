//! The report is honest: deliberately broken kernels show up in its numbers, by as much as they are broken.
#![allow(dead_code, unreachable_pub)]

mod meshes;
mod support;

#[path = "../examples/speed_vs_error/kernels.rs"]
mod kernels;
#[path = "../examples/speed_vs_error/rows.rs"]
mod rows;
#[path = "../examples/speed_vs_error/table.rs"]
mod table;
#[path = "../examples/speed_vs_error/timing.rs"]
mod timing;
#[path = "../examples/speed_vs_error/watertight.rs"]
mod watertight;

use kernels::{Entry, Function, Origin};
use rows::{Accuracy, Sheet};
use support::cases::Kernel;
use support::rng;
use truehit::glam::{DVec2, DVec3};
use truehit::kernel::{frustum, sphere, triangle};
use truehit::{Hit, Interval, Ray};
use watertight::Sieve;

const CASES: usize = 400;

fn sheet(kernel: Kernel, number: u32) -> Sheet {
    let family = support::families::all().into_iter().find(|f| f.kernel == kernel && f.number == number).unwrap();
    let sheet = Sheet::new(&family, CASES);
    assert!(sheet.hits() > CASES / 4 && sheet.hits() < CASES, "{} hits", sheet.hits());
    sheet
}

fn on_spheres(function: fn(&Ray, DVec3, f64, Interval) -> Option<Hit>) -> Entry {
    Entry { kernel: Kernel::Sphere, name: "under test", origin: Origin::Shipped, function: Function::Sphere(function) }
}

#[test]
fn a_right_kernel_is_seen_right() {
    let sheet = sheet(Kernel::Sphere, 0);
    let a = Accuracy::of(&on_spheres(sphere::intersect), &sheet);
    assert_eq!((a.answered, a.hits, a.wrong(), a.violations), (CASES, sheet.hits(), 0, 0));
    assert!(a.quantile(1.0).unwrap() <= 1.0);
}

#[test]
fn a_shifted_lambda_shows_in_ulps_and_broken_bounds() {
    fn late(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        let hit = sphere::intersect(ray, center, radius, within)?;
        Some(Hit { lambda: hit.lambda * (1.0 + 1024.0 * f64::EPSILON), ..hit })
    }
    let sheet = sheet(Kernel::Sphere, 0);
    let a = Accuracy::of(&on_spheres(late), &sheet);
    assert_eq!((a.wrong(), a.violations), (0, sheet.hits()));
    assert!(a.quantile(0.0).unwrap() > 1000.0 && a.quantile(1.0).unwrap() < 2100.0);
    assert_eq!(a.worst.len(), 10);
    assert!(a.worst[0].1.contains("sphere 0x") || a.worst[0].1.contains("sphere ["), "{}", a.worst[0].1);
}

#[test]
fn a_bound_too_small_shows() {
    fn bold(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        let hit = sphere::intersect(ray, center, radius, within)?;
        Some(Hit { error: hit.error / 1e3, ..hit })
    }
    let sheet = sheet(Kernel::Sphere, 0);
    let a = Accuracy::of(&on_spheres(bold), &sheet);
    assert!(a.violations > sheet.hits() / 2, "{} of {}", a.violations, sheet.hits());
    assert_eq!(a.wrong(), 0);
}

#[test]
fn misses_and_inventions_are_counted_one_by_one() {
    fn odd(ray: &Ray) -> bool {
        ray.origin.x.to_bits().is_multiple_of(8)
    }
    fn blind(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        if odd(ray) { None } else { sphere::intersect(ray, center, radius, within) }
    }
    fn eager(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        let ghost = Hit { lambda: 1.0, error: 0.0, uv: DVec2::ZERO, part: 0 };
        sphere::intersect(ray, center, radius, within).or_else(|| odd(ray).then_some(ghost))
    }
    let sheet = sheet(Kernel::Sphere, 0);
    let of = |hit: bool| {
        let both = sheet.cases.iter().zip(&sheet.truths);
        both.filter(|(c, t)| odd(&c.ray) && t.is_some() == hit).count()
    };
    assert!(of(true) > 10 && of(false) > 10);
    let a = Accuracy::of(&on_spheres(blind), &sheet);
    assert_eq!((a.false_misses, a.false_hits), (of(true), 0));
    let a = Accuracy::of(&on_spheres(eager), &sheet);
    assert_eq!((a.false_misses, a.false_hits), (0, of(false)));
}

#[test]
fn a_wrong_part_shows() {
    fn swapped(ray: &Ray, base: DVec3, top: DVec3, r0: f64, r1: f64, within: Interval) -> Option<Hit> {
        let hit = frustum::intersect(ray, base, top, r0, r1, within)?;
        Some(Hit { part: (hit.part + 1) % 3, ..hit })
    }
    let sheet = sheet(Kernel::Cone, 0);
    let function = Function::Frustum(swapped);
    let entry = Entry { kernel: Kernel::Cone, name: "under test", origin: Origin::Shipped, function };
    let a = Accuracy::of(&entry, &sheet);
    assert_eq!((a.wrong(), a.wrong_parts), (0, sheet.hits()));
}

#[test]
fn a_slow_kernel_and_its_slow_rays_show() {
    fn slow_at_times(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        if ray.origin.x.to_bits().is_multiple_of(8) {
            for _ in 0..400 {
                std::hint::black_box(sphere::intersect(ray, center, radius, within));
            }
        }
        sphere::intersect(ray, center, radius, within)
    }
    let sheet = sheet(Kernel::Sphere, 0);
    let speed = |entry: &Entry| timing::speed(entry, &entry.prepare(&sheet.cases), 5);
    let (quick, slow) = (speed(&on_spheres(sphere::intersect)), speed(&on_spheres(slow_at_times)));
    assert!(slow.throughput.median > 5.0 * quick.throughput.median, "{slow:?}");
    assert!(slow.latency.median > 5.0 * quick.latency.median);
    let share = sheet.cases.iter().filter(|c| c.ray.origin.x.to_bits().is_multiple_of(8)).count() as f64 / CASES as f64;
    let seen = slow.slower_than(20.0 * quick.typical());
    assert!((seen - share).abs() < 0.03, "{seen} of {share}");
}

#[test]
fn leaks_double_hits_and_wrong_triangles_show() {
    /// Blind to triangles' borders: a λ of an open triangle.
    fn open(ray: &Ray, t: &[DVec3; 3], within: Interval) -> Option<Hit> {
        triangle::intersect(ray, t, within).filter(|h| h.uv.x > 0.0 && h.uv.y > 0.0 && h.uv.x + h.uv.y < 1.0)
    }
    fn backwards(ray: &Ray, t: &[DVec3; 3], _: Interval) -> Option<Hit> {
        triangle::intersect(ray, t, Interval::LINE)
    }
    let settings = watertight::settings(60);
    let of = |function| Sieve::of("under test", true, &settings, |s| watertight::in_a_loop(s, function));
    let rays = [240; 3];

    let right = of(triangle::intersect);
    assert!(right.is_tight() && right.rays == rays && right.checked > 150);
    // Closed triangles share their borders, where some rays go exactly.
    let doubles = right.doubles.unwrap();
    assert!(doubles[0] > 10 && doubles[1] > 10 && doubles[2] == 0, "{doubles:?}");

    let leaky = of(open);
    assert!(!leaky.is_tight());
    assert!(leaky.leaks[0] > 10 && leaky.leaks[1] > 10 && leaky.leaks[2] == 0, "{:?}", leaky.leaks);

    let behind = of(backwards);
    assert_eq!((behind.leaks, behind.others), ([0; 3], Some(behind.checked)));
    assert_eq!(behind.doubles, Some(rays));
}

#[test]
fn a_mesh_is_tight_and_crossed_once() {
    let sieves = watertight::all(40);
    assert_eq!(sieves.iter().filter(|s| s.shipped).count(), 6);
    for s in sieves.iter().filter(|s| s.shipped) {
        assert!(s.is_tight(), "{}: {:?} leaks, {:?}", s.name, s.leaks, s.others);
    }
    let crosses = sieves.iter().find(|s| s.name.contains("crosses")).unwrap();
    assert_eq!(crosses.doubles, Some([0; 3]));
}
