//! Closest and any hits of many rays. Where sixteen in a row go the same way they are walked as a bundle; the answers
//! are those of each ray alone.

use super::Mesh;
use super::leaf::{Leaf, Margins, Outcome, Probe, Thick, Vec8, filter, load};
use super::query::{self, Nearest, Sure, occluded};
use crate::bvh::{self, Bundle, LocalRay, RAYS};
use crate::{Hit, Interval, Ray};
use fearless_simd::{Simd, dispatch, prelude::*};

/// A ray and the stretch of it that counts.
type Stretch = (Ray, Interval);

/// `hits[i]` becomes the nearest hit of `rays[i]`.
pub(super) fn closest(mesh: &Mesh, rays: &[Stretch], hits: &mut [Option<Hit>]) {
    let alone = |stretches: &[Stretch], hits: &mut [Option<Hit>]| {
        for (hit, (ray, within)) in hits.iter_mut().zip(stretches) {
            *hit = query::closest(mesh, ray, *within);
        }
    };
    let (bundles, rest) = rays.as_chunks::<RAYS>();
    let (of_bundles, of_rest) = hits.as_chunks_mut::<RAYS>();
    for (rays, hits) in bundles.iter().zip(of_bundles) {
        let together = go_together(rays) && dispatch!(mesh.level.token(), simd => closest_with(simd, mesh, rays, hits));
        if !together {
            alone(rays, hits);
        }
    }
    alone(rest, of_rest);
}

/// `hits[i]` becomes whether `rays[i]` hits anything.
pub(super) fn any(mesh: &Mesh, rays: &[Stretch], hits: &mut [bool]) {
    let alone = |stretches: &[Stretch], hits: &mut [bool]| {
        for (hit, (ray, within)) in hits.iter_mut().zip(stretches) {
            *hit = query::any(mesh, ray, *within);
        }
    };
    let (bundles, rest) = rays.as_chunks::<RAYS>();
    let (of_bundles, of_rest) = hits.as_chunks_mut::<RAYS>();
    for (rays, hits) in bundles.iter().zip(of_bundles) {
        let together = go_together(rays) && dispatch!(mesh.level.token(), simd => any_with(simd, mesh, rays, hits));
        if !together {
            alone(rays, hits);
        }
    }
    alone(rest, of_rest);
}

/// A first look that costs next to nothing: whether a few directions are alike. [`Bundle::around`] looks at all.
fn go_together(rays: &[Stretch; RAYS]) -> bool {
    let first = rays[0].0.direction;
    let close = 0.25 * first.abs().max_element();
    [5, 10, 15].iter().all(|&i| (rays[i].0.direction - first).abs().max_element() <= close)
}

/// Eight rays, by lane.
#[derive(Clone, Copy)]
struct Group {
    origin: [[f32; 8]; 3],
    direction: [[f32; 8]; 3],
    t_min: [f32; 8],
    /// The end of what matters; −∞ for a ray that has its answer.
    last: [f32; 8],
}

/// What all rays of a bundle have in common, and what each has for itself.
struct Common<S: Simd> {
    thick: Thick<S>,
    margins: Margins,
    groups: [Group; 2],
}

impl<S: Simd> Common<S> {
    #[inline(always)]
    fn new(simd: S, mesh: &Mesh, bundle: &Bundle, rays: &[LocalRay; RAYS]) -> Self {
        let mut groups = [Group { origin: [[0.0; 8]; 3], direction: [[0.0; 8]; 3], t_min: [0.0; 8], last: [0.0; 8] }; 2];
        let mut margins: Option<Margins> = None;
        for (i, ray) in rays.iter().enumerate() {
            let probe = Probe::new(ray, mesh.exact);
            let (group, lane) = (&mut groups[i / 8], i % 8);
            for axis in 0..3 {
                group.origin[axis][lane] = ray.origin[axis];
                group.direction[axis][lane] = ray.direction[axis];
            }
            (group.t_min[lane], group.last[lane]) = (probe.t_min, probe.last(ray.t_max));
            margins = Some(margins.map_or(probe.margins, |m| m.max(probe.margins)));
        }
        let margins = margins.expect("a bundle has rays");
        Self { thick: Thick::new(simd, bundle, margins), margins, groups }
    }

    /// Calls `each` for every triangle and group of rays of which some may meet it, until it answers no.
    #[inline(always)]
    fn visit(
        &mut self,
        simd: S,
        leaf: &Leaf,
        exact: bool,
        mut each: impl FnMut(&mut [f32; 8], u32, usize, &Outcome) -> bool,
    ) {
        let mut triangles = self.thick.test(simd, &leaf.triangles(simd, exact));
        while triangles != 0 {
            let lane = triangles.trailing_zeros();
            triangles &= triangles - 1;
            let triangle = leaf.triangle(simd, lane as usize, exact);
            for (i, group) in self.groups.iter_mut().enumerate() {
                let ray: [Vec8<S>; 2] = [load(simd, &group.origin), load(simd, &group.direction)];
                let stretch = [group.t_min.simd_into(simd), group.last.simd_into(simd)];
                if let Some(outcome) = filter(simd, &triangle, ray, &self.margins, stretch)
                    && !each(&mut group.last, lane, i, &outcome)
                {
                    return;
                }
            }
        }
    }
}

