//! What exact real arithmetic on the given floats answers.

use super::big::{Big, Big3, Real};
use super::cases::{Case, Solid};
use std::cmp::Ordering;
use truehit::glam::{DAffine3, DVec3};
use truehit::{Interval, Ray};

/// A ray in exact numbers.
#[derive(Clone, Debug)]
pub struct Line {
    pub o: Big3,
    pub d: Big3,
}

impl From<&Ray> for Line {
    fn from(ray: &Ray) -> Self {
        Self { o: ray.origin.into(), d: ray.direction.into() }
    }
}

impl Line {
    /// The line as seen through a world-to-object map, exactly.
    pub fn through(&self, map: &DAffine3) -> Self {
        let rows: Vec<Big3> = (0..3).map(|i| Big3::from(map.matrix3.row(i))).collect();
        let turn = |v: &Big3| Big3(std::array::from_fn(|i| rows[i].dot(v)));
        Self { o: turn(&self.o).plus(&map.translation.into()), d: turn(&self.d) }
    }
}

/// A hit, exactly.
#[derive(Clone, Debug)]
pub struct Truth {
    pub lambda: Real,
    /// The parts this point belongs to: several at a rim, where any of them may be named.
    pub parts: [u32; 4],
}

pub const WALL: u32 = 0;
pub const BASE: u32 = 1;
pub const TOP: u32 = 2;

/// The nearest hit of the case's shape within its interval.
pub fn truth(case: &Case) -> Option<Truth> {
    if !case.ray.is_valid() || case.within.is_empty() {
        return None;
    }
    solid(&case.solid, &Line::from(&case.ray), case.within)
}

pub fn solid(solid_: &Solid, line: &Line, within: Interval) -> Option<Truth> {
    let open = |lambda: Option<Real>| lambda.filter(|l| l.within(within)).map(|lambda| Truth { lambda, parts: [0; 4] });
    match solid_ {
        Solid::Plane { point, normal } => open(plane(line, &(*point).into(), &(*normal).into())),
        Solid::Triangle(v) => open(triangle(line, v)),
        Solid::Polygon(contours) => open(polygon(line, contours)),
        Solid::Sphere { center, radius } => {
            first(sphere(line, *center, *radius).map(|ends| ends.map(|lambda| Truth { lambda, parts: [0; 4] })), within)
        }
        Solid::Frustum { base, top, base_radius, top_radius } => {
            first(frustum(line, *base, *top, *base_radius, *top_radius), within)
        }
        Solid::Slab { min, max } => {
            let [enter, exit] = slab(line, *min, *max)?;
            // [enter, exit] and the open interval overlap: touching a limit is nothing.
            let some = exit.cmp_f64(within.min).is_gt() && enter.cmp_f64(within.max).is_lt();
            some.then_some(Truth { lambda: enter, parts: [0; 4] })
        }
        Solid::Mesh { positions, triangles } => mesh(line, positions, triangles, within),
        Solid::Affine { object_from_world, inner, .. } => {
            let line = line.through(object_from_world);
            if line.d.is_zero() { None } else { solid(inner, &line, within) }
        }
    }
}

fn first(ends: Option<[Truth; 2]>, within: Interval) -> Option<Truth> {
    ends?.into_iter().find(|t| t.lambda.within(within))
}

/// λ = n·(p − o)/n·d; a line in the plane or beside it misses.
pub fn plane(line: &Line, point: &Big3, normal: &Big3) -> Option<Real> {
    let d = normal.dot(&line.d);
    (!d.is_zero()).then(|| Real::Ratio(normal.dot(&point.minus(&line.o)), d))
}

/// Cramer's rule for o + λd = a + u·e₁ + v·e₂ in exact numbers; closed: u, v, 1 − u − v ≥ 0.
pub fn triangle(line: &Line, v: &[DVec3; 3]) -> Option<Real> {
    let [a, b, c] = v.map(Big3::from);
    let (e1, e2) = (b.minus(&a), c.minus(&a));
    let p = line.d.cross(&e2);
    let det = e1.dot(&p);
    if det.is_zero() {
        return None;
    }
    let t = line.o.minus(&a);
    let u = t.dot(&p);
    let opposite = |x: &Big| x.sign() == det.sign().reverse();
    if opposite(&u) {
        return None;
    }
    let q = t.cross(&e1);
    let v = line.d.dot(&q);
    if opposite(&v) || opposite(&(&det - &(&u + &v))) {
        return None;
    }
    Some(Real::Ratio(e2.dot(&q), det))
}

