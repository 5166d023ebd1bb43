//! The shapes.

mod plane;
mod triangle;

pub use plane::Plane;
pub use triangle::Triangle;
