//! How large vectors and matrices are: bounds that no rounding undercuts.

use super::bound::U;
use super::float::{exponent_of, ldexp};
use glam::{DMat3, DVec3};

/// At least |Mv|/|v| for every v, exact but for rounding where M turns and scales along its own axes: ‖M‖² is at most the
/// largest absolute row sum of MᵀM.
pub(crate) fn largest_stretch(m: &DMat3) -> f64 {
    let largest = m.to_cols_array().iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let k = -exponent_of(largest);
    let m = DMat3::from_cols_array(&m.to_cols_array().map(|x| ldexp(x, k)));
    let gram = m.transpose() * m;
    let rows = gram.x_axis.abs() + gram.y_axis.abs() + gram.z_axis.abs();
    ldexp((rows.max_element() * (1.0 + 64.0 * U)).sqrt() * (1.0 + 4.0 * U), -k)
}

/// |v|₁ ≥ |v|.
#[inline(always)]
pub(crate) fn taxicab(v: DVec3) -> f64 {
    v.abs().element_sum()
}
