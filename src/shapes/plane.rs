//! The plane.

use crate::kernel::{eft, float, plane};
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint};
use glam::{DVec2, DVec3};

/// The plane n·(p − `point`) = 0, unbounded.
///
/// n is `normal` exactly as given, of any non-zero length; only [`Shape::normal`] returns a unit vector. A ray along
/// the plane, inside it or beside it, misses.
///
/// Texture coordinates are lengths along two unit tangents: the first is a coordinate axis (the one the normal leans
/// to least) made perpendicular to the normal, the second is the normal × the first; both count from `point`.
///
/// ```
/// use truehit::{Interval, Plane, Ray, Shape};
/// let floor = Plane::new([0.0, -1.0, 0.0], [0.0, 2.0, 0.0])?;
/// let ray = Ray::new([0.0, 3.0, 0.0], [0.0, -2.0, 1.0]);
/// let hit = floor.intersect(&ray, Interval::FORWARD).unwrap();
/// assert_eq!(hit.lambda, 2.0);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    point: DVec3,
    normal: DVec3,
    unit: DVec3,
    tangents: [DVec3; 2],
}

impl Plane {
    /// The plane through `point` with `normal`; plain arrays are taken too.
    ///
    /// # Errors
    /// [`InvalidShape::NotFinite`] for a NaN or an infinity, [`InvalidShape::ZeroVector`] for a zero normal.
    pub fn new(point: impl Into<DVec3>, normal: impl Into<DVec3>) -> Result<Self, InvalidShape> {
        let (point, normal) = (point.into(), normal.into());
        for (field, v) in [("point", point), ("normal", normal)] {
            if !v.is_finite() {
                return Err(InvalidShape::NotFinite { field });
            }
        }
        let unit = float::unit(normal).ok_or(InvalidShape::ZeroVector { field: "normal" })?;
        Ok(Self { point, normal, unit, tangents: tangents(unit) })
    }
}

/// Two unit vectors that make a right-handed frame with the unit vector `n` as the third.
pub(super) fn tangents(n: DVec3) -> [DVec3; 2] {
    let a = n.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        DVec3::X
    } else if a.y <= a.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let u = (axis - n * n.dot(axis)).normalize();
    [u, n.cross(u)]
}

impl Shape for Plane {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        plane::intersect(ray, self.point, self.normal, within)
    }

    fn normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        self.unit
    }

    fn bounds(&self) -> Aabb {
        Aabb::EVERYTHING
    }

    fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
        let p = self.point(ray, hit).position - self.point;
        DVec2::new(p.dot(self.tangents[0]), p.dot(self.tangents[1]))
    }

    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let near = eft::step(ray.origin, hit.lambda, ray.direction);
        let (position, error) = plane::project(self.point, [self.normal, DVec3::ZERO], near);
        SurfacePoint { position, error }
    }

    fn departs(&self, ray: &Ray, _: &Hit, outward: bool) -> bool {
        plane::departs(ray, self.point, self.normal, outward)
    }

    fn precise_lambda(&self, ray: &Ray, _: &Hit) -> [f64; 2] {
        plane::precise_lambda(ray, self.point, self.normal)
    }
}
