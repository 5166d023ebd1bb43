//! The fast path: the signs that tell where a line enters and leaves, each with a bound, then one Newton step.
//!
//! docs/numerics.md §6 derives every constant.

use super::{BASE, TOP, WALL, refine};
use crate::hit::Hit;
use crate::interval::Interval;
use crate::kernel::bound::{U, UNDERFLOW};
use crate::kernel::eft::{Product, two_diff, two_sum};
use crate::kernel::float::power;
use crate::kernel::pair::{Pair, in_range, plain_cross, plain_dot, taxicab};
use crate::ray::Ray;
use glam::{DVec2, DVec3};

// Bounds of the signs' errors, with |·|₁ lengths d, v, x, size = x + v + r₀ + r₁, X = d·v·size, Y = (v + |Δr|)·X.
/// d·v: this·d·v.
const RATE: f64 = 4.5 * U;
/// r²(d·v)² − |w × v|²: u·X·(20·r|d·v| + 256u·X).
const CROSSING: [f64; 2] = [20.0 * U, 256.0 * U * U];
/// A: this·(h² + Δr²)·(d·v)².
const LEADING: f64 = 32.0 * U;
/// D/h⁴: u·Y·(66·v·|g|₁ + 640u·Y).
const DISCRIMINANT: [f64; 2] = [66.0 * U, 640.0 * U * U];
/// The slopes at the caps' planes: this·d·v·Y.
const TURN: f64 = 32.0 * U;

// Bounds of the residuals' errors.
/// Of a cap's plane: this·v·size.
const PLANE_RESIDUAL: f64 = 128.0 * U * U;
/// Of the wall, |q|² − R²: this[0]·(|q|₁·(x + |s|·v + |q|₁) + R²) + this[1]·R·size·|Δr|·v/h², besides what q is off the
/// perpendicular.
const WALL_RESIDUAL: [f64; 2] = [72.0 * U * U, 300.0 * U * U];
/// Of the wall's slope: this·d·(|q|₁ + R·|Δr|·v/h²).
const SLOPE: f64 = 24.0 * U;

/// λ = `lambda` + `lo` to within `rest`; a `rest` of NaN where nothing is proved.
#[derive(Clone, Copy)]
struct Solved {
    lambda: f64,
    lo: f64,
    rest: f64,
}

