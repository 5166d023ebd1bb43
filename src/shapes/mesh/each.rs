//! Closest and any hits of many rays. Where sixteen in a row go the same way they are walked as a bundle; the answers
//! are those of each ray alone.

use super::Mesh;
use super::leaf::{Leaf, Outcome, Thick, Vec8, filter, load};
use super::query::{self, Nearest, occluded};
use crate::bvh::{self, Bundle, Eight, Limits, RAYS, Sure};
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

/// A bundle in which more triangles than this are in question for some ray is too wide for its mesh: the rays are faster
/// alone.
const MOST_TRIANGLES: u32 = 80;

/// What all rays of a bundle have in common.
struct Common<S: Simd> {
    thick: Thick<S>,
    /// The ends of what matters are kept up to date: −∞ for a ray that has its answer.
    rays: [Eight; RAYS / 8],
    tested: u32,
}

impl<S: Simd> Common<S> {
    #[inline(always)]
    fn new(simd: S, bundle: &Bundle) -> Self {
        let mut common = Self { thick: Thick::new(simd, bundle), rays: bundle.rays, tested: 0 };
        let reach = f32x8::splat(simd, common.thick.reach);
        for eight in &mut common.rays {
            let (t_min, t_max): (f32x8<S>, f32x8<S>) = (eight.t_min.simd_into(simd), eight.t_max.simd_into(simd));
            (eight.t_min, eight.t_max) = (t_min.max(-reach).into(), t_max.min(reach).into());
        }
        common
    }

    fn too_wide(&self) -> bool {
        self.tested > MOST_TRIANGLES
    }

    /// Calls `each` for every triangle and eight rays of which some may meet it, until it answers no.
    #[inline(always)]
    fn visit(
        &mut self,
        simd: S,
        leaf: &Leaf,
        exact: bool,
        mut each: impl FnMut(&mut [f32; 8], u32, usize, &Outcome) -> bool,
    ) {
        let mut triangles = self.thick.test(simd, &leaf.triangles(simd, exact));
        self.tested += triangles.count_ones();
        while triangles != 0 {
            let lane = triangles.trailing_zeros();
            triangles &= triangles - 1;
            let triangle = leaf.triangle(simd, lane as usize, exact);
            for (i, eight) in self.rays.iter_mut().enumerate() {
                let ray: [Vec8<S>; 2] = [load(simd, &eight.origin), load(simd, &eight.direction)];
                let stretch = [eight.t_min.simd_into(simd), eight.t_max.simd_into(simd)];
                if let Some(outcome) = filter(simd, &triangle, ray, &self.thick.margins, stretch)
                    && !each(&mut eight.t_max, lane, 8 * i, &outcome)
                {
                    return;
                }
            }
        }
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn closest_with<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS], hits: &mut [Option<Hit>; RAYS]) -> bool {
    let Some(bundle) = Bundle::new(simd, mesh.frame(), rays) else { return false };
    let mut walk = Together {
        mesh,
        common: Common::new(simd, &bundle),
        nearest: std::array::from_fn(|i| {
            let (ray, within) = &rays[i];
            Nearest::new(
                mesh,
                ray,
                *within,
                Limits::PLAIN,
                Sure::new(Limits::PLAIN, *within),
                bundle.rays[i / 8].t_max[i % 8],
            )
        }),
        t_max: bundle.t_max,
    };
    bvh::closest(simd, &mesh.tree, &bundle.lanes(simd), bundle.t_max, &mut walk);
    if walk.common.too_wide() {
        return false;
    }
    for (hit, nearest) in hits.iter_mut().zip(&mut walk.nearest) {
        nearest.settle(simd, hit);
    }
    true
}

/// A bundle's walk to the nearest hits.
struct Together<'a, S: Simd> {
    mesh: &'a Mesh,
    common: Common<S>,
    nearest: [Nearest<'a>; RAYS],
    /// The largest t that matters to one of them.
    t_max: f32,
}

impl<S: Simd> bvh::Closest<S> for Together<'_, S> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, leaf: u32) -> f32 {
        self.visit(simd, leaf);
        // Nothing matters to a bundle that is given up.
        if self.common.too_wide() { f32::NEG_INFINITY } else { self.t_max }
    }
}

impl<S: Simd> Together<'_, S> {
    #[inline(never)]
    fn visit(&mut self, simd: S, number: u32) {
        simd.vectorize(
            #[inline(always)]
            || {
                let nearest = &mut self.nearest;
                let mut shorter = false;
                let leaf = &self.mesh.leaves[number as usize];
                self.common.visit(simd, leaf, self.mesh.exact, |last, lane, eight, outcome| {
                    let mut rays = outcome.maybe;
                    while rays != 0 {
                        let ray = rays.trailing_zeros() as usize & 7;
                        rays &= rays - 1;
                        let (through, depth) = (outcome.through >> ray & 1 == 1, outcome.depths.interval(ray));
                        let nearest = &mut nearest[eight + ray];
                        nearest.consider(simd, [number, lane], through, depth);
                        if nearest.t_max < last[ray] {
                            last[ray] = nearest.t_max;
                            shorter = true;
                        }
                    }
                    true
                });
                if shorter {
                    let latest = |n: &Nearest| n.t_max;
                    self.t_max = self.nearest.iter().map(latest).fold(f32::NEG_INFINITY, f32::max);
                }
            },
        );
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn any_with<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS], hits: &mut [bool; RAYS]) -> bool {
    let Some(bundle) = Bundle::new(simd, mesh.frame(), rays) else { return false };
    let mut walk = Until { mesh, rays, common: Common::new(simd, &bundle), hits };
    *walk.hits = [false; RAYS];
    bvh::any(simd, &mesh.tree, &bundle.lanes(simd), bundle.t_max, &mut walk);
    !walk.common.too_wide() || !walk.hits.contains(&false)
}

/// A bundle's walk until all rays are known to hit something.
struct Until<'a, S: Simd> {
    mesh: &'a Mesh,
    rays: &'a [Stretch; RAYS],
    common: Common<S>,
    hits: &'a mut [bool; RAYS],
}

impl<S: Simd> bvh::Any<S> for Until<'_, S> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, leaf: u32) -> bool {
        self.visit(simd, leaf) || self.common.too_wide()
    }
}

impl<S: Simd> Until<'_, S> {
    /// Whether all rays are done.
    #[inline(never)]
    fn visit(&mut self, simd: S, leaf: u32) -> bool {
        simd.vectorize(
            #[inline(always)]
            || {
                let (hits, given) = (&mut *self.hits, self.rays);
                let (leaf, mesh) = (&self.mesh.leaves[leaf as usize], self.mesh);
                self.common.visit(simd, leaf, mesh.exact, |last, lane, eight, outcome| {
                    let mut rays = outcome.maybe;
                    while rays != 0 {
                        let ray = rays.trailing_zeros() as usize & 7;
                        rays &= rays - 1;
                        let (ref origin, within) = given[eight + ray];
                        if hits[eight + ray] {
                            continue;
                        }
                        let sure = Sure::new(Limits::PLAIN, within);
                        let certain = outcome.through >> ray & 1 == 1 && sure.holds(outcome.depths.interval(ray));
                        if certain || occluded(simd, mesh, origin, within, leaf, lane as usize) {
                            hits[eight + ray] = true;
                            last[ray] = f32::NEG_INFINITY;
                        }
                    }
                    hits.contains(&false)
                });
                !hits.contains(&false)
            },
        )
    }
}
