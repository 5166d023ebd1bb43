//! What follows a hit: its point, its normal, and the ray that leaves it.

use crate::block;
use crate::kernels::{Entry, Origin};
use crate::rows::Sheet;
use crate::support::big::{Big, Big3};
use crate::support::cases::{Case, Solid};
use crate::support::measure;
use crate::support::oracle::{self, Truth, WALL};
use crate::support::rng::Rng;
use crate::table;
use truehit::glam::{DAffine3, DVec3};
use truehit::{Hit, Interval, Ray, Shape, Surface};

/// How points, normals and the rays that leave them come out.
#[derive(Clone, Default)]
pub struct Aftermath {
    /// Distance of the point from the surface in ulps of the largest coordinate, ascending.
    pub points: Vec<f64>,
    /// Points farther off than their bound, where there is one.
    pub violations: usize,
    /// Angle to the exact normal, in units of 2⁻⁵³ rad, ascending.
    pub normals: Vec<f64>,
    pub spawned: usize,
    pub rehits: usize,
}

impl Aftermath {
    /// At those of the first `n` cases that exact arithmetic hits too, in a part of the surface that it agrees to.
    pub fn of(entry: &Entry, sheet: &Sheet, n: usize) -> Self {
        let mut out = Self::default();
        for (i, (case, truth)) in sheet.cases.iter().zip(&sheet.truths).enumerate().take(n) {
            let (Some(truth), Some(exact)) = (truth, &sheet.exact[i]) else { continue };
            out.add(entry, case, truth, &exact.lo, i as u64);
        }
        out.points.sort_by(f64::total_cmp);
        out.normals.sort_by(f64::total_cmp);
        out
    }

    pub fn merge(&mut self, other: &Self) {
        self.points.extend(&other.points);
        self.normals.extend(&other.normals);
        self.points.sort_by(f64::total_cmp);
        self.normals.sort_by(f64::total_cmp);
        self.violations += other.violations;
        self.spawned += other.spawned;
        self.rehits += other.rehits;
    }

    fn add(&mut self, entry: &Entry, case: &Case, truth: &Truth, lambda: &Big, seed: u64) {
        let shipped = entry.origin == Origin::Shipped;
        let size = largest(&case.solid).max(case.ray.origin.abs().max_element());
        // Figures in floats: the ends of their range are left to λ.
        let tame = |x: f64| x == 0.0 || (1e-60..1e60).contains(&x.abs());
        let d = case.ray.direction;
        if !(tame(size) && tame(d.abs().max_element()) && tame(smallest(&case.solid))) {
            return;
        }
        let Some(shape) = table::make_shape(&case.solid) else { return };
        let Some(hit) = (if shipped { shape.intersect(&case.ray, case.within) } else { entry.answer(case).flatten() })
        else {
            return;
        };
        let boxed = matches!(case.solid, Solid::Slab { .. });
        if !(boxed || truth.parts.contains(&hit.part)) || !hit.lambda.is_finite() {
            return;
        }
        // Where a ray enters a box; not one that starts inside, which is told where that would have been.
        let min = case.within.min;
        if boxed && min.is_finite() && lambda.cmp(&Big::from(min)).is_le() {
            return;
        }
        let exact_point = Big3(std::array::from_fn(|k| {
            &Big::from(case.ray.origin[k]) + &(lambda * &Big::from(case.ray.direction[k]))
        }));
        let (point, bound, normal) = if shipped {
            let p = shape.point(&case.ray, &hit);
            (p.position, p.error, shape.normal(&case.ray, &hit))
        } else {
            let p = textbook_point(entry.origin, &case.ray, &hit);
            let normal = match &case.solid {
                _ if !p.is_finite() => None,
                Solid::Slab { min, max } => Some(block::normal_at(*min, *max, &p.into(), -case.ray.direction)),
                solid => normal_at(solid, &p.into(), hit.part),
            };
            (p, f64::INFINITY, normal.unwrap_or(DVec3::NAN))
        };
        let exact_normal = match &case.solid {
            // At an edge any of its faces.
            Solid::Slab { min, max } => block::normal_at(*min, *max, &exact_point, normal),
            solid => {
                let Some(normal) = normal_at(solid, &exact_point, hit.part) else { return };
                normal
            }
        };
        if !point.is_finite() || near_apex(&case.solid, &exact_point, hit.part) {
            return;
        }
        let off = distance(&case.solid, &point.into(), hit.part);
        // A point's own size: a hit near the origin from far away is judged by where it is.
        self.points.push(off / measure::ulp(point.abs().max_element().max(largest(&case.solid))));
        self.violations += usize::from(off > bound * (1.0 + 1e-12));
        let turned = (normal - exact_normal).length() / 2f64.powi(-53);
        self.normals.push(if turned.is_nan() { f64::INFINITY } else { turned });

        let mut rng = Rng::new(seed);
        let away = exact_normal * rng.log(1e-3, 1.0) + rng.across(exact_normal);
        self.spawned += 1;
        self.rehits += usize::from(if shipped {
            let ray = Surface::new(shape.as_ref(), &case.ray, &hit).spawn(away);
            shape.intersect(&ray, Interval::FORWARD).is_some_and(|again| is_rehit(&case.solid, &hit, &again))
        } else {
            let again = Case { ray: Ray { origin: point, direction: away }, within: Interval::FORWARD, ..case.clone() };
            entry.answer(&again).flatten().is_some_and(|again| is_rehit(&case.solid, &hit, &again))
        });
    }
}

