//! Closest and any hits of many rays. Where as many in a row as a bundle has go the same way they are walked together; the answers
//! are those of each ray alone.

use super::Mesh;
use super::leaf::{Margins, OfEight, Spot, filter};
use super::query::{self, exactly, nearer, occluded};
use super::seen::{OfSixteen, Seen, View, everywhere};
use super::settle::{Remembered, settle};
use crate::bvh::{self, Bundle, Limits, RAYS, SIXTEENS, Start};
use crate::{Hit, Interval, Ray};
use fearless_simd::{Simd, dispatch, f32x8, f32x16, prelude::*, u32x16};
use glam::DVec3;

/// A ray and the stretch of it that counts.
pub(super) type Stretch = (Ray, Interval);

/// `hits[i]` becomes the nearest hit of `rays[i]`.
pub(super) fn closest(mesh: &Mesh, rays: &[Stretch], hits: &mut [Option<Hit>]) {
    let mut bundle = None;
    each(
        rays,
        hits,
        |rays, hits| dispatch!(mesh.level.of_many(), simd => closest_with(simd, mesh, rays, &mut bundle, hits)),
        go_together,
        |(ray, within), hit| query::find_closest(mesh, ray, *within, hit),
    );
}

/// `hits[i]` becomes whether `rays[i]` hits anything.
pub(super) fn any(mesh: &Mesh, rays: &[Stretch], hits: &mut [bool]) {
    let mut bundle = None;
    each(
        rays,
        hits,
        |rays, hits| dispatch!(mesh.level.of_many(), simd => any_with(simd, mesh, rays, &mut bundle, hits)),
        |rays| go_together(rays) || end_together(rays),
        |(ray, within), hit| *hit = query::any(mesh, ray, *within),
    );
}

/// A bundle at a time by `together`, which may refuse, the others one by one. After a refusal bundles are tried ever more
/// seldom, so that rays without any order cost no more than alone. What is left of the slice is tried if it `may` be a bundle.
fn each<T: Copy + Default>(
    rays: &[Stretch],
    hits: &mut [T],
    mut together: impl FnMut(&[Stretch; RAYS], &mut [T; RAYS]) -> bool,
    may: impl Fn(&[Stretch]) -> bool,
    alone: impl Fn(&Stretch, &mut T),
) {
    const MOST_PATIENT: u32 = 64;
    let (mut wait, mut patience) = (0, 0);
    let (bundles, rest) = rays.as_chunks::<RAYS>();
    let (of_bundles, of_rest) = hits.as_chunks_mut::<RAYS>();
    for (rays, hits) in bundles.iter().zip(of_bundles) {
        if wait > 0 {
            wait -= 1;
        } else if together(rays, hits) {
            patience = 0;
            continue;
        } else {
            wait = patience;
            patience = (2 * patience).clamp(1, MOST_PATIENT);
        }
        for (hit, ray) in hits.iter_mut().zip(rays) {
            alone(ray, hit);
        }
    }
    if rest.len() >= FEWEST && wait == 0 && may(rest) {
        // The last of them stands for those that are not there.
        let (mut rays, mut answers) = ([rest[rest.len() - 1]; RAYS], [T::default(); RAYS]);
        rays[..rest.len()].copy_from_slice(rest);
        if together(&rays, &mut answers) {
            of_rest.copy_from_slice(&answers[..rest.len()]);
            return;
        }
    }
    for (hit, ray) in of_rest.iter_mut().zip(rest) {
        alone(ray, hit);
    }
}

/// Fewer rays than this are no bundle; [`end_together`] looks at six.
const FEWEST: usize = 8;

/// Rays turned by more than this against each other, and ends farther apart, in lengths of the ray, are not tried as a bundle: of
/// the way that answers are found, not of the answers.
const TURNED: f64 = 0.5;
const APART: f64 = 1e-5;

/// A first look that costs next to nothing: whether a few directions are alike. [`Bundle::take`] looks at all.
fn go_together(rays: &[Stretch]) -> bool {
    let first = rays[0].0.direction;
    (1..4).all(|i| is_near(first, rays[i * (rays.len() - 1) / 3].0.direction))
}

/// Alike, whether the rays may end at one place, and most come there the way their neighbours do: they start at surfaces, here and
/// there at another than the one before.
fn end_together(rays: &[Stretch]) -> bool {
    let end = |(ray, within): &Stretch| ray.origin + within.max * ray.direction;
    let (first, last) = (end(&rays[0]), end(&rays[rays.len() - 1]));
    let way = rays[0].1.max.abs() * rays[0].0.direction.abs().max_element();
    let neighbours = |i: &usize| {
        let i = i * rays.len() / 5;
        is_near(rays[i].0.direction, rays[i + 1].0.direction)
    };
    (first - last).abs().max_element() <= way * APART && (1..5).filter(neighbours).count() >= 3
}

