//! Haines' sphereflake (1987): a ball with nine balls of a third its size on it, each with nine, and so on.
//! x is right, y away from the camera, z up.

use crate::stage::{Props, Stage};
use std::f64::consts::TAU;
use truehit::glam::{DQuat, DVec3};
use truehit::shading::color::srgb;
use truehit::shading::{Background, Checker, Light, Material, Mirror, Rgb};
use truehit::{InvalidShape, Plane, Sphere};

/// 1 + 9 + 81 + 729 + 6561 balls.
const GENERATIONS: usize = 5;

pub(crate) fn flake() -> Result<Stage, InvalidShape> {
    let mut props = Props::default();
    let tiles = Checker::new(srgb(222, 218, 210), srgb(198, 198, 196), [0.5, 0.5]);
    let floor = Material::matt([1.0; 3]).with_texture(tiles).with_mirror(Mirror::fading([0.2; 3], 4.0));
    props.put("floor", Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, &floor);

    // From copper to brass, generation by generation.
    let metals: Vec<Material> = (0..GENERATIONS)
        .map(|generation| {
            let tint = srgb(226, 120, 84).lerp(srgb(236, 204, 130), generation as f64 / (GENERATIONS - 1) as f64);
            Material::matt(0.22 * tint).with_gloss(0.7, 250.0).with_mirror(Mirror::even(0.72 * tint))
        })
        .collect();
    let mut balls = vec![(DVec3::new(0.0, 0.0, 1.62), DVec3::Z, 1.0)];
    while let Some((center, outward, radius)) = balls.pop() {
        let generation = f64::log(1.0 / radius, 3.0).round() as usize;
        props.put("ball", Sphere::new(center, radius)?, &metals[generation]);
        if generation + 1 < GENERATIONS {
            balls.extend(children().map(|direction| {
                let direction = DQuat::from_rotation_arc(DVec3::Z, outward) * direction;
                (center + direction * radius * (4.0 / 3.0), direction, radius / 3.0)
            }));
        }
    }
    let (scene, names) = props.finish();
    let target = DVec3::new(0.0, 0.0, 1.72);
    let lights =
        vec![Light::directional([-5.0, -5.0, 7.0], [0.8; 3]), Light::directional([0.8, -0.5, 0.4], [0.16, 0.18, 0.24])];
    Ok(Stage {
        scene,
        names,
        lights,
        ambient: Rgb::splat(0.2),
        background: Background::Sky { up: DVec3::Z, horizon: srgb(226, 222, 216), zenith: srgb(86, 130, 170) },
        eye: DVec3::new(1.5, -6.6, 3.1),
        target,
        up: DVec3::Z,
        field_of_view: 35.0,
    })
}

/// Six around the equator, three above between them.
fn children() -> impl Iterator<Item = DVec3> {
    let at = |longitude: f64, latitude: f64| {
        let ((sin, cos), (z, r)) = (longitude.sin_cos(), latitude.sin_cos());
        DVec3::new(r * cos, r * sin, z)
    };
    let equator = (0..6).map(move |k| at(TAU * f64::from(k) / 6.0, 0.0));
    equator.chain((0..3).map(move |k| at(TAU * (f64::from(k) / 3.0 + 1.0 / 12.0), TAU / 6.4)))
}
