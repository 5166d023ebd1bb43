//! A shape seen through an affine map.

use crate::kernel::bound::{INFLATE, U};
use crate::kernel::eft::{two_diff, two_sum};
use crate::kernel::float::{length, power, unit};
use crate::kernel::map::{Image, Map, Unusable, inverse, transform_point};
use crate::kernel::norm::{largest_stretch, taxicab};
use crate::kernel::tally;
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint, Tangent};
use glam::{DAffine3, DVec2, DVec3};

/// `shape` moved, turned, scaled, mirrored or sheared by an affine map.
///
/// Rays are taken to the shape rather than the shape to the rays, so any shape goes under any map, maps nest, and one
/// `Arc<Mesh>` under many maps is instancing. λ is the same in both frames: directions are never normalised. A chain of
/// maps is multiplied when it is made and costs what one map does.
///
/// The shape is *defined* by [`object_from_world`](Self::object_from_world), the inverse map rounded to floats: a point
/// x belongs to it if `object_from_world` · x belongs to the inner shape. Normals are Mᵀn normalised, M =
/// `object_from_world`: outward stays outward under mirrors too.
///
/// **What is decided.** A ray's exact image need not have float components. Hit or miss is decided, exactly, for
/// [`object_ray`](Self::object_ray): that image with each component rounded once. Where the ray meets the surface
/// within a unit in the last place of an edge or of a tangent, the exact image may decide otherwise, and nowhere else.
/// λ is corrected for the rounding, `error` bounds what is left of it, and it is this λ that is compared with the
/// interval.
///
/// ```
/// use truehit::glam::{DAffine3, DVec3};
/// use truehit::{Affine, Interval, Plane, Ray, Shape};
/// let floor = Plane::new([0.0; 3], [0.0, 1.0, 0.0])?;
/// let raised = Affine::new(floor, DAffine3::from_translation(DVec3::new(0.0, 2.0, 0.0)))?;
/// let hit = raised.intersect(&Ray::new([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]), Interval::FORWARD).unwrap();
/// assert_eq!(hit.lambda, 3.0);
/// # Ok::<(), truehit::InvalidShape>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Affine<S> {
    shape: S,
    /// To the frame of the innermost shape, which is `shape` unless that is itself seen through a map.
    innermost_from_world: Map,
    world_from_innermost: DAffine3,
    /// Of a chain, which few are: `object_from_world` and its inverse.
    link: Option<Box<[DAffine3; 2]>>,
}

impl<S: Shape> Affine<S> {
    /// `shape` under the map `world_from_object`.
    ///
    /// # Errors
    /// [`InvalidShape::NotFinite`] for a NaN or an infinity; [`InvalidShape::Singular`] if the map flattens space: its
    /// exact determinant is zero, or that of its rounded inverse; [`InvalidShape::OutOfRange`] if the inverse leaves
    /// the range of floats, or a chain's product does.
    pub fn new(shape: S, world_from_object: DAffine3) -> Result<Self, InvalidShape> {
        if !world_from_object.is_finite() {
            return Err(InvalidShape::NotFinite { field: FIELD });
        }
        let object_from_world = inverse(&world_from_object).map_err(refused)?;
        // What the shape is defined by, inverted: not quite the map that was given.
        let world_from_object = inverse(&object_from_world).map_err(refused)?;
        let (innermost_from_world, world_from_innermost, link) = match shape.seen_through() {
            Some((_, map)) => {
                let map = map.after(&object_from_world).map_err(refused)?;
                let inverse = map.inverse().map_err(refused)?;
                (map, inverse, Some(Box::new([object_from_world, world_from_object])))
            }
            None => (object_from_world.into(), world_from_object, None),
        };
        Ok(Self { shape, innermost_from_world, world_from_innermost, link })
    }