fn is_near(a: DVec3, b: DVec3) -> bool {
    (b - a).abs().max_element() <= TURNED * a.abs().max_element()
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

    /// Considers a triangle for one ray, which may pass it between the t of `depth`; `through`: certainly passes through its
    /// inside. `true` if the ray needs no more.
    fn of_one(walk: &mut Walk<Self>, simd: S, spot: Spot, ray: usize, through: bool, depth: [f32; 2]) -> bool;
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

    /// Rays from one place: many triangle by triangle, few one by one.
    #[inline(always)]
    fn visit_from<S: Simd>(&mut self, simd: S, view: &View, number: u32, mut rays: u32)
    where
        A: Answers<S>,
    {
        let triangles = self.mesh.leaves[number as usize].triangles(simd, self.mesh.exact);
        let seen = Seen::new(simd, &triangles, view, &self.margins);
        let mut lanes = if rays.count_ones() <= FEW { 0xff } else { seen.lanes(simd, view) };
        if rays.count_ones() <= lanes.count_ones() * SIXTEENS as u32 {
            while rays != 0 {
                let ray = rays.trailing_zeros() as usize % RAYS;
                rays &= rays - 1;
                if let Some(verdict) = seen.ray(simd, &self.bundle.rays[ray / 16], ray % 16) {
                    self.of_ray(simd, number, ray, &verdict);
                }
            }
            return;
        }
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let [a, b] = &self.bundle.rays;
            let (mut first, mut second) =
                (seen.triangle(simd, lane as usize, a), seen.triangle(simd, lane as usize, b));
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
                self.of_ray(simd, number, ray, &verdict);
            }
        }
    }

    /// What one ray meets in a leaf.
    #[inline(always)]
    fn of_ray<S: Simd>(&mut self, simd: S, leaf: u32, ray: usize, verdict: &OfEight<S>)
    where
        A: Answers<S>,
    {
        let outcome = verdict.outcome();
        let mut lanes = outcome.maybe;
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let (through, depth) = (outcome.through >> lane & 1 == 1, outcome.depths.interval(lane as usize));
            if A::of_one(self, simd, Spot { leaf, lane }, ray, through, depth) {
                break;
            }
        }
    }
}

/// With as many rays, or fewer, a leaf is tested ray by ray.
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
                self.bundle.shorten(simd);
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
    bundle: &mut Option<Bundle>,
    hits: &mut [Option<Hit>; RAYS],
) -> bool {
    if !go_together(rays) {
        return false;
    }
    let bundle = bundle.get_or_insert_with(|| Bundle::EMPTY);
    if !bundle.take(simd, mesh.frame(), rays, Start::Origin) {
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

/// The search for the nearest hits. Of the triangles that are certainly hit the nearest so far is remembered, and whatever may
/// not be told from it is settled in f64 at once; λ of what remains when the walk has ended.
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
        let t_max = &mut rays.t_max[lane];
        if through && low > *t_max {
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
        if high < *t_max {
            *t_max = high;
        }
        false
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
                let (t, t_max) = (
                    Limits::PLAIN.upper(best.lambda + best.error),
                    &mut self.bundle.rays[ray / 16 % SIXTEENS].t_max[ray % 16],
                );
                if t < *t_max {
                    *t_max = t;
                }
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
        let remembered =
            Remembered { which: remembered & !settled, spots: spot.as_flattened(), ids: id.as_flattened() };
        settle(simd, self.mesh, self.rays, &self.margins, remembered, self.answers.hits);
    }
}

/// `false`, and nothing done, if the rays are no bundle.
#[inline(always)]
fn any_with<S: Simd>(
    simd: S,
    mesh: &Mesh,
    rays: &[Stretch; RAYS],
    bundle: &mut Option<Bundle>,
    hits: &mut [bool; RAYS],
) -> bool {
    let (to_one_place, alike) = (end_together(rays), go_together(rays));
    if !(to_one_place || alike) {
        return false;
    }
    let bundle = bundle.get_or_insert_with(|| Bundle::EMPTY);
    // Rays to a light, from the light; t is then `max` − λ.
    let from_end = to_one_place && bundle.take(simd, mesh.frame(), rays, Start::End);
    if !(from_end || alike && bundle.take(simd, mesh.frame(), rays, Start::Origin)) {
        return false;
    }
    *hits = [false; RAYS];
    let mut walk = Walk::new(simd, mesh, rays, bundle, Until { hits });
    bvh::together(simd, &mesh.tree, &mut walk);
    true
}

/// The search until all rays are known to hit something.
struct Until<'a> {
    hits: &'a mut [bool; RAYS],
}

impl<S: Simd> Answers<S> for Until<'_> {
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
        let mut answered = met;
        while answered != 0 {
            let lane = answered.trailing_zeros() as usize;
            answered &= answered - 1;
            walk.end(16 * sixteen + lane);
        }
        met
    }

    #[inline(always)]
    fn of_one(walk: &mut Walk<Self>, simd: S, spot: Spot, ray: usize, through: bool, depth: [f32; 2]) -> bool {
        let met = through & walk.bundle.rays[ray / 16].holds(ray % 16, depth) || walk.meets(simd, spot, ray);
        if met {
            walk.end(ray);
        }
        met
    }
}

impl Walk<'_, Until<'_>> {
    #[inline(always)]
    fn meets<S: Simd>(&self, simd: S, spot: Spot, ray: usize) -> bool {
        let (ref asked, within) = self.rays[ray % RAYS];
        let (leaf, lane) = spot.at(self.mesh);
        occluded(simd, self.mesh, asked, within, leaf, lane)
    }

    /// The ray has its answer.
    #[inline(always)]
    fn end(&mut self, ray: usize) {
        self.answers.hits[ray % RAYS] = true;
        self.bundle.end(ray);
    }
}
