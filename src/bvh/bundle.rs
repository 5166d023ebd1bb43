//! Rays that go the same way, walked as one.
//!
//! A box is skipped if no ray with an origin and an inverse direction between the bundle's bounds meets it:
//! docs/numerics.md §10. The walk costs what one ray's costs, and finds the leaves of all.

use super::frame::Frame;
use super::slab::{LENGTHS, Limits, NEAR, PLAIN_ERROR};
use super::traverse::Beam;
use super::wide::WideNode;
use crate::{Interval, Ray};
use fearless_simd::{Simd, f32x8, prelude::*};

/// How many rays a bundle has.
pub(crate) const RAYS: usize = 16;

/// Bundles wider than this, in directions over their length and in origins over the tree's size, would visit much that
/// none of their rays meets.
const WIDEST: f32 = 1.0 / 8.0;

/// Slopes steeper than this, against the direction's longest coordinate, have inverses that bound nothing.
const FLATTEST: f32 = 1.0 / 1_048_576.0; // 2⁻²⁰

/// The unit roundoff of f32, 2⁻²⁴.
const E: f32 = f32::EPSILON / 2.0;

/// What underflow may take from a product of a distance and an inverse, and far below any t that matters.
const UNDERFLOW: f32 = 1e-30;

/// Eight rays, by lane, in the tree's frame as [`LocalRay`](super::LocalRay) has them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eight {
    pub(crate) origin: [[f32; 8]; 3],
    pub(crate) direction: [[f32; 8]; 3],
    pub(crate) t_min: [f32; 8],
    pub(crate) t_max: [f32; 8],
}

/// Rays and the bounds of them all, rounded outward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bundle {
    pub(crate) rays: [Eight; RAYS / 8],
    /// Bit i: the directions' coordinates i are negative.
    away: u32,
    /// The end of the origins' range that is nearest to a plane in front, by axis, and the farthest.
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    /// The least and the greatest 1/direction.
    inverse: [[f32; 3]; 2],
    t_min: f32,
    /// The largest t that matters to one of them.
    pub(crate) t_max: f32,
    /// The middle of all origins, and how far they are from it by axis.
    pub(crate) origin: [f32; 3],
    pub(crate) origin_spread: [f32; 3],
    /// The same of directions.
    pub(crate) direction: [f32; 3],
    pub(crate) direction_spread: [f32; 3],
    /// The largest coordinate of an origin.
    pub(crate) size: f32,
    /// The shortest and the longest direction, by their largest coordinates.
    pub(crate) lengths: [f32; 2],
}

#[inline(always)]
fn pair<S: Simd>(simd: S, a: &[f32; 8], b: &[f32; 8]) -> [f32x8<S>; 2] {
    [f32x8::simd_from(simd, *a), f32x8::simd_from(simd, *b)]
}

/// The least and the greatest of all lanes of two vectors.
#[inline(always)]
fn range<S: Simd>([a, b]: [f32x8<S>; 2]) -> [f32; 2] {
    [a.min(b).reduce_min(), a.max(b).reduce_max()]
}

