//! What many rays meet first, and whether they meet anything: rays that go the same way are taken through the scene's
//! tree together, and each object they reach is asked for all of them at once.

use super::{Scene, SceneHit, reach};
use crate::bvh::{self, Bundle, RAYS, Start, Stretch};
use crate::{Hit, Interval, Ray};

impl<M> Scene<M> {
    /// The nearest hits of many rays: `hits[i]` becomes what [`intersect`](Self::intersect) answers to `rays[i]`.
    ///
    /// Rays in a row that go much the same way, such as those of neighbouring pixels, are taken through the scene and
    /// its meshes together. Others are answered one by one.
    ///
    /// ```
    /// use truehit::{Camera, Interval, Scene, Sphere};
    /// let mut scene = Scene::builder();
    /// let ball = scene.push(Sphere::UNIT, "ball");
    /// let scene = scene.build();
    /// let camera = Camera::look_at([0.0, 0.0, 4.0], [0.0; 3], [0.0, 1.0, 0.0], 0.6, [16, 16])?;
    /// let rays: Vec<_> = (0..256).map(|i| (camera.pixel(i % 16, i / 16), Interval::FORWARD)).collect();
    /// let mut hits = vec![None; rays.len()];
    /// scene.intersect_each(&rays, &mut hits);
    /// assert!(hits[0].is_none() && hits[8 * 16 + 8].is_some_and(|hit| hit.object == ball));
    /// assert_eq!(hits[100], scene.intersect(&rays[100].0, rays[100].1));
    /// # Ok::<(), truehit::InvalidCamera>(())
    /// ```
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn intersect_each(&self, rays: &[(Ray, Interval)], hits: &mut [Option<SceneHit>]) {
        assert_eq!(rays.len(), hits.len(), "there must be one hit for each ray");
        let mut bundle = None;
        bvh::each(
            rays,
            hits,
            |rays, many, hits| self.closest_together(rays, many, &mut bundle, hits),
            bvh::go_together,
            |(ray, within), hit| *hit = self.intersect(ray, *within),
        );
    }

    /// Whether many rays hit anything: [`occludes`](Self::occludes) for each, as
    /// [`intersect_each`](Self::intersect_each) for [`intersect`](Self::intersect). Shadow rays of neighbouring pixels
    /// to one light do best.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn occludes_each(&self, rays: &[(Ray, Interval)], hits: &mut [bool]) {
        assert_eq!(rays.len(), hits.len(), "there must be one answer for each ray");
        let mut bundle = None;
        bvh::each(
            rays,
            hits,
            |rays, many, hits| self.any_together(rays, many, &mut bundle, hits),
            |rays| bvh::go_together(rays) || bvh::end_together(rays),
            |(ray, within), hit| *hit = self.occludes(ray, *within),
        );
    }

    /// `false`, and nothing done, if the rays are no bundle.
    fn closest_together(
        &self,
        rays: &[Stretch; RAYS],
        many: usize,
        bundle: &mut Option<Bundle>,
        hits: &mut [Option<SceneHit>; RAYS],
    ) -> bool {
        if !bvh::go_together(rays) {
            return false;
        }
        let bundle = bundle.get_or_insert_with(|| Bundle::EMPTY);
        let mut nearest = Nearest { scene: self, rays, open: *rays, hits: [None; RAYS] };
        for &object in &self.unbounded {
            nearest.consider(object, all(many), |_, _| {});
        }
        let open = nearest.open;
        let taken = self.tree.together(&open, many, Start::Origin, bundle, |object, which, bundle| {
            nearest.consider(object as usize, which, |ray, lambda| bundle.limit(ray, lambda));
        });
        if taken {
            *hits = nearest.hits;
        }
        taken
    }

    /// `false`, and nothing done, if the rays are no bundle.
    fn any_together(
        &self,
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
        let mut met = 0;
        let mut ask = |object: u32, which: u32, bundle: &mut Bundle| {
            let now = self.occluded_by(object as usize, rays, which);
            met |= now;
            bundle.asking &= !now;
        };
        let taken = to_one_place && self.tree.together(rays, many, Start::End, bundle, &mut ask)
            || alike && self.tree.together(rays, many, Start::Origin, bundle, &mut ask);
        if taken {
            for &object in &self.unbounded {
                met |= self.occluded_by(object, rays, all(many) & !met);
            }
            *hits = std::array::from_fn(|ray| met >> ray & 1 == 1);
        }
        taken
    }

    /// Which of the rays of `which` hit `object`.
    fn occluded_by(&self, object: usize, rays: &[Stretch; RAYS], which: u32) -> u32 {
        let (asked, count) = chosen(rays, which);
        let mut hits = [false; RAYS];
        self.objects[object].shape.occludes_each(&asked[..count], &mut hits[..count]);
        bits(which).zip(hits).fold(0, |met, (ray, hit)| met | u32::from(hit) << ray)
    }
}

/// A bundle's search for the nearest hits.
struct Nearest<'a, M> {
    scene: &'a Scene<M>,
    rays: &'a [Stretch; RAYS],
    /// As far as hits may still come first.
    open: [Stretch; RAYS],
    hits: [Option<SceneHit>; RAYS],
}

impl<M> Nearest<'_, M> {
    /// Asks `object` for the hits of some rays and keeps those that come first; `shorten` is told how far such a ray
    /// matters now.
    fn consider(&mut self, object: usize, which: u32, mut shorten: impl FnMut(usize, f64)) {
        let (asked, count) = chosen(&self.open, which);
        let mut found = [None::<Hit>; RAYS];
        self.scene.objects[object].shape.intersect_each(&asked[..count], &mut found[..count]);
        for (ray, hit) in bits(which).zip(found) {
            let Some(hit) = hit else { continue };
            let (ref line, within) = self.rays[ray];
            let hit = self.scene.unlimited(object, line, within, self.open[ray].1.max, hit);
            let found = SceneHit { object, hit };
            if self.hits[ray].as_ref().is_none_or(|best| self.scene.precedes(line, &found, best)) {
                self.hits[ray] = Some(found);
                self.open[ray].1.max = reach(&hit, within.max);
                shorten(ray, self.open[ray].1.max);
            }
        }
    }
}

/// The first `many` rays.
fn all(many: usize) -> u32 {
    u32::MAX >> (RAYS - many)
}

/// The numbers of the bits that are set.
fn bits(mut which: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = which.trailing_zeros() as usize;
        which &= which.wrapping_sub(1);
        (bit < RAYS).then_some(bit)
    })
}

/// The rays of `which`, in front of others, and how many.
fn chosen(rays: &[Stretch; RAYS], which: u32) -> ([Stretch; RAYS], usize) {
    let mut asked = *rays;
    for (to, from) in bits(which).enumerate() {
        asked[to] = rays[from];
    }
    (asked, which.count_ones() as usize)
}
