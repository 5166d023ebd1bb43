//! Error-free transforms: the rounded result of one operation and, exactly, what rounding took away.
//!
//! Sources: Knuth (two-sum), Dekker 1971 and Veltkamp (two-product without FMA), Ogita, Rump, Oishi 2005.
//! Exact as long as nothing over- or underflows: docs/numerics.md §1.

use super::bound::LARGE;
use super::cpu::{FusedLanes, dispatch, fused_lanes};
use super::lanes::{Lanes, Plain};
use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;
use std::fmt::Debug;
use std::ops::{Add, Sub};

/// What sums and differences are formed in: one float or [`Lanes`] of them.
pub trait Real: Copy + Add<Output = Self> + Sub<Output = Self> {}
impl<T: Copy + Add<Output = T> + Sub<Output = T>> Real for T {}

/// (s, e): s = fl(a + b) and s + e = a + b exactly.
#[inline(always)]
#[must_use]
pub fn two_sum<T: Real>(a: T, b: T) -> (T, T) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

/// (d, e): d = fl(a − b) and d + e = a − b exactly.
#[inline(always)]
#[must_use]
pub fn two_diff<T: Real>(a: T, b: T) -> (T, T) {
    let d = a - b;
    let bb = d - a;
    (d, (a - (d - bb)) - (b + bb))
}

/// [`two_sum`] for |a| ≥ |b| or a = 0.
#[inline(always)]
#[must_use]
pub fn quick_two_sum<T: Real>(a: T, b: T) -> (T, T) {
    let s = a + b;
    (s, b - (s - a))
}

/// How a product's rounding error is found. Both ways give the same bits, so a kernel generic over this trait answers
/// alike on every CPU; plain expressions never fuse.
pub trait Product: Copy + Debug {
    /// Vectors with products of this kind.
    type Lanes: Lanes;
    /// (p, e): p = fl(a·b) and p + e = a·b exactly.
    fn two_product(a: f64, b: f64) -> (f64, f64);
    /// n − q·d, rounded once, for a quotient q so near n/d that n − fl(q·d) is exact.
    fn remainder(n: f64, q: f64, d: f64) -> f64;
    /// [`Product::two_product`] in each lane.
    fn two_products<S: Simd, V: SimdFloat<S, Element = f64>>(a: V, b: V) -> (V, V);
    /// [`Product::remainder`] in each lane.
    fn remainders<S: Simd, V: SimdFloat<S, Element = f64>>(n: V, q: V, d: V) -> V;
    /// What [`Lanes`] need to know of the CPU: it is asked whether it has the instructions.
    fn cpu() -> <Self::Lanes as Lanes>::Cpu;
}

/// By fused multiply-add: two instructions, but only inside code compiled for a CPU that has it
/// ([`dispatch`]); elsewhere it is a library call.
#[derive(Clone, Copy, Debug)]
pub struct Fused;

/// By splitting both factors into halves of 26 bits (Veltkamp, Dekker): 17 operations on any CPU.
#[derive(Clone, Copy, Debug)]
pub struct Split;

impl Product for Fused {
    type Lanes = FusedLanes;

    #[inline(always)]
    fn cpu() -> <FusedLanes as Lanes>::Cpu {
        fused_lanes()
    }

    #[inline(always)]
    fn two_product(a: f64, b: f64) -> (f64, f64) {
        let p = a * b;
        (p, f64::mul_add(a, b, -p))
    }

    #[inline(always)]
    fn remainder(n: f64, q: f64, d: f64) -> f64 {
        f64::mul_add(-q, d, n)
    }

    #[inline(always)]
    fn two_products<S: Simd, V: SimdFloat<S, Element = f64>>(a: V, b: V) -> (V, V) {
        let p = a * b;
        (p, a.mul_sub_precise(b, p))
    }

    #[inline(always)]
    fn remainders<S: Simd, V: SimdFloat<S, Element = f64>>(n: V, q: V, d: V) -> V {
        (-q).mul_add_precise(d, n)
    }
}

impl Product for Split {
    type Lanes = Plain;

    #[inline(always)]
    fn cpu() {}

    #[inline(always)]
    fn two_product(a: f64, b: f64) -> (f64, f64) {
        let p = a * b;
        let (a_hi, a_lo) = split(a);
        let (b_hi, b_lo) = split(b);
        (p, ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo)
    }

    #[inline(always)]
    fn remainder(n: f64, q: f64, d: f64) -> f64 {
        let (t, t_lo) = Self::two_product(q, d);
        (n - t) - t_lo
    }

