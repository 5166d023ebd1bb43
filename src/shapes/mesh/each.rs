//! Closest and any hits of many rays. Where as many in a row as a bundle has go the same way they are walked together;
//! the answers are those of each ray alone.

use super::Mesh;
use super::leaf::{Margins, Spot, Verdict, filter};
use super::query::{self, exactly, nearer, occluded};
use super::seen::{OfSixteen, Seen, View, everywhere};
use super::settle::{Remembered, settle};
use crate::Hit;
use crate::bvh::{self, Bundle, RAYS, SIXTEENS, Start, Stretch};
use fearless_simd::{Simd, dispatch, f32x8, f32x16, prelude::*, u32x16};

/// `hits[i]` becomes the nearest hit of `rays[i]`.
pub(super) fn closest(mesh: &Mesh, rays: &[Stretch], hits: &mut [Option<Hit>]) {
    let mut bundle = None;
    bvh::each(
        rays,
        hits,
        |rays, many, hits| dispatch!(mesh.level.of_many(), simd => closest_with(simd, mesh, rays, many, &mut bundle, hits)),
        bvh::go_together,
        |(ray, within), hit| query::find_closest(mesh, ray, *within, hit),
    );
}

/// `hits[i]` becomes whether `rays[i]` hits anything.
pub(super) fn any(mesh: &Mesh, rays: &[Stretch], hits: &mut [bool]) {
    let mut bundle = None;
    bvh::each(
        rays,
        hits,
        |rays, many, hits| dispatch!(mesh.level.of_many(), simd => any_with(simd, mesh, rays, many, &mut bundle, hits)),
        |rays| bvh::go_together(rays) || bvh::end_together(rays),
        |(ray, within), hit| *hit = query::any(mesh, ray, *within),
    );
}

/// A bundle's walk, with what all its rays have in common.
struct Walk<'a, A> {
    mesh: &'a Mesh,
    rays: &'a [Stretch; RAYS],
    bundle: &'a mut Bundle,
    margins: Margins,
    view: Option<View>,
    answers: A,
}

/// What a bundle's rays want to know.
trait Answers<S: Simd>: Sized {
    /// Considers a triangle for sixteen rays, and answers which of them need no more.
    fn of_sixteen(walk: &mut Walk<Self>, simd: S, spot: Spot, sixteen: usize, verdict: &OfSixteen<S>) -> u32;

    /// Considers a triangle for one ray, which may pass it between the t of `depth`; `through`: certainly passes
    /// through its inside. `true` if the ray needs no more.
    fn of_one(walk: &mut Walk<Self>, simd: S, spot: Spot, ray: usize, through: bool, depth: [f32; 2]) -> bool;

    /// Keeps the bundle's t_max, after a leaf.
    fn shorten(walk: &mut Walk<Self>, simd: S);
}

impl<'a, A> Walk<'a, A> {
    #[inline(always)]
    fn new<S: Simd>(simd: S, mesh: &'a Mesh, rays: &'a [Stretch; RAYS], bundle: &'a mut Bundle, answers: A) -> Self {
        let (margins, reach) = Margins::of_bundle(bundle);
        let reach = f32x16::splat(simd, reach);
        for rays in &mut bundle.rays {
            let (t_min, t_max): (f32x16<S>, f32x16<S>) = (rays.t_min.simd_into(simd), rays.t_max.simd_into(simd));
            (rays.t_min, rays.t_max) = (t_min.max(-reach).into(), t_max.min(reach).into());
        }
        Self { mesh, rays, view: View::of(bundle), bundle, margins, answers }
    }

