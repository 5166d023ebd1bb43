//! Sphere, cylinder, cone.

use super::{Hit, Interval, Ray, Real, V3, cast, first_within, hit};
use glam::DVec3;

/// Lecture: λ = −B/A ± √D/A with A = d·d, B = d·(a − c), C = |a − c|² − r², D = B² − AC.
///
/// Goes wrong far away (C and D cancel: a fifth of the decisions at 1e8 radii), when grazing (D), and near the surface
/// (−B and √D cancel in the nearer root).
#[inline]
pub fn sphere<R: Real>(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let f = o - V3::of(center);
    let r = R::from_f64(radius);
    let a = d.dot(d);
    let b = d.dot(f);
    let c = f.dot(f) - r * r;
    let discriminant = b * b - a * c;
    if !(discriminant >= R::ZERO) {
        return None;
    }
    let (middle, half) = (-b / a, discriminant.sqrt() / a);
    let lambda = first_within(middle - half, middle + half, min, max)?;
    Some(hit(lambda, R::ZERO, R::ZERO, 0))
}

/// Haines, Günther, Akenine-Möller 2019, *Precision Improvements for Ray/Sphere Intersection* (Ray Tracing Gems,
/// ch. 7): the discriminant from the point nearest to the centre, the roots without cancellation; the best published
/// closed form.
///
/// Goes wrong when grazing from afar (the nearest point is rounded at the origin's scale) and with the origin on the
/// surface (C cancels).
#[inline]
pub fn sphere_gems<R: Real>(ray: &Ray, center: DVec3, radius: f64, within: Interval) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let f = o - V3::of(center);
    let r = R::from_f64(radius);
    let a = d.dot(d);
    let b = -f.dot(d);
    let nearest = f + d.scaled(b / a);
    let discriminant = r * r - nearest.dot(nearest);
    if !(discriminant >= R::ZERO) {
        return None;
    }
    let c = f.dot(f) - r * r;
    let q = b + (a * discriminant).sqrt().copysign(b);
    let (t0, t1) = (c / q, q / a);
    let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
    let lambda = first_within(near, far, min, max)?;
    Some(hit(lambda, R::ZERO, R::ZERO, 0))
}

/// Lecture, errata mended: the cylinder's wall by its quadratic with the z-range test, the caps by their planes with
/// the circle test, the smallest λ of what is left. In the axis's frame x² + y² is the squared length of what is
/// perpendicular to it. `top_radius` stands there for the frustum's signature and is not looked at.
///
/// Parts: 0 wall, 1 base, 2 top. Goes wrong far away and along the axis (as the sphere does), and leaks at rims, where
/// the rounded z and the rounded circle test may both say no.
#[inline]
pub fn cylinder<R: Real>(
    ray: &Ray,
    base: DVec3,
    top: DVec3,
    base_radius: f64,
    top_radius: f64,
    within: Interval,
) -> Option<Hit> {
    let _ = top_radius;
    let (o, d, min, max) = cast::<R>(ray, within);
    let f = Frame::new(o, d, V3::of(base), V3::of(top));
    let r = R::from_f64(base_radius);
    let a = f.d.dot(f.d);
    let b = f.d.dot(f.o);
    let c = f.o.dot(f.o) - r * r;
    f.nearest(a, b, c, r, r, min, max)
}

/// As [`cylinder`], for the wall x² + y² = (r₀ + kz)², k = (r₁ − r₀)/height: a cone for r₁ = 0, truncated otherwise.
/// The z-range test also rejects the mirror nappe.
///
/// Goes wrong besides near the apex and along generators, where A, B and C vanish together.
#[inline]
pub fn cone<R: Real>(
    ray: &Ray,
    base: DVec3,
    top: DVec3,
    base_radius: f64,
    top_radius: f64,
    within: Interval,
) -> Option<Hit> {
    let (o, d, min, max) = cast::<R>(ray, within);
    let f = Frame::new(o, d, V3::of(base), V3::of(top));
    let (r0, r1) = (R::from_f64(base_radius), R::from_f64(top_radius));
    let slope = (r1 - r0) / f.height;
    let (radius, growth) = (r0 + slope * f.oz, slope * f.dz);
    let a = f.d.dot(f.d) - growth * growth;
    let b = f.d.dot(f.o) - growth * radius;
    let c = f.o.dot(f.o) - radius * radius;
    f.nearest(a, b, c, r0, r1, min, max)
}

/// The ray split into what lies along the axis and what is perpendicular to it.
struct Frame<R> {
    o: V3<R>,
    d: V3<R>,
    oz: R,
    dz: R,
    height: R,
}

impl<R: Real> Frame<R> {
    #[inline(always)]
    fn new(o: V3<R>, d: V3<R>, base: V3<R>, top: V3<R>) -> Self {
        let axis = top - base;
        let height = axis.dot(axis).sqrt();
        let axis = axis.scaled(R::ONE / height);
        let o = o - base;
        let (oz, dz) = (o.dot(axis), d.dot(axis));
        Self { o: o - axis.scaled(oz), d: d - axis.scaled(dz), oz, dz, height }
    }

    /// The smallest λ within the interval on the wall Aλ² + 2Bλ + C = 0 or on a cap.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn nearest(&self, a: R, b: R, c: R, r0: R, r1: R, min: R, max: R) -> Option<Hit> {
        let mut best = max;
        let mut part = None;
        let discriminant = b * b - a * c;
        if a == R::ZERO {
            // Parallel to the axis or to a generator: one root, or none.
            let two_b = b + b;
            self.wall(-c / two_b, min, &mut best, &mut part);
        } else if discriminant >= R::ZERO {
            let (middle, half) = (-b / a, discriminant.sqrt() / a);
            self.wall(middle - half, min, &mut best, &mut part);
            self.wall(middle + half, min, &mut best, &mut part);
        }
        // A ray across the axis meets no cap; dividing by dz = 0 would give NaN, which fails every test.
        if self.dz != R::ZERO {
            let mut cap = |lambda: R, r: R, which: u32| {
                let p = self.o + self.d.scaled(lambda);
                if lambda > min && lambda < best && p.dot(p) <= r * r {
                    best = lambda;
                    part = Some(which);
                }
            };
            cap(-self.oz / self.dz, r0, 1);
            cap((self.height - self.oz) / self.dz, r1, 2);
        }
        part.map(|part| hit(best, R::ZERO, R::ZERO, part))
    }

    #[inline(always)]
    fn wall(&self, lambda: R, min: R, best: &mut R, part: &mut Option<u32>) {
        let z = self.oz + lambda * self.dz;
        if lambda > min && lambda < *best && z >= R::ZERO && z <= self.height {
            *best = lambda;
            *part = Some(0);
        }
    }
}
