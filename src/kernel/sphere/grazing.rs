//! Rays that graze a sphere: discriminant and both roots in double-double, with bounds known beforehand; exact tangents
//! of short numbers by integers. docs/numerics.md §5, "Grazing".

use super::super::bound::U;
use super::super::eft::{Product, two_diff, two_sum};
use super::super::fixed;
use super::super::pair::{Pair, close_dot, plain_dot, taxicab};
use super::super::section::Undecided;
use super::near::{Excess, Root, Roots, first_inside};
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::DVec3;

/// |error of D| ≤ this·A·r·(r + |f|₁).
const CLOSE_D: f64 = 128.0 * U * U;
/// |error of λ, beside what D's brings| ≤ this·(Σ|fᵢdᵢ| + √D)/A.
const ROOT: f64 = 96.0 * U * U;
/// |error of b| ≤ this·Σ|fᵢdᵢ|.
const CLOSE_B: f64 = 16.0 * U * U;

/// The nearest hit inside `within`, of an ordinary ray that the fast path does not see miss.
#[inline(always)]
pub(super) fn nearest<P: Product>(
    ray: &Ray,
    center: DVec3,
    r: f64,
    within: Interval,
) -> Result<Option<Hit>, Undecided> {
    let (f, d) = (Pair::difference(ray.origin, center), ray.direction);
    let line = Line::new::<P>(&f, d);
    let (discriminant, error) = (line.discriminant::<P>(&f, d, r), CLOSE_D * line.a * r * (r + taxicab(f.hi)));
    if discriminant.0 < -error {
        return Ok(None);
    }
    if discriminant.0 > error {
        let answer = first_inside(line.roots::<P>(discriminant, error, line.products), ray, r, within);
        if answer.is_ok() {
            return answer;
        }
    } else if Excess::is_zero::<P>(&f, r) && line.b.abs() > CLOSE_B * line.products {
        // On the sphere: λ = 0 and −2b/A.
        let roots = Roots::new::<P>(&f, d, &Excess::ZERO);
        let (near, far) = (roots.near::<P>(&Excess::ZERO), roots.far::<P>(&Excess::ZERO, d, r));
        return first_inside(if line.b > 0.0 { [far, near] } else { [near, far] }, ray, r, within);
    }
    if f.lo != DVec3::ZERO {
        return Err(Undecided);
    }
    // Short numbers: b and A are exact, too.
    let discriminant = fixed::discriminant(f.hi, d, r).ok_or(Undecided)?;
    if discriminant.0 < 0.0 {
        return Ok(None);
    }
    first_inside(line.roots::<P>(discriminant, 0.0, line.b.abs()), ray, r, within)
}

/// A and b in double-double, Σ|fᵢdᵢ|.
struct Line {
    a: f64,
    a_lo: f64,
    b: f64,
    b_lo: f64,
    products: f64,
}

impl Line {
    #[inline(always)]
    fn new<P: Product>(f: &Pair, d: DVec3) -> Self {
        let ((a, a_lo), (b, b_lo)) = (close_dot::<P>(d, d), f.dot_float::<P>(d));
        let (b, b_lo) = two_sum(b, b_lo);
        Self { a, a_lo, b, b_lo, products: plain_dot(f.hi.abs(), d.abs()) }
    }

    /// r²A − |f × d|² as an unevaluated sum.
    #[inline(always)]
    fn discriminant<P: Product>(&self, f: &Pair, d: DVec3, r: f64) -> (f64, f64) {
        let minor = |i: usize, j: usize| {
            let ((p, p_lo), (q, q_lo)) = (P::two_product(f.hi[i], d[j]), P::two_product(f.hi[j], d[i]));
            let (s, s_lo) = two_diff(p, q);
            (s, s_lo + ((p_lo - q_lo) + (f.lo[i] * d[j] - f.lo[j] * d[i])))
        };
        let ((x, x_lo), (y, y_lo), (z, z_lo)) = (minor(1, 2), minor(2, 0), minor(0, 1));
        let mixed = x_lo * (2.0 * x + x_lo) + y_lo * (2.0 * y + y_lo) + z_lo * (2.0 * z + z_lo);
        let ((x, x_lo), (y, y_lo), (z, z_lo)) = (P::two_product(x, x), P::two_product(y, y), P::two_product(z, z));
        let (r2, r2_lo) = P::two_product(r, r);
        let (ar2, ar2_lo) = P::two_product(r2, self.a);
        let ar2_lo = ar2_lo + (r2 * self.a_lo + r2_lo * self.a);
        let ((s, s_lo), (t, t_lo)) = (two_sum(x, y), two_diff(ar2, z));
        let (value, value_lo) = two_diff(t, s);
        let lo = ((t_lo - s_lo) + (ar2_lo - ((x_lo + y_lo) + z_lo))) - mixed;
        two_sum(value, value_lo + lo)
    }

