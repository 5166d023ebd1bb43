//! The engines, each as its own documentation says it is fastest.

mod bvh;
mod obvhs;
mod parry;
mod truehit;

use crate::embree::{Embree, Mode, Scene};
use crate::engine::{Engine, Maker};
use crate::mesh::Mesh;
use std::sync::Arc;

/// All engines, the one that ratios refer to first.
pub fn all(embree: Option<&Arc<Embree>>) -> Vec<Maker> {
    let mut makers = Vec::new();
    if let Some(embree) = embree {
        let mut add = |name, robust, packets| {
            let embree = embree.clone();
            let make = move |mesh: &Mesh| -> Box<dyn Engine> {
                Box::new(Scene::new(&embree, mesh, Mode { robust, packets }, c"threads=1"))
            };
            makers.push(Maker { name, double: false, make: Box::new(make) });
        };
        add("Embree robust", true, false);
        add("Embree fast", false, false);
        add("Embree robust, packets", true, true);
        add("Embree fast, packets", false, true);
    }
    let mut add = |name, double, make: fn(&Mesh) -> Box<dyn Engine>| {
        makers.push(Maker { name, double, make: Box::new(make) });
    };
    add("truehit", true, |mesh| Box::new(truehit::Single::new(mesh)));
    add("truehit, slices", true, |mesh| Box::new(truehit::Slices::new(mesh)));
    add("obvhs CWBVH", false, |mesh| Box::new(obvhs::Cw::new(mesh)));
    add("obvhs BVH2", false, |mesh| Box::new(obvhs::Binary::new(mesh)));
    add("parry3d", false, |mesh| Box::new(parry::Single::new(mesh)));
    add("parry3d-f64", true, |mesh| Box::new(parry::Double::new(mesh)));
    add("bvh f32", false, |mesh| Box::new(bvh::Tree::<f32>::new(mesh)));
    add("bvh f64", true, |mesh| Box::new(bvh::Tree::<f64>::new(mesh)));
    makers
}