impl Bundle {
    /// `None` if the rays go too different ways, if one of them is not taken as it is by
    /// [`LocalRay::new`](super::LocalRay::new), or if an interval is empty.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, frame: &Frame, rays: &[(Ray, Interval); RAYS]) -> Option<Self> {
        const ZERO: [f32; 8] = [0.0; 8];
        let mut eights = [Eight { origin: [ZERO; 3], direction: [ZERO; 3], t_min: ZERO, t_max: ZERO }; RAYS / 8];
        let mut empty = false;
        for (i, (ray, within)) in rays.iter().enumerate() {
            let (eight, lane) = (&mut eights[i / 8], i % 8);
            let (o, d) = ((ray.origin - frame.center) * frame.scale, ray.direction * frame.scale);
            for axis in 0..3 {
                eight.origin[axis][lane] = o[axis] as f32;
                eight.direction[axis][lane] = d[axis] as f32;
            }
            (eight.t_min[lane], eight.t_max[lane]) = (Limits::PLAIN.lower(within.min), Limits::PLAIN.upper(within.max));
            empty |= within.is_empty();
        }
        // No closures over vectors here and below: one that is not inlined makes calls of all that it does.
        let [a, b] = &eights;
        let o = [
            pair(simd, &a.origin[0], &b.origin[0]),
            pair(simd, &a.origin[1], &b.origin[1]),
            pair(simd, &a.origin[2], &b.origin[2]),
        ];
        let d = [
            pair(simd, &a.direction[0], &b.direction[0]),
            pair(simd, &a.direction[1], &b.direction[1]),
            pair(simd, &a.direction[2], &b.direction[2]),
        ];
        let longest =
            [d[0][0].abs().max(d[1][0].abs()).max(d[2][0].abs()), d[0][1].abs().max(d[1][1].abs()).max(d[2][1].abs())];
        let (origins, directions) = ([range(o[0]), range(o[1]), range(o[2])], [range(d[0]), range(d[1]), range(d[2])]);
        let lengths = range(longest);
        let [t_min, _] = range(pair(simd, &a.t_min, &b.t_min));
        let [_, t_max] = range(pair(simd, &a.t_max, &b.t_max));
        // Sums of a NaN or an infinity with others are one, and fail the comparisons below.
        let all = (o[0][0] + o[1][0] + o[2][0]) + (d[0][0] + d[1][0] + d[2][0]);
        let sum = (all + (o[0][1] + o[1][1] + o[2][1]) + (d[0][1] + d[1][1] + d[2][1])).reduce_sum();
        let largest = |[low, high]: [f32; 2]| if -low > high { -low } else { high };
        let size = origins.iter().fold(0.0, |m: f32, &r| m.max(largest(r)));
        let plain = (size <= NEAR) & (lengths[0] >= LENGTHS[0]) & (lengths[1] <= LENGTHS[1]) & sum.is_finite() & !empty;
        let alike = |axis: usize| {
            let ([o_low, o_high], [d_low, d_high]) = (origins[axis], directions[axis]);
            let gentlest = if d_low.abs() < d_high.abs() { d_low.abs() } else { d_high.abs() };
            (o_high - o_low <= WIDEST)
                & (d_high - d_low <= WIDEST * lengths[0])
                & ((d_low < 0.0) == (d_high < 0.0))
                & (gentlest >= FLATTEST * lengths[0])
        };
        if !(plain & alike(0) & alike(1) & alike(2)) {
            return None;
        }
        let mut bundle = Self {
            rays: eights,
            away: 0,
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            inverse: [[0.0; 3]; 2],
            t_min,
            t_max,
            origin: [0.0; 3],
            origin_spread: [0.0; 3],
            direction: [0.0; 3],
            direction_spread: [0.0; 3],
            size,
            lengths,
        };
        let halves = |[low, high]: [f32; 2], off: f32| {
            let middle = 0.5 * (low + high);
            let (above, below) = (high - middle, middle - low);
            (middle, (if above > below { above } else { below }) * (1.0 + 4.0 * E) + off)
        };
        for axis in 0..3 {
            let (o, d) = (origins[axis], directions[axis]);
            let (o_off, d_off) = (4.0 * E * largest(o) + 2.0 * PLAIN_ERROR, 4.0 * E * largest(d));
            (bundle.origin[axis], bundle.origin_spread[axis]) = halves(o, o_off);
            (bundle.direction[axis], bundle.direction_spread[axis]) = halves(d, d_off);
            let (low, high) = (o[0] - o_off, o[1] + o_off);
            let backward = d[0] < 0.0;
            bundle.away |= u32::from(backward) << axis;
            (bundle.near_origin[axis], bundle.far_origin[axis]) = if backward { (low, high) } else { (high, low) };
            // Of directions with one sign the greatest has the least inverse. The margin is for five roundings: of the direction,
            // of its inverse, and of difference and product in the test.
            let (least, greatest) = (1.0 / d[1], 1.0 / d[0]);
            bundle.inverse[0][axis] = least - least.abs() * (8.0 * E);
            bundle.inverse[1][axis] = greatest + greatest.abs() * (8.0 * E);
        }
        Some(bundle)
    }

    /// The bounds in every lane.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(&self, simd: S) -> Lanes<S> {
        Lanes {
            near_origin: spread(simd, self.near_origin),
            far_origin: spread(simd, self.far_origin),
            inverse: [spread(simd, self.inverse[0]), spread(simd, self.inverse[1])],
            t_min: f32x8::splat(simd, self.t_min),
            near: [self.away & 1, 2 + (self.away >> 1 & 1), 4 + (self.away >> 2 & 1)],
        }
    }
}

#[inline(always)]
fn spread<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [f32x8<S>; 3] {
    [f32x8::splat(simd, x), f32x8::splat(simd, y), f32x8::splat(simd, z)]
}

/// [`Bundle`]'s bounds in every lane.
pub(crate) struct Lanes<S: Simd> {
    near_origin: [f32x8<S>; 3],
    far_origin: [f32x8<S>; 3],
    inverse: [[f32x8<S>; 3]; 2],
    t_min: f32x8<S>,
    near: [u32; 3],
}

impl<S: Simd> Beam<S> for Lanes<S> {
    #[inline(always)]
    fn test(&self, simd: S, node: &WideNode, t_max: f32) -> (u32, f32x8<S>) {
        let (mut enter, mut exit) = (self.t_min, f32x8::splat(simd, t_max));
        for axis in 0..3 {
            let (least, greatest) = (self.inverse[0][axis], self.inverse[1][axis]);
            let near = node.row(simd, self.near[axis]) - self.near_origin[axis];
            let far = node.row(simd, self.near[axis] ^ 1) - self.far_origin[axis];
            enter = enter.max((near * least).min(near * greatest));
            exit = exit.min((far * least).max(far * greatest));
        }
        let miss = enter.simd_gt(exit + f32x8::splat(simd, UNDERFLOW));
        (!(miss.to_bitmask() as u32) & 0xff, enter)
    }
}
