//! The lecture's and the literature's kernels as given: what the shipped kernels are measured against.
//!
//! Generic over the precision ([`f32`] or [`f64`]), with the signatures of the shipped kernels, so that one table lines
//! them up. Inputs are cast to the precision at the door, as a renderer of that precision would have stored them. They
//! claim nothing: [`Hit::error`] is infinite. Nothing else in the crate calls them.
//!
//! "Lecture" is CSCD18 *Ray Tracing, Part 2* (L. Sigal, 2008), with its errata mended: docs/numerics.md §13.

// Comparisons are written so that a NaN misses.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod flat;
mod quadric;
mod triangle;

pub use flat::{plane, polygon, slab};
pub use quadric::{cone, cylinder, sphere, sphere_gems};
pub use triangle::{algorithm_1, algorithm_2, moller_trumbore, woop};

use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::{DVec2, DVec3};
use std::fmt::Debug;
use std::ops::{Add, Div, Index, Mul, Neg, Sub};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The precision a textbook kernel computes in: `f32` or `f64`.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + PartialOrd
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// ∞.
    const INFINITY: Self;
    /// Rounded to this precision.
    fn from_f64(value: f64) -> Self;
    /// Exactly.
    fn to_f64(self) -> f64;
    /// √self.
    #[must_use]
    fn sqrt(self) -> Self;
    /// |self|.
    #[must_use]
    fn abs(self) -> Self;
    /// |self| with the sign of `sign`.
    #[must_use]
    fn copysign(self, sign: Self) -> Self;
    /// u·v − w·x in the next precision up, rounded to this one: what Woop's kernel falls back to. For f64 there is
    /// none, and it is the plain expression.
    fn wider_cross(u: Self, v: Self, w: Self, x: Self) -> Self;
}

macro_rules! real {
    ($($r:ty),*) => {$(
        impl Real for $r {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const INFINITY: Self = <$r>::INFINITY;
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $r
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                self.copysign(sign)
            }
            #[inline(always)]
            fn wider_cross(u: Self, v: Self, w: Self, x: Self) -> Self {
                (f64::from(u) * f64::from(v) - f64::from(w) * f64::from(x)) as $r
            }
        }
    )*};
}
real!(f32, f64);

/// Three numbers of one precision.
#[derive(Clone, Copy, Debug)]
struct V3<R>(R, R, R);

impl<R: Real> V3<R> {
    #[inline(always)]
    fn of(v: DVec3) -> Self {
        Self(R::from_f64(v.x), R::from_f64(v.y), R::from_f64(v.z))
    }

    #[inline(always)]
    fn dot(self, b: Self) -> R {
        self.0 * b.0 + self.1 * b.1 + self.2 * b.2
    }

    #[inline(always)]
    fn cross(self, b: Self) -> Self {
        Self(self.1 * b.2 - self.2 * b.1, self.2 * b.0 - self.0 * b.2, self.0 * b.1 - self.1 * b.0)
    }

    #[inline(always)]
    fn scaled(self, s: R) -> Self {
        Self(self.0 * s, self.1 * s, self.2 * s)
    }

    /// The axis of the largest |component|.
    #[inline(always)]
    fn dominant_axis(self) -> usize {
        let (x, y, z) = (self.0.abs(), self.1.abs(), self.2.abs());
        if x > y && x > z {
            0
        } else if y > z {
            1
        } else {
            2
        }
    }
}

impl<R: Real> Add for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1, self.2 + b.2)
    }
}

impl<R: Real> Sub for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(self.0 - b.0, self.1 - b.1, self.2 - b.2)
    }
}

impl<R> Index<usize> for V3<R> {
    type Output = R;
    #[inline(always)]
    fn index(&self, axis: usize) -> &R {
        match axis {
            0 => &self.0,
            1 => &self.1,
            _ => &self.2,
        }
    }
}

