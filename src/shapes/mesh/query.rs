//! Closest and any hit of a mesh.

use super::Mesh;
use super::leaf::{Leaf, Outcome, Probe, Spot, UNCERTIFIED};
use super::settle::settle_one;
use crate::bvh::{self, Ends, Lanes, Limits, LocalRay};
use crate::kernel::eft::{Fused, Split};
use crate::kernel::{cpu, tally, textbook, triangle};
use crate::{Hit, Interval, Ray};
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::Level;
use fearless_simd::{Simd, dispatch};
use glam::DVec3;
use std::cmp::Ordering;

/// The nearest hit; the lowest triangle of those met at exactly the same λ.
///
/// By value down to where it is found: in memory of this function's it would be copied by loads that wait for all of
/// its stores.
#[inline(always)]
pub(super) fn closest(mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Level::Avx2(simd) = mesh.level.token() {
        return closest_avx2(simd, mesh, ray, within);
    }
    closest_dispatched(mesh, ray, within)
}

// Arguments in registers: a closure would be given them in memory.
fearless_simd::kernel!(
    fn closest_avx2(simd: Avx2, mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
        closest_with(simd, mesh, ray, within)
    }
);

#[inline(never)]
fn closest_dispatched(mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    dispatch!(mesh.level.token(), simd => {
        if is_baseline(simd) { closest_apart(simd, mesh, ray, within) } else { closest_with(simd, mesh, ray, within) }
    })
}

/// [`closest`] where it is wanted, compiled apart for the same reason.
#[inline(always)]
pub(super) fn find_closest(mesh: &Mesh, ray: &Ray, within: Interval, hit: &mut Option<Hit>) {
    let asked = Asked::new(mesh, ray, within);
    dispatch!(mesh.level.token(), simd => {
        let within = asked.within();
        *hit = if is_baseline(simd) {
            closest_apart(simd, asked.mesh, asked.ray, within)
        } else {
            closest_with(simd, asked.mesh, asked.ray, within)
        };
    });
}

/// Whether these instructions need no function of their own. Then the query would be inlined into the one that
/// dispatches, and all others would pay for its frame.
#[inline(always)]
fn is_baseline<S: Simd>(simd: S) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return !matches!(simd.level(), Level::Sse4_2(_) | Level::Avx2(_) | Level::Avx512(_));
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    {
        let _ = simd;
        true
    }
}

#[inline(never)]
fn closest_apart<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    closest_with(simd, mesh, ray, within)
}

/// A query on its way into a closure, which takes it through memory. The limits do not stand side by side: they would
/// be stored one by one and loaded as a pair, which has to wait until both have reached the cache.
#[repr(C)]
struct Asked<'a> {
    min: f64,
    ray: &'a Ray,
    max: f64,
    mesh: &'a Mesh,
}

impl<'a> Asked<'a> {
    #[inline(always)]
    fn new(mesh: &'a Mesh, ray: &'a Ray, Interval { min, max }: Interval) -> Self {
        Self { min, ray, max, mesh }
    }

    #[inline(always)]
    fn within(&self) -> Interval {
        Interval { min: self.min, max: self.max }
    }
}

#[inline(always)]
fn closest_with<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    match LocalRay::new(simd, mesh.frame(), ray, within) {
        Some(local) => closest_along::<S, true>(simd, mesh, ray, within, &local),
        None => closest_uncommon(simd, mesh, ray, within),
    }
}

#[inline(never)]
fn closest_uncommon<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    simd.vectorize(
        #[inline(always)]
        move || match LocalRay::uncommon(simd, mesh.frame(), ray, within) {
            Some(local) => closest_along::<S, false>(simd, mesh, ray, within, &local),
            None => closest_of_all(mesh, ray, within),
        },
    )
}

