//! Ray tracing with answers that can be trusted: hit or miss decided exactly, a proved bound on every hit, watertight
//! meshes, no epsilon.
//!
//! **The pipeline**, in the names of its files: a [`Camera`] turns a pixel into a [`Ray`]; a [`Scene`] finds the
//! [`Shape`] that the ray meets first, through a [`bvh`] that knows boxes and no shapes; the shape answers with a
//! [`Hit`], which is λ, its error bound and which part, and nothing an affine map would change; of the closest hit
//! alone a [`Surface`] is asked for its point, its normal, its texture coordinates, and for the rays that
//! [leave it](Surface::spawn); [`shading`] makes light of them, and a [`Raster`] of light is an image.
//!
//! ```
//! use truehit::glam::{DAffine3, DVec3};
//! use truehit::{Affine, Camera, Interval, Plane, Scene, Sphere};
//!
//! // Two things, each with a tag of one's own choice.
//! let mut builder = Scene::builder();
//! builder.push(Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, "ground");
//! let squashed = DAffine3::from_scale(DVec3::new(2.0, 2.0, 0.5));
//! let lifted = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.5));
//! builder.push(Affine::new(Sphere::UNIT, lifted * squashed)?, "pebble");
//! let scene = builder.build();
//!
//! // Straight down from above, through the middle pixel.
//! let camera = Camera::look_at([0.0, 0.0, 9.0], [0.0; 3], [0.0, 1.0, 0.0], 0.5, [3, 3])?;
//! let ray = camera.pixel(1, 1);
//! let found = scene.intersect(&ray, Interval::FORWARD).expect("the pebble");
//! assert_eq!(*scene.tag(found.object), "pebble");
//! assert!((found.hit.lambda - 8.0).abs() <= found.hit.error);
//!
//! // On the pebble: which way is up, and what a ray sees that leaves it sideways: nothing, not even the pebble.
//! let surface = scene.surface(&ray, &found);
//! assert!((surface.normal() - DVec3::Z).length() < 1e-15);
//! assert!(!scene.occludes(&surface.spawn(DVec3::X), Interval::FORWARD));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **The floors**, from below: numbers ([`kernel`]: pure functions, each beside its textbook counterpart), geometry
//! ([`Ray`], [`Interval`], [`Aabb`], [`Hit`], [`Shape`], [`Affine`], [`Surface`]), acceleration ([`bvh`]), things (the
//! shapes and [`Scene`]), picture ([`Camera`], [`shading`], [`signature`]). Nothing knows a floor above its own.
//!
//! **Conventions.** λ is measured in lengths of the ray's direction, which need not be one; intervals of λ are open.
//! Solids are closed bodies with caps; planes, triangles and polygons are closed sets, edges included. Normals are unit
//! vectors, outward or by winding, and never turn towards the ray. Bad input is refused by constructors, by name:
//! [`InvalidShape`]; a ray with a NaN in it misses.
//!
//! Features: `rayon` (default) builds trees and renders rows on all cores with the same results; `image` (default)
//! makes textures of the pictures that the crate `image` reads.

mod aabb;
mod affine;
pub mod bvh;
mod camera;
mod error;
mod hit;
mod interval;
pub mod kernel;
mod raster;
mod ray;
mod scene;
pub mod shading;
mod shape;
mod shapes;
pub mod signature;
mod surface;

pub use aabb::Aabb;
pub use affine::Affine;
pub use camera::{Camera, InvalidCamera};
pub use error::InvalidShape;
pub use glam;
pub use hit::Hit;
pub use interval::Interval;
pub use raster::Raster;
pub use ray::Ray;
pub use scene::{Scene, SceneBuilder, SceneHit};
pub use shape::{Shape, SurfacePoint, Tangent};
pub use shapes::{Cone, Cylinder, Mesh, Patch, Plane, Polygon, Sphere, Triangle};
pub use surface::Surface;

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
