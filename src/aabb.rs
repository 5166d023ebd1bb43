//! Axis-aligned boxes.

use glam::{DAffine3, DVec3};

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

    /// A box around the images of `points` under `map`: little larger than rounding makes necessary, the entries of the
    /// map taken to be rounded too; everything, if one of them overflows.
    #[must_use]
    pub fn around_images(points: &[DVec3], map: &DAffine3) -> Self {
        let (m, t) = (map.matrix3, map.translation);
        points.iter().fold(Self::EMPTY, |b, p| {
            let size = m.x_axis.abs() * p.x.abs() + m.y_axis.abs() * p.y.abs() + m.z_axis.abs() * p.z.abs() + t.abs();
            // One rounding of the entry, one of the product, three of the sum; the rest is for this line.
            let off = size * (4.0 * f64::EPSILON) + DVec3::splat(f64::MIN_POSITIVE);
            let image = m * *p + t;
            b.union(Self { min: image - off, max: image + off }.or_everything())
        })
    }

    /// A box around this one's image under `map`; everything, if this one is not finite.
    #[must_use]
    pub fn image(self, map: &DAffine3) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        if !self.is_finite() {
            return Self::EVERYTHING;
        }
        // Each term of a coordinate is least at one end of its side; rounding as for points.
        let (m, t) = (map.matrix3, map.translation);
        let most = self.min.abs().max(self.max.abs());
        let size = m.x_axis.abs() * most.x + m.y_axis.abs() * most.y + m.z_axis.abs() * most.z + t.abs();
        let off = size * (4.0 * f64::EPSILON) + DVec3::splat(f64::MIN_POSITIVE);
        let (x, u) = (m.x_axis * self.min.x, m.x_axis * self.max.x);
        let (y, v) = (m.y_axis * self.min.y, m.y_axis * self.max.y);
        let (z, w) = (m.z_axis * self.min.z, m.z_axis * self.max.z);
        let image =
            Self { min: x.min(u) + y.min(v) + z.min(w) + t - off, max: x.max(u) + y.max(v) + z.max(w) + t + off };
        image.or_everything()
    }

    /// Everything instead of what overflow has left unknown.
    fn or_everything(self) -> Self {
        if self.min.is_nan() || self.max.is_nan() { Self::EVERYTHING } else { self }
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
