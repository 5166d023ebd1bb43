//! Exact arithmetic on floats: the last tier, which always decides.
//!
//! A finite float is an integer times a power of two; sums, differences and products of such numbers are again such
//! numbers. Here they are integers of 64-bit limbs times a power of 2⁶⁴, so that aligning two of them moves whole
//! limbs. No rounding, no overflow, no range: every degree and every exponent an f64 can have.
//!
//! Expansions of floats (Shewchuk 1997) are faster for the triangle's cubic form, but grow as the product of lengths
//! and break where products underflow; a cone's sign is a form of degree twelve.

use super::number::Number;
use super::scaled::Scaled;
use std::cmp::Ordering;

/// Limbs that fit without an allocation: a form of degree six in floats whose exponents differ by less than 2⁶⁴.
const INLINE: usize = 20;

/// ± limbs · 2^(64·scale), exactly.
#[derive(Clone, Debug)]
pub struct Dyadic {
    negative: bool,
    scale: i32,
    /// Little-endian; no zero limb at either end; empty for zero.
    limbs: Limbs,
}

#[derive(Clone, Debug)]
struct Limbs {
    len: usize,
    inline: [u64; INLINE],
    /// Used instead of `inline` when `len > INLINE`.
    heap: Vec<u64>,
}

impl Limbs {
    #[inline]
    fn zeroed(len: usize) -> Self {
        let heap = if len > INLINE { vec![0; len] } else { Vec::new() };
        Self { len, inline: [0; INLINE], heap }
    }

    #[inline]
    fn as_slice(&self) -> &[u64] {
        if self.len > INLINE { &self.heap[..self.len] } else { &self.inline[..self.len] }
    }

    #[inline]
    fn as_mut_slice(&mut self) -> &mut [u64] {
        if self.len > INLINE { &mut self.heap[..self.len] } else { &mut self.inline[..self.len] }
    }
}

impl Dyadic {
    /// Zero.
    #[must_use]
    pub fn zero() -> Self {
        Self { negative: false, scale: 0, limbs: Limbs::zeroed(0) }
    }

