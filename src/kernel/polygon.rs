//! A planar polygon with holes: even-odd, decided exactly as the ray sees it.
//!
//! Every vertex is seen along the ray, as the two components X and Y of (v−o)×d, scaled; the ray itself is then the
//! point (0, 0), and the crossings of the positive X axis are counted (Shimrat 1962) by the half-open rule on exact
//! signs. No point is ever computed to be tested. docs/numerics.md §7.

use super::bound::{LARGE, POLYGON_COORDINATE, U, UNDERFLOW};
use super::bounded::Bounded;
use super::cpu;
use super::dyadic::Dyadic;
use super::eft::{Fused, Product, Split};
use super::leaving;
use super::number::{Number, Vector, cross, difference, dot, sign_of, vector};
use super::plane::{Quotient, quotient, quotient_closely};
use super::ratio::{self, Ratio};
use super::tally;
use super::triangle::edge_sign;
use crate::{Aabb, Hit, Interval, Ray};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// The contours of a polygon, the outer one first, and its plane: through the first vertex, with the outer contour's
/// Newell normal, found exactly.
#[derive(Clone, Debug)]
pub struct Contours {
    vertices: Vec<DVec3>,
    /// Where each contour ends in `vertices`.
    ends: Vec<usize>,
    bounds: Aabb,
    /// Times a power of two that brings the largest component to [1, 2): in double-double, and exactly.
    normal: [DVec3; 2],
    exact_normal: Vector<Dyadic>,
}

impl Contours {
    /// The outer contour and the holes; `None` without three vertices in each, where a coordinate is not finite, or
    /// where the outer contour's Newell normal is zero.
    #[must_use]
    pub fn new(contours: &[&[DVec3]]) -> Option<Self> {
        let (outer, vertices) = (contours.first()?, contours.concat());
        if contours.iter().any(|c| c.len() < 3) || !vertices.iter().all(|v| v.is_finite()) {
            return None;
        }
        let from_first = |v: DVec3| difference::<Dyadic>(v, outer[0]);
        let mut newell: Vector<Dyadic> = vector(DVec3::ZERO);
        for pair in outer[1..].windows(2) {
            let c = cross(&from_first(pair[0]), &from_first(pair[1]));
            newell = [newell[0].plus(&c[0]), newell[1].plus(&c[1]), newell[2].plus(&c[2])];
        }
        let scaled = newell.clone().map(|x| x.rounded().0);
        let top = scaled.iter().filter(|x| !x.is_zero()).map(|x| x.exponent()).max()?;
        let pairs = scaled.map(|x| x.shifted(-top).to_pair());
        let mut end = 0;
        let ends = contours.iter().map(|c| {
            end += c.len();
            end
        });
        Some(Self {
            ends: ends.collect(),
            bounds: Aabb::around(&vertices),
            normal: [DVec3::from(pairs.map(|p| p.0)), DVec3::from(pairs.map(|p| p.1))],
            exact_normal: newell.map(|x| x.shifted(-top)),
            vertices,
        })
    }

    /// All vertices, contour after contour.
    #[must_use]
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// The contours, the outer one first.
    pub fn contours(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.vertices[start..end])
    }

    /// The box around all vertices.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// A normal as a double-double: its leading and its low part, the largest component in [1, 2).
    #[must_use]
    pub fn normal(&self) -> [DVec3; 2] {
        self.normal
    }

    /// The exact sign of n·(x − v₀): on which side of the plane `x` lies; `x` finite.
    #[must_use]
    pub fn side(&self, x: DVec3) -> Ordering {
        let from = self.vertices[0];
        sign_of(|| dot(&self.bounded_normal(), &difference(x, from)), || dot(&self.exact_normal, &difference(x, from)))
    }

    /// Whether `ray` starts strictly on the side of the plane that the normal points to, or for `outward` = false on
    /// the other, and does not meet the polygon on its way: both exactly.
    #[must_use]
    pub fn departs(&self, ray: &Ray, outward: bool) -> bool {
        leaving::plane(ray, &self.vertices[0], &self.normal, outward).unwrap_or_else(|| {
            ray.is_valid()
                && self.side(ray.origin) == leaving::side(outward)
                && intersect(ray, self, Interval::FORWARD).is_none()
        })
    }

    /// The distance of `x` from the plane, to a few units in the last place; exactly zero if it lies on it.
    #[must_use]
    pub fn distance(&self, x: DVec3) -> f64 {
        let height = dot(&self.exact_normal, &difference(x, self.vertices[0]));
        height.magnitude().approximately() / self.normal[0].length()
    }

    fn bounded_normal(&self) -> Vector<Bounded> {
        let [hi, lo] = self.normal;
        // Cut off after 105 bits.
        let part = |i: usize| Bounded::new(hi[i], lo[i], 8.0 * U * U * hi[i].abs() + UNDERFLOW);
        [part(0), part(1), part(2)]
    }
}

