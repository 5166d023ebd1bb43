//! The planar polygon.

use super::plane::tangents;
use crate::kernel::bound::U;
use crate::kernel::polygon::{self, Contours};
use crate::kernel::{eft, float, plane};
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint};
use glam::{DAffine3, DVec2, DVec3};

/// A planar polygon, with holes if need be: concave or self-intersecting, even-odd.
///
/// A point of its plane belongs to it if a line from it to infinity crosses the contours an odd number of times, all of
/// them counted, or if it lies on a contour. So a hole may touch or leave the outer contour, the middle of a pentagram
/// is outside, and repeated vertices and edges of no length do nothing. A ray in its plane misses.
///
/// The normal is the outer contour's (Newell 1972): seen from the side it points to, that contour runs anticlockwise.
/// The plane goes through its first vertex.
///
/// Texture coordinates run from 0 to 1 over the polygon's extent along the two tangents that [`Plane`](crate::Plane)
/// describes.
///
/// ```
/// use truehit::glam::DVec3;
/// use truehit::{Interval, Polygon, Ray, Shape};
/// let square = |h: f64| [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, y]| DVec3::new(x, y, 0.0));
/// let frame = Polygon::with_holes(&square(2.0), &[&square(1.0)])?;
/// let down = |x: f64| frame.intersect(&Ray::new([x, 0.0, 5.0], [0.0, 0.0, -1.0]), Interval::FORWARD);
/// assert!(down(0.5).is_none());
/// assert!(down(1.0).is_some()); // on the hole's contour
/// assert!(down(1.5).is_some());
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Debug)]
pub struct Polygon {
    contours: Contours,
    normal: DVec3,
    bounds: Aabb,
    tangents: [DVec3; 2],
    /// Least and greatest coordinate along each tangent, from the first vertex.
    extent: [DVec2; 2],
}

/// What rounding explains: a vertex may be off the plane by this times the largest coordinate. Vertices that were
/// turned and moved into place are off by a few u each, and so are those that the plane was made of.
const ROUNDING: f64 = 16.0 * U;

impl Polygon {
    /// The polygon inside one contour, which closes itself: its first vertex is not repeated at the end.
    ///
    /// # Errors
    /// As [`with_holes`](Self::with_holes).
    pub fn new(vertices: &[DVec3]) -> Result<Self, InvalidShape> {
        Self::with_holes(vertices, &[])
    }

    /// The polygon inside `outer` and outside `holes`, by even-odd over all contours.
    ///
    /// # Errors
    /// [`InvalidShape::TooFew`] for a contour of fewer than three vertices, [`InvalidShape::NotFinite`] for a NaN or an
    /// infinity, [`InvalidShape::Degenerate`] if the outer contour's Newell normal is zero, [`InvalidShape::NotPlanar`]
    /// for a vertex further off the plane than rounding explains: 16 u times the largest coordinate.
    pub fn with_holes(outer: &[DVec3], holes: &[&[DVec3]]) -> Result<Self, InvalidShape> {
        for (field, contour) in std::iter::once(("outer", &outer)).chain(holes.iter().map(|h| ("holes", h))) {
            if contour.len() < 3 {
                return Err(InvalidShape::TooFew { field, needed: 3, given: contour.len() });
            }
            if !contour.iter().all(|v| v.is_finite()) {
                return Err(InvalidShape::NotFinite { field });
            }
        }
        let all: Vec<&[DVec3]> = std::iter::once(outer).chain(holes.iter().copied()).collect();
        let contours = Contours::new(&all).ok_or(InvalidShape::Degenerate { field: "outer" })?;
        let size = contours.vertices().iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
        let (allowed, mut thickness) = (ROUNDING * size, 0.0);
        for (contour, vertices) in contours.contours().enumerate() {
            for (vertex, &v) in vertices.iter().enumerate() {
                let distance = contours.distance(v);
                if distance > allowed {
                    return Err(InvalidShape::NotPlanar { contour, vertex, distance, allowed });
                }
                thickness = f64::max(thickness, distance);
            }
        }
        let normal = float::unit(contours.normal()[0]).unwrap_or(DVec3::Z);
        let tangents = tangents(normal);
        let flat = contours.vertices().iter().map(|&v| planar(tangents, v - outer[0]));
        let (low, high) = flat.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let Aabb { min, max } = contours.bounds();
        // The plane passes by the vertices at most this far; not at all if they lie on it exactly.
        let off = 2.0 * thickness * normal.abs();
        let bounds = Aabb { min: min - off, max: max + off };
        Ok(Self { contours, normal, bounds, tangents, extent: [low, high] })
    }

    /// The contours, the outer one first.
    pub fn contours(&self) -> impl Iterator<Item = &[DVec3]> {
        self.contours.contours()
    }
}

fn planar([u, v]: [DVec3; 2], p: DVec3) -> DVec2 {
    DVec2::new(p.dot(u), p.dot(v))
}

impl Shape for Polygon {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        polygon::intersect(ray, &self.contours, within)
    }

    fn normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        self.normal
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn bounds_under(&self, map: &DAffine3) -> Aabb {
        if self.bounds == self.contours.bounds() {
            Aabb::around_images(self.contours.vertices(), map)
        } else {
            self.bounds.image(map)
        }
    }

    fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
        let p = self.point(ray, hit).position - self.contours.vertices()[0];
        let [low, high] = self.extent;
        (planar(self.tangents, p) - low) / (high - low)
    }

    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let near = eft::step(ray.origin, hit.lambda, ray.direction);
        let (position, error) = plane::project(self.contours.vertices()[0], self.contours.normal(), near);
        SurfacePoint { position, error }
    }

    fn departs(&self, ray: &Ray, _: &Hit, outward: bool) -> bool {
        self.contours.departs(ray, outward)
    }

    fn precise_lambda(&self, ray: &Ray, _: &Hit) -> [f64; 2] {
        polygon::precise_lambda(ray, &self.contours)
    }
}
