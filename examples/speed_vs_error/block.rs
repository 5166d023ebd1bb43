//! A box with a surface: what a user of the crate makes of its box kernel, to be measured beside the shapes.

use crate::support::big::{Big, Big3};
use truehit::glam::{DVec2, DVec3};
use truehit::kernel::dyadic::Dyadic;
use truehit::kernel::number::Number;
use truehit::kernel::ratio::Ratio;
use truehit::kernel::{eft, slab};
use truehit::{Aabb, Hit, Interval, Ray, Shape, SurfacePoint};

/// The closed box as a solid. `Hit::part` is a face: twice its axis, and one more if it is the upper one.
#[derive(Debug)]
pub struct Block {
    pub min: DVec3,
    pub max: DVec3,
}

/// (axis, where the face lies, its outward normal) of a face.
fn face(min: DVec3, max: DVec3, part: usize) -> (usize, f64, DVec3) {
    let axis = part / 2;
    let unit = DVec3::AXES[axis];
    if part.is_multiple_of(2) { (axis, min[axis], -unit) } else { (axis, max[axis], unit) }
}

impl Shape for Block {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        let (enter, exit) = slab::intersect(ray, self.min, self.max, within)?;
        // Of the faces that the line crosses inwards the last, of those outwards the first: exactly, or next to an edge
        // the wrong one's normal would be given, and at a limit the wrong end.
        let crossing = |&part: &usize| {
            let (axis, place, _) = face(self.min, self.max, part);
            Ratio { numerator: Dyadic::difference(place, ray.origin[axis]), denominator: ray.direction[axis].into() }
        };
        let order = |p: &usize, q: &usize| crossing(p).compare_exactly(&crossing(q));
        let towards = |part: usize| face(self.min, self.max, part).2.dot(ray.direction);
        let inside = |part: &usize| crossing(part).is_inside(within) == Some(true);
        let entered = (0..6).filter(|&part| towards(part) < 0.0).max_by(order).filter(inside);
        let left = || (0..6).filter(|&part| towards(part) > 0.0).min_by(order).filter(inside);
        let (part, lambda) = entered.map(|part| (part, enter)).or_else(|| left().map(|part| (part, exit)))?;
        // A crossing is within four units in the last place.
        Some(Hit { lambda, error: 4.0 * f64::EPSILON * lambda.abs(), uv: DVec2::ZERO, part: part as u32 })
    }

    fn normal(&self, _: &Ray, hit: &Hit) -> DVec3 {
        face(self.min, self.max, hit.part as usize).2
    }

    fn bounds(&self) -> Aabb {
        Aabb::new(self.min, self.max)
    }

    /// On its face, exactly.
    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let (axis, place, _) = face(self.min, self.max, hit.part as usize);
        let mut position = eft::step(ray.origin, hit.lambda, ray.direction).clamp(self.min, self.max);
        position[axis] = place;
        SurfacePoint { position, error: 0.0 }
    }

    fn departs(&self, ray: &Ray, hit: &Hit, outward: bool) -> bool {
        let (axis, place, normal) = face(self.min, self.max, hit.part as usize);
        let outside = (ray.origin[axis] - place) * normal[axis] > 0.0;
        if outward { outside && self.intersect(ray, Interval::FORWARD).is_none() } else { !outside }
    }
}

/// The outward normal of the face nearest to a point; of several, the one nearest to `like`.
pub fn normal_at(min: DVec3, max: DVec3, p: &Big3, like: DVec3) -> DVec3 {
    let off = |part: usize| {
        let (axis, place, _) = face(min, max, part);
        (&p.0[axis] - &Big::from(place)).to_f64().abs()
    };
    let least = (0..6).map(off).fold(f64::INFINITY, f64::min);
    // The exact point is known to far more digits than this.
    let close = least + 1e-30 * min.abs().max(max.abs()).max_element();
    let normals = (0..6).filter(|&part| off(part) <= close).map(|part| face(min, max, part).2);
    normals.max_by(|a, b| a.dot(like).total_cmp(&b.dot(like))).unwrap_or(DVec3::NAN)
}

/// How far a point is off the surface, from differences that are exact.
pub fn distance(min: DVec3, max: DVec3, p: &Big3) -> f64 {
    let mut outside = DVec3::ZERO;
    let mut inside = f64::INFINITY;
    for axis in 0..3 {
        let (below, above) =
            ((&Big::from(min[axis]) - &p.0[axis]).to_f64(), (&p.0[axis] - &Big::from(max[axis])).to_f64());
        outside[axis] = below.max(above).max(0.0);
        inside = inside.min(-below.max(above));
    }
    if outside == DVec3::ZERO { inside.abs() } else { outside.length() }
}
