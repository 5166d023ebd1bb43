//! Affine maps to twice the precision: exact inverses, chains as one map, images of rays with what rounding took away.
//!
//! docs/numerics.md §8.

use super::bound::{INFLATE, U};
use super::bounded::Bounded;
use super::cpu::{self, FusedLanes};
use super::dyadic::Dyadic;
use super::eft::{Fused, Product, Split, two_sum};
use super::float::power;
use super::lanes::{Lanes, Plain};
use super::norm::{largest_stretch, taxicab};
use super::number::{Number, Vector, cross, dot, vector};
use super::ratio::Ratio;
use super::tally;
use crate::ray::Ray;
use glam::{DAffine3, DMat3, DVec3};

/// An affine map whose entries are sums of two floats: a map, or the product of a chain of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    leading: DAffine3,
    /// What a chain's product has beyond that; a map of floats has nothing.
    rest: Option<Box<Rest>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Rest {
    low: DAffine3,
    /// How far the sums may be off the exact chain: a row of its matrix, by length, and an entry of its translation.
    errors: [f64; 2],
}

/// Why a map cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unusable {
    /// It flattens space.
    Singular,
    /// An entry leaves the range of floats.
    OutOfRange,
}

/// Rows and translation.
type Exact = ([Vector<Dyadic>; 3], Vector<Dyadic>);

impl From<DAffine3> for Map {
    fn from(map: DAffine3) -> Self {
        Self { leading: map, rest: None }
    }
}

/// The inverse, each entry rounded once: found exactly where that is needed, so that no determinant under- or
/// overflows. `map` must be finite.
///
/// # Errors
/// If the exact determinant is zero, or an entry of the inverse overflows.
pub fn inverse(map: &DAffine3) -> Result<DAffine3, Unusable> {
    let certain = cpu::dispatch(
        #[inline(always)]
        || certain_inverse::<Fused>(map),
        #[inline(always)]
        || certain_inverse::<Split>(map),
    );
    certain.map_or_else(|| Map::from(*map).inverse(), Ok)
}

/// The inverse, if double-double arithmetic leaves no doubt how any entry is rounded.
#[inline(always)]
fn certain_inverse<P: Product>(map: &DAffine3) -> Option<DAffine3> {
    let [x, y, z] = [
        vector::<Bounded<P>>(map.matrix3.x_axis),
        vector::<Bounded<P>>(map.matrix3.y_axis),
        vector::<Bounded<P>>(map.matrix3.z_axis),
    ];
    let t = map.translation;
    let [a, b, c] = [cross(&y, &z), cross(&z, &x), cross(&x, &y)];
    let determinant = Divisor::new(dot(&x, &a))?;
    let [a_t, b_t, c_t] = [moved(&a, &t), moved(&b, &t), moved(&c, &t)];
    let translation = DVec3::new(determinant.under(&a_t)?, determinant.under(&b_t)?, determinant.under(&c_t)?);
    let rows = [determinant.row_under(&a)?, determinant.row_under(&b)?, determinant.row_under(&c)?];
    Some(DAffine3 { matrix3: DMat3::from_cols(rows[0], rows[1], rows[2]).transpose(), translation })
}

/// −n·t. Nothing times zero is zero, without a doubt about underflow.
#[inline(always)]
fn moved<P: Product>(n: &Vector<Bounded<P>>, t: &DVec3) -> Bounded<P> {
    let mut sum = Bounded::exactly(0.0);
    for i in 0..3 {
        if t[i] != 0.0 {
            sum = sum.minus(&n[i].times(&Bounded::exactly(t[i])));
        }
    }
    sum
}

/// What many are divided by.
struct Divisor<P> {
    value: Bounded<P>,
    reciprocal: f64,
    /// Relative, of a quotient: the value's own, and that of the division.
    error: f64,
}

/// Nothing that is divided here under- or overflows between these.
const SAFE: std::ops::Range<f64> = power(-400)..power(400);