/// Even-odd over all contours as the line sees them, boundaries included; λ on the outer contour's Newell plane
/// through its first vertex. Seen along the line: everything is projected along d onto the coordinate plane of d's
/// largest component, exactly (scaled by that component).
pub fn polygon(line: &Line, contours: &[Vec<DVec3>]) -> Option<Real> {
    let outer: Vec<Big3> = contours.first()?.iter().map(|&v| v.into()).collect();
    let mut normal = Big3([Big::zero(), Big::zero(), Big::zero()]);
    for i in 1..outer.len().saturating_sub(1) {
        normal = normal.plus(&outer[i].minus(&outer[0]).cross(&outer[i + 1].minus(&outer[0])));
    }
    let lambda = plane(line, &outer[0], &normal)?;
    let z = (0..3).find(|&i| !line.d.0[i].is_zero())?;
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    let project = |v: DVec3| {
        let v = Big3::from(v).minus(&line.o);
        let along = |i: usize| &v.0[i] * &line.d.0[z] - &v.0[z] * &line.d.0[i];
        [along(x), along(y)]
    };
    let mut inside = false;
    for contour in contours {
        let flat: Vec<[Big; 2]> = contour.iter().map(|&v| project(v)).collect();
        for i in 0..flat.len() {
            let (a, b) = (&flat[i], &flat[(i + 1) % flat.len()]);
            let side = (&a[0] * &b[1] - &a[1] * &b[0]).sign();
            if side.is_eq() {
                // On the edge's line: on the edge if the origin is between its ends.
                let between = (&a[0] * &b[0] + &a[1] * &b[1]).sign();
                if between.is_le() {
                    return Some(lambda);
                }
            }
            let (below_a, below_b) = (a[1].sign().is_le(), b[1].sign().is_le());
            if below_a != below_b && (side.is_gt() == below_a) {
                inside = !inside;
            }
        }
    }
    inside.then_some(lambda)
}

/// The nearest triangle, the lowest index on exactly equal λ.
pub fn mesh(line: &Line, positions: &[DVec3], triangles: &[[u32; 3]], within: Interval) -> Option<Truth> {
    let mut best: Option<Truth> = None;
    for (index, t) in triangles.iter().enumerate() {
        let Some(lambda) = triangle(line, &t.map(|i| positions[i as usize])) else { continue };
        let Real::Ratio(n, d) = &lambda else { unreachable!() };
        let nearer = best.as_ref().is_none_or(|b| b.lambda.cmp_ratio(n, d).is_gt());
        if nearer && lambda.within(within) {
            best = Some(Truth { lambda, parts: [index as u32; 4] });
        }
    }
    best
}

pub fn sphere(line: &Line, center: DVec3, radius: f64) -> Option<[Real; 2]> {
    let f = line.o.minus(&center.into());
    let c = f.norm2() - Big::from(radius).squared();
    roots(&line.d.norm2(), &line.d.dot(&f), &c)
}

/// Both roots of aλ² + 2bλ + c, a > 0, in order.
fn roots(a: &Big, b: &Big, c: &Big) -> Option<[Real; 2]> {
    let disc = b.squared() - a * c;
    disc.sign().is_ge().then(|| {
        [false, true].map(|plus| Real::Root { a: a.clone(), b: b.clone(), c: c.clone(), disc: disc.clone(), plus })
    })
}

/// Where the line is inside: from a number (or −∞) to a number (or ∞).
struct Inside {
    enter: Option<Truth>,
    exit: Option<Truth>,
}

/// The closed solid: points p with t = (p − base)·a/a² in [0, 1], a = top − base, at most r₀ + (r₁ − r₀)t off the axis.
/// Cleared of fractions: 0 ≤ z ≤ a² and a²|q × a|² ≤ (r₀a² + kz)², q = p − base, z = q·a, k = r₁ − r₀.
pub fn frustum(line: &Line, base: DVec3, top: DVec3, r0: f64, r1: f64) -> Option<[Truth; 2]> {
    let axis = Big3::from(top).minus(&base.into());
    let q = line.o.minus(&base.into());
    let h2 = axis.norm2();
    let (oz, dz) = (q.dot(&axis), line.d.dot(&axis));
    let k = Big::from(r1) - Big::from(r0);
    let slab = if dz.is_zero() {
        if oz.sign().is_lt() || oz.cmp(&h2).is_gt() {
            return None;
        }
        Inside { enter: None, exit: None }
    } else {
        // A cap of radius zero is an apex, which is the wall's as well.
        let at = |z: Big, part: u32, r: f64| {
            let wall = if r == 0.0 { WALL } else { part };
            Truth { lambda: Real::Ratio(z - &oz, dz.clone()), parts: [part, wall, wall, wall] }
        };
        let ends = (at(Big::zero(), BASE, r0), at(h2.clone(), TOP, r1));
        let (enter, exit) = if dz.sign().is_gt() { ends } else { (ends.1, ends.0) };
        Inside { enter: Some(enter), exit: Some(exit) }
    };
    let (w, v) = (q.cross(&axis), line.d.cross(&axis));
    let (radius, growth) = (Big::from(r0) * &h2 + &k * &oz, &k * &dz);
    let a = &h2 * &v.norm2() - growth.squared();
    let b = &h2 * &v.dot(&w) - &growth * &radius;
    let c = &h2 * &w.norm2() - radius.squared();
    let wall = wall(a, b, c, &growth)?;
    let enter = tighter(slab.enter, wall.enter, Ordering::Greater)?;
    let exit = tighter(slab.exit, wall.exit, Ordering::Less)?;
    match compare(&enter.lambda, &exit.lambda) {
        Ordering::Less => Some([enter, exit]),
        Ordering::Equal => {
            let parts = [enter.parts[0], enter.parts[1], exit.parts[0], exit.parts[1]];
            Some([Truth { parts, ..enter }, Truth { parts, ..exit }])
        }
        Ordering::Greater => None,
    }
}

