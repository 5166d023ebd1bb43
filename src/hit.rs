//! What an intersection answers.

use glam::DVec2;

/// Where a ray meets a shape: what an affine map of both does not change.
///
/// Points, normals and texture coordinates are asked for later, of the closest hit only:
/// [`Shape::normal`](crate::Shape::normal), [`Shape::point`](crate::Shape::point),
/// [`Shape::texture_coordinates`](crate::Shape::texture_coordinates).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The hit is at `origin + lambda · direction`.
    pub lambda: f64,
    /// |`lambda` − exact λ| ≤ `error`; infinite where λ is beyond the range of floats, and then ±[`f64::MAX`].
    pub error: f64,
    /// Surface coordinates where they come with the intersection: a triangle's second and third barycentric weight;
    /// zero for shapes that work them out from the point.
    pub uv: DVec2,
    /// Which part of the shape: a mesh's triangle, or a solid's wall or cap.
    pub part: u32,
}
