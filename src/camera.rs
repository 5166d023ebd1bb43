//! Pixel → ray.

use crate::Ray;
use crate::kernel::float::unit;
use glam::{DVec2, DVec3};
use std::fmt;

/// A pinhole camera.
///
/// The picture has `width` × `height` pixels; pixel (i, j) is column i from the left and row j from the *top*. Raster
/// coordinates (x, y) run over [0, width] × [0, height] in the same directions, so pixel (i, j) covers
/// [i, i+1] × [j, j+1] and its centre is (i + ½, j + ½). Pixels are square.
///
/// The camera's frame: `right`, `up` and `forward` are unit vectors at right angles, `forward` from the eye to the
/// target, `right` = `forward` × `up`. A ray's direction has `forward` component one: λ of a hit is its depth, the
/// distance from the eye *along the view axis*.
///
/// ```
/// use truehit::{Camera, glam::DVec3};
/// let camera = Camera::look_at([0.0, 0.0, 4.0], [0.0; 3], [0.0, 1.0, 0.0], 90_f64.to_radians(), [200, 100])?;
/// // The middle of the picture, and the middle of its upper edge: 45° up.
/// assert_eq!(camera.ray(100.0, 50.0).direction, DVec3::NEG_Z);
/// assert!((camera.ray(100.0, 0.0).direction - DVec3::new(0.0, 1.0, -1.0)).length() < 1e-15);
/// # Ok::<(), truehit::InvalidCamera>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// The side of a pixel at distance one.
    pixel: f64,
    width: u32,
    height: u32,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, with `up` upward in the picture; `vertical_fov` is the angle between
    /// the picture's upper and lower edge in radians, `size` is [width, height] in pixels.
    ///
    /// # Errors
    /// [`InvalidCamera`] if a number is not finite, the eye is the target, `up` is zero or parallel to the view
    /// axis (to within rounding), the angle is not between 0 and π, or the picture has no pixels.
    pub fn look_at(
        eye: impl Into<DVec3>,
        target: impl Into<DVec3>,
        up: impl Into<DVec3>,
        vertical_fov: f64,
        size: [u32; 2],
    ) -> Result<Self, InvalidCamera> {
        let (eye, target, up) = (eye.into(), target.into(), up.into());
        for (field, v) in [("eye", eye), ("target", target), ("up", up)] {
            if !v.is_finite() {
                return Err(InvalidCamera::NotFinite { field });
            }
        }
        let [width, height] = size;
        if width == 0 || height == 0 {
            return Err(InvalidCamera::NoPixels { size });
        }
        // Written so that NaN is refused.
        let half = (0.5 * vertical_fov).tan();
        if !(vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI && half > 0.0) {
            return Err(InvalidCamera::FieldOfView { radians: vertical_fov });
        }
        // Halved, so that the difference of two huge coordinates stays finite.
        let forward = unit(0.5 * target - 0.5 * eye).ok_or(InvalidCamera::EyeAtTarget)?;
        let up = unit(up).ok_or(InvalidCamera::UpParallel)?;
        let right = forward.cross(up);
        // Each component of the cross product of two unit vectors is off by less than 3u, the unit vectors
        // themselves by about 2u each: below 16u its direction is noise.
        if right.length() <= 8.0 * f64::EPSILON {
            return Err(InvalidCamera::UpParallel);
        }
        let right = right.normalize();
        let pixel = 2.0 * half / f64::from(height);
        Ok(Self { eye, right, up: right.cross(forward), forward, pixel, width, height })
    }

    /// The ray through raster position (x, y): (0, 0) is the upper left corner, (width, height) the lower right one;
    /// positions outside the picture are legal. Its direction is not a unit vector: see [`Camera`].
    #[must_use]
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let across = (x - 0.5 * f64::from(self.width)) * self.pixel;
        let upward = (0.5 * f64::from(self.height) - y) * self.pixel;
        Ray { origin: self.eye, direction: self.forward + across * self.right + upward * self.up }
    }

    /// The ray through the centre of pixel (i, j).
    #[must_use]
    pub fn pixel(&self, i: u32, j: u32) -> Ray {
        self.ray(f64::from(i) + 0.5, f64::from(j) + 0.5)
    }

    /// One of the `strata`² rays of pixel (i, j): the pixel is divided into `strata` × `strata` cells, and ray `index`
    /// (taken modulo `strata`²) goes through a point of its cell that depends on (i, j, index) and nothing else, so a
    /// picture is the same whoever renders which pixel when. With one cell, or none, it is the pixel's centre.
    #[must_use]
    pub fn sample(&self, i: u32, j: u32, index: u32, strata: u32) -> Ray {
        if strata <= 1 {
            return self.pixel(i, j);
        }
        let cell = [index % strata, index / strata % strata];
        let jitter = jitter(i, j, index);
        let at = (DVec2::new(f64::from(cell[0]), f64::from(cell[1])) + jitter) / f64::from(strata);
        self.ray(f64::from(i) + at.x, f64::from(j) + at.y)
    }

    /// Where all rays start.
    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// The view axis, a unit vector.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Columns of pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }
}

/// A point of [0, 1)² from a hash of the sample's name: `SplitMix64` (Steele, Lea, Flood 2014), once per coordinate.
fn jitter(i: u32, j: u32, index: u32) -> DVec2 {
    let hash = |seed: u64| {
        let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    let pixel = u64::from(i) << 32 | u64::from(j);
    let first = hash(hash(pixel) ^ u64::from(index));
    let second = hash(first);
    let fraction = |bits: u64| (bits >> 11) as f64 * (f64::EPSILON / 2.0);
    DVec2::new(fraction(first), fraction(second))
}

/// Why [`Camera::look_at`] refused its input.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum InvalidCamera {
    /// A NaN or an infinity.
    NotFinite {
        /// The argument.
        field: &'static str,
    },
    /// Eye and target coincide, so there is no view axis.
    EyeAtTarget,
    /// `up` is zero or, to within rounding, parallel to the view axis.
    UpParallel,
    /// The angle is not between 0 and π, or so small that its tangent vanishes.
    FieldOfView {
        /// What was given.
        radians: f64,
    },
    /// A width or height of zero.
    NoPixels {
        /// What was given: [width, height].
        size: [u32; 2],
    },
}

impl fmt::Display for InvalidCamera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { field } => write!(f, "{field} must be finite"),
            Self::EyeAtTarget => write!(f, "eye and target must differ"),
            Self::UpParallel => write!(f, "up must not be zero or parallel to the line from eye to target"),
            Self::FieldOfView { radians } => {
                write!(f, "vertical_fov must be between 0 and π radians, got {radians}")
            }
            Self::NoPixels { size: [width, height] } => {
                write!(f, "size must be at least 1 × 1 pixels, got {width} × {height}")
            }
        }
    }
}

impl std::error::Error for InvalidCamera {}