impl<P: Product> Divisor<P> {
    #[inline(always)]
    fn new(value: Bounded<P>) -> Option<Self> {
        let size = value.hi.abs();
        if !(SAFE.contains(&size) && value.error < power(-60) * size) {
            return None;
        }
        // What the quotient's first digits leave of the numerator is below 4u of that, formed with an error of 9u² and
        // divided with one of 12u²; the rest is for what is of third order, and for rounding lo ± the bound.
        let error = value.error / size * INFLATE + 80.0 * U * U;
        Some(Self { reciprocal: value.hi.recip(), value, error })
    }

    /// n over it, rounded once, if that is certain.
    #[inline(always)]
    fn under(&self, n: &Bounded<P>) -> Option<f64> {
        if n.hi == 0.0 && n.error == 0.0 {
            return Some(0.0);
        }
        let size = n.hi.abs();
        if !(SAFE.contains(&size) && n.error < power(-60) * size) {
            return None;
        }
        let first = n.hi * self.reciprocal;
        let (p, p_lo) = P::two_product(first, self.value.hi);
        let left = ((n.hi - p) - p_lo) + (n.lo - first * self.value.lo);
        let (hi, lo) = two_sum(first, left * self.reciprocal);
        let off = (self.error * hi.abs() + n.error * self.reciprocal.abs()) * INFLATE;
        (hi + (lo - off) == hi && hi + (lo + off) == hi).then_some(hi)
    }

    #[inline(always)]
    fn row_under(&self, n: &Vector<Bounded<P>>) -> Option<DVec3> {
        Some(DVec3::new(self.under(&n[0])?, self.under(&n[1])?, self.under(&n[2])?))
    }
}

impl Map {
    /// Each entry rounded once.
    #[must_use]
    pub fn leading(&self) -> &DAffine3 {
        &self.leading
    }

    /// This map's inverse, each entry rounded once.
    ///
    /// # Errors
    /// If the determinant is zero, or an entry of the inverse overflows.
    pub fn inverse(&self) -> Result<DAffine3, Unusable> {
        let (rows, translation) = self.exact();
        let columns: [Vector<Dyadic>; 3] = [0, 1, 2].map(|j| [0, 1, 2].map(|i: usize| rows[i][j].clone()));
        let [x, y, z] = &columns;
        let cofactors = [cross(y, z), cross(z, x), cross(x, y)];
        let determinant = dot(x, &cofactors[0]);
        if determinant.is_zero() {
            return Err(Unusable::Singular);
        }
        let over = |numerator: Dyadic| {
            let ratio = Ratio { numerator, denominator: determinant.clone() };
            match ratio.lambda(0.0) {
                Some((value, error)) if error.is_finite() => Ok(value),
                _ => Err(Unusable::OutOfRange),
            }
        };
        let row = |r: &Vector<Dyadic>| Ok(DVec3::new(over(r[0].clone())?, over(r[1].clone())?, over(r[2].clone())?));
        let shift = |r: &Vector<Dyadic>| over(dot(r, &translation).negated());
        let [a, b, c] = &cofactors;
        Ok(DAffine3 {
            matrix3: DMat3::from_cols(row(a)?, row(b)?, row(c)?).transpose(),
            translation: DVec3::new(shift(a)?, shift(b)?, shift(c)?),
        })
    }

