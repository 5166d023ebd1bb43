//! truehit: `Mesh`, one ray a call, and slices of rays.

use crate::engine::{Engine, Found, RaySet};
use crate::mesh::Mesh;
use truehit::glam::DVec3;
use truehit::{Hit, Shape};

pub struct Single(truehit::Mesh);

fn build(mesh: &Mesh) -> truehit::Mesh {
    let positions = mesh.positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    truehit::Mesh::new(positions, mesh.triangles.clone()).expect("triangles")
}

impl Single {
    pub fn new(source: &Mesh) -> Self {
        Self(build(source))
    }
}

impl Engine for Single {
    fn closest(&mut self, set: &RaySet, found: &mut [Found]) {
        for ((ray, within), found) in set.double.iter().zip(found) {
            *found = as_found(self.0.intersect(ray, *within));
        }
    }

    fn any(&mut self, set: &RaySet, hit: &mut [bool]) {
        for ((ray, within), hit) in set.double.iter().zip(hit) {
            *hit = self.0.occludes(ray, *within);
        }
    }
}

fn as_found(hit: Option<Hit>) -> Found {
    hit.map_or(Found::MISS, |hit| Found { triangle: hit.part, lambda: hit.lambda })
}

/// Some thousand rays a call, so that answers are read while they are in the cache.
pub struct Slices {
    mesh: truehit::Mesh,
    hits: Vec<Option<Hit>>,
}

const RAYS_A_CALL: usize = 4096;

impl Slices {
    pub fn new(source: &Mesh) -> Self {
        Self { mesh: build(source), hits: vec![None; RAYS_A_CALL] }
    }
}

impl Engine for Slices {
    fn closest(&mut self, set: &RaySet, found: &mut [Found]) {
        for (rays, found) in set.double.chunks(RAYS_A_CALL).zip(found.chunks_mut(RAYS_A_CALL)) {
            let hits = &mut self.hits[..rays.len()];
            self.mesh.intersect_each(rays, hits);
            for (hit, found) in hits.iter().zip(found) {
                *found = as_found(*hit);
            }
        }
    }

    fn any(&mut self, set: &RaySet, hit: &mut [bool]) {
        self.mesh.occludes_each(&set.double, hit);
    }
}
