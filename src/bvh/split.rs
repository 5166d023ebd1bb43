//! Where a set of boxes is split in two: surface area heuristic over bins (Wald 2007).

use super::build::{Box8, Item, half_area_of};
use fearless_simd::{Simd, f32x4, prelude::*};

/// Below this depth items are halved by number, which ends within 32 more levels.
pub(super) const DEEPEST_SAH: u32 = 64;

const BINS: usize = 16;

/// The first `mid` items are the one part, in the box `left`; the others the other.
pub(super) struct Split {
    pub(super) mid: usize,
    pub(super) left: Box8,
    pub(super) right: Box8,
}

fn halve<S: Simd>(simd: S, items: &[Item]) -> Split {
    let mid = items.len() / 2;
    let (a, b) = items.split_at(mid);
    Split { mid, left: Box8::around(simd, a), right: Box8::around(simd, b) }
}

/// Adding this rounds to an integer, which is then in the lowest bits.
const TO_INTEGER: f32 = 8_388_608.0; // 2²³

/// Which bin an item's centre falls into, on all three axes.
struct Binning<S: Simd, const BINS: usize> {
    simd: S,
    least: f32x4<S>,
    scale: f32x4<S>,
}

impl<S: Simd, const BINS: usize> Binning<S, BINS> {
    #[inline(always)]
    fn bins(&self, item: &Item) -> [usize; 3] {
        let at = (item.middle(self.simd) - self.least) * self.scale;
        let at: [f32; 4] = (at + f32x4::splat(self.simd, TO_INTEGER)).into();
        let bin = [at[0].to_bits(), at[1].to_bits(), at[2].to_bits()];
        [bin[0] as usize & (BINS - 1), bin[1] as usize & (BINS - 1), bin[2] as usize & (BINS - 1)]
    }
}

/// What the bins hold, by axis.
struct Bins<const BINS: usize> {
    bounds: [[Box8; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl<const BINS: usize> Bins<BINS> {
    #[inline(always)]
    fn put<S: Simd>(&mut self, binning: &Binning<S, BINS>, item: &Item) {
        let count = item.count();
        for (axis, bin) in binning.bins(item).into_iter().enumerate() {
            self.counts[axis][bin] += count;
            self.bounds[axis][bin].grow(binning.simd, &item.0);
        }
    }
}

/// Below this number of items half the bins do.
const FEW: usize = 128;

/// Reorders the items, two or more, into two parts. A leaf that holds up to 2^`leaf` of them is tested as one.
#[inline(always)]
pub(super) fn split<S: Simd>(simd: S, items: &mut [Item], depth: u32, leaf: u32) -> Split {
    if items.len() < FEW {
        split_in_bins::<S, { BINS / 2 }>(simd, items, depth, leaf)
    } else {
        split_in_bins::<S, BINS>(simd, items, depth, leaf)
    }
}

#[inline(always)]
fn split_in_bins<S: Simd, const BINS: usize>(simd: S, items: &mut [Item], depth: u32, leaf: u32) -> Split {
    let mut least = f32x4::splat(simd, f32::INFINITY);
    let mut most = f32x4::splat(simd, f32::NEG_INFINITY);
    for item in &*items {
        let m = item.middle(simd);
        least = least.min(m);
        most = most.max(m);
    }
    let extent: [f32; 4] = (most - least).into();
    // Rounded to the nearest, the largest centre falls into the last bin. Subnormal extents divide to infinity.
    let scale = extent.map(|e| (BINS - 1) as f32 / e).map(|s| if s.is_finite() { s } else { 0.0 });
    if scale[..3] == [0.0; 3] || depth >= DEEPEST_SAH {
        return halve(simd, items);
    }
    let binning = Binning::<S, BINS> { simd, least, scale: scale.simd_into(simd) };
    let mut bins = Bins { bounds: [[Box8::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };
    // From two places in turn: neighbours share a bin, and would wait for each other.
    let (first, second) = items.split_at(items.len() / 2);
    for (a, b) in first.iter().zip(second) {
        bins.put(&binning, a);
        bins.put(&binning, b);
    }
    if items.len() % 2 == 1 {
        bins.put(&binning, &second[second.len() - 1]);
    }
    let Bins { bounds, counts } = &bins;
    let leaves = |count: u32| ((count + (1 << leaf) - 1) >> leaf) as f32;
    // The axes beside each other, so that none waits for its own areas.
    let mut costs = [[0.0f32; BINS]; 3];
    let (mut b, mut count) = ([Box8::EMPTY.load(simd); 3], [0; 3]);
    for i in (1..BINS).rev() {
        for axis in 0..3 {
            b[axis] = b[axis].min(bounds[axis][i].load(simd));
            count[axis] += counts[axis][i];
            costs[axis][i] = half_area_of(b[axis]) * leaves(count[axis]);
        }
    }
    let (mut b, mut count) = ([Box8::EMPTY.load(simd); 3], [0; 3]);
    for i in 1..BINS {
        for axis in 0..3 {
            b[axis] = b[axis].min(bounds[axis][i - 1].load(simd));
            count[axis] += counts[axis][i - 1];
            costs[axis][i] += half_area_of(b[axis]) * leaves(count[axis]);
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&axis| scale[axis] != 0.0) {
        for (i, &cost) in costs[axis].iter().enumerate().skip(1) {
            // The first bin and the last are never empty. Infinite boxes cost infinitely much everywhere.
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    let (_, axis, boundary) = best;
    if boundary == 0 {
        return halve(simd, items);
    }
    let (mut left, mut right) = (Box8::EMPTY, Box8::EMPTY);
    for (i, bin) in bounds[axis].iter().enumerate() {
        (if i < boundary { &mut left } else { &mut right }).grow(simd, bin);
    }
    // Without branches: which way an item goes cannot be foreseen.
    let mut mid = 0;
    let least: [f32; 4] = least.into();
    let (least, scale) = (least[axis], scale[axis]);
    for i in 0..items.len() {
        let item = items[i];
        let bin = (item.0.middle(axis) - least) * scale + TO_INTEGER;
        let goes_left = (bin.to_bits() as usize & (BINS - 1)) < boundary;
        items[i] = items[mid];
        items[mid] = item;
        mid += usize::from(goes_left);
    }
    Split { mid, left, right }
}