#[inline(always)]
fn closest_along<S: Simd, const FORWARD: bool>(
    simd: S,
    mesh: &Mesh,
    ray: &Ray,
    within: Interval,
    local: &LocalRay,
) -> Option<Hit> {
    let (probe, ends) = probe_and_ends::<FORWARD>(mesh, local);
    let nearest = Nearest::new(mesh, ray, within, local.limits, ends);
    let mut walk = Single { leaves: &mesh.leaves, probe, nearest };
    bvh::closest(simd, &mesh.tree, &Lanes::<S, FORWARD>::new(simd, local), ends.t_max, &mut walk);
    let probe = if FORWARD { Some(&walk.probe) } else { None };
    walk.nearest.settle(simd, probe)
}

/// What leaves are asked with, and where.
#[inline(always)]
fn probe_and_ends<const FORWARD: bool>(mesh: &Mesh, local: &LocalRay) -> (Probe, Ends) {
    let (probe, ends) = (Probe::new(local, mesh.exact), local.ends);
    (probe, if FORWARD { ends } else { Ends { t_min: probe.first(ends.t_min), ..ends } })
}

/// Whether anything is hit.
#[inline(always)]
pub(super) fn any(mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Level::Avx2(simd) = mesh.level.token() {
        return any_avx2(simd, mesh, ray, within);
    }
    any_dispatched(mesh, ray, within)
}

fearless_simd::kernel!(
    fn any_avx2(simd: Avx2, mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
        any_with(simd, mesh, ray, within)
    }
);

#[inline(never)]
fn any_dispatched(mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    dispatch!(mesh.level.token(), simd => {
        if is_baseline(simd) { any_apart(simd, mesh, ray, within) } else { any_with(simd, mesh, ray, within) }
    })
}

#[inline(never)]
fn any_apart<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    any_with(simd, mesh, ray, within)
}

#[inline(always)]
fn any_with<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    match LocalRay::new(simd, mesh.frame(), ray, within) {
        Some(local) => any_along::<S, true>(simd, mesh, ray, within, &local),
        None => any_uncommon(simd, mesh, ray, within),
    }
}

#[inline(never)]
fn any_uncommon<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    simd.vectorize(
        #[inline(always)]
        move || match LocalRay::uncommon(simd, mesh.frame(), ray, within) {
            Some(local) => any_along::<S, false>(simd, mesh, ray, within, &local),
            None => closest_of_all(mesh, ray, within).is_some(),
        },
    )
}

#[inline(always)]
fn any_along<S: Simd, const FORWARD: bool>(
    simd: S,
    mesh: &Mesh,
    ray: &Ray,
    within: Interval,
    local: &LocalRay,
) -> bool {
    let (probe, ends) = probe_and_ends::<FORWARD>(mesh, local);
    let mut first = First { leaves: &mesh.leaves, mesh, ray, within, ends, probe };
    bvh::any(simd, &mesh.tree, &Lanes::<S, FORWARD>::new(simd, local), ends.t_max, &mut first)
}

/// A ray that has no place in the tree's frame.
#[cold]
#[inline(never)]
fn closest_of_all(mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    tally::refined();
    if within.is_empty() || !ray.is_valid() {
        return None;
    }
    (0..mesh.triangles.len() as u32).fold(None, |best, part| {
        let hit = triangle::intersect(ray, &mesh.vertices(part), within);
        match hit {
            Some(hit) => Some(nearer(mesh, ray, best, Hit { part, ..hit })),
            None => best,
        }
    })
}

/// Whichever of two hits comes first: exactly, and by number where λ is the same.
#[inline(always)]
pub(super) fn nearer(mesh: &Mesh, ray: &Ray, best: Option<Hit>, hit: Hit) -> Hit {
    let Some(old) = best else { return hit };
    let (gap, slack) = (hit.lambda - old.lambda, hit.error + old.error);
    // Rounding the two sums cannot make an overlap look like a gap of twice its size.
    let order = if gap > 2.0 * slack {
        Ordering::Greater
    } else if gap < -2.0 * slack {
        Ordering::Less
    } else {
        triangle::compare(ray, &mesh.vertices(hit.part), &mesh.vertices(old.part)).then(hit.part.cmp(&old.part))
    };
    if order == Ordering::Less { hit } else { old }
}

