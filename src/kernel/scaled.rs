//! A double-double with its own binary exponent: full relative accuracy at any magnitude.
//!
//! The last step of every cold path: its coefficients arrive here with a relative error near 2⁻¹⁰⁰ and leave as one λ.
//! Double-double algorithms: Joldes, Muller, Popescu 2017, with the error bounds of their theorems.

use super::dyadic::Dyadic;
use super::eft::{Product, Split, quick_two_sum, two_sum};
use super::float::{exponent_of, ldexp, power};
use super::number::Number;

/// (hi + lo)·2^exponent with |lo| ≤ ½ ulp(hi) and 1 ≤ |hi| ≤ 2, or zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaled {
    hi: f64,
    lo: f64,
    exponent: i32,
}

/// A bound on the relative error of one operation below, with room to spare: the largest theorem gives 15u² (division).
pub const SCALED_ERROR: f64 = 16.0 * super::bound::U * super::bound::U;

impl Scaled {
    /// Zero.
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0, exponent: 0 };

    /// (hi + lo)·2^exponent to within 2⁻⁵⁰⁰ of itself; `hi` and `lo` finite, |hi| ≥ |lo|.
    #[inline]
    #[must_use]
    pub fn new(hi: f64, lo: f64, exponent: i32) -> Self {
        // Away from the ends of the range first, so that the sum is exact.
        let shift = match hi.abs() {
            h if h > power(500) => -500,
            h if h < power(-500) => 500,
            _ => 0,
        };
        let (hi, lo) = if shift == 0 { two_sum(hi, lo) } else { two_sum(ldexp(hi, shift), ldexp(lo, shift)) };
        Self { hi, lo, exponent: exponent - shift }.normalised()
    }

    #[inline]
    fn normalised(self) -> Self {
        if (1.0..2.0).contains(&self.hi.abs()) {
            return self;
        }
        if self.hi == 0.0 {
            return Self::ZERO;
        }
        // After a cancellation `hi` may be as small as the lowest bit of a `lo`: subnormal.
        let lift = if self.hi.abs() < power(-500) { 500 } else { 0 };
        let e = exponent_of(self.hi * power(lift)) - lift;
        Self { hi: ldexp(self.hi, -e), lo: ldexp(self.lo, -e), exponent: self.exponent + e }
    }

    /// Whether it is zero.
    #[must_use]
    pub fn is_zero(self) -> bool {
        self.hi == 0.0
    }

    /// Whether it is below zero.
    #[must_use]
    pub fn is_negative(self) -> bool {
        self.hi < 0.0
    }

    /// ⌊log₂|self|⌋; zero for zero.
    #[must_use]
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// self · 2^e.
    #[must_use]
    pub fn shifted(self, e: i32) -> Self {
        if self.is_zero() { self } else { Self { exponent: self.exponent + e, ..self } }
    }

    /// −self.
    #[must_use]
    pub fn negated(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo, ..self }
    }

    /// |self|.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.is_negative() { self.negated() } else { self }
    }

    /// self + other: relative error of the sum ≤ 3u²/(1−4u) if the signs agree or cancel (`AccurateDWPlusDW`).
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        if self.is_zero() {
            return other;
        }
        if other.is_zero() {
            return self;
        }
        let (a, b) = if self.exponent >= other.exponent { (self, other) } else { (other, self) };
        let shift = b.exponent - a.exponent;
        if shift < -250 {
            // b is below u⁴·a: dropping it costs less than one operation's bound.
            return a;
        }
        let (b_hi, b_lo) = (ldexp(b.hi, shift), ldexp(b.lo, shift));
        let (s_hi, s_lo) = two_sum(a.hi, b_hi);
        let (t_hi, t_lo) = two_sum(a.lo, b_lo);
        let (v_hi, v_lo) = quick_two_sum(s_hi, s_lo + t_hi);
        let (hi, lo) = quick_two_sum(v_hi, t_lo + v_lo);
        Self { hi, lo, exponent: a.exponent }.normalised()
    }

    /// self − other.
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.negated())
    }

    /// self · other: relative error ≤ 7u².
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        let (c, c_lo) = Split::two_product(self.hi, other.hi);
        let (hi, lo) = quick_two_sum(c, c_lo + (self.hi * other.lo + self.lo * other.hi));
        Self { hi, lo, exponent: self.exponent + other.exponent }.normalised()
    }

    /// self / other: relative error ≤ 15u²; `other` is not zero.
    #[must_use]
    pub fn over(self, other: Self) -> Self {
        if self.is_zero() {
            return Self::ZERO;
        }
        let q = self.hi / other.hi;
        // r = other·q, then one step of the remainder.
        let (p, p_lo) = Split::two_product(other.hi, q);
        let (r_hi, r_lo) = quick_two_sum(p, p_lo + other.lo * q);
        let (d_hi, d_lo) = two_sum(self.hi, -r_hi);
        let rest = d_hi + (d_lo + (self.lo - r_lo));
        let (hi, lo) = quick_two_sum(q, rest / other.hi);
        Self { hi, lo, exponent: self.exponent - other.exponent }.normalised()
    }

    /// self / other as a float, to a few ulps; `other` is not zero.
    #[must_use]
    pub fn quotient(self, other: Self) -> f64 {
        ldexp(self.hi / other.hi, self.exponent - other.exponent)
    }

    /// √self: relative error ≤ 6u²; self is not negative.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.is_zero() {
            return Self::ZERO;
        }
        let odd = self.exponent & 1;
        let (hi, lo) = (ldexp(self.hi, odd), ldexp(self.lo, odd));
        let s = hi.sqrt();
        let (p, p_lo) = Split::two_product(s, s);
        let rest = (hi - p) + (lo - p_lo);
        let (hi, lo) = quick_two_sum(s, rest / (2.0 * s));
        Self { hi, lo, exponent: (self.exponent - odd) / 2 }.normalised()
    }

    /// The nearest float (ties as `hi` has them) and a bound on how far it is off this value: above half an ulp only
    /// where it is subnormal; infinite where it overflows.
    #[must_use]
    pub fn to_f64(self) -> (f64, f64) {
        let (hi, lo) = (ldexp(self.hi, self.exponent), ldexp(self.lo.abs(), self.exponent));
        // Either may have been rounded to a multiple of the smallest subnormal; to a normal `lo` this adds nothing.
        let lo = lo + 2.0 * f64::from_bits(1);
        (hi, if hi.is_finite() { lo } else { f64::INFINITY })
    }

    /// Exactly this value.
    #[must_use]
    pub fn to_dyadic(self) -> Dyadic {
        Dyadic::from(self.hi).plus(&self.lo.into()).shifted(self.exponent)
    }

    /// self as a double-double without an exponent of its own, where the range allows.
    #[must_use]
    pub fn to_pair(self) -> (f64, f64) {
        (ldexp(self.hi, self.exponent), ldexp(self.lo, self.exponent))
    }
}