/// The same bits for either [`Product`].
#[inline(always)]
pub(super) fn intersect<P: Product>(
    ray: &Ray,
    base: DVec3,
    top: DVec3,
    r0: f64,
    r1: f64,
    within: Interval,
) -> Option<Hit> {
    let (o, d) = (ray.origin, ray.direction);
    let cold = || refine(ray, &base, &top, r0, r1, within.min, within.max);
    let (x, y, v) = (Pair::difference(o, base), Pair::difference(o, top), Pair::difference(top, base));
    let growth = r1 - r0;
    let (dl, vl) = (taxicab(d), taxicab(v.hi));
    let size = taxicab(x.hi) + vl + (r0 + r1);
    let scale = dl * vl * size;
    let rate = plain_dot(d, v.hi);
    let w = plain_cross(x.hi, d);
    let n = plain_cross(d, v.hi);
    let w1 = w + n;
    let ((at_base, base_error), (at_top, top_error)) =
        (crossing(w, v.hi, r0, rate, scale), crossing(w1, v.hi, r1, rate, scale));
    // NaN fails every one of these.
    let ordinary = in_range(dl, 100) & in_range(vl, 100) & (size < TOO_LARGE) & (r0 >= 0.0) & (r1 >= 0.0);
    let told = (at_base.abs() > base_error) & (at_top.abs() > top_error) & (rate.abs() > RATE * dl * vl);
    let across = rate == 0.0 && ordinary && is_across::<P>(d, &v);
    if !(ordinary & (told | across)) {
        return cold();
    }
    let h2 = plain_dot(v.hi, v.hi);
    let on_wall = !across & (at_base < 0.0) & (at_top < 0.0);
    let slope = growth * rate;
    let [(leading, leading_error), (discriminant, discriminant_error)] =
        wall_signs(w, n, v.hi, r0, growth, rate, dl * vl, scale);
    if on_wall {
        let [(from_base, turn_error), (from_top, _)] = turns(w, n, v.hi, [r0, r1], growth, rate, dl, scale);
        if (discriminant < -discriminant_error)
            | (leading < -leading_error)
            | (from_base > turn_error)
            | (from_top < -turn_error)
        {
            return None;
        }
        let hits = (discriminant > discriminant_error)
            & (leading > leading_error)
            & (from_base < -turn_error)
            & (from_top > turn_error);
        if !hits {
            return cold();
        }
    }
    if across {
        // A chord of one circle: between the caps' planes, and near enough to the axis.
        let (above, below) = (plain_dot(x.hi, v.hi), plain_dot(y.hi, v.hi));
        let error = HEIGHT * vl * (size + taxicab(y.hi));
        if (above < -error) | (below > error) | (discriminant < -discriminant_error) {
            return None;
        }
        if !((above > error) & (below < -error) & (discriminant > discriminant_error)) {
            return cold();
        }
    }
    let over_h2 = 1.0 / h2;
    let wall = |turn: f64| {
        let m = plain_cross(x.hi, v.hi);
        let radius = r0 * h2 + growth * plain_dot(x.hi, v.hi);
        let b = h2 * plain_dot(m, n) - radius * slope;
        // A rounded negative one is a tangent; what comes of it is checked below.
        let root = h2 * (if discriminant > 0.0 { discriminant } else { 0.0 }).sqrt();
        let q = b.abs() + root;
        let first = if b * turn > 0.0 {
            let c = h2 * plain_dot(m, m) - radius * radius;
            -turn * c / q
        } else {
            turn * q / leading
        };
        wall_step::<P>(first, turn, &x, &v, d, [r0, r1, growth], [dl, vl, size, rate, over_h2])
    };
    let plane = |from: &Pair| plane_step::<P>(from, &v, d, rate, dl * vl, vl * size);
    let forward = rate > 0.0;
    let (first, last) = if forward { ((at_base, BASE), (at_top, TOP)) } else { ((at_top, TOP), (at_base, BASE)) };
    for ((crossing, part), turn) in [(first, -1.0), (last, 1.0)] {
        let on_cap = !across & (crossing > 0.0);
        let Solved { lambda, lo, rest } = if on_cap { plane(if part == BASE { &x } else { &y }) } else { wall(turn) };
        let error = (lo.abs() + rest) * (1.0 + 8.0 * U);
        if lambda + error < within.min {
            continue;
        }
        if lambda - error > within.max {
            return None;
        }
        let inside = (lambda - error > within.min) & (lambda + error < within.max);
        let sharp = (rest <= U * lambda.abs()) | (rest <= size / dl * FLOOR);
        if inside & sharp {
            return Some(Hit { lambda, error, uv: DVec2::ZERO, part: if on_cap { part } else { WALL } });
        }
        return cold();
    }
    None
}

/// Whether d·v is zero, exactly, as it is where both lie along axes. May say no where it is.
#[cold]
#[inline(never)]
fn is_across<P: Product>(d: DVec3, v: &Pair) -> bool {
    let product = |a: f64, b: f64| {
        let (p, p_lo) = P::two_product(a, b);
        // Nothing is lost below the range.
        ((p.abs() > SMALL) | (a == 0.0) | (b == 0.0), p, p_lo)
    };
    let products = [product(d.x, v.hi.x), product(d.y, v.hi.y), product(d.z, v.hi.z)];
    let [(_, x, _), (_, y, _), (_, z, _)] = products;
    let (xy, rounding) = two_sum(x, y);
    v.lo == DVec3::ZERO && products.iter().all(|p| p.0 && p.2 == 0.0) && rounding == 0.0 && xy + z == 0.0
}

/// The rounding error of a product above this is a float.
const SMALL: f64 = power(-900);

