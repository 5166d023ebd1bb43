//! Rays that go the same way, walked together.
//!
//! A node's boxes are tested with the bounds of all origins and inverse directions first, at the price of one ray, and what is
//! left with each ray, eight a vector: docs/numerics.md §10.

use super::frame::Frame;
use super::slab::{E, LENGTHS, NEAR, PLAIN_ERROR, SLAB, STEEPEST, Sure, plain_ends};
use super::traverse::Stack;
use super::wide::{LEAF, Wide, WideNode, near_rows};
use crate::{Interval, Ray};
use fearless_simd::{Simd, f32x8, f64x4, prelude::*};

/// How many rays a bundle has.
pub(crate) const RAYS: usize = 16;

/// Bundles wider than this, in directions over their length and in origins over the tree's size, would visit much that
/// none of their rays meets.
const WIDEST: f32 = 1.0 / 8.0;

/// Slopes steeper than this, against the direction's longest coordinate, have inverses that bound nothing: such an axis is left
/// out of the bounds, as is one on which the rays go either way.
const FLATTEST: f32 = 1.0 / 1_048_576.0; // 2⁻²⁰

/// What underflow may take from a product of a distance and an inverse, and far below any t that matters.
const UNDERFLOW: f32 = 1e-30;

/// Farther than any t.
const FAR: f32 = 1e30;

/// Eight rays, by lane, in the tree's frame as [`LocalRay`](super::LocalRay) has them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eight {
    pub(crate) origin: [[f32; 8]; 3],
    pub(crate) direction: [[f32; 8]; 3],
    inv: [[f32; 8]; 3],
    near_shift: [[f32; 8]; 3],
    far_shift: [[f32; 8]; 3],
    pub(crate) t_min: [f32; 8],
    /// −∞ for a ray that has its answer.
    pub(crate) t_max: [f32; 8],
    sure_min: [f32; 8],
    sure_max: [f32; 8],
}

/// Numbers of eight rays, as vectors.
#[inline(always)]
fn gather<S: Simd>(simd: S, x: [f64; 8]) -> [f64x4<S>; 2] {
    [f64x4::simd_from(simd, [x[0], x[1], x[2], x[3]]), f64x4::simd_from(simd, [x[4], x[5], x[6], x[7]])]
}

impl Eight {
    /// The rays in the frame, as [`LocalRay::new`](super::LocalRay::new) takes those that it takes as they are. `None` if an
    /// interval is empty.
    #[inline(always)]
    fn new<S: Simd>(simd: S, frame: &Frame, rays: &[(Ray, Interval); 8]) -> Option<Self> {
        let [mut min, mut max] = [[0.0; 8]; 2];
        for (lane, (_, within)) in rays.iter().enumerate() {
            (min[lane], max[lane]) = (within.min, within.max);
        }
        let (min, max) = (gather(simd, min), gather(simd, max));
        // A NaN is below nothing.
        let full = min[0].simd_lt(max[0]) & min[1].simd_lt(max[1]);
        if full.to_bitmask() as u32 & 0xf != 0xf {
            return None;
        }
        let ([t_min, sure_min], [sure_max, t_max]) = (plain_ends(simd, min), plain_ends(simd, max));
        let (t_min, t_max) = (t_min.into(), t_max.into());
        let (sure_min, sure_max) = (sure_min.into(), sure_max.into());

        let (one, steepest) = (f32x8::splat(simd, 1.0), f32x8::splat(simd, STEEPEST));
        let [mut origin, mut direction, mut inv, mut near_shift, mut far_shift] = [[[0.0; 8]; 3]; 5];
        for axis in 0..3 {
            let [mut o, mut d] = [[0.0; 8]; 2];
            for (lane, (ray, _)) in rays.iter().enumerate() {
                (o[lane], d[lane]) = (ray.origin[axis], ray.direction[axis]);
            }
            let ([oa, ob], [da, db]) = (gather(simd, o), gather(simd, d));
            let (center, scale) = (f64x4::splat(simd, frame.center[axis]), f64x4::splat(simd, frame.scale));
            let o: f32x8<S> = ((oa - center) * scale).relaxed_narrow((ob - center) * scale);
            let d: f32x8<S> = (da * scale).relaxed_narrow(db * scale);
            let slope = d.abs().simd_lt(1.0 / STEEPEST).select(steepest, one / d);
            let pad = o.abs().mul_add(f32x8::splat(simd, SLAB), f32x8::splat(simd, SLAB + 2.0 * PLAIN_ERROR));
            let (middle, half) = (o * slope, slope.abs() * pad);
            (origin[axis], direction[axis], inv[axis]) = (o.into(), d.into(), slope.into());
            (near_shift[axis], far_shift[axis]) = ((-middle - half).into(), (half - middle).into());
        }
        Some(Self { origin, direction, inv, near_shift, far_shift, t_min, t_max, sure_min, sure_max })
    }

