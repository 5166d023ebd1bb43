//! From hits to a picture: the lecture's Whitted model in linear RGB.
//!
//! Geometry does not know this module: a [`Scene<Material>`](crate::Scene) is any scene whose tags happen to be
//! materials. [`Whitted`] follows a camera ray from mirror to mirror and adds up at each hit the local model of
//! [`phong`], lit by [`Light`]s; a [`Texture`] modulates what the material reflects of ambient and diffuse light.

pub mod color;
mod light;
mod material;
pub mod phong;
mod texture;
mod whitted;

pub use color::Rgb;
pub use light::{Incident, Light};
pub use material::{Material, Mirror, Sides};
pub use texture::{Checker, ImageTexture, InvalidTexture, Texture};
pub use whitted::{Background, RayCount, Rendering, Whitted};
