//! λ of eight rays at once, each with a triangle of its own: a register holds the same number of all.
//!
//! The operations are those of [`passed`](super::passed), each rounded alike, in the same order: what is answered here
//! has the same bits.

use crate::kernel::bound::{TRIANGLE_LAMBDA, U};
use crate::kernel::cpu;
use crate::kernel::eft::{Fused, Product, Split, two_diff, two_sum};
use fearless_simd::{Simd, f64x8, prelude::*};

/// Of eight vectors the x, the y and the z.
pub type Vectors<S> = [f64x8<S>; 3];

/// Eight rays, each with a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Rays<S: Simd> {
    /// Where they begin.
    pub origin: Vectors<S>,
    /// Where they go, of any length.
    pub direction: Vectors<S>,
    /// The first, second and third vertex of each one's triangle.
    pub vertices: [Vectors<S>; 3],
}

/// What [`passed`] found.
#[derive(Clone, Copy, Debug)]
pub struct Passed<S: Simd> {
    /// λ.
    pub lambda: f64x8<S>,
    /// How far off λ may be.
    pub error: f64x8<S>,
    /// The weights of the second and of the third vertex.
    pub uv: [f64x8<S>; 2],
    /// Of which rays that is so, a bit each, the lowest the first; the others are for [`super::intersect`].
    pub known: u32,
}

/// [`super::passed`] for eight rays. `plain`: the edges of all triangles are vectors of floats. `least`, times |e₁||e₂|
/// in largest components: what |D| and |N| have to be above.
///
/// For code that was dispatched to the instructions of `simd`.
#[inline(always)]
#[must_use]
pub fn passed<S: Simd>(simd: S, rays: &Rays<S>, plain: bool, least: [f64; 2]) -> Passed<S> {
    if cpu::has_fused(simd) {
        hits::<S, Fused>(simd, rays, plain, least)
    } else {
        hits::<S, Split>(simd, rays, plain, least)
    }
}

#[inline(always)]
fn hits<S: Simd, P: Product>(simd: S, rays: &Rays<S>, plain: bool, least: [f64; 2]) -> Passed<S> {
    let splat = |x: f64| f64x8::splat(simd, x);
    let Rays { origin: o, direction: d, vertices: [a, b, c] } = rays;
    let (e1, e2, s) = (minus(b, a), minus(c, a), Double::difference(o, a));
    let mut n = Double::cross::<P>(&e1, &e2);
    if !plain {
        n.add_low_parts(&Double::difference(b, a), &Double::difference(c, a));
    }
    let q = cross(d, &s.hi);
    let (nd, ns) = (n.times_float::<P>(d), n.times::<P>(&s));
    let ((det, det_lo), (height, height_lo)) = (nd.sum(), ns.sum());
    let (su, minus_sv) = (dot(&q, &e2), dot(&q, &e1));

    let m12 = largest(&e1) * largest(&e2);
    let known = det.abs().simd_gt(m12 * splat(least[0])) & height.abs().simd_gt(m12 * splat(least[1]));

    let inverse = splat(1.0) / det;
    let first = -height * inverse;
    let error = splat(U + TRIANGLE_LAMBDA) * first.abs();
    let remainder = P::remainders::<S, _>(height, -first, det) + (height_lo + first * det_lo);
    let lambda = first - remainder * inverse;
    let uv = [(su * inverse).min(splat(1.0)), (-minus_sv * inverse).min(splat(1.0))];
    Passed { lambda, error, uv, known: known.to_bitmask() as u32 }
}

/// Eight vectors as unevaluated sums; as in [`lanes`](crate::kernel::lanes), where a register holds one vector.
struct Double<S: Simd> {
    hi: Vectors<S>,
    lo: Vectors<S>,
}

impl<S: Simd> Double<S> {
    /// By component. Written out, since `array::map` is not always inlined, and then every intrinsic is a call.
    #[inline(always)]
    fn each(component: impl Fn(usize) -> (f64x8<S>, f64x8<S>)) -> Self {
        let ((x, x_lo), (y, y_lo), (z, z_lo)) = (component(0), component(1), component(2));
        Self { hi: [x, y, z], lo: [x_lo, y_lo, z_lo] }
    }

    #[inline(always)]
    fn difference(a: &Vectors<S>, b: &Vectors<S>) -> Self {
        Self::each(
            #[inline(always)]
            |i| two_diff(a[i], b[i]),
        )
    }

    /// Of vectors of floats.
    #[inline(always)]
    fn cross<P: Product>(a: &Vectors<S>, b: &Vectors<S>) -> Self {
        Self::each(
            #[inline(always)]
            |i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let ((p, p_lo), (m, m_lo)) = (P::two_products::<S, _>(a[j], b[k]), P::two_products::<S, _>(a[k], b[j]));
                let (hi, rounding) = two_diff(p, m);
                (hi, (p_lo - m_lo) + rounding)
            },
        )
    }

    /// What the low parts of `a` and of `b` add to [`Double::cross`].
    #[inline(always)]
    fn add_low_parts(&mut self, a: &Self, b: &Self) {
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (forth, back) = (a.hi[j] * b.lo[k] + a.lo[j] * b.hi[k], a.hi[k] * b.lo[j] + a.lo[k] * b.hi[j]);
            self.lo[i] += forth - back;
        }
    }

    #[inline(always)]
    fn times<P: Product>(&self, other: &Self) -> Self {
        Self::each(
            #[inline(always)]
            |i| {
                let (hi, lo) = P::two_products::<S, _>(self.hi[i], other.hi[i]);
                (hi, lo + (self.lo[i] * other.hi[i] + self.hi[i] * other.lo[i]))
            },
        )
    }

    #[inline(always)]
    fn times_float<P: Product>(&self, other: &Vectors<S>) -> Self {
        Self::each(
            #[inline(always)]
            |i| {
                let (hi, lo) = P::two_products::<S, _>(self.hi[i], other[i]);
                (hi, lo + self.lo[i] * other[i])
            },
        )
    }

    /// x + y + z.
    #[inline(always)]
    fn sum(&self) -> (f64x8<S>, f64x8<S>) {
        let ([x, y, z], [x_lo, y_lo, z_lo]) = (self.hi, self.lo);
        let (xy, rounding) = two_sum(x, y);
        let (sum, more_rounding) = two_sum(xy, z);
        (sum, (rounding + more_rounding) + ((x_lo + y_lo) + z_lo))
    }
}

