//! The tree's own frame, in which every coordinate is at most 1: what f32 resolves well, wherever the scene is.

use crate::Aabb;
use crate::kernel::float::{exponent_of, ldexp};
use glam::{DVec3, Vec4, Vec4Swizzles};

/// x ↦ (x − `center`)·2^−`exponent`.
///
/// A scene far from the origin is moved to it, one of any size is scaled by a power of two; f32 boxes lose neither
/// offset nor range. The subtraction rounds once, the scaling not at all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) center: DVec3,
    pub(crate) exponent: i32,
    pub(crate) scale: f64,
    /// 1/`scale`; infinite where that is no float.
    pub(crate) unscale: f64,
}

impl Frame {
    /// The frame in which the finite box `bounds` lies inside [−1, 1]³.
    pub(crate) fn around(bounds: Aabb) -> Self {
        if bounds.is_empty() || !bounds.is_finite() {
            return Self { center: DVec3::ZERO, exponent: 0, scale: 1.0, unscale: 1.0 };
        }
        let middle = bounds.center();
        let half = (0.5 * bounds.max - 0.5 * bounds.min).max_element();
        // Near the origin the frame is centred on it, so that vertices that f32 holds exactly stay exact; elsewhere
        // on a coarse grid, for the same reason.
        let grid = ldexp(1.0, exponent_of(half.max(1e-290)));
        let coordinate = |m: f64| {
            let far = m.abs() > 8.0 * half;
            let steps = m / grid;
            if !far {
                0.0
            } else if steps.abs() < 4e15 {
                steps.round() * grid
            } else {
                m
            }
        };
        let center = DVec3::new(coordinate(middle.x), coordinate(middle.y), coordinate(middle.z));
        let reach = (bounds.max - center).abs().max((bounds.min - center).abs()).max_element();
        // One rounding of `reach` cannot lift it to the next power but one.
        let exponent = (exponent_of(reach.max(1e-290)) + 1).min(1024);
        Self { center, exponent, scale: ldexp(1.0, -exponent), unscale: ldexp(1.0, exponent) }
    }

    /// `x` in the frame; each coordinate is off by at most u of itself and 2⁻¹⁰⁷⁴.
    #[inline(always)]
    pub(crate) fn local(&self, x: DVec3) -> DVec3 {
        (x - self.center) * self.scale
    }

    /// The way back: exact for what `local` and a rounding to f32 did not change.
    #[inline(always)]
    pub(crate) fn world(&self, x: DVec3) -> DVec3 {
        x * self.unscale + self.center
    }

    /// a − b in the frame: one rounding a coordinate, and underflow.
    #[inline(always)]
    pub(crate) fn local_difference(&self, a: DVec3, b: DVec3) -> DVec3 {
        (a - b) * self.scale
    }

    /// The box around what lies in an f32 box of the frame.
    pub(crate) fn back(&self, min: [f32; 3], max: [f32; 3]) -> Aabb {
        let world = |v: [f32; 3]| self.world(DVec3::from(v.map(f64::from)));
        // The addition's rounding; exact about the origin.
        let slack = |v: DVec3| {
            if self.center == DVec3::ZERO { DVec3::ZERO } else { f64::EPSILON * (v.abs() + self.center.abs()) }
        };
        let (min, max) = (world(min), world(max));
        Aabb { min: min - slack(min), max: max + slack(max) }
    }

    /// The f32 box around the box `b`: infinite if `b` is not finite, or not a box.
    pub(crate) fn outward(&self, b: &Aabb) -> FrameBox {
        if b.is_empty() || !b.is_finite() {
            return FrameBox { least: Vec4::NEG_INFINITY, most: Vec4::NEG_INFINITY };
        }
        let (lo, hi) = (self.local(b.min), self.local(b.max));
        // The subtraction's rounding; exact about the origin.
        let slack = |v: f64, c: f64| if c == 0.0 { 0.0 } else { v.abs() * f64::EPSILON };
        let least = |i: usize| down(lo[i] - slack(lo[i], self.center[i]));
        let most = |i: usize| down(-hi[i] - slack(hi[i], self.center[i]));
        FrameBox {
            least: Vec4::new(least(0), least(1), least(2), 0.0),
            most: Vec4::new(most(0), most(1), most(2), 0.0),
        }
    }

    /// `x` in the frame, rounded to the nearest f32.
    #[inline(always)]
    pub(crate) fn nearest(&self, x: DVec3) -> Vec4 {
        let x = self.local(x);
        Vec4::new(x.x as f32, x.y as f32, x.z as f32, 0.0)
    }
}

