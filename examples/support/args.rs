//! The command line that the examples share. An example has those options that its help names.
#![allow(dead_code, reason = "each example reads its part of the arguments")]
use lexopt::prelude::*;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

/// What was asked for.
#[derive(Clone, Debug)]
pub(crate) struct Args {
    /// Pixels: [width, height].
    pub(crate) size: [u32; 2],
    /// Each pixel is divided into this many cells per side.
    pub(crate) strata: u32,
    /// 0 for all cores.
    pub(crate) threads: usize,
    /// Where the PNG goes.
    pub(crate) output: PathBuf,
    /// A scene by name.
    pub(crate) scene: Option<String>,
    /// An OBJ file to render instead.
    pub(crate) mesh: Option<PathBuf>,
    /// An image to wrap around it.
    pub(crate) texture: Option<PathBuf>,
    /// Where the camera stands and where it looks, in the mesh's coordinates, instead of around it.
    pub(crate) view: [Option<[f64; 3]>; 2],
    /// Degrees: where the camera stands around the mesh, and how high.
    pub(crate) orbit: [f64; 2],
}

/// Reports an error on stderr.
pub(crate) fn exit_code(result: Result<(), Box<dyn Error>>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

impl Args {
    /// What holds without options.
    pub(crate) fn new(output: &str) -> Self {
        Self {
            size: [960, 640],
            strata: 2,
            threads: 0,
            output: PathBuf::from(output),
            scene: None,
            mesh: None,
            texture: None,
            view: [None; 2],
            orbit: [30.0, 18.0],
        }
    }

    /// Reads the command line. `None` after printing `help`.
    pub(crate) fn parse(help: &str, defaults: Args) -> Result<Option<Args>, lexopt::Error> {
        let mut args = defaults;
        let mut parser = lexopt::Parser::from_env();
        let mut samples: u32 = args.strata * args.strata;
        while let Some(arg) = parser.next()? {
            match arg {
                Long(name) if !help.contains(&format!("--{name} ")) && name != "help" => {
                    return Err(arg.unexpected());
                }
                Long("size") => args.size = parser.value()?.parse_with(size)?,
                Long("samples") => {
                    samples = parser.value()?.parse_with(|s| match s.parse() {
                        Ok(n @ 1..=65_536) => Ok(n),
                        _ => Err("must be a number from 1 to 65536"),
                    })?;
                }
                Long("threads") => args.threads = parser.value()?.parse()?,
                Short('o') | Long("output") => args.output = parser.value()?.into(),
                Long("scene") => args.scene = Some(parser.value()?.string()?),
                Long("mesh") => args.mesh = Some(parser.value()?.into()),
                Long("texture") => args.texture = Some(parser.value()?.into()),
                Long("orbit") => args.orbit = parser.value()?.parse_with(orbit)?,
                Long("eye") => args.view[0] = Some(parser.value()?.parse_with(point)?),
                Long("target") => args.view[1] = Some(parser.value()?.parse_with(point)?),
                Short('h') | Long("help") => {
                    println!("{help}");
                    return Ok(None);
                }
                other => return Err(other.unexpected()),
            }
        }
        args.strata = f64::from(samples).sqrt().ceil() as u32;
        Ok(Some(args))
    }
}

fn size(text: &str) -> Result<[u32; 2], &'static str> {
    let (width, height) = text.split_once(['x', '×']).ok_or("must look like 960x640")?;
    match [width.parse(), height.parse()] {
        [Ok(width @ 1..=16_384), Ok(height @ 1..=16_384)] => Ok([width, height]),
        _ => Err("must look like 960x640, each number from 1 to 16384"),
    }
}

fn point(text: &str) -> Result<[f64; 3], &'static str> {
    let numbers: Vec<f64> = text.split(',').filter_map(|x| x.trim().parse().ok()).collect();
    numbers.try_into().map_err(|_| "must look like 1.5,0,-2")
}

fn orbit(text: &str) -> Result<[f64; 2], &'static str> {
    let (around, above) = text.split_once(',').ok_or("must look like 30,20: degrees around and above")?;
    match [around.parse::<f64>(), above.parse::<f64>()] {
        [Ok(around), Ok(above)] if around.is_finite() && above.abs() <= 89.0 => Ok([around, above]),
        _ => Err("must look like 30,20: degrees around and above, the latter from -89 to 89"),
    }
}
