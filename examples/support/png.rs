//! A PNG that is whole or not there.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::{fs, process};

/// Writes sRGB bytes to `path` by way of a temporary file beside it, which is removed if anything goes wrong.
pub(crate) fn write(path: &Path, [width, height]: [u32; 2], bytes: &[u8]) -> Result<(), String> {
    let temporary = beside(path);
    let attempt = encode(&temporary, width, height, bytes).and_then(|()| fs::rename(&temporary, path));
    attempt.map_err(|error| {
        // It may not exist; then there is nothing to remove.
        let _ = fs::remove_file(&temporary);
        format!("cannot write {}: {error}", path.display())
    })
}

/// Fails early if `path` cannot be written: better before the work than after it.
pub(crate) fn check(path: &Path) -> Result<(), String> {
    let temporary = beside(path);
    let attempt = if path.is_dir() { Err(io::ErrorKind::IsADirectory.into()) } else { fs::write(&temporary, []) };
    let attempt = attempt.and_then(|()| fs::remove_file(&temporary));
    attempt.map_err(|error| format!("cannot write {}: {error}", path.display()))
}

fn encode(path: &Path, width: u32, height: u32, bytes: &[u8]) -> io::Result<()> {
    use image::ImageEncoder;
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut file = BufWriter::new(fs::File::create(path)?);
    PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Adaptive)
        .write_image(bytes, width, height, image::ExtendedColorType::Rgb8)
        .map_err(io::Error::other)?;
    file.flush()?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}.part", process::id()))
}
