//! A hit's point in a shape's own place and scale: what normals and projected points are made of.

use crate::Ray;
use crate::kernel::cpu::{FusedLanes, dispatch_lanes};
use crate::kernel::eft::{two_diff, two_sum};
use crate::kernel::float::{exponent_of, ldexp, power};
use crate::kernel::lanes::{Lanes, Plain};
use glam::DVec3;

/// Lengths are divided by 2^exponent, so that squares neither overflow nor vanish.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    exponent: i32,
}

impl Local {
    /// For lengths up to `largest`; none are changed unless they are extreme.
    pub(super) fn new(largest: f64) -> Self {
        let ordinary = 1e-90..1e90;
        Self { exponent: if ordinary.contains(&largest) { 0 } else { exponent_of(largest) } }
    }

    /// A length in local units.
    pub(super) fn inside(self, x: f64) -> f64 {
        scaled(x, -self.exponent)
    }

    /// A vector in local units.
    pub(super) fn vector(self, v: DVec3) -> DVec3 {
        if self.exponent == 0 { v } else { v.map(|x| self.inside(x)) }
    }

    /// A local length outside.
    pub(super) fn outside(self, x: f64) -> f64 {
        scaled(x, self.exponent)
    }

    /// A local vector outside.
    pub(super) fn vector_outside(self, v: DVec3) -> DVec3 {
        if self.exponent == 0 { v } else { v.map(|x| self.outside(x)) }
    }

    /// What is shorter may have lost digits when it was scaled, in local units.
    pub(super) fn lost(self) -> f64 {
        if self.exponent == 0 { 0.0 } else { power(-1000) }
    }

    /// origin + (λ₀ + λ₁)·direction − `from`, rounded once or twice: the parts that cancel do so exactly.
    pub(super) fn offset(self, ray: &Ray, lambda: [f64; 2], from: DVec3) -> DVec3 {
        let (o, from) = (self.vector(ray.origin), self.vector(from));
        let longest = ray.direction.abs().max_element();
        let step = if (1e-150..1e150).contains(&longest) { 0 } else { exponent_of(longest) };
        let d = if step == 0 { ray.direction } else { ray.direction.map(|x| scaled(x, -step)) };
        let [l, rest] = lambda.map(|l| scaled(l, step - self.exponent));
        dispatch_lanes(
            #[inline(always)]
            |cpu| offset::<FusedLanes>(cpu, o, [l, rest], d, from),
            #[inline(always)]
            || offset::<Plain>((), o, [l, rest], d, from),
        )
    }
}

#[inline(always)]
fn offset<L: Lanes>(cpu: L::Cpu, o: DVec3, [l, rest]: [f64; 2], d: DVec3, from: DVec3) -> DVec3 {
    let d = L::of(cpu, d);
    let (x, x_lo) = two_diff(L::of(cpu, o), L::of(cpu, from));
    let (p, p_lo) = d.two_product(d.splat(l));
    let (s, s_lo) = two_sum(x, p);
    let [x, y, z, _] = (s + (s_lo + (x_lo + p_lo + d * d.splat(rest)))).to_array();
    DVec3::new(x, y, z)
}

fn scaled(x: f64, e: i32) -> f64 {
    if e == 0 { x } else { ldexp(x, e) }
}

/// The float below `x` − `y` or at it, and the one above `x` + `y` or at it.
pub(super) fn around(x: f64, y: f64) -> (f64, f64) {
    let (low, low_rest) = two_diff(x, y);
    let (high, high_rest) = two_sum(x, y);
    // A rest of NaN (overflow) steps outward too.
    (if low_rest >= 0.0 { low } else { low.next_down() }, if high_rest <= 0.0 { high } else { high.next_up() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_rounded_outward_and_only_if_they_must() {
        assert_eq!(around(1.0, 0.5), (0.5, 1.5));
        assert_eq!(around(1.0, 1e-30), (1.0f64.next_down(), 1.0f64.next_up()));
        assert_eq!(around(f64::MAX, f64::MAX).1, f64::INFINITY);
        assert_eq!(around(0.1, 0.2).1, 0.1 + 0.2);
    }
}
