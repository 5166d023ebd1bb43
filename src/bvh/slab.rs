//! One ray against eight boxes in f32, never missing what the f64 ray meets.
//!
//! t = plane·inv + shift, one fused multiply-add a plane, with both shifts widened by what the roundings of plane,
//! origin, inverse and result may add up to: docs/numerics.md §10 has the proof. The form is Embree's; its margins, a
//! fixed number of ulps of t, do not cover the rounding of the origin and are replaced.

use super::frame::Frame;
use crate::kernel::float::power;
use crate::{Interval, Ray};
use fearless_simd::{Simd, f32x4, f32x8, f64x2, i32x4, mask32x8, prelude::*};
use glam::DVec3;

/// A ray in the frame of a tree, with what the box and leaf tests need of it: `origin` + t·`direction`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    /// Bit i: the direction's coordinate i is negative.
    pub(crate) away: u32,
    /// 1/direction, within ±`Placed::steepest`.
    pub(crate) inv: [f32; 4],
    /// What is taken from plane·inv: of planes met first, and of those met last.
    pub(crate) near_shift: [f32; 4],
    pub(crate) far_shift: [f32; 4],
    pub(crate) ends: Ends,
    /// The origin, rounded.
    pub(crate) origin: [f32; 4],
    /// The direction, rounded.
    pub(crate) direction: [f32; 4],
    /// Largest coordinate of the origin.
    pub(crate) size: f32,
    /// Largest coordinate of the direction.
    pub(crate) length: f32,
    /// Each coordinate of the origin was off the ray by at most this before it was rounded.
    pub(crate) origin_error: f32,
    pub(crate) limits: Limits,
}

/// λ and t of a ray: t = λ·stretch − advance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    stretch: f64,
    advance: f64,
}

/// The unit roundoff of f32, 2⁻²⁴.
pub(crate) const E: f32 = f32::EPSILON / 2.0;

/// Margin of a box test, relative to 1 + |origin|: eight roundings of f32 (six are needed: §10).
pub(super) const SLAB: f32 = 8.0 * E;

/// Slack of a limit at or near zero. Nothing in a tree of width 1 is that small, and products with it stay clear of the
/// subnormals, whose arithmetic costs a hundred times as much.
pub(super) const TINY: f64 = 1.0 / (1u64 << 60) as f64;

/// Origins further out than this are first moved along the ray to the tree.
pub(super) const NEAR: f32 = 4.0;

/// Directions in the frame whose largest coordinate is beyond these are first scaled.
pub(super) const LENGTHS: [f32; 2] = [1.0 / 1_099_511_627_776.0, 1_099_511_627_776.0]; // 2^±40

/// [`Placed::steepest`] of a ray that is taken as it is.
pub(super) const STEEPEST: f32 = LENGTHS[1] * LENGTHS[1];

/// [`LocalRay::origin_error`] of a ray that is taken as it is: 4u are needed.
pub(super) const PLAIN_ERROR: f32 = 8.0 * f64::EPSILON as f32;

/// Origins beyond this, before or after, are not traced.
const FARTHEST: f64 = 1_125_899_906_842_624.0; // 2⁵⁰

/// A ray in the frame, rounded.
struct Placed<S: Simd> {
    origin: f32x4<S>,
    direction: f32x4<S>,
    /// Their largest coordinates.
    size: f32,
    length: f32,
    /// See [`LocalRay::origin_error`].
    error: f32,
    /// Slopes 1/direction beyond this are taken for it. A slab is then wider than the ray's stretch near the tree: §10.
    steepest: f32,
    limits: Limits,
}

impl LocalRay {
    /// A ray that is taken as it is, from its origin on, as nearly all are: `t_min` ≥ 0. `None` for others, which are
    /// for [`uncommon`](Self::uncommon) in a function of its own: what follows is compiled for the constants here.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, frame: &Frame, ray: &Ray, within: Interval) -> Option<Self> {
        let placed = as_it_is(simd, frame, ray)?;
        // A NaN fails every comparison.
        if !((within.min >= 0.0) & (within.min < within.max)) {
            return None;
        }
        Some(Self::placed(&placed, plain_ends(simd, within)))
    }

    /// Any other ray. `None` where it cannot be expressed in the frame (then every leaf is visited): origins 2⁵⁰ times
    /// farther than the tree is wide, and directions as extreme; also for rays that are not valid and for empty
    /// intervals.
    #[inline(always)]
    pub(crate) fn uncommon<S: Simd>(simd: S, frame: &Frame, ray: &Ray, within: Interval) -> Option<Self> {
        if within.is_empty() {
            return None;
        }
        let placed = match as_it_is(simd, frame, ray) {
            Some(placed) => placed,
            None => place(simd, frame, ray)?,
        };
        Some(Self::placed(&placed, placed.limits.of(simd, within)))
    }

    #[inline(always)]
    fn placed<S: Simd>(placed: &Placed<S>, ends: Ends) -> Self {
        let &Placed { origin, direction, size, length, error, steepest, limits } = placed;
        let simd = origin.simd;
        let splat = |x: f32| f32x4::splat(simd, x);
        let inv = splat(1.0) / largest_of(direction.abs(), splat(1.0 / steepest)).copysign(direction);
        // With the direction's sign: planes met first are met as if the origin lay farther on, the others as if farther
        // back.
        let pad = origin.abs().mul_add(splat(SLAB), splat(SLAB + 2.0 * error)).copysign(direction);
        Self {
            away: direction.bitcast::<i32x4<S>>().simd_lt(i32x4::splat(simd, 0)).to_bitmask() as u32,
            inv: inv.into(),
            near_shift: ((origin + pad) * inv).into(),
            far_shift: ((origin - pad) * inv).into(),
            ends,
            origin: origin.into(),
            direction: direction.into(),
            size,
            length,
            origin_error: error,
            limits,
        }
    }
}

