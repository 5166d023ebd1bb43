//! The fast path for eight rays at once, each with a triangle of its own: a register holds the same number of all.
//!
//! The operations are those of [`intersect_with`](super::intersect_with), each rounded alike, in the same order: what is
//! answered here has the same bits.

use super::{LARGEST, PRESENT, VANISHED, WEIGHT};
use crate::kernel::bound::{TRIANGLE_CONDITION, TRIANGLE_LAMBDA, TRIANGLE_SIDES, U};
use crate::kernel::cpu;
use crate::kernel::eft::{Fused, Product, Split, two_diff, two_sum};
use fearless_simd::{Simd, f64x8, mask64x8, prelude::*};

/// Of eight vectors the x, the y and the z.
pub type Vectors<S> = [f64x8<S>; 3];

/// Eight rays, each with a triangle and an interval.
#[derive(Clone, Copy, Debug)]
pub struct Rays<S: Simd> {
    /// Where they begin.
    pub origin: Vectors<S>,
    /// Where they go, of any length.
    pub direction: Vectors<S>,
    /// The first, second and third vertex of each one's triangle.
    pub vertices: [Vectors<S>; 3],
    /// Between which λ counts, the ends excluded.
    pub within: [f64x8<S>; 2],
}

/// What [`intersect`] found; a bit of the masks is a ray, the lowest the first.
#[derive(Clone, Copy, Debug)]
pub struct Eight<S: Simd> {
    /// λ of those that hit.
    pub lambda: f64x8<S>,
    /// How far off λ may be.
    pub error: f64x8<S>,
    /// The weights of the second and of the third vertex.
    pub uv: [f64x8<S>; 2],
    /// Which rays certainly hit.
    pub hit: u32,
    /// Which rays [`super::intersect`] has to answer: neither do they certainly hit nor certainly miss.
    pub unsure: u32,
}

/// Where eight rays meet a triangle each, to the bit as [`super::intersect`] has it, as far as the fast path is certain.
///
/// For code that was dispatched to the instructions of `simd`.
#[inline(always)]
#[must_use]
pub fn intersect<S: Simd>(simd: S, rays: &Rays<S>) -> Eight<S> {
    if cpu::has_fused(simd) { fast::<S, Fused>(simd, rays) } else { fast::<S, Split>(simd, rays) }
}

#[inline(always)]
fn fast<S: Simd, P: Product>(simd: S, rays: &Rays<S>) -> Eight<S> {
    let splat = |x: f64| f64x8::splat(simd, x);
    let Rays { origin: o, direction: d, vertices: [a, b, c], within: [min, max] } = rays;
    let (e1, e2, s) = (Double::difference(b, a), Double::difference(c, a), Double::difference(o, a));
    let (n, q) = (e1.cross::<P>(&e2), cross(d, &s.hi));
    let (nd, ns) = (n.times_float::<P>(d), n.times::<P>(&s));
    let ((det, det_lo), (height, height_lo)) = (nd.sum(), ns.sum());
    let (su, minus_sv) = (dot(&q, &e2.hi), dot(&q, &e1.hi));

    let (d, s, m1, m2) = (largest(d), largest(&s.hi), largest(&e1.hi), largest(&e2.hi));
    let (sum, m12) = (m1 + m2, m1 * m2);
    let ordinary = ((sum + s) + d).simd_lt(splat(LARGEST));
    let bound = splat(TRIANGLE_SIDES) * (d * (m12 + s * sum)) + splat(VANISHED);
    let (sv, sw) = (-minus_sv, (det - su) + minus_sv);
    // A NaN among them is one in D or N as well, and those are not known then.
    let (least, most) = (su.min(sv).min(sw), su.max(sv).max(sw));
    let miss = ordinary & least.simd_lt(-bound) & most.simd_gt(bound);
    let through = ordinary & (least.simd_gt(bound) | most.simd_lt(-bound));

    let inverse = splat(1.0) / det;
    let certain =
        through & is_known(det, d * m12) & is_known(height, s * m12) & (bound * inverse.abs()).simd_le(splat(WEIGHT));

    let first = -height * inverse;
    let error = splat(U + TRIANGLE_LAMBDA) * first.abs();
    let remainder = P::remainders::<S, _>(height, -first, det) + (height_lo + first * det_lo);
    let lambda = first - remainder * inverse;
    let (from, to) = (lambda - error, lambda + error);
    let hit = certain & from.simd_gt(*min) & to.simd_lt(*max);
    let miss = miss | certain & (to.simd_lt(*min) | from.simd_gt(*max));
    let uv = [(su * inverse).min(splat(1.0)), (sv * inverse).min(splat(1.0))];
    Eight { lambda, error, uv, hit: hit.to_bitmask() as u32, unsure: (!(hit | miss)).to_bitmask() as u32 }
}

