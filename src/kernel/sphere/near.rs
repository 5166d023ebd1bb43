//! Rays that start next to the sphere, as those do that leave it: both roots from C and b in double-double, without the
//! square root that the sphere's other rays need.
//!
//! With B = b as a pair, ε = A·C/B²: the root next to the origin is −C/2B·2/(1 + √(1 − ε)), and the two roots add up to
//! −2B/A. docs/numerics.md §5, "Next to the origin".

use super::super::bound::{INFLATE, U, UNDERFLOW};
use super::super::cpu;
use super::super::eft::{Fused, Product, Split, quick_two_sum, two_diff, two_sum};
use super::super::float::power;
use super::super::pair::{Pair, close_dot, plain_dot, taxicab};
use super::super::section::{FINE, Undecided};
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::{DVec2, DVec3};

/// A ray starts next to the sphere if |A·C| ≤ this·A·r².
pub(super) const NEXT: f64 = power(-30);
/// It does not graze the sphere there if |ε| is at most this.
const STEEP: f64 = power(-20);
/// |error of C in plain arithmetic| ≤ this·r².
const PLAIN_C: f64 = 8.0 * U;
/// |error of b in plain arithmetic| ≤ this·r·|d|₁.
const PLAIN_B: f64 = 8.0 * U;
/// |error of C in double-double| ≤ this·r².
const CLOSE_C: f64 = 32.0 * U * U;
/// A product of floats at least this large is a sum of two floats.
const EXACT: f64 = power(-900);
/// |error of the near root, beside what C's brings| ≤ this·|λ|.
const NEAR_ROOT: f64 = U / 64.0;
/// |error of the far root, beside the near one's| ≤ this·r·|d|₁/A.
const FAR_ROOT: f64 = 256.0 * U * U;

/// Whether plain arithmetic is certain that the near root lies behind the origin: what is left then is the far root
/// if b is below zero, none if it is not. So it is with rays that were spawned where a ray left the sphere.
#[inline(always)]
pub(super) fn is_behind(f: DVec3, d: DVec3, b: f64, r: f64) -> bool {
    let c = plain_dot(f, f) - r * r;
    (c * b > 0.0) & (c.abs() > PLAIN_C * (r * r)) & (b.abs() > PLAIN_B * (r * taxicab(d)))
}

/// Whether plain arithmetic is certain that a ray starts outside, next to the sphere, and moves away from it, or, if
/// not `outward`, that it starts inside.
#[inline(always)]
pub(super) fn is_leaving(ray: &Ray, center: DVec3, r: f64, outward: bool) -> bool {
    let (f, d) = (ray.origin - center, ray.direction);
    let (b, c, r2) = (plain_dot(f, d), plain_dot(f, f) - r * r, r * r);
    let next = super::is_ordinary(f, d, r) & (c.abs() <= NEXT * r2);
    let away = (c > PLAIN_C * r2) & (b > PLAIN_B * (r * taxicab(d)));
    next & if outward { away } else { c < -PLAIN_C * r2 }
}

/// The nearest hit inside `within`. The ray is ordinary, D is certainly positive, |A·C| ≤ [`NEXT`]·A·r². Scalars, so
/// that the caller's vectors stay in registers.
#[inline(never)]
pub(super) fn intersect(ray: &Ray, x: f64, y: f64, z: f64, r: f64, min: f64, max: f64) -> Option<Hit> {
    // Captured in this order: coordinates side by side would be loaded as a vector just after they were stored one by
    // one, and wait for that.
    cpu::dispatch(
        #[inline(always)]
        move || ahead::<Fused>(ray, x, r, y, min, z, max),
        #[inline(always)]
        move || ahead::<Split>(ray, x, r, y, min, z, max),
    )
}

