//! The shapes.

mod cone;
mod cylinder;
mod frustum;
mod local;
mod mesh;
mod patch;
mod plane;
mod polygon;
mod sphere;
mod triangle;

pub use cone::Cone;
pub use cylinder::Cylinder;
pub use mesh::Mesh;
pub use patch::Patch;
pub use plane::Plane;
pub use polygon::Polygon;
pub use sphere::Sphere;
pub use triangle::Triangle;