    /// First `first`, then this map: multiplied exactly, rounded to two floats an entry.
    ///
    /// # Errors
    /// If an entry overflows.
    pub fn after(&self, first: &DAffine3) -> Result<Self, Unusable> {
        let (rows, translation) = self.exact();
        let columns = [first.matrix3.x_axis, first.matrix3.y_axis, first.matrix3.z_axis].map(vector::<Dyadic>);
        let shift = vector::<Dyadic>(first.translation);
        let (mut leading, mut low) = (DAffine3::ZERO, DAffine3::ZERO);
        for i in 0..3 {
            for (j, column) in columns.iter().enumerate() {
                let (hi, lo) = dot(&rows[i], column).rounded().0.to_pair();
                leading.matrix3.col_mut(j)[i] = hi;
                low.matrix3.col_mut(j)[i] = lo;
            }
            let (hi, lo) = dot(&rows[i], &shift).plus(&translation[i]).rounded().0.to_pair();
            leading.translation[i] = hi;
            low.translation[i] = lo;
        }
        if !leading.is_finite() {
            return Err(Unusable::OutOfRange);
        }
        // Two floats hold a number to 2⁻¹⁰⁴ of itself, or to a few of the smallest; what this map did not know is
        // multiplied.
        let rounding = |largest: f64| 4.0 * U * U * largest + f64::from_bits(4);
        let largest = |m: &DMat3| m.to_cols_array().iter().fold(0.0, |a: f64, x| a.max(x.abs()));
        let translation = leading.translation.abs().max_element();
        // Rows by their lengths, so that turns and shifts let the error grow by no more than their own; 2 > √3.
        let mut errors = [2.0 * rounding(largest(&leading.matrix3)), rounding(translation)];
        if let Some(Rest { errors: [matrix, shift], .. }) = self.rest.as_deref() {
            errors[0] += matrix * largest_stretch(&first.matrix3) * INFLATE;
            errors[1] += (matrix * taxicab(first.translation) + shift) * INFLATE;
        }
        Ok(Self { leading, rest: Some(Box::new(Rest { low, errors })) })
    }

    /// The image of `ray`.
    #[must_use]
    pub fn image(&self, ray: &Ray) -> Image {
        let image = cpu::dispatch_lanes(
            #[inline(always)]
            |cpu| self.image_with::<FusedLanes>(cpu, ray),
            #[inline(always)]
            || self.image_with::<Plain>((), ray),
        );
        // Where the terms cancel by more than a far-off place explains, two floats may not hold enough of their sum.
        let poor = !image.knows(image.direction_error, image.origin_error, [0.0; 2], ray);
        if poor && ray.is_valid() { self.close_image(ray, image) } else { image }
    }

    /// In three floats a sum, which nearly always do; else exactly.
    #[cold]
    #[inline(never)]
    fn close_image(&self, ray: &Ray, image: Image) -> Image {
        tally::refined();
        let unknown = self.rest.as_ref().map_or([0.0; 2], |rest| rest.unknown(ray));
        let close = cpu::dispatch_lanes(
            #[inline(always)]
            |cpu| self.close_image_with::<FusedLanes>(cpu, ray, unknown),
            #[inline(always)]
            || self.close_image_with::<Plain>((), ray, unknown),
        );
        // Nobody can know more than the chain's entries do.
        let [origin, direction] = [close.origin_error - unknown[0], close.direction_error - unknown[1]];
        if close.knows(direction, origin, unknown, ray) { close } else { self.exact_image(ray).unwrap_or(image) }
    }

    #[inline(always)]
    fn close_image_with<L: Lanes>(&self, cpu: L::Cpu, ray: &Ray, unknown: [f64; 2]) -> Image {
        let low = self.rest.as_ref().map_or(DAffine3::ZERO, |rest| rest.low);
        let (matrix, low_matrix) = (columns::<L>(cpu, &self.leading.matrix3), columns::<L>(cpu, &low.matrix3));
        let none = L::new(cpu, [0.0; 4]);
        let (t, t_low) = (L::of(cpu, self.leading.translation), L::of(cpu, low.translation));
        Image::new(
            close_product(matrix, low_matrix, ray.origin, t, t_low),
            close_product(matrix, low_matrix, ray.direction, none, none),
            unknown,
        )
    }

    /// Without closures, which are compiled without the instructions that `L` needs where they are not inlined; those
    /// of [`cpu::dispatch_lanes`] always are.
    #[inline(always)]
    fn image_with<L: Lanes>(&self, cpu: L::Cpu, ray: &Ray) -> Image {
        let (o, d) = (ray.origin, ray.direction);
        let none = L::new(cpu, [0.0; 4]);
        let (o_low, d_low, unknown) = match &self.rest {
            None => (none, none, [0.0; 2]),
            Some(rest) => {
                let low = columns::<L>(cpu, &rest.low.matrix3);
                let moved = plain_product(low, o, L::of(cpu, rest.low.translation));
                (moved, plain_product(low, d, none), rest.unknown(ray))
            }
        };
        let matrix = columns::<L>(cpu, &self.leading.matrix3);
        let t = L::of(cpu, self.leading.translation);
        Image::new(product(matrix, o, t, o_low), product(matrix, d, none, d_low), unknown)
    }

