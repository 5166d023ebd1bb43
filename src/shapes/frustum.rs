//! What cylinder, cone and truncated cone have in common: the capped frustum.

use super::local::{Local, around};
use super::patch::Patch;
use crate::kernel::bound::U;
use crate::kernel::float::{length, unit};
use crate::kernel::frustum::{self, BASE, TOP};
use crate::{Aabb, Hit, Interval, InvalidShape, Ray, SurfacePoint, Tangent};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frustum {
    pub(super) base: DVec3,
    pub(super) top: DVec3,
    pub(super) base_radius: f64,
    pub(super) top_radius: f64,
}

/// Where λ's own error moves a point by more than this part of the local radius, λ is asked for to a hundred bits.
const SHARP: f64 = 1.0 / (1u64 << 40) as f64;

/// A hit's point taken apart, in local units: end + along·axis + radial, from the nearer end, so that a rim and an apex
/// are met with their own rounding only.
struct Foot {
    local: Local,
    /// top − base; longer, where scaling would have left nothing of it.
    axis: DVec3,
    axis_length: f64,
    end: DVec3,
    /// From the base 0 to 1, from the top −1 to 0.
    along: f64,
    /// From the base to the top, 0 to 1.
    height: f64,
    /// Perpendicular to the axis; as long as the point's distance from it before any projection.
    radial: DVec3,
    /// Its length, and it over that: none on the axis.
    from_axis: f64,
    outward: Option<DVec3>,
    /// The wall's radius at this height.
    radius: f64,
}

impl Frustum {
    /// Checks what all of them refuse; `names` are those of base, top and the two radii.
    pub(super) fn new(
        base: DVec3,
        top: DVec3,
        base_radius: f64,
        top_radius: f64,
        names: [&'static str; 4],
    ) -> Result<Self, InvalidShape> {
        for (point, field) in [(base, names[0]), (top, names[1])] {
            if !point.is_finite() {
                return Err(InvalidShape::NotFinite { field });
            }
        }
        for (radius, field) in [(base_radius, names[2]), (top_radius, names[3])] {
            if !radius.is_finite() {
                return Err(InvalidShape::NotFinite { field });
            }
            if radius < 0.0 {
                return Err(InvalidShape::Negative { field, value: radius });
            }
        }
        if base_radius == 0.0 && top_radius == 0.0 {
            return Err(InvalidShape::NotPositive { field: names[2], value: base_radius });
        }
        if base == top {
            return Err(InvalidShape::Degenerate { field: names[1] });
        }
        Ok(Self { base, top, base_radius, top_radius })
    }

    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        frustum::intersect(ray, self.base, self.top, self.base_radius, self.top_radius, within)
    }

    pub(super) fn precise_lambda(&self, ray: &Ray, hit: &Hit) -> [f64; 2] {
        frustum::precise_lambda(ray, self.base, self.top, self.base_radius, self.top_radius, hit.lambda)
    }

    /// From base to top, as a vector and its factor: two where the difference overflows, else one. Subtracted before
    /// anything is scaled, or a short axis far out would vanish.
    fn axis(&self) -> (DVec3, f64) {
        let v = self.top - self.base;
        if v.is_finite() { (v, 1.0) } else { (0.5 * self.top - 0.5 * self.base, 2.0) }
    }

    /// From base to top, a unit vector.
    fn direction(&self) -> DVec3 {
        unit(self.axis().0).expect("two ends")
    }

    fn foot(&self, ray: &Ray, hit: &Hit) -> Foot {
        let extent = self.base.abs().max(self.top.abs()).max(ray.origin.abs()).max_element();
        let local = Local::new(extent.max(self.base_radius).max(self.top_radius));
        let (r0, r1) = (local.inside(self.base_radius), local.inside(self.top_radius));
        let (axis, times) = self.axis();
        let axis = local.vector(axis) * times;
        let axis = if axis.abs().max_element() < local.lost() { local.lost() * self.direction() } else { axis };
        let axis_length = length(axis);
        let foot = |lambda| {
            let from_base = local.offset(ray, lambda, self.base);
            let height = along(from_base, axis);
            let (end, x, at, r) = if height <= 0.5 {
                (self.base, from_base, height, r0)
            } else {
                let from_top = local.offset(ray, lambda, self.top);
                (self.top, from_top, along(from_top, axis), r1)
            };
            // Twice: what the first subtraction rounds along the axis, the second removes.
            let radial = x - at * axis;
            let radial = radial - along(radial, axis) * axis;
            let at = if height <= 0.5 { at.clamp(0.0, 1.0) } else { at.clamp(-1.0, 0.0) };
            let height = if height <= 0.5 { at } else { 1.0 + at };
            let (from_axis, outward, radius) = (length(radial), unit(radial), r + at * (r1 - r0));
            Foot { local, axis, axis_length, end, along: at, height, radial, from_axis, outward, radius }
        };
        let rough = foot([hit.lambda, 0.0]);
        let moved = local.inside(hit.error * length(ray.direction));
        if moved <= SHARP * rough.radius { rough } else { foot(self.precise_lambda(ray, hit)) }
    }

