use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::{Rng, nudged, nudged_each};
use super::shared_families;
use truehit::Interval;
use truehit::glam::DVec3;

const fn plane(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Plane, number, name, generate)
}

const fn triangle(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Triangle, number, name, generate)
}

const OWN_PLANE: [Family; 5] = [
    plane(7, "met at 1e-3..1e-15 rad", |rng, _| {
        let (point, n) = (rng.in_cube(5.0), rng.unit());
        let slant = rng.across(n) + n * rng.log(1e-15, 1e-3) * rng.sign();
        Case {
            within: Interval::LINE,
            ..Case::new(rng.in_cube(8.0), slant * rng.length(), Solid::Plane { point, normal: n * rng.length() })
        }
    }),
    plane(8, "ray in the plane or beside it", |rng, i| {
        // n·d = 0 exactly.
        let (n, d) = (DVec3::new(1.0, -2.0, 2.0), DVec3::new(2.0, 3.0, 2.0));
        let point = rng.small(9);
        let off = if i.is_multiple_of(2) { DVec3::ZERO } else { rng.small(1) };
        Case {
            within: Interval::LINE,
            ..Case::new(point + d * rng.eighths(4) + off, d, Solid::Plane { point, normal: n })
        }
    }),
    plane(13, "from 1e6, 1e12", |rng, _| {
        let (target, distance) = (rng.in_cube(5.0), rng.pick(&[1e6, 1e12]));
        let solid = Solid::Plane { point: rng.in_cube(5.0), normal: rng.unit() };
        super::towards(rng, target, distance, solid)
    }),
    plane(24, "origin within 2 ulp, |d| 1e2..1e8", |rng, _| {
        let (point, n) = (rng.in_cube(5.0), rng.unit());
        let origin = nudged_each(point + rng.across(n) * rng.uniform(0.0, 5.0), 2, rng);
        Case {
            within: Interval::LINE,
            ..Case::new(origin, rng.unit() * rng.log(1e2, 1e8), Solid::Plane { point, normal: n })
        }
    }),
    plane(29, "n·d = ± the smallest subnormal", |rng, _| {
        let tiny = f64::from_bits(1) * rng.sign();
        let normal = DVec3::new(0.0, 0.0, tiny);
        let (x, y) = (rng.eighths(9), rng.eighths(9));
        let point = DVec3::new(0.0, 0.0, rng.eighths(9) * 2f64.powi(-1060));
        let z = rng.eighths(9) * 2f64.powi(-1060);
        Case {
            within: Interval::LINE,
            ..Case::new(
                DVec3::new(x, y, z),
                DVec3::new(rng.eighths(3), 1.0, rng.sign()),
                Solid::Plane { point, normal },
            )
        }
    }),
];
pub fn planes() -> Vec<Family> {
    [&OWN_PLANE[..], &shared_families!(Kernel::Plane, super::flat::ordinary_plane)].concat()
}