#[cfg(test)]
mod tests {
    use super::super::dyadic::Dyadic;
    use super::super::number::Number;
    use super::*;
    use proptest::prelude::*;

    /// |computed − exact·den| ≤ bound·|computed·den|, all exact.
    fn within(computed: Scaled, numerator: &Dyadic, denominator: &Dyadic, bound: f64) -> bool {
        let computed = computed.to_dyadic();
        let error = computed.times(denominator).minus(numerator).magnitude();
        let allowed = computed.times(denominator).magnitude().times(&bound.into());
        allowed.minus(&error).sign() != Some(std::cmp::Ordering::Less)
    }

    fn any_scaled() -> impl Strategy<Value = Scaled> {
        (1.0..2.0f64, -1.0..1.0f64, any::<bool>(), -300..300i32).prop_map(|(hi, lo, negative, exponent)| {
            let s = Scaled::new(hi, lo * 1.1e-16, exponent);
            if negative { s.negated() } else { s }
        })
    }

    proptest! {
        #[test]
        fn operations_keep_their_bounds(a in any_scaled(), b in any_scaled(), near in -120..120i32) {
            let (x, y) = (a.to_dyadic(), b.to_dyadic());
            let one = Dyadic::from(1.0);
            prop_assert!(within(a.plus(b), &x.plus(&y), &one, SCALED_ERROR));
            let c = Scaled { exponent: a.exponent + near, ..b };
            prop_assert!(within(a.minus(c), &x.minus(&c.to_dyadic()), &one, SCALED_ERROR));
            prop_assert!(within(a.times(b), &x.times(&y), &one, SCALED_ERROR));
            prop_assert!(within(a.over(b), &x, &y, SCALED_ERROR));
            // s = √|a| within e relative ⇒ s² within 2e + e².
            let s = a.abs().sqrt().to_dyadic();
            let error = s.squared().minus(&x.magnitude()).magnitude();
            prop_assert!(s.squared().times(&(2.1 * SCALED_ERROR).into()).minus(&error).sign() != Some(std::cmp::Ordering::Less));
        }

    }
}