    pub(super) fn normal(&self, ray: &Ray, hit: &Hit) -> DVec3 {
        self.normal_at(&self.foot(ray, hit), ray, hit)
    }

    fn normal_at(&self, f: &Foot, ray: &Ray, hit: &Hit) -> DVec3 {
        let axis = self.direction();
        match hit.part {
            BASE => -axis,
            TOP => axis,
            _ => self.wall_normal(f, axis, ray),
        }
    }

    /// cos·radial − sin·axis, with tan = Δr/height. At an apex, where no radial direction is left, along the axis.
    fn wall_normal(&self, f: &Foot, axis: DVec3, ray: &Ray) -> DVec3 {
        let growth = f.local.inside(self.top_radius - self.base_radius);
        let Some(radial) = f.outward else {
            if growth != 0.0 {
                return -axis * growth.signum();
            }
            // A cylinder too thin to be told from its axis: against the ray.
            let across = ray.direction - along(ray.direction, f.axis) * f.axis;
            return unit(-across).unwrap_or_else(|| axis.any_orthonormal_vector());
        };
        unit(f.axis_length * radial - growth * axis).unwrap_or(radial)
    }

    pub(super) fn contact(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, Tangent) {
        let f = self.foot(ray, hit);
        (self.point_at(&f, hit), self.tangent_at(&f, ray, hit))
    }

    pub(super) fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.point_at(&self.foot(ray, hit), hit)
    }

    pub(super) fn tangent(&self, ray: &Ray, hit: &Hit) -> Tangent {
        self.tangent_at(&self.foot(ray, hit), ray, hit)
    }

    fn point_at(&self, f: &Foot, hit: &Hit) -> SurfacePoint {
        let (r0, r1) = (f.local.inside(self.base_radius), f.local.inside(self.top_radius));
        let outward = f.outward.unwrap_or(DVec3::ZERO);
        let clamped = |r: f64| if f.from_axis <= r { f.radial } else { r * outward };
        let (foot, radial) = match hit.part {
            BASE => (self.base, clamped(r0)),
            TOP => (self.top, clamped(r1)),
            _ => {
                let foot = f.end + f.local.vector_outside(f.along * f.axis);
                (foot, f.radius * outward)
            }
        };
        let radial = f.local.vector_outside(radial);
        let position = foot + radial;
        // docs/numerics.md §6: radial direction and its length, the foot, and the two sums.
        let rounding = 12.0 * U * self.base_radius.max(self.top_radius)
            + 6.0 * U * f.local.outside(f.axis_length)
            + 2.0 * length(U * foot)
            + 2.0 * length(U * position);
        SurfacePoint { position, error: rounding + f.local.outside(f.local.lost()) + f64::from_bits(16) }
    }

    /// The box around both caps' circles: a circle of radius r across unit axis a reaches r·√(1 − aᵢ²) along i.
    pub(super) fn bounds(&self) -> Aabb {
        let v = self.direction();
        // Half-widths of a unit circle, rounded up: v is off by less than 8u relatively, in every component that has
        // not vanished in scaling.
        let along = self.top.cmpne(self.base);
        let reach = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let up = v[j].hypot(v[k]) * (1.0 + 32.0 * U) + f64::MIN_POSITIVE;
            if along.test(j) || along.test(k) { up.min(1.0) } else { 0.0 }
        });
        let disc = |center: DVec3, r: f64| {
            let [x, y, z] = [0, 1, 2].map(|i| {
                let half = if reach[i] == 0.0 || r == 0.0 { 0.0 } else { (r * reach[i]).next_up().min(r) };
                around(center[i], half)
            });
            Aabb::new([x.0, y.0, z.0], [x.1, y.1, z.1])
        };
        disc(self.base, self.base_radius).union(disc(self.top, self.top_radius))
    }

    pub(super) fn texture_coordinates(&self, ray: &Ray, hit: &Hit) -> DVec2 {
        let f = self.foot(ray, hit);
        let (e1, e2) = self.direction().any_orthonormal_pair();
        let (x, y) = (f.radial.dot(e1), f.radial.dot(e2));
        let planar = |r: f64| {
            let r = f.local.inside(r);
            DVec2::new(0.5 + 0.5 * x / r, 0.5 + 0.5 * y / r).clamp(DVec2::ZERO, DVec2::ONE)
        };
        match hit.part {
            BASE => planar(self.base_radius),
            TOP => planar(self.top_radius),
            _ => {
                let angle = y.atan2(x) / TAU;
                DVec2::new(if angle < 0.0 { angle + 1.0 } else { angle }, f.height)
            }
        }
    }

    pub(super) fn departs(&self, ray: &Ray, outward: bool) -> bool {
        frustum::departs(ray, self.base, self.top, self.base_radius, self.top_radius, outward)
    }

    /// A cone's wall curves at most as its circle does (by the cosine less). The radial part of its normal is off by 8u
    /// of the distance from the nearer end; docs/numerics.md §6.
    fn tangent_at(&self, f: &Foot, ray: &Ray, hit: &Hit) -> Tangent {
        let normal = self.normal_at(f, ray, hit);
        if hit.part == BASE || hit.part == TOP {
            return Tangent { normal, normal_error: 16.0 * U, curvature: 0.0 };
        }
        // A part of the smallest subnormals has no digits.
        let rounding = 8.0 * U * (f.from_axis + length(f.along * f.axis)) + f64::from_bits(16);
        let curvature = 1.0 / f.local.outside(f.radius * (1.0 - 16.0 * U));
        Tangent { normal, normal_error: 16.0 * U + rounding / f.from_axis, curvature }
    }

    /// Half of ∇f for f(p) = |x|² − t²/h² − R(t)², with x = p − base, t = x·v, v = top − base, h² = |v|².
    pub(super) fn gradient(&self, point: DVec3) -> DVec3 {
        let (v, x) = (self.top - self.base, point - self.base);
        let height = along(x, v);
        let growth = self.top_radius - self.base_radius;
        x - height * v - (self.base_radius + height * growth) * growth / v.length_squared() * v
    }

    /// The wall's explicit form: angle in radians, height from 0 to 1.
    pub(super) fn patch(&self, angle: f64, height: f64) -> Patch {
        let v = self.top - self.base;
        let (e1, e2) = self.direction().any_orthonormal_pair();
        let (s, c) = angle.sin_cos();
        let (growth, outward) = (self.top_radius - self.base_radius, c * e1 + s * e2);
        let radius = self.base_radius + height * growth;
        Patch {
            point: self.base + height * v + radius * outward,
            around: radius * (c * e2 - s * e1),
            along: v + growth * outward,
        }
    }
}