/// o + λd in the kernel's own precision.
fn textbook_point(origin: Origin, ray: &Ray, hit: &Hit) -> DVec3 {
    if origin == Origin::TextbookF32 {
        return (ray.origin.as_vec3() + ray.direction.as_vec3() * hit.lambda as f32).as_dvec3();
    }
    ray.at(hit.lambda)
}

/// Other triangles of a mesh may well be met; no other shape of these by a ray that leaves it.
fn is_rehit(solid: &Solid, hit: &Hit, again: &Hit) -> bool {
    match solid {
        Solid::Mesh { .. } => hit.part == again.part,
        Solid::Affine { inner, .. } => is_rehit(inner, hit, again),
        _ => true,
    }
}

fn largest(solid: &Solid) -> f64 {
    let of = |points: &[DVec3]| points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    match solid {
        Solid::Plane { point, .. } => of(&[*point]),
        Solid::Triangle(v) => of(v),
        Solid::Sphere { center, radius } => of(&[*center]).max(*radius),
        Solid::Frustum { base, top, base_radius, top_radius } => of(&[*base, *top]).max(*base_radius).max(*top_radius),
        Solid::Polygon(contours) => contours.iter().map(|c| of(c)).fold(0.0, f64::max),
        Solid::Mesh { positions, .. } => of(positions),
        // Where the object's points come to lie in the world.
        Solid::Affine { world_from_object, inner, .. } => {
            let m = world_from_object.matrix3;
            let grown = [m.x_axis, m.y_axis, m.z_axis].map(|c| of(&[c])).iter().sum::<f64>();
            of(&[world_from_object.translation]) + largest(inner) * grown
        }
        Solid::Slab { min, max } => of(&[*min, *max]),
    }
}

fn smallest(solid: &Solid) -> f64 {
    match solid {
        Solid::Plane { normal, .. } => normal.abs().max_element(),
        Solid::Sphere { radius, .. } => *radius,
        Solid::Frustum { base, top, base_radius, top_radius } => {
            base_radius.max(*top_radius).min((*top - *base).abs().max_element())
        }
        Solid::Affine { object_from_world, inner, .. } => {
            smallest(inner).min(object_from_world.matrix3.x_axis.length())
        }
        _ => 1.0,
    }
}

fn to_f64(v: &Big3) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| v.0[i].to_f64()))
}