    /// The ray that hit or miss is decided for, in the frame of the innermost shape: that of [`shape`](Self::shape), or
    /// if that is itself an `Affine`, of the shape inside it, and so on.
    ///
    /// Each component x is off the exact image's by at most u·|x| + 48u²·P with u = 2⁻⁵³ and P the sum of absolute
    /// values of the products that x is made of: half a unit in the last place, unless the maps all but cancel it. In a
    /// chain, each further map may add 8u² of the product's largest entry to an entry.
    #[must_use]
    pub fn object_ray(&self, world_ray: &Ray) -> Ray {
        self.image(world_ray).ray
    }
}

impl<S> Affine<S> {
    /// The inner shape.
    #[must_use]
    pub fn shape(&self) -> &S {
        &self.shape
    }

    /// The map that defines the shape: the inverse of the one given, each entry rounded once.
    #[must_use]
    pub fn object_from_world(&self) -> &DAffine3 {
        self.link.as_ref().map_or(self.innermost_from_world.leading(), |link| &link[0])
    }

    /// The inverse of [`object_from_world`](Self::object_from_world), each entry rounded once.
    #[must_use]
    pub fn world_from_object(&self) -> &DAffine3 {
        self.link.as_ref().map_or(&self.world_from_innermost, |link| &link[1])
    }
}

const FIELD: &str = "world_from_object";

fn refused(why: Unusable) -> InvalidShape {
    match why {
        Unusable::Singular => InvalidShape::Singular { field: FIELD },
        Unusable::OutOfRange => InvalidShape::OutOfRange { field: FIELD, value: f64::INFINITY },
    }
}

/// λ of the exact image is at most this many times further from that of the rounded one than the point moves, in
/// lengths of the direction, unless the ray grazes by less than its inverse: how far outside the interval hits are
/// looked for.
const REACH: f64 = power(20);

impl<S: Shape> Affine<S> {
    #[inline]
    fn innermost(&self) -> &dyn Shape {
        self.shape.seen_through().map_or(&self.shape, |(shape, _)| shape)
    }

    fn image(&self, world_ray: &Ray) -> Image {
        self.innermost_from_world.image(world_ray)
    }

    /// At least ‖M‖: by how much M may lengthen a vector.
    fn norm(&self) -> f64 {
        largest_stretch(&self.innermost_from_world.leading().matrix3)
    }

    /// Mᵀn.
    fn across(&self, object_normal: DVec3) -> DVec3 {
        self.innermost_from_world.leading().matrix3.transpose() * object_normal
    }

    /// κ‖M‖²/|Mᵀn|, in an order that stays in range: how far a surface of curvature κ is bent here, where |Mᵀn| is
    /// `shrunk`.
    fn curved(&self, curvature: f64, shrunk: f64) -> f64 {
        if curvature == 0.0 {
            return 0.0;
        }
        let norm = self.norm();
        curvature * norm * (norm / shrunk)
    }

    /// Mᵀn, a unit vector.
    fn world_normal(&self, object_normal: DVec3) -> DVec3 {
        unit(self.across(object_normal)).unwrap_or(object_normal)
    }

    /// A point of the object, where its surface has this curvature and |Mᵀn| is `shrunk`.
    fn world_point(&self, object: SurfacePoint, curvature: f64, shrunk: f64) -> SurfacePoint {
        let SurfacePoint { position, error } = object;
        let world = transform_point(&self.world_from_innermost, position);
        let (w, t) = (self.world_from_innermost.matrix3, self.world_from_innermost.translation);
        // The map's entries are rounded, and so is the sum; products may be subnormal.
        let size =
            w.x_axis.abs() * position.x.abs() + w.y_axis.abs() * position.y.abs() + w.z_axis.abs() * position.z.abs();
        let rounding = U * (taxicab(world) + 2.0 * taxicab(size + t.abs())) + f64::from_bits(64);
        // An object-space error ε is at most ‖W‖ε here; along the normal, where it lies, it is ε/|Mᵀn|.
        let stretched = error * largest_stretch(&w);
        let along = 1.01 * error / shrunk;
        let bends = self.curved(curvature, shrunk) * along;
        let off = if bends < 0.005 && along < stretched { along } else { stretched };
        SurfacePoint { position: world, error: (off + rounding) * INFLATE }
    }