/// Where `ray` meets the polygon, if λ lies inside `within`.
///
/// A point belongs to it if it is inside an odd number of contours, crossings counted with even-odd in each, or on any
/// contour. A ray along the plane misses. Which side of every edge the ray passes is decided exactly, λ is that of the
/// plane, within 4 ulp, and `error` is proved.
#[inline]
#[must_use]
pub fn intersect(ray: &Ray, polygon: &Contours, within: Interval) -> Option<Hit> {
    cpu::dispatch(
        #[inline(always)]
        || intersect_with::<Fused>(ray, polygon, within),
        #[inline(always)]
        || intersect_with::<Split>(ray, polygon, within),
    )
}

/// [`intersect`] with products' rounding errors found in the way of `P`: for callers that are inside
/// [`cpu::dispatch`] already.
#[inline(always)]
#[must_use]
pub fn intersect_with<P: Product>(ray: &Ray, polygon: &Contours, within: Interval) -> Option<Hit> {
    let [n, n_lo] = &polygon.normal;
    match quotient::<P>(P::cpu(), ray, &polygon.vertices[0], n, Some(n_lo), &within) {
        Quotient::Outside => None,
        Quotient::Inside { lambda, error } => {
            let hit = Hit { lambda, error, uv: DVec2::ZERO, part: 0 };
            surrounds(ray, polygon).unwrap_or_else(|| surrounds_exactly(ray, polygon)).then_some(hit)
        }
        Quotient::Uncertain => refine(ray, polygon, within),
    }
}

