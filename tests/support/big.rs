//! Exact numbers: integers of any length times powers of two, and the numbers a quadratic with such coefficients has
//! for roots. Nothing here is shared with the crate's own exact arithmetic.

use dashu::base::{BitTest, DivRem, SquareRootRem};
use dashu::integer::{IBig, Sign, UBig};
use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};
use truehit::glam::DVec3;

/// n · 2^e, exactly.
#[derive(Clone, Debug)]
pub struct Big {
    n: IBig,
    e: i32,
}

impl Big {
    pub fn zero() -> Self {
        Self { n: IBig::ZERO, e: 0 }
    }

    pub fn is_zero(&self) -> bool {
        self.n.is_zero()
    }

    /// Against zero.
    pub fn sign(&self) -> Ordering {
        if self.n.is_zero() {
            Ordering::Equal
        } else if self.n.sign() == Sign::Negative {
            Ordering::Less
        } else {
            Ordering::Greater
        }
    }

    pub fn abs(&self) -> Self {
        if self.sign().is_lt() { -self } else { self.clone() }
    }

    pub fn cmp(&self, other: &Self) -> Ordering {
        (self - other).sign()
    }

    pub fn squared(&self) -> Self {
        Self { n: self.n.sqr().into(), e: 2 * self.e }
    }

    pub fn doubled(&self) -> Self {
        Self { n: self.n.clone(), e: self.e + 1 }
    }

    /// ⌊log₂|self|⌋ of a number that is not zero.
    pub fn exponent(&self) -> i32 {
        self.n.bit_len() as i32 - 1 + self.e
    }

    /// Truncated to 53 bits; for figures, not for decisions. Infinite or zero outside the range of floats.
    pub fn to_f64(&self) -> f64 {
        if self.is_zero() {
            return 0.0;
        }
        let (sign, n) = self.n.clone().into_parts();
        let drop = n.bit_len().saturating_sub(53);
        let m = u64::try_from(n >> drop).expect("at most 53 bits") as f64;
        let magnitude = ldexp(m, self.e + drop as i32);
        if sign == Sign::Negative { -magnitude } else { magnitude }
    }

    /// The integer that goes with 2^e, e at most the own exponent.
    fn aligned(&self, e: i32) -> IBig {
        if self.e == e { self.n.clone() } else { &self.n << (self.e - e) as usize }
    }

    fn magnitude(&self) -> UBig {
        self.n.clone().into_parts().1
    }
}

fn ldexp(mut x: f64, mut e: i32) -> f64 {
    while e != 0 && x != 0.0 && x.is_finite() {
        let step = e.clamp(-960, 960);
        x *= 2f64.powi(step);
        e -= step;
    }
    x
}

impl From<f64> for Big {
    fn from(x: f64) -> Self {
        assert!(x.is_finite(), "{x} has no exact value");
        if x == 0.0 {
            return Self::zero();
        }
        let bits = x.to_bits();
        let field = (bits >> 52 & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        let (m, e) = if field == 0 { (fraction, -1074) } else { (fraction | 1 << 52, field - 1075) };
        let zeros = m.trailing_zeros();
        let n = (m >> zeros) as i64;
        Self { n: IBig::from(if x < 0.0 { -n } else { n }), e: e + zeros as i32 }
    }
}

impl Add for &Big {
    type Output = Big;
    fn add(self, b: &Big) -> Big {
        if self.is_zero() {
            return b.clone();
        }
        if b.is_zero() {
            return self.clone();
        }
        let e = self.e.min(b.e);
        Big { n: self.aligned(e) + b.aligned(e), e }
    }
}

impl Neg for &Big {
    type Output = Big;
    fn neg(self) -> Big {
        Big { n: -&self.n, e: self.e }
    }
}

impl Sub for &Big {
    type Output = Big;
    fn sub(self, b: &Big) -> Big {
        self + &-b
    }
}

impl Mul for &Big {
    type Output = Big;
    fn mul(self, b: &Big) -> Big {
        Big { n: &self.n * &b.n, e: self.e + b.e }
    }
}

macro_rules! by_value {
    ($($op:ident $method:ident),*) => {$(
        impl $op for Big {
            type Output = Big;
            fn $method(self, b: Big) -> Big {
                (&self).$method(&b)
            }
        }
        impl $op<&Big> for Big {
            type Output = Big;
            fn $method(self, b: &Big) -> Big {
                (&self).$method(b)
            }
        }
        impl $op<Big> for &Big {
            type Output = Big;
            fn $method(self, b: Big) -> Big {
                self.$method(&b)
            }
        }
    )*};
}
by_value!(Add add, Sub sub, Mul mul);

/// A vector of exact numbers.
#[derive(Clone, Debug)]
pub struct Big3(pub [Big; 3]);

impl Big3 {
    pub fn dot(&self, b: &Self) -> Big {
        &self.0[0] * &b.0[0] + &self.0[1] * &b.0[1] + &self.0[2] * &b.0[2]
    }

