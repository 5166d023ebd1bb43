//! What a ray can meet.

use crate::kernel::float::length;
use crate::kernel::map::Map;
use crate::{Aabb, Hit, Interval, Ray};
use glam::{DAffine3, DVec2, DVec3};
use std::fmt::Debug;
use std::sync::Arc;

/// A surface that rays meet.
///
/// [`intersect`](Self::intersect) answers with a small [`Hit`]; everything else is asked of the closest hit only, with
/// the same ray. Only the first three methods are required; the others have defaults that are right for a flat shape
/// and say what a curved one gains by its own.
///
/// All vectors are in the shape's own frame, the frame of the ray that is passed in. The trait is object-safe, and
/// `&S`, `Box<S>` and `Arc<S>` are shapes by forwarding every method.
pub trait Shape: Debug + Send + Sync {
    /// The nearest hit with λ inside `within`, or `None`.
    ///
    /// Total: any ray gives an answer, and one that is not [valid](Ray::is_valid) misses. Each shape of this crate
    /// decides hit or miss as exact arithmetic on its stored numbers would, and `hit.error` bounds the error of λ.
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit>;

    /// The geometric normal at `hit`: a unit vector, outward for solids, by winding for open shapes; never turned
    /// towards the ray.
    fn normal(&self, ray: &Ray, hit: &Hit) -> DVec3;

    /// A box that holds the whole shape; infinite for an unbounded one.
    fn bounds(&self) -> Aabb;

    /// A box that holds the image of the whole shape under `map`, whose entries may each be off by half a unit in the
    /// last place. The default is the image of [`bounds`](Self::bounds); a shape that knows its vertices has a tighter
    /// one.
    fn bounds_under(&self, map: &DAffine3) -> Aabb {
        self.bounds().image(map)
    }

    /// Whether anything is hit inside `within`: the same answer as `intersect(…).is_some()`, often sooner.
    fn occludes(&self, ray: &Ray, within: Interval) -> bool {
        self.intersect(ray, within).is_some()
    }

    /// The nearest hits of many rays: `hits[i]` becomes what [`intersect`](Self::intersect) answers to `rays[i]`. The
    /// default asks one by one; a mesh walks rays that go the same way together.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn intersect_each(&self, rays: &[(Ray, Interval)], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "there must be one hit for each ray");
        for ((ray, within), hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray, *within);
        }
    }

    /// Whether many rays hit anything: [`occludes`](Self::occludes) for each, as
    /// [`intersect_each`](Self::intersect_each) for [`intersect`](Self::intersect).
    ///
    /// # Panics
    /// If the slices differ in length.
    fn occludes_each(&self, rays: &[(Ray, Interval)], hits: &mut [bool]) {
        assert_eq!(rays.len(), hits.len(), "there must be one answer for each ray");
        for ((ray, within), hit) in rays.iter().zip(hits) {
            *hit = self.occludes(ray, *within);
        }
    }

    /// The normal that shading uses: a unit vector, interpolated on smooth meshes, else the geometric
    /// [`normal`](Self::normal).
    fn shading_normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        self.normal(ray, hit)
    }

    /// Texture coordinates at `hit`, nominally in [0, 1]²; by default the hit's own `uv`.
    fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
        let _ = ray;
        hit.uv
    }

    /// The point of `hit`, as near to the surface as can be had. The default is `ray.at(lambda)` with its bound; a
    /// shape that projects that point back onto itself has a far smaller one.
    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let step = hit.lambda * ray.direction;
        let size = ray.origin.abs() + step.abs();
        // Two roundings of the components, and λ's own error.
        let error = 4.0 * f64::EPSILON * size.max_element() + 2.0 * hit.error * length(ray.direction);
        SurfacePoint { position: ray.origin + step, error }
    }

    /// Whether `ray`, which starts next to the surface at `hit`, is certain to have left it: its origin lies strictly
    /// on the side that `outward` names (the side of [`normal`](Self::normal) if true), and it does not meet the same
    /// piece of surface again on its way out. [`Surface::spawn`](crate::Surface::spawn) moves an origin until this
    /// holds. The default trusts the bound of [`point`](Self::point).
    fn departs(&self, ray: &Ray, hit: &Hit, outward: bool) -> bool {
        let _ = (ray, hit, outward);
        true
    }

    /// The surface around `hit`, for who moves it a little: [`Affine`](crate::Affine) finds by it how far λ moves when
    /// a ray's image is rounded. The default is a flat shape's, with a normal that is off by a few units in the last
    /// place.
    fn tangent(&self, ray: &Ray, hit: &Hit) -> Tangent {
        Tangent { normal: self.normal(ray, hit), normal_error: 8.0 * f64::EPSILON, curvature: 0.0 }
    }

    /// [`point`](Self::point) and [`tangent`](Self::tangent) at once, for which curved shapes and maps work out the
    /// same things.
    fn contact(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, Tangent) {
        (self.point(ray, hit), self.tangent(ray, hit))
    }

    /// [`intersect`](Self::intersect) where only the piece of surface that `hit` lies on matters: hits of others may be
    /// answered too, or not. The default looks at the whole shape; a mesh at one triangle.
    fn intersect_piece(&self, ray: &Ray, hit: &Hit, within: Interval) -> Option<Hit> {
        let _ = hit;
        self.intersect(ray, within)
    }

    /// The shape and the map, if this is another shape seen through an affine map (from the world to its frame): a
    /// chain of [`Affine`](crate::Affine)s takes a ray to the innermost shape in one step. None by default.
    fn seen_through(&self) -> Option<(&dyn Shape, &Map)> {
        None
    }

    /// λ of `hit` to about a hundred bits, as an unevaluated sum of two floats: what [`Scene`](crate::Scene) compares
    /// when two objects' hits lie within their bounds of each other. The default knows no more than the hit.
    fn precise_lambda(&self, ray: &Ray, hit: &Hit) -> [f64; 2] {
        let _ = ray;
        [hit.lambda, 0.0]
    }
}