/// The rays in the frame, and their bundle if they are one.
#[inline(always)]
fn gather<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS]) -> Option<([LocalRay; RAYS], Bundle)> {
    let first = LocalRay::new(simd, mesh.frame(), &rays[0].0, rays[0].1)?;
    let mut locals = [first; RAYS];
    for (local, (ray, within)) in locals.iter_mut().zip(rays).skip(1) {
        *local = LocalRay::new(simd, mesh.frame(), ray, *within)?;
    }
    let bundle = Bundle::around(simd, &locals)?;
    Some((locals, bundle))
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn closest_with<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS], hits: &mut [Option<Hit>; RAYS]) -> bool {
    let Some((locals, bundle)) = gather(simd, mesh, rays) else { return false };
    let t_max = locals.iter().fold(f32::NEG_INFINITY, |m, l| m.max(l.t_max));
    let mut walk = Together {
        mesh,
        common: Common::new(simd, mesh, &bundle, &locals),
        sure: std::array::from_fn(|i| Sure::new(&locals[i], rays[i].1)),
        nearest: std::array::from_fn(|i| Nearest::new(mesh, &rays[i].0, rays[i].1, &locals[i])),
        t_max,
    };
    bvh::closest(simd, &mesh.tree, &bundle.lanes(simd), t_max, &mut walk);
    for (hit, nearest) in hits.iter_mut().zip(walk.nearest) {
        *hit = nearest.settle(simd);
    }
    true
}

/// A bundle's walk to the nearest hits.
struct Together<'a, S: Simd> {
    mesh: &'a Mesh,
    common: Common<S>,
    sure: [Sure; RAYS],
    nearest: [Nearest<'a>; RAYS],
    /// The largest t that matters to one of them.
    t_max: f32,
}

impl<S: Simd> bvh::Closest<S> for Together<'_, S> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, leaf: u32) -> f32 {
        self.visit(simd, leaf);
        self.t_max
    }
}

impl<S: Simd> Together<'_, S> {
    #[inline(never)]
    fn visit(&mut self, simd: S, number: u32) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (nearest, sure) = (&mut self.nearest, &self.sure);
                let mut shorter = false;
                let leaf = &self.mesh.leaves[number as usize];
                self.common.visit(simd, leaf, self.mesh.exact, |last, lane, group, outcome| {
                    let mut rays = outcome.maybe;
                    while rays != 0 {
                        let ray = rays.trailing_zeros() as usize & 7;
                        rays &= rays - 1;
                        let (through, depth) = (outcome.through >> ray & 1 == 1, outcome.depths.interval(ray));
                        let at = 8 * group + ray;
                        nearest[at].consider(simd, sure[at], [number, lane], through, depth);
                        if nearest[at].t_max < last[ray] {
                            last[ray] = nearest[at].t_max;
                            shorter = true;
                        }
                    }
                    true
                });
                if shorter {
                    self.t_max = self.nearest.iter().fold(f32::NEG_INFINITY, |m, n| if n.t_max > m { n.t_max } else { m });
                }
            },
        );
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn any_with<S: Simd>(simd: S, mesh: &Mesh, rays: &[Stretch; RAYS], hits: &mut [bool; RAYS]) -> bool {
    let Some((locals, bundle)) = gather(simd, mesh, rays) else { return false };
    let t_max = locals.iter().fold(f32::NEG_INFINITY, |m, l| m.max(l.t_max));
    let mut walk = Until {
        mesh,
        rays,
        common: Common::new(simd, mesh, &bundle, &locals),
        sure: std::array::from_fn(|i| Sure::new(&locals[i], rays[i].1)),
        hits,
    };
    *walk.hits = [false; RAYS];
    bvh::any(simd, &mesh.tree, &bundle.lanes(simd), t_max, &mut walk);
    true
}

/// A bundle's walk until all rays are known to hit something.
struct Until<'a, S: Simd> {
    mesh: &'a Mesh,
    rays: &'a [Stretch; RAYS],
    common: Common<S>,
    sure: [Sure; RAYS],
    hits: &'a mut [bool; RAYS],
}

impl<S: Simd> bvh::Any<S> for Until<'_, S> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, leaf: u32) -> bool {
        self.visit(simd, leaf)
    }
}

impl<S: Simd> Until<'_, S> {
    /// Whether all rays are done.
    #[inline(never)]
    fn visit(&mut self, simd: S, leaf: u32) -> bool {
        simd.vectorize(
            #[inline(always)]
            || {
                let (hits, sure, given) = (&mut *self.hits, &self.sure, self.rays);
                let (leaf, mesh) = (&self.mesh.leaves[leaf as usize], self.mesh);
                self.common.visit(simd, leaf, mesh.exact, |last, lane, group, outcome| {
                    let mut rays = outcome.maybe;
                    while rays != 0 {
                        let ray = rays.trailing_zeros() as usize & 7;
                        rays &= rays - 1;
                        let at = 8 * group + ray;
                        if hits[at] {
                            continue;
                        }
                        let certain = outcome.through >> ray & 1 == 1 && sure[at].holds(outcome.depths.interval(ray));
                        let (ref r, within) = given[at];
                        if certain || occluded(simd, mesh, r, within, leaf, lane as usize) {
                            hits[at] = true;
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