/// The exact test with the products of the instruction level at hand.
#[inline(always)]
fn confirm<S: Simd>(simd: S, ray: &Ray, vertices: &[DVec3; 3], within: Interval) -> Option<Hit> {
    if UNCERTIFIED {
        return textbook::moller_trumbore::<f64>(ray, vertices, within);
    }
    if cpu::has_fused(simd) {
        triangle::intersect_with::<Fused>(ray, vertices, within)
    } else {
        triangle::intersect_with::<Split>(ray, vertices, within)
    }
}

/// The ray's hit of a leaf's triangle.
#[inline(always)]
pub(super) fn exactly<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval, spot: Spot) -> Option<Hit> {
    let hit = confirm(simd, ray, &spot.vertices(mesh), within)?;
    Some(Hit { part: spot.number(mesh), ..hit })
}

/// A triangle that is certainly hit, at this t or later.
#[derive(Clone, Copy)]
struct Passed {
    /// [`Spot::packed`]: all that are remembered are one vector, to begin with.
    spot: u32,
    t: f32,
}

const MOST_PASSED: usize = 4;

/// The search for the nearest hit. Triangles that the filter is certain of only shorten the ray; which of them is the
/// nearest, and λ, is settled in f64 when the walk has ended and few are left.
struct Nearest<'a> {
    mesh: &'a Mesh,
    ray: &'a Ray,
    within: Interval,
    limits: Limits,
    ends: Ends,
    passed: [Passed; MOST_PASSED],
    count: usize,
    best: Option<Hit>,
}

impl<'a> Nearest<'a> {
    #[inline(always)]
    fn new(mesh: &'a Mesh, ray: &'a Ray, within: Interval, limits: Limits, ends: Ends) -> Self {
        let passed = [Passed { spot: 0, t: 0.0 }; MOST_PASSED];
        Self { mesh, ray, within, limits, ends, passed, count: 0, best: None }
    }

    /// The answer. `probe`: of a ray that is taken as it is.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S, probe: Option<&Probe>) -> Option<Hit> {
        match (self.count, self.best.is_some()) {
            (0, false) => None,
            (1, false) => {
                let spot = Spot::of(self.passed[0].spot);
                match settle_one(simd, self.mesh, self.ray, spot, probe) {
                    Some(hit) => Some(hit),
                    None => self.exactly_apart(simd, spot),
                }
            }
            _ => {
                self.decide(simd);
                self.best
            }
        }
    }

    /// Considers a triangle that may be met between the t of `depth`; `through`: whose inside the line certainly
    /// passes. Elsewhere the sign of the denominator is not known, and the depths mean nothing.
    #[inline(always)]
    fn consider<S: Simd>(&mut self, simd: S, spot: Spot, through: bool, depth: [f32; 2]) {
        if self.count == MOST_PASSED {
            self.decide(simd);
        }
        if !(through && self.remember(spot, depth)) {
            self.confirm(simd, spot);
        }
    }

    /// Whether no more is to be done at once with a triangle that the line certainly passes through: it is too far, or
    /// certainly a hit.
    #[inline(always)]
    fn remember(&mut self, spot: Spot, [low, high]: [f32; 2]) -> bool {
        if low > self.ends.t_max {
            return true;
        }
        if !self.ends.sure.holds([low, high]) | (self.count == MOST_PASSED) {
            return false;
        }
        if high < self.ends.t_max {
            self.ends.t_max = high;
        }
        self.passed[self.count % MOST_PASSED] = Passed { spot: spot.packed(), t: low };
        self.count += 1;
        true
    }

    /// Decides the triangles that are still in question.
    #[inline(never)]
    fn decide<S: Simd>(&mut self, simd: S) {
        for i in 0..std::mem::take(&mut self.count) {
            let Passed { spot, t } = self.passed[i % MOST_PASSED];
            if t <= self.ends.t_max {
                self.confirm(simd, Spot::of(spot));
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn exactly_apart<S: Simd>(&self, simd: S, spot: Spot) -> Option<Hit> {
        simd.vectorize(
            #[inline(always)]
            move || exactly(simd, self.mesh, self.ray, self.within, spot),
        )
    }

    #[inline(never)]
    fn confirm<S: Simd>(&mut self, simd: S, spot: Spot) {
        simd.vectorize(
            #[inline(always)]
            move || {
                let Some(hit) = exactly(simd, self.mesh, self.ray, self.within, spot) else { return };
                let best = nearer(self.mesh, self.ray, self.best, hit);
                self.best = Some(best);
                let t = self.limits.upper(best.lambda + best.error);
                if t < self.ends.t_max {
                    self.ends.t_max = t;
                }
            },
        );
    }
}

/// One ray's walk to the nearest hit.
struct Single<'a> {
    leaves: &'a [Leaf],
    probe: Probe,
    nearest: Nearest<'a>,
}

impl<S: Simd> bvh::Closest<S> for Single<'_> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, number: u32) -> f32 {
        let leaf = &self.leaves[number as usize];
        f32::from_bits(self.visit(simd, leaf, number))
    }
}

