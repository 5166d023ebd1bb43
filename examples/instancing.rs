//! One mesh, many places: a dahlia of two hundred petals that are all the same `Arc<Mesh>`.
//!
//! `cargo run --release --example instancing`

#[path = "support/args.rs"]
mod args;
#[path = "support/draw.rs"]
mod draw;
#[path = "support/png.rs"]
mod png;
#[path = "support/stage.rs"]
mod stage;

use args::Args;
use stage::{Props, Stage};
use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use truehit::glam::{DAffine3, DVec3};
use truehit::shading::color::srgb;
use truehit::shading::{Background, Light, Material, Mirror, Rgb};
use truehit::{Affine, InvalidShape, Mesh, Plane};

const HELP: &str = "\
Renders a flower of two hundred petals that share one mesh.

Usage: cargo run --release --example instancing -- [OPTIONS]

  --size WIDTHxHEIGHT  in pixels [default: 960x640]
  --samples N          camera rays a pixel, rounded up to a square [default: 4]
  --threads N          [default: 0, one per core]
  -o, --output FILE    [default: instancing.png]
  -h, --help           this text";

const PETALS: u32 = 200;

fn main() -> ExitCode {
    args::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(args) = Args::parse(HELP, Args::new("instancing.png"))? else { return Ok(()) };
    // Before anything is said: an output that cannot be written is no success.
    png::check(&args.output)?;
    let petal = Arc::new(petal()?);
    let triangles = petal.triangles().len();
    println!("{triangles} triangles in memory, {} in the picture", triangles * PETALS as usize);
    let stage = stage(&petal)?;
    Ok(draw::draw(&stage.whitted(), &stage.camera(args.size)?, &args)?)
}

/// The flower: petal k stands at k golden angles around, the further out the lower and larger.
fn stage(petal: &Arc<Mesh>) -> Result<Stage, InvalidShape> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let mut props = Props::default();
    let table = Material::matt(srgb(38, 84, 92)).with_mirror(Mirror::fading([0.18; 3], 3.0));
    props.put("table", Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, &table);
    for k in 0..PETALS {
        // 0 in the heart, 1 at the rim.
        let out = (f64::from(k) / f64::from(PETALS)).sqrt();
        let heart = srgb(128, 22, 60);
        let middle = srgb(232, 92, 110);
        let rim = srgb(253, 222, 210);
        let color = if out < 0.4 { heart.lerp(middle, out / 0.4) } else { middle.lerp(rim, (out - 0.4) / 0.6) };
        let material = Material::matt(color).with_gloss(0.18, 40.0);
        let place = DAffine3::from_rotation_z(golden_angle * f64::from(k))
            * DAffine3::from_translation(DVec3::new(0.8 * out, 0.0, 0.08 + 0.3 * (1.0 - out * out)))
            * DAffine3::from_rotation_y(-1.4 + 1.25 * out)
            * DAffine3::from_scale(DVec3::splat(0.5 + 0.62 * out));
        props.put("petal", Affine::new(Arc::clone(petal), place)?, &material);
    }
    let (scene, names) = props.finish();
    let target = DVec3::new(0.0, 0.0, 0.42);
    let lights = vec![
        Light::point([-4.0, -4.0, 7.0], [0.86, 0.82, 0.76]),
        Light::directional([0.9, -0.6, 0.5], [0.16, 0.17, 0.22]),
    ];
    Ok(Stage {
        scene,
        names,
        lights,
        ambient: Rgb::splat(0.22),
        background: Background::Sky { up: DVec3::Z, horizon: srgb(130, 160, 164), zenith: srgb(60, 100, 110) },
        eye: DVec3::new(0.0, -4.6, 6.2),
        target,
        up: DVec3::Z,
        field_of_view: 26.0,
    })
}

/// A petal along x from the origin, of length one, hollow above: a grid with smooth normals.
fn petal() -> Result<Mesh, InvalidShape> {
    const ALONG: u32 = 24;
    const ACROSS: u32 = 16;
    let surface = |s: f64, t: f64| {
        let width = 0.3 * (std::f64::consts::PI * s.powf(1.1)).sin().max(0.0).powf(0.7);
        DVec3::new(s, width * t, 0.22 * s * s + 0.5 * width * t * t)
    };
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for i in 0..=ALONG {
        for j in 0..=ACROSS {
            // Not quite to the tips, where the width and with it the normal vanishes.
            let s = 0.01 + 0.98 * f64::from(i) / f64::from(ALONG);
            let t = 2.0 * f64::from(j) / f64::from(ACROSS) - 1.0;
            let h = 1e-5;
            let along = surface(s + h, t) - surface(s - h, t);
            let across = surface(s, t + h) - surface(s, t - h);
            positions.push(surface(s, t));
            normals.push(along.cross(across).normalize());
        }
    }
    let vertex = |i, j| i * (ACROSS + 1) + j;
    let quad = |i, j| [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
    let quads = (0..ALONG).flat_map(|i| (0..ACROSS).map(move |j| quad(i, j)));
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::new(positions, triangles)?.with_normals(normals)
}