impl Limits {
    /// t = λ.
    pub(crate) const PLAIN: Self = Self { stretch: 1.0, advance: 0.0 };

    /// Not below the t of `lambda`: λ·stretch − advance. One addition covers the roundings of both precisions; what
    /// matters near the tree is far below the limit of 2¹⁰⁰, which keeps infinities out of the sums.
    #[inline(always)]
    pub(crate) fn upper(&self, lambda: f64) -> f32 {
        let t = lambda * self.stretch;
        let t = if t > FARTHEST_T { FARTHEST_T } else { t };
        let t = if t < -FARTHEST_T { -FARTHEST_T } else { t };
        let slack = (t.abs() + self.advance.abs()) * f64::EPSILON + TINY;
        let t = t - self.advance;
        ((t + slack) + t.abs() * NARROWING) as f32
    }

    /// The interval in t, rounded both ways.
    #[inline(always)]
    fn of<S: Simd>(&self, simd: S, within: Interval) -> Ends {
        let splat = |x: f64| f64x2::<S>::splat(simd, x);
        let t = f64x2::<S>::simd_from(simd, [within.min, within.max]) * self.stretch;
        let t = t.min(splat(FARTHEST_T)).max(splat(-FARTHEST_T));
        let slack = (t.abs() + splat(self.advance.abs())) * f64::EPSILON + TINY;
        let t = t - splat(self.advance);
        let half = t.abs() * NARROWING + slack;
        let [t_min, sure_max, sure_min, t_max]: [f32; 4] = (t - half).relaxed_narrow(t + half).into();
        Ends { sure: Sure { min: sure_min, max: sure_max }, t_min, t_max }
    }
}

/// [`Limits::of`] for t = λ ≥ 0, in f32: rounded first, then moved by four roundings, to zero at least.
#[inline(always)]
fn plain_ends<S: Simd>(simd: S, within: Interval) -> Ends {
    let splat = |x: f32| f32x4::<S>::splat(simd, x);
    let ends = f64x2::<S>::simd_from(simd, [within.min, within.max]);
    let t = ends.relaxed_narrow(ends).min(splat(FARTHEST_T as f32));
    let half = t.mul_add(splat(4.0 * E), splat(TINY as f32));
    let ends = half.mul_add(f32x4::simd_from(simd, [1.0, -1.0, -1.0, 1.0]), t).max(splat(0.0));
    let [min, max, t_min, t_max]: [f32; 4] = ends.into();
    Ends { sure: Sure { min, max }, t_min, t_max }
}

/// Beyond this limits are all alike.
pub(super) const FARTHEST_T: f64 = power(100);

/// Covers the rounding of a limit to f32, twice.
const NARROWING: f64 = power(-23);

/// An interval as limits of t, in the order in which they are found as one vector.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Ends {
    pub(crate) sure: Sure,
    /// Not above the t of `within.min`.
    pub(crate) t_min: f32,
    /// Not below the t of `within.max`.
    pub(crate) t_max: f32,
}

/// What is certainly inside an interval: limits of t rounded inward.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Sure {
    min: f32,
    max: f32,
}

impl Sure {
    /// Whether a t between these is inside for certain; not if one is NaN.
    #[inline(always)]
    pub(crate) fn holds(self, [low, high]: [f32; 2]) -> bool {
        (low > self.min) & (high < self.max)
    }

    /// The same of eight.
    #[inline(always)]
    pub(crate) fn holds_each<S: Simd>(self, simd: S, [low, high]: [f32x8<S>; 2]) -> mask32x8<S> {
        low.simd_gt(f32x8::splat(simd, self.min)) & high.simd_lt(f32x8::splat(simd, self.max))
    }
}

