//! Which functions stand in the table.

use crate::kernels::{Entry, Function, Origin};
use crate::support::cases::{Kernel, Solid};
use truehit::glam::{DAffine3, DVec3};
use truehit::kernel::{self, textbook};
use truehit::{Affine, Ray, Shape};

/// Every kernel, by shape.
pub fn all() -> Vec<Entry> {
    let mut entries = Vec::new();
    let mut add = |kernel, name, origin, function| entries.push(Entry { kernel, name, origin, function });
    macro_rules! both {
        ($kernel:ident, $variant:ident, $name32:literal, $name64:literal, $function:ident) => {
            add(Kernel::$kernel, $name32, Origin::TextbookF32, Function::$variant(textbook::$function::<f32>));
            add(Kernel::$kernel, $name64, Origin::TextbookF64, Function::$variant(textbook::$function::<f64>));
        };
    }
    both!(Plane, Plane, "textbook f32", "textbook f64", plane);
    add(Kernel::Plane, "truehit", Origin::Shipped, shipped(Kernel::Plane));
    both!(Triangle, Triangle, "Algorithm 1 f32", "Algorithm 1 f64", algorithm_1);
    both!(Triangle, Triangle, "Algorithm 2 f32", "Algorithm 2 f64", algorithm_2);
    both!(Triangle, Triangle, "Möller–Trumbore f32", "Möller–Trumbore f64", moller_trumbore);
    both!(Triangle, Triangle, "Woop f32", "Woop f64", woop);
    add(Kernel::Triangle, "truehit", Origin::Shipped, shipped(Kernel::Triangle));
    both!(Polygon, Polygon, "odd/even f32", "odd/even f64", polygon);
    add(Kernel::Polygon, "truehit", Origin::Shipped, shipped(Kernel::Polygon));
    both!(Sphere, Sphere, "slide formula f32", "slide formula f64", sphere);
    both!(Sphere, Sphere, "RT Gems 7 f32", "RT Gems 7 f64", sphere_gems);
    add(Kernel::Sphere, "truehit", Origin::Shipped, shipped(Kernel::Sphere));
    both!(Cylinder, Frustum, "textbook f32", "textbook f64", cylinder);
    add(Kernel::Cylinder, "truehit", Origin::Shipped, shipped(Kernel::Cylinder));
    both!(Cone, Frustum, "textbook f32", "textbook f64", cone);
    add(Kernel::Cone, "truehit", Origin::Shipped, shipped(Kernel::Cone));
    both!(Slab, Slab, "slabs f32", "slabs f64", slab);
    add(Kernel::Slab, "truehit", Origin::Shipped, shipped(Kernel::Slab));
    let mapped = |map, then| Function::Mapped { map, then };
    add(Kernel::Affine, "mapped ray f32", Origin::TextbookF32, mapped(map_f32, textbook_f32));
    add(Kernel::Affine, "mapped ray f64", Origin::TextbookF64, mapped(map_f64, textbook_f64));
    add(Kernel::Affine, "truehit", Origin::Shipped, shipped(Kernel::Affine));
    add(Kernel::Mesh, "truehit", Origin::Shipped, shipped(Kernel::Mesh));
    entries
}

/// The crate's own kernel for a shape.
pub fn shipped(kernel: Kernel) -> Function {
    match kernel {
        Kernel::Plane => Function::Plane(kernel::plane::intersect),
        Kernel::Triangle => Function::Triangle(kernel::triangle::intersect),
        Kernel::Sphere => Function::Sphere(kernel::sphere::intersect),
        Kernel::Cylinder | Kernel::Cone => Function::Frustum(kernel::frustum::intersect),
        Kernel::Slab => Function::Slab(kernel::slab::intersect),
        // Shapes that work something out in their constructor.
        Kernel::Polygon | Kernel::Mesh | Kernel::Affine => Function::Shape(make_shape),
    }
}

fn map_f64(ray: &Ray, object_from_world: &DAffine3) -> Ray {
    Ray {
        origin: object_from_world.transform_point3(ray.origin),
        direction: object_from_world.transform_vector3(ray.direction),
    }
}

fn map_f32(ray: &Ray, object_from_world: &DAffine3) -> Ray {
    let map = object_from_world.as_affine3();
    let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
    Ray { origin: map.transform_point3(origin).as_dvec3(), direction: map.transform_vector3(direction).as_dvec3() }
}

macro_rules! textbook_table {
    ($name:ident, $r:ty, $map:ident) => {
        fn $name(kernel: Kernel) -> Function {
            match kernel {
                Kernel::Plane => Function::Plane(textbook::plane::<$r>),
                Kernel::Triangle => Function::Triangle(textbook::moller_trumbore::<$r>),
                Kernel::Polygon => Function::Polygon(textbook::polygon::<$r>),
                Kernel::Sphere => Function::Sphere(textbook::sphere::<$r>),
                Kernel::Cylinder => Function::Frustum(textbook::cylinder::<$r>),
                Kernel::Cone => Function::Frustum(textbook::cone::<$r>),
                Kernel::Slab => Function::Slab(textbook::slab::<$r>),
                Kernel::Affine => Function::Mapped { map: $map, then: $name },
                Kernel::Mesh => unreachable!("no textbook kernel: left out before"),
            }
        }
    };
}
textbook_table!(textbook_f32, f32, map_f32);
textbook_table!(textbook_f64, f64, map_f64);

/// The crate's shape, or `None` where its constructor refuses.
pub fn make_shape(solid: &Solid) -> Option<Box<dyn Shape>> {
    use truehit::{Cone, Cylinder, Mesh, Plane, Polygon, Sphere, Triangle};
    fn boxed<S: Shape + 'static, E>(shape: Result<S, E>) -> Option<Box<dyn Shape>> {
        Some(Box::new(shape.ok()?))
    }
    match solid {
        Solid::Plane { point, normal } => boxed(Plane::new(*point, *normal)),
        Solid::Triangle([a, b, c]) => boxed(Triangle::new(*a, *b, *c)),
        Solid::Sphere { center, radius } => boxed(Sphere::new(*center, *radius)),
        Solid::Frustum { base, top, base_radius, top_radius } if base_radius == top_radius => {
            boxed(Cylinder::new(*base, *top, *base_radius))
        }
        Solid::Frustum { base, top, base_radius, top_radius } => {
            boxed(Cone::truncated(*base, *top, *base_radius, *top_radius))
        }
        Solid::Polygon(contours) => {
            let holes: Vec<&[DVec3]> = contours[1..].iter().map(Vec::as_slice).collect();
            boxed(Polygon::with_holes(&contours[0], &holes))
        }
        Solid::Mesh { positions, triangles } => boxed(Mesh::new(positions.clone(), triangles.clone())),
        Solid::Affine { world_from_object, inner, .. } => boxed(Affine::new(make_shape(inner)?, *world_from_object)),
        Solid::Slab { min, max } => boxed::<_, ()>(Ok(crate::block::Block { min: *min, max: *max })),
    }
}

/// The solid with its maps as the crate's shape stores them, which is what defines it: the exact answer is about those.
pub fn as_stored(solid: Solid) -> Solid {
    let Solid::Affine { world_from_object, object_from_world, inner } = solid else { return solid };
    let inner = as_stored(*inner);
    let affine = make_shape(&inner).and_then(|s| Affine::new(s, world_from_object).ok());
    let object_from_world = affine.map_or(object_from_world, |a| *a.object_from_world());
    Solid::Affine { world_from_object, object_from_world, inner: Box::new(inner) }
}
