//! A mesh from a file, put on a turntable and framed. x is right, y up, z towards the camera.

use crate::obj::Obj;
use crate::stage::{Props, Stage, half_extent};
use indicatif::{ProgressBar, ProgressStyle};
use std::error::Error;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use truehit::glam::{DMat3, DVec3};
use truehit::shading::color::srgb;
use truehit::shading::{Background, ImageTexture, Light, Material, Mirror, Rgb};
use truehit::{Aabb, Cone, InvalidShape, Mesh, Plane};

/// The picture's vertical angle from outside, in degrees.
const FIELD_OF_VIEW: f64 = 24.0;

/// `obj` seen from `around` degrees to the right of its front and `above` degrees above its middle, as near as shows
/// it whole in a picture of this `size`; or from `eye`, by a sun overhead and a lamp at the camera.
pub(crate) fn product(
    obj: Obj,
    texture: Option<ImageTexture>,
    [around, above]: [f64; 2],
    [eye, target]: [Option<[f64; 3]>; 2],
    size: [u32; 2],
) -> Result<Stage, Box<dyn Error>> {
    let bounds = Aabb::around(&obj.positions);
    let middle = bounds.center();
    let radius = 0.5 * bounds.size().length();
    if radius == 0.0 {
        return Err("the mesh is a single point".into());
    }

    // The eye's direction, and the camera's frame.
    let (sin_around, cos_around) = around.to_radians().sin_cos();
    let (sin_above, cos_above) = above.to_radians().sin_cos();
    let back = DVec3::new(sin_around * cos_above, sin_above, cos_around * cos_above);
    let right = DVec3::Y.cross(back).normalize();
    let frame = DMat3::from_cols(right, back.cross(right), back).transpose();

    // A turntable just below, as wide as the mesh with a little around.
    let reach = obj.positions.iter().map(|p| (p - middle).with_y(0.0).length()).fold(0.0, f64::max);
    let foot = DVec3::new(middle.x, bounds.min.y, middle.z);
    let height = 0.06 * reach;
    let table = Cone::truncated(foot - height * DVec3::Y, foot, 1.12 * reach, 1.1 * reach)?;
    let ground = Plane::new(foot - height * DVec3::Y, DVec3::Y)?;

    // Far enough that every vertex and the table's front are inside the picture's pyramid, seen from in front of the
    // middle.
    let [horizontal, vertical] = half_extent(FIELD_OF_VIEW, size);
    let rim = (0..32).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 32.0).sin_cos();
        foot + 1.1 * reach * DVec3::new(cos, 0.0, sin)
    });
    let distance = obj.positions.iter().copied().chain(rim).map(|p| {
        let p = frame * (p - middle);
        p.z + (p.x.abs() / horizontal).max(p.y.abs() / vertical)
    });
    let distance = 1.06 * distance.fold(0.0, f64::max);

    let mut mesh = build(obj.positions, obj.triangles)?.with_normals(obj.normals)?;
    let mut material = Material::matt(srgb(214, 122, 84)).with_gloss(0.22, 40.0);
    if !obj.uvs.is_empty() {
        mesh = mesh.with_uvs(obj.uvs)?;
        if let Some(texture) = texture {
            material = Material::matt([1.0; 3]).with_gloss(0.22, 40.0).with_texture(texture);
        }
    } else if texture.is_some() {
        return Err("the mesh has no texture coordinates".into());
    }
    let mut props = Props::default();
    props.put("mesh", mesh, &material);
    let table_top = Material::matt(srgb(232, 226, 216)).with_mirror(Mirror::fading([0.14; 3], 0.8 * reach));
    props.put("turntable", table, &table_top);
    props.put("ground", ground, &Material::matt(srgb(196, 206, 208)));
    let (scene, names) = props.finish();

    let target = target.map_or(middle, DVec3::from);
    let (eye, lights, field_of_view) = if let Some(eye) = eye.map(DVec3::from) {
        let sun = Light::directional([0.3, 1.0, 0.2], [0.9, 0.85, 0.75]);
        (eye, vec![sun, Light::point(eye + 0.02 * radius * DVec3::Y, [0.35, 0.36, 0.4])], 55.0)
    } else {
        // Lights stand still relative to the camera: the key to the left and above, a cool one from the right.
        let from_camera = |x: f64, y: f64, z: f64| frame.transpose() * DVec3::new(x, y, z);
        let key = Light::directional(from_camera(-0.7, 0.95, 0.75), [0.80, 0.76, 0.70]);
        let fill = Light::directional(from_camera(0.9, 0.35, 0.5), [0.14, 0.17, 0.22]);
        (middle + distance * back, vec![key, fill], FIELD_OF_VIEW)
    };
    Ok(Stage {
        scene,
        names,
        lights,
        ambient: Rgb::new(0.2, 0.21, 0.22),
        background: Background::Sky { up: DVec3::Y, horizon: srgb(214, 222, 224), zenith: srgb(120, 150, 172) },
        eye,
        target,
        up: DVec3::Y,
        field_of_view,
    })
}

/// A build that takes longer than this shows how far it is.
const PATIENCE: Duration = Duration::from_millis(300);

/// The mesh, with a progress bar if it is a large one.
fn build(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Mesh, InvalidShape> {
    let (start, mut bar) = (Instant::now(), None);
    let mesh = Mesh::new_observed(positions, triangles, &mut |share| {
        if start.elapsed() > PATIENCE {
            let bar = bar.get_or_insert_with(|| {
                // Draws to stderr, and to nothing where that is not a terminal.
                let style = ProgressStyle::with_template("{bar:40} {pos} % of the tree").expect("a template");
                ProgressBar::new(100).with_style(style)
            });
            bar.set_position((100.0 * share) as u64);
        }
        ControlFlow::Continue(())
    });
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    mesh
}
