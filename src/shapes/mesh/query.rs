//! Closest and any hit of a mesh.

use super::Mesh;
use super::leaf::{Leaf, Probe};
use crate::bvh::{self, LocalRay};
use crate::kernel::eft::{Fused, Split};
use crate::kernel::triangle;
use crate::{Hit, Interval, Ray};
use fearless_simd::{Level, Simd, dispatch};
use glam::DVec3;
use std::cmp::Ordering;

/// The nearest hit; the lowest triangle of those met at exactly the same λ.
pub(super) fn closest(mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    dispatch!(mesh.level.token(), simd => closest_with(simd, mesh, ray, within))
}

#[inline(always)]
fn closest_with<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
    let Some(local) = LocalRay::new(simd, mesh.frame(), ray, within) else { return closest_of_all(mesh, ray, within) };
    let mut nearest =
        Nearest { mesh, ray, local: &local, probe: Probe::new(&local), within, t_max: local.t_max, best: None };
    bvh::closest(simd, &mesh.tree, &local, &mut nearest);
    nearest.best
}

/// Whether anything is hit.
pub(super) fn any(mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    dispatch!(mesh.level.token(), simd => any_with(simd, mesh, ray, within))
}

#[inline(always)]
fn any_with<S: Simd>(simd: S, mesh: &Mesh, ray: &Ray, within: Interval) -> bool {
    let Some(local) = LocalRay::new(simd, mesh.frame(), ray, within) else {
        return closest_of_all(mesh, ray, within).is_some();
    };
    let mut first = First { mesh, ray, probe: Probe::new(&local), t_max: local.t_max, within };
    bvh::any(simd, &mesh.tree, &local, &mut first)
}

/// A ray that has no place in the tree's frame.
#[cold]
#[inline(never)]
fn closest_of_all(mesh: &Mesh, ray: &Ray, within: Interval) -> Option<Hit> {
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
fn nearer(mesh: &Mesh, ray: &Ray, best: Option<Hit>, hit: Hit) -> Hit {
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
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let fused = matches!(simd.level(), Level::Avx2(_) | Level::Avx512(_));
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    let fused = cfg!(target_arch = "aarch64");
    if fused {
        triangle::intersect_with::<Fused>(ray, vertices, within)
    } else {
        triangle::intersect_with::<Split>(ray, vertices, within)
    }
}

struct Nearest<'a> {
    mesh: &'a Mesh,
    ray: &'a Ray,
    local: &'a LocalRay,
    probe: Probe,
    within: Interval,
    t_max: f32,
    best: Option<Hit>,
}

impl Nearest<'_> {
    /// Out of line, so that the walk keeps its registers.
    #[inline(never)]
    fn candidates<S: Simd>(&mut self, simd: S, leaf: &Leaf, lanes: u32) {
        simd.vectorize(
            #[inline(always)]
            || self.confirm_all(simd, leaf, lanes),
        );
    }

    #[inline(always)]
    fn confirm_all<S: Simd>(&mut self, simd: S, leaf: &Leaf, mut lanes: u32) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 7;
            lanes &= lanes - 1;
            let vertices = leaf.vertices(lane, self.mesh);
            if let Some(hit) = confirm(simd, self.ray, &vertices, self.within) {
                let hit = Hit { part: leaf.number(lane), ..hit };
                self.best = Some(nearer(self.mesh, self.ray, self.best, hit));
            }
        }
        if let Some(best) = self.best {
            let bound = best.lambda + best.error;
            // Open intervals: what lies exactly at the best λ still matters.
            let bound = bound + 2.0 * f64::EPSILON * bound.abs() + f64::MIN_POSITIVE;
            if bound < self.within.max {
                self.within.max = bound;
                self.t_max = self.local.upper(bound);
            }
        }
    }
}

impl bvh::Closest for Nearest<'_> {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, leaf: u32) -> f32 {
        let leaf = &self.mesh.leaves[leaf as usize];
        let lanes = self.probe.test(simd, leaf, self.t_max);
        if lanes != 0 {
            self.candidates(simd, leaf, lanes);
        }
        self.t_max
    }
}

struct First<'a> {
    mesh: &'a Mesh,
    ray: &'a Ray,
    probe: Probe,
    t_max: f32,
    within: Interval,
}

impl bvh::Any for First<'_> {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, leaf: u32) -> bool {
        let leaf = &self.mesh.leaves[leaf as usize];
        let lanes = self.probe.test(simd, leaf, self.t_max);
        lanes != 0 && self.candidates(simd, leaf, lanes)
    }
}

impl First<'_> {
    #[inline(never)]
    fn candidates<S: Simd>(&self, simd: S, leaf: &Leaf, mut lanes: u32) -> bool {
        simd.vectorize(
            #[inline(always)]
            || {
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize & 7;
                    lanes &= lanes - 1;
                    if confirm(simd, self.ray, &leaf.vertices(lane, self.mesh), self.within).is_some() {
                        return true;
                    }
                }
                false
            },
        )
    }
}