    /// Whether it is zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.limbs.len == 0
    }

    /// |self|.
    #[must_use]
    pub fn magnitude(&self) -> Self {
        Self { negative: false, ..self.clone() }
    }

    /// self · 2^e.
    #[must_use]
    pub fn shifted(&self, e: i32) -> Self {
        let mut shifted = self.times(&Self::integer(1u128 << e.rem_euclid(64), false, 0));
        shifted.scale += e.div_euclid(64);
        shifted
    }

    /// A float near it, for messages and tables.
    #[must_use]
    pub fn approximately(&self) -> f64 {
        self.rounded().0.to_f64().0
    }

    fn integer(magnitude: u128, negative: bool, scale: i32) -> Self {
        let mut limbs = Limbs::zeroed(2);
        limbs.inline[0] = magnitude as u64;
        limbs.inline[1] = (magnitude >> 64) as u64;
        Self { negative, scale, limbs }.trimmed()
    }

    /// Drops the zero limbs at both ends, so that equal values have equal parts and short ones stay short.
    #[inline]
    fn trimmed(mut self) -> Self {
        let limbs = self.limbs.as_slice();
        let high = limbs.iter().rev().take_while(|&&l| l == 0).count();
        if high == limbs.len() {
            return Self::zero();
        }
        let low = limbs.iter().take_while(|&&l| l == 0).count();
        if low > 0 || high > 0 {
            let len = limbs.len() - low - high;
            if self.limbs.len > INLINE && len <= INLINE {
                self.limbs.inline[..len].copy_from_slice(&self.limbs.heap[low..low + len]);
                self.limbs.heap = Vec::new();
            } else {
                self.limbs.as_mut_slice().copy_within(low..low + len, 0);
            }
            self.limbs.len = len;
            self.scale += low as i32;
        }
        self
    }

    /// |self| against |other|.
    fn compare_magnitudes(&self, other: &Self) -> Ordering {
        let (a, b) = (self.limbs.as_slice(), other.limbs.as_slice());
        let top = |d: &Self| d.scale + d.limbs.len as i32;
        match (a.is_empty(), b.is_empty()) {
            (true, true) => return Ordering::Equal,
            (true, false) => return Ordering::Less,
            (false, true) => return Ordering::Greater,
            (false, false) => {}
        }
        top(self).cmp(&top(other)).then_with(|| {
            let from_the_top = a.iter().rev().zip(b.iter().rev());
            // With equal tops the one with limbs left below is larger: its lowest limb is not zero.
            from_the_top.map(|(x, y)| x.cmp(y)).find(|o| o.is_ne()).unwrap_or_else(|| a.len().cmp(&b.len()))
        })
    }

    /// |self| + |other| with the sign given.
    fn add_magnitudes(&self, other: &Self, negative: bool) -> Self {
        let scale = self.scale.min(other.scale);
        let top = (self.scale + self.limbs.len as i32).max(other.scale + other.limbs.len as i32);
        let mut limbs = Limbs::zeroed((top - scale) as usize + 1);
        let out = limbs.as_mut_slice();
        let at = (self.scale - scale) as usize;
        out[at..at + self.limbs.len].copy_from_slice(self.limbs.as_slice());
        let at = (other.scale - scale) as usize;
        let mut carry = false;
        let (lower, upper) = out[at..].split_at_mut(other.limbs.len);
        for (o, &l) in lower.iter_mut().zip(other.limbs.as_slice()) {
            let (s, c1) = o.overflowing_add(l);
            let (s, c2) = s.overflowing_add(u64::from(carry));
            *o = s;
            carry = c1 | c2;
        }
        for o in upper {
            if !carry {
                break;
            }
            (*o, carry) = o.overflowing_add(1);
        }
        Self { negative, scale, limbs }.trimmed()
    }

    /// |self| − |other| with the sign given; |self| ≥ |other|.
    fn subtract_magnitudes(&self, other: &Self, negative: bool) -> Self {
        let scale = self.scale.min(other.scale);
        let top = self.scale + self.limbs.len as i32;
        let mut limbs = Limbs::zeroed((top - scale) as usize);
        let out = limbs.as_mut_slice();
        let at = (self.scale - scale) as usize;
        out[at..at + self.limbs.len].copy_from_slice(self.limbs.as_slice());
        let at = (other.scale - scale) as usize;
        let mut borrow = false;
        let (lower, upper) = out[at..].split_at_mut(other.limbs.len);
        for (o, &l) in lower.iter_mut().zip(other.limbs.as_slice()) {
            let (s, b1) = o.overflowing_sub(l);
            let (s, b2) = s.overflowing_sub(u64::from(borrow));
            *o = s;
            borrow = b1 | b2;
        }
        for o in upper {
            if !borrow {
                break;
            }
            (*o, borrow) = o.overflowing_sub(1);
        }
        Self { negative, scale, limbs }.trimmed()
    }

    fn add_signed(&self, other: &Self, other_negative: bool) -> Self {
        if other.is_zero() {
            return self.clone();
        }
        if self.is_zero() {
            return Self { negative: other_negative, ..other.clone() };
        }
        if self.negative == other_negative {
            return self.add_magnitudes(other, self.negative);
        }
        match self.compare_magnitudes(other) {
            Ordering::Greater => self.subtract_magnitudes(other, self.negative),
            Ordering::Less => other.subtract_magnitudes(self, other_negative),
            Ordering::Equal => Self::zero(),
        }
    }
}

impl From<f64> for Dyadic {
    /// Exactly `value`.
    ///
    /// # Panics
    /// If it is not finite: a caller's bug, since constructors and kernels let no such number through.
    fn from(value: f64) -> Self {
        assert!(value.is_finite(), "{value} has no exact value");
        let bits = value.to_bits();
        let field = ((bits >> 52) & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        // value = mantissa · 2^exponent
        let (mantissa, exponent) = if field == 0 { (fraction, -1074) } else { (fraction | 1 << 52, field - 1075) };
        Self::integer(u128::from(mantissa) << exponent.rem_euclid(64), value < 0.0, exponent.div_euclid(64))
    }
}

impl Number for Dyadic {
    fn exactly(value: f64) -> Self {
        value.into()
    }

    fn difference(a: f64, b: f64) -> Self {
        Self::from(a).minus(&b.into())
    }

    fn plus(&self, other: &Self) -> Self {
        self.add_signed(other, other.negative)
    }

    fn minus(&self, other: &Self) -> Self {
        self.add_signed(other, !other.negative)
    }

