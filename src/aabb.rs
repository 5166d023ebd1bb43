//! Axis-aligned boxes.

use glam::DVec3;

/// A closed axis-aligned box; flat and single-point boxes are boxes too. Infinite limits are legal: a plane's box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The least coordinates.
    pub min: DVec3,
    /// The greatest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The box that holds nothing, neutral for [`union`](Self::union).
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
    /// The box that holds everything.
    pub const EVERYTHING: Self = Self { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };

    /// The box between two corners.
    #[inline]
    pub fn new(min: impl Into<DVec3>, max: impl Into<DVec3>) -> Self {
        Self { min: min.into(), max: max.into() }
    }

    /// The smallest box around `points`; [`EMPTY`](Self::EMPTY) for none.
    #[must_use]
    pub fn around(points: &[DVec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| b.union(Self { min: p, max: p }))
    }

    /// The smallest box around both.
    #[inline]
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether it holds nothing: a lower limit above its upper one, or a NaN.
    #[inline]
    #[must_use]
    pub fn is_empty(self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether all limits are finite.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// Whether `point` is inside or on the boundary.
    #[inline]
    #[must_use]
    pub fn contains(self, point: DVec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// The middle.
    #[inline]
    #[must_use]
    pub fn center(self) -> DVec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// max − min.
    #[inline]
    #[must_use]
    pub fn size(self) -> DVec3 {
        self.max - self.min
    }
}