    /// Rays from one place: many triangle by triangle, few two by two.
    #[inline(always)]
    fn visit_from<S: Simd>(&mut self, simd: S, view: &View, number: u32, mut rays: u32)
    where
        A: Answers<S>,
    {
        let triangles = self.mesh.leaves[number as usize].triangles(simd, self.mesh.exact);
        let seen = Seen::new(simd, &triangles, view, &self.margins);
        let mut lanes = if rays.count_ones() <= FEW { 0xff } else { seen.lanes(simd, view) };
        if rays.count_ones() <= lanes.count_ones() * SIXTEENS as u32 {
            let seen = seen.twice(simd);
            while rays != 0 {
                let others = rays & (rays - 1);
                let two = [rays.trailing_zeros() as usize, others.trailing_zeros() as usize % RAYS];
                let mut sighting = seen.by_two(simd, &self.bundle.rays, two);
                if others == 0 {
                    sighting.maybe &= 0xff;
                }
                rays = others & others.wrapping_sub(1);
                if sighting.maybe != 0 {
                    self.of_rays(simd, number, two, &sighting.verdict(simd));
                }
            }
            return;
        }
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let [a, b] = &self.bundle.rays;
            let one = seen.one(simd, lane as usize);
            let (mut first, mut second) = (one.by(simd, a), one.by(simd, b));
            (first.maybe, second.maybe) = (first.maybe & rays, second.maybe & rays >> 16);
            if first.maybe | second.maybe == 0 {
                continue;
            }
            let spot = Spot { leaf: number, lane };
            let done = A::of_sixteen(self, simd, spot, 0, &first.verdict(simd));
            rays &= !(done | A::of_sixteen(self, simd, spot, 1, &second.verdict(simd)) << 16);
        }
    }

    /// Other rays: one by one, each with all triangles.
    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, number: u32, mut rays: u32)
    where
        A: Answers<S>,
    {
        let triangles = self.mesh.leaves[number as usize].triangles(simd, self.mesh.exact);
        while rays != 0 {
            let ray = rays.trailing_zeros() as usize % RAYS;
            rays &= rays - 1;
            let (sixteen, at) = (&self.bundle.rays[ray / 16], ray % 16);
            let [o, d] = [everywhere(simd, &sixteen.origin, at), everywhere(simd, &sixteen.direction, at)];
            let stretch = [f32x8::splat(simd, sixteen.t_min[at]), f32x8::splat(simd, sixteen.t_max[at])];
            if let Some(verdict) = filter(simd, &triangles, [o, d], &self.margins, stretch) {
                self.of_rays(simd, number, [ray; 2], &verdict);
            }
        }
    }

    /// What a ray meets in a leaf, or two: the first in the verdict's first eight lanes.
    #[inline(always)]
    fn of_rays<S, V, M>(&mut self, simd: S, leaf: u32, rays: [usize; 2], verdict: &Verdict<V, M>)
    where
        S: Simd,
        V: SimdFloat<S, Element = f32, Mask = M>,
        M: SimdMask<S>,
        A: Answers<S>,
    {
        let through = verdict.through.to_bitmask();
        let mut maybe = verdict.maybe;
        while maybe != 0 {
            let at = maybe.trailing_zeros() as usize % V::LEN;
            maybe &= maybe - 1;
            let (spot, depth) = (Spot { leaf, lane: at as u32 % 8 }, [verdict.low[at], verdict.high[at]]);
            if A::of_one(self, simd, spot, rays[at / 8 % 2], through >> at & 1 == 1, depth) {
                maybe &= !(0xff << (at & 8));
            }
        }
    }
}

/// As many rays, or fewer, are tested with all of a leaf's triangles.
const FEW: u32 = 4;

impl<S: Simd, A: Answers<S>> bvh::Together<S> for Walk<'_, A> {
    #[inline(always)]
    fn bundle(&self) -> &Bundle {
        self.bundle
    }

    #[inline(never)]
    fn leaf(&mut self, simd: S, leaf: u32, rays: u32) {
        simd.vectorize(
            #[inline(always)]
            || {
                match self.view {
                    Some(view) => self.visit_from(simd, &view, leaf, rays),
                    None => self.visit(simd, leaf, rays),
                }
                A::shorten(self, simd);
            },
        );
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn closest_with<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch; RAYS],
    many: usize,
    bundle: &mut Option<Bundle>,
    hits: &mut [Option<Hit>; RAYS],
) -> bool {
    if !bvh::go_together(rays) {
        return false;
    }
    let bundle = bundle.get_or_insert_with(|| Bundle::EMPTY);
    if !bundle.take(simd, mesh.frame(), rays, many, Start::Origin) {
        return false;
    }
    *hits = [None; RAYS];
    let nearests = Nearests {
        low: [[f32::INFINITY; 16]; SIXTEENS],
        spot: [[Spot::NOWHERE; 16]; SIXTEENS],
        id: [[0; 16]; SIXTEENS],
        remembered: 0,
        settled: 0,
        hits,
    };
    let mut walk = Walk::new(simd, mesh, rays, bundle, nearests);
    bvh::together(simd, &mesh.tree, &mut walk);
    walk.settle(simd);
    true
}

