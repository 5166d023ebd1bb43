//! λ of rays, each of which the filter has proved to meet a triangle inside its limits: one, or eight at a time.
//!
//! The filter's margins also say how large the numbers are, so that nobody has to look: docs/numerics.md §4.

use super::Mesh;
use super::leaf::{Leaf, Margins, PLAIN, Probe, ROTATION, Spot, UNCERTIFIED, column, number};
use super::query::exactly;
use crate::bvh::{E, Frame, Stretch};
use crate::kernel::bound::TRIANGLE_CONDITION;
use crate::kernel::float::power;
use crate::kernel::rows;
use crate::kernel::triangle::{self, eight};
use crate::{Hit, Ray};
use fearless_simd::{Simd, f32x8, f64x4, f64x8, prelude::*};
use glam::{DVec2, DVec3};

/// The frame's unit over ε·[`TRIANGLE_CONDITION`]; infinite where products might leave the range of f64, so that no D
/// or N is as large as is asked of it.
pub(super) fn unit(frame: &Frame) -> f64 {
    let ordinary = (power(-60) < frame.unscale) & (frame.unscale < power(60));
    if ordinary { frame.unscale / (f64::from(E) * TRIANGLE_CONDITION) } else { f64::INFINITY }
}

/// How large |D| and |N| have to be, where |e₁||e₂| in largest components is not above `edges`, that λ is known well
/// enough.
#[inline(always)]
fn least(mesh: &Mesh, margins: &Margins, edges: f64) -> [f64; 2] {
    let ([d, s], by) = (margins.sizes(), edges * mesh.unit);
    [f64::from(d) * by, f64::from(s) * by]
}

/// The hit of a ray, to the bit as [`exactly`] has it; `None` where that has to be asked. `probe`: of a ray that is
/// taken as it is.
#[inline(always)]
pub(super) fn settle_one<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, spot: Spot, probe: Option<&Probe>) -> Option<Hit> {
    if UNCERTIFIED {
        return None;
    }
    let (leaf, lane) = spot.at(mesh);
    let least = probe.map(|probe| {
        let size = f64::from(leaf.size[lane]) * mesh.frame().unscale;
        least(mesh, &probe.margins, size * size)
    });
    let hit = triangle::passed(simd, ray, corners(simd, mesh, leaf, lane), leaf.has_plain_edges(lane), least)?;
    Some(Hit { part: leaf.number(lane), ..hit })
}

