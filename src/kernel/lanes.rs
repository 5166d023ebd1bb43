//! The components of a vector side by side in one register: one instruction for all three.
//!
//! What the flat kernels are written in. Each kind of [`Product`] has its own, with the same rounded operations in the
//! same order, so that their bits agree.

use super::eft::{Product, Split, two_diff, two_sum};
use fearless_simd::{Simd, SimdFrom, f64x2, f64x4};
use glam::DVec3;
use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

/// Two floats.
pub trait Two: Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Both.
    fn to_array(self) -> [f64; 2];
    /// `x` in each lane, on the CPU of this.
    #[must_use]
    fn splat(self, x: f64) -> Self;
    /// |self|.
    #[must_use]
    fn abs(self) -> Self;
    /// Whether self ≤ other in either lane: a NaN is not.
    fn any_le(self, other: Self) -> bool;
    /// Whether least < self < most in both lanes: a NaN anywhere is not.
    fn is_between(self, least: Self, most: f64) -> bool;
}

/// Four floats: x, y, z and one that means nothing.
pub trait Lanes: Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// The proof that this CPU has the instructions.
    type Cpu: Copy;
    /// Half of it.
    type Half: Two;
    /// These four.
    fn new(cpu: Self::Cpu, lanes: [f64; 4]) -> Self;
    /// Another four, on the CPU of this.
    #[must_use]
    fn like(self, lanes: [f64; 4]) -> Self;
    /// All four.
    fn to_array(self) -> [f64; 4];
    /// |self|.
    #[must_use]
    fn abs(self) -> Self;
    /// The larger in each lane; either of them where one is NaN.
    #[must_use]
    fn max(self, other: Self) -> Self;
    /// [`Product::two_product`] in each lane.
    fn two_product(self, other: Self) -> (Self, Self);

    /// The components of `v`.
    #[inline(always)]
    fn of(cpu: Self::Cpu, v: DVec3) -> Self {
        Self::new(cpu, [v.x, v.y, v.z, v.z])
    }

    /// (z, x, y): turned twice.
    #[inline(always)]
    fn turned_back(cpu: Self::Cpu, v: DVec3) -> Self {
        Self::new(cpu, [v.z, v.x, v.y, v.y])
    }

    /// `x` in each lane, on the CPU of this.
    #[inline(always)]
    #[must_use]
    fn splat(self, x: f64) -> Self {
        self.like([x; 4])
    }

    /// (y, z, x).
    #[inline(always)]
    #[must_use]
    fn turned(self) -> Self {
        let [x, y, z, w] = self.to_array();
        self.like([y, z, x, w])
    }

    /// The x, the y and the z of two vectors.
    #[must_use]
    fn rows(self, other: Self) -> [Self::Half; 3];
    /// The first two.
    #[must_use]
    fn low(self) -> Self::Half;
    /// Two and two.
    #[must_use]
    fn joined(self, low: Self::Half, high: Self::Half) -> Self;

    /// The x, the y and the z of four vectors.
    #[inline(always)]
    #[must_use]
    fn columns([a, b, c, d]: [Self; 4]) -> [Self; 3] {
        let ([x, y, z], [t, u, v]) = (a.rows(b), c.rows(d));
        [a.joined(x, t), a.joined(y, u), a.joined(z, v)]
    }

    /// The largest |component| of four vectors.
    #[inline(always)]
    fn largest(vectors: [Self; 4]) -> Self {
        let [x, y, z] = Self::columns(vectors);
        x.abs().max(y.abs()).max(z.abs())
    }
}

/// A vector as an unevaluated sum, |lo| at most a few u of |hi|.
#[derive(Clone, Copy, Debug)]
pub(super) struct Double<L> {
    pub(super) hi: L,
    pub(super) lo: L,
}

impl<L: Lanes> Double<L> {
    /// a − b, exactly.
    #[inline(always)]
    pub(super) fn difference(a: L, b: L) -> Self {
        let (hi, lo) = two_diff(a, b);
        Self { hi, lo }
    }

    /// The products of components.
    #[inline(always)]
    pub(super) fn product(a: L, b: L) -> Self {
        let (hi, lo) = a.two_product(b);
        Self { hi, lo }
    }

