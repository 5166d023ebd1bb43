//! Rays that go the same way, walked together.
//!
//! A node's boxes are tested with the bounds of all origins and inverse directions first, at the price of one ray, and
//! each box that is next in turn with all rays, sixteen a vector: docs/numerics.md §10.

use super::frame::Frame;
use super::slab::{E, FARTHEST_T, LENGTHS, Limits, NEAR, PLAIN_ERROR, SLAB, STEEPEST, TINY};
use super::waiting::{Waiting, in_order, lane_of, t_of};
use super::wide::{LEAF, Wide, WideNode, near_rows};
use crate::kernel::rows::{columns, row};
use crate::{Interval, Ray};
use fearless_simd::{Simd, f32x8, f32x16, f64x8, mask32x8, mask32x16, prelude::*};

/// How many rays a bundle has.
pub(crate) const RAYS: usize = 32;

/// And in how many vectors.
pub(crate) const SIXTEENS: usize = RAYS / 16;

/// Bundles wider than this, in directions over their length and in origins over the tree's size, would visit much that
/// none of their rays meets. Rays from one place share enough without it.
const WIDEST: f32 = 1.0 / 8.0;

/// Slopes steeper than this, against the direction's longest coordinate, have inverses that bound nothing: such an axis
/// is left out of the bounds, as is one on which the rays go either way.
const FLATTEST: f32 = 1.0 / 1_048_576.0; // 2⁻²⁰

/// What underflow may take from a product of a distance and an inverse, and far below any t that matters.
const UNDERFLOW: f32 = 1e-30;

/// Farther than any t.
const FAR: f32 = 1e30;

/// Ends that are farther apart than this, in roundings of 1 + the largest coordinate, are not one place.
const ONE_PLACE: f32 = 8.0 * E;

/// No place that rays end at is farther from where they start.
const FARTHEST_WAY: f32 = 16.0;

/// And none is farther from the tree.
const FARTHEST_END: f32 = 8.0;

/// As [`PLAIN_ERROR`], of the end of a ray: 48u are needed.
const BACK_ERROR: f32 = 4.0 * PLAIN_ERROR;

/// From which end the rays of a bundle are looked at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Start {
    /// t = λ.
    Origin,
    /// t = `max` − λ: from where the interval ends, backwards.
    End,
}

/// Sixteen rays, by lane, in the tree's frame as [`LocalRay`](super::LocalRay) has them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Sixteen {
    pub(crate) direction: [[f32; 16]; 3],
    pub(crate) origin: [[f32; 16]; 3],
    inv: [[f32; 16]; 3],
    near_shift: [[f32; 16]; 3],
    far_shift: [[f32; 16]; 3],
    pub(crate) t_min: [f32; 16],
    /// −∞ for a place that has no ray.
    pub(crate) t_max: [f32; 16],
    /// What lies between these is certainly inside the ray's interval.
    sure_min: [f32; 16],
    sure_max: [f32; 16],
}

/// What a bundle's bounds are made of: numbers of two rays a vector, as they lie in memory.
struct Extent<S: Simd> {
    least: f32x16<S>,
    most: f32x16<S>,
    sum: f32x16<S>,
}

impl<S: Simd> Extent<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let [least, most] = [f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY)];
        Self { least, most, sum: f32x16::splat(simd, 0.0) }
    }

    #[inline(always)]
    fn add(&mut self, two: f32x16<S>) {
        (self.least, self.most, self.sum) = (self.least.min(two), self.most.max(two), self.sum + two);
    }

    /// The least and the greatest origin and direction, and whether all of them are finite.
    #[inline(always)]
    fn of_all(&self) -> ([[f32; 2]; 3], [[f32; 2]; 3], bool) {
        let ((least, least_of_others), (most, most_of_others)) = (self.least.split(), self.most.split());
        let (least, most) = (least.min(least_of_others), most.max(most_of_others));
        let (least, most): ([f32; 8], [f32; 8]) = (least.into(), most.into());
        let of = |i: usize| [least[i], most[i]];
        // Sums of a NaN or an infinity with others are one. Of the limits, the last two of each ray, nothing is asked.
        let (sum, sum_of_others) = self.sum.split();
        let finite = (sum + sum_of_others).is_finite().to_bitmask() & 0x3f == 0x3f;
        ([of(0), of(1), of(2)], [of(3), of(4), of(5)], finite)
    }
}