    pub fn cross(&self, b: &Self) -> Self {
        let minor = |i: usize, j: usize| &self.0[i] * &b.0[j] - &self.0[j] * &b.0[i];
        Self([minor(1, 2), minor(2, 0), minor(0, 1)])
    }

    pub fn plus(&self, b: &Self) -> Self {
        Self(std::array::from_fn(|i| &self.0[i] + &b.0[i]))
    }

    pub fn minus(&self, b: &Self) -> Self {
        Self(std::array::from_fn(|i| &self.0[i] - &b.0[i]))
    }

    pub fn norm2(&self) -> Big {
        self.0[0].squared() + self.0[1].squared() + self.0[2].squared()
    }

    pub fn is_zero(&self) -> bool {
        self.0.iter().all(Big::is_zero)
    }

    /// The unit vector along it, in floats; `None` for zero.
    pub fn direction(&self) -> Option<DVec3> {
        let top = self.0.iter().filter(|x| !x.is_zero()).map(Big::exponent).max()?;
        let shifted = |x: &Big| Big { n: x.n.clone(), e: x.e - top }.to_f64();
        Some(DVec3::from(self.0.each_ref().map(shifted)).normalize())
    }
}

impl From<DVec3> for Big3 {
    fn from(v: DVec3) -> Self {
        Self(v.to_array().map(Big::from))
    }
}

/// A real number, exactly.
#[derive(Clone, Debug)]
pub enum Real {
    /// n/d, d ≠ 0.
    Ratio(Big, Big),
    /// A root of a·λ² + 2b·λ + c: (−b + √disc)/a if `plus`, else (−b − √disc)/a; disc = b² − ac ≥ 0, a ≠ 0.
    Root { a: Big, b: Big, c: Big, disc: Big, plus: bool },
}

impl Real {
    pub fn from_f64(x: f64) -> Self {
        Self::Ratio(Big::from(x), Big::from(1.0))
    }

    /// Against n/d, exactly.
    pub fn cmp_ratio(&self, n: &Big, d: &Big) -> Ordering {
        // The sign of (self − n/d)·d, then of self − n/d.
        let times_d = match self {
            Self::Ratio(m, e) => times_sign((m * d - n * e).sign(), e.sign()),
            Self::Root { a, b, disc, plus, .. } => {
                // (−b ± √disc)/a − n/d = (x ± d√disc)/(ad), x = −bd − an.
                let x = -&(b * d + a * n);
                let up = *plus == d.sign().is_gt();
                times_sign(sign_with_root(&x, &(d.squared() * disc), up), a.sign())
            }
        };
        times_sign(times_d, d.sign())
    }

    /// Against a float, which may be infinite.
    pub fn cmp_f64(&self, x: f64) -> Ordering {
        if x == f64::INFINITY {
            Ordering::Less
        } else if x == f64::NEG_INFINITY {
            Ordering::Greater
        } else {
            self.cmp_ratio(&Big::from(x), &Big::from(1.0))
        }
    }

    pub fn within(&self, within: truehit::Interval) -> bool {
        if within.min.is_nan() || within.max.is_nan() {
            return false;
        }
        self.cmp_f64(within.min).is_gt() && self.cmp_f64(within.max).is_lt()
    }

