//! The report is honest: deliberately broken kernels show up in its numbers, by as much as they are broken.
#![allow(dead_code, unreachable_pub)]

mod meshes;
mod support;

#[path = "../examples/speed_vs_error/aftermath.rs"]
mod aftermath;
#[path = "../examples/speed_vs_error/block.rs"]
mod block;
#[path = "../examples/speed_vs_error/fallbacks.rs"]
mod fallbacks;
#[path = "../examples/speed_vs_error/kernels.rs"]
mod kernels;
#[path = "../examples/speed_vs_error/page.rs"]
mod page;
#[path = "../examples/speed_vs_error/peers.rs"]
mod peers;
#[path = "../examples/speed_vs_error/rows.rs"]
mod rows;
#[path = "../examples/speed_vs_error/table.rs"]
mod table;
#[path = "../examples/speed_vs_error/tables.rs"]
mod tables;
#[path = "../examples/speed_vs_error/timing.rs"]
mod timing;
#[path = "../examples/speed_vs_error/watertight.rs"]
mod watertight;

use aftermath::Aftermath;
use kernels::{Entry, Function, Origin};
use rows::{Accuracy, Row, Sheet};
use support::cases::{Family, Kernel};
use support::rng;
use truehit::glam::{DVec2, DVec3};
use truehit::kernel::{frustum, sphere, textbook, triangle};
use truehit::{Hit, Interval, Ray};
use watertight::Sieve;

const CASES: usize = 400;

fn family(kernel: Kernel, number: u32) -> Family {
    support::families::all().into_iter().find(|f| f.kernel == kernel && f.number == number).unwrap()
}

