//! The cylinder.

use super::frustum::{Frustum, shape_by_frustum};
use super::patch::Patch;
use crate::InvalidShape;
use glam::DVec3;

/// The solid cylinder between two points, with its caps: closed and convex.
///
/// A line meets it where it enters and where it leaves; touching is a hit, and from inside, the exit counts. Hit or
/// miss is decided exactly, λ is within 4 ulp of the exact λ, and `Hit::error` bounds it:
/// [`kernel::frustum::intersect`](crate::kernel::frustum::intersect), which also says what `Hit::part` is. Texture
/// coordinates are angle over 2π and height from 0 (base) to 1 (top) on the wall, and planar on the caps.
///
/// ```
/// use truehit::{Cylinder, Interval, Ray, Shape};
/// let can = Cylinder::new([0.0; 3], [0.0, 0.0, 2.0], 1.0)?;
/// let hit = can.intersect(&Ray::new([5.0, 0.0, 1.0], [-1.0, 0.0, 0.0]), Interval::FORWARD).unwrap();
/// assert_eq!(hit.lambda, 4.0);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder(Frustum);

impl Cylinder {
    /// The cylinder of `radius` around the segment from `base` to `top`.
    ///
    /// # Errors
    /// If a number is not finite, the radius not above zero, or the points are equal.
    pub fn new(base: impl Into<DVec3>, top: impl Into<DVec3>, radius: f64) -> Result<Self, InvalidShape> {
        if radius <= 0.0 {
            return Err(InvalidShape::NotPositive { field: "radius", value: radius });
        }
        let names = ["base", "top", "radius", "radius"];
        Frustum::new(base.into(), top.into(), radius, radius, names).map(Self)
    }

    /// The centre of its base cap.
    #[must_use]
    pub fn base(&self) -> DVec3 {
        self.0.base
    }

    /// The centre of its top cap.
    #[must_use]
    pub fn top(&self) -> DVec3 {
        self.0.top
    }

    /// Its radius.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.0.base_radius
    }

    /// Half the gradient of the wall's implicit form, the squared distance from the axis less the squared radius:
    /// outward, not of unit length.
    #[must_use]
    pub fn gradient(&self, point: DVec3) -> DVec3 {
        self.0.gradient(point)
    }

    /// The wall's explicit form: the point at `angle` (radians) and `height` (0 at the base, 1 at the top).
    #[must_use]
    pub fn patch(&self, angle: f64, height: f64) -> Patch {
        self.0.patch(angle, height)
    }
}

shape_by_frustum!(Cylinder);
