//! Many shapes, one question: what does the ray meet first?

mod each;

use crate::bvh::{self, Bvh};
use crate::kernel::eft::two_diff;
use crate::{Aabb, Hit, Interval, Ray, Shape, Surface};

/// Shapes, each with a tag of type `M` that the scene carries and never looks into: a material, an id, `()`.
///
/// An object's index is its place in the order of [`push`](SceneBuilder::push). Of hits at equal λ the lowest
/// (object, part) is answered. A scene without objects is legal: everything misses.
///
/// ```
/// use truehit::{Interval, Ray, Scene, Sphere};
/// let mut builder = Scene::builder();
/// builder.push(Sphere::new([0.0, 0.0, -5.0], 1.0)?, "far");
/// builder.push(Sphere::new([0.0, 0.0, -3.0], 0.5)?, "near");
/// let scene = builder.build();
///
/// let ray = Ray::new([0.0; 3], [0.0, 0.0, -1.0]);
/// let nearest = scene.intersect(&ray, Interval::FORWARD).unwrap();
/// assert_eq!(*scene.tag(nearest.object), "near");
/// assert_eq!(nearest.hit.lambda, 2.5);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Debug)]
pub struct Scene<M> {
    objects: Vec<Object<M>>,
    /// Of the objects with a finite box.
    tree: Bvh,
    /// The others, asked by every ray: planes, and shapes whose box has an infinity or a NaN in it.
    unbounded: Vec<usize>,
    bounds: Aabb,
}

#[derive(Debug)]
struct Object<M> {
    shape: Box<dyn Shape>,
    tag: M,
}

/// Which object a ray met, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneHit {
    /// The object's index, as [`SceneBuilder::push`] returned it.
    pub object: usize,
    /// The hit, in terms of that object.
    pub hit: Hit,
}

/// Collects a scene's objects.
#[derive(Debug)]
pub struct SceneBuilder<M> {
    objects: Vec<Object<M>>,
}

impl<M> Default for SceneBuilder<M> {
    fn default() -> Self {
        Self { objects: Vec::new() }
    }
}

impl<M> SceneBuilder<M> {
    /// Adds an object and returns its index: 0, 1, 2, …
    pub fn push(&mut self, shape: impl Shape + 'static, tag: M) -> usize {
        self.objects.push(Object { shape: Box::new(shape), tag });
        self.objects.len() - 1
    }

    /// The scene. Every shape passed its own constructor, so nothing is left to refuse; a user's shape with a NaN in
    /// its box is asked by every ray, like an unbounded one.
    #[must_use]
    pub fn build(self) -> Scene<M> {
        let shapes: Vec<&dyn Shape> = self.objects.iter().map(|object| &*object.shape).collect();
        let mut boxes = bvh::map(shapes.len(), |i| shapes[i].bounds());
        drop(shapes);
        let mut unbounded = Vec::new();
        let mut bounds = Aabb::EMPTY;
        for (index, own) in boxes.iter_mut().enumerate() {
            if own.min.is_nan() || own.max.is_nan() {
                bounds = Aabb::EVERYTHING;
            } else {
                bounds = bounds.union(*own);
            }
            if !own.is_finite() || own.is_empty() {
                unbounded.push(index);
                // Not in the tree.
                *own = Aabb::EMPTY;
            }
        }
        let mut objects = self.objects;
        objects.shrink_to_fit();
        Scene { objects, tree: Bvh::build(&boxes), unbounded, bounds }
    }
}

impl<M> Scene<M> {
    /// Begins a scene.
    #[must_use]
    pub fn builder() -> SceneBuilder<M> {
        SceneBuilder::default()
    }

    /// The nearest hit with λ inside `within`, over all objects.
    ///
    /// Two hits whose error bounds overlap are compared by [`Shape::precise_lambda`]; if that cannot tell them apart
    /// either, the lowest (object, part) wins.
    #[must_use]
    pub fn intersect(&self, ray: &Ray, within: Interval) -> Option<SceneHit> {
        let mut nearest = None;
        for &object in &self.unbounded {
            self.consider(ray, within, object, &mut nearest);
        }
        let limit = |nearest: &Option<SceneHit>| nearest.as_ref().map_or(within.max, |n| reach(&n.hit, within.max));
        self.tree.closest(ray, Interval { max: limit(&nearest), ..within }, |object, _| {
            self.consider(ray, within, object as usize, &mut nearest);
            limit(&nearest)
        });
        nearest
    }

