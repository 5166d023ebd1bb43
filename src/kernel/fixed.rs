//! The signs of triangles and of a sphere's tangents in 64-bit integers: exact, and faster than anything inexact that
//! must look twice.
//!
//! Where a ray meets an edge or a vertex or touches a sphere *exactly*, the numbers are short: vertices on a grid, or
//! single-precision vertices, seen along a tidy direction. All coordinates are then integers of one power of two, and
//! the edge functions fit 192 bits.

use super::float::power;
use crate::Ray;
use glam::DVec3;
use std::cmp::Ordering;

/// The largest integers: |coordinate| < 2⁵⁸, hence |difference| < 2⁵⁹, and |direction| < 2⁵⁹.
const BITS: i32 = 58;

type Integers = [i64; 3];

/// (exponent of the highest bit + 1, exponent of the lowest set bit) of a non-zero finite float.
fn extent(x: f64) -> (i32, i32) {
    let bits = x.to_bits();
    let field = ((bits >> 52) & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    let (mantissa, exponent) = if field == 0 { (fraction, -1074) } else { (fraction | 1 << 52, field - 1075) };
    (exponent + 64 - mantissa.leading_zeros() as i32, exponent + mantissa.trailing_zeros() as i32)
}

/// The vectors as integers of one power of two, if they fit.
fn integers<const N: usize>(vectors: [DVec3; N], bits: i32) -> Option<[Integers; N]> {
    multiples(vectors, bits).map(|(vectors, _)| vectors)
}

/// The vectors as integers, if they fit, and of which power of two.
fn multiples<const N: usize>(vectors: [DVec3; N], bits: i32) -> Option<([Integers; N], i32)> {
    let (mut top, mut bottom) = (i32::MIN, i32::MAX);
    for v in &vectors {
        for x in v.to_array() {
            if x != 0.0 {
                let (high, low) = extent(x);
                top = top.max(high);
                bottom = bottom.min(low);
            }
        }
    }
    // 2^−bottom must be a float itself.
    if top == i32::MIN {
        return Some(([[0; 3]; N], 0));
    }
    if top - bottom > bits || !(-1000..=1000).contains(&bottom) {
        return None;
    }
    let scale = f64::from_bits(((1023 - bottom) as u64) << 52);
    Some((vectors.map(|v| v.to_array().map(|x| (x * scale) as i64)), bottom))
}

fn difference(a: Integers, b: Integers) -> Integers {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// |a|, |b| < 2⁵⁹: below 2¹¹⁹.
fn cross(a: Integers, b: Integers) -> [i128; 3] {
    let minor = |i: usize, j: usize| i128::from(a[i]) * i128::from(b[j]) - i128::from(a[j]) * i128::from(b[i]);
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// The value high·2⁶⁴ + low with 0 ≤ low < 2⁶⁴.
#[derive(Clone, Copy)]
struct Sum {
    high: i128,
    low: u64,
}

impl Sum {
    fn sign(self) -> Ordering {
        self.high.cmp(&0).then(self.low.cmp(&0))
    }

    fn minus(self, other: Self) -> Self {
        let (low, borrow) = self.low.overflowing_sub(other.low);
        Self { high: self.high - other.high - i128::from(borrow), low }
    }

    fn negated(self) -> Self {
        Self { high: 0, low: 0 }.minus(self)
    }
}

/// p·e, |p| < 2¹¹⁹, |e| < 2⁵⁹: the products of both halves stay below 2¹²³, their sums below 2¹²⁵.
fn dot(p: [i128; 3], e: Integers) -> Sum {
    let (mut high, mut low) = (0i128, 0i128);
    for (p, e) in p.into_iter().zip(e) {
        let e = i128::from(e);
        high += (p >> 64) * e;
        low += i128::from(p as u64) * e;
    }
    Sum { high: high + (low >> 64), low: low as u64 }
}

/// The signs of the edge functions s(c,a), s(a,b), s(b,c), if the numbers are short enough; all finite.
pub(super) fn sides(ray: &Ray, &[a, b, c]: &[DVec3; 3]) -> Option<[Ordering; 3]> {
    let [o, a, b, c] = integers([ray.origin, a, b, c], BITS)?;
    let [d] = integers([ray.direction], BITS + 1)?;
    let (e1, e2) = (difference(b, a), difference(c, a));
    let q = cross(d, difference(o, a));
    let (su, sv) = (dot(q, e2), dot(q, e1).negated());
    let sw = dot(cross(e1, e2), d).minus(su).minus(sv);
    Some([su.sign(), sv.sign(), sw.sign()])
}

/// Whether two triangles lie in one plane, for certain: not known if the numbers are too long. All finite.
pub(super) fn in_one_plane(&[a, b, c]: &[DVec3; 3], &[p, q, r]: &[DVec3; 3]) -> bool {
    let Some([a, b, c, p, q, r]) = integers([a, b, c, p, q, r], BITS) else { return false };
    let n = cross(difference(b, a), difference(c, a));
    [p, q, r].into_iter().all(|v| dot(n, difference(v, a)).sign() == Ordering::Equal)
}

/// The sign of the edge function s(a, b), if the numbers are short enough; all finite.
pub(super) fn edge(ray: &Ray, a: DVec3, b: DVec3) -> Option<Ordering> {
    let [o, a, b] = integers([ray.origin, a, b], BITS)?;
    let [d] = integers([ray.direction], BITS + 1)?;
    Some(dot(cross(d, difference(a, o)), difference(b, a)).sign())
}

/// |d|²r² − |f × d|² as an unevaluated sum, to 2⁻¹⁰⁶ of itself and zero only if it is that, if the numbers are short enough.
/// r²|d|² must be in 2^±256.
///
/// |f|, r < 2ᴮ and |d| < 2ᴳ with B + G ≤ 61: f × d fits 62 bits, both squares 125.
pub(super) fn discriminant(f: DVec3, d: DVec3, r: f64) -> Option<(f64, f64)> {
    const TOGETHER: i32 = 61;
    let ([d], d_exponent) = multiples([d], TOGETHER / 2)?;
    let longest = d.iter().fold(0, |longest, x| longest | x.unsigned_abs());
    let bits = TOGETHER - (64 - longest.leading_zeros() as i32);
    let ([f, [r, ..]], exponent) = multiples([f, DVec3::new(r, 0.0, 0.0)], bits)?;
    let minor = |i: usize, j: usize| f[i] * d[j] - f[j] * d[i];
    let square = |x: i64| i128::from(x) * i128::from(x);
    let w2 = square(minor(1, 2)) + square(minor(2, 0)) + square(minor(0, 1));
    let value = square(r) * (square(d[0]) + square(d[1]) + square(d[2])) - w2;
    let (hi, unit) = (value as f64, power(2 * (exponent + d_exponent)));
    Some((hi * unit, (value - hi as i128) as f64 * unit))
}
