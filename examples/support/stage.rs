//! A scene ready to be photographed.
#![allow(dead_code, reason = "the signature needs no lights, the others no names")]

use truehit::glam::DVec3;
use truehit::shading::{Background, Light, Material, Rgb, Whitted};
use truehit::{Camera, InvalidCamera, Scene, SceneBuilder, Shape};

/// Objects with their names, lights, and where to look from.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) scene: Scene<Material>,
    /// By object index.
    pub(crate) names: Vec<&'static str>,
    pub(crate) lights: Vec<Light>,
    pub(crate) ambient: Rgb,
    pub(crate) background: Background,
    pub(crate) eye: DVec3,
    pub(crate) target: DVec3,
    pub(crate) up: DVec3,
    /// Vertical, in degrees, for a picture of 3 : 2; narrower ones are widened to show as much.
    pub(crate) field_of_view: f64,
}

impl Stage {
    pub(crate) fn whitted(&self) -> Whitted<'_> {
        Whitted {
            lights: self.lights.clone(),
            ambient: self.ambient,
            background: self.background,
            ..Whitted::new(&self.scene)
        }
    }

    pub(crate) fn camera(&self, size: [u32; 2]) -> Result<Camera, InvalidCamera> {
        let [_, half_height] = half_extent(self.field_of_view, size);
        Camera::look_at(self.eye, self.target, self.up, 2.0 * half_height.atan(), size)
    }
}

/// Half the width and height of what is seen at distance one; see [`Stage::field_of_view`].
pub(crate) fn half_extent(field_of_view: f64, size: [u32; 2]) -> [f64; 2] {
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let half_height = (0.5 * field_of_view.to_radians()).tan() * (1.5 / aspect).max(1.0);
    [half_height * aspect, half_height]
}

/// Collects objects with their names.
#[derive(Debug, Default)]
pub(crate) struct Props {
    scene: SceneBuilder<Material>,
    names: Vec<&'static str>,
}

impl Props {
    pub(crate) fn put(&mut self, name: &'static str, shape: impl Shape + 'static, material: &Material) {
        self.scene.push(shape, material.clone());
        self.names.push(name);
    }

    pub(crate) fn finish(self) -> (Scene<Material>, Vec<&'static str>) {
        (self.scene.build(), self.names)
    }
}
