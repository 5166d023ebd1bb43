//! Triangle meshes.
//!
//! A tree of f32 boxes over leaves of eight f32 triangles finds the few that may be met (`leaf` says why none is
//! lost); [`kernel::triangle`] decides them exactly and gives λ.

mod attributes;
mod build;
mod each;
mod leaf;
mod query;
mod seen;
mod settle;

use crate::bvh::{Frame, Level, Watch, Wide};
use crate::kernel::triangle;
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint};
use build::Built;
use glam::{DAffine3, DVec2, DVec3};
use leaf::Leaf;
use std::ops::ControlFlow;

/// A mesh of triangles: closed sets, each with its edges and vertices, so that neighbours leave no gap.
///
/// A hit's `part` is the triangle's index and its `uv` the second and third barycentric weights; of triangles met at
/// exactly the same λ (a shared edge, coincident triangles) the lowest index is hit. Degenerate triangles are legal
/// and never hit. The geometric normal is by winding: (b − a) × (c − a).
///
/// ```
/// use truehit::{Interval, Mesh, Ray, Shape, glam::DVec3};
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let square = Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2], [0, 2, 3]])?;
/// // Exactly through the diagonal, which belongs to both triangles.
/// let hit = square.intersect(&Ray::new([0.5, 0.5, 3.0], [0.0, 0.0, -1.0]), Interval::FORWARD).unwrap();
/// assert_eq!((hit.lambda, hit.part), (3.0, 0));
///
/// // Many rays in one call are walked together.
/// let down = |i: u8| (Ray::new([0.5, 0.01 * f64::from(i), 3.0], [0.0, 0.0, -1.0]), Interval::FORWARD);
/// let rays: Vec<_> = (0..=200).map(down).collect();
/// let mut hits = vec![None; rays.len()];
/// square.intersect_each(&rays, &mut hits);
/// assert_eq!(hits[50], Some(hit));
/// assert_eq!(hits.iter().flatten().count(), 101);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<DVec3>,
    uvs: Vec<DVec2>,
    bounds: Aabb,
    tree: Wide,
    leaves: Vec<Leaf>,
    /// The leaves hold the vertices themselves, not rounded ones.
    exact: bool,
    /// The frame's unit as [`settle`] counts with it.
    unit: f64,
    level: Level,
}

impl Mesh {
    /// The mesh of `triangles`, each three indices into `positions`. Both may be empty.
    ///
    /// # Errors
    /// If a position is not finite, an index names no position, or there are 2²⁹ triangles or more.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, InvalidShape> {
        Self::new_watched(positions, triangles, &Watch::nobody())
    }

    /// The same mesh, with an observer for builds of seconds: it is told now and then which share is done, from 0 to 1,
    /// never less than before, and may end the build. Calls come from the threads that build, one at a time.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use truehit::{InvalidShape, Mesh, glam::DVec3};
    /// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    /// let mut seen = Vec::new();
    /// let mesh = Mesh::new_observed(corners.clone(), vec![[0, 1, 2]], &mut |share| {
    ///     seen.push(share);
    ///     ControlFlow::Continue(())
    /// })?;
    /// assert!(seen[0] == 0.0 && seen.last() == Some(&1.0));
    /// let refused = Mesh::new_observed(corners, vec![[0, 1, 2]], &mut |_| ControlFlow::Break(()));
    /// assert_eq!(refused.unwrap_err(), InvalidShape::Cancelled);
    /// # Ok::<(), InvalidShape>(())
    /// ```
    ///
    /// # Errors
    /// [`InvalidShape::Cancelled`] if the observer breaks; otherwise as for [`new`](Self::new).
    pub fn new_observed(
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        observer: &mut (dyn FnMut(f64) -> ControlFlow<()> + Send),
    ) -> Result<Self, InvalidShape> {
        Self::new_watched(positions, triangles, &Watch::new(observer))
    }

    fn new_watched(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, watch: &Watch) -> Result<Self, InvalidShape> {
        if !positions.iter().all(|p| p.is_finite()) {
            return Err(InvalidShape::NotFinite { field: "positions" });
        }
        if triangles.len() >= leaf::MOST_TRIANGLES {
            return Err(InvalidShape::TooMany { field: "triangles", given: triangles.len() });
        }
        let count = positions.len();
        let mut used = vec![false; count];
        for (at, t) in triangles.iter().enumerate() {
            for &index in t {
                let Some(used) = used.get_mut(index as usize) else {
                    return Err(InvalidShape::IndexOutOfRange { field: "triangles", at, index, count });
                };
                *used = true;
            }
        }
        let level = Level::detect();
        let built = build::build(&positions, &triangles, &used, level, watch);
        let Some(Built { tree, leaves, exact, bounds }) = built else { return Err(InvalidShape::Cancelled) };
        let unit = settle::unit(&tree.frame);
        let (normals, uvs) = (Vec::new(), Vec::new());
        Ok(Self { positions, triangles, normals, uvs, bounds, tree, leaves, exact, unit, level })
    }

    /// With a shading normal for each position, of any length; they are interpolated over the triangles, and where
    /// they cancel the geometric normal stands in.
    ///
    /// # Errors
    /// If there is not one for each position, or one is not finite.
    pub fn with_normals(mut self, normals: Vec<DVec3>) -> Result<Self, InvalidShape> {
        if normals.len() != self.positions.len() {
            let (needed, given) = (self.positions.len(), normals.len());
            return Err(InvalidShape::LengthMismatch { field: "normals", needed, given });
        }
        if !normals.iter().all(|n| n.is_finite()) {
            return Err(InvalidShape::NotFinite { field: "normals" });
        }
        self.normals = normals;
        Ok(self)
    }

    /// With texture coordinates for each position, interpolated over the triangles.
    ///
    /// # Errors
    /// If there is not one pair for each position, or one is not finite.
    pub fn with_uvs(mut self, uvs: Vec<DVec2>) -> Result<Self, InvalidShape> {
        if uvs.len() != self.positions.len() {
            let (needed, given) = (self.positions.len(), uvs.len());
            return Err(InvalidShape::LengthMismatch { field: "uvs", needed, given });
        }
        if !uvs.iter().all(|uv| uv.is_finite()) {
            return Err(InvalidShape::NotFinite { field: "uvs" });
        }
        self.uvs = uvs;
        Ok(self)
    }

    /// The positions.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The triangles' indices into the positions.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The vertices of a triangle.
    ///
    /// # Panics
    /// If there is no triangle of that index.
    #[must_use]
    #[inline]
    pub fn vertices(&self, part: u32) -> [DVec3; 3] {
        // `map` would be a call, and leave the vertices in memory.
        let [a, b, c] = self.triangles[part as usize];
        let position = |i: u32| self.positions[i as usize];
        [position(a), position(b), position(c)]
    }

    /// Uses the instructions of `level` from now on, if this CPU has them: for tests and benchmarks. All levels give
    /// the same answers.
    pub fn set_level(&mut self, level: Level) {
        self.level = level;
    }

    /// Bytes on the heap, all arrays included.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.positions.capacity() * size_of::<DVec3>()
            + self.triangles.capacity() * size_of::<[u32; 3]>()
            + self.normals.capacity() * size_of::<DVec3>()
            + self.uvs.capacity() * size_of::<DVec2>()
            + self.leaves.capacity() * size_of::<Leaf>()
            + self.tree.memory()
    }

    fn frame(&self) -> &Frame {
        &self.tree.frame
    }
}

