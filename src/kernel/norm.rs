//! How large vectors and matrices are: bounds that no rounding undercuts.

use super::bound::U;
use super::float::{exponent_of, ldexp, power};
use glam::{DMat3, DVec3};

/// At least |Mv|/|v| for every v, exact but for rounding where M turns and scales along its own axes: ‖M‖² is at most
/// the largest absolute row sum of MᵀM.
pub(crate) fn largest_stretch(m: &DMat3) -> f64 {
    let largest = m.to_cols_array().iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    if (power(-200)..power(200)).contains(&largest) {
        return stretch(m);
    }
    let k = -exponent_of(largest);
    ldexp(stretch(&DMat3::from_cols_array(&m.to_cols_array().map(|x| ldexp(x, k)))), -k)
}

/// The same where squares stay in range.
fn stretch(m: &DMat3) -> f64 {
    let gram = m.transpose() * *m;
    let rows = gram.x_axis.abs() + gram.y_axis.abs() + gram.z_axis.abs();
    (rows.max_element() * (1.0 + 64.0 * U)).sqrt() * (1.0 + 4.0 * U)
}

/// |v|₁ ≥ |v|.
#[inline(always)]
pub(crate) fn taxicab(v: DVec3) -> f64 {
    v.abs().element_sum()
}
