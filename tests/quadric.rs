//! Sphere, cylinder, cone: every answer against exact arithmetic, on cases that are dense in ties.

#[path = "support/mod.rs"]
mod support;

use std::collections::BTreeMap;
use support::big::Real;
use support::cases::{Case, Solid};
use support::measure::{measure, scale};
use support::oracle::truth;
use support::rng::{Rng, nudged, nudged_each};
use truehit::glam::DVec3;
use truehit::{Hit, Interval, kernel};

fn shipped(case: &Case) -> Option<Hit> {
    match case.solid {
        Solid::Sphere { center, radius } => kernel::sphere::intersect(&case.ray, center, radius, case.within),
        Solid::Frustum { base, top, base_radius, top_radius } => {
            kernel::frustum::intersect(&case.ray, base, top, base_radius, top_radius, case.within)
        }
        _ => unreachable!("not a quadric"),
    }
}

/// What a run over many cases came to.
#[derive(Debug, Default)]
struct Tally {
    cases: usize,
    hits: usize,
    wrong: usize,
    wrong_part: usize,
    violations: usize,
    ulps: f64,
    parts: BTreeMap<u32, usize>,
    tightness: Vec<f64>,
    first_bad: Option<String>,
}

impl Tally {
    fn add(&mut self, case: &Case, contract: f64) {
        self.cases += 1;
        let (hit, truth) = (shipped(case), truth(case));
        let mut bad = hit.is_some() != truth.is_some();
        self.wrong += usize::from(bad);
        self.hits += usize::from(truth.is_some());
        if let (Some(hit), Some(truth)) = (hit, truth) {
            *self.parts.entry(hit.part).or_default() += 1;
            let m = measure(&hit, &truth.lambda.enclosure(), scale(case));
            self.ulps = self.ulps.max(m.ulps);
            self.violations += usize::from(m.violated);
            self.tightness.push(m.tightness);
            let wrong_part = !truth.parts.contains(&hit.part);
            self.wrong_part += usize::from(wrong_part);
            bad |= m.violated || m.ulps > contract || wrong_part;
        }
        if bad && self.first_bad.is_none() {
            self.first_bad = Some(format!("{}\n{hit:?}\n{:?}", case.hex(), truth_of(case)));
        }
    }

    fn tightness(&mut self) -> f64 {
        self.tightness.sort_by(f64::total_cmp);
        self.tightness.get(self.tightness.len() / 2).copied().unwrap_or(1.0)
    }
}

fn truth_of(case: &Case) -> Option<f64> {
    truth(case).map(|t| t.lambda.enclosure().to_f64())
}

fn run(name: &str, n: usize, contract: f64, mut generate: impl FnMut(&mut Rng) -> Case) -> Tally {
    let mut rng = Rng::new(0x5eed ^ name.len() as u64);
    let mut tally = Tally::default();
    for _ in 0..n {
        tally.add(&generate(&mut rng), contract);
    }
    let tightness = tally.tightness();
    println!(
        "{name:36} {:7} cases {:7} hits {:?}  wrong {}  wrong part {}  max {:.4} ulp  violations {}  median bound/error {tightness:.2}",
        tally.cases, tally.hits, tally.parts, tally.wrong, tally.wrong_part, tally.ulps, tally.violations
    );
    assert!(tally.first_bad.is_none(), "{name}: {}", tally.first_bad.as_ref().unwrap());
    assert!(tally.hits > 0, "{name}: no hits");
    tally
}

/// A frustum of few bits: cylinders, cones, both ways up, truncated.
fn lattice_frustum(rng: &mut Rng) -> Solid {
    let base = rng.small(2);
    let mut axis = DVec3::ZERO;
    while axis == DVec3::ZERO {
        axis = if rng.chance(0.5) {
            rng.small(2)
        } else {
            [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3) as usize] * rng.eighths(3)
        };
    }
    let r = 0.125 + rng.eighths(2).abs();
    let (base_radius, top_radius) = match rng.below(4) {
        0 => (r, r),
        1 => (r, 0.0),
        2 => (0.0, r),
        _ => (r, 0.125 + rng.eighths(2).abs()),
    };
    Solid::Frustum { base, top: base + axis, base_radius, top_radius }
}

