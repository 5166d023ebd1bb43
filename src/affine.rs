//! A shape seen through an affine map.

use crate::kernel::bound::{INFLATE, U};
use crate::kernel::cpu;
use crate::kernel::dyadic::Dyadic;
use crate::kernel::eft::{Fused, Product, Split, two_sum};
use crate::kernel::float::{exponent_of, ldexp, unit};
use crate::kernel::number::{Number, Vector, cross, dot, vector};
use crate::kernel::ratio::Ratio;
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, Shape, SurfacePoint};
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// `shape` moved, turned, scaled, mirrored or sheared by an affine map.
///
/// Rays are taken to the shape rather than the shape to the rays, so any shape goes under any map, maps nest, and one
/// `Arc<Mesh>` under many maps is instancing. λ is the same in both frames: directions are never normalised.
///
/// The shape is *defined* by [`object_from_world`](Self::object_from_world), the inverse map rounded to floats: a point x
/// belongs to it if `object_from_world` · x belongs to the inner shape. A ray's image is rounded once, and hit or miss is
/// decided exactly for that image; λ is then corrected for the rounding, and the hit's `error` covers what is left.
/// Normals are Mᵀn normalised, M = `object_from_world`: outward stays outward under mirrors too.
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine<S> {
    shape: S,
    object_from_world: DAffine3,
    world_from_object: DAffine3,
    bounds: Aabb,
    /// At least ‖M‖, M = `object_from_world`, and ‖M⁻¹‖: by how much they may lengthen a vector.
    norms: [f64; 2],
}

impl<S: Shape> Affine<S> {
    /// `shape` under the map `world_from_object`.
    ///
    /// # Errors
    /// [`InvalidShape::NotFinite`] for a NaN or an infinity; [`InvalidShape::Singular`] if the map flattens space: its
    /// exact determinant is zero, or that of its rounded inverse; [`InvalidShape::OutOfRange`] if the inverse leaves the
    /// range of floats.
    pub fn new(shape: S, world_from_object: DAffine3) -> Result<Self, InvalidShape> {
        if !world_from_object.is_finite() {
            return Err(InvalidShape::NotFinite { field: FIELD });
        }
        let object_from_world = inverse(&world_from_object)?;
        // What the shape is defined by, inverted: not quite the map that was given.
        let world_from_object = inverse(&object_from_world)?;
        let bounds = shape.bounds_under(&world_from_object);
        let norms = [largest_stretch(&object_from_world.matrix3), largest_stretch(&world_from_object.matrix3)];
        Ok(Self { shape, object_from_world, world_from_object, bounds, norms })
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
        &self.object_from_world
    }

    /// The inverse of [`object_from_world`](Self::object_from_world), each entry rounded once.
    #[must_use]
    pub fn world_from_object(&self) -> &DAffine3 {
        &self.world_from_object
    }

    /// Mᵀn, a unit vector.
    fn world_normal(&self, object_normal: DVec3) -> DVec3 {
        let n = self.object_from_world.matrix3.transpose() * object_normal;
        unit(n).unwrap_or(object_normal)
    }
}

const FIELD: &str = "world_from_object";

/// The inverse, found exactly and rounded once: no determinant under- or overflows.
fn inverse(map: &DAffine3) -> Result<DAffine3, InvalidShape> {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(vector::<Dyadic>);
    let rows = [cross(&y, &z), cross(&z, &x), cross(&x, &y)];
    let det = dot(&x, &rows[0]);
    if det.is_zero() {
        return Err(InvalidShape::Singular { field: FIELD });
    }
    let over = |numerator: &Dyadic| {
        let ratio = Ratio { numerator: numerator.clone(), denominator: det.clone() };
        match ratio.lambda(0.0) {
            Some((value, error)) if error.is_finite() => Ok(value),
            _ => Err(InvalidShape::OutOfRange { field: FIELD, value: f64::INFINITY }),
        }
    };
    let row = |r: &Vector<Dyadic>| Ok(DVec3::new(over(&r[0])?, over(&r[1])?, over(&r[2])?));
    let t = vector(map.translation);
    let shift = |r: &Vector<Dyadic>| over(&dot(r, &t).negated());
    Ok(DAffine3 {
        matrix3: DMat3::from_cols(row(&rows[0])?, row(&rows[1])?, row(&rows[2])?).transpose(),
        translation: DVec3::new(shift(&rows[0])?, shift(&rows[1])?, shift(&rows[2])?),
    })
}

