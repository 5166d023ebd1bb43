//! Whether a ray leaves the solid that it starts next to, in plain arithmetic.
//!
//! The solid is where three functions of a point are not above zero: the heights beyond both caps' planes, and |q| − R,
//! with q the point's way from the axis and R the wall's radius at its height. The first two are linear along a ray,
//! the third is convex: one that is above zero and grows stays so. Where a sign is not certain the exact test has to
//! say: docs/numerics.md §11.

use super::Solid;
use crate::kernel::bound::{U, UNDERFLOW};
use crate::kernel::float::power;
use crate::kernel::pair::{in_range, plain_dot, taxicab};
use crate::ray::Ray;
use glam::DVec3;

/// |error of a dot product of which both vectors are rounded once| ≤ this·Σ|aᵢbᵢ|.
const PRODUCT: f64 = 6.0 * U;
/// |error of |q| − R| ≤ this[0]·(|x|₁ + m|v|₁) + this[1]·(|q| + R) + this[2]·|Δr|m, where m = Σ|xᵢvᵢ|/h².
const WALL: [f64; 3] = [3.0 * U, 5.0 * U, 16.0 * U];
/// |error of |q| times that one's slope| ≤ this·|d|₁·(|x|₁ + m|v|₁ + |q|)·(1 + |Δr||v|₁/h²).
const SLOPE: f64 = 32.0 * U;
/// Both hold where |q| is more than this part of |x|₁ + m|v|₁ + |q|.
const OFF_AXIS: f64 = power(-20);

/// A number and a bound on its error.
struct Known {
    value: f64,
    error: f64,
}

impl Known {
    #[inline(always)]
    fn is_above(&self) -> bool {
        self.value > self.error
    }

    #[inline(always)]
    fn is_below(&self) -> bool {
        self.value < -self.error
    }
}

/// Whether it is certain that the ray starts outside and never meets the solid, or, if not `outward`, that it starts
/// inside. All three surfaces are looked at: nothing foretells which one was left, and which way.
pub(super) fn is_certain(ray: &Ray, solid: &Solid, outward: bool) -> bool {
    let (o, d, v) = (ray.origin, ray.direction, solid.top - solid.base);
    let ordinary = in_range(taxicab(d), 100) & in_range(taxicab(v), 100);
    let (above_base, above_top) = (product(o - solid.base, v), product(o - solid.top, v));
    let (rate, [off_wall, slope]) = (product(d, v), wall(ray, solid));
    let inside = above_base.is_above() & above_top.is_below() & off_wall.is_below();
    let leaves = (above_base.is_below() & rate.is_below())
        | (above_top.is_above() & rate.is_above())
        | (off_wall.is_above() & slope.is_above());
    ordinary & if outward { leaves } else { inside }
}

/// a · b
#[inline(always)]
fn product(a: DVec3, b: DVec3) -> Known {
    Known { value: plain_dot(a, b), error: PRODUCT * plain_dot(a.abs(), b.abs()) + UNDERFLOW }
}

/// |q| − R at the ray's origin, and its slope along the ray, times |q|.
#[inline(always)]
fn wall(ray: &Ray, solid: &Solid) -> [Known; 2] {
    let (x, d, v) = (ray.origin - solid.base, ray.direction, solid.top - solid.base);
    let growth = solid.top_radius - solid.base_radius;
    let over_h2 = 1.0 / plain_dot(v, v);
    let (at, most) = (plain_dot(x, v) * over_h2, plain_dot(x.abs(), v.abs()) * over_h2);
    let q = x - at * v;
    let (from_axis, radius) = (plain_dot(q, q).sqrt(), solid.base_radius + growth * at);
    let (widened, reach) = (growth * over_h2, taxicab(x) + most * taxicab(v));
    let sizes = reach + from_axis;
    let known = in_range(from_axis, 100) & (from_axis > OFF_AXIS * sizes);
    let errors = [
        // What underflow takes from x·v is multiplied by Δr/h², which may be large.
        WALL[0] * reach
            + WALL[1] * (from_axis + radius.abs())
            + WALL[2] * (growth.abs() * most)
            + UNDERFLOW * widened.abs(),
        SLOPE * taxicab(d) * sizes * (1.0 + widened.abs() * taxicab(v)),
    ];
    let values = [from_axis - radius, plain_dot(q, d) - from_axis * (widened * plain_dot(d, v))];
    [0, 1].map(|i| Known { value: values[i], error: if known { errors[i] } else { f64::NAN } })
}

#[cfg(test)]
mod tests {
    use super::super::{departs, intersect, side};
    use super::*;
    use crate::Interval;
    use crate::kernel::search::{Rational, climb, dot3, each, exact, minus};

    const DIMENSION: usize = 17;