/// A point of few bits in, on or about the frustum: rims, apex, axis, cap planes.
fn lattice_point(rng: &mut Rng, solid: &Solid) -> DVec3 {
    let Solid::Frustum { base, top, base_radius, top_radius } = *solid else { unreachable!() };
    let axis = top - base;
    let across = [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3) as usize] * rng.sign();
    let s = rng.integer(-2, 6) as f64 / 4.0;
    let radius = base_radius + s * (top_radius - base_radius);
    match rng.below(6) {
        0 => rng.small(4),
        1 => base + across * base_radius,
        2 => top + across * top_radius,
        3 => base + s * axis + across * radius,
        4 => base + s * axis,
        _ => base + s * axis + rng.small(1),
    }
}

fn lattice_case(rng: &mut Rng) -> Case {
    let solid = lattice_frustum(rng);
    let Solid::Frustum { base, top, base_radius, top_radius } = solid else { unreachable!() };
    let (p, q) = (lattice_point(rng, &solid), lattice_point(rng, &solid));
    let d = match rng.below(5) {
        0 => top - base,
        1 => [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3) as usize] * rng.sign(),
        2 => rng.small(1),
        // Along a generator, where the lattice has one.
        3 => {
            top - base + (top_radius - base_radius) * [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3) as usize] * rng.sign()
        }
        _ => q - p,
    };
    let origin = p - d * rng.eighths(2);
    let within =
        [Interval::FORWARD, Interval::LINE, Interval::new(rng.eighths(2), rng.eighths(2)), Interval::new(-0.0, 1.0)];
    Case { within: within[rng.below(4) as usize], ..Case::new(origin, d, solid) }
}

#[test]
fn frusta_on_a_lattice() {
    let t = run("lattice", 40_000, 4.0, lattice_case);
    assert!(t.parts.len() == 3);
    run("lattice, nudged", 20_000, 4.0, |rng| {
        let mut case = lattice_case(rng);
        let n = 1;
        case.ray.origin = nudged_each(case.ray.origin, n, rng);
        if rng.chance(0.3) {
            case.ray.direction = nudged_each(case.ray.direction, n, rng);
        }
        if let Solid::Frustum { base, top, base_radius, .. } = &mut case.solid {
            if rng.chance(0.3) {
                *base_radius = nudged(*base_radius, if *base_radius == 0.0 { 1 } else { rng.integer(-1, 1) });
            }
            if rng.chance(0.2) {
                (*base, *top) = (nudged_each(*base, n, rng), nudged_each(*top, n, rng));
            }
        }
        case
    });
    run("lattice, scaled", 10_000, 4.0, |rng| {
        let mut case = lattice_case(rng);
        let (k, l) = (2f64.powi(rng.integer(-300, 300) as i32), 2f64.powi(rng.integer(-300, 300) as i32));
        case.ray.origin *= k;
        case.ray.direction *= l;
        if let Solid::Frustum { base, top, base_radius, top_radius } = &mut case.solid {
            (*base, *top, *base_radius, *top_radius) = (*base * k, *top * k, *base_radius * k, *top_radius * k);
        }
        case
    });
}

fn ordinary_frustum(rng: &mut Rng, distance: f64, kind: u64) -> Case {
    let base = rng.in_cube(5.0);
    let axis = rng.unit() * rng.log(0.1, 10.0);
    let r = rng.log(0.1, 10.0);
    let (base_radius, top_radius) = match kind {
        0 => (r, r),
        1 => (r, 0.0),
        _ => (r, rng.log(0.1, 10.0)),
    };
    let size = r.max(axis.length()).max(top_radius);
    let target = base + axis * rng.uniform(0.0, 1.0) + rng.unit() * size * rng.uniform(0.0, 1.2);
    let u = rng.unit();
    Case::new(
        target - u * distance * size,
        u * rng.length(),
        Solid::Frustum { base, top: base + axis, base_radius, top_radius },
    )
}

#[test]
fn ordinary_frusta() {
    for (kind, name) in [(0, "cylinder"), (1, "cone"), (2, "truncated cone")] {
        for distance in [0.0, 0.5, 5.0, 1e3, 1e6, 1e9] {
            let n = if distance == 5.0 { 20_000 } else { 5_000 };
            let mut t =
                run(&format!("{name} from {distance} sizes"), n, 4.0, |rng| ordinary_frustum(rng, distance, kind));
            assert!(t.hits * 5 > t.cases && t.tightness() < 8.0);
        }
    }
}

