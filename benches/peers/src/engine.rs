//! What every engine in the race can do.

use crate::mesh::Mesh;
use std::time::Duration;

/// The same ray in both precisions: all components are floats of 24 bits, so no engine sees another ray than the rest.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    /// Hits count for 0 < λ < `max`.
    pub max: f32,
}

/// Rays and how they were made.
pub struct RaySet {
    pub name: &'static str,
    pub any_hit: bool,
    /// Neighbours in the slice are neighbours in the picture.
    pub coherent: bool,
    pub rays: Vec<Ray>,
    pub double: Vec<(truehit::Ray, truehit::Interval)>,
}

impl RaySet {
    pub fn new(name: &'static str, any_hit: bool, coherent: bool, rays: Vec<Ray>) -> Self {
        let widen = |v: [f32; 3]| v.map(f64::from);
        let double = rays
            .iter()
            .map(|r| {
                let ray = truehit::Ray::new(widen(r.origin), widen(r.direction));
                (ray, truehit::Interval::new(0.0, r.max.into()))
            })
            .collect();
        Self { name, any_hit, coherent, rays, double }
    }
}

/// No triangle.
pub const MISS: u32 = u32::MAX;

/// The answer to a closest-hit query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    pub triangle: u32,
    pub lambda: f64,
}

impl Found {
    pub const MISS: Self = Self { triangle: MISS, lambda: f64::INFINITY };

    pub fn is_hit(self) -> bool {
        self.triangle != MISS
    }
}

/// A built engine. Both queries take the whole set, so that no call of this trait is measured.
pub trait Engine {
    fn closest(&mut self, set: &RaySet, found: &mut [Found]);
    fn any(&mut self, set: &RaySet, hit: &mut [bool]);
    /// Bytes that the process' allocator does not see: a foreign library's, live and at the peak of its build.
    fn foreign_bytes(&self) -> (usize, usize) {
        (0, 0)
    }
}

/// How to make one.
pub struct Maker {
    pub name: &'static str,
    /// Triangle indices and λ in f64.
    pub double: bool,
    #[allow(clippy::type_complexity)]
    pub make: Box<dyn Fn(&Mesh) -> Box<dyn Engine>>,
}

/// An engine with what its build cost.
pub struct Built {
    pub name: &'static str,
    pub engine: Box<dyn Engine>,
    pub build: Duration,
    pub live: usize,
    pub peak: usize,
}