    fn times(&self, other: &Self) -> Self {
        let (a, b) = (self.limbs.as_slice(), other.limbs.as_slice());
        let mut limbs = Limbs::zeroed(a.len() + b.len());
        let out = limbs.as_mut_slice();
        for (i, &x) in a.iter().enumerate() {
            let mut carry = 0u64;
            for (o, &y) in out[i..].iter_mut().zip(b) {
                let t = u128::from(x) * u128::from(y) + u128::from(*o) + u128::from(carry);
                *o = t as u64;
                carry = (t >> 64) as u64;
            }
            if !b.is_empty() {
                out[i + b.len()] = carry;
            }
        }
        Self { negative: self.negative != other.negative, scale: self.scale + other.scale, limbs }.trimmed()
    }

    fn negated(&self) -> Self {
        Self { negative: !self.negative && !self.is_zero(), ..self.clone() }
    }

    fn sign(&self) -> Option<Ordering> {
        Some(match (self.is_zero(), self.negative) {
            (true, _) => Ordering::Equal,
            (_, true) => Ordering::Less,
            (_, false) => Ordering::Greater,
        })
    }

    fn rounded(&self) -> (Scaled, f64) {
        let limbs = self.limbs.as_slice();
        if limbs.is_empty() {
            return (Scaled::ZERO, 0.0);
        }
        // The top 128 bits, with the leading one in place.
        let limb = |i: usize| limbs.len().checked_sub(i + 1).map_or(0, |k| limbs[k]);
        let zeros = limb(0).leading_zeros();
        let top = u128::from(limb(0)) << 64 | u128::from(limb(1));
        let top = if zeros == 0 { top } else { top << zeros | u128::from(limb(2) >> (64 - zeros)) };
        // 53 + 53 bits of it, truncated: off by less than 2⁻¹⁰⁵ of the value, since the leading bit is set.
        let hi = (top >> 75) as u64;
        let lo = (top >> 22) as u64 & ((1 << 53) - 1);
        let (hi, lo) = (hi as f64, lo as f64 / 9_007_199_254_740_992.0);
        let exponent = 64 * (self.scale + limbs.len() as i32) - 53 - zeros as i32;
        let scaled = Scaled::new(hi, lo, exponent);
        (if self.negative { scaled.negated() } else { scaled }, 1.0 / 2f64.powi(104))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dashu::rational::RBig;
    use proptest::prelude::*;

    fn rational(x: f64) -> RBig {
        RBig::try_from(x).unwrap()
    }

    fn to_rational(d: &Dyadic) -> RBig {
        let base = RBig::from(u64::MAX) + RBig::ONE;
        let mut value = RBig::ZERO;
        for &l in d.limbs.as_slice().iter().rev() {
            value = value * &base + RBig::from(l);
        }
        let power = base.pow(d.scale.unsigned_abs() as isize);
        let value = if d.scale < 0 { value / power } else { value * power };
        if d.negative { -value } else { value }
    }

    fn any_finite() -> impl Strategy<Value = f64> {
        prop_oneof![
            any::<f64>().prop_filter("finite", |x| x.is_finite()),
            (-4.0..4.0f64),
            (-8i8..8).prop_map(f64::from),
            (any::<i32>(), -80..80i32).prop_map(|(m, e)| f64::from(m) * 2f64.powi(e)),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2048))]
        #[test]
        fn agrees_with_rationals(v in prop::collection::vec(any_finite(), 6)) {
            let d: Vec<Dyadic> = v.iter().map(|&x| x.into()).collect();
            let r: Vec<RBig> = v.iter().map(|&x| rational(x)).collect();
            // A cubic determinant, and its square less another: lengths from one limb to spilled.
            let det = |i: usize| d[i].times(&d[i + 1]).minus(&d[i + 2].times(&d[i + 3]));
            let ret = |i: usize| &r[i] * &r[i + 1] - &r[i + 2] * &r[i + 3];
            prop_assert_eq!(to_rational(&det(0)), ret(0));
            let big = det(0).times(&det(1)).squared().plus(&det(2).negated());
            let rig = (ret(0) * ret(1)) * (ret(0) * ret(1)) - ret(2);
            prop_assert_eq!(&to_rational(&big), &rig);
            let sign = rig.cmp(&RBig::ZERO);
            prop_assert_eq!(big.sign(), Some(sign));
            prop_assert!(big.minus(&big).is_zero());
            // Rounded to a double-double: within its bound.
            let (scaled, relative) = big.rounded();
            let error = to_rational(&scaled.to_dyadic().minus(&big).magnitude());
            prop_assert!(error <= rational(relative) * to_rational(&big.magnitude()));
        }
    }
}
