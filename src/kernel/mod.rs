//! The numbers: pure functions that decide whether and where a ray meets a surface.

pub mod bound;
pub mod bounded;
pub mod cpu;
pub mod dyadic;
pub mod eft;
mod fixed;
pub mod float;
pub mod frustum;
pub mod lanes;
mod leaving;
pub mod map;
pub(crate) mod norm;
pub mod number;
mod pair;
pub mod plane;
pub mod polygon;
pub mod ratio;
pub(crate) mod rows;
pub mod scaled;
#[cfg(test)]
pub(crate) mod search;
mod section;
pub mod slab;
pub mod sphere;
pub mod tally;
pub mod textbook;
pub mod triangle;
