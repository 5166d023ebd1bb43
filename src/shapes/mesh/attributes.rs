//! What is interpolated over a triangle.

use crate::kernel::bound::U;
use crate::kernel::float::unit;
use glam::{DVec2, DVec3};

/// The three barycentric weights, none negative.
#[inline]
pub(super) fn weights(uv: DVec2) -> [f64; 3] {
    [(1.0 - uv.x - uv.y).max(0.0), uv.x, uv.y]
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
    unit(sum)
}