    /// What is certainly inside the interval of ray `lane`.
    #[inline(always)]
    pub(crate) fn sure(&self, lane: usize) -> Sure {
        Sure { min: self.sure_min[lane & 7], max: self.sure_max[lane & 7] }
    }

    #[inline(always)]
    fn slab<S: Simd>(&self, simd: S, axis: usize) -> (f32x8<S>, f32x8<S>, f32x8<S>) {
        (self.inv[axis].simd_into(simd), self.near_shift[axis].simd_into(simd), self.far_shift[axis].simd_into(simd))
    }

    /// The rays that may meet the box of lane `lane`; `near` as of [`near_rows`].
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, node: &WideNode, lane: usize, near: &[u32; 3]) -> u32 {
        let (mut enter, mut exit): (f32x8<S>, f32x8<S>) = (self.t_min.simd_into(simd), self.t_max.simd_into(simd));
        for (axis, &row) in near.iter().enumerate() {
            let row = row as usize & 7;
            let first = f32x8::splat(simd, node.rows[row][lane & 7]);
            let last = f32x8::splat(simd, node.rows[row ^ 1][lane & 7]);
            let (inv, near_shift, far_shift) = self.slab(simd, axis);
            enter = enter.max(first.mul_add(inv, near_shift));
            exit = exit.min(last.mul_add(inv, far_shift));
        }
        !(enter.simd_gt(exit).to_bitmask() as u32) & 0xff
    }

    /// The same where the rays go either way.
    #[inline(always)]
    fn meet_mixed<S: Simd>(&self, simd: S, node: &WideNode, lane: usize) -> u32 {
        let (mut enter, mut exit): (f32x8<S>, f32x8<S>) = (self.t_min.simd_into(simd), self.t_max.simd_into(simd));
        for axis in 0..3 {
            let (inv, near_shift, far_shift) = self.slab(simd, axis);
            let low = f32x8::splat(simd, node.rows[2 * axis][lane & 7]) * inv;
            let high = f32x8::splat(simd, node.rows[2 * axis + 1][lane & 7]) * inv;
            enter = enter.max(low.min(high) + near_shift);
            exit = exit.min(low.max(high) + far_shift);
        }
        !(enter.simd_gt(exit).to_bitmask() as u32) & 0xff
    }
}

