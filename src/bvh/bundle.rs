//! Rays that go the same way, walked as one.
//!
//! A box is skipped if no ray with an origin and an inverse direction between the bundle's bounds meets it:
//! docs/numerics.md §10. The walk costs what one ray's costs, and finds the leaves of all.

use super::slab::LocalRay;
use super::traverse::Beam;
use super::wide::WideNode;
use fearless_simd::{Simd, f32x4, f32x8, prelude::*};

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

/// Bounds of the rays of a bundle, all rounded outward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bundle {
    /// Bit i: the directions' coordinates i are negative.
    away: u32,
    /// The end of the origins' range that is nearest to a plane in front, by axis, and the farthest.
    near_origin: [f32; 4],
    far_origin: [f32; 4],
    /// The least and the greatest 1/direction.
    inverse: [[f32; 4]; 2],
    t_min: f32,
    /// The middle of all origins, and how far they are from it by axis.
    pub(crate) origin: [f32; 4],
    pub(crate) origin_spread: [f32; 4],
    /// The same of directions.
    pub(crate) direction: [f32; 4],
    pub(crate) direction_spread: [f32; 4],
}

impl Bundle {
    /// `None` if the rays go too different ways.
    #[inline(always)]
    pub(crate) fn around<S: Simd>(simd: S, rays: &[LocalRay; RAYS]) -> Option<Self> {
        let vector = |v: &[f32; 4]| f32x4::<S>::simd_from(simd, *v);
        let first = &rays[0];
        let range = |v: &[f32; 4]| [vector(v), vector(v)];
        let (mut origins, mut directions, mut inverses) =
            (range(&first.origin), range(&first.direction), range(&first.inv));
        let (mut t_min, mut error, mut length, mut mixed) = (first.t_min, first.origin_error, first.length, 0);
        let grow = |[low, high]: &mut [f32x4<S>; 2], v: &[f32; 4]| {
            *low = low.min(vector(v));
            *high = high.max(vector(v));
        };
        for ray in &rays[1..] {
            grow(&mut origins, &ray.origin);
            grow(&mut directions, &ray.direction);
            grow(&mut inverses, &ray.inv);
            mixed |= ray.away ^ first.away;
            t_min = t_min.min(ray.t_min);
            error = error.max(ray.origin_error);
            length = length.min(ray.length);
        }
        let narrow = (directions[1] - directions[0]).simd_le(WIDEST * length) & (origins[1] - origins[0]).simd_le(WIDEST);
        let gentlest = directions[0].abs().min(directions[1].abs());
        let steep = gentlest.simd_ge(FLATTEST * length);
        if (mixed != 0) | (narrow.to_bitmask() & 7 != 7) | (steep.to_bitmask() & 7 != 7) {
            return None;
        }
        let largest = |[low, high]: &[f32x4<S>; 2]| low.abs().max(high.abs());
        let halves = |[low, high]: &[f32x4<S>; 2], off: f32x4<S>| {
            let middle = (*low + *high) * 0.5;
            let spread = (*high - middle).max(middle - *low) * (1.0 + 4.0 * E) + off;
            (middle.into(), spread.into())
        };
        let origin_off = largest(&origins) * (4.0 * E) + f32x4::splat(simd, 2.0 * error);
        let direction_off = largest(&directions) * (4.0 * E);
        let (origin, origin_spread) = halves(&origins, origin_off);
        let (direction, direction_spread) = halves(&directions, direction_off);
        let (low, high) = (origins[0] - origin_off, origins[1] + origin_off);
        let backward = inverses[0].simd_lt(0.0);
        Some(Self {
            away: first.away,
            near_origin: backward.select(low, high).into(),
            far_origin: backward.select(high, low).into(),
            inverse: [
                (inverses[0] - inverses[0].abs() * (8.0 * E)).into(),
                (inverses[1] + inverses[1].abs() * (8.0 * E)).into(),
            ],
            t_min,
            origin,
            origin_spread,
            direction,
            direction_spread,
        })
    }

    /// The bounds in every lane.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(&self, simd: S) -> Lanes<S> {
        let spread = |v: &[f32; 4]| [0, 1, 2].map(|i| f32x8::splat(simd, v[i]));
        Lanes {
            near_origin: spread(&self.near_origin),
            far_origin: spread(&self.far_origin),
            inverse: [spread(&self.inverse[0]), spread(&self.inverse[1])],
            t_min: f32x8::splat(simd, self.t_min),
            near: [self.away & 1, 2 + (self.away >> 1 & 1), 4 + (self.away >> 2 & 1)],
        }
    }
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
