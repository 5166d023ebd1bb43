//! A case's solid as one of the crate's shapes.

use super::cases::Solid;
use truehit::{Cone, Cylinder, InvalidShape, Plane, Shape, Sphere, Triangle};

/// The shape, if there is one for this solid and its constructor takes it.
pub fn shape(solid: &Solid) -> Option<Result<Box<dyn Shape>, InvalidShape>> {
    fn boxed<S: Shape + 'static>(shape: Result<S, InvalidShape>) -> Option<Result<Box<dyn Shape>, InvalidShape>> {
        Some(shape.map(|s| Box::new(s) as Box<dyn Shape>))
    }
    match solid {
        Solid::Plane { point, normal } => boxed(Plane::new(*point, *normal)),
        Solid::Triangle([a, b, c]) => boxed(Triangle::new(*a, *b, *c)),
        Solid::Sphere { center, radius } => boxed(Sphere::new(*center, *radius)),
        Solid::Frustum { base, top, base_radius, top_radius } if base_radius == top_radius => {
            boxed(Cylinder::new(*base, *top, *base_radius))
        }
        Solid::Frustum { base, top, base_radius, top_radius: 0.0 } => boxed(Cone::new(*base, *top, *base_radius)),
        Solid::Frustum { base, top, base_radius, top_radius } => {
            boxed(Cone::truncated(*base, *top, *base_radius, *top_radius))
        }
        Solid::Polygon(_) | Solid::Slab { .. } | Solid::Mesh { .. } | Solid::Affine { .. } => None,
    }
}
