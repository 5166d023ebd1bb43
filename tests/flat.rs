//! Planes, triangles, polygons, boxes and affine maps in every family of hard cases, against the oracle.

mod support;

use support::cases::{Case, Kernel, Solid};
use support::families;
use support::shapes::{as_stored, shape};
use support::sweep::{Row, quantile, sweep};
use truehit::glam::{DVec2, DVec3};
use truehit::kernel::{eft, plane, polygon, slab, triangle};
use truehit::{Hit, Polygon, Shape};

/// Every family of `kernel`: nothing wrong, every bound holds, λ within the contract, both products the same bits.
fn families_of(kernel: Kernel, cases: usize, answer: fn(&Case) -> Option<Hit>) {
    let mut hits = 0;
    for family in families::all().into_iter().filter(|f| f.kernel == kernel) {
        let row = sweep(&family, answer, 0..cases);
        show(kernel, family.number, family.name, &row);
        assert_eq!((row.counts.wrong(), row.counts.violations), (0, 0), "{}", family.name);
        assert!(row.counts.max_ulps <= kernel.contract(), "{}", family.name);
        hits += row.counts.hits;
    }
    assert!(hits > cases, "only {hits} hits");
}

#[test]
fn planes_in_every_family() {
    families_of(Kernel::Plane, 3000, |case| {
        let Solid::Plane { point, normal } = case.solid else { unreachable!() };
        let hit = plane::intersect(&case.ray, point, normal, case.within);
        assert_eq!(hit, plane::intersect_with::<eft::Split>(&case.ray, point, normal, case.within));
        hit
    });
}

#[test]
fn polygons_in_every_family() {
    families_of(Kernel::Polygon, 3000, |case| {
        let Solid::Polygon(contours) = &case.solid else { unreachable!() };
        let contours: Vec<&[DVec3]> = contours.iter().map(Vec::as_slice).collect();
        let shape = Polygon::with_holes(contours[0], &contours[1..]).unwrap();
        let contours = polygon::Contours::new(&contours).unwrap();
        let hit = polygon::intersect(&case.ray, &contours, case.within);
        assert_eq!(hit, polygon::intersect_with::<eft::Split>(&case.ray, &contours, case.within));
        assert_eq!(hit, shape.intersect(&case.ray, case.within));
        hit
    });
}

#[test]
fn boxes_in_every_family() {
    families_of(Kernel::Slab, 5000, |case| {
        let Solid::Slab { min, max } = case.solid else { unreachable!() };
        let (enter, _) = slab::intersect(&case.ray, min, max, case.within)?;
        Some(Hit { lambda: enter, error: f64::INFINITY, uv: DVec2::ZERO, part: 0 })
    });
}

#[test]
fn triangles_in_every_family() {
    families_of(Kernel::Triangle, 2000, |case| {
        let Solid::Triangle(t) = &case.solid else { unreachable!() };
        let hit = triangle::intersect(&case.ray, t, case.within);
        assert_eq!(hit, triangle::intersect_with::<eft::Split>(&case.ray, t, case.within));
        hit
    });
}

fn show(kernel: Kernel, number: u32, name: &str, row: &Row) {
    println!(
        "{:<9} {number:>3} {name:<40} cases {} hits {:>6} wrong {} violated {} max ulp {:.4} median bound/err {:.2}",
        kernel.name(),
        row.counts.cases,
        row.counts.hits,
        row.counts.wrong(),
        row.counts.violations,
        row.counts.max_ulps,
        quantile(&row.tightness, 0.5),
    );
    for (what, case) in &row.failures {
        println!("{what}: {}", case.hex());
    }
}

#[test]
fn affine_maps_in_every_family() {
    for family in families::all().into_iter().filter(|f| f.kernel == Kernel::Affine) {
        let mut row = Row::default();
        for i in 0..2000 {
            let case = as_stored(family.case(i));
            let Some(Ok(affine)) = shape(&case.solid) else { unreachable!() };
            let hit = affine.intersect(&case.ray, case.within);
            row.add(&case, hit);
        }
        show(Kernel::Affine, family.number, family.name, &row);
        assert_eq!((row.counts.wrong(), row.counts.violations), (0, 0), "{}", family.name);
        assert!(row.counts.max_ulps <= family.contract(), "{}", family.name);
        assert!(row.counts.hits > 300, "{}", family.name);
    }
}
