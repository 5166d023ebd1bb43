//! A case's solid as one of the crate's shapes.

use super::big::Big;
use super::cases::{Case, Solid};
use super::oracle::innermost;
use truehit::glam::DVec3;
use truehit::{Affine, Cone, Cylinder, InvalidShape, Mesh, Plane, Polygon, Ray, Shape, Sphere, Triangle};

/// The shape, if there is one for this solid and its constructor takes it.
pub fn shape(solid: &Solid) -> Option<Result<Box<dyn Shape>, InvalidShape>> {
    fn boxed<S: Shape + 'static>(shape: Result<S, InvalidShape>) -> Result<Box<dyn Shape>, InvalidShape> {
        shape.map(|s| Box::new(s) as Box<dyn Shape>)
    }
    Some(match solid {
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
        Solid::Affine { world_from_object, inner, .. } => {
            shape(inner)?.and_then(|inner| boxed(Affine::new(inner, *world_from_object)))
        }
        Solid::Mesh { positions, triangles } => boxed(Mesh::new(positions.clone(), triangles.clone())),
        Solid::Polygon(contours) => {
            let holes: Vec<&[DVec3]> = contours[1..].iter().map(Vec::as_slice).collect();
            boxed(Polygon::with_holes(&contours[0], &holes))
        }
        Solid::Slab { .. } => return None,
    })
}

/// The case with the maps that the crate's shapes store in place of the generator's own inverses.
pub fn as_stored(mut case: Case) -> Case {
    let mut solid = &mut case.solid;
    while let Solid::Affine { world_from_object, object_from_world, inner } = solid {
        *object_from_world =
            *Affine::new(Sphere::UNIT, *world_from_object).expect("an invertible map").object_from_world();
        solid = inner;
    }
    case
}

/// The ray that an affine case is decided for. Panics if it is further from the exact image than is documented.
pub fn object_ray(case: &Case) -> Ray {
    let Solid::Affine { world_from_object, inner, .. } = &case.solid else { panic!("no map") };
    let inner = shape(inner).expect("a shape").expect("a legal shape");
    let ray = Affine::new(inner, *world_from_object).expect("an invertible map").object_ray(&case.ray);
    let (_, line, sizes) = innermost(case);
    let u = f64::EPSILON / 2.0;
    for (rounded, exact, size) in [(ray.origin, &line.o, sizes[0]), (ray.direction, &line.d, sizes[1])] {
        for i in 0..3 {
            let off = (Big::from(rounded[i]) - &exact.0[i]).abs();
            let bound = Big::from(u) * Big::from(rounded[i]).abs() + Big::from(48.0 * u * u * size[i]);
            // And what underflows in a product.
            let bound = bound + Big::from(f64::from_bits(256));
            assert!(off.cmp(&bound).is_le(), "{} is off by {}: {}", rounded[i], off.to_f64(), case.hex());
        }
    }
    ray
}
