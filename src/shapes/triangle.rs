//! The triangle.

use crate::kernel::triangle;
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint};
use glam::{DAffine3, DVec3};

/// A triangle, edges and vertices included.
///
/// Its normal is (b−a)×(c−a), by winding: seen from the side it points to, the vertices run anticlockwise. `uv` of a
/// hit, and its texture coordinates, are the weights of `b` and `c`. A ray in its plane misses.
///
/// ```
/// use truehit::{Interval, Ray, Shape, Triangle};
/// let triangle = Triangle::new([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0])?;
/// let ray = Ray::new([1.0, 2.0, 3.0], [0.0, 0.0, -1.0]);
/// let hit = triangle.intersect(&ray, Interval::FORWARD).unwrap();
/// assert_eq!((hit.lambda, hit.uv.x, hit.uv.y), (3.0, 0.25, 0.5));
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    vertices: [DVec3; 3],
    normal: DVec3,
}

impl Triangle {
    /// The triangle a, b, c; plain arrays are taken too.
    ///
    /// # Errors
    /// [`InvalidShape::NotFinite`] for a NaN or an infinity, [`InvalidShape::Degenerate`] if the vertices lie on one
    /// line exactly. However thin otherwise, it is a triangle.
    pub fn new(a: impl Into<DVec3>, b: impl Into<DVec3>, c: impl Into<DVec3>) -> Result<Self, InvalidShape> {
        let vertices = [a.into(), b.into(), c.into()];
        for (field, v) in ["a", "b", "c"].into_iter().zip(vertices) {
            if !v.is_finite() {
                return Err(InvalidShape::NotFinite { field });
            }
        }
        let normal = triangle::normal(&vertices);
        if normal == DVec3::ZERO {
            return Err(InvalidShape::Degenerate { field: "a, b, c" });
        }
        Ok(Self { vertices, normal })
    }

    /// The three vertices.
    #[must_use]
    pub fn vertices(&self) -> &[DVec3; 3] {
        &self.vertices
    }
}

impl Shape for Triangle {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        triangle::intersect(ray, &self.vertices, within)
    }

    fn normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        self.normal
    }

    fn bounds(&self) -> Aabb {
        Aabb::around(&self.vertices)
    }

    fn bounds_under(&self, map: &DAffine3) -> Aabb {
        Aabb::around_images(&self.vertices, map)
    }

    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let (position, error) = triangle::point(ray, &self.vertices, hit.uv);
        SurfacePoint { position, error }
    }

    fn departs(&self, ray: &Ray, _: &Hit, outward: bool) -> bool {
        triangle::departs(ray, &self.vertices, outward)
    }

    fn precise_lambda(&self, ray: &Ray, _: &Hit) -> [f64; 2] {
        triangle::precise_lambda(ray, &self.vertices)
    }
}