fn ordinary_sphere(rng: &mut Rng, distance: f64) -> Case {
    let (center, radius) = (rng.in_cube(5.0), rng.log(0.1, 10.0));
    let u = rng.unit();
    let target = center + rng.across(u) * radius * (2.0 * rng.uniform(0.0, 1.0)).sqrt();
    Case::new(target - u * distance * radius, u * rng.length(), Solid::Sphere { center, radius })
}

#[test]
fn spheres() {
    for distance in [0.0, 0.5, 3.0, 1e4, 1e8, 1e12] {
        let mut t = run(&format!("sphere from {distance} r"), 20_000, 1.0, |rng| ordinary_sphere(rng, distance));
        assert!(t.hits * 5 > t.cases && t.tightness() < 8.0);
    }
    run("sphere, origin on it", 20_000, 1.0, |rng| {
        let (center, radius) = (rng.in_cube(5.0), rng.log(0.1, 10.0));
        let n = rng.integer(0, 2);
        let origin = nudged_each(center + rng.unit() * radius, n, rng);
        Case::new(origin, rng.unit() * rng.length(), Solid::Sphere { center, radius })
    });
    run("sphere on a lattice", 40_000, 1.0, |rng| {
        let solid =
            Solid::Sphere { center: rng.small(2), radius: [1.0, 1.25, 1.5, 3.0, 0.625, 2.125][rng.below(6) as usize] };
        let mut d = DVec3::ZERO;
        while d == DVec3::ZERO {
            d = if rng.chance(0.5) {
                rng.small(2)
            } else {
                [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3) as usize] * rng.sign()
            };
        }
        let within = [
            Interval::FORWARD,
            Interval::LINE,
            Interval::new(rng.eighths(2), rng.eighths(2)),
            Interval::new(-0.0, 1.0),
        ];
        Case { within: within[rng.below(4) as usize], ..Case::new(rng.small(3), d, solid) }
    });
    for distance in [3.0, 1e5] {
        run(&format!("sphere grazed from {distance} r"), 20_000, 1.0, |rng| {
            let (center, radius) = (rng.in_cube(5.0), rng.log(0.1, 10.0));
            let u = rng.unit();
            let impact = radius * (1.0 + rng.sign() * rng.log(1e-16, 1e-4));
            let origin = center + rng.across(u) * impact - u * distance * radius;
            Case::new(origin, u * rng.length(), Solid::Sphere { center, radius })
        });
    }
    run("sphere, limits at λ", 5_000, 1.0, |rng| {
        let mut case = ordinary_sphere(rng, 3.0);
        if let Some(t) = truth(&case) {
            let limit = nudged(t.lambda.enclosure().to_f64(), rng.integer(-1, 2));
            case.within = if rng.chance(0.5) { Interval::new(limit, f64::INFINITY) } else { Interval::new(0.0, limit) };
        }
        case
    });
}

#[test]
fn precise_lambda_has_a_hundred_bits() {
    use truehit::{Cone, Shape, Sphere};
    let mut rng = Rng::new(5);
    let mut n = 0;
    for _ in 0..5_000 {
        let case = if rng.chance(0.5) { ordinary_sphere(&mut rng, 3.0) } else { ordinary_frustum(&mut rng, 3.0, 2) };
        let shape: Box<dyn Shape> = match case.solid {
            Solid::Sphere { center, radius } => Box::new(Sphere::new(center, radius).unwrap()),
            Solid::Frustum { base, top, base_radius, top_radius } => {
                Box::new(Cone::truncated(base, top, base_radius, top_radius).unwrap())
            }
            _ => unreachable!(),
        };
        let (Some(hit), Some(truth)) = (shape.intersect(&case.ray, case.within), truth(&case)) else { continue };
        n += 1;
        let [hi, lo] = shape.precise_lambda(&case.ray, &hit);
        let exact = truth.lambda.enclosure();
        let error = exact.minus(&Real::from_f64(hi).enclosure().lo).minus(&Real::from_f64(lo).enclosure().lo).abs();
        assert!(error.hi.to_f64() < 1e-29 * exact.to_f64().abs(), "{}", case.hex());
    }
    println!("{n} precise");
    assert!(n > 1500);
}
