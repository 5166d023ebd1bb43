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

/// The exact value lies within `error` of hi + lo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    /// The leading part.
    pub hi: f64,
    /// The rest, at most half an ulp of `hi`.
    pub lo: f64,
    /// How far off hi + lo may be; NaN or infinite where nothing is known.
    pub error: f64,
}

/// Relative error of one double-double operation: the theorems give 3u² (sum) and 7u² (product).
const OPERATION: f64 = 8.0 * U * U;

impl Bounded {
    /// hi + lo with a bound that is known from elsewhere; |lo| may be as large as |hi|.
    #[must_use]
    pub fn new(hi: f64, lo: f64, error: f64) -> Self {
        let (hi, lo) = two_sum(hi, lo);
        Self { hi, lo, error }
    }

    /// |self| is at most this.
    fn magnitude(&self) -> f64 {
        self.hi.abs() * (1.0 + 2.0 * U)
    }
}

impl Number for Bounded {
    fn exactly(value: f64) -> Self {
        Self { hi: value, lo: 0.0, error: 0.0 }
    }

    fn difference(a: f64, b: f64) -> Self {
        let (hi, lo) = two_diff(a, b);
        Self { hi, lo, error: 0.0 }
    }

    fn plus(&self, other: &Self) -> Self {
        let (s_hi, s_lo) = two_sum(self.hi, other.hi);
        let (t_hi, t_lo) = two_sum(self.lo, other.lo);
        let (v_hi, v_lo) = quick_two_sum(s_hi, s_lo + t_hi);
        let (hi, lo) = quick_two_sum(v_hi, t_lo + v_lo);
        let error = (self.error + other.error + OPERATION * hi.abs()) * INFLATE;
        Self { hi, lo, error }
    }

    fn minus(&self, other: &Self) -> Self {
        self.plus(&other.negated())
    }

    fn times(&self, other: &Self) -> Self {
        let (c, c_lo) = Split::two_product(self.hi, other.hi);
        let (hi, lo) = quick_two_sum(c, c_lo + (self.hi * other.lo + self.lo * other.hi));
        let carried = self.magnitude() * other.error + other.magnitude() * self.error + self.error * other.error;
        Self { hi, lo, error: (carried + OPERATION * hi.abs()) * INFLATE + UNDERFLOW }
    }

    fn negated(&self) -> Self {
        Self { hi: -self.hi, lo: -self.lo, error: self.error }
    }

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
        let mut b = Bounded::difference(values[0], values[1]);
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
