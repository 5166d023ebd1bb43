use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::{Rng, nudged, nudged_each};
use super::shared_families;
use truehit::glam::DVec3;

const fn family(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Sphere, number, name, generate)
}

const OWN: [Family; 15] = [
    family(1, "grazed at 3 r", |rng, _| grazed(rng, 3.0)),
    family(2, "grazed at 1e5 r", |rng, _| grazed(rng, 1e5)),
    family(3, "exact tangents", |rng, i| tangent(rng, i, 0)),
    family(4, "tangents, r ± 1 ulp", |rng, i| {
        let n = rng.sign() as i64;
        tangent(rng, i, n)
    }),
    family(10, "from 1e4, 1e8, 1e12 r", |rng, _| {
        let distance = rng.pick(&[1e4, 1e8, 1e12]);
        aimed(rng, distance)
    }),
    family(20, "subnormal radius", |rng, _| {
        let radius = f64::from_bits(1 + rng.below(1 << 40));
        let target = rng.unit() * radius * rng.uniform(0.0, 1.4);
        let u = rng.unit();
        Case::new(target - u * 1e-305, u * rng.length(), Solid::Sphere { center: DVec3::ZERO, radius })
    }),
    family(46, "origin rounded onto it", |rng, _| on_surface(rng, 0)),
    family(47, "origin exactly on it", |rng, i| {
        let (p, r) = exact_point(i);
        let s = 2f64.powi(rng.integer(-40, 40) as i32);
        Case::new(p * s, rng.unit() * rng.length(), Solid::Sphere { center: DVec3::ZERO, radius: r * s })
    }),
    family(48, "origin ± 1 ulp in or out", |rng, _| on_surface(rng, 1)),
    family(49, "origin on it, tangent d", |rng, i| {
        let (p, r) = exact_point(i);
        // Perpendicular to (x, y, z) exactly: (y, −x, 0) and its like, and nearly.
        let d = match i % 3 {
            0 => DVec3::new(p.y, -p.x, 0.0),
            1 => DVec3::new(0.0, p.z, -p.y),
            _ => rng.across(p) * rng.length(),
        };
        let d = if d == DVec3::ZERO { DVec3::Z.cross(p) } else { d };
        Case::new(p, d, Solid::Sphere { center: DVec3::ZERO, radius: r })
    }),
    family(50, "origin at the centre", |rng, _| {
        let center = rng.in_cube(5.0);
        Case::new(center, rng.unit() * rng.length(), Solid::Sphere { center, radius: rng.log(1e-3, 1e3) })
    }),
    family(51, "origin inside", |rng, _| {
        let (center, radius) = (rng.in_cube(5.0), rng.log(0.1, 10.0));
        let origin = center + rng.unit() * radius * rng.uniform(0.0, 1.0).sqrt();
        Case::new(origin, rng.unit() * rng.length(), Solid::Sphere { center, radius })
    }),
    family(52, "origin near the surface", |rng, _| {
        let (center, radius) = (rng.in_cube(5.0), rng.log(0.1, 10.0));
        let gap = 1.0 + rng.sign() * rng.log(1e-15, 1e-2);
        Case::new(center + rng.unit() * radius * gap, rng.unit() * rng.length(), Solid::Sphere { center, radius })
    }),
    family(74, "planet with millimetre relief", |rng, _| {
        let radius = 6.371e6 + 1e-3 * rng.uniform(-1.0, 1.0);
        let u = rng.unit();
        let target = rng.unit() * 6.371e6;
        Case::new(target - u * 1e7, u * rng.length(), Solid::Sphere { center: DVec3::ZERO, radius })
    }),
    family(77, "far centre, unit radius", |rng, _| {
        let center = rng.in_cube(1.0) * rng.log(1e3, 1e9);
        let target = center + rng.unit() * rng.uniform(0.0, 1.4);
        super::towards(rng, target, 5.0, Solid::Sphere { center, radius: 1.0 })
    }),
];
pub fn spheres() -> Vec<Family> {
    [&OWN[..], &shared_families!(Kernel::Sphere, super::sphere::ordinary)].concat()
}

pub fn ordinary(rng: &mut Rng, _: usize) -> Case {
    let distance = rng.uniform(2.0, 10.0);
    aimed(rng, distance)
}

/// From `distance` radii, half of them hits.
fn aimed(rng: &mut Rng, distance: f64) -> Case {
    let (center, radius) = (rng.in_cube(5.0), rng.log(0.1, 10.0));
    let u = rng.unit();
    let target = center + rng.across(u) * radius * (2.0 * rng.uniform(0.0, 1.0)).sqrt();
    Case::new(target - u * distance * radius, u * rng.length(), Solid::Sphere { center, radius })
}

/// Impact parameter r(1 ± g).
fn grazed(rng: &mut Rng, distance: f64) -> Case {
    let (center, radius) = (if rng.chance(0.5) { DVec3::ZERO } else { rng.in_cube(5.0) }, rng.log(0.1, 10.0));
    let u = rng.unit();
    let impact = radius * (1.0 + rng.sign() * rng.log(1e-16, 1e-4));
    Case::new(
        center + rng.across(u) * impact - u * distance * radius,
        u * rng.length(),
        Solid::Sphere { center, radius },
    )
}

/// Lines that touch exactly once (D = 0), and with the radius moved by `n` floats.
fn tangent(rng: &mut Rng, i: usize, n: i64) -> Case {
    let (o, d, r) = match i % 4 {
        0 => (DVec3::new(3.0, 4.0, -7.0), DVec3::Z, 5.0),
        1 => (DVec3::new(5.0, 12.0, -1e3), 3.0 * DVec3::Z, 13.0),
        2 => (DVec3::new(1.0, 2.0, 2.0), DVec3::new(2.0, -1.0, 0.0), 3.0),
        // p·d = 0 and |p|² = 49: through p from p − d·λ, λ dyadic.
        _ => {
            let (p, d) = (DVec3::new(2.0, 3.0, 6.0), DVec3::new(3.0, 6.0, -4.0));
            (p - d * rng.eighths(9), d, 7.0)
        }
    };
    let s = 2f64.powi(rng.integer(-8, 8) as i32);
    let shift = rng.small(9) * s;
    let flip = rng.sign();
    let solid = Solid::Sphere { center: shift, radius: nudged(r * s, n) };
    Case { within: truehit::Interval::LINE, ..Case::new(o * s + shift, d * flip, solid) }
}

/// Points whose distance from the origin is an integer.
fn exact_point(i: usize) -> (DVec3, f64) {
    [
        (DVec3::new(3.0, 4.0, 0.0), 5.0),
        (DVec3::new(1.0, -2.0, 2.0), 3.0),
        (DVec3::new(-2.0, 3.0, 6.0), 7.0),
        (DVec3::new(0.0, -5.0, 12.0), 13.0),
        (DVec3::new(0.0, 0.0, 1.0), 1.0),
        (DVec3::new(4.0, 4.0, -7.0), 9.0),
    ][i % 6]
}

fn on_surface(rng: &mut Rng, n: i64) -> Case {
    let (center, radius) = (if rng.chance(0.5) { DVec3::ZERO } else { rng.in_cube(5.0) }, rng.log(0.1, 10.0));
    let origin = nudged_each(center + rng.unit() * radius, n, rng);
    Case::new(origin, rng.unit() * rng.length(), Solid::Sphere { center, radius })
}
