use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::{Rng, nudged};
use super::shared_families;
use truehit::Interval;
use truehit::glam::DVec3;

const fn family(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Slab, number, name, generate)
}

const OWN: [Family; 8] = [
    family(14, "at offset 64, 1e4, 1e6, at a face, edge, corner", |rng, i| {
        let c = rng.unit() * rng.pick(&[64.0, 1e4, 1e6]);
        let c = (c * 8.0).round() / 8.0;
        let (min, max) = (c, c + rng.small(2).abs() + DVec3::splat(0.125));
        let target = on_boundary(rng, min, max, 1 + i % 3);
        super::exactly_towards(rng, target, Solid::Slab { min, max })
    }),
    family(30, "|d_x| 1e-30..1e-320", |rng, _| {
        let (min, max) = random(rng);
        let target = around(rng, min, max);
        let u = rng.unit();
        let mut d = u * rng.length();
        let mut o = target - u * rng.uniform(0.0, 5.0);
        let axis = rng.below(3) as usize;
        d[axis] = 10f64.powf(rng.uniform(-320.0, -30.0)) * rng.sign();
        o[axis] = rng.pick(&[min[axis], max[axis], target[axis], nudged(min[axis], -1), nudged(max[axis], 1)]);
        Case { within: Interval::LINE, ..Case::new(o, d, Solid::Slab { min, max }) }
    }),
    family(32, "one ulp beside a face, edge, corner", |rng, i| {
        let (min, max) = dyadic(rng);
        let target = on_boundary(rng, min, max, 1 + i % 3);
        let mut case = super::exactly_towards(rng, target, Solid::Slab { min, max });
        let axis = rng.below(3) as usize;
        case.ray.origin[axis] = nudged(case.ray.origin[axis], rng.sign() as i64);
        case
    }),
    family(13, "from 1e4, 1e8, 1e12", |rng, i| {
        let (min, max) = random(rng);
        let (target, distance) = (on_boundary(rng, min, max, i % 4), rng.pick(&[1e4, 1e8, 1e12]));
        super::towards(rng, target, distance, Solid::Slab { min, max })
    }),
    family(59, "origin on a slab plane, d_i = ±0", |rng, i| {
        let (min, max) = dyadic(rng);
        let mut case = Case::new(on_boundary(rng, min, max, 1 + i % 2), rng.small(2), Solid::Slab { min, max });
        let axis = rng.below(3) as usize;
        case.ray.direction[axis] = 0.0 * rng.sign();
        if case.ray.direction == DVec3::ZERO {
            case.ray.direction[(axis + 1) % 3] = rng.sign();
        }
        case
    }),
    family(60, "flat box", |rng, i| {
        let (min, mut max) = dyadic(rng);
        let axis = rng.below(3) as usize;
        max[axis] = min[axis];
        let target = on_boundary(rng, min, max, i % 4);
        super::exactly_towards(rng, target, Solid::Slab { min, max })
    }),
    family(61, "point box", |rng, i| {
        let p = rng.small(8);
        let mut case = super::exactly_towards(rng, p, Solid::Slab { min: p, max: p });
        if i.is_multiple_of(2) {
            case.ray.origin.x = nudged(case.ray.origin.x, rng.integer(-1, 1));
        }
        case
    }),
    family(62, "inverted box", |rng, _| {
        let (max, mut min) = dyadic(rng);
        min.y = max.y + 0.125;
        let target = around(rng, max, min);
        super::exactly_towards(rng, target, Solid::Slab { min, max })
    }),
];
pub fn boxes() -> Vec<Family> {
    [&OWN[..], &shared_families!(Kernel::Slab, super::box_::ordinary)].concat()
}

pub fn ordinary(rng: &mut Rng, _: usize) -> Case {
    let (min, max) = random(rng);
    let (target, distance) = (around(rng, min, max), (max - min).length() * rng.uniform(1.0, 10.0));
    super::towards(rng, target, distance, Solid::Slab { min, max })
}

fn random(rng: &mut Rng) -> (DVec3, DVec3) {
    let (a, b) = (rng.in_cube(4.0), rng.in_cube(4.0));
    (a.min(b), a.max(b))
}

fn dyadic(rng: &mut Rng) -> (DVec3, DVec3) {
    let a = rng.small(4);
    (a, a + rng.small(2).abs() + DVec3::splat(0.125))
}

fn around(rng: &mut Rng, min: DVec3, max: DVec3) -> DVec3 {
    let t = DVec3::new(rng.uniform(-0.2, 1.2), rng.uniform(-0.2, 1.2), rng.uniform(-0.2, 1.2));
    min + (max - min) * t
}

/// A point of the box with that many coordinates on its boundary: inside, face, edge, corner.
fn on_boundary(rng: &mut Rng, min: DVec3, max: DVec3, fixed: usize) -> DVec3 {
    let first = rng.below(3) as usize;
    let mut p = [0.0; 3];
    for (n, axis) in [first, (first + 1) % 3, (first + 2) % 3].into_iter().enumerate() {
        let t = if n < fixed { rng.pick(&[0.0, 1.0]) } else { rng.pick(&[0.25, 0.5, 0.75]) };
        p[axis] = if t == 1.0 { max[axis] } else { min[axis] + (max[axis] - min[axis]) * t };
    }
    p.into()
}