/// λ ≥ 0 only, as mostly asked for, and C from double-double.
#[inline(always)]
fn ahead<P: Product>(ray: &Ray, x: f64, r: f64, y: f64, min: f64, z: f64, max: f64) -> Option<Hit> {
    let (f, d, within) = (Pair::difference(ray.origin, DVec3::new(x, y, z)), ray.direction, Interval { min, max });
    let c = Excess::or_zero::<P>(&f, r);
    let roots = Roots::new::<P>(&f, d, &c);
    if (within.min >= 0.0) & roots.known {
        // The near root lies behind the origin if C has the sign of b, on it if C is zero; the far one if b is above
        // zero.
        let root = if c.hi * roots.b >= 0.0 {
            if roots.b > 0.0 {
                return None;
            }
            roots.far::<P>(&c, d, r)
        } else {
            roots.near::<P>(&c)
        };
        match root.place(ray, r, within) {
            Place::Inside(hit) => return Some(hit),
            Place::Beyond => return None,
            Place::Before | Place::Unknown => {}
        }
    }
    again(ray, x, y, z, r, within.min, within.max)
}

/// Any interval, and C however small: as well known as it is for λ ≥ 0, if that will do, so that λ is the same.
#[cold]
#[inline(never)]
fn again(ray: &Ray, x: f64, y: f64, z: f64, r: f64, min: f64, max: f64) -> Option<Hit> {
    let (f, within) = (Pair::difference(ray.origin, DVec3::new(x, y, z)), Interval { min, max });
    let answer = in_order(&f, ray, r, &Excess::or_zero::<Split>(&f, r), within);
    answer
        .or_else(|Undecided| in_order(&f, ray, r, &Excess::closer(&f, r), within))
        .unwrap_or_else(|Undecided| super::refine(ray, x, y, z, r, min, max))
}

fn in_order(f: &Pair, ray: &Ray, r: f64, c: &Excess, within: Interval) -> Result<Option<Hit>, Undecided> {
    let roots = Roots::new::<Split>(f, ray.direction, c);
    if !roots.known {
        return Err(Undecided);
    }
    let (near, far) = (roots.near::<Split>(c), roots.far::<Split>(c, ray.direction, r));
    first_inside(if roots.b > 0.0 { [far, near] } else { [near, far] }, ray, r, within)
}

/// The first of two roots in order that lies inside `within`.
#[inline(always)]
pub(super) fn first_inside(roots: [Root; 2], ray: &Ray, r: f64, within: Interval) -> Result<Option<Hit>, Undecided> {
    for root in roots {
        match root.place(ray, r, within) {
            Place::Inside(hit) => return Ok(Some(hit)),
            Place::Beyond => return Ok(None),
            Place::Before => {}
            Place::Unknown => return Err(Undecided),
        }
    }
    Ok(None)
}

/// Where a root lies against an interval.
enum Place {
    Before,
    Inside(Hit),
    Beyond,
    Unknown,
}

/// λ = hi + lo to within `rest`.
pub(super) struct Root {
    pub(super) hi: f64,
    pub(super) lo: f64,
    pub(super) rest: f64,
}

impl Root {
    #[inline(always)]
    fn place(&self, ray: &Ray, r: f64, within: Interval) -> Place {
        let (lambda, error) = (self.hi, (self.lo.abs() + self.rest) * INFLATE);
        // What is promised: the last bit, or that of 2⁻⁴⁰ of the coordinates. Mostly the radius is large enough.
        let fine = |size: f64| self.rest * (1.75 * taxicab(ray.direction)) <= 0.5 * U * FINE * size;
        let known = (self.rest <= 0.4 * U * lambda.abs()) || fine(r);
        if !known {
            Place::Unknown
        } else if (lambda - error > within.min) & (lambda + error < within.max) {
            Place::Inside(Hit { lambda, error, uv: DVec2::ZERO, part: 0 })
        } else if lambda - error > within.max {
            Place::Beyond
        } else if (lambda + error < within.min) | (error == 0.0) & (lambda <= within.min) {
            Place::Before
        } else {
            Place::Unknown
        }
    }
}

