//! The scene of `render` and `signature`: every shape once or more. x is right, y away from the camera, z up.

use crate::stage::{Props, Stage};
use std::error::Error;
use std::f64::consts::TAU;
use truehit::glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use truehit::shading::color::srgb;
use truehit::shading::{Background, Checker, ImageTexture, Light, Material, Mirror, Rgb, Texture};
use truehit::{Affine, Cone, Cylinder, Mesh, Plane, Polygon, Sphere, Triangle};

/// A still life in front of a wall.
pub(crate) fn gallery() -> Result<Stage, Box<dyn Error>> {
    let plaster = Material::matt(srgb(226, 178, 152));
    let teal = Material::matt(srgb(24, 104, 112)).with_gloss(0.15, 30.0);
    let navy = Material::matt(srgb(34, 50, 94)).with_gloss(0.12, 30.0);
    let mustard = Material::matt(srgb(222, 160, 40)).with_gloss(0.35, 60.0);
    let coral = Material::matt(srgb(214, 82, 62)).with_gloss(0.6, 150.0).with_mirror(Mirror::even([0.06; 3]));
    let sage = Material::matt(srgb(134, 162, 128)).with_gloss(0.5, 90.0).with_mirror(Mirror::even([0.05; 3]));
    let cream = Material::matt(srgb(238, 226, 204)).with_gloss(0.3, 40.0);
    let chrome = Material::matt([0.02; 3]).with_gloss(0.9, 900.0).with_mirror(Mirror::even([0.86, 0.88, 0.9]));
    let gold = Material::matt(srgb(150, 98, 30)).with_gloss(0.9, 120.0).with_mirror(Mirror::even([0.5, 0.36, 0.14]));
    let floor = Material::matt([1.0; 3])
        .with_texture(Checker::new(srgb(236, 214, 192), srgb(196, 150, 126), [1.0, 1.0]))
        .with_gloss(0.1, 60.0)
        .with_mirror(Mirror::fading([0.22; 3], 2.5));

    let mut props = Props::default();
    props.put("floor (plane)", Plane::new([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])?, &floor);
    props.put("wall (plane)", Plane::new([0.0, 3.4, 0.0], [0.0, -1.0, 0.0])?, &plaster);

    // Flat shapes behind: a moon gate, a sail, and a star that crosses itself.
    let gate = circle([-1.05, 1.9, 1.5], 1.5, 96);
    let moon = circle([-1.05, 1.9, 1.62], 0.95, 96);
    props.put("moon gate (polygon with a hole)", Polygon::with_holes(&gate, &[&moon])?, &teal);
    props.put("sail (triangle)", Triangle::new([0.9, 2.3, 0.0], [3.3, 2.5, 0.0], [2.7, 2.4, 3.1])?, &navy);
    let star: Vec<DVec3> = (0..8).map(|k| circle([1.15, 3.3, 2.75], 0.5, 8)[k * 3 % 8]).collect();
    props.put("star (self-intersecting polygon)", Polygon::new(&star)?, &mustard);

    // The knot on its plinth, framed by the gate.
    props.put(
        "plinth (cylinder)",
        Cylinder::new([-1.05, 0.75, 0.0], [-1.05, 0.75, 0.5], 0.72)?,
        &cream.clone().with_texture(Terrazzo),
    );
    let stand = DAffine3::from_translation(DVec3::new(-1.05, 0.75, 1.28))
        * DAffine3::from_rotation_z(0.5)
        * DAffine3::from_rotation_x(TAU / 4.0);
    props.put("knot (smooth mesh)", Affine::new(knot()?, stand)?, &gold);

    // Solids to the right.
    props.put("spire (cone)", Cone::new([2.15, 1.2, 0.0], [2.15, 1.2, 1.9], 0.52)?, &mustard);
    props.put("mirror ball (sphere)", Sphere::new([0.82, -0.15, 0.66], 0.66)?, &chrome);
    props.put("vase (truncated cone)", Cone::truncated([-2.6, 0.2, 0.0], [-2.6, 0.2, 0.95], 0.34, 0.52)?, &sage);
    props.put("apple (sphere)", Sphere::new([-2.6, 0.2, 1.27], 0.32)?, &coral);

    // A sphere made a pebble by an affine map, striped by an image.
    let pebble = DAffine3::from_scale_rotation_translation(
        DVec3::new(0.62, 0.42, 0.3),
        DQuat::from_rotation_z(-0.5) * DQuat::from_rotation_y(0.12),
        DVec3::new(-0.62, -1.05, 0.302),
    );
    let stripes =
        Material::matt([1.0; 3]).with_texture(stripes()?).with_gloss(0.6, 120.0).with_mirror(Mirror::even([0.07; 3]));
    props.put("pebble (affinely deformed sphere)", Affine::new(Sphere::UNIT, pebble)?, &stripes);
    props.put("log (cylinder)", Cylinder::new([1.6, -1.0, 0.2], [2.35, -0.55, 0.2], 0.2)?, &teal);
    props.put("marble (sphere)", Sphere::new([0.35, -1.45, 0.16], 0.16)?, &mustard);
    props.put(
        "marble (sphere)",
        Sphere::new([-1.85, -0.75, 0.2], 0.2)?,
        &navy.clone().with_gloss(0.7, 200.0).with_mirror(Mirror::even([0.1; 3])),
    );

    let (scene, names) = props.finish();
    let target = DVec3::new(-0.1, 0.6, 1.02);
    let lights = vec![
        Light::point([-4.2, -4.6, 6.2], [0.86, 0.76, 0.64]),
        Light::directional([0.9, -0.7, 0.55], [0.10, 0.13, 0.2]),
    ];
    Ok(Stage {
        scene,
        names,
        lights,
        ambient: Rgb::new(0.2, 0.19, 0.21),
        background: Background::Sky { up: DVec3::Z, horizon: srgb(246, 214, 186), zenith: srgb(120, 150, 180) },
        eye: DVec3::new(0.35, -7.6, 2.15),
        target,
        up: DVec3::Z,
        field_of_view: 30.0,
    })
}