/// A point on a surface, nearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where.
    pub position: DVec3,
    /// `position` is at most this far from the surface. Along the surface it is off the exact hit by at most the hit's
    /// `error` times the length of the ray's direction, plus a few units in the last place of the coordinates.
    pub error: f64,
}

/// A surface around a hit: its tangent plane, and how fast it leaves that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent {
    /// What [`Shape::normal`] gives: a unit vector.
    pub normal: DVec3,
    /// How far off that vector may be, λ's own error aside.
    pub normal_error: f64,
    /// An upper bound of the normal curvature (1/radius) near the hit; zero for flat shapes.
    pub curvature: f64,
}

macro_rules! forward_shape {
    ($($pointer:ty),*) => {$(
        impl<S: Shape + ?Sized> Shape for $pointer {
            fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
                (**self).intersect(ray, within)
            }
            fn normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
                (**self).normal(ray, hit)
            }
            fn bounds(&self) -> Aabb {
                (**self).bounds()
            }
            fn bounds_under(&self, map: &DAffine3) -> Aabb {
                (**self).bounds_under(map)
            }
            fn occludes(&self, ray: &Ray, within: Interval) -> bool {
                (**self).occludes(ray, within)
            }
            fn intersect_each(&self, rays: &[(Ray, Interval)], hits: &mut [Option<Hit>]) {
                (**self).intersect_each(rays, hits);
            }
            fn occludes_each(&self, rays: &[(Ray, Interval)], hits: &mut [bool]) {
                (**self).occludes_each(rays, hits);
            }
            fn shading_normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
                (**self).shading_normal(ray, hit)
            }
            fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
                (**self).texture_coordinates(ray, hit)
            }
            fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
                (**self).point(ray, hit)
            }
            fn departs(&self, ray: &Ray, hit: &Hit, outward: bool) -> bool {
                (**self).departs(ray, hit, outward)
            }
            fn tangent(&self, ray: &Ray, hit: &Hit) -> Tangent {
                (**self).tangent(ray, hit)
            }
            fn contact(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, Tangent) {
                (**self).contact(ray, hit)
            }
            fn intersect_piece(&self, ray: &Ray, hit: &Hit, within: Interval) -> Option<Hit> {
                (**self).intersect_piece(ray, hit, within)
            }
            fn seen_through(&self) -> Option<(&dyn Shape, &Map)> {
                (**self).seen_through()
            }
            fn precise_lambda(&self, ray: &Ray, hit: &Hit) -> [f64; 2] {
                (**self).precise_lambda(ray, hit)
            }
        }
    )*};
}
forward_shape!(&S, Box<S>, Arc<S>);