/// w = p − base, a = top − base, w·a and a² exactly.
fn along(base: DVec3, top: DVec3, p: &Big3) -> (Big3, Big3, Big, Big) {
    let a = Big3::from(top).minus(&base.into());
    let w = p.minus(&base.into());
    let (wa, aa) = (w.dot(&a), a.dot(&a));
    (w, a, wa, aa)
}

/// The image of a point, exactly.
fn image(map: &DAffine3, p: &Big3) -> Big3 {
    let m = map.matrix3;
    let rows = [m.row(0), m.row(1), m.row(2)].map(Big3::from);
    Big3(std::array::from_fn(|i| rows[i].dot(p))).plus(&map.translation.into())
}

/// The way a normal lies in the world: the linear part's transpose of it, exactly.
fn transposed(map: &DAffine3, n: &Big3) -> Big3 {
    let m = map.matrix3;
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(Big3::from);
    Big3(std::array::from_fn(|i| columns[i].dot(n)))
}

/// The triangle that a mesh's part is.
fn facet(positions: &[DVec3], triangles: &[[u32; 3]], part: u32) -> Solid {
    Solid::Triangle(triangles[part as usize].map(|i| positions[i as usize]))
}

/// Newell's normal of the outer contour, exactly.
fn newell(contours: &[Vec<DVec3>]) -> Big3 {
    let outer: Vec<Big3> = contours[0].iter().map(|&v| v.into()).collect();
    let edges = (1..outer.len() - 1).map(|i| outer[i].minus(&outer[0]).cross(&outer[i + 1].minus(&outer[0])));
    edges.reduce(|sum, n| sum.plus(&n)).expect("three vertices")
}

/// Along the outward normal at a point of the surface, all of it exact.
fn direction_at(solid: &Solid, p: &Big3, part: u32) -> Option<Big3> {
    Some(match solid {
        Solid::Plane { normal, .. } => (*normal).into(),
        Solid::Triangle([a, b, c]) => {
            let a = Big3::from(*a);
            Big3::from(*b).minus(&a).cross(&Big3::from(*c).minus(&a))
        }
        Solid::Polygon(contours) => newell(contours),
        Solid::Sphere { center, .. } => p.minus(&(*center).into()),
        Solid::Frustum { base, top, base_radius, top_radius } => {
            let (w, a, wa, aa) = along(*base, *top, p);
            let scaled = |v: &Big3, s: &Big| Big3(std::array::from_fn(|i| &v.0[i] * s));
            match part {
                WALL => {
                    // On the wall w·a² − a·(w·a) is as long as a²·r, r = r₀ + (r₁ − r₀)·w·a/a².
                    let growth = &Big::from(*top_radius) - &Big::from(*base_radius);
                    let radius = &(&Big::from(*base_radius) * &aa) + &(&growth * &wa);
                    let radial = scaled(&w, &aa).minus(&scaled(&a, &wa));
                    scaled(&radial, &aa).minus(&scaled(&a, &(&growth * &radius)))
                }
                oracle::BASE => Big3::from(DVec3::ZERO).minus(&a),
                _ => a,
            }
        }
        Solid::Mesh { positions, triangles } => direction_at(&facet(positions, triangles, part), p, part)?,
        Solid::Affine { object_from_world: map, inner, .. } => {
            transposed(map, &direction_at(inner, &image(map, p), part)?)
        }
        Solid::Slab { .. } => return None,
    })
}

/// The outward unit normal at a point, from differences and products that are exact; `None` at an apex.
pub fn normal_at(solid: &Solid, p: &Big3, part: u32) -> Option<DVec3> {
    let unit = |v: &Big3| to_f64(v).try_normalize();
    match solid {
        Solid::Frustum { base, top, base_radius, top_radius } => {
            let (w, a, wa, aa) = along(*base, *top, p);
            let axis = to_f64(&a);
            match part {
                WALL => {
                    // w·a² − a·(w·a) points straight away from the axis.
                    let radial = Big3(std::array::from_fn(|i| &(&w.0[i] * &aa) - &(&a.0[i] * &wa)));
                    let radial = unit(&radial)?;
                    (radial + axis * ((base_radius - top_radius) / aa.to_f64())).try_normalize()
                }
                oracle::BASE => (-axis).try_normalize(),
                _ => axis.try_normalize(),
            }
        }
        _ => direction_at(solid, p, part)?.direction(),
    }
}

