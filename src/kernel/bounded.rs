//! A double-double that carries a bound on its own error: the second tier of every decision.
//!
//! Each operation adds what it may have rounded away to the bound (running error analysis; Higham §3.3), so that no
//! formula built from it needs an analysis of its own. Algorithms and their error constants: Joldes, Muller, Popescu
//! 2017; docs/numerics.md §2.

use super::bound::{INFLATE, U, UNDERFLOW};
use super::eft::{Product, Split, quick_two_sum, two_diff, two_sum};
use super::number::Number;
use super::scaled::Scaled;
use std::cmp::Ordering;
use std::marker::PhantomData;

/// The exact value lies within `error` of hi + lo. Products are formed the way `P` says, with the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded<P = Split> {
    /// The leading part.
    pub hi: f64,
    /// The rest, at most half an ulp of `hi`.
    pub lo: f64,
    /// How far off hi + lo may be; NaN or infinite where nothing is known, zero where nothing was rounded.
    pub error: f64,
    by: PhantomData<P>,
}

/// Relative error of one double-double product: the theorem gives 7u².
const PRODUCT: f64 = 8.0 * U * U;

/// A product of floats at least this large has a rounding error that is a float.
const EXACT: f64 = f64::from_bits((1023 - 900) << 52); // 2⁻⁹⁰⁰

impl<P: Product> Bounded<P> {
    /// hi + lo with a bound that is known from elsewhere; |lo| may be as large as |hi|.
    #[must_use]
    #[inline(always)]
    pub fn new(hi: f64, lo: f64, error: f64) -> Self {
        let (hi, lo) = two_sum(hi, lo);
        Self { hi, lo, error, by: PhantomData }
    }

    /// |self| is at most this.
    #[inline(always)]
    fn magnitude(&self) -> f64 {
        self.hi.abs() * (1.0 + 2.0 * U)
    }
}

impl<P: Product> Number for Bounded<P> {
    #[inline(always)]
    fn exactly(value: f64) -> Self {
        Self { hi: value, lo: 0.0, error: 0.0, by: PhantomData }
    }

    #[inline(always)]
    fn difference(a: f64, b: f64) -> Self {
        let (hi, lo) = two_diff(a, b);
        Self { hi, lo, error: 0.0, by: PhantomData }
    }

    /// What is dropped is known: short numbers, and ties of them, stay exact.
    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        let (s_hi, s_lo) = two_sum(self.hi, other.hi);
        let (t_hi, t_lo) = two_sum(self.lo, other.lo);
        let (c, c_dropped) = two_sum(s_lo, t_hi);
        let (v_hi, v_lo) = quick_two_sum(s_hi, c);
        let (w, w_dropped) = two_sum(t_lo, v_lo);
        let (hi, lo) = quick_two_sum(v_hi, w);
        let error = ((self.error + other.error) + (c_dropped.abs() + w_dropped.abs())) * INFLATE;
        Self { hi, lo, error, by: PhantomData }
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        self.plus(&other.negated())
    }

    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        let (c, c_lo) = P::two_product(self.hi, other.hi);
        let (hi, lo) = quick_two_sum(c, c_lo + (self.hi * other.lo + self.lo * other.hi));
        // Two floats have an exact product, unless it is so small that its rounding error is no float.
        let floats = (self.lo == 0.0) & (other.lo == 0.0) & (self.error == 0.0) & (other.error == 0.0);
        let zero = (self.hi == 0.0) & (self.error == 0.0) | (other.hi == 0.0) & (other.error == 0.0);
        let exact = floats & (c.abs() > EXACT) | zero;
        let rounded = if exact { 0.0 } else { PRODUCT * hi.abs() + UNDERFLOW };
        let carried = self.magnitude() * other.error + other.magnitude() * self.error + self.error * other.error;
        Self { hi, lo, error: (carried + rounded) * INFLATE, by: PhantomData }
    }

    #[inline(always)]
    fn negated(&self) -> Self {
        Self { hi: -self.hi, lo: -self.lo, ..*self }
    }

    #[inline(always)]
    fn sign(&self) -> Option<Ordering> {
        // |hi + lo| ≥ |hi|(1 − 2u); a NaN or infinite bound compares false.
        if self.hi.abs() * (1.0 - 4.0 * U) > self.error {
            Some(if self.hi > 0.0 { Ordering::Greater } else { Ordering::Less })
        } else if self.hi == 0.0 && self.error == 0.0 {
            Some(Ordering::Equal)
        } else {
            None
        }
    }

    fn rounded(&self) -> (Scaled, f64) {
        if self.hi == 0.0 || !self.hi.is_finite() || !self.lo.is_finite() {
            let relative = if self.hi == 0.0 && self.error == 0.0 { 0.0 } else { f64::INFINITY };
            return (Scaled::ZERO, relative);
        }
        // |exact| ≥ |hi|(1 − u) − error. Half is nothing to build on, and a NaN is not below it.
        let known = self.error < 0.5 * self.hi.abs();
        let relative = if known { self.error / (self.hi.abs() - self.error) * (1.0 + 16.0 * U) } else { f64::INFINITY };
        (Scaled::new(self.hi, self.lo, 0), relative)
    }
}

#[cfg(test)]
mod tests {
    use super::super::dyadic::Dyadic;
    use super::*;
    use proptest::prelude::*;

    /// Random chains of operations, the same in both arithmetics: the exact value is always inside.
    fn check(values: &[f64], ops: &[u8]) -> (f64, bool) {
        let mut b = <Bounded>::difference(values[0], values[1]);
        let mut d = Dyadic::difference(values[0], values[1]);
        for (v, op) in values[2..].windows(2).zip(ops) {
            let (vb, vd) = (Bounded::difference(v[0], v[1]), Dyadic::difference(v[0], v[1]));
            (b, d) = match op % 4 {
                0 => (b.plus(&vb), d.plus(&vd)),
                1 => (b.minus(&vb), d.minus(&vd)),
                2 => (b.times(&vb), d.times(&vd)),
                _ => (b.squared().minus(&vb.squared()), d.squared().minus(&vd.squared())),
            };
        }
        let error = Dyadic::from(b.hi).plus(&b.lo.into()).minus(&d).magnitude();
        let holds = Dyadic::from(b.error).minus(&error).sign() != Some(Ordering::Less);
        let agrees = b.sign().is_none_or(|s| Some(s) == d.sign());
        (error.approximately() / b.error, holds && agrees)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4096))]
        #[test]
        fn the_exact_value_is_inside(
            values in prop::collection::vec((-1.0..1.0f64, -30..30i32), 8),
            ops in prop::collection::vec(any::<u8>(), 5),
        ) {
            let values: Vec<f64> = values.iter().map(|&(m, e)| m * 2f64.powi(e)).collect();
            let (ratio, holds) = check(&values, &ops);
            prop_assert!(holds, "|error|/bound = {ratio}");
        }

        #[test]
        fn it_holds_where_products_underflow(
            values in prop::collection::vec((-1.0..1.0f64, -560..-440i32), 8),
            ops in prop::collection::vec(0..3u8, 2),
        ) {
            let values: Vec<f64> = values.iter().map(|&(m, e)| m * 2f64.powi(e)).collect();
            let (ratio, holds) = check(&values, &ops);
            prop_assert!(holds, "|error|/bound = {ratio}");
        }
    }
}