/// Where aλ² + 2bλ + c ≤ 0, on the nappe whose radius is not negative.
fn wall(a: Big, b: Big, c: Big, growth: &Big) -> Option<Inside> {
    let end = |lambda: Real| Some(Truth { lambda, parts: [WALL; 4] });
    match a.sign() {
        Ordering::Greater => {
            let [enter, exit] = roots(&a, &b, &c)?;
            Some(Inside { enter: end(enter), exit: end(exit) })
        }
        Ordering::Equal => {
            let root = |c: Big, b: &Big| Real::Ratio(-&c, b.doubled());
            match b.sign() {
                Ordering::Equal => c.sign().is_le().then_some(Inside { enter: None, exit: None }),
                Ordering::Greater => Some(Inside { enter: None, exit: end(root(c, &b)) }),
                Ordering::Less => Some(Inside { enter: end(root(c, &b)), exit: None }),
            }
        }
        Ordering::Less => {
            // Outside the roots, of which there always are two (the line crosses the apex's plane outside or at the
            // apex); the cone's own nappe is on the side to which the radius grows. With a < 0 the "plus" root is the
            // smaller one.
            let disc = b.squared() - &a * &c;
            assert!(disc.sign().is_ge(), "a line inside both nappes");
            let grows = growth.sign().is_gt();
            let root = Real::Root { a, b, c, disc, plus: !grows };
            Some(if grows { Inside { enter: end(root), exit: None } } else { Inside { enter: None, exit: end(root) } })
        }
    }
}

/// The end that cuts more: the greater of two entries, the smaller of two exits; both parts where they are equal.
fn tighter(slab: Option<Truth>, wall: Option<Truth>, wanted: Ordering) -> Option<Truth> {
    match (slab, wall) {
        (Some(s), Some(w)) => Some(match compare(&w.lambda, &s.lambda) {
            Ordering::Equal => Truth { lambda: s.lambda, parts: [s.parts[0], WALL, WALL, WALL] },
            o if o == wanted => w,
            _ => s,
        }),
        (one, other) => one.or(other),
    }
}

/// Two numbers of which one is a ratio, or which are the two roots of one quadratic with a > 0.
fn compare(x: &Real, y: &Real) -> Ordering {
    match (x, y) {
        (_, Real::Ratio(n, d)) => x.cmp_ratio(n, d),
        (Real::Ratio(n, d), _) => y.cmp_ratio(n, d).reverse(),
        (Real::Root { plus: p, disc, .. }, Real::Root { plus: q, .. }) => {
            if p == q || disc.is_zero() {
                Ordering::Equal
            } else {
                p.cmp(q)
            }
        }
    }
}

/// Where the line enters and leaves the closed box.
pub fn slab(line: &Line, min: DVec3, max: DVec3) -> Option<[Real; 2]> {
    let (lower, upper) = (Big3::from(min), Big3::from(max));
    let mut ends: Option<[Real; 2]> = None;
    for i in 0..3 {
        let (below, above) = (&lower.0[i] - &line.o.0[i], &upper.0[i] - &line.o.0[i]);
        if below.cmp(&above).is_gt() {
            return None;
        }
        let d = &line.d.0[i];
        if d.is_zero() {
            if below.sign().is_gt() || above.sign().is_lt() {
                return None;
            }
            continue;
        }
        let (near, far) = if d.sign().is_gt() { (below, above) } else { (above, below) };
        let (near, far) = (Real::Ratio(near, d.clone()), Real::Ratio(far, d.clone()));
        ends = Some(match ends {
            None => [near, far],
            Some([enter, exit]) => [
                if compare(&near, &enter).is_gt() { near } else { enter },
                if compare(&far, &exit).is_lt() { far } else { exit },
            ],
        });
    }
    ends.filter(|[enter, exit]| compare(enter, exit).is_le())
}

/// The innermost solid of a chain of maps, and the exact image of the case's line in its frame, with P for each
/// component of origin and direction: the sum of the absolute values that it is made of, as the maps multiply them.
pub fn innermost(case: &Case) -> (&Solid, Line, [DVec3; 2]) {
    let mut line = Line::from(&case.ray);
    let (mut o, mut d) = (case.ray.origin.abs(), case.ray.direction.abs());
    let mut solid = &case.solid;
    while let Solid::Affine { object_from_world: map, inner, .. } = solid {
        line = line.through(map);
        let m = map.matrix3;
        let grown = |v: DVec3| m.x_axis.abs() * v.x + m.y_axis.abs() * v.y + m.z_axis.abs() * v.z;
        (o, d) = (grown(o) + map.translation.abs(), grown(d));
        solid = inner;
    }
    (solid, line, [o, d])
}