    #[cold]
    #[inline(never)]
    fn exact_image(&self, ray: &Ray) -> Option<Image> {
        tally::exact();
        let (rows, translation) = self.exact();
        let (o, d) = (vector::<Dyadic>(ray.origin), vector::<Dyadic>(ray.direction));
        let rounded = |exact: Vector<Dyadic>| {
            let [x, y, z] = exact.map(|x| x.rounded().0.to_pair());
            let value = DVec3::new(x.0, y.0, z.0);
            Sum { value, rest: DVec3::new(x.1, y.1, z.1), error: 4.0 * U * U * taxicab(value) }
        };
        let image = Image::new(
            rounded([0, 1, 2].map(|i| dot(&rows[i], &o).plus(&translation[i]))),
            rounded([0, 1, 2].map(|i| dot(&rows[i], &d))),
            self.rest.as_ref().map_or([0.0; 2], |rest| rest.unknown(ray)),
        );
        (image.ray.origin.is_finite() && image.ray.direction.is_finite()).then_some(image)
    }

    fn exact(&self) -> Exact {
        let low = self.rest.as_ref().map_or(DAffine3::ZERO, |rest| rest.low);
        let entry = |hi: f64, lo: f64| if lo == 0.0 { hi.into() } else { Dyadic::from(hi).plus(&lo.into()) };
        let both = |hi: DVec3, lo: DVec3| [0, 1, 2].map(|j| entry(hi[j], lo[j]));
        let row = |i: usize| both(self.leading.matrix3.row(i), low.matrix3.row(i));
        ([row(0), row(1), row(2)], both(self.leading.translation, low.translation))
    }
}

impl Rest {
    /// By how much not knowing the chain's entries moves origin and direction (|·|₁).
    #[inline(always)]
    fn unknown(&self, ray: &Ray) -> [f64; 2] {
        let [matrix, shift] = self.errors;
        [3.1 * (matrix * taxicab(ray.origin) + shift), 3.1 * matrix * taxicab(ray.direction)]
    }
}

/// How much better than the last place of its components a ray's image is known.
const ENOUGH: f64 = 1.0 / (1u64 << 20) as f64;

/// A ray's image: rounded, what rounding took away, and bounds (|·|₁) on what even that leaves out.
#[derive(Clone, Copy, Debug)]
pub struct Image {
    /// Each component rounded once.
    pub ray: Ray,
    /// What is missing from the origin.
    pub origin_low: DVec3,
    /// What is missing from the direction.
    pub direction_low: DVec3,
    /// A bound on what is missing beyond that from the origin.
    pub origin_error: f64,
    /// A bound on what is missing beyond that from the direction.
    pub direction_error: f64,
}

impl Image {
    /// Whether these errors are too small to count: beside the last places, or, of the origin, beside λ's; or beside
    /// what is unknown anyway. A NaN is not.
    #[inline(always)]
    fn knows(&self, direction_error: f64, origin_error: f64, unknown: [f64; 2], ray: &Ray) -> bool {
        let size = |v: DVec3| v.abs().max_element();
        let (o, d) = (size(self.ray.origin), size(self.ray.direction));
        let along = direction_error <= (ENOUGH * U * d).max(unknown[1]);
        along
            && (origin_error <= (ENOUGH * U * o).max(unknown[0])
                || origin_error * size(ray.direction) <= ENOUGH * ENOUGH * U * size(ray.origin) * d)
    }

