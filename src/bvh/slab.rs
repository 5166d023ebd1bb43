//! One ray against eight boxes in f32, never missing what the f64 ray meets.
//!
//! t = plane·inv − shift, one fused multiply-add a plane, with both shifts widened by what the roundings of plane,
//! origin, inverse and result may add up to: docs/numerics.md §10 has the proof. The form is Embree's; its margins, a
//! fixed number of ulps of t, do not cover the rounding of the origin and are replaced.

use super::frame::{Frame, down, exponent_of, up};
use crate::kernel::scaled::ldexp;
use crate::{Interval, Ray};
use glam::DVec3;

/// A ray in the frame of a tree, with what the box and leaf tests need of it.
///
/// `origin` + t·`direction` with 1 ≤ max |direction| < 2; t = λ·`stretch` − `advance`.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct LocalRay {
    /// Which row of a node holds the plane met first, by axis; the other is `3 − 2·(row ≥ 3)…`: see [`far`](Self::far).
    pub(crate) near: [usize; 3],
    pub(crate) far: [usize; 3],
    /// 1/direction, |inv| ≤ [`STEEPEST`].
    pub(crate) inv: [f32; 3],
    pub(crate) near_shift: [f32; 3],
    pub(crate) far_shift: [f32; 3],
    /// Not above the t of `within.min`.
    pub(crate) t_min: f32,
    /// Not below the t of `within.max`.
    pub(crate) t_max: f32,
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
    /// Each coordinate of `origin` is at most this far off the ray.
    pub(crate) origin_error: f64,
    stretch: f64,
    advance: f64,
}

/// Steeper slopes are taken for this one. A slab is then wider than the ray's stretch near the tree: §10.
const STEEPEST: f64 = 1_099_511_627_776.0; // 2⁴⁰

/// Margin of a box test, relative to 1 + |origin|: four roundings of f32 (three are needed: §10).
const SLAB: f64 = 4.0 / 16_777_216.0;

/// Origins further out than this are first moved along the ray to the tree.
const NEAR: f64 = 4.0;

impl LocalRay {
    /// `None` where the ray cannot be expressed in the frame (then every leaf is visited): origins 2⁵⁰ times farther
    /// than the tree is wide, and directions as extreme.
    #[inline(always)]
    pub(crate) fn new(frame: &Frame, ray: &Ray, within: Interval) -> Option<Self> {
        let longest = ray.direction.abs().max_element();
        let e = exponent_of(longest);
        let k = e - frame.exponent;
        if !(-1000..=1000).contains(&k) {
            return None;
        }
        let direction = if (-1000..=1000).contains(&e) {
            ray.direction * power(-e)
        } else {
            DVec3::from(ray.direction.to_array().map(|d| ldexp(d, -e)))
        };
        let start = frame.local(ray.origin);
        let reach = start.abs().max_element();
        let (mut origin, mut advance) = (start, 0.0);
        if reach > NEAR {
            // To where the steepest coordinate is zero: the whole tree lies within t = ±1 of it.
            let d = direction.abs();
            let t = if d.x >= d.y && d.x >= d.z {
                -start.x / direction.x
            } else if d.y >= d.z {
                -start.y / direction.y
            } else {
                -start.z / direction.z
            };
            origin = start + t * direction;
            advance = t;
        }
        // u·(|start| + |t·direction| + |origin|) ≤ u·(1 + 2 + 3)·reach, and the underflow of all.
        let origin_error = 4.0 * f64::EPSILON * reach + f64::MIN_POSITIVE;
        let size = origin.abs().max_element();
        if !(reach <= 1_125_899_906_842_624.0 && size <= 4_503_599_627_370_496.0) {
            return None;
        }
        let pad = SLAB * (1.0 + size) + 2.0 * origin_error;
        let mut local = Self {
            near: [0; 3],
            far: [0; 3],
            inv: [0.0; 3],
            near_shift: [0.0; 3],
            far_shift: [0.0; 3],
            t_min: 0.0,
            t_max: 0.0,
            origin,
            direction,
            origin_error,
            stretch: power(k),
            advance,
        };
        for i in 0..3 {
            let d = direction[i];
            let inv = if d.abs() < 1.0 / STEEPEST { STEEPEST } else { 1.0 / d };
            let away = usize::from(inv < 0.0);
            local.near[i] = i + 3 * away;
            local.far[i] = i + 3 - 3 * away;
            local.inv[i] = inv as f32;
            local.near_shift[i] = (origin[i] * inv + pad * inv.abs()) as f32;
            local.far_shift[i] = (origin[i] * inv - pad * inv.abs()) as f32;
        }
        local.t_min = local.lower(within.min);
        local.t_max = local.upper(within.max);
        Some(local)
    }

    /// Not below the t of `lambda`.
    #[inline(always)]
    pub(crate) fn upper(&self, lambda: f64) -> f32 {
        let t = lambda * self.stretch;
        up((t - self.advance) + (t.abs() + self.advance.abs()) * f64::EPSILON + f64::MIN_POSITIVE)
    }

    /// Not above the t of `lambda`.
    #[inline(always)]
    pub(crate) fn lower(&self, lambda: f64) -> f32 {
        let t = lambda * self.stretch;
        down((t - self.advance) - (t.abs() + self.advance.abs()) * f64::EPSILON - f64::MIN_POSITIVE)
    }
}

/// 2^e, |e| ≤ 1022.
#[inline(always)]
fn power(e: i32) -> f64 {
    f64::from_bits(((e + 1023) as u64) << 52)
}