/// The search for the nearest hits. Of the triangles that are certainly hit the nearest so far is remembered, and
/// whatever may not be told from it is settled in f64 at once; λ of what remains when the walk has ended.
struct Nearests<'a> {
    /// Not above t of the triangle that is remembered, at `spot`; t_max is not below.
    low: [[f32; 16]; SIXTEENS],
    /// Leaf and lane.
    spot: [[u32; 16]; SIXTEENS],
    /// What the leaf has for its `id`: asked for at once, since by the end it may have left the cache.
    id: [[u32; 16]; SIXTEENS],
    /// The rays that have one remembered, and those that have one settled.
    remembered: u32,
    settled: u32,
    /// The nearest of those that were settled.
    hits: &'a mut [Option<Hit>; RAYS],
}

impl<S: Simd> Answers<S> for Nearests<'_> {
    #[inline(always)]
    fn of_sixteen(walk: &mut Walk<Self>, simd: S, spot: Spot, sixteen: usize, verdict: &OfSixteen<S>) -> u32 {
        let rays = &mut walk.bundle.rays[sixteen];
        let [low, t_max]: [f32x16<S>; 2] = [walk.answers.low[sixteen].simd_into(simd), rays.t_max.simd_into(simd)];
        let certain = verdict.through & rays.all_hold(simd, [verdict.low, verdict.high]);
        let nearer = certain & verdict.high.simd_lt(low);
        let farther = verdict.through & verdict.low.simd_gt(t_max);
        let ids = nearer.select(u32x16::splat(simd, spot.id(walk.mesh)), walk.answers.id[sixteen].simd_into(simd));
        walk.answers.id[sixteen] = ids.into();
        let spots = nearer.select(u32x16::splat(simd, spot.packed()), walk.answers.spot[sixteen].simd_into(simd));
        walk.answers.spot[sixteen] = spots.into();
        walk.answers.low[sixteen] = nearer.select(verdict.low, low).into();
        rays.t_max = nearer.select(verdict.high.min(t_max), t_max).into();
        walk.answers.remembered |= (nearer.to_bitmask() as u32) << (16 * sixteen);
        let mut open = verdict.maybe & !((nearer | farther).to_bitmask() as u32);
        while open != 0 {
            let lane = open.trailing_zeros() as usize;
            open &= open - 1;
            walk.confirm(simd, spot, 16 * sixteen + lane);
        }
        0
    }

    #[inline(always)]
    fn of_one(walk: &mut Walk<Self>, simd: S, spot: Spot, ray: usize, through: bool, [low, high]: [f32; 2]) -> bool {
        let (rays, lane) = (&mut walk.bundle.rays[ray / 16], ray % 16);
        let sure = rays.holds(lane, [low, high]);
        if through && low > rays.t_max[lane] {
            return false;
        }
        let of_ray = &mut walk.answers.low[ray / 16][lane];
        if !(through & sure & (high < *of_ray)) {
            walk.confirm(simd, spot, ray);
            return false;
        }
        *of_ray = low;
        walk.answers.remembered |= 1 << ray;
        walk.answers.spot[ray / 16][lane] = spot.packed();
        walk.answers.id[ray / 16][lane] = spot.id(walk.mesh);
        rays.shorten(simd, lane, high);
        false
    }

    #[inline(always)]
    fn shorten(walk: &mut Walk<Self>, simd: S) {
        // While one ray has met nothing its t_max is what it was, and mostly the largest still.
        let Nearests { remembered, settled, .. } = walk.answers;
        if (remembered | settled) & walk.bundle.asking == walk.bundle.asking {
            walk.bundle.shorten(simd);
        }
    }
}

