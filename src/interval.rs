//! The stretch of a ray that counts.

/// The open interval `min` < λ < `max` of a ray that counts.
///
/// Both limits are compared with the exact λ, not with the rounded one. A negative `min` is legal. An interval with a
/// NaN limit, or with `min ≥ max`, holds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower limit, itself outside.
    pub min: f64,
    /// The upper limit, itself outside.
    pub max: f64,
}

impl Interval {
    /// Everything in front of the origin: (0, ∞).
    pub const FORWARD: Self = Self { min: 0.0, max: f64::INFINITY };
    /// The whole line: (−∞, ∞).
    pub const LINE: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };

    /// The open interval from `min` to `max`.
    #[inline]
    #[must_use]
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    /// Whether no λ lies inside.
    #[inline]
    #[must_use]
    pub fn is_empty(self) -> bool {
        // A NaN limit compares as nothing, which makes it empty.
        self.min.partial_cmp(&self.max) != Some(std::cmp::Ordering::Less)
    }
}
