//! parry3d and parry3d-f64: `TriMesh`. It has no any-hit query; its users ask for the closest hit.

macro_rules! parry {
    ($name:ident, $crate_name:ident, $real:ty) => {
        pub struct $name($crate_name::shape::TriMesh);

        impl $name {
            pub fn new(mesh: &crate::mesh::Mesh) -> Self {
                use $crate_name::math::Vector;
                let vector = |p: &[f32; 3]| Vector::new(p[0].into(), p[1].into(), p[2].into());
                let positions = mesh.positions.iter().map(vector).collect();
                Self($crate_name::shape::TriMesh::new(positions, mesh.triangles.clone()).expect("triangles"))
            }

            fn trace(&self, ray: &crate::engine::Ray) -> Option<(u32, $real)> {
                use $crate_name::math::Vector;
                use $crate_name::query::Ray;
                use $crate_name::shape::CompositeShapeRef;
                let vector = |p: [f32; 3]| Vector::new(p[0].into(), p[1].into(), p[2].into());
                let max = if ray.max.is_finite() { ray.max.into() } else { <$real>::MAX };
                let ray = Ray::new(vector(ray.origin), vector(ray.direction));
                CompositeShapeRef(&self.0).cast_local_ray(&ray, max, false)
            }
        }

        impl crate::engine::Engine for $name {
            fn closest(&mut self, set: &crate::engine::RaySet, found: &mut [crate::engine::Found]) {
                for (ray, found) in set.rays.iter().zip(found) {
                    *found = self.trace(ray).map_or(crate::engine::Found::MISS, |(triangle, lambda)| {
                        crate::engine::Found { triangle, lambda: lambda.into() }
                    });
                }
            }

            fn any(&mut self, set: &crate::engine::RaySet, hit: &mut [bool]) {
                for (ray, hit) in set.rays.iter().zip(hit) {
                    *hit = self.trace(ray).is_some();
                }
            }
        }
    };
}
parry!(Single, parry3d, f32);
parry!(Double, parry3d_f64, f64);