impl Single<'_> {
    /// Returns t_max by its bits, which the walk compares. Out of line, so that it keeps its registers.
    #[inline(never)]
    fn visit<S: Simd>(&mut self, simd: S, triangles: &Leaf, leaf: u32) -> u32 {
        simd.vectorize(
            #[inline(always)]
            move || {
                let Ends { t_min, t_max, .. } = self.nearest.ends;
                if let Some(verdict) = self.probe.test(simd, triangles, [t_min, t_max]) {
                    let outcome = verdict.outcome();
                    let &Outcome { maybe, through, ref depths } = &outcome;
                    // Most often it is one.
                    let lane = maybe.trailing_zeros();
                    let alone = maybe.is_power_of_two() & (through >> lane & 1 == 1);
                    if !(alone && self.nearest.remember(Spot { leaf, lane }, depths.interval(lane as usize))) {
                        self.candidates(simd, leaf, &outcome);
                    }
                }
                self.nearest.ends.t_max.to_bits()
            },
        )
    }

    #[inline(never)]
    fn candidates<S: Simd>(&mut self, simd: S, leaf: u32, outcome: &Outcome) {
        let mut lanes = outcome.maybe;
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let through = outcome.through >> lane & 1 == 1;
            self.nearest.consider(simd, Spot { leaf, lane }, through, outcome.depths.interval(lane as usize));
        }
    }
}

/// The walk to any hit: the filter's certainty is enough.
struct First<'a> {
    leaves: &'a [Leaf],
    mesh: &'a Mesh,
    ray: &'a Ray,
    within: Interval,
    ends: Ends,
    probe: Probe,
}

impl<S: Simd> bvh::Any<S> for First<'_> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, leaf: u32) -> bool {
        self.visit(simd, &self.leaves[leaf as usize])
    }
}

impl First<'_> {
    #[inline(never)]
    fn visit<S: Simd>(&self, simd: S, leaf: &Leaf) -> bool {
        simd.vectorize(
            #[inline(always)]
            move || {
                let Ends { sure, t_min, t_max } = self.ends;
                let Some(verdict) = self.probe.test(simd, leaf, [t_min, t_max]) else { return false };
                verdict.certain(simd, sure) != 0 || self.candidates(simd, leaf, verdict.maybe)
            },
        )
    }

    #[inline(never)]
    fn candidates<S: Simd>(&self, simd: S, leaf: &Leaf, lanes: u32) -> bool {
        let mut lanes = (0..8).filter(|lane| lanes >> lane & 1 == 1);
        lanes.any(|lane| occluded(simd, self.mesh, self.ray, self.within, leaf, lane))
    }
}

/// Whether a triangle is hit, exactly.
#[inline(never)]
pub(super) fn occluded<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval, leaf: &Leaf, lane: usize) -> bool {
    simd.vectorize(
        #[inline(always)]
        move || confirm(simd, ray, &leaf.vertices(lane & 7, mesh), within).is_some(),
    )
}