    /// `object`'s tangent plane; `across` is Mᵀn, of length `shrunk`.
    fn world_tangent(&self, object: &Tangent, across: DVec3, shrunk: f64) -> Tangent {
        // |δ(Mᵀn)| ≤ ‖M‖(|δn| + a few u); of it only what is across Mᵀn turns the unit vector.
        let turned = 1.01 * (object.normal_error + 8.0 * U) * (self.norm() / shrunk);
        Tangent {
            normal: unit(across).unwrap_or(object.normal),
            normal_error: turned + 8.0 * U,
            curvature: self.curved(object.curvature, shrunk),
        }
    }

    /// How far λ of `hit` moves from the rounded image to the exact one, and a bound on how far that is off.
    ///
    /// With e = o_lo + λ·d_lo the first order is Δ = −n·e/n·d; what it leaves out is bounded by what is not known of e,
    /// n and d, and by the surface's curvature. Where the ray grazes too closely for that, both hits lie in the shape's
    /// box. docs/numerics.md §8.
    fn shift(&self, image: &Image, hit: &Hit) -> (f64, f64) {
        let shape = self.innermost();
        let (ray, lambda) = (&image.ray, hit.lambda);
        let low = lambda * image.direction_low;
        let e = image.origin_low + low;
        let unknown = image.origin_error
            + lambda.abs() * image.direction_error
            + 4.0 * U * (taxicab(image.origin_low) + taxicab(low))
            + hit.error * taxicab(image.direction_low);
        let (size, e_size) = (taxicab(ray.direction), taxicab(e));
        if e_size == 0.0 && unknown == 0.0 {
            return (0.0, 0.0);
        }
        let Tangent { normal: n, normal_error, curvature } = shape.tangent(ray, hit);
        let normal_error = normal_error + curvature * (hit.error * size + e_size + unknown);
        let slope = n.dot(ray.direction) + n.dot(image.direction_low);
        // Three products, three sums, and products that vanish.
        let slope_error = (normal_error + 5.0 * U) * size + image.direction_error + f64::from_bits(8);
        let least_slope = slope.abs() - slope_error;
        let shift = -n.dot(e) / slope;
        let first = (unknown + (normal_error + 4.0 * U) * e_size + shift.abs() * slope_error) / least_slope;
        let moved = e_size + unknown + (shift.abs() + first) * size;
        let bend = 1.3 * (curvature * moved) * moved / least_slope;
        let error = (first + bend) * INFLATE;
        let sound = slope.abs() >= 2.0 * slope_error
            && curvature * moved * size <= 0.3 * least_slope
            && curvature * moved <= 0.1
            && error.is_finite();
        if sound {
            return (shift, error);
        }
        let bounds = shape.bounds();
        let widest = 2.0 * (taxicab(bounds.size()) + e_size + unknown) / ray.direction.abs().max_element();
        (0.0, if widest.is_finite() { widest } else { f64::INFINITY })
    }

    /// What `hit`, the first of the rounded image in `zone`, is of the ray itself, or what comes after it.
    #[inline(always)]
    fn answer(&self, image: &Image, hit: Hit, zone: Interval, within: Interval) -> Option<Hit> {
        let (shift, error) = self.shift(image, &hit);
        let Hit { lambda, error, .. } = corrected(&hit, shift, error);
        if lambda - error > within.min && lambda + error < within.max {
            return Some(Hit { lambda, error, ..hit });
        }
        self.next_to_limit(image, hit, zone, within)
    }

