//! Colour by surface parameters.

use super::Rgb;
use super::color::decode;
use glam::DVec2;
use std::fmt::{self, Debug};
use std::sync::Arc;

/// A colour for each point (u, v) of texture space. Anything that implements it is a texture; each shape documents
/// its own (u, v): [`Shape::texture_coordinates`](crate::Shape::texture_coordinates).
pub trait Texture: Debug + Send + Sync {
    /// The linear colour at `at`, which may be any pair of numbers.
    fn color(&self, at: DVec2) -> Rgb;
}

impl<T: Texture + ?Sized> Texture for Arc<T> {
    fn color(&self, at: DVec2) -> Rgb {
        (**self).color(at)
    }
}

/// Fields of two colours in turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checker {
    even: Rgb,
    odd: Rgb,
    fields: DVec2,
}

impl Checker {
    /// `fields` of them to one unit of (u, v); the field at (0, 0) is `even`.
    pub fn new(even: impl Into<Rgb>, odd: impl Into<Rgb>, fields: impl Into<DVec2>) -> Self {
        Self { even: even.into(), odd: odd.into(), fields: fields.into() }
    }
}

impl Texture for Checker {
    fn color(&self, at: DVec2) -> Rgb {
        let field = (at * self.fields).floor();
        // One by one: the sum of two huge numbers may lose its parity.
        let even = |n: f64| (0.5 * n).fract() == 0.0;
        if even(field.x) == even(field.y) { self.even } else { self.odd }
    }
}

/// A picture, repeated over the plane: (0, 0) is its lower left corner, (1, 1) its upper right one. Between texel
/// centres colours are interpolated, in linear RGB.
#[derive(Clone, PartialEq)]
pub struct ImageTexture {
    width: u32,
    height: u32,
    /// Linear, in rows from the top.
    texels: Vec<[f32; 3]>,
}

impl ImageTexture {
    /// A texture of `width` × `height` texels from their sRGB bytes, red, green, blue, in rows from the top.
    ///
    /// # Errors
    /// [`InvalidTexture`] if there are no texels, or not three bytes for each.
    pub fn from_srgb8(width: u32, height: u32, bytes: &[u8]) -> Result<Self, InvalidTexture> {
        let needed = (u64::from(width) * u64::from(height)).checked_mul(3);
        if bytes.is_empty() || needed != Some(bytes.len() as u64) {
            return Err(InvalidTexture { width, height, bytes: bytes.len() });
        }
        let linear: Vec<f32> = (0..=255_u8).map(|byte| decode(f64::from(byte) / 255.0) as f32).collect();
        let texels = bytes.as_chunks::<3>().0.iter().map(|texel| texel.map(|byte| linear[usize::from(byte)])).collect();
        Ok(Self { width, height, texels })
    }

    fn texel(&self, i: u32, j: u32) -> Rgb {
        let [r, g, b] = self.texels[j as usize * self.width as usize + i as usize];
        Rgb::new(r.into(), g.into(), b.into())
    }
}

/// Any picture that the crate `image` reads; transparency is dropped.
#[cfg(feature = "image")]
impl TryFrom<&image::DynamicImage> for ImageTexture {
    type Error = InvalidTexture;

    fn try_from(picture: &image::DynamicImage) -> Result<Self, InvalidTexture> {
        let picture = picture.to_rgb8();
        Self::from_srgb8(picture.width(), picture.height(), picture.as_raw())
    }
}

impl Texture for ImageTexture {
    fn color(&self, at: DVec2) -> Rgb {
        // The two texels around `t` (in [0, 1) after wrapping; NaN becomes 0) of `n`, and the weight of the second.
        let around = |t: f64, n: u32| {
            let x = (t - t.floor()).max(0.0) * f64::from(n) - 0.5;
            let first = x.floor();
            let wrapped = |i: f64| i.rem_euclid(f64::from(n)) as u32;
            (wrapped(first), wrapped(first + 1.0), x - first)
        };
        let (left, right, rightness) = around(at.x, self.width);
        let (upper, lower, lowness) = around(1.0 - at.y, self.height);
        let row = |j| self.texel(left, j).lerp(self.texel(right, j), rightness);
        row(upper).lerp(row(lower), lowness)
    }
}

impl Debug for ImageTexture {
    /// Without the texels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ImageTexture({} × {})", self.width, self.height)
    }
}

/// A picture that cannot be a texture: without texels, or with a number of bytes that does not fit its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidTexture {
    /// The width given.
    pub width: u32,
    /// The height given.
    pub height: u32,
    /// How many bytes came with it.
    pub bytes: usize,
}

impl fmt::Display for InvalidTexture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, bytes } = self;
        write!(f, "a texture of {width} × {height} texels cannot be made of {bytes} bytes")
    }
}

impl std::error::Error for InvalidTexture {}
