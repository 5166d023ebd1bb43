//! A tree of boxes that knows no shapes: objects are numbers with a box each, leaves call closures.
//!
//! `build` makes a binary tree by the surface area heuristic (`split`), `reinsert` moves what lies badly, `collapse`
//! packs the tree into nodes of eight f32 boxes, `traverse` walks it front to back with one ray (`slab`) or with many
//! that go the same way (`bundle`). Boxes are rounded outward into the frame of `frame`, and the ray's constants carry
//! margins for every rounding between the f64 ray and the f32 boxes: no box that holds a point of the ray is skipped
//! (docs/numerics.md §10).

mod build;
mod bundle;
mod collapse;
mod frame;
mod level;
mod node;
#[cfg(test)]
mod quality;
mod reinsert;
mod slab;
mod slices;
mod split;
mod tasks;
mod traverse;
mod waiting;
mod watch;
mod wide;

pub use level::Level;

pub(crate) use bundle::{Bundle, RAYS, SIXTEENS, Sixteen, Start, Together, together};
pub(crate) use collapse::build;
pub(crate) use frame::{Frame, FrameBox};
pub(crate) use slab::{E, Ends, Limits, LocalRay, Sure};
pub(crate) use slices::{Stretch, each, end_together, go_together};
pub(crate) use tasks::map;
pub(crate) use traverse::{Any, Closest, Lanes, any, closest};
pub(crate) use watch::Watch;
pub(crate) use wide::Wide;

use crate::{Aabb, Interval, Ray};
use fearless_simd::{Simd, dispatch};
use std::ops::ControlFlow;

/// A tree over the boxes of objects numbered from zero.
#[derive(Clone, Debug)]
pub struct Bvh {
    tree: Wide,
    /// Leaf i holds `objects[i]`.
    objects: Vec<u32>,
    level: Level,
}

/// Objects in a leaf: one, since an object's own test costs far more than a box's.
const OBJECTS_PER_LEAF: u32 = 1;

impl Bvh {
    /// The tree over `boxes`; object i is `boxes[i]`. Empty boxes hold no object; one that is infinite or NaN is
    /// visited by every ray.
    ///
    /// The same boxes give the same tree at any number of threads.
    ///
    /// # Panics
    /// On 2²⁹ boxes or more.
    #[must_use]
    pub fn build(boxes: &[Aabb]) -> Self {
        Self::build_watched(boxes, &Watch::nobody()).expect("nobody stops it")
    }

    /// The same tree, with an observer that is told now and then which share of the build is done, from 0 to 1, never
    /// less than before, and that may end it: then there is none. Calls come from the threads that build, one at a
    /// time.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use truehit::{Aabb, bvh::Bvh};
    /// let boxes = vec![Aabb::new([0.0; 3], [1.0; 3]); 1000];
    /// let mut last = 0.0;
    /// let tree = Bvh::build_observed(&boxes, &mut |share| {
    ///     last = share;
    ///     ControlFlow::Continue(())
    /// });
    /// assert!(tree.is_some() && last == 1.0);
    /// assert!(Bvh::build_observed(&boxes, &mut |_| ControlFlow::Break(())).is_none());
    /// ```
    ///
    /// # Panics
    /// On 2²⁹ boxes or more, and if the observer does.
    pub fn build_observed(boxes: &[Aabb], observer: &mut (dyn FnMut(f64) -> ControlFlow<()> + Send)) -> Option<Self> {
        Self::build_watched(boxes, &Watch::new(observer))
    }

    fn build_watched(boxes: &[Aabb], watch: &Watch) -> Option<Self> {
        let sound = boxes.iter().filter(|b| b.is_finite() && !b.is_empty());
        let whole = sound.fold(Aabb::EMPTY, |whole, &b| whole.union(b));
        let frame = Frame::around(whole);
        let bounds = |i: usize| {
            let b: &Aabb = &boxes[i];
            let empty = b.is_empty() && !b.min.is_nan() && !b.max.is_nan();
            if empty { FrameBox::EMPTY } else { frame.outward(b) }
        };
        let built = build(boxes.len(), frame, &bounds, OBJECTS_PER_LEAF, watch)?;
        watch.phase(1.0, 1);
        watch.add(1);
        if watch.stopped() {
            return None;
        }
        assert_eq!(built.starts.len(), built.objects.len() + 1, "one object in a leaf");
        Some(Self { tree: built.tree, objects: built.objects, level: Level::detect() })
    }

    /// Calls `visit(object, bound)` for every object whose box the ray meets between `within.min` and the bound,
    /// nearest boxes first. The bound is `within.max` at first and then what `visit` last returned: an upper bound of
    /// the λ that still matters. An object is visited at most once.
    #[inline]
    pub fn closest(&self, ray: &Ray, within: Interval, mut visit: impl FnMut(u32, f64) -> f64) {
        dispatch!(self.level.token(), simd => self.closest_with(simd, ray, within, &mut visit));
    }

    #[inline(always)]
    fn closest_with<S: Simd>(&self, simd: S, ray: &Ray, within: Interval, visit: &mut impl FnMut(u32, f64) -> f64) {
        match LocalRay::new(simd, &self.tree.frame, ray, within) {
            Some(local) => self.closest_along::<S, true>(simd, &local, within.max, visit),
            None => self.closest_uncommon(simd, ray, within, visit),
        }
    }

