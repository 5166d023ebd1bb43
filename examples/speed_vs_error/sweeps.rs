//! Rays along one parameter: distance, grazing angle, scale.

use crate::kernels::Entry;
use crate::rows::Sheet;
use crate::support::cases::{Case, Kernel, Solid};
use crate::support::measure;
use crate::support::rng::Rng;
use truehit::glam::DVec3;

/// A shape of about unit size in a direction of its own, scaled.
fn solid(kernel: Kernel, scale: f64, rng: &mut Rng) -> Solid {
    let axis = rng.unit();
    match kernel {
        Kernel::Sphere => Solid::Sphere { center: rng.in_cube(0.5) * scale, radius: scale },
        Kernel::Triangle => {
            let (u, v) = (rng.across(axis), rng.unit());
            Solid::Triangle([u * scale, (axis - u) * scale, (v - axis) * scale])
        }
        Kernel::Cylinder => {
            Solid::Frustum { base: -axis * scale, top: axis * scale, base_radius: scale, top_radius: scale }
        }
        _ => Solid::Frustum { base: -axis * scale, top: axis * scale, base_radius: scale, top_radius: 0.0 },
    }
}

/// A point of the shape, or near it for `spread` above 1.
fn target(solid: &Solid, spread: f64, rng: &mut Rng) -> DVec3 {
    match solid {
        Solid::Sphere { center, radius } => *center + rng.unit() * (*radius * spread * rng.uniform(0.0, 1.0).sqrt()),
        Solid::Triangle([a, b, c]) => {
            let (u, v) = (rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            *a + (*b - *a) * u * spread + (*c - *a) * v * spread
        }
        Solid::Frustum { base, top, base_radius, .. } => {
            let axis = *top - *base;
            let side = rng.across(axis);
            let t = rng.uniform(0.0, 1.0);
            *base + axis * t + side * (*base_radius * spread * (1.0 - t) * rng.uniform(0.0, 1.0))
        }
        _ => unreachable!("not swept"),
    }
}

/// From `distance` (in units of the shape's size) towards the shape.
pub fn from_distance(kernel: Kernel, scale: f64, distance: f64, spread: f64, seed: u64) -> Case {
    let mut rng = Rng::new(seed ^ distance.to_bits() ^ scale.to_bits().rotate_left(7));
    let solid = solid(kernel, scale, &mut rng);
    let target = target(&solid, spread, &mut rng);
    let direction = rng.unit();
    Case::new(target - direction * (distance * scale), direction, solid)
}

/// Meeting the surface at `angle` radians from three units away.
pub fn at_angle(kernel: Kernel, angle: f64, seed: u64) -> Case {
    let mut rng = Rng::new(seed ^ angle.to_bits());
    match kernel {
        Kernel::Triangle => {
            let solid = solid(kernel, 1.0, &mut rng);
            let Solid::Triangle([a, b, c]) = &solid else { unreachable!() };
            let normal = (*b - *a).cross(*c - *a).normalize();
            let along = rng.across(normal);
            let direction = along * angle.cos() + normal * angle.sin();
            let target = target(&solid, 1.0, &mut rng);
            Case::new(target - direction * 3.0, direction, solid)
        }
        kernel => {
            // A tangent of a circle about the axis (or about the centre), lowered to cos(angle) times its radius.
            let solid = solid(kernel, 1.0, &mut rng);
            let (centre, axis) = match &solid {
                Solid::Sphere { center, .. } => (*center, rng.unit()),
                Solid::Frustum { base, top, .. } => ((*base + *top) / 2.0, (*top - *base).normalize()),
                _ => unreachable!(),
            };
            let side = rng.across(axis);
            let direction = axis.cross(side) + axis * rng.uniform(-0.1, 0.1);
            Case::new(centre + side * angle.cos() - direction * 3.0, direction, solid)
        }
    }
}

/// The hits that are hits, the largest error among them in ulps, and the share of wrong decisions.
pub struct Point {
    pub hits: usize,
    pub max: f64,
    pub wrong: f64,
}

/// One kernel over the cases.
pub fn point(entry: &Entry, sheet: &Sheet) -> Point {
    let (mut ulps, mut wrong) = (Vec::new(), 0);
    for (case, exact) in sheet.cases.iter().zip(&sheet.exact) {
        match (exact, entry.answer(case).flatten()) {
            (Some(exact), Some(hit)) => {
                let m = measure::measure(&hit, exact, measure::scale(case));
                ulps.push(if m.ulps.is_nan() { f64::INFINITY } else { m.ulps });
            }
            (None, None) => {}
            _ => wrong += 1,
        }
    }
    let hits = ulps.len();
    let max = ulps.into_iter().reduce(f64::max).unwrap_or(f64::NAN);
    Point { hits, max, wrong: f64::from(wrong) / sheet.cases.len() as f64 }
}
