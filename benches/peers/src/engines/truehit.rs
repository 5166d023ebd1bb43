//! truehit: `Mesh`, one ray a call, and slices of rays.

use crate::engine::{Engine, Found, RaySet};
use crate::mesh::Mesh;
use truehit::glam::DVec3;
use truehit::{Interval, Shape};

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
        for ((ray, limit), found) in set.double.iter().zip(&set.rays).zip(found) {
            let within = Interval::new(0.0, limit.max.into());
            *found = self
                .0
                .intersect(ray, within)
                .map_or(Found::MISS, |hit| Found { triangle: hit.part, lambda: hit.lambda });
        }
    }

    fn any(&mut self, set: &RaySet, hit: &mut [bool]) {
        for ((ray, limit), hit) in set.double.iter().zip(&set.rays).zip(hit) {
            *hit = self.0.occludes(ray, Interval::new(0.0, limit.max.into()));
        }
    }
}
