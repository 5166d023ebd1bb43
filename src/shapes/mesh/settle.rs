//! λ of many rays, each of which is known to meet a triangle: four at a time.

use super::Mesh;
use super::each::Stretch;
use super::leaf::{Spot, UNCERTIFIED, vertices_of_four};
use super::query::exactly;
use crate::Hit;
use crate::kernel::triangle::four;
use fearless_simd::{Simd, f64x4, prelude::*};
use glam::DVec2;

/// Answers those `rays` that have a bit in `which` with what they hit at their `spots`, to the bit as [`exactly`] has it.
#[inline(always)]
pub(super) fn settle<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch],
    mut which: u32,
    spots: &[u32],
    hits: &mut [Option<Hit>],
) {
    while which != 0 {
        let mut of = [0; 4];
        let count = which.count_ones().min(4) as usize;
        for ray in &mut of[..count] {
            *ray = which.trailing_zeros() as usize;
            which &= which - 1;
        }
        if count < FEWEST || UNCERTIFIED {
            for &ray in &of[..count] {
                let (ref asked, within) = rays[ray];
                hits[ray] = exactly(simd, mesh, asked, within, Spot::of(spots[ray]));
            }
        } else {
            for ray in count..4 {
                of[ray] = of[0];
            }
            settle_four(simd, mesh, rays, of, spots, hits);
        }
    }
}

/// Fewer are answered one by one.
const FEWEST: usize = 2;

#[inline(always)]
fn settle_four<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch],
    of: [usize; 4],
    spots: &[u32],
    hits: &mut [Option<Hit>],
) {
    let spot = |i: usize| Spot::of(spots[of[i]]);
    let (p, q, r, s) = (&rays[of[0]], &rays[of[1]], &rays[of[2]], &rays[of[3]]);
    let four::Four { lambda, error, uv: [u, v], hit, unsure } = four::intersect(
        simd,
        &four::Rays {
            origin: four::vectors(simd, [p.0.origin, q.0.origin, r.0.origin, s.0.origin]),
            direction: four::vectors(simd, [p.0.direction, q.0.direction, r.0.direction, s.0.direction]),
            vertices: vertices_of_four(simd, mesh, [spot(0), spot(1), spot(2), spot(3)]),
            within: [
                f64x4::simd_from(simd, [p.1.min, q.1.min, r.1.min, s.1.min]),
                f64x4::simd_from(simd, [p.1.max, q.1.max, r.1.max, s.1.max]),
            ],
        },
    );
    let [lambda, error, u, v]: [[f64; 4]; 4] = [lambda.into(), error.into(), u.into(), v.into()];
    for (i, &ray) in of.iter().enumerate() {
        let spot = spot(i);
        if hit >> i & 1 == 1 {
            let uv = DVec2::new(u[i], v[i]);
            hits[ray] = Some(Hit { lambda: lambda[i], error: error[i], uv, part: spot.number(mesh) });
        } else if unsure >> i & 1 == 1 {
            let (ref asked, within) = rays[ray];
            hits[ray] = exactly(simd, mesh, asked, within, spot);
        }
    }
}