impl Walk<'_, Nearests<'_>> {
    /// Settles whether and where a ray hits a triangle.
    #[inline(never)]
    fn confirm<S: Simd>(&mut self, simd: S, spot: Spot, ray: usize) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (ref asked, within) = self.rays[ray % RAYS];
                let Some(hit) = exactly(simd, self.mesh, asked, within, spot) else { return };
                let best = nearer(self.mesh, asked, self.answers.hits[ray % RAYS], hit);
                self.answers.hits[ray % RAYS] = Some(best);
                self.answers.settled |= 1 << ray;
                self.bundle.limit(ray, best.lambda + best.error);
            },
        );
    }

    /// Settles what is remembered.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S) {
        let Nearests { low, spot, id, remembered, settled, .. } = self.answers;
        let mut both = remembered & settled;
        while both != 0 {
            let ray = both.trailing_zeros() as usize % RAYS;
            both &= both - 1;
            if low[ray / 16][ray % 16] <= self.bundle.rays[ray / 16].t_max[ray % 16] {
                self.confirm(simd, Spot::of(spot[ray / 16][ray % 16]), ray);
            }
        }
        let remembered = Remembered {
            which: remembered & !settled & self.bundle.asking,
            spots: spot.as_flattened(),
            ids: id.as_flattened(),
        };
        settle(simd, self.mesh, self.rays, &self.margins, remembered, self.answers.hits);
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn any_with<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch; RAYS],
    many: usize,
    bundle: &mut Option<Bundle>,
    hits: &mut [bool; RAYS],
) -> bool {
    let (to_one_place, alike) = (bvh::end_together(rays), bvh::go_together(rays));
    if !(to_one_place || alike) {
        return false;
    }
    let bundle = bundle.get_or_insert_with(|| Bundle::EMPTY);
    // Rays to a light, from the light; t is then `max` − λ.
    let from_end = to_one_place && bundle.take(simd, mesh.frame(), rays, many, Start::End);
    if !(from_end || alike && bundle.take(simd, mesh.frame(), rays, many, Start::Origin)) {
        return false;
    }
    let mut walk = Walk::new(simd, mesh, rays, bundle, Until);
    bvh::together(simd, &mesh.tree, &mut walk);
    let asking = walk.bundle.asking;
    for (ray, hit) in hits.iter_mut().enumerate() {
        *hit = asking >> ray & 1 == 0;
    }
    true
}

/// The search until all rays are known to hit something.
struct Until;

impl<S: Simd> Answers<S> for Until {
    #[inline(always)]
    fn of_sixteen(walk: &mut Walk<Self>, simd: S, spot: Spot, sixteen: usize, verdict: &OfSixteen<S>) -> u32 {
        let rays = &walk.bundle.rays[sixteen];
        let certain = verdict.through & rays.all_hold(simd, [verdict.low, verdict.high]);
        let (certain, maybe) = (certain.to_bitmask() as u32, verdict.maybe);
        let (mut met, mut open) = (maybe & certain, maybe & !certain);
        while open != 0 {
            let lane = open.trailing_zeros() as usize;
            open &= open - 1;
            if walk.meets(simd, spot, 16 * sixteen + lane) {
                met |= 1 << lane;
            }
        }
        walk.end(met << (16 * sixteen));
        met
    }

    #[inline(always)]
    fn of_one(walk: &mut Walk<Self>, simd: S, spot: Spot, ray: usize, through: bool, depth: [f32; 2]) -> bool {
        let met = through & walk.bundle.rays[ray / 16].holds(ray % 16, depth) || walk.meets(simd, spot, ray);
        if met {
            walk.end(1 << ray);
        }
        met
    }

    #[inline(always)]
    fn shorten(walk: &mut Walk<Self>, _: S) {
        if walk.bundle.asking == 0 {
            walk.bundle.t_max = f32::NEG_INFINITY;
        }
    }
}

impl Walk<'_, Until> {
    #[inline(always)]
    fn meets<S: Simd>(&self, simd: S, spot: Spot, ray: usize) -> bool {
        let (ref asked, within) = self.rays[ray % RAYS];
        let (leaf, lane) = spot.at(self.mesh);
        occluded(simd, self.mesh, asked, within, leaf, lane)
    }

    /// These rays have their answers.
    #[inline(always)]
    fn end(&mut self, rays: u32) {
        self.bundle.asking &= !rays;
    }
}