/// [`Leaf::vertices`], each in a register: x, y, z and z again.
#[inline(always)]
fn corners<S: Simd>(simd: S, mesh: &Mesh, leaf: &Leaf, lane: usize) -> [f64x4<S>; 3] {
    let four = |v: DVec3| f64x4::simd_from(simd, [v.x, v.y, v.z, v.z]);
    if !mesh.exact {
        let [a, b, c] = mesh.vertices(leaf.number(lane));
        return [four(a), four(b), four(c)];
    }
    let frame = mesh.frame();
    let (center, unscale) = (four(frame.center), f64x4::splat(simd, frame.unscale));
    let vertex = |i: usize| four(column(&leaf.vertices[i % 3], lane)) * unscale + center;
    let first = 3 - (leaf.id[lane] >> ROTATION) as usize;
    [vertex(first), vertex(first + 1), vertex(first + 2)]
}

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
    margins: &Margins,
    remembered: Remembered,
    hits: &mut [Option<Hit>],
) {
    let least = least(mesh, margins, 1.0);
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
        settle_eight(simd, mesh, rays, least, of, remembered, hits);
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
    least: [f64; 2],
    of: [usize; 8],
    Remembered { spots, ids, .. }: Remembered,
    hits: &mut [Option<Hit>],
) {
    let mut of_rays = [f64x8::splat(simd, 0.0); 8];
    for (row, &ray) in of_rays.iter_mut().zip(&of) {
        *row = rows::row(simd, &rays[ray]);
    }
    let [ox, oy, oz, dx, dy, dz, ..] = rows::columns(of_rays);
    let (mut spot, mut id, mut of_all) = ([Spot::of(0); 8], [0; 8], PLAIN);
    for (i, &ray) in of.iter().enumerate() {
        (spot[i], id[i]) = (Spot::of(spots[ray]), ids[ray]);
        of_all &= id[i];
    }
    let vertices = vertices(simd, mesh, &spot, &id);
    let rays_of_eight = eight::Rays { origin: [ox, oy, oz], direction: [dx, dy, dz], vertices };
    let eight::Passed { lambda, error, uv: [u, v], known } =
        eight::passed(simd, &rays_of_eight, of_all == PLAIN, least);
    let [lambda, error, u, v]: [[f64; 8]; 4] = [lambda.into(), error.into(), u.into(), v.into()];
    let found =
        |i: usize| Some(Hit { lambda: lambda[i], error: error[i], uv: DVec2::new(u[i], v[i]), part: number(id[i]) });
    if known == 0xff {
        for i in 0..8 {
            hits[of[i]] = found(i);
        }
        return;
    }
    for (i, &ray) in of.iter().enumerate() {
        hits[ray] = if known >> i & 1 == 1 {
            found(i)
        } else {
            let (ref asked, within) = rays[ray];
            exactly(simd, mesh, asked, within, Spot::of(spots[ray]))
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Interval;
    use crate::bvh::{Level, LocalRay};
    use crate::kernel::search::Random;
    use fearless_simd::dispatch;

    fn largest(v: DVec3) -> f64 {
        v.abs().max_element()
    }

    /// Triangles of all sizes, near the origin and far from it, as floats of 24 bits and of 53.
    #[test]
    fn the_filter_knows_how_large_the_numbers_are() {
        let mut random = Random::new(5);
        let (mut through, mut settled, mut closest) = (0, 0, f64::INFINITY);
        let meshes = [
            (1.0, 0.0, true),
            (1e-3, 0.0, false),
            (1e15, 0.0, true),
            (1e-15, 0.0, false),
            (1.0, 4096.0, true),
            (1e30, 0.0, true),
            (1e-30, 0.0, false),
        ];
        for (scale, center, short) in meshes {
            let mut vector = |by: f64| scale * by * DVec3::new(random.number(), random.number(), random.number());
            let rounded = |v: DVec3| {
                let v = v + DVec3::splat(center);
                if short { v.as_vec3().as_dvec3() } else { v }
            };
            let mut positions = Vec::new();
            for i in 0..300 {
                let (a, by) = (vector(0.9), f64::powi(2.0, -i % 12));
                positions.extend([a, a + vector(by), a + vector(by)].map(rounded));
            }
            let triangles = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let rays: Vec<Ray> = (0..300)
                .map(|i| {
                    let [a, b, c] = [0, 1, 2].map(|k| positions[3 * i + k]);
                    let origin = rounded(vector(3.0));
                    Ray::new(origin, (0.25 * a + 0.25 * b + 0.5 * c - origin) * f64::powi(2.0, i as i32 % 40 - 20))
                })
                .collect();
            let mesh = Mesh::new(positions, triangles).unwrap();
            for (i, ray) in rays.iter().enumerate() {
                let level = Level::all()[i % Level::all().len()].1;
                dispatch!(level.token(), simd => {
                    let local = LocalRay::new(simd, mesh.frame(), ray, Interval::FORWARD).expect("an ordinary ray");
                    let probe = Probe::new(&local, mesh.exact);
                    for (number, leaf) in mesh.leaves.iter().enumerate() {
                        let ends = local.ends;
                        let Some(verdict) = probe.test(simd, leaf, [ends.t_min, ends.t_max]) else { continue };
                        let outcome = verdict.outcome();
                        for lane in (0..8).filter(|lane| (outcome.maybe & outcome.through) >> lane & 1 == 1) {
                            let [a, b, c] = leaf.vertices(lane, &mesh);
                            let (m1, m2) = (largest(b - a), largest(c - a));
                            let size = f64::from(leaf.size[lane]) * mesh.frame().unscale;
                            assert!(m1 <= size && m2 <= size);
                            for (least, m) in least(&mesh, &probe.margins, m1 * m2)
                                .into_iter()
                                .zip([largest(ray.direction), largest(ray.origin - a)])
                            {
                                let enough = least * TRIANGLE_CONDITION / (m * m1 * m2);
                                assert!(enough > 1.0, "{ray:?}");
                                closest = closest.min(enough);
                            }
                            through += 1;
                            let spot = Spot { leaf: number as u32, lane: lane as u32 };
                            if ends.t_min < outcome.depths.interval(lane)[0]
                                && let Some(hit) = settle_one(simd, &mesh, ray, spot, Some(&probe))
                            {
                                assert_eq!(Some(hit), exactly(simd, &mesh, ray, Interval::FORWARD, spot));
                                settled += 1;
                            }
                        }
                    }
                });
            }
        }
        println!("{through} triangles certainly passed, λ of {settled} settled; sizes known to {closest}");
        assert!(through > 3000 && settled * 10 > through * 6 && settled * 10 < through * 9 && closest < 1.5);
    }
}