/// What both roots are made of.
pub(super) struct Roots {
    b: f64,
    b_lo: f64,
    /// 1/2b
    half: f64,
    epsilon: f64,
    /// C's sign is certain and the ray does not graze: then b's is too.
    known: bool,
}

/// C = |f|² − r² as hi + lo, off by at most `error`.
pub(super) struct Excess {
    hi: f64,
    lo: f64,
    error: f64,
}

impl Excess {
    pub(super) const ZERO: Self = Self { hi: 0.0, lo: 0.0, error: 0.0 };

    #[inline(always)]
    fn new<P: Product>(f: &Pair, r: f64) -> Self {
        let (hi, lo) = f.squared_less_pair::<P>(r);
        Self { hi, lo, error: CLOSE_C * (r * r) }
    }

    /// As [`Excess::new`], and exactly zero if it is that.
    #[inline(always)]
    fn or_zero<P: Product>(f: &Pair, r: f64) -> Self {
        let c = Self::new::<P>(f, r);
        if c.hi.abs() <= c.error && Self::is_zero::<P>(f, r) { Self::ZERO } else { c }
    }

    /// Zero on the sphere: whether it is that, for certain.
    #[inline(always)]
    pub(super) fn is_zero<P: Product>(f: &Pair, r: f64) -> bool {
        let square = |x: f64| P::two_product(x, x);
        let ((x, x_lo), (y, y_lo), (z, z_lo), (r2, r_lo)) = (square(f.hi.x), square(f.hi.y), square(f.hi.z), square(r));
        let ((s, s_lo), (t, t_lo)) = (two_sum(x, y), two_diff(z, r2));
        let ((g, g_lo), (h, h_lo), (i, i_lo)) = (two_sum(s_lo, t_lo), two_sum(x_lo, y_lo), two_diff(z_lo, r_lo));
        let (j, j_lo) = two_sum(g, h);
        let ((k, k_lo), (sum, sum_lo)) = (two_sum(j, i), two_sum(s, t));
        let dropped = g_lo.abs() + h_lo.abs() + i_lo.abs() + j_lo.abs() + k_lo.abs() + sum_lo.abs();
        let exact = |x: f64, square: f64| (x == 0.0) | (square >= EXACT);
        let squares = exact(f.hi.x, x) & exact(f.hi.y, y) & exact(f.hi.z, z) & (f.lo == DVec3::ZERO);
        squares & (dropped == 0.0) & (sum == -k)
    }

    /// With what the sums and products of the other round away: zero on the sphere, for certain.
    fn closer(f: &Pair, r: f64) -> Self {
        let Pair { hi: h, lo: l } = *f;
        let (h2, mut parts, mut lost) = (2.0 * h, [0.0; 20], 0.0);
        let products = [
            [(h.x, h.x), (h.y, h.y), (h.z, h.z), (r, -r), (h2.x, l.x)],
            [(h2.y, l.y), (h2.z, l.z), (l.x, l.x), (l.y, l.y), (l.z, l.z)],
        ];
        for (&(a, b), parts) in products.as_flattened().iter().zip(parts.as_chunks_mut().0) {
            let (p, rounded) = Split::two_product(a, b);
            *parts = [p, rounded];
            if p.abs() < EXACT && a != 0.0 && b != 0.0 {
                lost = UNDERFLOW;
            }
        }
        for _ in 0..2 {
            for i in 1..parts.len() {
                (parts[i], parts[i - 1]) = two_sum(parts[i], parts[i - 1]);
            }
        }
        let [rest @ .., sum] = &parts;
        let (hi, lo) = two_sum(*sum, rest.iter().sum());
        let size: f64 = rest.iter().map(|x| x.abs()).sum();
        Self { hi, lo, error: 32.0 * U * size + lost }
    }
}

