//! The scene signature: which object each pixel sees, as a picture and as numbers.
//!
//! `cargo run --release --example signature`

#[path = "support/args.rs"]
mod args;
#[path = "support/gallery.rs"]
mod gallery;
#[path = "support/png.rs"]
mod png;
#[path = "support/stage.rs"]
mod stage;

use args::Args;
use std::error::Error;
use std::process::ExitCode;
use truehit::signature::{Signature, color};

const HELP: &str = "\
Writes the scene signature of the gallery to a PNG, one colour an object, and a legend to the terminal.

Usage: cargo run --release --example signature -- [OPTIONS]

  --size WIDTHxHEIGHT  in pixels [default: 960x640]
  -o, --output FILE    [default: signature.png]
  -h, --help           this text";

fn main() -> ExitCode {
    args::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(args) = Args::parse(HELP, Args::new("signature.png"))? else { return Ok(()) };
    png::check(&args.output)?;
    let stage = gallery::gallery()?;
    let signature = Signature::of(&stage.scene, &stage.camera(args.size)?);
    png::write(&args.output, args.size, &signature.to_srgb8())?;
    println!("{:>6}  {:<7}  {:>7}  object", "id", "colour", "pixels");
    for (object, name) in stage.names.iter().enumerate() {
        let [r, g, b] = color(object);
        println!("{object:>6}  #{r:02x}{g:02x}{b:02x}  {:>7}  {name}", signature.count(object));
    }
    let none = signature.ids().values().iter().filter(|id| id.is_none()).count();
    println!("{:>6}  #000000  {none:>7}  nothing", "-");
    println!("{}", args.output.display());
    Ok(())
}
