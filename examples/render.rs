//! The main job: a scene → a picture.
//!
//! `cargo run --release --example render`, and `-- --help` for the rest.

#[path = "support/args.rs"]
mod args;
#[path = "support/draw.rs"]
mod draw;
#[path = "support/flake.rs"]
mod flake;
#[path = "support/gallery.rs"]
mod gallery;
#[path = "support/obj.rs"]
mod obj;
#[path = "support/png.rs"]
mod png;
#[path = "support/product.rs"]
mod product;
#[path = "support/stage.rs"]
mod stage;

use args::Args;
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use truehit::shading::ImageTexture;

const HELP: &str = "\
Renders a scene, or a mesh from a file, to a PNG.

Usage: cargo run --release --example render -- [OPTIONS]

  --scene NAME         gallery: every shape, textures and mirrors [default]
                       flake: balls on balls, mirrors in mirrors
  --mesh FILE.obj      this mesh instead, framed automatically
  --texture FILE       an image (PNG or JPEG) for the mesh's texture coordinates
  --orbit AROUND,ABOVE where the camera stands around the mesh, in degrees [default: 30,18]
  --eye X,Y,Z          or where it stands, in the mesh's coordinates (y is up), and
  --target X,Y,Z       where it looks [default: the middle]: for a view from inside
  --size WIDTHxHEIGHT  in pixels [default: 960x640]
  --samples N          camera rays a pixel, rounded up to a square [default: 4]
  --threads N          [default: 0, one per core]
  -o, --output FILE    [default: render.png]
  -h, --help           this text";

fn main() -> ExitCode {
    args::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(args) = Args::parse(HELP, Args::new("render.png"))? else { return Ok(()) };
    let stage = match (&args.mesh, args.scene.as_deref()) {
        (Some(_), Some(_)) => return Err("--mesh and --scene exclude each other".into()),
        (Some(path), None) => {
            let texture = args.texture.as_deref().map(load_texture).transpose()?;
            product::product(obj::load(path)?, texture, args.orbit, args.view, args.size)?
        }
        (None, Some("gallery") | None) => gallery::gallery()?,
        (None, Some("flake")) => flake::flake()?,
        (None, Some(name)) => return Err(format!("there is no scene {name:?}; --help lists them").into()),
    };
    Ok(draw::draw(&stage.whitted(), &stage.camera(args.size)?, &args)?)
}

fn load_texture(path: &Path) -> Result<ImageTexture, String> {
    let picture = image::open(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?.to_rgb8();
    ImageTexture::from_srgb8(picture.width(), picture.height(), picture.as_raw())
        .map_err(|error| format!("{}: {error}", path.display()))
}