impl Roots {
    #[inline(always)]
    pub(super) fn new<P: Product>(f: &Pair, d: DVec3, c: &Excess) -> Self {
        let (b, b_lo) = f.dot_float::<P>(d);
        let (b, b_lo) = quick_two_sum(b, b_lo);
        let half = 0.5 / b;
        let epsilon = plain_dot(d, d) * (c.hi * (4.0 * (half * half)));
        let certain = (c.hi.abs() > c.error) | (c.error == 0.0);
        Self { b, b_lo, half, epsilon, known: certain & (epsilon.abs() <= STEEP) }
    }

    /// −C/2b, and in proportion 2/(1 + √(1 − ε)) − 1 = ε/4 + ε²/8 + … more.
    #[inline(always)]
    fn first(&self, c: &Excess) -> (f64, f64) {
        (-c.hi * self.half, self.epsilon * (0.25 + 0.125 * self.epsilon))
    }

    #[inline(always)]
    pub(super) fn near<P: Product>(&self, c: &Excess) -> Root {
        let (&Self { b, b_lo, half, .. }, (first, more)) = (self, self.first(c));
        // One step of the division.
        let rest = P::remainder(-c.hi, first, 2.0 * b) - (c.lo + 2.0 * (first * b_lo));
        let (hi, lo) = two_sum(first, rest * half + first * more);
        // Zero is that of no sign.
        Root { hi: hi + 0.0, lo, rest: 1.01 * (c.error * half.abs()) + NEAR_ROOT * hi.abs() }
    }

