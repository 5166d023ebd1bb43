//! Linear RGB inside, sRGB on the way in and out.

use crate::Raster;
use glam::DVec3;

/// Red, green, blue: linear, unbounded above; what one adds and multiplies light in.
pub type Rgb = DVec3;

/// A colour given as one reads it off a picture: three sRGB bytes.
///
/// ```
/// use truehit::shading::color::{srgb, to_srgb8};
/// assert_eq!(to_srgb8(srgb(200, 30, 7)), [200, 30, 7]);
/// ```
#[must_use]
pub fn srgb(red: u8, green: u8, blue: u8) -> Rgb {
    let decoded = |byte: u8| decode(f64::from(byte) / 255.0);
    Rgb::new(decoded(red), decoded(green), decoded(blue))
}

/// Linear → sRGB, both in [0, 1]: the piecewise function of IEC 61966-2-1, not a power of 2.2.
#[must_use]
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB → linear, both in [0, 1]: the inverse of [`encode`].
#[must_use]
pub fn decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The bytes that a screen shows for `linear`: clamped to [0, 1], encoded, rounded to nearest. NaN is black.
#[must_use]
pub fn to_srgb8(linear: Rgb) -> [u8; 3] {
    linear.to_array().map(|c| (encode(c.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

impl Raster<Rgb> {
    /// The picture as sRGB bytes: red, green, blue of each pixel, in rows from the top.
    #[must_use]
    pub fn to_srgb8(&self) -> Vec<u8> {
        self.values().iter().flat_map(|&c| to_srgb8(c)).collect()
    }
}