/// At least |Mv|/|v| for every v, exact but for rounding where M turns and scales along its own axes: ‖M‖² is at most the
/// largest absolute row sum of MᵀM.
fn largest_stretch(m: &DMat3) -> f64 {
    let largest = m.to_cols_array().iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let k = -exponent_of(largest);
    let m = DMat3::from_cols_array(&m.to_cols_array().map(|x| ldexp(x, k)));
    let gram = m.transpose() * m;
    let rows = gram.x_axis.abs() + gram.y_axis.abs() + gram.z_axis.abs();
    ldexp((rows.max_element() * (1.0 + 64.0 * U)).sqrt() * (1.0 + 4.0 * U), -k)
}

/// A ray's image: rounded, what rounding took away, and a bound on what even that leaves out.
struct Image {
    ray: Ray,
    origin_low: DVec3,
    direction_low: DVec3,
    origin_error: f64,
    direction_error: f64,
}

fn image(map: &DAffine3, ray: &Ray) -> Image {
    cpu::dispatch(
        #[inline(always)]
        || image_with::<Fused>(map, ray),
        #[inline(always)]
        || image_with::<Split>(map, ray),
    )
}

#[inline(always)]
fn image_with<P: Product>(map: &DAffine3, ray: &Ray) -> Image {
    let m = map.matrix3;
    let row = |i: usize, v: DVec3, t: f64| sum::<P>([m.x_axis[i], m.y_axis[i], m.z_axis[i]], v, t);
    let o = [0, 1, 2].map(|i| row(i, ray.origin, map.translation[i]));
    let d = [0, 1, 2].map(|i| row(i, ray.direction, 0.0));
    let part =
        |v: &[(f64, f64, f64); 3], pick: fn(&(f64, f64, f64)) -> f64| DVec3::new(pick(&v[0]), pick(&v[1]), pick(&v[2]));
    // Each low part is a sum of up to seven terms of at most u of the sizes, rounded at most five times; products and
    // their errors may have underflowed.
    let left_out = |v: &[(f64, f64, f64); 3]| 32.0 * U * U * (v[0].2 + v[1].2 + v[2].2) + 64.0 * f64::from_bits(1);
    Image {
        ray: Ray { origin: part(&o, |v| v.0), direction: part(&d, |v| v.0) },
        origin_low: part(&o, |v| v.1),
        direction_low: part(&d, |v| v.1),
        origin_error: left_out(&o),
        direction_error: left_out(&d),
    }
}

/// r·v + t in double-double, and the sum of the terms' absolute values.
#[inline(always)]
fn sum<P: Product>(r: [f64; 3], v: DVec3, t: f64) -> (f64, f64, f64) {
    let (x, x_lo) = P::two_product(r[0], v.x);
    let (y, y_lo) = P::two_product(r[1], v.y);
    let (z, z_lo) = P::two_product(r[2], v.z);
    let (xy, e) = two_sum(x, y);
    let (zt, f) = two_sum(z, t);
    let (s, g) = two_sum(xy, zt);
    let (hi, lo) = two_sum(s, ((e + f) + g) + ((x_lo + y_lo) + z_lo));
    (hi, lo, (x.abs() + y.abs()) + (z.abs() + t.abs()))
}

/// |v|₁ ≥ |v|.
fn norm(v: DVec3) -> f64 {
    v.abs().element_sum()
}

impl<S: Shape> Affine<S> {
    fn object_ray(&self, world_ray: &Ray) -> Ray {
        image(&self.object_from_world, world_ray).ray
    }

    /// How far λ of `hit` moves from the rounded image to the exact one, and a bound on how far that is off.
    ///
    /// With e = o_lo + λ·d_lo the first order is Δ = −n·e/n·d; what it leaves out is bounded by what is not known of e, n
    /// and d, and by the surface's curvature. Where the ray grazes too closely for that, both hits lie in the shape's
    /// box. docs/numerics.md §8.
    fn shift(&self, image: &Image, hit: &Hit) -> (f64, f64) {
        let (ray, lambda) = (&image.ray, hit.lambda);
        let low = lambda * image.direction_low;
        let e = image.origin_low + low;
        let unknown = image.origin_error
            + lambda.abs() * image.direction_error
            + 4.0 * U * (norm(image.origin_low) + norm(low))
            + hit.error * norm(image.direction_low);
        let (size, e_size) = (norm(ray.direction), norm(e));
        if e_size == 0.0 && unknown == 0.0 {
            return (0.0, 0.0);
        }
        let n = self.shape.normal(ray, hit);
        let curvature = self.shape.curvature(ray, hit);
        let normal_error = self.shape.normal_error(ray, hit) + curvature * (hit.error * size + e_size + unknown);
        let (slope, slope_low, slope_size) = sum::<Split>(n.to_array(), ray.direction, n.dot(image.direction_low));
        let slope = slope + slope_low;
        let slope_error = normal_error * size + 4.0 * U * (slope.abs() + U * slope_size) + image.direction_error;
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
        let bounds = self.shape.bounds();
        let widest = 2.0 * (norm(bounds.size()) + e_size + unknown) / ray.direction.abs().max_element();
        (0.0, if widest.is_finite() { widest } else { f64::INFINITY })
    }
}