    /// −2b/A less the near one.
    #[inline(always)]
    pub(super) fn far<P: Product>(&self, c: &Excess, d: DVec3, r: f64) -> Root {
        let (&Self { b, b_lo, half, .. }, (near, more)) = (self, self.first(c));
        let (a, a_lo) = close_dot::<P>(d, d);
        let inverse = 1.0 / a;
        let first = -2.0 * (b * inverse);
        let rest = P::remainder(-2.0 * b, first, a) - (2.0 * b_lo + first * a_lo);
        let (hi, lo) = two_sum(first, rest * inverse - (near + near * more));
        let rest = FAR_ROOT * (r * taxicab(d) * inverse) + 1.01 * (c.error * half.abs()) + 8.0 * U * near.abs();
        Root { hi, lo, rest }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::dyadic::Dyadic;
    use super::super::super::search::{Rational, climb, dot3, each, exact, minus};
    use super::super::super::tally::Tally;
    use super::*;

    /// A ray that starts within 2⁻³⁰ radii of a sphere, mostly within a few ulps.
    fn setting(x: &[f64]) -> Option<(Ray, DVec3, f64)> {
        let (center, d) = (DVec3::new(x[6], x[7], x[8]) * 2f64.powf(8.0 * x[9]), DVec3::new(x[3], x[4], x[5]));
        let origin = center + DVec3::new(x[0], x[1], x[2]);
        let gap = 2f64.powf(-44.0 + 13.0 * x[10]) * x[11];
        let r = (origin - center).length() * (1.0 + if gap.abs() < 2f64.powi(-50) { 0.0 } else { gap });
        let (f, a) = (origin - center, plain_dot(d, d));
        let (value, error) = super::super::discriminant(f, d, r);
        let b = plain_dot(f, d);
        let next = super::super::is_ordinary(f, d, r) && value > error && (b * b - value).abs() <= NEXT * (a * r * r);
        next.then_some((Ray { origin, direction: d }, center, r))
    }

    fn rational(x: f64) -> Rational {
        Rational::try_from(x).unwrap()
    }

    /// A, b, C.
    fn polynomial(ray: &Ray, center: DVec3, r: f64) -> [Rational; 3] {
        let (f, d, r) = (minus(ray.origin, center), exact(ray.direction), rational(r));
        [dot3(&d, &d), dot3(&f, &d), dot3(&f, &f) - &r * &r]
    }

    #[test]
    fn no_input_reaches_the_bounds() {
        let ratio = |off: Rational, bound: f64| Some((off.to_f64().value() / bound).abs());
        let worst = climb("sphere, start: C, b in plain", 12, |x| {
            let (ray, center, r) = setting(x)?;
            let (f, d) = (ray.origin - center, ray.direction);
            let [_, b, c] = polynomial(&ray, center, r);
            let off_c = ratio(c - rational(plain_dot(f, f) - r * r), PLAIN_C * (r * r))?;
            Some(off_c.max(ratio(b - rational(plain_dot(f, d)), PLAIN_B * (r * taxicab(d)))?))
        });
        assert!((0.05..1.0).contains(&worst));
        let worst = climb("sphere, start: C", 12, |x| {
            let (ray, center, r) = setting(x)?;
            let c = Excess::new::<Split>(&Pair::difference(ray.origin, center), r);
            let [.., exact] = polynomial(&ray, center, r);
            ratio(exact - rational(c.hi) - rational(c.lo), c.error)
        });
        assert!((0.02..1.0).contains(&worst));
        // Hardly anything is left out, and little is known of that: far less than of C in double-double.
        let worst = climb("sphere, start: C, closer", 12, |x| {
            let (ray, center, r) = setting(x)?;
            let c = Excess::closer(&Pair::difference(ray.origin, center), r);
            let [.., exact] = polynomial(&ray, center, r);
            let off = exact - rational(c.hi) - rational(c.lo);
            assert!(c.error <= power(-40) * CLOSE_C * (r * r) + 64.0 * U * U * c.hi.abs());
            if off.is_zero() { Some(0.0) } else { ratio(off, c.error) }
        });
        assert!(worst < 1.0);
        // The whole bound, C's share included, and the part of it that is not C's: C as it is, exactly.
        for (name, far, sharp) in [
            ("sphere, start: near λ", false, false),
            ("sphere, start: near λ but for C", false, true),
            ("sphere, start: far λ", true, false),
        ] {
            let worst = climb(name, 12, |x| {
                let (ray, center, r) = setting(x)?;
                let (f, d) = (Pair::difference(ray.origin, center), ray.direction);
                let mut c = Excess::new::<Split>(&f, r);
                let roots = Roots::new::<Split>(&f, d, &c);
                let [a, b, mut cc] = polynomial(&ray, center, r);
                if !roots.known {
                    return None;
                }
                if sharp {
                    c.error = 0.0;
                    cc = rational(c.hi) + rational(c.lo);
                }
                let Root { hi, lo, rest } = if far { roots.far::<Split>(&c, d, r) } else { roots.near::<Split>(&c) };
                let l = rational(hi) + rational(lo);
                let off = ((&a * &l + &b + &b) * &l + cc) / (Rational::from(2) * (a * l + b));
                ratio(off, rest)
            });
            assert!((0.002..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    /// Answers are the exact tier's, whatever the interval; few rays need it.
    #[test]
    fn rays_next_to_the_sphere_are_answered_as_exactly_as_others() {
        use super::super::{decide, fast};
        let (mut rays, mut hits, mut cold) = (0, 0, 0);
        each(60_000, 12, |x| {
            let Some((ray, center, r)) = setting(x) else { return };
            let limit = x[0] * 2f64.powf(-30.0 + 30.0 * x[1]);
            for within in [Interval::FORWARD, Interval::LINE, Interval { min: limit.abs(), max: 1.0 }] {
                rays += 1;
                let before = Tally::now();
                let fused = fast::<Fused>(&ray, center, r, within);
                cold += Tally::now().since(before).refined;
                assert_eq!(fused, fast::<Split>(&ray, center, r, within));
                let exact = decide::<Dyadic>(&ray, center, r, within).unwrap();
                assert_eq!(fused.is_some(), exact.is_some(), "{ray:?} {center} {r:e} {within:?}");
                if let (Some(hit), Some(exact)) = (fused, exact) {
                    hits += 1;
                    assert!((hit.lambda - exact.lambda).abs() <= hit.error + exact.error);
                }
            }
        });
        println!("{rays} rays that start next to a sphere, {hits} hits, {cold} refined");
        assert!(rays > 50_000 && 3 * hits > rays && 20 * cold < rays);
    }

    /// Whether a ray has left is told in plain arithmetic, mostly, and as exactly as otherwise.
    #[test]
    fn what_is_certain_of_leaving_is_true() {
        use super::super::{departs, intersect, side};
        let (mut certain, mut departed) = ([0; 2], [0; 2]);
        each(40_000, 12, |x| {
            let Some((ray, center, r)) = setting(x) else { return };
            let from = side(ray.origin, center, r);
            let misses = intersect(&ray, center, r, Interval::FORWARD).is_none();
            for (outward, exactly) in [(true, from.is_gt() && misses), (false, from.is_lt())] {
                assert_eq!(departs(&ray, center, r, outward), exactly, "{ray:?} {center} {r:e}");
                let quick = is_leaving(&ray, center, r, outward);
                assert!(exactly || !quick, "{ray:?} {center} {r:e}");
                certain[usize::from(outward)] += usize::from(quick);
                departed[usize::from(outward)] += usize::from(exactly);
            }
        });
        println!("{certain:?} certain (inward, outward) of {departed:?} that leave a sphere");
        assert!(certain.iter().zip(departed).all(|(&n, all)| n > 5_000 && 3 * n > 2 * all));
    }

    /// However little a point is off the sphere, it is not on it.
    #[test]
    fn next_to_the_sphere_is_not_on_it() {
        let on = |x: f64, y: f64, z: f64, r: f64| {
            let f = Pair { hi: DVec3::new(x, y, z), lo: DVec3::ZERO };
            let is = [Excess::is_zero::<Fused>(&f, r), Excess::is_zero::<Split>(&f, r)];
            assert_eq!(is[0], is[1]);
            is[0]
        };
        for r in [1.0, 1.0 + 2.0 * U, 1e70, 0.1] {
            assert!(on(0.0, r, 0.0, r) && on(0.0, 0.0, -r, r));
            for e in 0..1070 {
                let t = r * power(-(e.min(537))) * power(-(e - e.min(537)));
                assert!(!on(t, 0.0, r, r) && !on(r, t, 0.0, r) && !on(0.0, -r, t, r) && !on(t, -t, r, r), "{r} {e}");
            }
        }
    }

    /// On the sphere exactly: zero is found without integers.
    #[test]
    fn origins_exactly_on_the_sphere() {
        let (mut rays, before) = (0, Tally::now());
        each(20_000, 6, |x| {
            let (d, s) = (DVec3::new(x[0], x[1], x[2]), 2f64.powf(20.0 * x[3]));
            let radius = if x[4] > 0.0 { s } else { 7.0 * 2f64.powi((9.0 * x[3]) as i32) };
            let origin = if x[4] > 0.0 { DVec3::Y * s } else { radius / 7.0 * DVec3::new(2.0, -3.0, 6.0) };
            let (ray, inward) = (Ray { origin, direction: d }, d.dot(origin));
            if inward.abs() < 1e-2 * radius * d.length() {
                return;
            }
            rays += 1;
            let hit = super::super::intersect(&ray, DVec3::ZERO, radius, Interval::FORWARD);
            assert_eq!(hit.is_some(), inward < 0.0);
            let both = super::super::intersect(&ray, DVec3::ZERO, radius, Interval { min: -1e-9, max: 1e-9 }).unwrap();
            assert_eq!((both.lambda.to_bits(), both.error), (0, 0.0));
        });
        let counted = Tally::now().since(before);
        println!("{rays} rays from exactly on a sphere, {counted:?}");
        assert!(rays > 10_000 && counted == Tally::default());
    }
}
