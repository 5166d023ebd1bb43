//! Closest and any hits of many rays. Where sixteen in a row go the same way they are walked as a bundle; the answers
//! are those of each ray alone.

use super::Mesh;
use super::leaf::{Leaf, Margins, everywhere, filter};
use super::query::{self, Nearest, occluded};
use crate::bvh::{self, Bundle, Limits, RAYS, Sure};
use crate::{Hit, Interval, Ray};
use fearless_simd::{Simd, dispatch, f32x8, prelude::*};

/// A ray and the stretch of it that counts.
type Stretch = (Ray, Interval);

/// `hits[i]` becomes the nearest hit of `rays[i]`.
pub(super) fn closest(mesh: &Mesh, rays: &[Stretch], hits: &mut [Option<Hit>]) {
    each(
        rays,
        hits,
        |rays, hits| dispatch!(mesh.level.token(), simd => closest_with(simd, mesh, rays, hits)),
        |(ray, within)| query::closest(mesh, ray, *within),
    );
}

/// `hits[i]` becomes whether `rays[i]` hits anything.
pub(super) fn any(mesh: &Mesh, rays: &[Stretch], hits: &mut [bool]) {
    each(
        rays,
        hits,
        |rays, hits| dispatch!(mesh.level.token(), simd => any_with(simd, mesh, rays, hits)),
        |(ray, within)| query::any(mesh, ray, *within),
    );
}

/// Sixteen at a time by `together`, which may refuse, the others one by one. After a refusal bundles are tried ever more
/// seldom, so that rays without any order cost no more than alone.
fn each<T>(
    rays: &[Stretch],
    hits: &mut [T],
    together: impl Fn(&[Stretch; RAYS], &mut [T; RAYS]) -> bool,
    alone: impl Fn(&Stretch) -> T,
) {
    const MOST_PATIENT: u32 = 64;
    let (mut wait, mut patience) = (0, 1);
    let (bundles, rest) = rays.as_chunks::<RAYS>();
    let (of_bundles, of_rest) = hits.as_chunks_mut::<RAYS>();
    for (rays, hits) in bundles.iter().zip(of_bundles) {
        if wait > 0 {
            wait -= 1;
        } else if go_together(rays) && together(rays, hits) {
            patience = 1;
            continue;
        } else {
            wait = patience;
            patience = (2 * patience).min(MOST_PATIENT);
        }
        for (hit, ray) in hits.iter_mut().zip(rays) {
            *hit = alone(ray);
        }
    }
    for (hit, ray) in of_rest.iter_mut().zip(rest) {
        *hit = alone(ray);
    }
}

/// A first look that costs next to nothing: whether a few directions are alike. [`Bundle::new`] looks at all.
fn go_together(rays: &[Stretch; RAYS]) -> bool {
    let first = rays[0].0.direction;
    let close = 0.25 * first.abs().max_element();
    [5, 10, 15].iter().all(|&i| (rays[i].0.direction - first).abs().max_element() <= close)
}

/// What all rays of a bundle have in common.
struct Common<'a> {
    mesh: &'a Mesh,
    bundle: Bundle,
    margins: Margins,
}

impl<'a> Common<'a> {
    #[inline(always)]
    fn new<S: Simd>(simd: S, mesh: &'a Mesh, mut bundle: Bundle) -> Self {
        let (margins, reach) = Margins::of_bundle(&bundle);
        let reach = f32x8::splat(simd, reach);
        for eight in &mut bundle.rays {
            let (t_min, t_max): (f32x8<S>, f32x8<S>) = (eight.t_min.simd_into(simd), eight.t_max.simd_into(simd));
            (eight.t_min, eight.t_max) = (t_min.max(-reach).into(), t_max.min(reach).into());
        }
        Self { mesh, bundle, margins }
    }

