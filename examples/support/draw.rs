//! From a stage to a file, with a progress bar and a last line that says what it took.

use crate::args::Args;
use crate::png;
use indicatif::{ProgressBar, ProgressStyle};
use std::time::Instant;
use truehit::Camera;
use truehit::shading::Whitted;

/// Renders what `camera` sees and writes it to `args.output`.
pub(crate) fn draw(whitted: &Whitted<'_>, camera: &Camera, args: &Args) -> Result<(), String> {
    png::check(&args.output)?;
    // Draws to stderr, and to nothing where that is not a terminal.
    let bar = ProgressBar::new(camera.height().into());
    let style = "{bar:40} {pos}/{len} rows, {eta} left";
    bar.set_style(ProgressStyle::with_template(style).map_err(|error| error.to_string())?);
    let start = Instant::now();
    let rendering = on_threads(args.threads, || whitted.render_with(camera, args.strata, |_| bar.inc(1)))?;
    let seconds = start.elapsed().as_secs_f64();
    bar.finish_and_clear();
    png::write(&args.output, args.size, &rendering.picture.to_srgb8())?;
    let rays = rendering.rays;
    println!(
        "{}: {} × {}, {:.2} s, {:.2} M rays ({:.2} camera, {:.2} shadow, {:.2} mirror), {:.2} M rays/s",
        args.output.display(),
        args.size[0],
        args.size[1],
        seconds,
        rays.total() as f64 / 1e6,
        rays.camera as f64 / 1e6,
        rays.shadow as f64 / 1e6,
        rays.mirror as f64 / 1e6,
        rays.total() as f64 / 1e6 / seconds
    );
    Ok(())
}

/// Runs `work` in a pool of `threads` threads; 0 for one per core.
#[cfg(feature = "rayon")]
pub(crate) fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    Ok(pool.map_err(|error| format!("cannot start {threads} threads: {error}"))?.install(work))
}

/// Runs `work` on this thread, the only one without the feature `rayon`.
#[cfg(not(feature = "rayon"))]
pub(crate) fn on_threads<R>(threads: usize, work: impl FnOnce() -> R) -> Result<R, String> {
    if threads > 1 {
        return Err(format!("cannot start {threads} threads: built without the feature rayon"));
    }
    Ok(work())
}
