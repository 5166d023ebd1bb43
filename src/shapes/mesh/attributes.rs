//! What is asked of the closest hit only: point, normals, weights.

use crate::SurfacePoint;
use crate::kernel::bound::U;
use crate::kernel::bounded::Bounded;
use crate::kernel::dyadic::Dyadic;
use crate::kernel::number::{Number, cross, difference};
use crate::kernel::scaled::Scaled;
use glam::{DVec2, DVec3};

/// The three barycentric weights, none negative.
#[inline]
pub(super) fn weights(uv: DVec2) -> [f64; 3] {
    [(1.0 - uv.x - uv.y).max(0.0), uv.x, uv.y]
}

/// The unit normal (b − a) × (c − a), right for slivers and at any size; zero for a degenerate triangle, which no ray
/// hits.
pub(super) fn face_normal(&[a, b, c]: &[DVec3; 3]) -> DVec3 {
    fn normal<N: Number>(a: DVec3, b: DVec3, c: DVec3) -> ([Scaled; 3], bool) {
        let n = cross::<N>(&difference(b, a), &difference(c, a)).map(|x| x.rounded());
        // A component that is lost in its own bound matters if it is not small beside another that is certain.
        (n.map(|(x, _)| x), n.iter().all(|&(_, relative)| relative < U))
    }
    let (e1, e2) = (b - a, c - a);
    let n = e1.cross(e2);
    let size = n.abs().max_element();
    // Each component: 2u from the edges, 2u from products and difference, of |e1||e2| twice.
    let terms = e1.abs().max_element() * e2.abs().max_element();
    if size > 1e-6 * terms && size > 1e-250 && size < 1e250 {
        // Off by at most 8u·10⁶ relative: well below what shading sees, but not below what a mirror does at a sliver.
        if size > 0.1 * terms {
            return (n / size).normalize();
        }
    }
    let (mut n, certain) = normal::<Bounded>(a, b, c);
    if !certain {
        n = normal::<Dyadic>(a, b, c).0;
    }
    let largest = n.iter().fold(Scaled::ZERO, |m, x| if x.abs().minus(m).is_negative() { m } else { x.abs() });
    if largest.is_zero() {
        return DVec3::ZERO;
    }
    DVec3::from(n.map(|x| x.over(largest).to_f64().0)).normalize()
}

/// The interpolated normal as a unit vector; `None` where the corners' normals cancel.
pub(super) fn blended_normal(corners: &[DVec3; 3], uv: DVec2) -> Option<DVec3> {
    let size = corners.iter().fold(0.0f64, |m, n| m.max(n.abs().max_element()));
    if size == 0.0 {
        return None;
    }
    // Scaled first: squares of any length a normal may have would leave the range.
    let [wa, wb, wc] = weights(uv);
    let sum = wa * (corners[0] / size) + wb * (corners[1] / size) + wc * (corners[2] / size);
    // What is left of normals that cancel is their rounding.
    if sum.abs().max_element() <= 64.0 * U {
        return None;
    }
    (sum / sum.abs().max_element()).try_normalize()
}

/// The point with weights `uv`, and how far off the triangle's plane rounding may have put it.
pub(super) fn point(&[a, b, c]: &[DVec3; 3], uv: DVec2) -> SurfacePoint {
    let (e1, e2) = (b - a, c - a);
    let step = uv.x * e1 + uv.y * e2;
    let position = a + step;
    // Per coordinate: u for the edges, u for the products, u for their sum, u for the last sum; the weights
    // themselves are off by a few u, which moves the point along the plane. √3 for three coordinates.
    let size = uv.x * e1.abs() + uv.y * e2.abs();
    let error = 2.0 * U * (position.abs() + 12.0 * size).max_element() + f64::MIN_POSITIVE;
    SurfacePoint { position, error }
}