#[inline(always)]
fn minus<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> Vectors<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> Vectors<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> f64x8<S> {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

/// The largest |component|.
#[inline(always)]
fn largest<S: Simd>(v: &Vectors<S>) -> f64x8<S> {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{DIMENSION, fast_path, setting};
    use super::super::{has_plain_edges, largest};
    use super::*;
    use crate::Ray;
    use crate::bvh::Level;
    use crate::kernel::bound::TRIANGLE_CONDITION;
    use crate::kernel::search::each;
    use fearless_simd::dispatch;
    use glam::DVec3;

    type Case = (Ray, [DVec3; 3]);

    #[inline(always)]
    fn gathered<S: Simd>(simd: S, cases: &[Case]) -> Rays<S> {
        let number =
            |f: &dyn Fn(&Case) -> f64| -> f64x8<S> { [0, 1, 2, 3, 4, 5, 6, 7].map(|i| f(&cases[i])).simd_into(simd) };
        let vectors = |f: &dyn Fn(&Case) -> DVec3| [0, 1, 2].map(|axis| number(&|case| f(case)[axis]));
        Rays {
            origin: vectors(&|(ray, _)| ray.origin),
            direction: vectors(&|(ray, _)| ray.direction),
            vertices: [0, 1, 2].map(|i| vectors(&|(_, t)| t[i])),
        }
    }

    /// Hits that were known, with plain edges, and left to the scalar function.
    fn compare(cases: &[Case; 8]) -> [u32; 3] {
        let alone = cases.map(|(ray, t)| fast_path(&ray, &t));
        let sizes = cases.map(|(ray, t)| [largest(ray.direction), largest(ray.origin - t[0])]);
        let least = [0, 1].map(|i| sizes.iter().fold(0.0, |most, size| size[i].max(most)) / TRIANGLE_CONDITION);
        let (plain, mut seen) = (cases.iter().all(|(_, t)| has_plain_edges(t)), [0; 3]);
        for (level, detected) in Level::all() {
            for plain in [false, plain] {
                dispatch!(detected.token(), simd => {
                    let eight = passed(simd, &gathered(simd, cases), plain, least);
                    seen = [0, 0, 8 - (eight.known & 0xff).count_ones()];
                    for (i, hit) in alone.iter().enumerate() {
                        let (of, known) = (|x: f64x8<_>| x[i].to_bits(), eight.known >> i & 1 == 1);
                        if let (Some(hit), true) = (hit, known) {
                            let same = [of(eight.lambda), of(eight.error), of(eight.uv[0]), of(eight.uv[1])];
                            let alone = [hit.lambda, hit.error, hit.uv.x, hit.uv.y].map(f64::to_bits);
                            assert_eq!(same, alone, "{level}: {:?}", cases[i]);
                            seen = [seen[0] + 1, seen[1] + u32::from(plain), seen[2]];
                        }
                    }
                    assert!(eight.known < 256);
                });
            }
        }
        seen
    }

    /// Ordinary and hard triangles, and numbers that leave the range.
    #[test]
    fn eight_answer_as_one_does_to_the_bit() {
        let (mut cases, mut rays, mut seen) = (Vec::new(), 0, [0; 3]);
        each(40_000, DIMENSION + 2, |x| {
            let (mut ray, mut t) = setting(x);
            let (kind, scale) = ((12.0 * x[DIMENSION].abs()) as u32, x[DIMENSION + 1]);
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            let short = rays / 8 % 2 == 0;
            match kind {
                7 if !short => {
                    let factor = 2f64.powf(1000.0 * scale);
                    (t, ray) = (t.map(|v| v * factor), Ray { origin: ray.origin * factor, ..ray });
                }
                8 if !short => ray.direction *= 2f64.powf(1020.0 * scale),
                9 if !short && scale > 0.8 => {
                    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0];
                    let at = (1e6 * scale) as usize;
                    let [a, b, c] = &mut t;
                    let v = [a, b, c, &mut ray.origin, &mut ray.direction];
                    v.into_iter().nth(at % 5).unwrap()[at / 5 % 3] = odd[at / 15 % 4];
                }
                10.. if !short => {}
                _ => {
                    (t, ray.origin) = ([v(0), v(3), v(6)], 5.0 * v(9));
                    t = t.map(|v| if short { v.as_vec3().as_dvec3() } else { v });
                    ray.direction = t[0] + 0.5 * x[12].abs() * (t[1] - t[0]) + 0.4 * (t[2] - t[0]) - ray.origin;
                }
            }
            rays += 1;
            cases.push((ray, t));
            if cases.len() == 8 {
                let of_eight = compare(cases.as_array().expect("eight"));
                seen = [0, 1, 2].map(|i| seen[i] + of_eight[i]);
                cases.clear();
            }
        });
        let [known, plain, left] = seen;
        println!("triangle, eight at once: {rays} rays, {known} hits known, {plain} with plain edges; {left} left");
        assert!(known * 2 > rays && plain * 5 > rays && left * 50 > rays);
    }
}
