//! How far an answer is from the truth.

use super::big::{Big, Enclosure};
use super::cases::{Case, Solid};
use truehit::Hit;
use truehit::glam::DVec3;

/// A hit against the truth.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// |λ − exact λ| in ulps of max(|λ|, 2⁻⁴⁰·s).
    pub ulps: f64,
    /// The bound does not hold.
    pub violated: bool,
    /// bound / |λ − exact λ|: 1 is as tight as can be, ∞ where λ is exact.
    pub tightness: f64,
}

pub fn measure(hit: &Hit, exact: &Enclosure, scale: f64) -> Measure {
    let size = exact.to_f64().abs();
    if !hit.lambda.is_finite() || size.is_infinite() {
        // An exact λ beyond the largest float has no float near it: the largest or ∞ will do, with no bound.
        let right = size.is_infinite() && hit.lambda.abs() >= f64::MAX && hit.error == f64::INFINITY;
        return Measure {
            ulps: if right { 0.0 } else { f64::INFINITY },
            violated: hit.error != f64::INFINITY,
            tightness: f64::INFINITY,
        };
    }
    let error = exact.minus(&Big::from(hit.lambda)).abs();
    let violated = hit.error.is_nan() || (hit.error.is_finite() && error.lo.cmp(&Big::from(hit.error)).is_gt());
    let off = error.hi.to_f64();
    let ulp = ulp(size.max(scale * 2f64.powi(-40)));
    // Both may be near the bottom of the range.
    Measure { ulps: off / ulp, violated, tightness: if off == 0.0 { f64::INFINITY } else { hit.error / off } }
}

/// The spacing of floats at |x|.
pub fn ulp(x: f64) -> f64 {
    let x = x.abs().min(f64::MAX);
    let field = (x.to_bits() >> 52).max(1);
    // 2^(field − 1023 − 52), which may be subnormal.
    if field > 52 { f64::from_bits((field - 52) << 52) } else { f64::from_bits(1 << (field - 1)) }
}

/// s: the largest coordinate of origin and shape over the direction's length.
pub fn scale(case: &Case) -> f64 {
    fn extent(solid: &Solid) -> f64 {
        let largest = |points: &[DVec3]| points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        match solid {
            Solid::Plane { point, .. } => largest(&[*point]),
            Solid::Triangle(v) => largest(v),
            Solid::Polygon(contours) => contours.iter().map(|c| largest(c)).fold(0.0, f64::max),
            Solid::Sphere { center, radius } => largest(&[*center]).max(*radius),
            Solid::Frustum { base, top, base_radius, top_radius } => {
                largest(&[*base, *top]).max(*base_radius).max(*top_radius)
            }
            Solid::Slab { min, max } => largest(&[*min, *max]),
            Solid::Mesh { positions, .. } => largest(positions),
            // In the world: where the object's points come to lie.
            Solid::Affine { world_from_object, inner, .. } => {
                let m = world_from_object.matrix3;
                largest(&[world_from_object.translation])
                    + extent(inner) * [m.x_axis, m.y_axis, m.z_axis].map(|c| c.abs().max_element()).iter().sum::<f64>()
            }
        }
    }
    let d = case.ray.direction;
    let largest = d.abs().max_element();
    let length = (d / largest).length();
    let coordinates = case.ray.origin.abs().max_element().max(extent(&case.solid));
    coordinates / largest / length
}
