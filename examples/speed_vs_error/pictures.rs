//! Two pictures of one scene, where the eye sees it.

use crate::aftermath::textbook_normal;
use crate::kernels::{Entry, Function, Origin};
use crate::support::cases::{Case, Kernel, Solid};
use crate::table;
use image::{Rgb, RgbImage};
use std::path::Path;
use truehit::glam::DVec3;
use truehit::{Interval, Ray};

const SIZE: (u32, u32) = (360, 170);
const GAP: u32 = 8;

/// A sphere, a cylinder and a cone of unit size from 1e6, 2e7 and 1e8 away: left by the textbook kernels in f64,
/// right by truehit's.
pub fn far_view(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let up = DVec3::new(0.25, 1.0, 0.2).normalize();
    let scene = [
        Solid::Sphere { center: DVec3::new(-2.4, 0.0, 0.0), radius: 1.0 },
        Solid::Frustum { base: -0.9 * up, top: 0.9 * up, base_radius: 0.8, top_radius: 0.8 },
        Solid::Frustum {
            base: DVec3::new(2.4, 0.0, 0.0) - 0.9 * up,
            top: DVec3::new(2.4, 0.0, 0.0) + 0.9 * up,
            base_radius: 1.0,
            top_radius: 0.0,
        },
    ];
    let entries = table::all();
    let pick = |kernel: Kernel, origin: Origin| -> Result<Entry, String> {
        let found = entries.iter().find(|e| e.kernel == kernel && e.origin == origin);
        found.copied().ok_or_else(|| format!("no {} kernel", kernel.name()))
    };
    let distances = [1e6, 2e7, 1e8];
    let rows = distances.len() as u32;
    let mut picture =
        RgbImage::from_pixel(2 * SIZE.0 + 3 * GAP, rows * SIZE.1 + (rows + 1) * GAP, Rgb([127, 127, 127]));
    for (row, distance) in distances.into_iter().enumerate() {
        for (column, origin) in [Origin::TextbookF64, Origin::Shipped].into_iter().enumerate() {
            let functions: Vec<Function> = scene
                .iter()
                .map(|s| pick(crate::kernels::kind(s), origin).map(|e| e.function))
                .collect::<Result<_, _>>()?;
            let left = GAP + column as u32 * (SIZE.0 + GAP);
            let top = GAP + row as u32 * (SIZE.1 + GAP);
            for y in 0..SIZE.1 {
                for x in 0..SIZE.0 {
                    let colour = pixel(&scene, &functions, distance, x, y);
                    picture.put_pixel(left + x, top + y, colour);
                }
            }
        }
    }
    picture.save(path)?;
    Ok(())
}

fn pixel(scene: &[Solid], functions: &[Function], distance: f64, x: u32, y: u32) -> Rgb<u8> {
    let toward = DVec3::new(-0.25, -0.45, -1.0).normalize();
    let right = toward.cross(DVec3::Y).normalize();
    let up = right.cross(toward);
    let scale = 8.0 / f64::from(SIZE.0);
    let target = right * ((f64::from(x) + 0.5 - f64::from(SIZE.0) / 2.0) * scale)
        - up * ((f64::from(y) + 0.5 - f64::from(SIZE.1) / 2.0) * scale);
    let origin = -toward * distance;
    let ray = Ray { origin, direction: target - origin };
    let mut nearest = None;
    for (solid, function) in scene.iter().zip(functions) {
        let case = Case { ray, within: Interval::FORWARD, solid: solid.clone() };
        let entry =
            Entry { kernel: crate::kernels::kind(solid), name: "", origin: Origin::Shipped, function: *function };
        if let Some(hit) = entry.answer(&case).flatten()
            && nearest.as_ref().is_none_or(|(best, _): &(f64, DVec3)| hit.lambda < *best)
        {
            nearest = Some((hit.lambda, textbook_normal(solid, &ray, &hit)));
        }
    }
    let Some((_, normal)) = nearest else { return Rgb([236, 239, 244]) };
    let light = DVec3::new(0.5, 0.8, 0.6).normalize();
    let lit = 0.15 + 0.85 * normal.dot(light).max(0.0);
    let tint =
        [0.35 + 0.35 * normal.x.abs(), 0.55, 0.75].map(|c: f64| (255.0 * (c * lit).clamp(0.0, 1.0).sqrt()) as u8);
    Rgb(tint)
}
