//! Where a set of boxes is split in two: surface area heuristic over bins (Wald 2007).

use super::build::{Box8, Item, sides};
use fearless_simd::{Simd, f32x4, f32x8, i32x4, prelude::*};

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

/// What the bins hold: boxes by axis, counts of all axes beside each other, as far apart as boxes.
struct Bins<const BINS: usize> {
    bounds: [[Box8; BINS]; 3],
    counts: [[i32; 8]; BINS],
}

impl<const BINS: usize> Bins<BINS> {
    #[inline(always)]
    fn put<S: Simd>(&mut self, binning: &Binning<S, BINS>, item: &Item) {
        let count = item.count() as i32;
        for (axis, bin) in binning.bins(item).into_iter().enumerate() {
            self.counts[bin][axis] += count;
            self.bounds[axis][bin].grow(binning.simd, &item.0);
        }
    }
}

/// One part of a split, of the axes beside each other.
struct Side<S: Simd> {
    simd: S,
    bounds: [f32x8<S>; 3],
    count: i32x4<S>,
}

impl<S: Simd> Side<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let empty = Box8::EMPTY.load(simd);
        Self { simd, bounds: [empty, empty, empty], count: i32x4::splat(simd, 0) }
    }

    #[inline(always)]
    fn take<const BINS: usize>(&mut self, bounds: &[[Box8; BINS]; 3], counts: &[[i32; 8]; BINS], bin: usize) {
        for (b, bins) in self.bounds.iter_mut().zip(bounds) {
            *b = b.min(bins[bin].load(self.simd));
        }
        self.count += i32x4::from_slice(self.simd, &counts[bin][..4]);
    }

    /// Area times leaves.
    #[inline(always)]
    fn cost(&self, leaf: u32) -> f32x4<S> {
        let [a, b, c] = [sides(self.bounds[0]), sides(self.bounds[1]), sides(self.bounds[2])];
        let (ac, bb) = (a.interleave(c), b.interleave(b));
        let (x, y, z) = (ac.0.zip_low(bb.0), ac.0.zip_high(bb.0), ac.1.zip_low(bb.1));
        let area = x * y + y * z + z * x;
        let leaves = (self.count + i32x4::splat(self.simd, (1 << leaf) - 1)) >> leaf;
        area * f32x4::float_from(leaves)
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
    let mut bins = Bins { bounds: [[Box8::EMPTY; BINS]; 3], counts: [[0; 8]; BINS] };
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
    let mut above = Side::new(simd);
    let mut costs = [[0.0f32; 4]; BINS];
    for i in (1..BINS).rev() {
        above.take(bounds, counts, i);
        costs[i] = above.cost(leaf).into();
    }
    let mut below = Side::new(simd);
    let mut least_cost = f32x4::splat(simd, f32::INFINITY);
    let mut boundaries = f32x4::splat(simd, 0.0);
    for (i, &cost) in costs.iter().enumerate().skip(1) {
        below.take(bounds, counts, i - 1);
        let cost: f32x4<S> = cost.simd_into(simd);
        let cost = below.cost(leaf) + cost;
        // The first bin and the last are never empty. Infinite boxes cost infinitely much everywhere.
        let less = cost.simd_lt(least_cost);
        boundaries = less.select(f32x4::splat(simd, i as f32), boundaries);
        least_cost = less.select(cost, least_cost);
    }
    let (least_cost, boundaries): ([f32; 4], [f32; 4]) = (least_cost.into(), boundaries.into());
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&axis| scale[axis] != 0.0) {
        if least_cost[axis] < best.0 {
            best = (least_cost[axis], axis, boundaries[axis] as usize);
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