    #[inline(always)]
    fn new(o: Sum, d: Sum, unknown: [f64; 2]) -> Self {
        // Products and their errors may have underflowed.
        let underflow = 64.0 * f64::from_bits(1);
        Self {
            ray: Ray { origin: o.value, direction: d.value },
            origin_low: o.rest,
            direction_low: d.rest,
            origin_error: o.error + underflow + unknown[0],
            direction_error: d.error + underflow + unknown[1],
        }
    }
}

/// value + rest, known to `error` (|·|₁).
#[derive(Clone, Copy)]
struct Sum {
    value: DVec3,
    rest: DVec3,
    error: f64,
}

impl Sum {
    #[inline(always)]
    fn new<L: Lanes>(value: L, rest: L, error: L) -> Self {
        let [x, y, z, _] = error.to_array();
        Self { value: three(value), rest: three(rest), error: (x + y) + z }
    }
}

#[inline(always)]
fn three<L: Lanes>(lanes: L) -> DVec3 {
    let [x, y, z, _] = lanes.to_array();
    DVec3::new(x, y, z)
}

#[inline(always)]
fn columns<L: Lanes>(cpu: L::Cpu, m: &DMat3) -> [L; 3] {
    [L::of(cpu, m.x_axis), L::of(cpu, m.y_axis), L::of(cpu, m.z_axis)]
}

/// M·v + t, rounded seven times.
#[inline(always)]
fn plain_product<L: Lanes>(m: [L; 3], v: DVec3, t: L) -> L {
    (m[0] * t.splat(v.x) + m[1] * t.splat(v.y)) + (m[2] * t.splat(v.z) + t)
}

/// M·v + t + `low` in double-double, and a bound on its error: each row's low part is a sum of seven terms in six
/// additions, and `low` of four products or less, rounded seven times.
#[inline(always)]
fn product<L: Lanes>(m: [L; 3], v: DVec3, t: L, low: L) -> Sum {
    let (x, x_lo) = m[0].two_product(t.splat(v.x));
    let (y, y_lo) = m[1].two_product(t.splat(v.y));
    let (z, z_lo) = m[2].two_product(t.splat(v.z));
    let (xy, e) = two_sum(x, y);
    let (zt, f) = two_sum(z, t);
    let (s, g) = two_sum(xy, zt);
    let (hi, lo) = two_sum(s, (((e + f) + g) + ((x_lo + y_lo) + z_lo)) + low);
    // Each term is at most u of the sum of the products' absolute values, or of partial sums below that.
    let size = (x.abs() + y.abs()) + (z.abs() + t.abs());
    Sum::new(hi, lo, size * t.splat(40.0 * U * U))
}

/// [`product`] in three floats a sum, of a map in two floats an entry.
#[inline(always)]
fn close_product<L: Lanes>(m: [L; 3], m_low: [L; 3], v: DVec3, t: L, t_low: L) -> Sum {
    let (hi, lo, error) = close_sum(m, m_low, [t.splat(v.x), t.splat(v.y), t.splat(v.z)], t, t_low);
    Sum::new(hi, lo, error)
}

/// (r + r_low)·v + t + `t_low` in double-double, summed in three floats, and a bound on its error, each lane for
/// itself: docs/numerics.md §8.
#[inline(always)]
fn close_sum<L: Lanes>(r: [L; 3], r_low: [L; 3], v: [L; 3], t: L, t_low: L) -> (L, L, L) {
    let (x, x_lo) = r[0].two_product(v[0]);
    let (y, y_lo) = r[1].two_product(v[1]);
    let (z, z_lo) = r[2].two_product(v[2]);
    let (xy, e) = two_sum(x, y);
    let (zt, f) = two_sum(z, t);
    let (first, g) = two_sum(xy, zt);
    // What is of the size of the first one's rounding.
    let (p, p_lo) = r_low[0].two_product(v[0]);
    let (q, q_lo) = r_low[1].two_product(v[1]);
    let (s, s_lo) = r_low[2].two_product(v[2]);
    let (ef, a) = two_sum(e, f);
    let (g, b) = two_sum(g, t_low);
    let (lows, c) = two_sum(x_lo, y_lo);
    let (lows, d) = two_sum(lows, z_lo);
    let (pq, h) = two_sum(p, q);
    let (sum, i) = two_sum(pq, s);
    let (left, j) = two_sum(ef, g);
    let (right, k) = two_sum(lows, sum);
    let (second, l) = two_sum(left, right);
    let third = (((a + b) + (c + d)) + ((h + i) + (j + k))) + (l + ((p_lo + q_lo) + s_lo));
    let (hi, rest) = two_sum(first, second);
    let (hi, lo) = two_sum(hi, rest + third);
    let size = (x.abs() + y.abs()) + (z.abs() + t.abs());
    (hi, lo, hi.abs() * t.splat(2.0 * U * U) + size * t.splat(CLOSE_SUM))
}