    /// (−b ∓ √D)/A; D is off by `error`, b by 16u²·`products`.
    #[inline(always)]
    fn roots<P: Product>(&self, (discriminant, lo): (f64, f64), error: f64, products: f64) -> [Root; 2] {
        let inverse = 1.0 / self.a;
        let s = discriminant.sqrt();
        // A tangent has one root: none of its terms is divided by zero.
        let (half, off) = if s > 0.0 { (0.5 / s, error / s) } else { (0.0, 0.0) };
        let s_lo = (P::remainder(discriminant, s, s) + lo) * half;
        let root = |s: f64, s_lo: f64| {
            let (n, n_lo) = two_sum(s, -self.b);
            let (n, n_lo) = two_sum(n, n_lo + (s_lo - self.b_lo));
            let first = n * inverse;
            let rest = P::remainder(n, first, self.a) + (n_lo - first * self.a_lo);
            let (hi, lo) = two_sum(first, rest * inverse);
            // Zero is that of no sign.
            Root { hi: hi + 0.0, lo, rest: (off + ROOT * (products + s.abs())) * inverse }
        };
        [root(-s, -s_lo), root(s, s_lo)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::dyadic::Dyadic;
    use super::super::super::eft::{Fused, Split};
    use super::super::super::search::{Rational, climb, each};
    use super::super::super::tally::Tally;
    use super::super::tests::{polynomial, setting};
    use super::super::{decide, intersect};
    use super::*;

    fn rational(x: f64) -> Rational {
        Rational::try_from(x).unwrap()
    }

    #[test]
    fn no_input_reaches_the_bounds() {
        let ratio = |off: Rational, bound: f64| Some((off.to_f64().value() / bound).abs());
        let worst = climb("sphere, grazing: D", 11, |x| {
            let (o, c, d, r) = setting(x)?;
            let f = Pair::difference(o, c);
            let line = Line::new::<Split>(&f, d);
            let (hi, lo) = line.discriminant::<Split>(&f, d, r);
            let [.., exact] = polynomial(o, c, d, r);
            ratio(exact - rational(hi) - rational(lo), CLOSE_D * line.a * r * (r + taxicab(f.hi)))
        });
        assert!((0.02..1.0).contains(&worst));
        // The whole bound, D's share included, and what is left of it where D is known to twice the digits.
        for (name, sharp) in [("sphere, grazing: λ", false), ("sphere, grazing: λ but for D", true)] {
            let worst = climb(name, 11, |x| {
                let (o, c, d, r) = setting(x)?;
                let f = Pair::difference(o, c);
                let line = Line::new::<Split>(&f, d);
                let mut discriminant = line.discriminant::<Split>(&f, d, r);
                let mut error = CLOSE_D * line.a * r * (r + taxicab(f.hi));
                let [a, b, mut cc, exact] = polynomial(o, c, d, r);
                if discriminant.0 <= error {
                    return None;
                }
                if sharp {
                    let hi = exact.to_f64().value();
                    discriminant = (hi, (exact - rational(hi)).to_f64().value());
                    error = 0.0;
                    // Of this D, to which b² − AC is then not equal by its rounding.
                    cc = (&b * &b - rational(hi) - rational(discriminant.1)) / &a;
                }
                let [falling, rising] = line.roots::<Split>(discriminant, error, line.products);
                let root = if x[6] < 0.0 { falling } else { rising };
                let l = rational(root.hi) + rational(root.lo);
                let slope = Rational::from(2) * (&a * &l + &b);
                let off = ((&a * &l + &b + &b) * &l + cc) / slope;
                ratio(off, root.rest)
            });
            assert!((0.002..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    /// Answers are the exact tier's, whatever the interval; few rays need it.
    #[test]
    fn grazing_rays_are_answered_as_exactly_as_others() {
        let (mut rays, mut hits, before) = (0, 0, Tally::now());
        each(30_000, 12, |x| {
            let Some((origin, c, d, r)) = setting(x) else { return };
            // Of impact parameter r(1 ± g), g from 2⁻⁵⁶ to 2⁻¹⁶.
            let r = r / (1.0 + x[6].abs().powi(6)) * (1.0 + x[6] * 2f64.powf(-36.0 + 20.0 * x[11]));
            let ray = Ray { origin, direction: d };
            let at = -(origin - c).dot(d) / d.dot(d);
            for within in [Interval::FORWARD, Interval::LINE, Interval { min: at, max: f64::INFINITY }] {
                rays += 1;
                let hit = intersect(&ray, c, r, within);
                let answers = [nearest::<Fused>(&ray, c, r, within), nearest::<Split>(&ray, c, r, within)];
                assert_eq!(answers[0].as_ref().ok(), answers[1].as_ref().ok());
                let exact = decide::<Dyadic>(&ray, c, r, within).unwrap();
                for hit in [Some(hit), answers[0].as_ref().ok().copied()].into_iter().flatten() {
                    assert_eq!(hit.is_some(), exact.is_some(), "{ray:?} {c} {r:e} {within:?}");
                    if let (Some(hit), Some(exact)) = (hit, exact) {
                        hits += 1;
                        assert!((hit.lambda - exact.lambda).abs() <= hit.error + exact.error);
                    }
                }
            }
        });
        let counted = Tally::now().since(before);
        println!("{rays} rays that graze a sphere, {hits} hits, {counted:?}");
        assert!(rays > 30_000 && hits > rays / 2 && 3 * counted.refined > rays && 50 * counted.exact < rays);
    }

    /// Tangents of short numbers, and radii a float more or less: known without `Number`s, and exactly.
    #[test]
    fn short_tangents_are_known() {
        let mut seen = [0; 3];
        each(20_000, 7, |x| {
            let off = [-1, 0, 1][(x[6].abs() * 3.0) as usize];
            // Radii of 53 bits leave few to the others.
            let whole = |x: f64| (x * if off == 0 { 2048.0 } else { 2.0 }).round();
            // A direction across p, |p| = 7 or 3.
            let (p, r) = if x[0] > 0.0 { ([2.0, 3.0, 6.0], 7.0) } else { ([1.0, -2.0, 2.0], 3.0) };
            let d = DVec3::from(p).cross(DVec3::new(whole(x[1]), whole(x[2]), whole(x[3])));
            if d == DVec3::ZERO {
                return;
            }
            let f = DVec3::from(p) + d * whole(x[4]);
            let (d, s) = (d * 2f64.powi((40.0 * x[3]) as i32), 2f64.powi((60.0 * x[5]) as i32));
            let (f, radius) = (f * s, f64::from_bits((f64::to_bits(r * s) as i64 + off) as u64));
            let Some((hi, lo)) = fixed::discriminant(f, d, radius) else { return };
            let [.., exact] = polynomial(f, DVec3::ZERO, d, radius);
            let error = exact.clone() - rational(hi) - rational(lo);
            assert!(error.to_f64().value().abs() <= U * U * hi.abs() && (hi == 0.0) == exact.is_zero());
            assert_eq!(hi.total_cmp(&0.0) as i64, off);
            seen[(off + 1) as usize] += 1;
            let ray = Ray { origin: f, direction: d };
            let answer = nearest::<Split>(&ray, DVec3::ZERO, radius, Interval::LINE).unwrap();
            assert_eq!(answer.is_some(), off >= 0);
        });
        println!("{seen:?} misses, tangents, hits");
        assert!(seen.iter().all(|&n| n > 500));
    }
}
