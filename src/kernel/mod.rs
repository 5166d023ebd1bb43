//! The numbers: pure functions that decide whether and where a ray meets a surface.

pub mod bound;
pub mod bounded;
pub mod cpu;
pub mod dyadic;
pub mod eft;
pub mod number;
pub mod scaled;
pub mod textbook;