/// A ray in the frame with nothing but roundings.
#[inline(always)]
fn as_it_is<S: Simd>(simd: S, frame: &Frame, ray: &Ray) -> Option<Placed<S>> {
    let pair = |x: f64, y: f64| f64x2::<S>::simd_from(simd, [x, y]);
    let (o, d, c) = (ray.origin, ray.direction, frame.center);
    let direction = (pair(d.x, d.y) * frame.scale).relaxed_narrow(pair(d.z, 0.0) * frame.scale);
    let origin = ((pair(o.x, o.y) - pair(c.x, c.y)) * frame.scale)
        .relaxed_narrow((pair(o.z, 0.0) - pair(c.z, 0.0)) * frame.scale);
    let [size, length] = sizes(origin, direction);
    // A NaN fails every comparison.
    if !((size <= NEAR) & (LENGTHS[0]..=LENGTHS[1]).contains(&length)) {
        return None;
    }
    Some(Placed { origin, direction, size, length, error: PLAIN_ERROR, steepest: STEEPEST, limits: Limits::PLAIN })
}

/// The larger of each two that are not below zero, a NaN if there is one: compared as integers, in a quarter of the
/// time.
#[inline(always)]
fn largest_of<S: Simd>(a: f32x4<S>, b: f32x4<S>) -> f32x4<S> {
    a.bitcast::<i32x4<S>>().max(b.bitcast::<i32x4<S>>()).bitcast()
}

/// The largest coordinates of two vectors whose fourth are zero, found beside each other; a NaN if there is one.
#[inline(always)]
fn sizes<S: Simd>(a: f32x4<S>, b: f32x4<S>) -> [f32; 2] {
    let (a, b) = (a.abs(), b.abs());
    let two = largest_of(a.zip_low(b), a.zip_high(b));
    let [of_a, of_b, ..]: [f32; 4] = largest_of(two, two.slide::<2>(two)).into();
    [of_a, of_b]
}

/// Rays from far outside, and with very long or short directions; as [`as_it_is`].
#[inline(always)]
fn place<S: Simd>(simd: S, frame: &Frame, ray: &Ray) -> Option<Placed<S>> {
    let e = exponent_of_normal(largest(ray.direction));
    let k = e - frame.exponent;
    // A zero or subnormal direction has e = −1023, an infinite one e = 1024.
    if (e.abs() > 1000) | (k.abs() > 1000) {
        return None;
    }
    let direction = ray.direction * power(-e);
    let start = frame.local(ray.origin);
    let reach = largest(start);
    let (mut origin, mut advance, mut size) = (start, 0.0, reach);
    if reach > f64::from(NEAR) {
        (origin, advance) = approach(start, direction);
        size = largest(origin);
    }
    let sum = direction.element_sum() + origin.element_sum();
    if !((reach <= FARTHEST) & (size <= FARTHEST) & sum.is_finite()) {
        return None;
    }
    let narrow =
        |v: DVec3| f64x2::<S>::simd_from(simd, [v.x, v.y]).relaxed_narrow(f64x2::<S>::simd_from(simd, [v.z, 0.0]));
    let (origin, direction) = (narrow(origin), narrow(direction));
    let [size, length] = sizes(origin, direction);
    Some(Placed {
        origin,
        direction,
        size,
        length,
        // u·(|start| + |t·direction| + |origin|) ≤ u·(1 + 2 + 3)·reach, and the underflow of all; up by 2⁻¹⁰.
        error: (4.004 * f64::EPSILON * reach + f64::from(f32::MIN_POSITIVE)) as f32,
        steepest: LENGTHS[1],
        limits: Limits { stretch: power(k), advance },
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Level;
    use crate::kernel::search::{Rational, climb};
    use fearless_simd::dispatch;

    fn rational(x: f64) -> Rational {
        Rational::try_from(x).unwrap()
    }

    /// A ray meets a plane between the near t of it and the far one: how far from their middle, in halves of what lies
    /// between.
    #[test]
    fn no_input_reaches_the_margins() {
        let frame = Frame { center: DVec3::ZERO, exponent: 0, scale: 1.0, unscale: 1.0 };
        let worst = climb("planes in f32", 4, |x| {
            let ray = Ray::new([4.0 * x[0], 0.0, 0.0], [x[1] * power((20.0 * x[2]) as i32), 1.0, 1.0]);
            let plane = x[3] as f32;
            let exact = (rational(plane.into()) - rational(ray.origin.x)) / rational(ray.direction.x);
            let from_middle = |level: Level| {
                let [near, far] = dispatch!(level.token(), simd => {
                    let local = LocalRay::new(simd, &frame, &ray, Interval::FORWARD).expect("an ordinary ray");
                    let (inv, planes) = (f32x4::simd_from(simd, local.inv), f32x4::splat(simd, plane));
                    [local.near_shift, local.far_shift].map(|shift| {
                        let t: [f32; 4] = planes.mul_sub(inv, f32x4::simd_from(simd, shift)).into();
                        rational(t[0].into())
                    })
                });
                ((&exact + &exact - &near - &far) / (far - near)).to_f64().value().abs()
            };
            Some(Level::all().into_iter().map(|(_, level)| from_middle(level)).fold(0.0, f64::max))
        });
        assert!((0.3..0.75).contains(&worst), "{worst}");
    }
}