    #[inline(always)]
    fn two_products<S: Simd, V: SimdFloat<S, Element = f64>>(a: V, b: V) -> (V, V) {
        let p = a * b;
        let ((a_hi, a_lo), (b_hi, b_lo)) = (splits(a), splits(b));
        (p, ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo)
    }

    #[inline(always)]
    fn remainders<S: Simd, V: SimdFloat<S, Element = f64>>(n: V, q: V, d: V) -> V {
        let (t, t_lo) = Self::two_products(q, d);
        (n - t) - t_lo
    }
}

/// 2²⁷ + 1
const VELTKAMP: f64 = 134_217_729.0;

/// a = hi + lo, each of at most 26 bits.
#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    let c = VELTKAMP * a;
    let hi = c - (c - a);
    (hi, a - hi)
}

/// [`split`] in each lane.
#[inline(always)]
fn splits<S: Simd, V: SimdFloat<S, Element = f64>>(a: V) -> (V, V) {
    let c = a * VELTKAMP;
    let hi = c - (c - a);
    (hi, a - hi)
}

/// Products below this have low parts that are no floats.
const SMALL: f64 = f64::from_bits((1023 - 900) << 52);

/// o + λd, each component rounded once or nearly: off by (u + 3u²(|oᵢ| + |λdᵢ|)/|result|) of itself. Where λdᵢ is below
/// 2⁻⁹⁰⁰, or λ or d reaches 2⁹⁰⁰, product and sum are each rounded.
#[must_use]
pub fn step(o: DVec3, lambda: f64, d: DVec3) -> DVec3 {
    dispatch(
        #[inline(always)]
        move || step_with::<Fused>(o, lambda, d),
        #[inline(always)]
        move || step_with::<Split>(o, lambda, d),
    )
}

#[inline(always)]
fn step_with<P: Product>(o: DVec3, lambda: f64, d: DVec3) -> DVec3 {
    let component = |o: f64, d: f64| {
        let (p, p_lo) = P::two_product(lambda, d);
        let (s, s_lo) = two_sum(o, p);
        let value = s + (s_lo + p_lo);
        // A low part that vanishes is not the same by both kinds of product.
        if value.is_nan() || p.abs() < SMALL { o + p } else { value }
    };
    // Splitting overflows before the product does.
    if lambda.abs().max(d.abs().max_element()) < LARGE {
        DVec3::new(component(o.x, d.x), component(o.y, d.y), component(o.z, d.z))
    } else {
        o + lambda * d
    }
}

#[cfg(test)]
mod tests {
    use super::super::dyadic::Dyadic;
    use super::super::number::Number;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn fused_and_split_products_have_the_same_bits(a in -1e60..1e60f64, b in -1e60..1e60f64) {
            prop_assert_eq!(Fused::two_product(a, b), Split::two_product(a, b));
        }

        #[test]
        fn remainders_of_quotients_have_the_same_bits(n in -1e60..1e60f64, d in -1e60..1e60f64, off in -1e-4..1e-4f64) {
            for q in [n / d, n * (1.0 / d), n / d * (1.0 + off)] {
                prop_assert_eq!(Fused::remainder(n, q, d), Split::remainder(n, q, d));
            }
        }

        #[test]
        fn steps_have_the_same_bits(m in prop::array::uniform7(-1.0..1.0f64), e in prop::array::uniform3(-1070..1000i32)) {
            let [o, d] = [[m[0], m[1], m[2]], [m[3], m[4], m[5]]].map(DVec3::from);
            let (o, d, lambda) = (o * 2f64.powi(e[0]), d * 2f64.powi(e[1]), m[6] * 2f64.powi(e[2]));
            prop_assert_eq!(
                step_with::<Fused>(o, lambda, d).to_array().map(f64::to_bits),
                step_with::<Split>(o, lambda, d).to_array().map(f64::to_bits)
            );
        }

        #[test]
        fn sum_and_difference_are_exact(a in -1e60..1e60f64, b in -1e-20..1e60f64) {
            let exact = Dyadic::from(a).plus(&b.into());
            let (s, e) = two_sum(a, b);
            prop_assert!(Dyadic::from(s).plus(&e.into()).minus(&exact).is_zero());
            let (d, e) = two_diff(a, -b);
            prop_assert!(Dyadic::from(d).plus(&e.into()).minus(&exact).is_zero());
        }
    }
}