/// r²(d·v)² − |w × v|² and a bound on its error: whether the line with that moment about a cap's centre crosses the
/// cap's plane inside its circle.
#[inline(always)]
fn crossing(moment: DVec3, v: DVec3, r: f64, rate: f64, scale: f64) -> (f64, f64) {
    let reach = r * rate;
    let across = plain_cross(moment, v);
    let value = reach * reach - plain_dot(across, across);
    (value, scale * (CROSSING[0] * reach.abs() + CROSSING[1] * scale))
}

/// A and D/h⁴ with bounds on their errors.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn wall_signs(w: DVec3, n: DVec3, v: DVec3, r0: f64, growth: f64, rate: f64, dv: f64, scale: f64) -> [(f64, f64); 2] {
    let (h2, vl) = (plain_dot(v, v), taxicab(v));
    let wide = (vl + growth.abs()) * scale;
    let g = r0 * n - growth * w;
    let (vw, slope) = (plain_dot(v, w), growth * rate);
    let spread = h2 + growth * growth;
    [
        (h2 * plain_dot(n, n) - slope * slope, LEADING * spread * (dv * dv)),
        (
            h2 * plain_dot(g, g) - spread * (vw * vw),
            wide * (DISCRIMINANT[0] * vl * taxicab(g) + DISCRIMINANT[1] * wide),
        ),
    ]
}

/// The slopes of the wall's polynomial at the planes of base and top, times d·v/h², with bounds on their errors.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn turns(w: DVec3, n: DVec3, v: DVec3, r: [f64; 2], growth: f64, rate: f64, dl: f64, scale: f64) -> [(f64, f64); 2] {
    let (h2, vl) = (plain_dot(v, v), taxicab(v));
    let error = TURN * dl * vl * ((vl + growth.abs()) * scale);
    let turn = |w: DVec3, r: f64| (h2 * plain_dot(n, w) - growth * r * (rate * rate), error);
    [turn(w, r[0]), turn(w + n, r[1])]
}

/// (from a cap's centre)·v: this·v·(that one's distance + size).
const HEIGHT: f64 = 8.0 * U;
/// λ need not be better known than to 4u·2⁻⁴⁰ of the largest coordinate over the direction's length; that is `size`/14
/// or more over d. Rays that begin on the solid are behind such a λ.
const FLOOR: f64 = 4.0 * U / (14.0 * (1u64 << 40) as f64);
/// Lengths stay below this, so that forms of degree eight do not overflow.
const TOO_LARGE: f64 = (1u128 << 100) as f64;

/// One step from the rounded λ of a plane through `from`'s foot, perpendicular to v.
#[inline(always)]
fn plane_step<P: Product>(from: &Pair, v: &Pair, d: DVec3, rate: f64, dv: f64, reach: f64) -> Solved {
    let over_rate = 1.0 / rate;
    let first = -plain_dot(from.hi, v.hi) * over_rate;
    let (t, t_lo) = from.moved::<P>(first, d).dot::<P>(v);
    let step = -(t + t_lo) * over_rate;
    let (lambda, lo) = two_sum(first, step);
    let over = over_rate.abs();
    let rest = (PLANE_RESIDUAL * reach + UNDERFLOW) * over + step.abs() * (1.1 * RATE * dv * over + 4.0 * U);
    Solved { lambda, lo, rest }
}

