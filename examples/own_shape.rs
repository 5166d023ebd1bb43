//! A shape of one's own: a paraboloid, whose mirror shows a ball in its focus as large as the mirror itself.
//!
//! `cargo run --release --example own_shape`

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
use std::f64::consts::TAU;
use std::process::ExitCode;
use truehit::glam::{DAffine3, DQuat, DVec2, DVec3, dvec2};
use truehit::shading::color::srgb;
use truehit::shading::{Background, Light, Material, Mirror, Rgb};
use truehit::{Aabb, Affine, Cylinder, Hit, Interval, Plane, Ray, Shape, Sphere};

/// z = x² + y² for z ≤ 1: an open dish with its focus at z = ¼. Its normal points out of the dish, downwards.
#[derive(Debug)]
struct Paraboloid;

impl Paraboloid {
    /// f(p) = x² + y² − z, zero on the surface and positive outside, and how far rounding may put it off.
    fn f(p: DVec3) -> (f64, f64) {
        (p.x * p.x + p.y * p.y - p.z, 4.0 * f64::EPSILON * (p.x * p.x + p.y * p.y + p.z.abs()))
    }
    fn gradient(p: DVec3) -> DVec3 {
        DVec3::new(2.0 * p.x, 2.0 * p.y, -1.0)
    }
}

impl Shape for Paraboloid {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        let (o, d) = (ray.origin, ray.direction);
        // f(o + λd) = aλ² + 2bλ + c, its roots without cancellation.
        let (a, b, c) = (d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y - 0.5 * d.z, Self::f(o).0);
        let q = -(b + (b * b - a * c).sqrt().copysign(b));
        let mut roots = [q / a, c / q];
        roots.sort_by(f64::total_cmp);
        // NaN is in no interval, so a negative discriminant misses.
        let lambda = roots.into_iter().find(|&l| within.min < l && l < within.max && ray.at(l).z <= 1.0)?;
        // By Newton: the error of a root is about f/f′ there. The point's own rounding counts for |∇f| of itself.
        let (p, size) = (ray.at(lambda), o.abs().max_element() + lambda.abs() * d.abs().max_element());
        let (f, rounding) = Self::f(p);
        let slope = Self::gradient(p).dot(d).abs();
        let error = 2.0 * (f.abs() + rounding + 4.0 * f64::EPSILON * size * Self::gradient(p).length()) / slope;
        Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 })
    }

    fn normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        Self::gradient(ray.at(hit.lambda)).normalize()
    }

    fn bounds(&self) -> Aabb {
        Aabb::new([-1.0, -1.0, 0.0], [1.0, 1.0, 1.0])
    }

    /// Optional: around the dish, and up from its bottom.
    fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
        let p = ray.at(hit.lambda);
        dvec2(p.y.atan2(p.x) / TAU, p.z)
    }

    /// Optional: a spawned ray has left once f at its origin certainly has the right sign.
    fn departs(&self, ray: &Ray, _: &Hit, outward: bool) -> bool {
        let (f, rounding) = Self::f(ray.origin);
        if outward { f > rounding } else { f < -rounding }
    }
}

const HELP: &str = "\
Renders a paraboloid, a shape that the crate does not have.

Usage: cargo run --release --example own_shape -- [OPTIONS]

  --size WIDTHxHEIGHT  in pixels [default: 960x640]
  --samples N          camera rays a pixel, rounded up to a square [default: 4]
  --threads N          [default: 0, one per core]
  -o, --output FILE    [default: own_shape.png]
  -h, --help           this text";

fn main() -> ExitCode {
    args::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(args) = Args::parse(HELP, Args::new("own_shape.png"))? else { return Ok(()) };
    let stage = stage()?;
    Ok(draw::draw(&stage.whitted(), &stage.camera(args.size)?, &args)?)
}

/// A dish that faces the camera, a ball in its focus.
fn stage() -> Result<Stage, Box<dyn Error>> {
    let mut props = Props::default();
    let floor = Material::matt(srgb(226, 206, 178)).with_mirror(Mirror::fading([0.2; 3], 3.0));
    props.put("floor", Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, &floor);
    let silver = Material::matt(srgb(60, 62, 66)).with_gloss(0.6, 300.0).with_mirror(Mirror::even([0.8; 3]));
    let dish = DAffine3::from_scale_rotation_translation(
        DVec3::splat(1.6),
        DQuat::from_rotation_arc(DVec3::Z, DVec3::new(-0.12, -1.0, 0.26).normalize()),
        DVec3::new(0.0, 1.0, 1.35),
    );
    props.put("dish", Affine::new(Paraboloid, dish)?, &silver);
    let red = Material::matt(srgb(216, 62, 44)).with_gloss(0.7, 150.0);
    let focus = dish.transform_point3(DVec3::new(0.0, 0.0, 0.25));
    props.put("ball", Sphere::new(focus, 0.12)?, &red);
    let stick = Material::matt(srgb(40, 42, 46)).with_gloss(0.3, 60.0);
    props.put("stick", Cylinder::new(dish.transform_point3(DVec3::ZERO), focus, 0.02)?, &stick);
    // A ring of columns around dish and camera, for the dish to bend.
    let colors = [srgb(24, 104, 112), srgb(222, 160, 40), srgb(238, 226, 204), srgb(34, 50, 94), srgb(134, 162, 128)];
    for k in 0..17_u32 {
        let (sin, cos) = (TAU * (f64::from(k) + 0.5) / 17.0).sin_cos();
        let foot = DVec3::new(4.6 * sin, 4.6 * cos, 0.0);
        let height = DVec3::new(0.0, 0.0, 1.0 + f64::from(k * 5 % 4) * 0.45);
        let material = Material::matt(colors[k as usize % 5]).with_gloss(0.3, 50.0);
        if foot.y > -2.0 || foot.x > 0.0 && foot.x < 1.5 {
            props.put("column", Cylinder::new(foot, foot + height, 0.3)?, &material);
        }
    }
    let (scene, names) = props.finish();
    let target = DVec3::new(0.0, 0.6, 1.3);
    let lights =
        vec![Light::directional([-4.0, -5.0, 6.0], [0.8; 3]), Light::directional([0.8, -0.5, 0.4], [0.16, 0.18, 0.24])];
    Ok(Stage {
        scene,
        names,
        lights,
        ambient: Rgb::splat(0.2),
        background: Background::Sky { up: DVec3::Z, horizon: srgb(238, 222, 204), zenith: srgb(96, 134, 166) },
        eye: DVec3::new(-1.4, -8.0, 2.6),
        target,
        up: DVec3::Z,
        field_of_view: 28.0,
    })
}