const OWN_TRIANGLE: [Family; 20] = [
    triangle(7, "met at 1e-3..1e-10 rad", |rng, _| grazing(rng, 1.0)),
    triangle(8, "ray in its plane", |rng, _| {
        let (solid, [a, b, c]) = exact(rng);
        // Weights of few bits: exactly in the plane.
        let at = |rng: &mut Rng| a + (b - a) * rng.eighths(2) + (c - a) * rng.eighths(2);
        let (o, p) = (at(rng), at(rng));
        let d = if o == p { b - a } else { p - o };
        Case { within: Interval::LINE, ..Case::new(o, d, solid) }
    }),
    triangle(9, "along an edge", |rng, i| {
        let (solid, v) = if i.is_multiple_of(2) { exact(rng) } else { random(rng) };
        let (a, b) = (v[i % 3], v[(i + 1) % 3]);
        let o = a - (b - a) * 2.0;
        Case { within: Interval::LINE, ..Case::new(o, b - a, solid) }
    }),
    triangle(13, "unit triangle from 1e6, 1e12", |rng, _| {
        let (solid, v) = random(rng);
        let (target, distance) = (around(rng, &v), rng.pick(&[1e6, 1e12]));
        super::towards(rng, target, distance, solid)
    }),
    triangle(23, "legs 2e-4, centroid, d = z", |rng, _| {
        let s = 2e-4 * 2f64.powi(rng.integer(-40, 3) as i32);
        let v = [DVec3::ZERO, DVec3::new(s, 0.0, 0.0), DVec3::new(0.0, s, 0.0)];
        let o = DVec3::new(s / 3.0, s / 3.0, -rng.uniform(0.5, 2.0));
        Case::new(o, DVec3::Z, Solid::Triangle(v))
    }),
    triangle(24, "origin within 2 ulp of its plane", |rng, _| {
        let (solid, v) = random(rng);
        let inside = around(rng, &v);
        let origin = nudged_each(inside, 2, rng);
        Case { within: Interval::LINE, ..Case::new(origin, rng.unit() * rng.log(1e2, 1e8), solid) }
    }),
    triangle(31, "exactly at a point of an edge", |rng, i| {
        let (solid, v) = exact(rng);
        let (a, b) = (v[i % 3], v[(i + 1) % 3]);
        let target = a + (b - a) * rng.pick(&[0.25, 0.5, 0.75]);
        super::exactly_towards(rng, target, solid)
    }),
    triangle(32, "at a rounded point of an edge", |rng, i| {
        let (solid, v) = random(rng);
        let target = v[i % 3].lerp(v[(i + 1) % 3], rng.uniform(-0.05, 1.05));
        let distance = rng.log(0.1, 1e3);
        super::towards(rng, target, distance, solid)
    }),
    triangle(33, "exactly at a vertex", |rng, i| {
        let (solid, v) = exact(rng);
        super::exactly_towards(rng, v[i % 3], solid)
    }),
    triangle(37, "quad diagonal", |rng, i| {
        let q = [
            DVec3::new(-1.0, -1.0, 0.0),
            DVec3::new(1.0, -1.0, 0.0),
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(-1.0, 1.0, 0.0),
        ];
        let s = if i < 2 { 0.304_584_47 } else { rng.uniform(0.0, 0.6) };
        let v = if i.is_multiple_of(2) { [q[0], q[1], q[2]] } else { [q[0], q[2], q[3]] };
        Case::new(DVec3::new(0.0, 0.0, 10.0), DVec3::new(s, s, -0.902_472_5), Solid::Triangle(v))
    }),
    triangle(39, "far sphere mesh, at its vertices", |rng, i| {
        let center = DVec3::new(148_376.0, 1234.0, -223_423.0);
        let u = rng.unit();
        let mut v = [u, u + 0.1 * rng.across(u), u + 0.1 * rng.across(u)].map(|p| center + p.normalize());
        v.rotate_left(i % 3);
        let distance = rng.log(1.0, 1e6);
        let target = v[0];
        super::towards(rng, target, distance, Solid::Triangle(v))
    }),
    triangle(40, "aspect 1e-3..1e-9", |rng, _| sliver(rng, false)),
    triangle(41, "slivers met grazing", |rng, _| sliver(rng, true)),
    triangle(42, "collinear vertices", |rng, i| {
        let (a, u) = (rng.small(3), if i.is_multiple_of(2) { rng.small(2) } else { DVec3::X });
        let v = [a, a + u * rng.eighths(2), a + u * rng.eighths(2)];
        let target = a + u * rng.eighths(1);
        super::exactly_towards(rng, target, Solid::Triangle(v))
    }),
    triangle(43, "two equal vertices", |rng, i| {
        let (_, mut v) = random(rng);
        v[i % 3] = v[(i + 1) % 3];
        let target = around(rng, &v);
        super::towards(rng, target, 3.0, Solid::Triangle(v))
    }),
    triangle(44, "three equal vertices", |rng, _| {
        let p = rng.small(5);
        super::exactly_towards(rng, p, Solid::Triangle([p; 3]))
    }),
    triangle(45, "area underflows", |rng, _| {
        let (_, v) = random(rng);
        let k = 2f64.powi(rng.integer(-560, -530) as i32);
        let v = v.map(|p| p * k);
        let target = around(rng, &v);
        let u = rng.unit();
        Case::new(target - u * k * 4.0, u * rng.length(), Solid::Triangle(v))
    }),
    triangle(53, "origin on a vertex, an edge, inside", |rng, i| {
        let (solid, [a, b, c]) = exact(rng);
        let origin = match i % 3 {
            0 => a,
            1 => a + (b - a) * 0.25,
            _ => a + (b - a) * 0.25 + (c - a) * 0.5,
        };
        Case { within: Interval::LINE, ..Case::new(origin, rng.unit() * rng.length(), solid) }
    }),
    triangle(86, "flat, axis-aligned, near its own box's edge", |rng, i| {
        let z = rng.eighths(4);
        let p = |rng: &mut Rng| DVec3::new(rng.eighths(3), rng.eighths(3), z);
        let v = [p(rng), p(rng), p(rng)];
        // A slope of few bits: exactly through the vertex.
        let d = DVec3::new(rng.eighths(2), rng.eighths(2), rng.sign() * 2f64.powi(-rng.integer(0, 40) as i32));
        Case::new(v[i % 3] - d * 2.0, d, Solid::Triangle(v))
    }),
    triangle(88, "one ulp beside an edge or vertex", |rng, i| {
        let (solid, v) = exact(rng);
        let target = v[i % 3].lerp(v[(i + 1) % 3], rng.pick(&[0.0, 0.25, 0.5, 0.75]));
        let mut case = super::exactly_towards(rng, target, solid);
        case.ray.origin.x = nudged(case.ray.origin.x, rng.sign() as i64);
        case
    }),
];
pub fn triangles() -> Vec<Family> {
    [&OWN_TRIANGLE[..], &shared_families!(Kernel::Triangle, super::flat::ordinary_triangle)].concat()
}

