//! Plane, polygon, box.

use super::{Hit, Interval, Ray, Real, V3, cast, hit};
use glam::DVec3;

/// Lecture: λ = (p₁ − a)·n / (d·n).
///
/// Goes wrong where p₁ − a is nearly perpendicular to n (origin near the plane) or d is (grazing): both dot products
/// cancel. A ray in the plane gives 0/0, a miss.
#[inline]
pub fn plane<R: Real>(ray: &Ray, point: DVec3, normal: DVec3, within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let n = V3::of(normal);
    let lambda = (V3::of(point) - o).dot(n) / d.dot(n);
    (lambda > min && lambda < max).then(|| hit(lambda, R::ZERO, R::ZERO, 0))
}

/// Lecture: the plane, then the odd/even count of crossings in it, over all contours (Shimrat 1962; the half-open rule
/// of W. R. Franklin's *pnpoly*). The plane is the outer contour's by Newell's formula, its projection drops the
/// normal's dominant axis.
///
/// Goes wrong at edges and vertices, where the rounded point falls on either side.
#[inline]
pub fn polygon<R: Real>(ray: &Ray, contours: &[&[DVec3]], within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let outer = contours.first()?;
    let first = V3::<R>::of(*outer.first()?);
    let mut n = V3(R::ZERO, R::ZERO, R::ZERO);
    for (i, &v) in outer.iter().enumerate() {
        let (p, q) = (V3::of(v) - first, V3::of(outer[(i + 1) % outer.len()]) - first);
        n = n + p.cross(q);
    }
    let lambda = (first - o).dot(n) / d.dot(n);
    if !(lambda > min && lambda < max) {
        return None;
    }
    let p = o + d.scaled(lambda);
    let drop = n.dominant_axis();
    let (x, y) = ((drop + 1) % 3, (drop + 2) % 3);
    let mut inside = false;
    for contour in contours {
        for (i, &v) in contour.iter().enumerate() {
            let (a, b) = (V3::<R>::of(v), V3::<R>::of(contour[(i + 1) % contour.len()]));
            if (a[y] > p[y]) != (b[y] > p[y]) && p[x] < (b[x] - a[x]) * (p[y] - a[y]) / (b[y] - a[y]) + a[x] {
                inside = !inside;
            }
        }
    }
    inside.then(|| hit(lambda, R::ZERO, R::ZERO, 0))
}

/// Kay, Kajiya 1986: the slabs' λ-intervals intersected, unpadded: where the line enters and leaves the box, if that
/// overlaps the interval.
///
/// Goes wrong at faces, edges and corners by the rounding of o and 1/d, and where the origin lies on a slab plane with
/// dᵢ = 0 (0·∞).
#[inline]
pub fn slab<R: Real>(ray: &Ray, lower: DVec3, upper: DVec3, within: Interval) -> Option<(f64, f64)> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let (lower, upper) = (V3::<R>::of(lower), V3::<R>::of(upper));
    let (mut enter, mut exit) = (-R::INFINITY, R::INFINITY);
    for axis in 0..3 {
        let inverse = R::ONE / d[axis];
        let (a, b) = ((lower[axis] - o[axis]) * inverse, (upper[axis] - o[axis]) * inverse);
        let (near, far) = if a < b { (a, b) } else { (b, a) };
        enter = if near > enter { near } else { enter };
        exit = if far < exit { far } else { exit };
    }
    (enter <= exit && exit > min && enter < max).then(|| (enter.to_f64(), exit.to_f64()))
}
