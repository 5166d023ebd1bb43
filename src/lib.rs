//! truehit
mod aabb;
mod error;
mod hit;
mod interval;
pub mod kernel;
mod ray;
mod shape;
mod surface;

pub use aabb::Aabb;
pub use error::InvalidShape;
pub use glam;
pub use hit::Hit;
pub use interval::Interval;
pub use ray::Ray;
pub use shape::{Shape, SurfacePoint};
pub use surface::Surface;