    #[inline(never)]
    fn closest_uncommon<S: Simd>(&self, simd: S, ray: &Ray, within: Interval, visit: &mut impl FnMut(u32, f64) -> f64) {
        simd.vectorize(
            #[inline(always)]
            || {
                if let Some(local) = LocalRay::uncommon(simd, &self.tree.frame, ray, within) {
                    self.closest_along::<S, false>(simd, &local, within.max, visit);
                } else if !within.is_empty() && ray.is_valid() {
                    // No place in the frame: every object.
                    self.objects.iter().fold(within.max, |bound, &object| visit(object, bound));
                }
            },
        );
    }

    #[inline(always)]
    fn closest_along<S: Simd, const FORWARD: bool>(
        &self,
        simd: S,
        local: &LocalRay,
        bound: f64,
        visit: &mut impl FnMut(u32, f64) -> f64,
    ) {
        let mut nearest = Nearest { bvh: self, local, bound, visit };
        closest(simd, &self.tree, &Lanes::<S, FORWARD>::new(simd, local), local.ends.t_max, &mut nearest);
    }

    /// Whether `hits(object)` for any object whose box the ray meets inside `within`; asks until the first yes.
    #[inline]
    pub fn any(&self, ray: &Ray, within: Interval, mut hits: impl FnMut(u32) -> bool) -> bool {
        dispatch!(self.level.token(), simd => self.any_with(simd, ray, within, &mut hits))
    }

    #[inline(always)]
    fn any_with<S: Simd>(&self, simd: S, ray: &Ray, within: Interval, hits: &mut impl FnMut(u32) -> bool) -> bool {
        match LocalRay::new(simd, &self.tree.frame, ray, within) {
            Some(local) => self.any_along::<S, true>(simd, &local, hits),
            None => self.any_uncommon(simd, ray, within, hits),
        }
    }

    #[inline(never)]
    fn any_uncommon<S: Simd>(&self, simd: S, ray: &Ray, within: Interval, hits: &mut impl FnMut(u32) -> bool) -> bool {
        simd.vectorize(
            #[inline(always)]
            || match LocalRay::uncommon(simd, &self.tree.frame, ray, within) {
                Some(local) => self.any_along::<S, false>(simd, &local, hits),
                None => !within.is_empty() && ray.is_valid() && self.objects.iter().any(|&o| hits(o)),
            },
        )
    }

    #[inline(always)]
    fn any_along<S: Simd, const FORWARD: bool>(
        &self,
        simd: S,
        local: &LocalRay,
        hits: &mut impl FnMut(u32) -> bool,
    ) -> bool {
        any(simd, &self.tree, &Lanes::<S, FORWARD>::new(simd, local), local.ends.t_max, &mut First { bvh: self, hits })
    }

    /// Takes the rays of a bundle, the first `many` of which count, through the tree together: `visit(object, rays,
    /// bundle)` for every object whose box some of them meet before their t_max, nearest boxes first, with those rays
    /// as bits. `false`, and nothing visited, if they are no bundle.
    pub(crate) fn together(
        &self,
        rays: &[Stretch; RAYS],
        many: usize,
        from: Start,
        bundle: &mut Bundle,
        mut visit: impl FnMut(u32, u32, &mut Bundle),
    ) -> bool {
        dispatch!(self.level.of_many(), simd => self.together_with(simd, rays, many, from, bundle, &mut visit))
    }

    #[inline(always)]
    fn together_with<S: Simd>(
        &self,
        simd: S,
        rays: &[Stretch; RAYS],
        many: usize,
        from: Start,
        bundle: &mut Bundle,
        visit: &mut impl FnMut(u32, u32, &mut Bundle),
    ) -> bool {
        let taken = bundle.take(simd, &self.tree.frame, rays, many, from);
        if taken {
            together(simd, &self.tree, &mut Group { bvh: self, bundle, visit });
        }
        taken
    }

    /// Uses the instructions of `level` from now on, if this CPU has them: for tests and benchmarks. All levels give
    /// the same answers.
    pub fn set_level(&mut self, level: Level) {
        self.level = level;
    }

    /// Bytes on the heap.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.tree.memory() + size_of::<u32>() * self.objects.capacity()
    }

    #[inline]
    fn leaf(&self, leaf: u32) -> u32 {
        self.objects[leaf as usize]
    }
}

struct Nearest<'a, F> {
    bvh: &'a Bvh,
    local: &'a LocalRay,
    bound: f64,
    visit: F,
}

impl<S: Simd, F: FnMut(u32, f64) -> f64> Closest<S> for Nearest<'_, F> {
    #[inline(always)]
    fn leaf(&mut self, _: S, leaf: u32) -> f32 {
        self.bound = (self.visit)(self.bvh.leaf(leaf), self.bound);
        self.local.limits.upper(self.bound)
    }
}

struct First<'a, F> {
    bvh: &'a Bvh,
    hits: F,
}

impl<S: Simd, F: FnMut(u32) -> bool> Any<S> for First<'_, F> {
    #[inline(always)]
    fn leaf(&mut self, _: S, leaf: u32) -> bool {
        (self.hits)(self.bvh.leaf(leaf))
    }
}

struct Group<'a, F> {
    bvh: &'a Bvh,
    bundle: &'a mut Bundle,
    visit: F,
}

impl<S: Simd, F: FnMut(u32, u32, &mut Bundle)> Together<S> for Group<'_, F> {
    #[inline(always)]
    fn bundle(&self) -> &Bundle {
        self.bundle
    }

    #[inline(always)]
    fn leaf(&mut self, simd: S, leaf: u32, rays: u32) {
        (self.visit)(self.bvh.leaf(leaf), rays, self.bundle);
        self.bundle.shorten(simd);
        if self.bundle.asking == 0 {
            self.bundle.t_max = f32::NEG_INFINITY;
        }
    }
}