/// A ray and an interval in one precision.
#[inline(always)]
fn cast<R: Real>(ray: &Ray, within: Interval) -> (V3<R>, V3<R>, R, R) {
    (V3::of(ray.origin), V3::of(ray.direction), R::from_f64(within.min), R::from_f64(within.max))
}

/// The smaller of two λ, smallest first, that lies in the open interval.
#[inline(always)]
fn first_within<R: Real>(near: R, far: R, min: R, max: R) -> Option<R> {
    if near > min && near < max {
        Some(near)
    } else if far > min && far < max {
        Some(far)
    } else {
        None
    }
}

#[inline(always)]
fn hit<R: Real>(lambda: R, u: R, v: R, part: u32) -> Hit {
    Hit { lambda: lambda.to_f64(), error: f64::INFINITY, uv: DVec2::new(u.to_f64(), v.to_f64()), part }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;

    type Kernel = fn(&Ray, Interval) -> Option<Hit>;

    /// Every kernel on a ray it must get right: down the z axis from (¼, ¼, 4) with a direction of length 2.
    #[test]
    fn each_kernel_answers_an_easy_ray() {
        const A: DVec3 = DVec3::new(-1.0, -1.0, 0.0);
        const B: DVec3 = DVec3::new(3.0, -1.0, 0.0);
        const C: DVec3 = DVec3::new(-1.0, 3.0, 0.0);
        const Z: DVec3 = DVec3::Z;
        const O: DVec3 = DVec3::ZERO;
        macro_rules! kernels {
            ($r:ty) => {{
                let kernels: [(&str, Kernel, f64); 10] = [
                    ("algorithm 1", |r, w| algorithm_1::<$r>(r, &[A, B, C], w), 2.0),
                    ("algorithm 2", |r, w| algorithm_2::<$r>(r, &[A, B, C], w), 2.0),
                    ("moller trumbore", |r, w| moller_trumbore::<$r>(r, &[A, B, C], w), 2.0),
                    ("woop", |r, w| woop::<$r>(r, &[A, B, C], w), 2.0),
                    ("plane", |r, w| plane::<$r>(r, A, Z, w), 2.0),
                    ("polygon", |r, w| polygon::<$r>(r, &[&[A, B, C]], w), 2.0),
                    ("sphere", |r, w| sphere::<$r>(r, O, 1.0, w), 2.0 - 0.875f64.sqrt() / 2.0),
                    ("sphere gems", |r, w| sphere_gems::<$r>(r, O, 1.0, w), 2.0 - 0.875f64.sqrt() / 2.0),
                    ("cylinder", |r, w| cylinder::<$r>(r, O, 3.0 * Z, 1.0, 1.0, w), 0.5),
                    ("cone", |r, w| cone::<$r>(r, O, 3.0 * Z, 1.0, 0.0, w), 2.0 - 1.5 * (1.0 - 0.125f64.sqrt())),
                ];
                let ray = Ray::new([0.25, 0.25, 4.0], [0.0, 0.0, -2.0]);
                let aside = Ray::new([25.0, 0.25, 4.0], [0.0, 0.0, -2.0]);
                for (name, kernel, lambda) in kernels {
                    let hit = kernel(&ray, Interval::FORWARD).unwrap_or_else(|| panic!("{name} missed"));
                    assert!((hit.lambda - lambda).abs() < 1e-5, "{name}: {} for {lambda}", hit.lambda);
                    assert!(hit.error == f64::INFINITY, "{name} claims a bound");
                    assert!(kernel(&ray, Interval::new(50.0, 60.0)).is_none(), "{name} ignores the interval");
                    assert!(name == "plane" || kernel(&aside, Interval::FORWARD).is_none(), "{name} hit aside");
                }
                let (enter, exit) = slab::<$r>(&ray, -DVec3::ONE, DVec3::ONE, Interval::FORWARD).unwrap();
                assert_eq!((enter, exit), (1.5, 2.5));
                assert!(slab::<$r>(&aside, -DVec3::ONE, DVec3::ONE, Interval::FORWARD).is_none());
            }};
        }
        kernels!(f32);
        kernels!(f64);
    }
}
