//! bvh: its tree and its box test. It ends at candidates, and its triangle test culls back faces; the loop that keeps
//! the closest hit and Möller and Trumbore's test of both sides are ours.

use crate::engine::{Engine, Found, RaySet};
use crate::mesh::Mesh;
use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use bvh::ray::Ray;
use nalgebra::{Point3, Vector3};

#[derive(Clone, Copy)]
pub struct Shape<T: Real> {
    corners: [Point3<T>; 3],
    node: usize,
}

pub trait Real: nalgebra::RealField + bvh::bounding_hierarchy::BHValue + Into<f64> + Copy {
    fn of(x: f32) -> Self;
}
impl Real for f32 {
    fn of(x: f32) -> Self {
        x
    }
}
impl Real for f64 {
    fn of(x: f32) -> Self {
        x.into()
    }
}

impl<T: Real> Bounded<T, 3> for Shape<T> {
    fn aabb(&self) -> Aabb<T, 3> {
        Aabb::empty().grow(&self.corners[0]).grow(&self.corners[1]).grow(&self.corners[2])
    }
}

impl<T: Real> BHShape<T, 3> for Shape<T> {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }
    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl<T: Real> Shape<T> {
    fn intersect(&self, ray: &Ray<T, 3>, max: T) -> Option<T> {
        let (e1, e2) = (self.corners[1] - self.corners[0], self.corners[2] - self.corners[0]);
        let p = ray.direction.cross(&e2);
        let inverse = T::of(1.0) / e1.dot(&p);
        let s = ray.origin - self.corners[0];
        let u = s.dot(&p) * inverse;
        let q = s.cross(&e1);
        let v = ray.direction.dot(&q) * inverse;
        let t = e2.dot(&q) * inverse;
        let zero = T::of(0.0);
        (u >= zero && v >= zero && u + v <= T::of(1.0) && t > zero && t < max).then_some(t)
    }
}

pub struct Tree<T: Real> {
    tree: Bvh<T, 3>,
    shapes: Vec<Shape<T>>,
    stack: Vec<(usize, T)>,
}

impl<T: Real> Tree<T> {
    pub fn new(mesh: &Mesh) -> Self {
        let shape = |t| Shape { corners: [0, 1, 2].map(|i| Point3::from(mesh.corner(t, i).map(T::of))), node: 0 };
        let mut shapes: Vec<_> = (0..mesh.triangles.len() as u32).map(shape).collect();
        let tree = Bvh::build(&mut shapes);
        Self { tree, shapes, stack: Vec::new() }
    }

    fn trace(&mut self, ray: &crate::engine::Ray, any: bool) -> Option<(usize, T)> {
        // Not `Ray::new`, which would normalise the direction and with it λ.
        let direction = Vector3::from(ray.direction.map(T::of));
        let inv_direction = direction.map(|x| T::of(1.0) / x);
        let mut max = T::of(ray.max);
        let ray = Ray { origin: Point3::from(ray.origin.map(T::of)), direction, inv_direction };
        let mut best = None;
        self.stack.clear();
        self.stack.push((0, T::of(0.0)));
        while let Some((node, near)) = self.stack.pop() {
            if near > max {
                continue;
            }
            match &self.tree.nodes[node] {
                BvhNode::Leaf { shape_index, .. } => {
                    if let Some(t) = self.shapes[*shape_index].intersect(&ray, max) {
                        max = t;
                        best = Some((*shape_index, t));
                        if any {
                            return best;
                        }
                    }
                }
                BvhNode::Node { child_l_index, child_l_aabb, child_r_index, child_r_aabb, .. } => {
                    let left = ray.intersection_slice_for_aabb(child_l_aabb).map(|s| (*child_l_index, s.0));
                    let right = ray.intersection_slice_for_aabb(child_r_aabb).map(|s| (*child_r_index, s.0));
                    match (left, right) {
                        (Some(l), Some(r)) if l.1 < r.1 => self.stack.extend([r, l]),
                        (Some(l), Some(r)) => self.stack.extend([l, r]),
                        (one, other) => self.stack.extend(one.or(other)),
                    }
                }
            }
        }
        best
    }
}

impl<T: Real> Engine for Tree<T> {
    fn closest(&mut self, set: &RaySet, found: &mut [Found]) {
        for (ray, found) in set.rays.iter().zip(found) {
            *found = self
                .trace(ray, false)
                .map_or(Found::MISS, |(triangle, lambda)| Found { triangle: triangle as u32, lambda: lambda.into() });
        }
    }

    fn any(&mut self, set: &RaySet, hit: &mut [bool]) {
        for (ray, hit) in set.rays.iter().zip(hit) {
            *hit = self.trace(ray, true).is_some();
        }
    }
}