    /// Next to a limit: the first hit of which the corrected λ lies inside `within`, from the first one in `zone` on.
    /// Where that is not known, the rounded image decides.
    #[cold]
    #[inline(never)]
    fn next_to_limit(&self, image: &Image, mut hit: Hit, mut zone: Interval, within: Interval) -> Option<Hit> {
        tally::refined();
        loop {
            match self.place(image, &hit, within, zone.min) {
                Place::Before => {}
                Place::Inside(hit) => return Some(hit),
                Place::Beyond => return None,
            }
            zone.min = past(&hit, zone);
            hit = self.innermost().intersect(&image.ray, zone)?;
        }
    }

    /// Where the corrected λ of `hit`, the first of the rounded image beyond `from`, lies against `within`.
    fn place(&self, image: &Image, hit: &Hit, within: Interval, from: f64) -> Place {
        let (shift, error) = self.shift(image, hit);
        let corrected = corrected(hit, shift, error);
        let Hit { lambda, error: off, .. } = corrected;
        if lambda + off < within.min {
            return Place::Before;
        }
        if lambda - off > within.max {
            return Place::Beyond;
        }
        if lambda - off > within.min && lambda + off < within.max {
            return Place::Inside(corrected);
        }
        let [hi, lo] = self.innermost().precise_lambda(&image.ray, hit);
        // To a hundred bits but for `error`; λ + Δ − limit.
        let beyond = |limit: f64| {
            if limit.is_infinite() {
                return (-limit, 0.0);
            }
            let (difference, rest) = two_diff(hi, limit);
            let rest = rest + (lo + shift);
            let unknown = error + power(-90) * hi.abs() + 8.0 * U * (rest.abs() + lo.abs() + shift.abs());
            (difference + rest, unknown * INFLATE + U * (difference + rest).abs())
        };
        let ((after, after_error), (before, before_error)) = (beyond(within.min), beyond(within.max));
        if after < -after_error {
            return Place::Before;
        }
        if before > before_error {
            return Place::Beyond;
        }
        if !(after > after_error && before < -before_error) {
            let decided = self.innermost().intersect(&image.ray, Interval { min: from.max(within.min), ..within });
            if decided.is_none_or(|d| d.part != hit.part || d.lambda != hit.lambda) {
                return if after > after_error { Place::Beyond } else { Place::Before };
            }
        }
        let exact = hit.lambda + shift;
        let lambda = exact.max(within.min).min(within.max);
        let error = (hit.error + error + U * lambda.abs() + (exact - lambda).abs()) * INFLATE;
        Place::Inside(Hit { lambda, error, ..*hit })
    }
}

/// `hit` where [`Affine::shift`] moves it.
#[inline(always)]
fn corrected(hit: &Hit, shift: f64, error: f64) -> Hit {
    let lambda = hit.lambda + shift;
    Hit { lambda, error: (hit.error + error + U * lambda.abs()) * INFLATE, ..*hit }
}

/// Where a hit lies against an interval.
enum Place {
    Before,
    Inside(Hit),
    Beyond,
}

/// Beyond the λ of `hit`, which lies inside `zone`.
fn past(hit: &Hit, zone: Interval) -> f64 {
    (hit.lambda + 2.0 * hit.error).max(zone.min.next_up())
}

/// `within`, and as much on either side of it as λ may move.
#[inline(always)]
fn widened(image: &Image, within: Interval) -> Interval {
    let origin = taxicab(image.origin_low) + image.origin_error;
    let direction = taxicab(image.direction_low) + image.direction_error;
    let longest = image.ray.direction.abs().max_element();
    // Infinite limits stay where they are; where the way to a finite one overflows, nothing is left out. 0·∞ adds
    // nothing.
    let reach = |limit: f64| (REACH * (origin + limit.abs() * direction) / longest).max(0.0);
    Interval { min: within.min - reach(within.min), max: within.max + reach(within.max) }
}

impl<S: Shape> Shape for Affine<S> {
    fn intersect(&self, world_ray: &Ray, within: Interval) -> Option<Hit> {
        if within.is_empty() {
            return None;
        }
        let image = self.image(world_ray);
        let zone = widened(&image, within);
        let hit = match self.shape.seen_through() {
            None => self.shape.intersect(&image.ray, zone),
            Some((innermost, _)) => innermost.intersect(&image.ray, zone),
        }?;
        self.answer(&image, hit, zone, within)
    }