/// A box in the frame: its least corner, and its greatest one negated, so that growing it is two minima. The fourth
/// coordinates are anything.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameBox {
    pub(crate) least: Vec4,
    pub(crate) most: Vec4,
}

impl FrameBox {
    /// Holds nothing.
    pub(crate) const EMPTY: Self = Self { least: Vec4::INFINITY, most: Vec4::INFINITY };

    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.least.x == f32::INFINITY
    }

    /// Around three points that are what they seem.
    #[inline(always)]
    pub(crate) fn around(a: Vec4, b: Vec4, c: Vec4) -> Self {
        Self { least: a.min(b).min(c), most: -a.max(b).max(c) }
    }

    /// Around everything that [`Frame::nearest`] takes to a point in it; inside [−1, 1]³.
    #[inline(always)]
    pub(crate) fn widened(&self) -> Self {
        // Four times half an ulp: the rounding to the nearest, the one here, and the frame's.
        let wider = |x: Vec4| (x - (x.abs() * (2.0 * f32::EPSILON) + Vec4::splat(1e-30))).max(Vec4::NEG_ONE);
        Self { least: wider(self.least), most: wider(self.most) }
    }

    #[inline(always)]
    pub(crate) fn union(&self, other: &Self) -> Self {
        Self { least: self.least.min(other.least), most: self.most.min(other.most) }
    }

    /// Half the surface; infinite for an infinite box.
    #[inline(always)]
    pub(crate) fn half_area(&self) -> f32 {
        let sides = self.least + self.most;
        let p = sides * sides.yzxw();
        p.x + p.y + p.z
    }
}

/// The largest f32 that is not above `x`; −∞ for NaN. Without branches: which way it is rounded cannot be foreseen.
#[inline(always)]
pub(crate) fn down(x: f64) -> f32 {
    let f = x as f32;
    let bits = f.to_bits() as i32;
    // The next one towards −∞: one less in magnitude above zero, one more below it.
    let below = if f == 0.0 { i32::MIN + 1 } else { bits - (bits >> 31 | 1) };
    let rounded = f32::from_bits(if f64::from(f) > x { below } else { bits } as u32);
    if x.is_nan() { f32::NEG_INFINITY } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn boxes_only_grow(
            at in prop::array::uniform3(-1.0..1.0f64), size in prop::array::uniform3(0.0..1.0f64),
            offset in -300..300i32, scale in -300..300i32,
        ) {
            use crate::kernel::{dyadic::Dyadic, number::Number};
            let min = DVec3::from(at) * 2f64.powi(offset);
            let b = Aabb::new(min, min + DVec3::from(size) * 2f64.powi(scale));
            let frame = Frame::around(b);
            let FrameBox { least: lo, most } = frame.outward(&b);
            let hi = -most;
            let near = FrameBox::around(frame.nearest(b.min), frame.nearest(b.max), frame.nearest(b.min)).widened();
            for i in 0..3 {
                prop_assert!(-1.0 <= near.least[i] && near.least[i] <= lo[i] && hi[i] <= -near.most[i] && near.most[i] >= -1.0);
                let exact = |x: f64| Dyadic::difference(x, frame.center[i]).shifted(-frame.exponent);
                let below = exact(b.min[i]).minus(&f64::from(lo[i]).into());
                let above = Dyadic::exactly(f64::from(hi[i])).minus(&exact(b.max[i]));
                prop_assert!(below.sign() != Some(std::cmp::Ordering::Less));
                prop_assert!(above.sign() != Some(std::cmp::Ordering::Less));
                prop_assert!(lo[i] >= -1.0 && hi[i] <= 1.0, "{} {}", lo[i], hi[i]);
            }
        }
    }

    #[test]
    fn extremes_are_legal() {
        for b in [
            Aabb::new([-1e308; 3], [1.7e308; 3]),
            Aabb::new([0.0; 3], [0.0; 3]),
            Aabb::new([1e300; 3], [1e300; 3]),
            Aabb::new([5e-324; 3], [1e-323; 3]),
        ] {
            let frame = Frame::around(b);
            let FrameBox { least: lo, most } = frame.outward(&b);
            let hi = -most;
            assert!((0..3).all(|i| -1.0 <= lo[i] && lo[i] <= hi[i] && hi[i] <= 1.0), "{b:?} {lo:?} {hi:?}");
        }
    }
}
