//! A curved surface in its explicit form.

use glam::DVec3;

/// A point s(α, β) of a curved surface with its tangents ∂s/∂α and ∂s/∂β, neither of unit length.
///
/// Their cross product is the outward normal, as the gradient of the implicit form is; at a pole or an apex it
/// vanishes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// s(α, β).
    pub point: DVec3,
    /// ∂s/∂α, around the axis.
    pub around: DVec3,
    /// ∂s/∂β, along the axis.
    pub along: DVec3,
}

impl Patch {
    /// ∂s/∂α × ∂s/∂β: outward, not of unit length.
    ///
    /// ```
    /// use truehit::Sphere;
    /// let patch = Sphere::UNIT.patch(0.3, 0.4);
    /// let gradient = Sphere::UNIT.gradient(patch.point);
    /// assert!(patch.normal().normalize().dot(gradient.normalize()) > 1.0 - 1e-15);
    /// ```
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.around.cross(self.along)
    }
}
