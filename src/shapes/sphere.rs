//! The sphere.

use super::local::{Local, around};
use super::patch::Patch;
use crate::kernel::bound::U;
use crate::kernel::float::{length, unit};
use crate::kernel::sphere;
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint, Tangent};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// The ball |p − center| ≤ radius: a closed convex solid.
///
/// A line that touches it hits, once; from inside, the exit counts. Hit or miss is decided exactly, λ is within one ulp
/// of the exact λ, and `Hit::error` bounds it: [`kernel::sphere::intersect`](crate::kernel::sphere::intersect).
/// Texture coordinates are longitude (0 at +x, towards +y) and latitude (0 at −z, 1 at +z), each over its range.
///
/// ```
/// use truehit::{Interval, Ray, Shape, Sphere};
/// let ball = Sphere::new([0.0, 0.0, 3.0], 2.0)?;
/// let ray = Ray::new([0.0; 3], [0.0, 0.0, 0.5]);
/// let hit = ball.intersect(&ray, Interval::FORWARD).unwrap();
/// assert_eq!(hit.lambda, 2.0);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    center: DVec3,
    radius: f64,
}

/// Where λ's own error moves a point by more than this part of the radius, λ is asked for to a hundred bits.
const SHARP: f64 = 1.0 / (1u64 << 40) as f64;

impl Sphere {
    /// Radius 1 around the origin.
    pub const UNIT: Self = Self { center: DVec3::ZERO, radius: 1.0 };

    /// The sphere of `radius` around `center`.
    ///
    /// # Errors
    /// If a number is not finite or the radius not above zero.
    pub fn new(center: impl Into<DVec3>, radius: f64) -> Result<Self, InvalidShape> {
        let center = center.into();
        if !center.is_finite() {
            return Err(InvalidShape::NotFinite { field: "center" });
        }
        if !radius.is_finite() {
            return Err(InvalidShape::NotFinite { field: "radius" });
        }
        if radius <= 0.0 {
            return Err(InvalidShape::NotPositive { field: "radius", value: radius });
        }
        Ok(Self { center, radius })
    }

    /// Its centre.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Its radius.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// ∇f for f(p) = |p − center|² − radius²: outward, not of unit length.
    #[must_use]
    pub fn gradient(&self, point: DVec3) -> DVec3 {
        2.0 * (point - self.center)
    }

    /// The explicit form: the point at `longitude` and `latitude`, in radians, with its tangents.
    #[must_use]
    pub fn patch(&self, longitude: f64, latitude: f64) -> Patch {
        let ((sa, ca), (sb, cb)) = (longitude.sin_cos(), latitude.sin_cos());
        let r = self.radius;
        Patch {
            point: self.center + r * DVec3::new(ca * cb, sa * cb, sb),
            around: r * cb * DVec3::new(-sa, ca, 0.0),
            along: r * DVec3::new(-ca * sb, -sa * sb, cb),
        }
    }
}

impl Shape for Sphere {
    #[inline]
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        sphere::intersect(ray, self.center, self.radius, within)
    }

    /// Accurate to a few ulps near the sphere and to 2⁻⁴⁰ from any distance; where the sphere is too small to be told
    /// from a point, against the ray.
    fn normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        let largest = ray.origin.abs().max(self.center.abs()).max_element().max(self.radius);
        let local = Local::new(largest);
        let sharp = hit.error * length(ray.direction) <= SHARP * self.radius;
        let lambda = if sharp { [hit.lambda, 0.0] } else { self.precise_lambda(ray, hit) };
        let against = || unit(-ray.direction).unwrap_or(DVec3::Z);
        unit(local.offset(ray, lambda, self.center)).unwrap_or_else(against)
    }

    fn bounds(&self) -> Aabb {
        let [x, y, z] = self.center.to_array().map(|c| around(c, self.radius));
        Aabb::new([x.0, y.0, z.0], [x.1, y.1, z.1])
    }

    fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
        let n = self.normal(ray, hit);
        let longitude = n.y.atan2(n.x) / TAU;
        DVec2::new(if longitude < 0.0 { longitude + 1.0 } else { longitude }, 0.5 + n.z.clamp(-1.0, 1.0).asin() / PI)
    }

    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.contact(ray, hit).0
    }

    fn tangent(&self, ray: &Ray, hit: &Hit) -> Tangent {
        let curvature = (1.0 / self.radius).next_up();
        Tangent { normal: self.normal(ray, hit), normal_error: 16.0 * U, curvature }
    }

    fn contact(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, Tangent) {
        let tangent = self.tangent(ray, hit);
        let position = self.center + self.radius * tangent.normal;
        // The normal's length is off by less than 4u, so the product by less than 5u·r, and the sum by u of itself;
        // the last term is for subnormal results.
        let error = 6.0 * U * self.radius + 2.0 * length(U * position) + f64::from_bits(8);
        (SurfacePoint { position, error }, tangent)
    }

    fn departs(&self, ray: &Ray, _hit: &Hit, outward: bool) -> bool {
        sphere::departs(ray, self.center, self.radius, outward)
    }

    fn precise_lambda(&self, ray: &Ray, hit: &Hit) -> [f64; 2] {
        sphere::precise_lambda(ray, self.center, self.radius, hit.lambda)
    }
}