    /// Calls `each` for every triangle of the leaf that one of `rays` may meet: with the triangle's lane, the ray, whether its line
    /// certainly passes through, and the interval of t. It is given, and answers with, the t from which on nothing matters
    /// to the ray.
    #[inline(always)]
    fn visit<S: Simd>(
        &mut self,
        simd: S,
        leaf: &Leaf,
        mut rays: u32,
        mut each: impl FnMut(usize, usize, bool, [f32; 2], f32) -> f32,
    ) {
        let triangles = leaf.triangles(simd, self.mesh.exact);
        while rays != 0 {
            let ray = rays.trailing_zeros() as usize & 15;
            rays &= rays - 1;
            let (eight, at) = (&mut self.bundle.rays[ray / 8], ray % 8);
            // It got its answer after it was noted for this leaf.
            if eight.t_max[at] == f32::NEG_INFINITY {
                continue;
            }
            let [o, d] = [everywhere(simd, &eight.origin, at), everywhere(simd, &eight.direction, at)];
            let stretch = [f32x8::splat(simd, eight.t_min[at]), f32x8::splat(simd, eight.t_max[at])];
            let Some(outcome) = filter(simd, &triangles, [o, d], &self.margins, stretch) else { continue };
            let mut lanes = outcome.maybe;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize & 7;
                lanes &= lanes - 1;
                let (through, depth) = (outcome.through >> lane & 1 == 1, outcome.depths.interval(lane));
                eight.t_max[at] = each(lane, ray, through, depth, eight.t_max[at]);
            }
        }
        self.bundle.shorten(simd);
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn closest_with<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS], hits: &mut [Option<Hit>; RAYS]) -> bool {
    let Some(bundle) = Bundle::new(simd, mesh.frame(), rays) else { return false };
    let mut walk = Nearests {
        nearest: std::array::from_fn(|i| {
            let (ray, within) = &rays[i];
            let eight = &bundle.rays[i / 8];
            Nearest::new(mesh, ray, *within, Limits::PLAIN, eight.sure(i % 8), eight.t_max[i % 8])
        }),
        common: Common::new(simd, mesh, bundle),
    };
    bvh::together(simd, &mesh.tree, &mut walk);
    for (hit, nearest) in hits.iter_mut().zip(&mut walk.nearest) {
        nearest.settle(simd, hit);
    }
    true
}

/// A bundle's walk to the nearest hits.
struct Nearests<'a> {
    common: Common<'a>,
    nearest: [Nearest<'a>; RAYS],
}

impl<S: Simd> bvh::Together<S> for Nearests<'_> {
    #[inline(always)]
    fn bundle(&self) -> &Bundle {
        &self.common.bundle
    }

    #[inline(never)]
    fn leaf(&mut self, simd: S, number: u32, rays: u32) {
        simd.vectorize(
            #[inline(always)]
            || {
                let nearest = &mut self.nearest;
                let leaf = &self.common.mesh.leaves[number as usize];
                self.common.visit(simd, leaf, rays, |lane, ray, through, depth, last| {
                    let nearest = &mut nearest[ray];
                    nearest.consider(simd, [number, lane as u32], through, depth);
                    if nearest.t_max < last { nearest.t_max } else { last }
                });
            },
        );
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn any_with<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS], hits: &mut [bool; RAYS]) -> bool {
    let Some(bundle) = Bundle::new(simd, mesh.frame(), rays) else { return false };
    *hits = [false; RAYS];
    let sure = std::array::from_fn(|i| bundle.rays[i / 8].sure(i % 8));
    let mut walk = Until { rays, sure, common: Common::new(simd, mesh, bundle), hits };
    bvh::together(simd, &mesh.tree, &mut walk);
    true
}

/// A bundle's walk until all rays are known to hit something.
struct Until<'a> {
    rays: &'a [Stretch; RAYS],
    sure: [Sure; RAYS],
    common: Common<'a>,
    hits: &'a mut [bool; RAYS],
}

impl<S: Simd> bvh::Together<S> for Until<'_> {
    #[inline(always)]
    fn bundle(&self) -> &Bundle {
        &self.common.bundle
    }

    #[inline(never)]
    fn leaf(&mut self, simd: S, leaf: u32, rays: u32) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (hits, given, sure, mesh) = (&mut *self.hits, self.rays, &self.sure, self.common.mesh);
                let leaf = &mesh.leaves[leaf as usize];
                self.common.visit(simd, leaf, rays, |lane, ray, through, depth, last| {
                    let (ref origin, within) = given[ray];
                    hits[ray] = hits[ray]
                        || through && sure[ray].holds(depth)
                        || occluded(simd, mesh, origin, within, leaf, lane);
                    if hits[ray] { f32::NEG_INFINITY } else { last }
                });
            },
        );
    }
}