/// Where a wall's radius is next to nothing, and with it the direction its normal has.
fn near_apex(solid: &Solid, p: &Big3, part: u32) -> bool {
    if let Solid::Affine { object_from_world, inner, .. } = solid {
        return near_apex(inner, &image(object_from_world, p), part);
    }
    let Solid::Frustum { base, top, base_radius, top_radius } = solid else { return false };
    let (_, _, wa, aa) = along(*base, *top, p);
    let radius = base_radius + (top_radius - base_radius) * (wa.to_f64() / aa.to_f64());
    part == WALL && radius.abs() < 1e-9 * base_radius.max(*top_radius)
}

/// How far `p` is off the surface of its part, from numerators that are exact; under a map to first order.
fn distance(solid: &Solid, p: &Big3, part: u32) -> f64 {
    match solid {
        Solid::Plane { point, normal } => {
            let n = Big3::from(*normal);
            (n.dot(&p.minus(&(*point).into())).to_f64() / normal.length()).abs()
        }
        Solid::Triangle([a, b, c]) => {
            let a = Big3::from(*a);
            let n = Big3::from(*b).minus(&a).cross(&Big3::from(*c).minus(&a));
            (n.dot(&p.minus(&a)).to_f64() / to_f64(&n).length()).abs()
        }
        Solid::Sphere { center, radius } => {
            let f = p.minus(&(*center).into());
            let off = f.norm2() - Big::from(*radius).squared();
            (off.to_f64() / (to_f64(&f).length() + radius)).abs()
        }
        Solid::Frustum { base, top, base_radius, top_radius } => {
            let (w, a, wa, aa) = along(*base, *top, p);
            let height = to_f64(&a).length();
            if part == oracle::BASE {
                return (wa.to_f64() / height).abs();
            }
            if part == oracle::TOP {
                return ((&wa - &aa).to_f64() / height).abs();
            }
            // a⁴(ρ² − r(t)²), r(t) = r₀ + (r₁ − r₀)·w·a/a².
            let growth = &Big::from(*top_radius) - &Big::from(*base_radius);
            let radius = &(&Big::from(*base_radius) * &aa) + &(&growth * &wa);
            let rho2 = &(&w.norm2() * &aa) - &wa.squared();
            let off = &(&rho2 * &aa) - &radius.squared();
            let a2 = aa.to_f64();
            let sum = (rho2.to_f64().max(0.0) / a2).sqrt() + (radius.to_f64() / a2).abs();
            let cosine = height / height.hypot(growth.to_f64());
            if sum == 0.0 { 0.0 } else { (off.to_f64() / (a2 * a2) / sum * cosine).abs() }
        }
        Solid::Polygon(contours) => {
            let n = newell(contours);
            (n.dot(&p.minus(&contours[0][0].into())).to_f64() / to_f64(&n).length()).abs()
        }
        Solid::Mesh { positions, triangles } => distance(&facet(positions, triangles, part), p, part),
        Solid::Affine { object_from_world: map, inner, .. } => {
            let q = image(map, p);
            let Some(n) = direction_at(inner, &q, part) else { return f64::NAN };
            // A unit along the world's normal is so many along the object's.
            let stretch = to_f64(&transposed(map, &n)).length() / to_f64(&n).length();
            distance(inner, &q, part) / stretch
        }
        Solid::Slab { min, max } => block::distance(*min, *max, p),
    }
}

/// A textbook hit's normal, for pictures.
pub fn textbook_normal(solid: &Solid, ray: &Ray, hit: &Hit) -> DVec3 {
    normal_at(solid, &ray.at(hit.lambda).into(), hit.part).unwrap_or(DVec3::ZERO)
}
