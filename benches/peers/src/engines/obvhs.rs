//! obvhs: its two trees, best build, triangles in leaf order as its documentation advises.

use crate::engine::{Engine, Found, RaySet};
use crate::mesh::Mesh;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::time::Duration;

fn triangles(mesh: &Mesh) -> Vec<Triangle> {
    (0..mesh.triangles.len() as u32)
        .map(|t| {
            let [v0, v1, v2] = [0, 1, 2].map(|i| Vec3A::from(mesh.corner(t, i)));
            Triangle { v0, v1, v2 }
        })
        .collect()
}

macro_rules! obvhs {
    ($name:ident, $tree:ty, $build:ident) => {
        pub struct $name {
            tree: $tree,
            triangles: Vec<Triangle>,
        }

        impl $name {
            pub fn new(mesh: &Mesh) -> Self {
                let triangles = triangles(mesh);
                let tree = $build(&triangles, BvhBuildParams::very_slow_build(), &mut Duration::default());
                let triangles = tree.primitive_indices.iter().map(|&t| triangles[t as usize]).collect();
                Self { tree, triangles }
            }
        }

        impl Engine for $name {
            fn closest(&mut self, set: &RaySet, found: &mut [Found]) {
                for (ray, found) in set.rays.iter().zip(found) {
                    let ray = Ray::new(ray.origin.into(), ray.direction.into(), 0.0, ray.max);
                    let mut hit = RayHit::none();
                    self.tree.ray_traverse(ray, &mut hit, |ray, id| self.triangles[id].intersect(ray));
                    *found = match hit.primitive_id {
                        u32::MAX => Found::MISS,
                        id => Found { triangle: self.tree.primitive_indices[id as usize], lambda: hit.t.into() },
                    };
                }
            }

            fn any(&mut self, set: &RaySet, hit: &mut [bool]) {
                for (ray, hit) in set.rays.iter().zip(hit) {
                    let ray = Ray::new(ray.origin.into(), ray.direction.into(), 0.0, ray.max);
                    *hit = !self.tree.ray_traverse_miss(ray, |ray, id| self.triangles[id].intersect(ray));
                }
            }
        }
    };
}
obvhs!(Cw, CwBvh, build_cwbvh_from_tris);
obvhs!(Binary, Bvh2, build_bvh2_from_tris);