    /// A solid, and a ray from next to its wall or one of its caps, on either side.
    fn setting(x: &[f64]) -> (Ray, Solid) {
        let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
        let base = 2f64.powf(4.0 * x[15]) * v(0);
        let (top, base_radius) = (base + v(3) * 2f64.powf(6.0 * x[14]), x[12].abs());
        let top_radius = if x[13] < -0.5 { base_radius } else { x[13].abs() };
        let axis = top - base;
        let (along, across) = (axis.normalize_or(DVec3::X), axis.cross(v(6)).normalize_or(DVec3::Y));
        // Across the axis twice, so that the axis of across may be any.
        let (s, step) = (x[10].abs(), x[16].signum() * 2f64.powf(-53.0 + 8.0 * x[16].abs()));
        let size = base.abs().max_element() + axis.length() + base_radius + top_radius;
        let radius = base_radius + s * (top_radius - base_radius);
        let origin = if x[11] < 0.3 {
            let lean = (top_radius - base_radius) / axis.length();
            let normal = (across - lean * along).normalize();
            base + s * axis + radius * across + step * size * normal
        } else if x[11] < 0.6 {
            base + s * base_radius * across - step * size * along
        } else {
            top + s * top_radius * across + step * size * along
        };
        (Ray { origin, direction: v(7) }, Solid { base, top, base_radius, top_radius })
    }

    fn rational(x: f64) -> Rational {
        Rational::try_from(x).unwrap()
    }

    #[test]
    fn no_input_reaches_the_bounds() {
        for (k, name) in ["a height", "|q| − R", "its slope"].into_iter().enumerate() {
            let worst = climb(&format!("frustum, leaving: {name}"), DIMENSION, |t| {
                let (ray, solid) = setting(t);
                let (x, d) = (minus(ray.origin, solid.base), exact(ray.direction));
                let v = minus(solid.top, solid.base);
                let (known, exact) = if k == 0 {
                    (product(ray.origin - solid.base, solid.top - solid.base), dot3(&x, &v))
                } else {
                    let (h2, growth) = (dot3(&v, &v), rational(solid.top_radius) - rational(solid.base_radius));
                    let at = dot3(&x, &v) / &h2;
                    let q = [0, 1, 2].map(|i| &x[i] - &at * &v[i]);
                    // |q| by its square, from the nearest float.
                    let square = dot3(&q, &q);
                    let near = rational(square.to_f64().value().sqrt());
                    if near.is_zero() {
                        return None;
                    }
                    let rest = (&square / &near - &near) / Rational::from(2);
                    let from_axis = &near + &rest - &rest * &rest / (Rational::from(2) * &near);
                    let [off_wall, slope] = wall(&ray, &solid);
                    if k == 1 {
                        (off_wall, from_axis - (rational(solid.base_radius) + growth * at))
                    } else {
                        (slope, dot3(&q, &d) - from_axis * growth * dot3(&d, &v) / h2)
                    }
                };
                known.error.is_finite().then(|| ((exact - rational(known.value)).to_f64().value() / known.error).abs())
            });
            assert!((0.02..1.0).contains(&worst), "{name}: {worst}");
        }
    }

    /// A cone so flat that heights whose products with the axis are lost count beside its radius.
    #[test]
    fn what_underflow_takes_is_uncertain() {
        let (height, radius) = (power(-99), power(820));
        let solid = Solid { base: DVec3::ZERO, top: height * DVec3::Z, base_radius: 0.0, top_radius: radius };
        let origin = DVec3::new(power(-98), 0.0, power(-977));
        let from = side(origin, solid.base, solid.top, 0.0, radius);
        assert!(from.is_lt());
        for direction in [DVec3::X, DVec3::NEG_Z, DVec3::Z, DVec3::new(1.0, 0.0, -1.0)] {
            assert!(!departs(&Ray { origin, direction }, solid.base, solid.top, 0.0, radius, true), "{direction}");
        }
    }

    /// The quick answer is that of the exact questions, and nearly always there is one.
    #[test]
    fn what_is_certain_is_true() {
        let (mut certain, mut departed) = ([0; 2], [0; 2]);
        each(40_000, DIMENSION, |x| {
            let (ray, solid) = setting(x);
            let Solid { base, top, base_radius, top_radius } = solid;
            if !ray.is_valid() || !solid.is_valid() {
                return;
            }
            let from = side(ray.origin, base, top, base_radius, top_radius);
            let misses = intersect(&ray, base, top, base_radius, top_radius, Interval::FORWARD).is_none();
            for (outward, exactly) in [(true, from.is_gt() && misses), (false, from.is_lt())] {
                assert_eq!(departs(&ray, base, top, base_radius, top_radius, outward), exactly, "{ray:?} {solid:?}");
                let quick = is_certain(&ray, &solid, outward);
                assert!(exactly || !quick, "{ray:?} {solid:?}");
                certain[usize::from(outward)] += usize::from(quick);
                departed[usize::from(outward)] += usize::from(exactly);
            }
        });
        println!("{certain:?} certain (inward, outward) of {departed:?} that leave a frustum");
        assert!(certain.iter().zip(departed).all(|(&n, all)| n > 5_000 && 3 * n > 2 * all));
    }
}