/// Rays and the bounds of them all, rounded outward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bundle {
    pub(crate) rays: [Eight; RAYS / 8],
    /// Bit i: the directions' coordinates i are negative.
    away: u32,
    /// On some axis they are not all of one sign.
    mixed: bool,
    /// The end of the origins' range that is nearest to a plane in front, by axis, and the farthest.
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    /// The least and the greatest 1/direction.
    inverse: [[f32; 3]; 2],
    t_min: f32,
    /// The largest t that matters to one of them.
    pub(crate) t_max: f32,
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
    /// `None` if the rays go very different ways, if one of them is not taken as it is by
    /// [`LocalRay::new`](super::LocalRay::new), or if an interval is empty.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, frame: &Frame, rays: &[(Ray, Interval); RAYS]) -> Option<Self> {
        let (halves, _) = rays.as_chunks::<8>();
        let eights = [Eight::new(simd, frame, &halves[0])?, Eight::new(simd, frame, &halves[1])?];
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
        let plain = (size <= NEAR) & (lengths[0] >= LENGTHS[0]) & (lengths[1] <= LENGTHS[1]) & sum.is_finite();
        let alike = |axis: usize| {
            let ([o_low, o_high], [d_low, d_high]) = (origins[axis], directions[axis]);
            (o_high - o_low <= WIDEST) & (d_high - d_low <= WIDEST * lengths[0])
        };
        if !(plain & alike(0) & alike(1) & alike(2)) {
            return None;
        }
        let mut bundle = Self {
            rays: eights,
            away: 0,
            mixed: false,
            near_origin: [FAR; 3],
            far_origin: [-FAR; 3],
            inverse: [[1.0; 3]; 2],
            t_min,
            t_max,
            size,
            lengths,
        };
        for axis in 0..3 {
            let (o, d) = (origins[axis], directions[axis]);
            let off = 4.0 * E * largest(o) + 2.0 * PLAIN_ERROR;
            let (low, high) = (o[0] - off, o[1] + off);
            let backward = d[0] < 0.0;
            let gentlest = if d[0].abs() < d[1].abs() { d[0].abs() } else { d[1].abs() };
            if backward != (d[1] < 0.0) || gentlest < FLATTEST * lengths[0] {
                bundle.mixed = true;
                continue;
            }
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

    /// Which of `rays` may meet the box of lane `lane`.
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, node: &WideNode, lane: usize, near: &[u32; 3], rays: u32) -> u32 {
        let mut met = 0;
        for (i, eight) in self.rays.iter().enumerate() {
            if rays >> (8 * i) & 0xff != 0 {
                let of_eight =
                    if self.mixed { eight.meet_mixed(simd, node, lane) } else { eight.meet(simd, node, lane, near) };
                met |= of_eight << (8 * i);
            }
        }
        met & rays
    }

    /// Keeps the largest t that matters, after one of the rays' has changed.
    #[inline(always)]
    pub(crate) fn shorten<S: Simd>(&mut self, simd: S) {
        let [_, last] = range(pair(simd, &self.rays[0].t_max, &self.rays[1].t_max));
        self.t_max = last;
    }

    /// The bounds in every lane.
    #[inline(always)]
    fn bounds<S: Simd>(&self, simd: S) -> Bounds<S> {
        Bounds {
            near_origin: spread(simd, self.near_origin),
            far_origin: spread(simd, self.far_origin),
            inverse: [spread(simd, self.inverse[0]), spread(simd, self.inverse[1])],
            t_min: f32x8::splat(simd, self.t_min),
            near: near_rows(self.away),
        }
    }
}

#[inline(always)]
fn spread<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [f32x8<S>; 3] {
    [f32x8::splat(simd, x), f32x8::splat(simd, y), f32x8::splat(simd, z)]
}

/// [`Bundle`]'s bounds in every lane.
struct Bounds<S: Simd> {
    near_origin: [f32x8<S>; 3],
    far_origin: [f32x8<S>; 3],
    inverse: [[f32x8<S>; 3]; 2],
    t_min: f32x8<S>,
    near: [u32; 3],
}

impl<S: Simd> Bounds<S> {
    /// Which of the node's boxes a ray may meet before `t_max`, and from which t on.
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

/// A bundle, and what is done at the leaves.
pub(crate) trait Together<S: Simd> {
    fn bundle(&self) -> &Bundle;

    /// Tests what leaf `leaf` holds with the rays of these bits, and keeps the bundle's t_max.
    fn leaf(&mut self, simd: S, leaf: u32, rays: u32);
}

/// Visits the leaves whose boxes rays meet before their t_max, nearest first, with those rays.
#[inline(always)]
pub(crate) fn together<S: Simd>(simd: S, tree: &Wide, walk: &mut impl Together<S>) {
    let nodes = &tree.nodes[..];
    let bounds = walk.bundle().bounds(simd);
    let mut stack = Stack::<i128>::new();
    let (mut at, mut rays) = (0, (1 << RAYS) - 1);
    loop {
        if at & LEAF == 0 {
            let (node, bundle) = (&nodes[at as usize], walk.bundle());
            let (mut hits, enter) = bounds.test(simd, node, bundle.t_max);
            let enter: [f32; 8] = enter.into();
            stack.reserve();
            let mut count = 0;
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize & 7;
                hits &= hits - 1;
                let met = bundle.meet(simd, node, lane, &bounds.near, rays);
                if met != 0 {
                    // Signed, as a single ray's entries are.
                    let t = i128::from(enter[lane].to_bits() as i32);
                    stack.insert(t << 64 | i128::from(met) << 32 | i128::from(node.child(lane)), count);
                    count += 1;
                }
            }
        } else {
            walk.leaf(simd, at & !LEAF, rays);
        }
        loop {
            let Some(entry) = stack.pop() else { return };
            if f32::from_bits((entry >> 64) as u32) <= walk.bundle().t_max {
                (at, rays) = (entry as u32, (entry >> 32) as u32);
                break;
            }
        }
    }
}