/// Whether a triple product, of sizes with this product, has lost few enough bits: known before λ is.
#[inline(always)]
fn is_known<S: Simd>(product: f64x8<S>, size: f64x8<S>) -> mask64x8<S> {
    let splat = |x: f64| f64x8::splat(size.simd, x);
    let amplified = product.abs() * splat(TRIANGLE_CONDITION);
    (size + splat(TRIANGLE_CONDITION * PRESENT)).simd_lt(amplified)
        & amplified.simd_lt(splat(TRIANGLE_CONDITION / PRESENT))
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

    #[inline(always)]
    fn cross<P: Product>(&self, other: &Self) -> Self {
        Self::each(
            #[inline(always)]
            |i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let ((p, p_lo), (m, m_lo)) = (
                    P::two_products::<S, _>(self.hi[j], other.hi[k]),
                    P::two_products::<S, _>(self.hi[k], other.hi[j]),
                );
                let (hi, rounding) = two_diff(p, m);
                let forth = self.hi[j] * other.lo[k] + self.lo[j] * other.hi[k];
                let back = self.hi[k] * other.lo[j] + self.lo[k] * other.hi[j];
                (hi, ((p_lo - m_lo) + rounding) + (forth - back))
            },
        )
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
    use super::super::tests::{DIMENSION, setting};
    use super::*;
    use crate::bvh::Level;
    use crate::kernel::search::each;
    use crate::kernel::tally::Tally;
    use crate::{Interval, Ray};
    use fearless_simd::dispatch;
    use glam::DVec3;

    type Case = (Ray, [DVec3; 3], Interval);

    #[inline(always)]
    fn gathered<S: Simd>(simd: S, cases: &[Case]) -> Rays<S> {
        let number =
            |f: &dyn Fn(&Case) -> f64| -> f64x8<S> { [0, 1, 2, 3, 4, 5, 6, 7].map(|i| f(&cases[i])).simd_into(simd) };
        let vectors = |f: &dyn Fn(&Case) -> DVec3| [0, 1, 2].map(|axis| number(&|case| f(case)[axis]));
        Rays {
            origin: vectors(&|(ray, ..)| ray.origin),
            direction: vectors(&|(ray, ..)| ray.direction),
            vertices: [0, 1, 2].map(|i| vectors(&|(_, t, _)| t[i])),
            within: [number(&|(.., within)| within.min), number(&|(.., within)| within.max)],
        }
    }

    /// Hits, and rays left to the scalar function.
    fn compare(cases: &[Case; 8]) -> [u32; 2] {
        let alone = cases.map(|(ray, t, within)| {
            let before = Tally::now();
            let hit = super::super::intersect(&ray, &t, within);
            (hit, Tally::now().since(before).refined > 0)
        });
        for (level, detected) in Level::all() {
            dispatch!(detected.token(), simd => {
                let eight = intersect(simd, &gathered(simd, cases));
                for (i, (hit, unsure)) in alone.into_iter().enumerate() {
                    let of = |x: f64x8<_>| x[i].to_bits();
                    assert_eq!(eight.unsure >> i & 1 == 1, unsure, "{level}: {:?}", cases[i]);
                    assert_eq!(eight.hit >> i & 1 == 1, hit.is_some() && !unsure, "{level}: {:?}", cases[i]);
                    if let (Some(hit), false) = (hit, unsure) {
                        let same = [of(eight.lambda), of(eight.error), of(eight.uv[0]), of(eight.uv[1])];
                        let alone = [hit.lambda, hit.error, hit.uv.x, hit.uv.y].map(f64::to_bits);
                        assert_eq!(same, alone, "{level}: {:?}", cases[i]);
                    }
                }
                assert!((eight.hit | eight.unsure) < 256);
            });
        }
        alone
            .iter()
            .fold([0; 2], |[hits, left], (hit, unsure)| [hits + u32::from(hit.is_some()), left + u32::from(*unsure)])
    }

    /// Ordinary and hard triangles; ties; ends of the interval at λ or an ulp beside it; numbers that leave the range.
    #[test]
    fn eight_answer_as_one_does_to_the_bit() {
        let (mut cases, mut seen) = (Vec::new(), [0; 3]);
        each(40_000, DIMENSION + 3, |x| {
            let (mut ray, mut t) = setting(x);
            let (kind, scale) = ((12.0 * x[DIMENSION].abs()) as u32, x[DIMENSION + 1]);
            let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
            let grid = |v: DVec3| (v * 16.0).round() / 8.0;
            match kind {
                0..=5 => {
                    (t, ray.origin) = ([v(0), v(3), v(6)], 5.0 * v(9));
                    ray.direction = t[0] + x[12].abs() * (t[1] - t[0]) + 0.4 * (t[2] - t[0]) - ray.origin;
                }
                6 => {
                    t = t.map(grid);
                    ray = Ray { origin: grid(ray.origin), direction: t[0] + 0.25 * (t[1] - t[0]) - grid(ray.origin) };
                }
                7 => {
                    let factor = 2f64.powf(1000.0 * scale);
                    (t, ray) = (t.map(|v| v * factor), Ray { origin: ray.origin * factor, ..ray });
                }
                8 => ray.direction *= 2f64.powf(1020.0 * scale),
                9 if scale > 0.8 => {
                    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0];
                    let at = (1e6 * scale) as usize;
                    let [a, b, c] = &mut t;
                    let v = [a, b, c, &mut ray.origin, &mut ray.direction];
                    v.into_iter().nth(at % 5).unwrap()[at / 5 % 3] = odd[at / 15 % 4];
                }
                _ => {}
            }
            let lambda = super::super::intersect(&ray, &t, Interval::LINE).map_or(0.0, |hit| hit.lambda);
            let within = match (8.0 * x[DIMENSION + 2].abs()) as u32 {
                0 => Interval { min: lambda, ..Interval::LINE },
                1 => Interval { min: lambda.next_down(), max: lambda.next_up() },
                2 => Interval { max: lambda * (1.0 - 1e-15), ..Interval::LINE },
                3 => Interval { max: f64::NAN, ..Interval::LINE },
                4 => Interval::FORWARD,
                _ => Interval::LINE,
            };
            cases.push((ray, t, within));
            if cases.len() == 8 {
                let [hits, unsure] = compare(cases.as_array().expect("eight"));
                seen = [seen[0] + 8, seen[1] + hits, seen[2] + unsure];
                cases.clear();
            }
        });
        let [rays, hits, unsure] = seen;
        println!("triangle, eight at once: {rays} rays, {hits} hits, {unsure} left to the scalar function");
        assert!(hits * 5 > rays && unsure * 10 > rays && unsure * 4 < rays * 3);
    }
}
