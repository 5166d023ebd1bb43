//! Triangles: the lecture's two algorithms, Möller–Trumbore, Woop.

use super::{Hit, Interval, Ray, Real, V3, cast, hit};
use glam::DVec3;

/// Lecture, Algorithm 1: intersect the plane, then test the rounded point against three half-planes.
///
/// Goes wrong at every shared edge: neighbours round the point on their own planes and each may put it outside.
#[inline]
pub fn algorithm_1<R: Real>(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let [a, b, c] = vertices.map(V3::<R>::of);
    let n = (b - a).cross(c - a);
    let lambda = (a - o).dot(n) / d.dot(n);
    // False for the 0/0 of a ray in the plane as well.
    if !(lambda > min && lambda < max) {
        return None;
    }
    let p = o + d.scaled(lambda);
    let u = (b - a).cross(p - a).dot(n);
    let v = (c - b).cross(p - b).dot(n);
    let w = (a - c).cross(p - c).dot(n);
    if !(u >= R::ZERO && v >= R::ZERO && w >= R::ZERO) {
        return None;
    }
    let area = n.dot(n);
    Some(hit(lambda, w / area, u / area, 0))
}

/// Lecture, Algorithm 2: p(α, β) = p₁ + α(p₂ − p₁) + β(p₃ − p₁) = a + λd as a 3×3 system, by Cramer's rule; hit if
/// α ≥ 0, β ≥ 0, α + β ≤ 1.
///
/// Goes wrong where Algorithm 1 does, for α and β are rounded by each neighbour in its own way.
#[inline]
pub fn algorithm_2<R: Real>(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let [p1, p2, p3] = vertices.map(V3::<R>::of);
    // [p₂ − p₁, p₃ − p₁, −d]·(α, β, λ) = a − p₁
    let (x, y, z, rhs) = (p2 - p1, p3 - p1, d.scaled(-R::ONE), o - p1);
    let det = |a: V3<R>, b: V3<R>, c: V3<R>| a.dot(b.cross(c));
    let whole = det(x, y, z);
    if whole == R::ZERO {
        return None;
    }
    let alpha = det(rhs, y, z) / whole;
    let beta = det(x, rhs, z) / whole;
    let lambda = det(x, y, rhs) / whole;
    let inside = alpha >= R::ZERO && beta >= R::ZERO && alpha + beta <= R::ONE;
    (inside && lambda > min && lambda < max).then(|| hit(lambda, alpha, beta, 0))
}

/// Möller, Trumbore 1997, two-sided, with the paper's ε as exactly zero.
///
/// Goes wrong on shared edges and vertices: 8.6 % of rays aimed at vertices of a closed mesh leak, in f64 too.
#[inline]
pub fn moller_trumbore<R: Real>(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let [a, b, c] = vertices.map(V3::<R>::of);
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == R::ZERO {
        return None;
    }
    let inverse = R::ONE / det;
    let t = o - a;
    let u = t.dot(p) * inverse;
    if !(u >= R::ZERO && u <= R::ONE) {
        return None;
    }
    let q = t.cross(e1);
    let v = d.dot(q) * inverse;
    if !(v >= R::ZERO && u + v <= R::ONE) {
        return None;
    }
    let lambda = e2.dot(q) * inverse;
    (lambda > min && lambda < max).then(|| hit(lambda, u, v, 0))
}

/// Woop, Benthin, Wald 2013, *Watertight Ray/Triangle Intersection*: the ray is sheared onto an axis and the edges
/// tested in 2-D, zeros again in the wider precision (f32 only), two-sided.
///
/// Neighbours agree on their edge, so nothing leaks, but each may err: edges are hit twice, and the plane's λ keeps
/// the rounding of the sheared z.
#[inline]
pub fn woop<R: Real>(ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let kz = d.dominant_axis();
    let (mut kx, mut ky) = ((kz + 1) % 3, (kz + 2) % 3);
    if d[kz] < R::ZERO {
        std::mem::swap(&mut kx, &mut ky);
    }
    let (sx, sy, sz) = (d[kx] / d[kz], d[ky] / d[kz], R::ONE / d[kz]);
    let [a, b, c] = vertices.map(|v| V3::<R>::of(v) - o);
    let shear = |v: V3<R>| (v[kx] - sx * v[kz], v[ky] - sy * v[kz]);
    let ((ax, ay), (bx, by), (cx, cy)) = (shear(a), shear(b), shear(c));
    let mut u = cx * by - cy * bx;
    let mut v = ax * cy - ay * cx;
    let mut w = bx * ay - by * ax;
    if u == R::ZERO || v == R::ZERO || w == R::ZERO {
        u = R::wider_cross(cx, by, cy, bx);
        v = R::wider_cross(ax, cy, ay, cx);
        w = R::wider_cross(bx, ay, by, ax);
    }
    if (u < R::ZERO || v < R::ZERO || w < R::ZERO) && (u > R::ZERO || v > R::ZERO || w > R::ZERO) {
        return None;
    }
    let det = u + v + w;
    if det == R::ZERO {
        return None;
    }
    let inverse = R::ONE / det;
    let lambda = (u * (sz * a[kz]) + v * (sz * b[kz]) + w * (sz * c[kz])) * inverse;
    (lambda > min && lambda < max).then(|| hit(lambda, v * inverse, w * inverse, 0))
}
