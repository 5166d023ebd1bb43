//! The scene signature: which object each pixel sees.

use crate::{Camera, Interval, Raster, Scene};

/// The index of the first object seen through each pixel's centre, or `None`: the simplest picture of geometry, and
/// the one to look at when a picture is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Signature {
    ids: Raster<Option<usize>>,
    /// Pixels per object.
    counts: Vec<usize>,
}

impl Signature {
    /// The signature of `scene` seen by `camera`.
    #[must_use]
    pub fn of<M: Sync>(scene: &Scene<M>, camera: &Camera) -> Self {
        let see = |i, j| scene.intersect(&camera.pixel(i, j), Interval::FORWARD).map(|found| found.object);
        let ids =
            Raster::from_rows(camera.width(), camera.height(), |j| (0..camera.width()).map(|i| see(i, j)).collect());
        let mut counts = vec![0; scene.len()];
        for &object in ids.values().iter().flatten() {
            counts[object] += 1;
        }
        Self { ids, counts }
    }

    /// The object of each pixel.
    #[must_use]
    pub fn ids(&self) -> &Raster<Option<usize>> {
        &self.ids
    }

    /// How many pixels show `object`; zero if there is none of that index.
    #[must_use]
    pub fn count(&self, object: usize) -> usize {
        self.counts.get(object).copied().unwrap_or(0)
    }

    /// The id buffer as an image: sRGB bytes, red, green, blue, in rows from the top; black where nothing is hit.
    #[must_use]
    pub fn to_srgb8(&self) -> Vec<u8> {
        self.ids.values().iter().flat_map(|id| id.map_or([0; 3], color)).collect()
    }
}

/// The colour of `object`, as sRGB bytes: never black, and a different one for each of the first 2²⁴ − 1 objects.
#[must_use]
pub fn color(object: usize) -> [u8; 3] {
    // Multiplication by an odd number permutes the numbers modulo 2²⁴ and leaves 0 where it is. Of some ten thousand
    // tried this one keeps black and the first 24 colours furthest apart: 96 in the RGB cube of side 255.
    const SPREAD: u32 = 0x000A_A61F;
    let hash = (object % 0x00FF_FFFF) as u32 + 1;
    let [_, r, g, b] = (hash.wrapping_mul(SPREAD) & 0x00FF_FFFF).to_be_bytes();
    [r, g, b]
}
