//! Floats taken apart and put together, at any exponent.

use glam::DVec3;

/// ⌊log₂|x|⌋ of a finite number, subnormal ones included; below every other for zero.
#[inline]
#[must_use]
pub fn exponent_of(x: f64) -> i32 {
    let field = |x: f64| ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    if x.abs() < f64::MIN_POSITIVE { field(x * power(100)) - 100 } else { field(x) }
}

/// x·2^e: exact where the range allows, rounded once where it does not.
#[inline]
#[must_use]
pub fn ldexp(x: f64, e: i32) -> f64 {
    let own = (x.to_bits() >> 52 & 0x7ff) as i32;
    let moved = own.saturating_add(e);
    // A normal number that stays one, as nearly always.
    if own.wrapping_sub(1).cast_unsigned() < 0x7fe && moved.wrapping_sub(1).cast_unsigned() < 0x7fe {
        return f64::from_bits(x.to_bits() & !(0x7ff << 52) | (moved as u64) << 52);
    }
    if x == 0.0 { x } else { ldexp_anywhere(x, e) }
}

#[cold]
#[inline(never)]
fn ldexp_anywhere(x: f64, e: i32) -> f64 {
    if !x.is_finite() {
        return x;
    }
    // x = m·2^own, 1 ≤ |m| < 2: a subnormal is lifted first.
    let (x, e) = if x.abs() < f64::MIN_POSITIVE { (x * power(100), e.saturating_sub(100)) } else { (x, e) };
    let m = f64::from_bits(x.to_bits() & !(0x7ff << 52) | 1023 << 52);
    match e.saturating_add(exponent_of(x)) {
        e if e > 1023 => f64::INFINITY.copysign(x),
        e if e >= -1022 => m * power(e),
        // Only the last factor leaves the normal range.
        e => m * power(-1000) * power((e + 1000).max(-200)),
    }
}

/// 2^e, −1022 ≤ e ≤ 1023.
#[inline(always)]
#[must_use]
pub const fn power(e: i32) -> f64 {
    f64::from_bits(((e + 1023) as u64) << 52)
}

/// Whether squares of such numbers, and sums of a few, stay in range.
fn has_squares(x: f64) -> bool {
    x > power(-400) && x < power(400)
}

/// |v|, whatever its range.
#[inline]
#[must_use]
pub fn length(v: DVec3) -> f64 {
    let longest = v.abs().max_element();
    if has_squares(longest) {
        return v.length();
    }
    let e = exponent_of(longest);
    ldexp(v.map(|x| ldexp(x, -e)).length(), e)
}

/// `v` over its length, whatever that is; `None` for zero, infinite or NaN.
#[inline]
#[must_use]
pub fn unit(v: DVec3) -> Option<DVec3> {
    let longest = v.abs().max_element();
    if !(longest > 0.0 && v.is_finite()) {
        return None;
    }
    let v = if has_squares(longest) { v } else { v.map(|x| ldexp(x, -exponent_of(longest))) };
    Some(v / v.length())
}

#[cfg(test)]
mod tests {
    use super::super::dyadic::Dyadic;
    use super::super::number::Number;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn lengths_have_no_range() {
        for e in [-1074, -1000, -540, 0, 540, 1000] {
            let v = DVec3::new(3.0, 0.0, 4.0).map(|x| ldexp(x, e));
            assert_eq!(length(v), ldexp(5.0, e), "{e}");
        }
        assert_eq!(length(DVec3::ZERO), 0.0);
        assert_eq!(length(DVec3::new(f64::INFINITY, 1.0, 0.0)), f64::INFINITY);
    }

    #[test]
    fn units_have_no_range() {
        for e in [-1074, -1000, -540, 0, 540, 1000] {
            let v = DVec3::new(3.0, 0.0, 4.0).map(|x| ldexp(x, e));
            let u = unit(v).unwrap();
            assert!((u - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15, "{e}: {u}");
            assert_eq!(exponent_of(v.z), e + 2);
        }
        assert_eq!(unit(DVec3::ZERO), None);
        assert_eq!(unit(DVec3::new(f64::NAN, 1.0, 0.0)), None);
        assert_eq!(unit(DVec3::new(f64::INFINITY, 1.0, 0.0)), None);
    }

    proptest! {
        #[test]
        fn ldexp_rounds_once(bits in any::<u64>(), e in -2100..2100i32) {
            let x = f64::from_bits(bits & !(1 << 62));
            let exact = Dyadic::from(x).shifted(e);
            let (value, bound) = (ldexp(x, e), f64::from_bits(1) / 2.0);
            if value.is_finite() && value.abs() >= f64::MIN_POSITIVE {
                prop_assert!(Dyadic::from(value).minus(&exact).is_zero());
            } else if value.is_finite() {
                // Half the smallest subnormal is not a float: compare doubled.
                let error = Dyadic::from(value).minus(&exact).magnitude().shifted(1);
                prop_assert!(bound == 0.0 && Dyadic::from(f64::from_bits(1)).minus(&error).sign() != Some(std::cmp::Ordering::Less));
            }
        }
    }
}
