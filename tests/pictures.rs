//! Small pictures that someone has looked at, and that every thread count renders alike.
//!
//! `TRUEHIT_BLESS=1 cargo test --test pictures` writes them anew; look at each before it is committed.

#[path = "../examples/support/flake.rs"]
mod flake;
#[path = "../examples/support/gallery.rs"]
mod gallery;
#[path = "../examples/support/stage.rs"]
mod stage;

use stage::Stage;
use std::path::Path;
use truehit::Raster;
use truehit::shading::{RayCount, Rendering, Rgb};
use truehit::signature::Signature;

const SIZE: [u32; 2] = [72, 48];

fn render(stage: &Stage, strata: u32) -> Rendering {
    stage.whitted().render(&stage.camera(SIZE).unwrap(), strata)
}

/// Compares sRGB bytes with the golden picture of that name.
fn assert_golden(name: &str, bytes: &[u8]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name).with_extension("png");
    if std::env::var_os("TRUEHIT_BLESS").is_some() {
        image::save_buffer(&path, bytes, SIZE[0], SIZE[1], image::ExtendedColorType::Rgb8).unwrap();
    }
    let golden = image::open(&path).unwrap().into_rgb8();
    assert_eq!(<[u32; 2]>::from(golden.dimensions()), SIZE);
    // Another platform's powf and sin may round a byte the other way, or move a jagged edge in a mirror by a sample.
    let differences = golden.as_raw().iter().zip(bytes).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    println!("{name}: {differences} of {} bytes differ", bytes.len());
    assert!(differences * 200 < bytes.len(), "{name}: {differences} of {} bytes differ", bytes.len());
}

#[test]
fn the_gallery_looks_as_it_did() {
    let rendering = render(&gallery::gallery().unwrap(), 3);
    assert_golden("gallery", &rendering.picture.to_srgb8());
    assert_eq!(rendering.rays.camera, 72 * 48 * 9);
    assert!(rendering.rays.shadow > 20_000 && rendering.rays.mirror > 5_000, "{:?}", rendering.rays);
}

#[test]
fn the_flake_looks_as_it_did() {
    assert_golden("flake", &render(&flake::flake().unwrap(), 2).picture.to_srgb8());
}

#[test]
fn the_signature_looks_as_it_did_and_shows_every_object() {
    let stage = gallery::gallery().unwrap();
    let signature = Signature::of(&stage.scene, &stage.camera(SIZE).unwrap());
    assert_golden("signature", &signature.to_srgb8());
    for (object, name) in stage.names.iter().enumerate() {
        assert!(signature.count(object) > 8, "{name} is hardly seen: {} pixels", signature.count(object));
    }
}

/// The definition of a picture: pixel by pixel, sample by sample, on this thread.
fn one_by_one(stage: &Stage, strata: u32) -> Rendering {
    let (whitted, camera) = (stage.whitted(), stage.camera(SIZE).unwrap());
    let mut rays = RayCount::default();
    let mut rows: Vec<Vec<Rgb>> = Vec::new();
    for j in 0..camera.height() {
        let mut row = Vec::new();
        for i in 0..camera.width() {
            let samples = strata * strata;
            let sum: Rgb = (0..samples).map(|s| whitted.radiance(&camera.sample(i, j, s, strata), &mut rays)).sum();
            row.push(sum / f64::from(samples));
        }
        rows.push(row);
    }
    Rendering { picture: Raster::from_rows(SIZE[0], SIZE[1], |j| rows[j as usize].clone()), rays }
}

#[test]
fn a_picture_is_the_same_bits_at_any_thread_count() {
    let stage = gallery::gallery().unwrap();
    let expected = one_by_one(&stage, 2);
    assert_eq!(render(&stage, 2), expected);
    #[cfg(feature = "rayon")]
    for threads in [1, 2, 3, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| render(&stage, 2)), expected, "{threads} threads");
    }
}
