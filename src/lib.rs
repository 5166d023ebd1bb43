//! truehit
mod aabb;
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
pub use camera::{Camera, InvalidCamera};
pub use error::InvalidShape;
pub use glam;
pub use hit::Hit;
pub use interval::Interval;
pub use raster::Raster;
pub use ray::Ray;
pub use scene::{Scene, SceneBuilder, SceneHit};
pub use shape::{Shape, SurfacePoint};
pub use shapes::{Cone, Cylinder, Patch, Plane, Sphere, Triangle};
pub use surface::Surface;
