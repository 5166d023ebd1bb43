//! One ray against eight boxes in f32, never missing what the f64 ray meets.
//!
//! t = plane·inv − shift, one fused multiply-add a plane, with both shifts widened by what the roundings of plane,
//! origin, inverse and result may add up to: docs/numerics.md §10 has the proof. The form is Embree's; its margins, a
//! fixed number of ulps of t, do not cover the rounding of the origin and are replaced.

use super::frame::Frame;
use crate::kernel::float::power;
use crate::{Interval, Ray};
use fearless_simd::{Simd, f32x4, prelude::*};
use glam::DVec3;

/// A ray in the frame of a tree, with what the box and leaf tests need of it.
///
/// `origin` + t·`direction` with 1 ≤ max |direction| < 2; t = λ·stretch − advance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    /// Which row of a node holds the plane met first, by axis, and from the fourth on the one met last.
    pub(crate) planes: [u32; 8],
    /// 1/direction, |inv| ≤ [`STEEPEST`].
    pub(crate) inv: [f32; 4],
    pub(crate) near_shift: [f32; 4],
    pub(crate) far_shift: [f32; 4],
    /// Not above the t of `within.min`.
    pub(crate) t_min: f32,
    /// Not below the t of `within.max`.
    pub(crate) t_max: f32,
    /// The origin, rounded.
    pub(crate) origin: [f32; 4],
    /// The direction, rounded.
    pub(crate) direction: [f32; 4],
    /// Largest coordinate of the origin.
    pub(crate) size: f32,
    /// Each coordinate of the origin was off the ray by at most this before it was rounded.
    pub(crate) origin_error: f32,
    stretch: f64,
    advance: f64,
}

/// [`LocalRay::planes`] by the signs of the direction.
const PLANES: [[u32; 8]; 8] = {
    let mut table = [[0; 8]; 8];
    let mut signs = 0;
    while signs < 8 {
        let mut axis = 0;
        while axis < 3 {
            let away = (signs >> axis & 1) as u32;
            table[signs][axis] = axis as u32 + 3 * away;
            table[signs][axis + 3] = axis as u32 + 3 - 3 * away;
            axis += 1;
        }
        signs += 1;
    }
    table
};

/// Steeper slopes are taken for this one. A slab is then wider than the ray's stretch near the tree: §10.
const STEEPEST: f32 = 1_099_511_627_776.0; // 2⁴⁰

/// Margin of a box test, relative to 1 + |origin|: eight roundings of f32 (six are needed: §10).
const SLAB: f32 = 8.0 / 16_777_216.0;

/// Slack of a limit at or near zero. Nothing in a tree of width 1 is that small, and products with it stay clear of the
/// subnormals, whose arithmetic costs a hundred times as much.
const TINY: f64 = 1.0 / (1u64 << 63) as f64 / (1 << 17) as f64; // 2⁻⁸⁰

/// Origins beyond this, before or after, are not traced.
const FARTHEST: f64 = 1_125_899_906_842_624.0; // 2⁵⁰

/// Origins further out than this are first moved along the ray to the tree.
const NEAR: f64 = 4.0;

impl LocalRay {
    /// `None` where the ray cannot be expressed in the frame (then every leaf is visited): origins 2⁵⁰ times farther
    /// than the tree is wide, and directions as extreme; also for rays that are not valid and for empty intervals.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, frame: &Frame, ray: &Ray, within: Interval) -> Option<Self> {
        let e = exponent_of_normal(largest(ray.direction));
        let k = e - frame.exponent;
        // A zero or subnormal direction has e = −1023, an infinite one e = 1024.
        let in_range = (e.abs() <= 1000) & (k.abs() <= 1000);
        let direction = ray.direction * power(if in_range { -e } else { 0 });
        let start = frame.local(ray.origin);
        let reach = largest(start);
        let (mut origin, mut advance, mut size) = (start, 0.0, reach);
        if reach > NEAR {
            (origin, advance) = approach(start, direction);
            size = largest(origin);
        }
        let sum = direction.element_sum() + origin.element_sum();
        let sound = in_range & (reach <= FARTHEST) & (size <= FARTHEST) & sum.is_finite() & (within.min < within.max);
        if !sound {
            return None;
        }
        // u·(|start| + |t·direction| + |origin|) ≤ u·(1 + 2 + 3)·reach, and the underflow of all; up by 2⁻¹⁰.
        let origin_error = (4.004 * f64::EPSILON * reach + f64::from(f32::MIN_POSITIVE)) as f32;
        let size = size as f32;
        let pad = SLAB * (1.0 + size) + 2.0 * origin_error;
        let (o, d) = (narrow(origin, 0.0), narrow(direction, 1.0));
        let (o4, d4): (f32x4<S>, f32x4<S>) = (o.simd_into(simd), d.simd_into(simd));
        let one = f32x4::splat(simd, 1.0);
        let gentle = d4.abs().simd_lt(1.0 / STEEPEST);
        let inv = gentle.select(f32x4::splat(simd, STEEPEST), one / d4);
        let (middle, half) = (o4 * inv, inv.abs() * pad);
        let away = inv.simd_lt(0.0).to_bitmask() as usize;
        let mut local = Self {
            planes: PLANES[away & 7],
            inv: inv.into(),
            near_shift: (middle + half).into(),
            far_shift: (middle - half).into(),
            t_min: 0.0,
            t_max: 0.0,
            origin: o,
            direction: d,
            size,
            origin_error,
            stretch: power(k),
            advance,
        };
        local.t_min = local.lower(within.min);
        local.t_max = local.upper(within.max);
        Some(local)
    }

    /// Not below the t of `lambda`.
    #[inline(always)]
    pub(crate) fn upper(&self, lambda: f64) -> f32 {
        self.upper_of(lambda, self.advance)
    }

    /// Not above the t of `lambda`.
    #[inline(always)]
    pub(crate) fn lower(&self, lambda: f64) -> f32 {
        -self.upper_of(-lambda, -self.advance)
    }

    /// Not below λ·stretch − advance. One addition covers the roundings of both precisions; what matters near the tree
    /// is far below the limit of 2¹⁰⁰, which keeps infinities out of the sums.
    #[inline(always)]
    fn upper_of(&self, lambda: f64, advance: f64) -> f32 {
        const LIMIT: f64 = f64::from_bits((1023 + 100) << 52);
        let t = lambda * self.stretch;
        let t = if t > LIMIT { LIMIT } else { t };
        let t = if t < -LIMIT { -LIMIT } else { t };
        let slack = (t.abs() + advance.abs()) * f64::EPSILON + TINY;
        let t = t - advance;
        ((t + slack) + t.abs() * (1.0 / f64::from(1 << 23))) as f32
    }
}

/// The ray moved to where its steepest coordinate is zero, and by how much: the whole tree lies within ±1 of there.
#[inline(never)]
fn approach(start: DVec3, direction: DVec3) -> (DVec3, f64) {
    let d = direction.abs();
    let t = if d.x >= d.y && d.x >= d.z {
        -start.x / direction.x
    } else if d.y >= d.z {
        -start.y / direction.y
    } else {
        -start.z / direction.z
    };
    (start + t * direction, t)
}

/// Largest absolute value; a NaN may be lost.
#[inline(always)]
fn largest(v: DVec3) -> f64 {
    let (x, y, z) = (v.x.abs(), v.y.abs(), v.z.abs());
    let m = if x > y { x } else { y };
    if m > z { m } else { z }
}

/// The exponent of a normal number.
#[inline(always)]
fn exponent_of_normal(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

#[inline(always)]
fn narrow(v: DVec3, last: f32) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, last]
}