/// An upright circle, as a polygon of `n` corners that faces the camera.
fn circle(center: [f64; 3], radius: f64, n: usize) -> Vec<DVec3> {
    let turn = |k: usize| TAU * k as f64 / n as f64;
    (0..n).map(|k| DVec3::from(center) + radius * DVec3::new(turn(k).sin(), 0.0, -turn(k).cos())).collect()
}

/// A tube around the (2, 3) torus knot, within radius 0.8 of the z axis.
fn knot() -> Result<Mesh, truehit::InvalidShape> {
    const ALONG: u32 = 360;
    const AROUND: u32 = 36;
    let curve = |t: f64| {
        let r = 0.42 + 0.19 * (1.5 * t).cos();
        DVec3::new(r * t.cos(), r * t.sin(), 0.25 * (1.5 * t).sin())
    };
    let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..ALONG {
        let t = 2.0 * TAU * f64::from(i) / f64::from(ALONG);
        let tangent = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
        let inward = tangent.cross(DVec3::Z).normalize();
        let frame = DMat3::from_cols(inward, inward.cross(tangent), tangent);
        for j in 0..AROUND {
            let angle = TAU * f64::from(j) / f64::from(AROUND);
            let normal = frame * DVec3::new(angle.cos(), -angle.sin(), 0.0);
            positions.push(curve(t) + 0.115 * normal);
            normals.push(normal);
            uvs.push(DVec2::new(f64::from(i) / f64::from(ALONG), f64::from(j) / f64::from(AROUND)));
        }
    }
    let vertex = |i: u32, j: u32| i % ALONG * AROUND + j % AROUND;
    let quad = |i, j| [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
    let quads = (0..ALONG).flat_map(|i| (0..AROUND).map(move |j| quad(i, j)));
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::new(positions, triangles)?.with_normals(normals)?.with_uvs(uvs)
}

/// Bands of latitude, as a picture file would hold them.
fn stripes() -> Result<ImageTexture, truehit::shading::InvalidTexture> {
    const BANDS: [[u8; 3]; 5] = [[34, 50, 94], [238, 226, 204], [214, 82, 62], [238, 226, 204], [24, 104, 112]];
    let rows = 320_usize;
    let texels: Vec<u8> = (0..rows).flat_map(|row| BANDS[(row * 11 / rows) % BANDS.len()]).collect();
    ImageTexture::from_srgb8(1, rows as u32, &texels)
}

/// Chips of stone in cream: each cell of a grid has one, of a place, size and colour of its own.
#[derive(Debug)]
struct Terrazzo;

impl Texture for Terrazzo {
    fn color(&self, at: DVec2) -> Rgb {
        let p = at * DVec2::new(26.0, 8.0);
        let cell = p.floor();
        for dx in [-1.0, 0.0, 1.0] {
            for dy in [-1.0, 0.0, 1.0] {
                let corner = cell + DVec2::new(dx, dy);
                let random = |salt: f64| {
                    (corner.dot(DVec2::new(127.1, 311.7)) + salt).sin().mul_add(43758.5453, 0.0).rem_euclid(1.0)
                };
                let center = corner + DVec2::new(random(0.0), random(1.7));
                let d = p - center;
                // Chips are triangles, more or less, turned any way.
                let turn = TAU * random(3.1);
                let reach = 0.12 + 0.26 * random(5.3);
                let radius = reach * (0.8 + 0.25 * (3.0 * d.y.atan2(d.x) + turn).cos());
                if d.length() < radius {
                    let chips = [srgb(196, 110, 86), srgb(92, 112, 116), srgb(214, 170, 96), srgb(160, 140, 122)];
                    return chips[(4.0 * random(7.9)) as usize % 4];
                }
            }
        }
        Rgb::ONE
    }
}