/// |error of [`close_sum`] beyond its low float's rounding| ≤ this times the sum of the products' absolute values.
const CLOSE_SUM: f64 = 256.0 * U * U * U;

/// map · p, each component rounded once but for 41u² of what it is the sum of.
#[must_use]
pub(crate) fn transform_point(map: &DAffine3, p: DVec3) -> DVec3 {
    #[inline(always)]
    fn with<L: Lanes>(cpu: L::Cpu, map: &DAffine3, p: DVec3) -> DVec3 {
        product(columns::<L>(cpu, &map.matrix3), p, L::of(cpu, map.translation), L::new(cpu, [0.0; 4])).value
    }
    cpu::dispatch_lanes(
        #[inline(always)]
        |cpu| with::<FusedLanes>(cpu, map, p),
        #[inline(always)]
        || with::<Plain>((), map, p),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        (-1.0..1.0f64, -60..60i32).prop_map(|(m, e)| m * 2f64.powi(e))
    }

    fn map(x: &[f64]) -> DAffine3 {
        DAffine3::from_cols_slice(x)
    }

    fn ray(x: &[f64]) -> Ray {
        Ray::new([x[0], x[1], x[2]], [x[3], x[4], x[5]])
    }

    proptest! {
        #[test]
        fn both_products_answer_with_the_same_bits(x in prop::collection::vec(number(), 30)) {
            let Ok(chain) = Map::from(map(&x[..12])).after(&map(&x[12..24])) else { return Ok(()) };
            let ray = ray(&x[24..]);
            let cpu = Fused::cpu();
            let (split, fused) = (chain.image_with::<Plain>((), &ray), chain.image_with::<FusedLanes>(cpu, &ray));
            prop_assert_eq!(format!("{split:?}"), format!("{fused:?}"));
            let [split, fused] =
                [chain.close_image_with::<Plain>((), &ray, [0.0; 2]), chain.close_image_with::<FusedLanes>(cpu, &ray, [0.0; 2])];
            prop_assert_eq!(format!("{split:?}"), format!("{fused:?}"));
        }

        #[test]
        fn the_exact_image_is_inside(x in prop::collection::vec(number(), 30)) {
            let (first, second) = (map(&x[..12]), map(&x[12..24]));
            let ray = ray(&x[24..]);
            let chain = Map::from(second).after(&first).unwrap();
            let (near, far) = (Map::from(first).exact(), Map::from(second).exact());
            let through = |m: &Exact, v: &Vector<Dyadic>, moved: bool| [0, 1, 2].map(|i: usize| {
                let turned = dot(&m.0[i], v);
                if moved { turned.plus(&m.1[i]) } else { turned }
            });
            let unknown = chain.rest.as_ref().unwrap().unknown(&ray);
            let images = [
                chain.image_with::<Plain>((), &ray),
                chain.close_image_with::<Plain>((), &ray, unknown),
                chain.exact_image(&ray).unwrap(),
            ];
            for image in images {
                let parts = [
                    (true, ray.origin, image.ray.origin, image.origin_low, image.origin_error),
                    (false, ray.direction, image.ray.direction, image.direction_low, image.direction_error),
                ];
                for (moved, v, hi, lo, error) in parts {
                    let exact = through(&far, &through(&near, &vector(v), moved), moved);
                    for i in 0..3 {
                        let off = exact[i].minus(&hi[i].into()).minus(&lo[i].into()).magnitude();
                        prop_assert!(off.minus(&error.into()).sign() != Some(std::cmp::Ordering::Greater));
                    }
                }
            }
        }
    }

    #[test]
    fn no_input_reaches_the_bound_of_close_sums() {
        use crate::kernel::search::{Rational, climb, dot3, exact};
        let worst = climb("map: sums in three floats", 11, |x| {
            let (mut r, v, t) = ([x[0], x[1], x[2]], DVec3::new(x[3], x[4], x[5]), x[6]);
            // The product left over cancels the others, to about the last place.
            r[2] = -(r[0] * v.x + r[1] * v.y + t) / v.z;
            let low = [0, 1, 2].map(|i| U * x[7 + i] * r[i]);
            let t_low = U * x[10] * t;
            let all = |x: f64| Plain::new((), [x; 4]);
            let (hi, lo, error) = close_sum(r.map(all), low.map(all), v.to_array().map(all), all(t), all(t_low));
            let [hi, lo, error] = [hi, lo, error].map(|x| x.to_array()[0]);
            let number = |x: f64| Rational::try_from(x).ok();
            let exact =
                dot3(&exact(r.into()), &exact(v)) + dot3(&exact(low.into()), &exact(v)) + number(t)? + number(t_low)?;
            Some(((exact - number(hi)? - number(lo)?).to_f64().value() / error).abs())
        });
        assert!((0.001..1.0).contains(&worst));
    }

    /// Rotations, scalings, shears and moves with their zeros, and such as are almost singular.
    fn everyday() -> impl Strategy<Value = DAffine3> {
        let entry =
            prop_oneof![Just(0.0), Just(1.0), Just(-1.0), (-3..4i32).prop_map(f64::from), -1.0..1.0f64, number()];
        prop::collection::vec(entry, 12).prop_map(|x| map(&x))
    }

    #[test]
    fn certain_inverses_are_the_exact_ones() {
        use proptest::test_runner::{Config, TestRunner};
        let certain = std::cell::Cell::new([0; 2]);
        TestRunner::new(Config::with_cases(4096))
            .run(&everyday(), |m| {
                let exact = Map::from(m).inverse();
                let fast = certain_inverse::<Split>(&m);
                prop_assert_eq!(fast, certain_inverse::<Fused>(&m));
                let [yes, no] = certain.get();
                let bits = |m: DAffine3| m.to_cols_array().map(f64::to_bits);
                certain.set(if fast.is_some() { [yes + 1, no] } else { [yes, no + 1] });
                if let Some(fast) = fast {
                    prop_assert_eq!(Ok(bits(fast)), exact.map(bits));
                }
                Ok(())
            })
            .unwrap();
        println!("{:?} certain, not", certain.get());
        let rotation = DAffine3::from_rotation_z(0.3);
        assert!(certain.get()[0] > 2000 && certain_inverse::<Split>(&rotation).is_some());
    }

    #[test]
    fn inverses_have_no_range_of_their_own() {
        for k in [-300, -120, 0, 120, 300] {
            let s = 2f64.powi(k);
            let map =
                DAffine3 { matrix3: DMat3::from_diagonal(DVec3::new(s, -s, 2.0 * s)), translation: DVec3::splat(s) };
            let inverse = inverse(&map).unwrap();
            assert_eq!(inverse.matrix3, DMat3::from_diagonal(DVec3::new(1.0, -1.0, 0.5) / s));
            assert_eq!(inverse.translation, DVec3::new(-1.0, 1.0, -0.5));
        }
        assert_eq!(inverse(&DAffine3::from_mat3(DMat3::ZERO)), Err(Unusable::Singular));
        let tiny = DAffine3::from_scale(DVec3::splat(1e-310));
        assert_eq!(inverse(&tiny), Err(Unusable::OutOfRange));
        let huge = DAffine3::from_scale(DVec3::splat(1e200));
        assert_eq!(Map::from(huge).after(&huge), Err(Unusable::OutOfRange));
    }
}