impl<S: Shape> Shape for Affine<S> {
    fn intersect(&self, world_ray: &Ray, within: Interval) -> Option<Hit> {
        let image = image(&self.object_from_world, world_ray);
        let hit = self.shape.intersect(&image.ray, within)?;
        let (shift, error) = self.shift(&image, &hit);
        // Decided for the image, λ stays in its interval.
        let lambda = (hit.lambda + shift).max(within.min).min(within.max);
        let clamped = (hit.lambda + shift - lambda).abs();
        let error = (hit.error + error + U * lambda.abs() + clamped) * INFLATE;
        Some(Hit { lambda, error, ..hit })
    }

    fn normal(&self, world_ray: &Ray, hit: &Hit) -> DVec3 {
        self.world_normal(self.shape.normal(&self.object_ray(world_ray), hit))
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn occludes(&self, world_ray: &Ray, within: Interval) -> bool {
        self.shape.occludes(&self.object_ray(world_ray), within)
    }

    fn shading_normal(&self, world_ray: &Ray, hit: &Hit) -> DVec3 {
        self.world_normal(self.shape.shading_normal(&self.object_ray(world_ray), hit))
    }

    fn texture_coordinates(&self, world_ray: &Ray, hit: &Hit) -> DVec2 {
        self.shape.texture_coordinates(&self.object_ray(world_ray), hit)
    }

    fn point(&self, world_ray: &Ray, hit: &Hit) -> SurfacePoint {
        let object_ray = self.object_ray(world_ray);
        let SurfacePoint { position, error } = self.shape.point(&object_ray, hit);
        let (w, t) = (self.world_from_object.matrix3, self.world_from_object.translation);
        let row = |i: usize| sum::<Split>([w.x_axis[i], w.y_axis[i], w.z_axis[i]], position, t[i]);
        let rows = [row(0), row(1), row(2)];
        let world = DVec3::new(rows[0].0, rows[1].0, rows[2].0);
        // The map's entries are rounded, and so is the sum.
        let rounding = U * (norm(world) + rows.iter().map(|r| 2.0 * r.2).sum::<f64>());
        // An object-space error ε is at most ‖W‖ε here; along the normal, where it lies, it is ε/|Mᵀn|.
        let stretched = error * self.norms[1];
        let n = self.object_from_world.matrix3.transpose() * self.shape.normal(&object_ray, hit);
        let across = 1.01 * error / n.length();
        let bends = self.curvature(world_ray, hit) * across;
        let off = if bends < 0.005 && across < stretched { across } else { stretched };
        SurfacePoint { position: world, error: (off + rounding) * INFLATE }
    }

    fn departs(&self, world_ray: &Ray, hit: &Hit, outward: bool) -> bool {
        self.shape.departs(&self.object_ray(world_ray), hit, outward)
    }

    fn curvature(&self, world_ray: &Ray, hit: &Hit) -> f64 {
        let object_ray = self.object_ray(world_ray);
        let n = self.object_from_world.matrix3.transpose() * self.shape.normal(&object_ray, hit);
        // κ‖M‖²/|Mᵀn|, in an order that stays in range.
        self.shape.curvature(&object_ray, hit) * self.norms[0] * (self.norms[0] / n.length())
    }

    fn normal_error(&self, world_ray: &Ray, hit: &Hit) -> f64 {
        let object_ray = self.object_ray(world_ray);
        let n = self.object_from_world.matrix3.transpose() * self.shape.normal(&object_ray, hit);
        // |δ(Mᵀn)| ≤ ‖M‖(|δn| + a few u); of it only what is across Mᵀn turns the unit vector.
        let error = self.shape.normal_error(&object_ray, hit) + 8.0 * U;
        1.01 * error * (self.norms[0] / n.length()) + 8.0 * U
    }

    fn precise_lambda(&self, world_ray: &Ray, hit: &Hit) -> [f64; 2] {
        let image = image(&self.object_from_world, world_ray);
        let [hi, lo] = self.shape.precise_lambda(&image.ray, hit);
        let (shift, _) = self.shift(&image, hit);
        let (hi, rest) = two_sum(hi, shift);
        let (hi, lo) = two_sum(hi, lo + rest);
        [hi, lo]
    }
}