    /// self × other: with M the product of the largest components |lo| ≤ 8.1uM, off by 28u²M.
    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        let Self { hi, lo } = self.cross_turned_back(other, false);
        Self { hi: hi.turned(), lo: lo.turned() }
    }

    /// [`Double::cross`] as (z, x, y). If both are `plain`, their low parts zero, these cost nothing.
    #[inline(always)]
    pub(super) fn cross_turned_back(self, other: Self, plain: bool) -> Self {
        let (at, bt) = (self.hi.turned(), other.hi.turned());
        let ((p, p_lo), (m, m_lo)) = (self.hi.two_product(bt), at.two_product(other.hi));
        let (hi, rounding) = two_diff(p, m);
        let mut lo = (p_lo - m_lo) + rounding;
        if !plain {
            let (forth, back) =
                (self.hi * other.lo.turned() + self.lo * bt, at * other.lo + self.lo.turned() * other.hi);
            lo = lo + (forth - back);
        }
        Self { hi, lo }
    }

    /// float × self: with M the product of the largest components |lo| ≤ 6.1uM, off by 16u²M.
    #[inline(always)]
    pub(super) fn crossed_by(self, float: L) -> Self {
        let (at, bt) = (float.turned(), self.hi.turned());
        let ((p, p_lo), (m, m_lo)) = (float.two_product(bt), at.two_product(self.hi));
        let (hi, rounding) = two_diff(p, m);
        let lo = ((p_lo - m_lo) + rounding) + (float * self.lo.turned() - at * self.lo);
        Self { hi: hi.turned(), lo: lo.turned() }
    }

    /// The products of components.
    #[inline(always)]
    pub(super) fn times(self, other: Self) -> Self {
        let (hi, lo) = self.hi.two_product(other.hi);
        Self { hi, lo: lo + (self.lo * other.hi + self.hi * other.lo) }
    }

    /// The products of components.
    #[inline(always)]
    pub(super) fn times_float(self, other: L) -> Self {
        let (hi, lo) = self.hi.two_product(other);
        Self { hi, lo: lo + self.lo * other }
    }

    /// x + y + z of four vectors, one in each lane.
    #[inline(always)]
    pub(super) fn sums(vectors: [Self; 4]) -> Self {
        let [x, y, z] = L::columns(vectors.map(|v| v.hi));
        let [s, t, u] = L::columns(vectors.map(|v| v.lo));
        let (xy, e) = two_sum(x, y);
        let (hi, f) = two_sum(xy, z);
        Self { hi, lo: (e + f) + ((s + t) + u) }
    }

    /// What is in each lane over what is in the first, off by 40u² of itself and not normalised; and one over the
    /// first, rounded.
    #[inline(always)]
    pub(super) fn over_first(self) -> (Self, f64) {
        let (hi, lo) = two_sum(self.hi, self.lo);
        let ([d, ..], [d_lo, ..]) = (hi.to_array(), lo.to_array());
        let inverse = 1.0 / d;
        let q = hi * hi.splat(inverse);
        let (t, t_lo) = q.two_product(hi.splat(d));
        let remainder = ((hi - t) - t_lo) + (lo - q * hi.splat(d_lo));
        (Self { hi: q, lo: remainder * hi.splat(inverse) }, inverse)
    }
}

impl<S: Simd> Two for f64x2<S> {
    #[inline(always)]
    fn to_array(self) -> [f64; 2] {
        self.into()
    }

    #[inline(always)]
    fn splat(self, x: f64) -> Self {
        self.simd.splat_f64x2(x)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.simd.abs_f64x2(self)
    }

    #[inline(always)]
    fn any_le(self, other: Self) -> bool {
        self.simd.any_true_mask64x2(self.simd.simd_le_f64x2(self, other))
    }

    #[inline(always)]
    fn is_between(self, least: Self, most: f64) -> bool {
        let cpu = self.simd;
        let (above, below) = (cpu.simd_lt_f64x2(least, self), cpu.simd_lt_f64x2(self, self.splat(most)));
        cpu.all_true_mask64x2(cpu.and_mask64x2(above, below))
    }
}

impl<S: Simd> Lanes for f64x4<S> {
    type Cpu = S;
    type Half = f64x2<S>;

    #[inline(always)]
    fn new(cpu: S, lanes: [f64; 4]) -> Self {
        Self::simd_from(cpu, lanes)
    }

    #[inline(always)]
    fn like(self, lanes: [f64; 4]) -> Self {
        Self::simd_from(self.simd, lanes)
    }

    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        self.into()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.simd.abs_f64x4(self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.simd.max_f64x4(self, other)
    }

    #[inline(always)]
    fn rows(self, other: Self) -> [f64x2<S>; 3] {
        let cpu = self.simd;
        let (xy, z) = (cpu.zip_low_f64x4(self, other), cpu.zip_high_f64x4(self, other));
        let ((x, y), (z, _)) = (cpu.split_f64x4(xy), cpu.split_f64x4(z));
        [x, y, z]
    }

    #[inline(always)]
    fn low(self) -> f64x2<S> {
        self.simd.split_f64x4(self).0
    }

    #[inline(always)]
    fn joined(self, low: f64x2<S>, high: f64x2<S>) -> Self {
        self.simd.combine_f64x2(low, high)
    }

    /// By fused multiply-add.
    #[inline(always)]
    fn two_product(self, other: Self) -> (Self, Self) {
        let p = self * other;
        (p, self.simd.mul_sub_precise_f64x4(self, other, p))
    }
}

/// Floats on any CPU; products are those of [`Split`].
#[derive(Clone, Copy, Debug)]
pub struct Plain<const N: usize = 4>([f64; N]);

impl<const N: usize> Plain<N> {
    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl<const N: usize> Add for Plain<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Plain<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Plain<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl Two for Plain<2> {
    #[inline(always)]
    fn to_array(self) -> [f64; 2] {
        self.0
    }

    #[inline(always)]
    fn splat(self, x: f64) -> Self {
        Self([x; 2])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn any_le(self, other: Self) -> bool {
        let ([a, b], [c, d]) = (self.0, other.0);
        (a <= c) | (b <= d)
    }

    #[inline(always)]
    fn is_between(self, least: Self, most: f64) -> bool {
        let ([a, b], [c, d]) = (self.0, least.0);
        (c < a) & (d < b) & (a < most) & (b < most)
    }
}

impl Lanes for Plain {
    type Cpu = ();
    type Half = Plain<2>;

    #[inline(always)]
    fn new((): (), lanes: [f64; 4]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    fn like(self, lanes: [f64; 4]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        self.0
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn rows(self, other: Self) -> [Plain<2>; 3] {
        [0, 1, 2].map(|i| Plain([self.0[i], other.0[i]]))
    }

    #[inline(always)]
    fn low(self) -> Plain<2> {
        Plain([self.0[0], self.0[1]])
    }

    #[inline(always)]
    fn joined(self, low: Plain<2>, high: Plain<2>) -> Self {
        let ([a, b], [c, d]) = (low.0, high.0);
        Self([a, b, c, d])
    }

    #[inline(always)]
    fn two_product(self, other: Self) -> (Self, Self) {
        (self * other, self.with(other, |a, b| Split::two_product(a, b).1))
    }
}