fn sheet(kernel: Kernel, number: u32) -> Sheet {
    let sheet = Sheet::new(&family(kernel, number), CASES);
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
fn a_bound_too_large_shows() {
    fn timid(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        let hit = sphere::intersect(ray, center, radius, within)?;
        Some(Hit { error: hit.error * 100.0, ..hit })
    }
    let row = Row::new(&on_spheres(timid), &family(Kernel::Sphere, 0), &sheet(Kernel::Sphere, 0), 0);
    let shortcomings = row.shortcomings();
    assert!(shortcomings.len() == 1 && shortcomings[0].starts_with("bounds 1"), "{shortcomings:?}");
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
    let entries = [on_spheres(sphere::intersect), on_spheres(slow_at_times)];
    let runners: Vec<_> = entries.iter().map(|e| (e, e.prepare(&sheet.cases))).collect();
    let speeds = timing::race(&runners, 5);
    let (quick, slow) = (speeds[0], speeds[1]);
    assert!(slow.throughput.median > 5.0 * quick.throughput.median, "{slow:?}");
    assert!(slow.latency.median > 5.0 * quick.latency.median);
    assert!(slow.throughput.low <= slow.throughput.median && slow.throughput.median <= slow.throughput.high);
}

/// The crate's own counts: none on ordinary rays, every ray of exact tangents; textbook kernels have nothing to count.
#[test]
fn rays_that_leave_the_fast_path_are_counted() {
    fn on_tangents(function: fn(&Ray, DVec3, f64, Interval) -> Option<Hit>) -> Accuracy {
        Accuracy::of(&on_spheres(function), &Sheet::new(&family(Kernel::Sphere, 3), CASES))
    }
    let a = Accuracy::of(&on_spheres(sphere::intersect), &sheet(Kernel::Sphere, 0));
    assert_eq!((a.refined, a.exact), (0, 0));
    let a = on_tangents(sphere::intersect);
    assert_eq!(a.refined, CASES);
    assert!(a.exact <= a.refined);
    assert_eq!(on_tangents(textbook::sphere::<f64>).refined, 0);
    let entries = table::all();
    for kernel in Kernel::ALL {
        let f = fallbacks::of(&family(kernel, 0), &entries, 20_000);
        println!("{}: {} of {} left the fast path, {} hits", kernel.name(), f.refined, f.rays, f.hits);
        assert!(f.hits * 3 > f.rays && f.refined * 1000 <= f.rays);
    }
}

#[test]
fn errors_lie_in_their_bins() {
    let ulps = [0.0, 0.0, 0.3, 0.5, 0.7, 1.0, 2.0, 5.0, 1e4, 1e7, f64::INFINITY];
    assert_eq!(rows::histogram(&ulps), [2, 2, 2, 1, 1, 1, 2]);
}

/// Points off the surface, normals askew and rays that meet what they left show in a textbook kernel, not in the
/// crate's.
#[test]
fn points_normals_and_re_hits_show() {
    let sheet = sheet(Kernel::Sphere, 10);
    let entries = table::all();
    let of = |name: &str| {
        let entry = entries.iter().find(|e| e.kernel == Kernel::Sphere && e.name == name).unwrap();
        Aftermath::of(entry, &sheet, CASES)
    };
    let (own, textbook) = (of("truehit"), of("slide formula f64"));
    assert!(own.points.len() > 150 && textbook.points.len() > 100);
    assert!(own.points.last().unwrap() < &4.0 && textbook.points.last().unwrap() > &1e6);
    assert!(textbook.normals.last().unwrap() > own.normals.last().unwrap());
    assert_eq!((own.violations, own.rehits, own.spawned), (0, 0, own.points.len()));
    assert!(textbook.rehits * 10 > textbook.spawned, "{} of {}", textbook.rehits, textbook.spawned);
}

/// A kernel that is wrong is on the page by name, with its numbers, and in the list of worst cases; a right one is not.
#[test]
fn a_broken_kernel_is_on_the_page() {
    fn broken(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
        let hit = sphere::intersect(ray, center, radius, within)?;
        if ray.origin.x < 0.0 { None } else { Some(Hit { lambda: hit.lambda * (1.0 + 64.0 * f64::EPSILON), ..hit }) }
    }
    let (family, sheet) = (family(Kernel::Sphere, 0), sheet(Kernel::Sphere, 0));
    let page = |function| {
        let rows = [Row::new(&on_spheres(function), &family, &sheet, 100)];
        let took = std::time::Duration::from_secs(1);
        let page = page::Page {
            rows: &rows,
            ordinary: &[],
            sieves: &[],
            cases: CASES,
            full: true,
            machine: String::new(),
            took,
        };
        let worst = tables::worst_cases(&rows);
        (rows[0].shortcomings(), page.markdown(), tables::csv("a test", &rows), worst)
    };
    let (shortcomings, markdown, csv, worst) = page(sphere::intersect);
    assert!(shortcomings.is_empty() && markdown.contains("No row breaks its contract"));
    assert!(csv.lines().nth(2).unwrap().contains(&format!(",{CASES},0,0,0,{},0,0,", sheet.hits())));
    assert_eq!(worst.lines().count(), 11);

    let missed = sheet.cases.iter().zip(&sheet.truths).filter(|(c, t)| c.ray.origin.x < 0.0 && t.is_some()).count();
    let hit = sheet.hits() - missed;
    let (shortcomings, markdown, csv, worst) = page(broken);
    println!("{}", shortcomings.join(", "));
    assert!(shortcomings[0] == format!("{missed} wrong decisions of {CASES}"), "{shortcomings:?}");
    assert!(shortcomings.contains(&format!("{hit} bounds on λ broken of {hit}")), "{shortcomings:?}");
    assert!(shortcomings.iter().any(|s| s.starts_with("λ off by")), "{shortcomings:?}");
    assert!(markdown.contains("Rows that break their contract") && markdown.contains(&shortcomings.join(", ")));
    assert!(csv.lines().nth(2).unwrap().contains(&format!(",{CASES},{missed},0,0,{hit},0,{hit},")), "{csv}");
    assert_eq!(worst.lines().filter(|l| l.starts_with("sphere 0 under test, missed: origin")).count(), 10);
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

/// Tables whose lines have as many cells as their heads: names of families hold bars.
#[test]
fn the_pages_tables_are_even() {
    let (family, sheet) = (family(Kernel::Sphere, 16), Sheet::new(&family(Kernel::Sphere, 16), 40));
    assert!(family.name.contains('|'));
    let entries = [on_spheres(sphere::intersect), on_spheres(textbook::sphere::<f64>)];
    let rows = entries.map(|e| Row::new(&e, &family, &sheet, 40));
    let page = page::Page {
        rows: &rows,
        ordinary: &[],
        sieves: &[],
        cases: 40,
        full: false,
        machine: String::new(),
        took: std::time::Duration::ZERO,
    };
    let committed = [include_str!("../docs/speed-vs-error.md"), include_str!("../README.md")];
    let mut tables = 0;
    for text in [page.markdown().as_str()].into_iter().chain(committed) {
        let mut cells = 0;
        for line in text.lines() {
            let bars = if line.starts_with('|') { line.replace("\\|", "").matches('|').count() } else { 0 };
            assert!(cells == 0 || bars == 0 || bars == cells, "{line}");
            tables += usize::from(cells == 0 && bars > 0);
            cells = bars;
        }
    }
    println!("{tables} tables");
    assert!(tables > 30);
}