    fn intersect_each(&self, rays: &[(Ray, Interval)], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "there must be one hit for each ray");
        let images: Vec<Image> = rays.iter().map(|(ray, _)| self.image(ray)).collect();
        let zoned = images.iter().zip(rays).map(|(image, &(_, within))| {
            let zone = if within.is_empty() { within } else { widened(image, within) };
            (image.ray, zone)
        });
        let zoned: Vec<(Ray, Interval)> = zoned.collect();
        self.innermost().intersect_each(&zoned, hits);
        for (i, hit) in hits.iter_mut().enumerate() {
            *hit = hit.and_then(|hit| self.answer(&images[i], hit, zoned[i].1, rays[i].1));
        }
    }

    fn occludes_each(&self, rays: &[(Ray, Interval)], hits: &mut [bool]) {
        assert_eq!(rays.len(), hits.len(), "there must be one answer for each ray");
        let mut found = vec![None; rays.len()];
        self.intersect_each(rays, &mut found);
        for (hit, found) in hits.iter_mut().zip(&found) {
            *hit = found.is_some();
        }
    }

    fn normal(&self, world_ray: &Ray, hit: &Hit) -> DVec3 {
        self.world_normal(self.innermost().normal(&self.object_ray(world_ray), hit))
    }

    fn bounds(&self) -> Aabb {
        self.innermost().bounds_under(&self.world_from_innermost)
    }

    fn seen_through(&self) -> Option<(&dyn Shape, &Map)> {
        Some((self.innermost(), &self.innermost_from_world))
    }

    fn shading_normal(&self, world_ray: &Ray, hit: &Hit) -> DVec3 {
        self.world_normal(self.innermost().shading_normal(&self.object_ray(world_ray), hit))
    }

    fn texture_coordinates(&self, world_ray: &Ray, hit: &Hit) -> DVec2 {
        self.innermost().texture_coordinates(&self.object_ray(world_ray), hit)
    }

    fn point(&self, world_ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.contact(world_ray, hit).0
    }

    fn tangent(&self, world_ray: &Ray, hit: &Hit) -> Tangent {
        self.contact(world_ray, hit).1
    }

    fn contact(&self, world_ray: &Ray, hit: &Hit) -> (SurfacePoint, Tangent) {
        let (point, tangent) = self.innermost().contact(&self.object_ray(world_ray), hit);
        let across = self.across(tangent.normal);
        let shrunk = length(across);
        (self.world_point(point, tangent.curvature, shrunk), self.world_tangent(&tangent, across, shrunk))
    }

    fn departs(&self, world_ray: &Ray, hit: &Hit, outward: bool) -> bool {
        let image = self.image(world_ray);
        if !self.innermost().departs(&image.ray, hit, outward) {
            return false;
        }
        // Behind the rounded image's origin, and before the exact one's? Only what was left may be there.
        let mut zone = Interval { max: f64::from_bits(1), ..widened(&image, Interval::FORWARD) };
        while let Some(behind) = self.innermost().intersect_piece(&image.ray, hit, zone) {
            let left = matches!(self.place(&image, &behind, Interval::FORWARD, zone.min), Place::Before);
            if !left && behind.part == hit.part {
                return false;
            }
            zone.min = past(&behind, zone);
        }
        true
    }

    fn precise_lambda(&self, world_ray: &Ray, hit: &Hit) -> [f64; 2] {
        let image = self.image(world_ray);
        let [hi, lo] = self.innermost().precise_lambda(&image.ray, hit);
        let (shift, _) = self.shift(&image, hit);
        let (hi, rest) = two_sum(hi, shift);
        let (hi, lo) = two_sum(hi, lo + rest);
        [hi, lo]
    }
}
