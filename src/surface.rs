//! A hit looked at closely: where it is, which way the surface faces, and how to leave it.

use crate::{Hit, Ray, Shape, SurfacePoint, Tangent};
use glam::{DVec2, DVec3};

/// The surface at a hit, and rays that leave it.
///
/// ```
/// use truehit::{Interval, Ray, Shape, Sphere, Surface};
/// let ball = Sphere::new([0.0; 3], 1.0)?;
/// let ray = Ray::new([0.3, 0.4, 5.0], [0.0, 0.0, -1.0]);
/// let hit = ball.intersect(&ray, Interval::FORWARD).unwrap();
/// let surface = Surface::new(&ball, &ray, &hit);
/// // Away from the ball: it is never met again, whatever the scale.
/// let away = surface.spawn(surface.normal());
/// assert!(ball.intersect(&away, Interval::FORWARD).is_none());
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    shape: &'a dyn Shape,
    ray: Ray,
    hit: Hit,
    point: DVec3,
    error: f64,
    normal: DVec3,
}

impl<'a> Surface<'a> {
    /// The surface of `shape` where `ray` met it at `hit`.
    #[must_use]
    pub fn new(shape: &'a dyn Shape, ray: &Ray, hit: &Hit) -> Self {
        let (SurfacePoint { position, error }, Tangent { normal, .. }) = shape.contact(ray, hit);
        Self { shape, ray: *ray, hit: *hit, point: position, error, normal }
    }

    /// The point, at most [`error`](Self::error) off the surface.
    #[must_use]
    pub fn point(&self) -> DVec3 {
        self.point
    }

    /// How far [`point`](Self::point) may be from the surface.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.error
    }

    /// The geometric unit normal, outward or by winding.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// The unit normal for shading.
    #[must_use]
    pub fn shading_normal(&self) -> DVec3 {
        self.shape.shading_normal(&self.ray, &self.hit)
    }

    /// Texture coordinates.
    #[must_use]
    pub fn texture_coordinates(&self) -> DVec2 {
        self.shape.texture_coordinates(&self.ray, &self.hit)
    }

    /// A ray that leaves the surface along `direction` (any non-zero length): it never meets the piece of surface it
    /// starts on, on its way out. A direction with a negative component along the normal leaves inward (a refracted
    /// ray: it meets a solid's far side as it should), any other outward.
    ///
    /// The origin is [`point`](Self::point) moved off the surface by its own error bound, and further only if the
    /// shape's exact test says that it is not yet clear: a few units in the last place, no epsilon.
    #[must_use]
    pub fn spawn(&self, direction: DVec3) -> Ray {
        self.leave(direction, |_| direction)
    }

    /// A ray from the surface to `target`, which it reaches at λ = 1: a shadow ray, to be traced over
    /// `Interval::new(0.0, 1.0)`. To a target as near to the surface's plane as rounding is, the ray may meet that
    /// surface again.
    #[must_use]
    pub fn spawn_to(&self, target: DVec3) -> Ray {
        self.leave(target - self.point, |origin| target - origin)
    }

    fn leave(&self, direction: DVec3, direction_from: impl Fn(DVec3) -> DVec3) -> Ray {
        let outward = direction.dot(self.normal) >= 0.0;
        // At least a unit in the last place of the largest coordinate, or adding the step would do nothing.
        let least = (2.0 * self.error).max(self.point.abs().max_element() * f64::EPSILON).max(f64::MIN_POSITIVE);
        let from = |outward: bool, step: f64| {
            let origin = self.point + (if outward { step } else { -step }) * self.normal;
            Ray { origin, direction: direction_from(origin) }
        };
        let departs = |ray: &Ray, outward: bool| ray.is_valid() && self.shape.departs(ray, &self.hit, outward);
        let first = from(outward, least);
        if departs(&first, outward) { first } else { self.search(outward, least, &from, &departs) }
    }

    /// Where the first step does not do.
    #[cold]
    #[inline(never)]
    fn search(
        &self,
        outward: bool,
        least: f64,
        from: &dyn Fn(bool, f64) -> Ray,
        departs: &dyn Fn(&Ray, bool) -> bool,
    ) -> Ray {
        let steps = || (0..DOUBLINGS).map(|k| least * f64::from(1u32 << k));
        let away = if outward { self.normal } else { -self.normal };
        // A direction along the surface may lie on one side of the rounded normal's plane and on the other of the exact
        // one: the exact test then never lets go on the first side.
        for side in [outward, !outward] {
            if let Some(ray) = steps().map(|step| from(side, step)).find(|ray| departs(ray, side)) {
                return ray;
            }
        }
        // A target that the surface itself hides, or that its ray reaches before coming down to the surface: only the
        // origin can be clear of it.
        let clear = |ray: &Ray| ray.is_valid() && departs(&Ray { direction: away, ..*ray }, outward);
        if let Some(ray) = steps().map(|step| from(outward, step)).find(clear) {
            return ray;
        }
        // A shape whose bound does not hold: as far as it takes.
        let mut step = least;
        loop {
            let ray = from(outward, step);
            if !ray.is_valid() {
                return from(outward, least);
            }
            if departs(&ray, outward) {
                return ray;
            }
            step *= 1024.0;
        }
    }
}

/// How often the step off the surface is doubled before something else is tried: bounds are a few times too large, so
/// the first step nearly always does, and 2⁸ of them are still far below 10⁻¹² of the scene.
const DOUBLINGS: u32 = 9;
