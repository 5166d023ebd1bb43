//! λ of many rays, each of which is known to meet a triangle: eight at a time.

use super::Mesh;
use super::each::Stretch;
use super::leaf::{ROTATION, Spot, UNCERTIFIED, number};
use super::query::exactly;
use crate::Hit;
use crate::kernel::rows;
use crate::kernel::triangle::eight;
use fearless_simd::{Simd, f32x8, f64x4, f64x8, prelude::*};
use glam::{DVec2, DVec3};

/// What rays hit.
#[derive(Clone, Copy)]
pub(super) struct Remembered<'a> {
    /// The rays that do.
    pub(super) which: u32,
    /// Where: leaf and lane.
    pub(super) spots: &'a [u32],
    /// The leaf's `id` of that lane.
    pub(super) ids: &'a [u32],
}

/// Answers rays with what they are remembered to hit, to the bit as [`exactly`] has it.
#[inline(always)]
pub(super) fn settle<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch],
    remembered: Remembered,
    hits: &mut [Option<Hit>],
) {
    let mut which = remembered.which;
    while which != 0 {
        let count = which.count_ones();
        if count < FEWEST || UNCERTIFIED {
            let ray = which.trailing_zeros() as usize;
            which &= which - 1;
            let (ref asked, within) = rays[ray];
            hits[ray] = exactly(simd, mesh, asked, within, Spot::of(remembered.spots[ray]));
            continue;
        }
        let mut of = [0; 8];
        for ray in &mut of {
            // The last stands for those that are not there.
            *ray = which.trailing_zeros() as usize;
            let others = which & (which - 1);
            which = if others == 0 { which } else { others };
        }
        which = if count > 8 { which } else { 0 };
        settle_eight(simd, mesh, rays, of, remembered, hits);
    }
}

/// Fewer are answered one by one.
const FEWEST: u32 = 2;

/// x, y and z of eight vectors.
#[inline(always)]
fn vectors<S: Simd>(simd: S, v: &[DVec3; 8]) -> eight::Vectors<S> {
    let [a, b, c, d, e, f, g, h] = v;
    let (ab, cd, ef, gh) = (two(simd, a, b), two(simd, c, d), two(simd, e, f), two(simd, g, h));
    let ((a, b), (c, d)) = (ab.deinterleave(cd), ef.deinterleave(gh));
    let ((x, z), (y, _)) = (a.deinterleave(c), b.deinterleave(d));
    [x, y, z]
}

#[inline(always)]
fn two<S: Simd>(simd: S, a: &DVec3, b: &DVec3) -> f64x8<S> {
    f64x4::simd_from(simd, [a.x, a.y, a.z, 0.0]).combine(f64x4::simd_from(simd, [b.x, b.y, b.z, 0.0]))
}

/// The vertices of eight triangles, each in a register of its own.
#[inline(always)]
fn vertices<S: Simd>(simd: S, mesh: &Mesh, spots: &[Spot; 8], ids: &[u32; 8]) -> [eight::Vectors<S>; 3] {
    if !mesh.exact {
        let mut vertices = [[DVec3::ZERO; 8]; 3];
        for (i, spot) in spots.iter().enumerate() {
            let [a, b, c] = spot.vertices(mesh);
            (vertices[0][i], vertices[1][i], vertices[2][i]) = (a, b, c);
        }
        let [a, b, c] = &vertices;
        return [vectors(simd, a), vectors(simd, b), vectors(simd, c)];
    }
    let [a, b, c, d, e, f, g, h] = spots;
    let leaves = [a.at(mesh), b.at(mesh), c.at(mesh), d.at(mesh), e.at(mesh), f.at(mesh), g.at(mesh), h.at(mesh)];
    let frame = mesh.frame();
    let unscale = f64x8::splat(simd, frame.unscale);
    let mut turns = [0.0; 8];
    for (turn, id) in turns.iter_mut().zip(ids) {
        *turn = (id >> ROTATION) as f32;
    }
    let turns = widened(simd, turns);
    let (once, twice) = (turns.simd_eq(f64x8::splat(simd, 1.0)), turns.simd_eq(f64x8::splat(simd, 2.0)));
    let mut axes = [[unscale; 3]; 3];
    for (axis, turned) in axes.iter_mut().enumerate() {
        let center = f64x8::splat(simd, frame.center[axis]);
        let mut v = [unscale; 3];
        for (i, v) in v.iter_mut().enumerate() {
            let mut x = [0.0; 8];
            for (x, (leaf, lane)) in x.iter_mut().zip(&leaves) {
                *x = leaf.vertices[i][axis][*lane];
            }
            *v = widened(simd, x) * unscale + center;
        }
        *turned = [
            once.select(v[2], twice.select(v[1], v[0])),
            once.select(v[0], twice.select(v[2], v[1])),
            once.select(v[1], twice.select(v[0], v[2])),
        ];
    }
    let [x, y, z] = axes;
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}

#[inline(always)]
fn widened<S: Simd>(simd: S, x: [f32; 8]) -> f64x8<S> {
    let x = f32x8::simd_from(simd, x);
    x.combine(x).widen().0
}

#[inline(always)]
fn settle_eight<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch],
    of: [usize; 8],
    Remembered { spots, ids, .. }: Remembered,
    hits: &mut [Option<Hit>],
) {
    let mut of_rays = [f64x8::splat(simd, 0.0); 8];
    for (row, &ray) in of_rays.iter_mut().zip(&of) {
        *row = rows::row(simd, &rays[ray]);
    }
    let [ox, oy, oz, dx, dy, dz, min, max] = rows::columns(of_rays);
    let (mut spot, mut id) = ([Spot::of(0); 8], [0; 8]);
    for (i, &ray) in of.iter().enumerate() {
        (spot[i], id[i]) = (Spot::of(spots[ray]), ids[ray]);
    }
    let vertices = vertices(simd, mesh, &spot, &id);
    let eight::Eight { lambda, error, uv: [u, v], hit, unsure } = eight::intersect(
        simd,
        &eight::Rays { origin: [ox, oy, oz], direction: [dx, dy, dz], vertices, within: [min, max] },
    );
    let [lambda, error, u, v]: [[f64; 8]; 4] = [lambda.into(), error.into(), u.into(), v.into()];
    let found =
        |i: usize| Some(Hit { lambda: lambda[i], error: error[i], uv: DVec2::new(u[i], v[i]), part: number(id[i]) });
    if hit == 0xff {
        for i in 0..8 {
            hits[of[i]] = found(i);
        }
        return;
    }
    for (i, &ray) in of.iter().enumerate() {
        if hit >> i & 1 == 1 {
            hits[ray] = found(i);
        } else if unsure >> i & 1 == 1 {
            let (ref asked, within) = rays[ray];
            hits[ray] = exactly(simd, mesh, asked, within, Spot::of(spots[ray]));
        }
    }
}