impl Shape for Mesh {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        query::closest(self, ray, within)
    }

    fn normal(&self, _: &Ray, hit: &Hit) -> DVec3 {
        triangle::normal(&self.vertices(hit.part))
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn bounds_under(&self, map: &DAffine3) -> Aabb {
        // A million instances of a large mesh must not read all of it each.
        const FEW: usize = 64;
        if self.positions.len() <= FEW || !self.frame().unscale.is_finite() {
            return Aabb::around_images(&self.positions, map);
        }
        self.tree.boxes().fold(Aabb::EMPTY, |b, part| b.union(part.image(map)))
    }

    fn occludes(&self, ray: &Ray, within: Interval) -> bool {
        query::any(self, ray, within)
    }

    /// Rays in a row that go much the same way, such as those of neighbouring pixels, are walked through the tree
    /// together, which is about three times as fast; most so if they start at one point, a camera, and come in tiles of
    /// pixels. Others cost what they cost alone. Each answer is the ray's own, to the bit.
    fn intersect_each(&self, rays: &[(Ray, Interval)], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "there must be one hit for each ray");
        each::closest(self, rays, hits);
    }

    /// Shadow rays of neighbouring pixels to one light do best.
    fn occludes_each(&self, rays: &[(Ray, Interval)], hits: &mut [bool]) {
        assert_eq!(rays.len(), hits.len(), "there must be one answer for each ray");
        each::any(self, rays, hits);
    }

    fn shading_normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        if self.normals.is_empty() {
            return self.normal(ray, hit);
        }
        let corners = self.triangles[hit.part as usize].map(|i| self.normals[i as usize]);
        attributes::blended_normal(&corners, hit.uv).unwrap_or_else(|| self.normal(ray, hit))
    }

    fn texture_coordinates(&self, _: &Ray, hit: &Hit) -> DVec2 {
        if self.uvs.is_empty() {
            return hit.uv;
        }
        let [a, b, c] = self.triangles[hit.part as usize].map(|i| self.uvs[i as usize]);
        let [wa, wb, wc] = attributes::weights(hit.uv);
        wa * a + wb * b + wc * c
    }

    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let (position, error) = triangle::point(ray, &self.vertices(hit.part), hit.uv);
        SurfacePoint { position, error }
    }

    fn departs(&self, ray: &Ray, hit: &Hit, outward: bool) -> bool {
        triangle::departs(ray, &self.vertices(hit.part), outward)
    }

    fn intersect_piece(&self, ray: &Ray, hit: &Hit, within: Interval) -> Option<Hit> {
        let found = triangle::intersect(ray, &self.vertices(hit.part), within)?;
        Some(Hit { part: hit.part, ..found })
    }

    fn precise_lambda(&self, ray: &Ray, hit: &Hit) -> [f64; 2] {
        triangle::precise_lambda(ray, &self.vertices(hit.part))
    }
}