pub fn ordinary_plane(rng: &mut Rng, _: usize) -> Case {
    // The half of the lines that look away misses.
    Case::new(
        rng.in_cube(8.0),
        rng.unit() * rng.length(),
        Solid::Plane { point: rng.in_cube(5.0), normal: rng.unit() * rng.length() },
    )
}

pub fn ordinary_triangle(rng: &mut Rng, _: usize) -> Case {
    let (solid, v) = random(rng);
    let (target, distance) = (around(rng, &v), rng.uniform(1.0, 10.0));
    super::towards(rng, target, distance, solid)
}

fn random(rng: &mut Rng) -> (Solid, [DVec3; 3]) {
    let c = rng.in_cube(3.0);
    let size = rng.log(0.3, 3.0);
    loop {
        let v = [c + rng.unit() * size, c + rng.unit() * size, c + rng.unit() * size];
        let area = (v[1] - v[0]).cross(v[2] - v[0]).length();
        if area > 0.2 * size * size {
            return (Solid::Triangle(v), v);
        }
    }
}

/// Vertices of few bits.
fn exact(rng: &mut Rng) -> (Solid, [DVec3; 3]) {
    loop {
        let v = [rng.small(4), rng.small(4), rng.small(4)];
        if (v[1] - v[0]).cross(v[2] - v[0]) != DVec3::ZERO {
            return (Solid::Triangle(v), v);
        }
    }
}

/// A point of the plane, in the triangle half of the time.
fn around(rng: &mut Rng, v: &[DVec3; 3]) -> DVec3 {
    let (mut a, mut b) = (rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0));
    if rng.chance(0.5) {
        (a, b) = (a.min(b), a.max(b) - a.min(b));
    } else {
        (a, b) = (a * 1.5 - 0.25, b * 1.5 - 0.25);
    }
    v[0] + (v[1] - v[0]) * a + (v[2] - v[0]) * b
}

fn grazing(rng: &mut Rng, size: f64) -> Case {
    let (solid, v) = random(rng);
    let n = (v[1] - v[0]).cross(v[2] - v[0]).normalize();
    let u = rng.across(n) + n * rng.log(1e-10, 1e-3) * rng.sign();
    let target = around(rng, &v);
    Case::new(target - u * size * rng.uniform(1.0, 5.0), u * rng.length(), solid)
}

fn sliver(rng: &mut Rng, grazing: bool) -> Case {
    let (a, u) = (rng.in_cube(3.0), rng.unit());
    let w = rng.across(u) * rng.log(1e-9, 1e-3);
    let v = [a, a + u, a + u * rng.uniform(0.0, 1.0) + w];
    let target = around(rng, &v);
    let mut case = super::towards(rng, target, 3.0, Solid::Triangle(v));
    if grazing {
        let n = u.cross(w).normalize();
        let d = rng.across(n) + n * rng.log(1e-10, 1e-3) * rng.sign();
        case.ray = truehit::Ray { origin: target - d * 3.0, direction: d * rng.length() };
    }
    case
}