    /// An enclosing interval of relative width below 2⁻²⁵⁰ (zero wide where the value is found exactly).
    pub fn enclosure(&self) -> Enclosure {
        match self {
            Self::Ratio(n, d) => Enclosure::quotient(&Enclosure::exactly(n.clone()), &Enclosure::exactly(d.clone())),
            Self::Root { a, b, c, disc, plus } => {
                let root = Enclosure::sqrt(disc);
                let x = -b;
                // The root without cancellation, and the other one from the product c/a of both.
                if x.is_zero() || x.sign().is_gt() == *plus {
                    let q = if *plus { root.plus(&x) } else { root.negated().plus(&x) };
                    Enclosure::quotient(&q, &Enclosure::exactly(a.clone()))
                } else {
                    let q = if *plus { root.negated().plus(&x) } else { root.plus(&x) };
                    Enclosure::quotient(&Enclosure::exactly(c.clone()), &q)
                }
            }
        }
    }
}

fn times_sign(o: Ordering, by: Ordering) -> Ordering {
    match by {
        Ordering::Less => o.reverse(),
        Ordering::Equal => Ordering::Equal,
        Ordering::Greater => o,
    }
}

/// The sign of x + √y (`plus`) or x − √y; y ≥ 0.
fn sign_with_root(x: &Big, y: &Big, plus: bool) -> Ordering {
    if !plus {
        return sign_with_root(&-x, y, true).reverse();
    }
    match x.sign() {
        Ordering::Less => y.cmp(&x.squared()),
        Ordering::Equal => y.sign(),
        Ordering::Greater => Ordering::Greater,
    }
}

/// lo ≤ value ≤ hi.
#[derive(Clone, Debug)]
pub struct Enclosure {
    pub lo: Big,
    pub hi: Big,
}

/// Bits of a quotient or a root.
const BITS: usize = 288;

impl Enclosure {
    pub fn exactly(x: Big) -> Self {
        Self { lo: x.clone(), hi: x }
    }

    fn plus(&self, x: &Big) -> Self {
        Self { lo: &self.lo + x, hi: &self.hi + x }
    }

    fn negated(&self) -> Self {
        Self { lo: -&self.hi, hi: -&self.lo }
    }

    /// √x, x ≥ 0.
    fn sqrt(x: &Big) -> Self {
        if x.is_zero() {
            return Self::exactly(Big::zero());
        }
        let mut n = x.magnitude();
        let mut shift = (2 * BITS).saturating_sub(n.bit_len());
        // The exponent must be even.
        shift += (x.e - shift as i32).rem_euclid(2) as usize;
        n <<= shift;
        let e = (x.e - shift as i32) / 2;
        let (root, rest) = n.sqrt_rem();
        let lo = Big { n: root.clone().into(), e };
        let hi = if rest.is_zero() { lo.clone() } else { Big { n: (root + UBig::ONE).into(), e } };
        Self { lo, hi }
    }

    /// n/d; neither holds numbers of both signs, and d not zero.
    fn quotient(n: &Self, d: &Self) -> Self {
        if n.lo.is_zero() && n.hi.is_zero() {
            return Self::exactly(Big::zero());
        }
        let negative = (n.lo.sign().is_lt() || n.hi.sign().is_lt()) != (d.lo.sign().is_lt() || d.hi.sign().is_lt());
        let sorted = |x: &Self| if x.hi.sign().is_gt() { (x.lo.clone(), x.hi.clone()) } else { (-&x.hi, -&x.lo) };
        let ((n_lo, n_hi), (d_lo, d_hi)) = (sorted(n), sorted(d));
        assert!(d_lo.sign().is_gt() && n_lo.sign().is_ge(), "a quotient of undecided sign");
        let magnitude = Self { lo: divide(&n_lo, &d_hi, false), hi: divide(&n_hi, &d_lo, true) };
        if negative { magnitude.negated() } else { magnitude }
    }

    /// A float near it.
    pub fn to_f64(&self) -> f64 {
        self.lo.to_f64()
    }

    /// |self|'s least and greatest.
    pub fn abs(&self) -> Self {
        if self.lo.sign().is_ge() {
            self.clone()
        } else if self.hi.sign().is_le() {
            self.negated()
        } else {
            let (a, b) = (self.lo.abs(), self.hi.abs());
            Self { lo: Big::zero(), hi: if a.cmp(&b).is_gt() { a } else { b } }
        }
    }

    pub fn minus(&self, x: &Big) -> Self {
        self.plus(&-x)
    }
}

/// n/d of two positive numbers to [`BITS`] bits, rounded down or up.
fn divide(n: &Big, d: &Big, up: bool) -> Big {
    let (mut a, b) = (n.magnitude(), d.magnitude());
    let shift = (BITS + b.bit_len()).saturating_sub(a.bit_len());
    a <<= shift;
    let (q, r) = a.div_rem(&b);
    let q = if up && !r.is_zero() { q + UBig::ONE } else { q };
    Big { n: q.into(), e: n.e - d.e - shift as i32 }
}
