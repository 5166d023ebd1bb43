//! The cone, whole and truncated.

use super::frustum::{Frustum, shape_by_frustum};
use super::patch::Patch;
use crate::InvalidShape;
use glam::DVec3;

/// The solid cone or truncated cone between two points, with its caps: closed and convex.
///
/// A line meets it where it enters and where it leaves; touching is a hit, the apex too, and from inside, the exit
/// counts. Hit or miss is decided exactly, λ is within 4 ulp of the exact λ, and `Hit::error` bounds it:
/// [`kernel::frustum::intersect`](crate::kernel::frustum::intersect), which also says what `Hit::part` is. Texture
/// coordinates are angle over 2π and height from 0 (base) to 1 (top) on the wall, and planar on the caps.
///
/// ```
/// use truehit::{Cone, Interval, Ray, Shape};
/// let hat = Cone::new([0.0; 3], [0.0, 0.0, 2.0], 1.0)?;
/// let hit = hat.intersect(&Ray::new([5.0, 0.0, 1.0], [-1.0, 0.0, 0.0]), Interval::FORWARD).unwrap();
/// assert_eq!(hit.lambda, 4.5);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone(Frustum);

impl Cone {
    /// The cone with a circle of `radius` around `base` and its tip at `apex`.
    ///
    /// # Errors
    /// If a number is not finite, the radius not above zero, or the points are equal.
    pub fn new(base: impl Into<DVec3>, apex: impl Into<DVec3>, radius: f64) -> Result<Self, InvalidShape> {
        if radius <= 0.0 {
            return Err(InvalidShape::NotPositive { field: "radius", value: radius });
        }
        Frustum::new(base.into(), apex.into(), radius, 0.0, ["base", "apex", "radius", "radius"]).map(Self)
    }

    /// The truncated cone from a circle of `base_radius` around `base` to one of `top_radius` around `top`. Equal radii
    /// make a cylinder, one zero radius a cone.
    ///
    /// # Errors
    /// If a number is not finite, a radius negative or both zero, or the points are equal.
    pub fn truncated(
        base: impl Into<DVec3>,
        top: impl Into<DVec3>,
        base_radius: f64,
        top_radius: f64,
    ) -> Result<Self, InvalidShape> {
        let names = ["base", "top", "base_radius", "top_radius"];
        Frustum::new(base.into(), top.into(), base_radius, top_radius, names).map(Self)
    }

    /// The centre of its base cap.
    #[must_use]
    pub fn base(&self) -> DVec3 {
        self.0.base
    }

    /// The centre of its top cap, or its apex.
    #[must_use]
    pub fn top(&self) -> DVec3 {
        self.0.top
    }

    /// Its radius at the base.
    #[must_use]
    pub fn base_radius(&self) -> f64 {
        self.0.base_radius
    }

    /// Its radius at the top.
    #[must_use]
    pub fn top_radius(&self) -> f64 {
        self.0.top_radius
    }

    /// Half the gradient of the wall's implicit form, the squared distance from the axis less the squared radius
    /// there: outward, not of unit length, zero at an apex.
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

shape_by_frustum!(Cone);
