//! A ray: where it starts, which way it goes.

use glam::DVec3;

/// The ray r(λ) = `origin` + λ·`direction`.
///
/// The direction has any non-zero length: λ is measured in units of it, so that an affine map of the ray leaves λ as
/// it is. A ray with a NaN or infinite component, or with a zero direction, misses everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where λ = 0.
    pub origin: DVec3,
    /// The step for one unit of λ; any non-zero length.
    pub direction: DVec3,
}

impl Ray {
    /// The ray from `origin` along `direction`; plain arrays are taken too.
    ///
    /// ```
    /// use truehit::Ray;
    /// let ray = Ray::new([0.0, 0.0, 5.0], [0.0, 0.0, -2.0]);
    /// assert_eq!(ray.at(2.0), truehit::glam::DVec3::new(0.0, 0.0, 1.0));
    /// ```
    #[inline]
    pub fn new(origin: impl Into<DVec3>, direction: impl Into<DVec3>) -> Self {
        Self { origin: origin.into(), direction: direction.into() }
    }

    /// The point at `lambda`, rounded: off by up to a few ulps of the larger of the origin and the step. A hit's point
    /// on its surface, with a bound, comes from [`Shape::point`](crate::Shape::point).
    #[inline]
    #[must_use]
    pub fn at(&self, lambda: f64) -> DVec3 {
        self.origin + lambda * self.direction
    }

    /// Whether every component is finite and the direction is not zero.
    #[inline]
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.origin.is_finite() && self.direction.is_finite() && self.direction != DVec3::ZERO
    }
}