/// x·axis/|axis|², whatever the axis's range.
fn along(x: DVec3, axis: DVec3) -> f64 {
    let local = Local::new(axis.abs().max_element());
    let axis = local.vector(axis);
    local.vector(x).dot(axis) / axis.length_squared()
}

/// Implements [`Shape`](crate::Shape) for a newtype around [`Frustum`].
macro_rules! shape_by_frustum {
    ($name:ident) => {
        impl crate::Shape for $name {
            #[inline]
            fn intersect(&self, ray: &crate::Ray, within: crate::Interval) -> Option<crate::Hit> {
                self.0.intersect(ray, within)
            }

            /// Accurate to a few ulps near the solid and to 2⁻⁴⁰ from any distance. By part on a rim; at an apex
            /// outward along the axis.
            fn normal(&self, ray: &crate::Ray, hit: &crate::Hit) -> glam::DVec3 {
                self.0.normal(ray, hit)
            }

            fn bounds(&self) -> crate::Aabb {
                self.0.bounds()
            }

            fn texture_coordinates(&self, ray: &crate::Ray, hit: &crate::Hit) -> glam::DVec2 {
                self.0.texture_coordinates(ray, hit)
            }

            fn point(&self, ray: &crate::Ray, hit: &crate::Hit) -> crate::SurfacePoint {
                self.0.point(ray, hit)
            }

            fn departs(&self, ray: &crate::Ray, _hit: &crate::Hit, outward: bool) -> bool {
                self.0.departs(ray, outward)
            }

            fn tangent(&self, ray: &crate::Ray, hit: &crate::Hit) -> crate::Tangent {
                self.0.tangent(ray, hit)
            }

            fn contact(&self, ray: &crate::Ray, hit: &crate::Hit) -> (crate::SurfacePoint, crate::Tangent) {
                self.0.contact(ray, hit)
            }

            fn precise_lambda(&self, ray: &crate::Ray, hit: &crate::Hit) -> [f64; 2] {
                self.0.precise_lambda(ray, hit)
            }
        }
    };
}
pub(super) use shape_by_frustum;