impl Sixteen {
    const EMPTY: Self = Self {
        direction: [[0.0; 16]; 3],
        origin: [[0.0; 16]; 3],
        inv: [[0.0; 16]; 3],
        near_shift: [[0.0; 16]; 3],
        far_shift: [[0.0; 16]; 3],
        t_min: [0.0; 16],
        t_max: [0.0; 16],
        sure_min: [0.0; 16],
        sure_max: [0.0; 16],
    };

    /// Takes the rays into the frame, as [`LocalRay::new`](super::LocalRay::new) takes those that it takes as they are.
    /// Returns the largest coordinate of each direction and of the way to the far end, and whether all intervals are
    /// longer than a rounding of f32.
    #[inline(always)]
    fn set<S: Simd>(
        &mut self,
        simd: S,
        frame: &Frame,
        rays: &[(Ray, Interval); 16],
        from: Start,
        extent: &mut Extent<S>,
    ) -> ([f32x16<S>; 2], bool) {
        let (c, s) = (frame.center, frame.scale);
        let center = f64x8::simd_from(simd, [c.x, c.y, c.z, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let to_frame = f64x8::simd_from(simd, [s, s, s, s, s, s, 1.0, 1.0]);
        let back = f64x8::simd_from(simd, [s, s, s, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let mut rows = [f32x16::splat(simd, 0.0); 8];
        for (i, two) in rows.iter_mut().enumerate() {
            let mut both = [f64x8::splat(simd, 0.0); 2];
            for k in 0..2 {
                let ray = &rays[2 * i + k];
                both[k] = (row(simd, ray) - center) * to_frame;
                if from == Start::End {
                    let (Ray { direction: d, .. }, Interval { max, .. }) = *ray;
                    both[k] += f64x8::simd_from(simd, [d.x, d.y, d.z, 0.0, 0.0, 0.0, 0.0, 0.0]) * (back * max);
                }
            }
            *two = both[0].relaxed_narrow(both[1]);
            extent.add(*two);
        }
        let [ox, oy, oz, dx, dy, dz, min, max] = columns(rows);
        // A NaN is below nothing.
        let long = min.simd_lt(max).to_bitmask() == 0xffff;
        let farthest = f32x16::splat(simd, FARTHEST_T as f32);
        let (min, max) = (min.min(farthest).max(-farthest), max.min(farthest).max(-farthest));
        let (rounding, tiny) = (f32x16::splat(simd, 4.0 * E), f32x16::splat(simd, TINY as f32));
        let slack = [min.abs().mul_add(rounding, tiny), max.abs().mul_add(rounding, tiny)];
        let (o, mut d) = ([ox, oy, oz], [dx, dy, dz]);
        let (mut ends, mut slacks, mut error) = ([min, max], slack, PLAIN_ERROR);
        if from == Start::End {
            d = [-dx, -dy, -dz];
            ends = [f32x16::splat(simd, 0.0), max - min];
            slacks = [tiny, slack[0] + slack[1]];
            error = BACK_ERROR;
        }
        let (one, steepest) = (f32x16::splat(simd, 1.0), f32x16::splat(simd, STEEPEST));
        for axis in 0..3 {
            let (o, d) = (o[axis], d[axis]);
            let slope = d.abs().simd_lt(1.0 / STEEPEST).select(steepest, one / d);
            let pad = o.abs().mul_add(f32x16::splat(simd, SLAB), f32x16::splat(simd, SLAB + 2.0 * error));
            let (middle, half) = (o * slope, slope.abs() * pad);
            (self.origin[axis], self.direction[axis], self.inv[axis]) = (o.into(), d.into(), slope.into());
            (self.near_shift[axis], self.far_shift[axis]) = ((-middle - half).into(), (half - middle).into());
        }
        (self.t_min, self.t_max) = ((ends[0] - slacks[0]).into(), (ends[1] + slacks[1]).into());
        (self.sure_min, self.sure_max) = ((ends[0] + slacks[0]).into(), (ends[1] - slacks[1]).into());
        let length = d[0].abs().max(d[1].abs()).max(d[2].abs());
        ([length, length * max.abs()], long)
    }

    /// Whether a t between these is inside the ray's interval for certain.
    #[inline(always)]
    pub(crate) fn holds(&self, lane: usize, [low, high]: [f32; 2]) -> bool {
        (low > self.sure_min[lane & 15]) & (high < self.sure_max[lane & 15])
    }

    /// The same of all rays, each with its own.
    #[inline(always)]
    pub(crate) fn all_hold<S: Simd>(&self, simd: S, [low, high]: [f32x16<S>; 2]) -> mask32x16<S> {
        let (min, max): (f32x16<S>, f32x16<S>) = (self.sure_min.simd_into(simd), self.sure_max.simd_into(simd));
        low.simd_gt(min) & high.simd_lt(max)
    }

    /// Nothing of ray `lane` matters from `t` on. All are written, since they are read as a vector, which would have to
    /// wait for one written alone.
    #[inline(always)]
    pub(crate) fn shorten<S: Simd>(&mut self, simd: S, lane: usize, t: f32) {
        let (t_max, this): (f32x16<S>, _) =
            (self.t_max.simd_into(simd), mask32x16::from_bitmask(simd, 1 << (lane & 15)));
        self.t_max = this.select(t_max.min(f32x16::splat(simd, t)), t_max).into();
    }

    #[inline(always)]
    fn slab<S: Simd>(&self, simd: S, axis: usize) -> (f32x16<S>, f32x16<S>, f32x16<S>) {
        (self.inv[axis].simd_into(simd), self.near_shift[axis].simd_into(simd), self.far_shift[axis].simd_into(simd))
    }

    /// The rays that may meet the box of lane `lane`; `near` as of [`near_rows`].
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, node: &WideNode, lane: usize, near: &[u32; 3]) -> u32 {
        let (mut enter, mut exit): (f32x16<S>, f32x16<S>) = (self.t_min.simd_into(simd), self.t_max.simd_into(simd));
        for (axis, &row) in near.iter().enumerate() {
            let row = row as usize & 7;
            let first = f32x16::splat(simd, node.rows[row][lane & 7]);
            let last = f32x16::splat(simd, node.rows[row ^ 1][lane & 7]);
            let (inv, near_shift, far_shift) = self.slab(simd, axis);
            enter = enter.max(first.mul_add(inv, near_shift));
            exit = exit.min(last.mul_add(inv, far_shift));
        }
        !(enter.simd_gt(exit).to_bitmask() as u32) & 0xffff
    }

    /// The same where the rays go either way.
    #[inline(always)]
    fn meet_mixed<S: Simd>(&self, simd: S, node: &WideNode, lane: usize) -> u32 {
        let (mut enter, mut exit): (f32x16<S>, f32x16<S>) = (self.t_min.simd_into(simd), self.t_max.simd_into(simd));
        for axis in 0..3 {
            let (inv, near_shift, far_shift) = self.slab(simd, axis);
            let low = f32x16::splat(simd, node.rows[2 * axis][lane & 7]) * inv;
            let high = f32x16::splat(simd, node.rows[2 * axis + 1][lane & 7]) * inv;
            enter = enter.max(low.min(high) + near_shift);
            exit = exit.min(low.max(high) + far_shift);
        }
        !(enter.simd_gt(exit).to_bitmask() as u32) & 0xffff
    }
}

/// Rays and the bounds of them all, rounded outward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bundle {
    pub(crate) rays: [Sixteen; SIXTEENS],
    /// Where all rays start, but for [`origin_error`](Self::origin_error), if they do.
    pub(crate) place: Option<[f32; 3]>,
    /// Bit i: the directions' coordinates i are negative.
    away: u32,
    /// On some axis they are not all of one sign.
    mixed: bool,
    /// Bit i: ray i wants to know more.
    pub(crate) asking: u32,
    /// The end of the origins' range that is nearest to a plane in front, by axis, and the farthest.
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    /// The least and the greatest direction.
    pub(crate) directions: [[f32; 3]; 2],
    /// The least and the greatest 1/direction.
    inverse: [[f32; 3]; 2],
    t_min: f32,
    /// The largest t that matters to one of them.
    pub(crate) t_max: f32,
    /// The largest coordinate of an origin.
    pub(crate) size: f32,
    /// The shortest and the longest direction, by their largest coordinates.
    pub(crate) lengths: [f32; 2],
    /// Each coordinate of the place was off the rays by at most this before it was rounded; without one, each of an
    /// origin off its ray.
    pub(crate) origin_error: f32,
}

/// The least and the greatest of all lanes.
#[inline(always)]
fn range<S: Simd>(vectors: [f32x16<S>; SIXTEENS]) -> [f32; 2] {
    let (mut least, mut most) = (vectors[0], vectors[0]);
    for vector in &vectors[1..] {
        (least, most) = (least.min(*vector), most.max(*vector));
    }
    [least.reduce_min(), most.reduce_max()]
}

#[inline(always)]
fn largest([low, high]: [f32; 2]) -> f32 {
    if -low > high { -low } else { high }
}

impl Bundle {
    /// None that is of use.
    pub(crate) const EMPTY: Self = Self {
        rays: [Sixteen::EMPTY; SIXTEENS],
        place: None,
        away: 0,
        mixed: false,
        asking: 0,
        near_origin: [FAR; 3],
        far_origin: [-FAR; 3],
        directions: [[0.0; 3]; 2],
        inverse: [[1.0; 3]; 2],
        t_min: 0.0,
        t_max: 0.0,
        size: 0.0,
        lengths: [0.0; 2],
        origin_error: 0.0,
    };

    /// Makes these rays the bundle's, instead of all others; only the first `many` want to know something. `false`, and
    /// no use, if the rays go very different ways, if one of them is not taken as it is by
    /// [`LocalRay::new`](super::LocalRay::new), or if an interval is empty; from the end, if that is not one place.
    #[inline(always)]
    pub(crate) fn take<S: Simd>(
        &mut self,
        simd: S,
        frame: &Frame,
        rays: &[(Ray, Interval); RAYS],
        many: usize,
        from: Start,
    ) -> bool {
        (self.away, self.mixed, self.asking) = (0, false, u32::MAX >> (RAYS - many));
        (self.near_origin, self.far_origin) = ([FAR; 3], [-FAR; 3]);
        self.inverse = [[1.0; 3]; 2];
        // No closures over vectors here and below: one that is not inlined makes calls of all that it does.
        let (sixteens, _) = rays.as_chunks::<16>();
        let zero = f32x16::splat(simd, 0.0);
        let [mut lengths, mut ways, mut t_min, mut t_max] = [[zero; SIXTEENS]; 4];
        let (mut long, mut extent) = (true, Extent::new(simd));
        for i in 0..SIXTEENS {
            let sixteen = &mut self.rays[i];
            let ([length, way], all_long) = sixteen.set(simd, frame, &sixteens[i], from, &mut extent);
            (lengths[i], ways[i]) = (length, way);
            (t_min[i], t_max[i]) = (sixteen.t_min.simd_into(simd), sixteen.t_max.simd_into(simd));
            long &= all_long;
        }
        for ray in many..RAYS {
            self.rays[ray / 16].t_max[ray % 16] = f32::NEG_INFINITY;
        }
        let (origins, mut directions, finite) = extent.of_all();
        if from == Start::End {
            for [low, high] in &mut directions {
                (*low, *high) = (-*high, -*low);
            }
        }
        self.lengths = range(lengths);
        ([self.t_min, _], [_, self.t_max]) = (range(t_min), range(t_max));
        let [mut size, mut spread, mut turn] = [0.0; 3];
        for axis in 0..3 {
            let ([o_low, o_high], [d_low, d_high]) = (origins[axis], directions[axis]);
            let (far, apart) = (largest(origins[axis]), o_high - o_low);
            size = if far > size { far } else { size };
            spread = if apart > spread { apart } else { spread };
            turn = if d_high - d_low > turn { d_high - d_low } else { turn };
        }
        let one_place = spread <= ONE_PLACE * (1.0 + size);
        let alike = one_place | (spread <= WIDEST) & (turn <= WIDEST * self.lengths[0]);
        let (farthest, shortest, error) = match from {
            Start::Origin => (NEAR, LENGTHS[0], PLAIN_ERROR),
            // Twice as far, half as short: no t is longer than from an origin.
            Start::End => (FARTHEST_END, 2.0 * LENGTHS[0], BACK_ERROR),
        };
        let plain = (size <= farthest) & (self.lengths[0] >= shortest) & (self.lengths[1] <= LENGTHS[1]);
        let ends = (from == Start::Origin) || one_place & (range(ways)[1] <= FARTHEST_WAY);
        if !(long & plain & alike & ends & finite) {
            return false;
        }
        self.place = one_place.then_some([origins[0][0], origins[1][0], origins[2][0]]);
        self.size = size;
        // The difference of the two is rounded.
        self.origin_error = if one_place { error + spread * (1.0 + 4.0 * E) } else { error };
        for axis in 0..3 {
            let (o, d) = (origins[axis], directions[axis]);
            (self.directions[0][axis], self.directions[1][axis]) = (d[0], d[1]);
            let off = 4.0 * E * largest(o) + 2.0 * error;
            let (low, high) = (o[0] - off, o[1] + off);
            let backward = d[0] < 0.0;
            let gentlest = if d[0].abs() < d[1].abs() { d[0].abs() } else { d[1].abs() };
            if backward != (d[1] < 0.0) || gentlest < FLATTEST * self.lengths[0] {
                self.mixed = true;
                continue;
            }
            self.away |= u32::from(backward) << axis;
            (self.near_origin[axis], self.far_origin[axis]) = if backward { (low, high) } else { (high, low) };
            // Of directions with one sign the greatest has the least inverse. The margin is for five roundings: of the
            // direction, of its inverse, and of difference and product in the test.
            let (least, greatest) = (1.0 / d[1], 1.0 / d[0]);
            self.inverse[0][axis] = least - least.abs() * (8.0 * E);
            self.inverse[1][axis] = greatest + greatest.abs() * (8.0 * E);
        }
        true
    }

    /// Which rays may meet the box of lane `lane`.
    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, node: &WideNode, lane: usize, near: &[u32; 3]) -> u32 {
        let [a, b] = &self.rays;
        if self.mixed {
            return a.meet_mixed(simd, node, lane) | b.meet_mixed(simd, node, lane) << 16;
        }
        a.meet(simd, node, lane, near) | b.meet(simd, node, lane, near) << 16
    }

    /// Nothing of the ray matters from `lambda` on, if the bundle is seen from its origin.
    #[inline(always)]
    pub(crate) fn limit(&mut self, ray: usize, lambda: f64) {
        let (t, t_max) = (Limits::PLAIN.upper(lambda), &mut self.rays[ray / 16 % SIXTEENS].t_max[ray % 16]);
        if t < *t_max {
            *t_max = t;
        }
    }

    /// Keeps the largest t that matters, after one of the rays' has changed.
    #[inline(always)]
    pub(crate) fn shorten<S: Simd>(&mut self, simd: S) {
        let mut last: f32x16<S> = self.rays[0].t_max.simd_into(simd);
        for sixteen in &self.rays[1..] {
            last = last.max(f32x16::simd_from(simd, sixteen.t_max));
        }
        self.t_max = last.reduce_max();
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
    fn test(&self, simd: S, node: &WideNode, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let (mut enter, mut exit) = (self.t_min, f32x8::splat(simd, t_max));
        for axis in 0..3 {
            let (least, greatest) = (self.inverse[0][axis], self.inverse[1][axis]);
            let near = node.row(simd, self.near[axis]) - self.near_origin[axis];
            let far = node.row(simd, self.near[axis] ^ 1) - self.far_origin[axis];
            enter = enter.max((near * least).min(near * greatest));
            exit = exit.min((far * least).max(far * greatest));
        }
        (enter.simd_le(exit + f32x8::splat(simd, UNDERFLOW)), enter)
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
    let mut waiting = Waiting::new();
    let mut at = 0;
    loop {
        let (hits, enter) = bounds.test(simd, &nodes[at as usize], walk.bundle().t_max);
        waiting.push(at, hits.to_bitmask().count_ones(), in_order(simd, hits, enter));
        at = loop {
            let Some((key, node)) = waiting.pop() else { return };
            let bundle = walk.bundle();
            if t_of(key) > bundle.t_max {
                continue;
            }
            let (node, lane) = (&nodes[node as usize], lane_of(key));
            let rays = bundle.meet(simd, node, lane, &bounds.near) & bundle.asking;
            if rays == 0 {
                continue;
            }
            let child = node.child(lane);
            if child & LEAF == 0 {
                break child;
            }
            walk.leaf(simd, child & !LEAF, rays);
        };
    }
}