/// One Newton step towards the root at which the wall's polynomial rises (`turn` 1) or falls (−1), from any λ near it.
///
/// With s a float near the foot's height, q = p − s·v and R the radius at the exact height: the residual |q|² − R².
#[inline(always)]
fn wall_step<P: Product>(
    first: f64,
    turn: f64,
    x: &Pair,
    v: &Pair,
    d: DVec3,
    [r0, r1, growth]: [f64; 3],
    [dl, vl, size, rate, over_h2]: [f64; 5],
) -> Solved {
    let p = x.moved::<P>(first, d);
    let s = plain_dot(p.hi, v.hi) * over_h2;
    let q = p.moved::<P>(-s, v.hi);
    let q = Pair { hi: q.hi, lo: q.lo - s * v.lo };
    let rounded = q.hi + q.lo;
    let (height, radius, radius_lo) = if growth == 0.0 {
        (plain_dot(rounded, v.hi) * over_h2, r0, 0.0)
    } else {
        let (qv, qv_lo) = q.dot::<P>(v);
        let height = (qv + qv_lo) * over_h2;
        // r₀ + Δr·(s + height)
        let (k, k_lo) = two_diff(r1, r0);
        let (grown, grown_lo) = P::two_product(k, s);
        let (radius, radius_lo) = two_sum(r0, grown);
        (height, radius, radius_lo + (grown_lo + (k * height + k_lo * s)))
    };
    let residual = q.squared_less::<P>(radius, radius_lo);
    let growth_rate = growth * rate * over_h2;
    let slope = plain_dot(rounded, d) - height * rate - (radius + radius_lo) * growth_rate;
    let half = 0.5 / slope;
    let step = -residual * half;
    let (lambda, lo) = two_sum(first, step);
    // What is not known.
    let (off, steep) = (taxicab(rounded), growth.abs() * vl * over_h2);
    let askew = height.abs() * vl + 16.0 * U * off;
    let (reach, grown) = (taxicab(x.hi) + s.abs() * vl + off, radius.abs() * (steep * size));
    let rounding = WALL_RESIDUAL[0] * (off * reach + radius * radius) + WALL_RESIDUAL[1] * grown;
    let residual_error = rounding + askew * askew + UNDERFLOW;
    let slope_error = SLOPE * dl * (off + radius.abs() * steep) + UNDERFLOW;
    let bend = dl * dl + growth_rate * growth_rate;
    let (half, step) = (half.abs(), step.abs());
    let rest = half * (residual_error + 1.3 * bend * (step * step)) + step * (2.2 * half * slope_error + 8.0 * U);
    // The step must be small against the bend, and the slope known, and of the right sign.
    let proved = (32.0 * bend * step * half < 1.0) & (128.0 * slope_error * half < 1.0) & (slope * turn > 0.0);
    Solved { lambda, lo, rest: if proved { rest } else { f64::NAN } }
}

#[cfg(test)]
mod tests {
    use super::super::super::search::{Rational, climb, cross3, dot3, each, exact, minus};
    use super::super::{Solid, intersect as answer};
    use super::*;
    use crate::kernel::eft::{Fused, Split};
    use crate::kernel::tally::Tally;

    /// Base, top, radii and a ray from near or far, with few relations or near-ties between them.
    fn setting(x: &[f64]) -> (Ray, Solid) {
        let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
        let base = v(0);
        let top = base + v(3) * 2f64.powf(4.0 * x[14]);
        let base_radius = x[12].abs();
        let top_radius = if x[13] < -0.5 { base_radius } else { x[13].abs() };
        let direction = v(6);
        // A point of the wall or near it, and a way back from it.
        let s = x[15].abs();
        let across = direction.cross(top - base).normalize_or(DVec3::X);
        let radius = base_radius + s * (top_radius - base_radius);
        let near = base + s * (top - base) + across * radius * (1.0 - x[9].abs().powi(8)) + x[10].powi(5) * DVec3::Y;
        let origin = near - direction * 2f64.powf(5.0 + 5.0 * x[11]);
        (Ray { origin, direction }, Solid { base, top, base_radius, top_radius })
    }

    const DIMENSION: usize = 16;

    struct Rounded {
        x: Pair,
        y: Pair,
        v: Pair,
        w: DVec3,
        n: DVec3,
        rate: f64,
        growth: f64,
        dl: f64,
        vl: f64,
        size: f64,
    }