/// The axis along which the ray runs fastest, and the two after it.
#[inline(always)]
fn axes(direction: DVec3) -> [usize; 3] {
    let a = direction.abs();
    if a.x >= a.y && a.x >= a.z {
        [1, 2, 0]
    } else if a.y >= a.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// Whether the contours surround the ray an odd number of times; `None` where rounding leaves that open, as it does on
/// every contour.
#[inline(always)]
fn surrounds(ray: &Ray, polygon: &Contours) -> Option<bool> {
    let (o, d) = (ray.origin, ray.direction);
    let [x, y, z] = axes(d);
    let (dx, dy, dz) = (d[x], d[y], d[z]);
    let reach = (polygon.bounds.max - o).abs().max((polygon.bounds.min - o).abs()).max_element();
    let size = reach * dz.abs();
    let bound = POLYGON_COORDINATE * size + UNDERFLOW;
    // `size` may be NaN.
    let in_range = size < LARGE;
    if !in_range {
        return None;
    }
    let seen = |v: DVec3| {
        let s = v - o;
        (seen(s[x], s[z], dx, dz), seen(s[y], s[z], dy, dz))
    };
    let mut inside = false;
    let mut start = 0;
    for &end in &polygon.ends {
        let contour = &polygon.vertices[start..end];
        start = end;
        let (mut ax, mut ay) = seen(contour[contour.len() - 1]);
        for &v in contour {
            let (bx, by) = seen(v);
            // To the left of the axis that is counted on, Y may be of either sign as long as both edges see the same.
            if !((by.abs() > bound) | (bx < -bound)) {
                return None;
            }
            let below = ay < 0.0;
            if below != (by < 0.0) {
                if (ax > bound) & (bx > bound) {
                    inside = !inside;
                } else if !((ax < -bound) & (bx < -bound)) {
                    let (side, off) = turn([ax, ay], [bx, by], bound);
                    let certain = side.abs() > off;
                    if !certain {
                        return None;
                    }
                    inside ^= (side > 0.0) == below;
                }
            }
            (ax, ay) = (bx, by);
        }
    }
    Some(inside)
}

/// A component of a vertex as the ray sees it, times d_z: where a line along the ray through it crosses the plane
/// across the axis.
#[inline(always)]
fn seen(s: f64, sz: f64, d: f64, dz: f64) -> f64 {
    s * dz - sz * d
}

/// The determinant of two vertices, each component off by `bound`, and how far off it is.
#[inline(always)]
fn turn([ax, ay]: [f64; 2], [bx, by]: [f64; 2], bound: f64) -> (f64, f64) {
    let (p, q) = (ax * by, bx * ay);
    let off = 1.1 * (bound * ((ax.abs() + ay.abs()) + (bx.abs() + by.abs()) + bound))
        + 4.0 * U * (p.abs() + q.abs())
        + UNDERFLOW;
    (p - q, off)
}

/// Whether the ray passes inside the contours or through one of them, exactly.
#[cold]
#[inline(never)]
fn surrounds_exactly(ray: &Ray, polygon: &Contours) -> bool {
    fn component<N: Number>(ray: &Ray, v: DVec3, i: usize, z: usize) -> N {
        let (o, d) = (ray.origin, ray.direction);
        let along = N::difference(v[i], o[i]).times(&N::exactly(d[z]));
        along.minus(&N::difference(v[z], o[z]).times(&N::exactly(d[i])))
    }
    tally::refined();
    let [x, y, z] = axes(ray.direction);
    let forwards = ray.direction[z] > 0.0;
    let seen = |v: DVec3| {
        [x, y].map(|i| {
            let (s, t) = (v[i] - ray.origin[i], v[z] - ray.origin[z]);
            let (p, q) = (s * ray.direction[z], t * ray.direction[i]);
            if (p - q).abs() > 4.0 * U * (p.abs() + q.abs()) + UNDERFLOW && (p.abs() + q.abs()) < LARGE {
                return p.total_cmp(&q);
            }
            sign_of(|| component(ray, v, i, z), || component(ray, v, i, z))
        })
    };
    let mut inside = false;
    for contour in polygon.contours() {
        let mut a = contour[contour.len() - 1];
        let mut at_a = seen(a);
        for &b in contour {
            let at_b = seen(b);
            let below = |at: [Ordering; 2]| at[1].is_le();
            let crosses = below(at_a) != below(at_b);
            // Not both strictly on one side of either axis.
            let may_touch = (0..2).all(|i| at_a[i] != at_b[i] || at_a[i].is_eq());
            if crosses || may_touch {
                let side = edge_sign(ray, a, b);
                if side.is_eq() && may_touch {
                    return true;
                }
                let side = if forwards { side } else { side.reverse() };
                inside ^= crosses && side.is_gt() == below(at_a);
            }
            (a, at_a) = (b, at_b);
        }
    }
    inside
}

fn plane<N: Number>(ray: &Ray, point: DVec3, normal: &Vector<N>) -> Ratio<N> {
    Ratio { numerator: dot(normal, &difference(point, ray.origin)), denominator: dot(normal, &vector(ray.direction)) }
}

#[cold]
#[inline(never)]
fn refine(ray: &Ray, polygon: &Contours, within: Interval) -> Option<Hit> {
    if !ray.is_valid() || within.is_empty() || !surrounds_exactly(ray, polygon) {
        return None;
    }
    let point = polygon.vertices[0];
    let [n, n_lo] = &polygon.normal;
    let (lambda, error) = match quotient_closely(ray, &point, n, Some(n_lo), within) {
        Quotient::Outside => return None,
        Quotient::Inside { lambda, error } => (lambda, error),
        Quotient::Uncertain => ratio::refine(
            || plane(ray, point, &polygon.bounded_normal()),
            || plane(ray, point, &polygon.exact_normal),
            within,
            ratio::floor(ray, point),
        )?,
    };
    Some(Hit { lambda, error, uv: DVec2::ZERO, part: 0 })
}

/// λ of the polygon's plane to about a hundred bits, as an unevaluated sum of two floats; zero where the ray lies along
/// the plane.
#[must_use]
pub fn precise_lambda(ray: &Ray, polygon: &Contours) -> [f64; 2] {
    let point = polygon.vertices[0];
    ratio::precise(|| plane(ray, point, &polygon.bounded_normal()), || plane(ray, point, &polygon.exact_normal))
}

#[cfg(test)]
mod tests {
    use super::super::search::{Rational, climb, exact, minus};
    use super::*;

    #[test]
    fn no_input_reaches_the_bounds() {
        // A ray at the middle of an edge, nearly, so that determinants are small.
        let setting = |x: &[f64]| {
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            let (o, a, b) = (v(0), v(3), v(6));
            let d = a + x[9].abs() * (b - a) - o;
            (d.z != 0.0).then(|| {
                let [s, t] = [a - o, b - o];
                let reach = s.abs().max(t.abs()).max_element();
                (o, d, [a, b], [s, t], POLYGON_COORDINATE * (reach * d.abs().max_element()))
            })
        };
        let exactly = |o: DVec3, d: DVec3, v: DVec3| {
            let (s, d) = (minus(v, o), exact(d));
            [0, 1].map(|i| &s[i] * &d[2] - &s[2] * &d[i])
        };
        let rounded = |d: DVec3, s: DVec3| [seen(s.x, s.z, d.x, d.z), seen(s.y, s.z, d.y, d.z)];
        let off = |rounded: f64, exact: &Rational, bound: f64| {
            (exact - Rational::try_from(rounded).unwrap()).to_f64().value().abs() / bound
        };
        let worst = climb("polygon: coordinates", 10, |x| {
            let (o, d, vertices, differences, bound) = setting(x)?;
            let [x, y] = rounded(d, differences[0]);
            let exact = exactly(o, d, vertices[0]);
            Some(off(x, &exact[0], bound).max(off(y, &exact[1], bound)))
        });
        assert!((0.1..1.0).contains(&worst));
        let worst = climb("polygon: determinants", 10, |x| {
            let (o, d, vertices, differences, bound) = setting(x)?;
            let (value, bound) = turn(rounded(d, differences[0]), rounded(d, differences[1]), bound);
            let [[ax, ay], [bx, by]] = vertices.map(|v| exactly(o, d, v));
            Some(off(value, &(ax * by - bx * ay), bound))
        });
        assert!((0.03..1.0).contains(&worst));
    }
}
