//! Vectors as unevaluated sums of two float vectors, and the plain products beside them: what the fast paths of the
//! solids share. No bounds are carried; docs/numerics.md §5, §6 have them.

use super::eft::{Product, two_diff, two_sum};
use glam::DVec3;

/// An exact difference: hi + lo.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) hi: DVec3,
    pub(super) lo: DVec3,
}

/// s + t + low parts = |p|² − r².
struct Squares {
    s: f64,
    t: f64,
    sums_lo: f64,
    products_lo: f64,
    mixed: f64,
}

impl Pair {
    #[inline(always)]
    pub(super) fn difference(a: DVec3, b: DVec3) -> Self {
        let ((x, xe), (y, ye), (z, ze)) = (two_diff(a.x, b.x), two_diff(a.y, b.y), two_diff(a.z, b.z));
        Self { hi: DVec3::new(x, y, z), lo: DVec3::new(xe, ye, ze) }
    }

    /// self + s·d, to about 2u² of what is added.
    #[inline(always)]
    pub(super) fn moved<P: Product>(&self, s: f64, d: DVec3) -> Self {
        let ((px, pxe), (py, pye), (pz, pze)) =
            (P::two_product(s, d.x), P::two_product(s, d.y), P::two_product(s, d.z));
        let ((x, xe), (y, ye), (z, ze)) = (two_sum(self.hi.x, px), two_sum(self.hi.y, py), two_sum(self.hi.z, pz));
        let lo = DVec3::new(xe + (pxe + self.lo.x), ye + (pye + self.lo.y), ze + (pze + self.lo.z));
        Self { hi: DVec3::new(x, y, z), lo }
    }

    /// |self|² − (radius + lo)².
    #[inline(always)]
    pub(super) fn squared_less<P: Product>(&self, radius: f64, lo: f64) -> f64 {
        let Squares { s, t, sums_lo, products_lo, mixed } = self.squares::<P>(radius);
        let (sum, sum_lo) = two_sum(s, t);
        sum + ((sum_lo + sums_lo) + products_lo + (mixed - lo * (2.0 * radius + lo)))
    }

    /// |self|² − radius² as an unevaluated sum.
    #[inline(always)]
    pub(super) fn squared_less_pair<P: Product>(&self, radius: f64) -> (f64, f64) {
        let Squares { s, t, sums_lo, products_lo, mixed } = self.squares::<P>(radius);
        let (sum, sum_lo) = two_sum(s, t);
        two_sum(sum, ((sum_lo + sums_lo) + products_lo) + mixed)
    }

    /// |self|² − radius² where it nearly vanishes: the largest terms' sum is rounded like the result.
    #[inline(always)]
    pub(super) fn residual<P: Product>(&self, radius: f64) -> f64 {
        let Squares { s, t, sums_lo, products_lo, mixed } = self.squares::<P>(radius);
        (s + t) + ((sums_lo + products_lo) + mixed)
    }

    #[inline(always)]
    fn squares<P: Product>(&self, radius: f64) -> Squares {
        let Self { hi: h, lo: l } = *self;
        let ((x, x_lo), (y, y_lo)) = (P::two_product(h.x, h.x), P::two_product(h.y, h.y));
        let ((z, z_lo), (r, r_lo)) = (P::two_product(h.z, h.z), P::two_product(radius, radius));
        let ((s, s_lo), (t, t_lo)) = (two_sum(x, y), two_diff(z, r));
        let (sums_lo, products_lo) = (s_lo + t_lo, (x_lo + y_lo) + (z_lo - r_lo));
        Squares { s, t, sums_lo, products_lo, mixed: plain_dot(l, 2.0 * h + l) }
    }

    /// self · other as an unevaluated sum.
    #[inline(always)]
    pub(super) fn dot<P: Product>(&self, other: &Self) -> (f64, f64) {
        let (sum, lo) = self.dot_float::<P>(other.hi);
        (sum, lo + plain_dot(self.hi, other.lo))
    }

    /// self · v as an unevaluated sum.
    #[inline(always)]
    pub(super) fn dot_float<P: Product>(&self, v: DVec3) -> (f64, f64) {
        let (sum, lo) = close_dot::<P>(self.hi, v);
        (sum, lo + plain_dot(self.lo, v))
    }
}

/// a · b as an unevaluated sum.
#[inline(always)]
pub(super) fn close_dot<P: Product>(a: DVec3, b: DVec3) -> (f64, f64) {
    let ((x, x_lo), (y, y_lo), (z, z_lo)) =
        (P::two_product(a.x, b.x), P::two_product(a.y, b.y), P::two_product(a.z, b.z));
    let (s, s_lo) = two_sum(x, y);
    let (t, t_lo) = two_sum(s, z);
    (t, (s_lo + t_lo) + ((x_lo + y_lo) + z_lo))
}

#[inline(always)]
pub(super) fn plain_dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[inline(always)]
pub(super) fn plain_cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

#[inline(always)]
pub(super) fn taxicab(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// 2⁻ᵉ ≤ x < 2ᵉ
#[inline(always)]
pub(super) fn in_range(x: f64, e: u64) -> bool {
    let least = (1023 - e) << 52;
    x.to_bits().wrapping_sub(least) < (2 * e) << 52
}
