//! What a surface does with light.

use super::{Rgb, Texture};
use glam::DVec2;
use std::sync::Arc;

/// The coefficients of E = r_d I_d max(0, s·n) + r_a I_a + r_s I_s max(0, r·c)^α + r_g I_spec, each per channel.
///
/// ```
/// use truehit::shading::{Checker, Material, Mirror, color::srgb};
/// let glazed = Material::matt(srgb(180, 40, 30)).with_gloss(0.5, 200.0).with_mirror(Mirror::even([0.1; 3]));
/// let tiles = Material::matt([1.0; 3]).with_texture(Checker::new([0.8; 3], [0.1; 3], [8.0, 8.0]));
/// ```
#[derive(Clone, Debug)]
pub struct Material {
    /// r_a: how much of the ambient light leaves again.
    pub ambient: Rgb,
    /// r_d: how much of a light's is scattered alike in all directions.
    pub diffuse: Rgb,
    /// r_s: the strength of highlights.
    pub specular: Rgb,
    /// α: how narrow highlights are.
    pub shininess: f64,
    /// r_g.
    pub mirror: Mirror,
    /// Multiplies r_a and r_d.
    pub texture: Option<Arc<dyn Texture>>,
    /// Which sides are lit.
    pub sides: Sides,
}

/// Which sides of a surface are lit. Normals never turn towards the ray; shading decides what a side seen from behind
/// looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// Whichever side the ray sees, with the normal reversed if it is the back.
    #[default]
    Both,
    /// The side the normal points to. The back shows ambient light and nothing else.
    Front,
}

/// r_g, the reflectance of a mirror: constant, or fading with the distance from the mirror to what is seen in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// r_g for an object that touches the mirror.
    pub reflectance: Rgb,
    /// r_g falls linearly to zero at this distance, in units of the scene; infinity for a constant r_g.
    pub range: f64,
}

impl Mirror {
    /// No reflection.
    pub const NONE: Self = Self { reflectance: Rgb::ZERO, range: f64::INFINITY };

    /// The same r_g at every distance.
    pub fn even(reflectance: impl Into<Rgb>) -> Self {
        Self { reflectance: reflectance.into(), range: f64::INFINITY }
    }

    /// `reflectance` at distance zero, nothing from `range` on.
    pub fn fading(reflectance: impl Into<Rgb>, range: f64) -> Self {
        Self { reflectance: reflectance.into(), range }
    }

    /// r_g for an object at `distance`; infinity for the background.
    #[must_use]
    pub fn at(&self, distance: f64) -> Rgb {
        if self.range == f64::INFINITY {
            return self.reflectance;
        }
        // Written so that a range of NaN reflects nothing.
        if distance < self.range { (1.0 - distance / self.range) * self.reflectance } else { Rgb::ZERO }
    }
}

impl Material {
    /// A surface without highlights or reflections: r_a = r_d = `color`.
    pub fn matt(color: impl Into<Rgb>) -> Self {
        let color = color.into();
        Self {
            ambient: color,
            diffuse: color,
            specular: Rgb::ZERO,
            shininess: 1.0,
            mirror: Mirror::NONE,
            texture: None,
            sides: Sides::Both,
        }
    }

    /// With white highlights: r_s = `strength`, α = `shininess`.
    #[must_use]
    pub fn with_gloss(self, strength: f64, shininess: f64) -> Self {
        Self { specular: Rgb::splat(strength), shininess, ..self }
    }

    /// With reflections.
    #[must_use]
    pub fn with_mirror(self, mirror: Mirror) -> Self {
        Self { mirror, ..self }
    }

    /// With a texture over r_a and r_d.
    #[must_use]
    pub fn with_texture(self, texture: impl Texture + 'static) -> Self {
        Self { texture: Some(Arc::new(texture)), ..self }
    }

    /// r_a and r_d at texture coordinates `at`.
    #[must_use]
    pub fn modulated(&self, at: impl FnOnce() -> DVec2) -> (Rgb, Rgb) {
        match &self.texture {
            Some(texture) => {
                let color = texture.color(at());
                (self.ambient * color, self.diffuse * color)
            }
            None => (self.ambient, self.diffuse),
        }
    }
}