    fn rounded(ray: &Ray, solid: &Solid) -> Rounded {
        let x = Pair::difference(ray.origin, solid.base);
        let v = Pair::difference(solid.top, solid.base);
        let d = ray.direction;
        let vl = taxicab(v.hi);
        Rounded {
            y: Pair::difference(ray.origin, solid.top),
            w: plain_cross(x.hi, d),
            n: plain_cross(d, v.hi),
            rate: plain_dot(d, v.hi),
            growth: solid.top_radius - solid.base_radius,
            dl: taxicab(d),
            vl,
            size: taxicab(x.hi) + vl + (solid.base_radius + solid.top_radius),
            x,
            v,
        }
    }

    fn rational(x: f64) -> Rational {
        Rational::try_from(x).unwrap()
    }

    fn off(value: f64, exact: &Rational, bound: f64) -> f64 {
        ((exact - rational(value)).to_f64().value() / bound).abs()
    }

    /// For bounds that need only hold where value or exact value is not negative.
    fn off_inside(value: f64, exact: &Rational, bound: f64) -> Option<f64> {
        (value >= 0.0 || *exact >= Rational::ZERO).then(|| off(value, exact, bound))
    }

    #[test]
    fn no_input_reaches_the_bounds_of_the_signs() {
        // crossing, A, D, turn
        for (k, name) in ["crossing", "A", "D", "turn"].into_iter().enumerate() {
            let worst = climb(&format!("frustum: {name}"), DIMENSION, |t| {
                let (ray, solid) = setting(t);
                let r = rounded(&ray, &solid);
                let scale = r.dl * r.vl * r.size;
                let (v, d) = (minus(solid.top, solid.base), exact(ray.direction));
                let w = cross3(&minus(ray.origin, solid.top), &d);
                let base_w = cross3(&minus(ray.origin, solid.base), &d);
                let n = cross3(&d, &v);
                let (rate, h2) = (dot3(&d, &v), dot3(&v, &v));
                let (r0, r1) = (rational(solid.base_radius), rational(solid.top_radius));
                let growth = &r1 - &r0;
                let rate2 = &rate * &rate;
                match k {
                    0 => {
                        let (value, bound) = crossing(r.w + r.n, r.v.hi, solid.top_radius, r.rate, scale);
                        let across = cross3(&w, &v);
                        off_inside(value, &(&r1 * &r1 * rate2 - dot3(&across, &across)), bound)
                    }
                    3 => {
                        let radii = [solid.base_radius, solid.top_radius];
                        let (value, bound) = turns(r.w, r.n, r.v.hi, radii, r.growth, r.rate, r.dl, scale)[1];
                        Some(off(value, &(h2 * dot3(&n, &w) - growth * r1 * rate2), bound))
                    }
                    _ => {
                        let signs =
                            wall_signs(r.w, r.n, r.v.hi, solid.base_radius, r.growth, r.rate, r.dl * r.vl, scale);
                        let (value, bound) = signs[k - 1];
                        let growth2 = &growth * &growth;
                        if k == 1 {
                            Some(off(value, &(h2 * dot3(&n, &n) - growth2 * rate2), bound))
                        } else {
                            let g = [0, 1, 2].map(|i| &r0 * &n[i] - &growth * &base_w[i]);
                            let vw = dot3(&v, &base_w);
                            off_inside(value, &(&h2 * dot3(&g, &g) - (&h2 + growth2) * &vw * &vw), bound)
                        }
                    }
                }
            });
            assert!((0.003..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    #[test]
    fn no_input_reaches_the_bounds_of_the_steps() {
        // From a poor λ or from afar the square of the step is most of the error, else what the residual is off.
        let steps = [(0, "frustum: λ on a cap's plane"), (1, "frustum: λ on the wall"), (2, "frustum: λ next to it")];
        for (steps, name) in steps {
            let worst = climb(name, DIMENSION, |t| {
                let (ray, solid) = setting(t);
                let (r, d) = (rounded(&ray, &solid), ray.direction);
                let (x, v, ed) = (minus(ray.origin, solid.base), minus(solid.top, solid.base), exact(d));
                let (rate, h2) = (dot3(&ed, &v), dot3(&v, &v));
                let to_f64 = |q: Rational| q.to_f64().value();
                if steps == 0 {
                    if r.rate.abs() <= RATE * r.dl * r.vl {
                        return None;
                    }
                    let s = plane_step::<Split>(&r.y, &r.v, d, r.rate, r.dl * r.vl, r.vl * r.size);
                    let exact = -dot3(&minus(ray.origin, solid.top), &v) / rate;
                    return Some((to_f64(exact - rational(s.lambda) - rational(s.lo)) / s.rest).abs());
                }
                let (r0, r1) = (rational(solid.base_radius), rational(solid.top_radius));
                let growth = r1 - &r0;
                let (m, n) = (cross3(&x, &v), cross3(&ed, &v));
                let (radius, slope) = (r0 * &h2 + &growth * dot3(&x, &v), growth * rate);
                let a = &h2 * dot3(&n, &n) - &slope * &slope;
                let b = &h2 * dot3(&m, &n) - &radius * &slope;
                let c = &h2 * dot3(&m, &m) - &radius * &radius;
                let (fa, fb, fc) = (to_f64(a.clone()), to_f64(b.clone()), to_f64(c.clone()));
                let root = (fb * fb - fa * fc).max(0.0).sqrt();
                let turn = t[11].signum();
                let first = (turn * root - fb) / fa;
                if !first.is_finite() {
                    return None;
                }
                let vector = [solid.base_radius, solid.top_radius, r.growth];
                let over_h2 = 1.0 / plain_dot(r.v.hi, r.v.hi);
                let sizes = [r.dl, r.vl, r.size, r.rate, over_h2];
                let step = |from: f64| wall_step::<Split>(from, turn, &r.x, &r.v, d, vector, sizes);
                let mut s = step(first);
                if steps == 2 {
                    let from = s.lambda;
                    s = step(from);
                    if s.lambda != from || from.abs() * r.dl > 4.0 * (r.vl + solid.base_radius) {
                        return None;
                    }
                }
                if s.rest.is_nan() {
                    return None;
                }
                let lambda = rational(s.lambda) + rational(s.lo);
                let off = ((&a * &lambda + &b + &b) * &lambda + c) / (Rational::from(2) * (a * lambda + b));
                (s.rest <= U * s.lambda.abs()).then(|| (to_f64(off) / s.rest).abs())
            });
            assert!((0.003..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    #[test]
    fn ordinary_rays_hardly_ever_need_the_cold_path() {
        let (mut cases, mut hits, before) = (0, 0, Tally::now());
        each(400_000, DIMENSION, |x| {
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            let Some(u) = v(9).try_normalize() else { return };
            let (base, axis) = (5.0 * v(0), 4.0 * v(3));
            let base_radius = 2f64.powf(2.0 * x[12]);
            let top_radius = [base_radius, 0.0, 2.0 * x[13].abs()][cases % 3];
            let size = axis.length().max(base_radius).max(top_radius);
            let target = base + x[14].abs() * axis + 0.4 * v(6) * size;
            let ray = Ray { origin: target - u * size * (6.0 + 4.0 * x[15]), direction: u };
            cases += 1;
            hits += usize::from(answer(&ray, base, base + axis, base_radius, top_radius, Interval::FORWARD).is_some());
        });
        let cold = Tally::now().since(before).refined;
        println!("frustum: {cold} of {cases} ordinary rays, {hits} hits");
        assert!(cold * 10_000 < cases && hits * 3 > cases);
    }

    #[test]
    fn both_products_answer_with_the_same_bits() {
        let mut seen = [0; 2];
        each(10_000, DIMENSION, |t| {
            let (ray, s) = setting(t);
            let within = Interval::FORWARD;
            let answers = [
                intersect::<Fused>(&ray, s.base, s.top, s.base_radius, s.top_radius, within),
                intersect::<Split>(&ray, s.base, s.top, s.base_radius, s.top_radius, within),
            ];
            assert_eq!(answers[0], answers[1]);
            seen[usize::from(answers[0].is_some())] += 1;
        });
        println!("{seen:?} misses and hits");
        assert!(seen[0] > 500 && seen[1] > 1000);
    }
}