    /// Whether any object is hit inside `within`.
    #[must_use]
    pub fn occludes(&self, ray: &Ray, within: Interval) -> bool {
        let occludes = |object: usize| self.objects[object].shape.occludes(ray, within);
        self.unbounded.iter().any(|&object| occludes(object))
            || self.tree.any(ray, within, |object| occludes(object as usize))
    }

    /// The surface at `hit`, which [`intersect`](Self::intersect) answered for the same `ray`.
    ///
    /// # Panics
    /// If `hit` is of another scene and its object is not in this one.
    #[must_use]
    pub fn surface(&self, ray: &Ray, hit: &SceneHit) -> Surface<'_> {
        Surface::new(self.shape(hit.object), ray, &hit.hit)
    }

    /// The tag that `object` was pushed with.
    ///
    /// # Panics
    /// If there is no such object.
    #[must_use]
    pub fn tag(&self, object: usize) -> &M {
        &self.objects[object].tag
    }

    /// The shape of `object`.
    ///
    /// # Panics
    /// If there is no such object.
    #[must_use]
    pub fn shape(&self, object: usize) -> &dyn Shape {
        &*self.objects[object].shape
    }

    /// How many objects there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.objects.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// A box that holds every object: [`Aabb::EMPTY`] for none, infinite where an object is.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Asks `object` for a hit and keeps it in `nearest` if it comes first.
    fn consider(&self, ray: &Ray, within: Interval, object: usize, nearest: &mut Option<SceneHit>) {
        let limit = nearest.as_ref().map_or(within.max, |n| reach(&n.hit, within.max));
        if let Some(hit) = self.objects[object].shape.intersect(ray, Interval { max: limit, ..within }) {
            let found = SceneHit { object, hit: self.unlimited(object, ray, within, limit, hit) };
            if nearest.as_ref().is_none_or(|best| self.precedes(ray, &found, best)) {
                *nearest = Some(found);
            }
        }
    }

    /// What `object` answers within the whole of `within`, where `hit` was found before `limit`. Next to a limit
    /// kernels look closer, and λ, `error` or `uv` may then differ within their bounds: an answer is not to depend on
    /// what was met before.
    #[inline]
    fn unlimited(&self, object: usize, ray: &Ray, within: Interval, limit: f64, hit: Hit) -> Hit {
        /// Where a limit is next to a hit: within a few bounds, or this part of λ, which is far more than kernels need.
        const NEXT: f64 = 1.0 / (1u64 << 40) as f64;
        // Written so that an unknown bound is next to it.
        let apart = hit.lambda + (8.0 * hit.error + NEXT * hit.lambda.abs()) < limit;
        if apart || limit == within.max {
            return hit;
        }
        self.asked_again(object, ray, within).unwrap_or(hit)
    }

    #[cold]
    #[inline(never)]
    fn asked_again(&self, object: usize, ray: &Ray, within: Interval) -> Option<Hit> {
        self.objects[object].shape.intersect(ray, within)
    }

    /// Whether `a` comes before `b` on the ray.
    fn precedes(&self, ray: &Ray, a: &SceneHit, b: &SceneHit) -> bool {
        let gap = b.hit.lambda - a.hit.lambda;
        // Twice the bounds, to cover the rounding of gap and sum. Written so that NaN goes the careful way.
        if gap.abs() > 2.0 * (a.hit.error + b.hit.error) {
            return gap > 0.0;
        }
        self.precedes_narrowly(ray, a, b)
    }

    #[cold]
    fn precedes_narrowly(&self, ray: &Ray, a: &SceneHit, b: &SceneHit) -> bool {
        /// What two answers "to about a hundred bits" may differ by and still be of one λ.
        const RESOLUTION: f64 = f64::EPSILON * f64::EPSILON * 256.0; // 2⁻⁹⁶
        let precise = |h: &SceneHit| self.shape(h.object).precise_lambda(ray, &h.hit);
        let ([a_hi, a_lo], [b_hi, b_lo]) = (precise(a), precise(b));
        let (hi, lo) = two_diff(b_hi, a_hi);
        let gap = hi + (lo + (b_lo - a_lo));
        if gap.abs() > RESOLUTION * a_hi.abs() {
            return gap > 0.0;
        }
        (a.object, a.hit.part) < (b.object, b.hit.part)
    }
}

/// The upper limit for hits that may come before `hit` or tie with it: just above its bound.
fn reach(hit: &Hit, max: f64) -> f64 {
    // f64::min returns the other operand for a NaN: a bound that is unknown limits nothing.
    (hit.lambda + 2.0 * hit.error).next_up().min(max)
}
