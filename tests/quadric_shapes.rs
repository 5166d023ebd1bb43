//! Sphere, cylinder, cone as shapes: normals, points, boxes, sides, and what their constructors refuse.

#[path = "support/mod.rs"]
mod support;

use support::big::{Big, Big3};
use support::cases::{Case, Kernel, Solid};
use support::families;
use support::oracle::{Line, truth};
use support::rng::Rng;
use support::shapes::shape;
use truehit::glam::{DVec2, DVec3};
use truehit::kernel::frustum::{BASE, TOP, WALL};
use truehit::{
    Cone, Cylinder, Interval, InvalidShape, Patch, Ray, Scene, Shape, Sphere, Surface, SurfacePoint, Tangent,
};

fn any_shape(rng: &mut Rng) -> Box<dyn Shape> {
    let (p, axis) = (rng.in_cube(5.0), rng.unit() * rng.log(0.1, 10.0));
    let (r, q) = (rng.log(0.1, 10.0), rng.log(0.1, 10.0));
    match rng.below(4) {
        0 => Box::new(Sphere::new(p, r).unwrap()),
        1 => Box::new(Cylinder::new(p, p + axis, r).unwrap()),
        2 => Box::new(Cone::new(p, p + axis, r).unwrap()),
        _ => Box::new(Cone::truncated(p, p + axis, r, q).unwrap()),
    }
}

/// A ray at the middle of the shape's box, from `distance` of its sizes away, not quite.
fn ray_at(rng: &mut Rng, shape: &dyn Shape, distance: f64) -> Ray {
    let b = shape.bounds();
    let target = b.center() + 0.4 * rng.in_cube(1.0) * b.size();
    let u = rng.unit();
    Ray::new(target - u * distance * b.size().max_element(), u * rng.length())
}

/// Lecture, "Normals": the gradient of the implicit form and the cross product of the explicit one's tangents agree.
#[test]
fn normal_is_gradient_is_cross_product() {
    let mut rng = Rng::new(1);
    let agree = |patch: Patch, gradient: DVec3| {
        let (n, g) = (patch.normal().normalize(), gradient.normalize());
        assert!((n - g).length() < 1e-11, "{patch:?} {gradient}");
    };
    let mut normals = 0;
    for _ in 0..3000 {
        let (p, axis) = (rng.in_cube(5.0), rng.unit() * rng.log(0.1, 10.0));
        let (r, q) = (rng.log(0.1, 10.0), rng.log(0.1, 10.0));
        let (angle, s) = (rng.uniform(-3.0, 3.0), rng.uniform(0.05, 0.9));
        let sphere = Sphere::new(p, r).unwrap();
        let cylinder = Cylinder::new(p, p + axis, r).unwrap();
        let cone = Cone::new(p, p + axis, r).unwrap();
        let truncated = Cone::truncated(p, p + axis, r, q).unwrap();
        let cases: [(&dyn Shape, Patch, DVec3); 4] = {
            let patches = [
                sphere.patch(angle, 1.4 * (2.0 * s - 1.0)),
                cylinder.patch(angle, s),
                cone.patch(angle, s),
                truncated.patch(angle, s),
            ];
            [
                (&sphere, patches[0], sphere.gradient(patches[0].point)),
                (&cylinder, patches[1], cylinder.gradient(patches[1].point)),
                (&cone, patches[2], cone.gradient(patches[2].point)),
                (&truncated, patches[3], truncated.gradient(patches[3].point)),
            ]
        };
        for (shape, patch, gradient) in cases {
            agree(patch, gradient);
            // The shape's own normal where a ray along it meets the patch.
            let n = gradient.normalize();
            let ray = Ray::new(patch.point + n * r, -n * rng.length());
            let hit = shape.intersect(&ray, Interval::FORWARD).expect("the patch is there");
            assert_eq!(hit.part, WALL);
            assert!((shape.normal(&ray, &hit) - n).length() < 1e-9, "{shape:?} {ray:?}");
            normals += 1;
        }
    }
    println!("{normals} normals");
}

#[test]
fn hits_lie_in_the_box_points_on_the_surface_normals_outward() {
    let mut rng = Rng::new(2);
    let mut hits = 0;
    for distance in [0.0, 2.0, 1e3, 1e6, 1e9] {
        for _ in 0..3000 {
            let shape = any_shape(&mut rng);
            let ray = ray_at(&mut rng, &*shape, distance);
            let Some(hit) = shape.intersect(&ray, Interval::FORWARD) else { continue };
            hits += 1;
            let (point, normal) = (shape.point(&ray, &hit), shape.normal(&ray, &hit));
            assert!((normal.length() - 1.0).abs() < 4.0 * f64::EPSILON);
            // Entered against the normal, left along it.
            let along = normal.dot(ray.direction.normalize());
            assert!(if distance > 0.5 { along < 1e-6 } else { true }, "{shape:?} {ray:?} {along}");
            let b = shape.bounds();
            let slack = DVec3::splat(point.error);
            assert!((b.min - slack).cmple(point.position).all() && point.position.cmple(b.max + slack).all());
            let scale = b.min.abs().max(b.max.abs()).max_element();
            assert!(point.error < 40.0 * f64::EPSILON * scale, "{} at {scale}", point.error);
            // Within the bound of the surface: bound's width outward it is outside, inward inside.
            let step = 1.01 * point.error * normal;
            let (out, back) = (Ray::new(point.position + step, normal), Ray::new(point.position - step, -normal));
            let smooth = hit.part == WALL;
            assert!(!smooth || shape.departs(&out, &hit, true), "{shape:?} {ray:?}");
            assert!(!smooth || shape.departs(&back, &hit, false), "{shape:?} {ray:?}");
            let uv = shape.texture_coordinates(&ray, &hit);
            assert!(uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all());
            assert!(shape.tangent(&ray, &hit).curvature >= 0.0);
            assert!(shape.occludes(&ray, Interval::FORWARD));
        }
    }
    println!("{hits} hits");
    assert!(hits > 8000);
}

#[test]
fn spawned_rays_never_meet_what_they_left() {
    let mut rng = Rng::new(3);
    let mut spawned = [0; 2];
    for _ in 0..20_000 {
        let shape = any_shape(&mut rng);
        let ray = ray_at(&mut rng, &*shape, 2.0);
        let Some(hit) = shape.intersect(&ray, Interval::FORWARD) else { continue };
        let surface = Surface::new(&*shape, &ray, &hit);
        let direction = rng.unit();
        let outward = direction.dot(surface.normal()) > 1e-6;
        let inward = direction.dot(surface.normal()) < -1e-6;
        let away = surface.spawn(direction);
        let again = shape.intersect(&away, Interval::FORWARD);
        if outward {
            spawned[0] += 1;
            assert!(again.is_none(), "{shape:?} {ray:?} {direction}");
        } else if inward {
            spawned[1] += 1;
            // A refracted ray meets the far side, once.
            assert!(again.is_some(), "{shape:?} {ray:?} {direction}");
        }
    }
    println!("{spawned:?} outward and inward");
    assert!(spawned[0] > 4000 && spawned[1] > 4000);
}

#[test]
fn boxes_are_tight() {
    let b = Cylinder::new([1.0, 2.0, 3.0], [1.0, 2.0, 5.0], 0.5).unwrap().bounds();
    assert_eq!((b.min, b.max), (DVec3::new(0.5, 1.5, 3.0), DVec3::new(1.5, 2.5, 5.0)));
    let b = Cone::new([0.0; 3], [4.0, 0.0, 0.0], 1.0).unwrap().bounds();
    assert_eq!((b.min, b.max), (DVec3::new(0.0, -1.0, -1.0), DVec3::new(4.0, 1.0, 1.0)));
    let b = Sphere::new([1.0, 0.0, -1.0], 2.0).unwrap().bounds();
    assert_eq!((b.min, b.max), (DVec3::new(-1.0, -2.0, -3.0), DVec3::new(3.0, 2.0, 1.0)));
    // Against many points of the surface: held, and reached.
    let mut rng = Rng::new(4);
    for _ in 0..300 {
        let (p, axis, r, q) =
            (rng.in_cube(5.0), rng.unit() * rng.log(0.1, 10.0), rng.log(0.1, 10.0), rng.log(0.1, 10.0));
        let cone = Cone::truncated(p, p + axis, r, q).unwrap();
        let b = cone.bounds();
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for i in 0..2000 {
            for s in [0.0, 1.0] {
                let point = cone.patch(f64::from(i) * std::f64::consts::TAU / 2000.0, s).point;
                (min, max) = (min.min(point), max.max(point));
            }
        }
        let size = b.size().max_element();
        assert!(
            (b.min - min).max_element() < 1e-14 * (size + 10.0) && (max - b.max).max_element() < 1e-14 * (size + 10.0)
        );
        assert!((min - b.min).max_element() < 1e-5 * size && (b.max - max).max_element() < 1e-5 * size);
    }
}

/// Solids that are no thicker than a rounding of where they lie: their ends cannot be scaled to a difference.
#[test]
fn wafers_far_out_keep_their_direction() {
    let mut hits = 0;
    for (far, thin) in
        [(1e200, 1e-200), (1e200, 1e-320), (1e100, 1e-150), (1e308, 1e-10), (1.0, 1e-300), (1e-100, 5e-324)]
    {
        for flip in [1.0, -1.0] {
            let (base, top) = (DVec3::new(far, 0.0, 0.0), DVec3::new(far, flip * thin, 0.0));
            let r = 0.5 * far;
            let shapes: [Box<dyn Shape>; 3] = [
                Box::new(Cylinder::new(base, top, r).unwrap()),
                Box::new(Cone::new(base, top, r).unwrap()),
                Box::new(Cone::truncated(base, top, r, 0.9 * r).unwrap()),
            ];
            for shape in shapes {
                let ray = Ray::new([far, -flip * far, 0.2 * far], [0.0, flip * far, 0.0]);
                let b = shape.bounds();
                assert_eq!((b.min, b.max), (DVec3::new(0.5 * far, b.min.y, -r), DVec3::new(1.5 * far, b.max.y, r)));
                let hit = shape.intersect(&ray, Interval::FORWARD).unwrap();
                let (SurfacePoint { position, error }, normal) = (shape.point(&ray, &hit), shape.normal(&ray, &hit));
                assert!(error < 1e-14 * far, "{error}");
                assert!(((position - DVec3::new(far, 0.0, 0.2 * far)) / far).length() < 1e-15, "{position}");
                assert_eq!(normal, DVec3::new(0.0, -flip, 0.0));
                let uv = shape.texture_coordinates(&ray, &hit);
                assert!(uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all());
                let mut builder = Scene::builder();
                builder.push(shape, ());
                assert_eq!(builder.build().intersect(&ray, Interval::FORWARD).map(|h| h.hit), Some(hit));
                hits += 1;
            }
        }
    }
    println!("{hits} hits");
    assert_eq!(hits, 36);
}

/// Small solids seen from where they are nearly a point.
#[test]
fn needles_and_wafers_of_any_size_have_points_in_their_boxes() {
    let mut rng = Rng::new(12);
    let mut hits = 0;
    for e in [-900, -600, -402, -398, -100, 0, 300] {
        for _ in 0..2_000 {
            let s = truehit::kernel::float::ldexp(1.0, e);
            let (base, axis) = (s * rng.in_cube(5.0), s * rng.unit() * rng.log(1e-7, 1e7));
            let (r, q) = (s * rng.log(1e-7, 1e7), s * rng.log(1e-7, 1e7));
            let shape = Cone::truncated(base, base + axis, r, q).unwrap();
            let b = shape.bounds();
            let target = b.center() + 0.4 * rng.in_cube(1.0) * b.size();
            let origin = [target + 2.0 * b.size().max_element() * rng.unit(), rng.unit()][rng.below(2) as usize];
            let ray = Ray::new(origin, target - origin);
            let Some(hit) = shape.intersect(&ray, Interval::FORWARD) else { continue };
            hits += 1;
            let (point, normal) = (shape.point(&ray, &hit), shape.normal(&ray, &hit));
            let slack = DVec3::splat(point.error);
            assert!((b.min - slack).cmple(point.position).all(), "{shape:?} {ray:?} {hit:?} {point:?}");
            assert!(point.position.cmple(b.max + slack).all(), "{shape:?} {ray:?} {hit:?} {point:?}");
            assert!(point.error < 1e-14 * b.min.abs().max(b.max.abs()).max_element(), "{shape:?} {ray:?} {point:?}");
            assert!((normal.length() - 1.0).abs() < 1e-15);
        }
    }
    println!("{hits} hits");
    assert!(hits > 4_000);
}

#[test]
fn thin_walls_keep_their_height() {
    let can = Cylinder::new([0.0; 3], [0.0, 0.0, 1e-200], 1e100).unwrap();
    let ray = Ray::new([2e100, 0.0, 2.5e-201], [-1.0, 0.0, 0.0]);
    let hit = can.intersect(&ray, Interval::FORWARD).unwrap();
    assert!(hit.part == WALL && (can.texture_coordinates(&ray, &hit).y - 0.25).abs() < 1e-15);
}

#[test]
fn parts_normals_and_texture_of_a_can_and_a_hat() {
    let can = Cylinder::new([0.0; 3], [0.0, 0.0, 2.0], 1.0).unwrap();
    let at = |o: [f64; 3], d: [f64; 3]| {
        let ray = Ray::new(o, d);
        let hit = can.intersect(&ray, Interval::FORWARD).unwrap();
        (hit.part, can.normal(&ray, &hit), can.texture_coordinates(&ray, &hit))
    };
    assert_eq!(at([0.0, 0.0, 5.0], [0.0, 0.0, -1.0]), (TOP, DVec3::Z, DVec2::splat(0.5)));
    assert_eq!(at([0.5, 0.0, -5.0], [0.0, 0.0, 1.0]), (BASE, DVec3::NEG_Z, DVec2::new(0.75, 0.5)));
    assert_eq!(at([0.0, 3.0, 0.5], [0.0, -1.0, 0.0]), (WALL, DVec3::Y, DVec2::new(0.25, 0.25)));
    let hat = Cone::new([0.0; 3], [0.0, 0.0, 2.0], 1.0).unwrap();
    // At the apex: along the axis, never NaN.
    for d in [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 0.0]] {
        let ray = Ray::new(DVec3::new(0.0, 0.0, 2.0) - 2.0 * DVec3::from(d), d);
        let hit = hat.intersect(&ray, Interval::FORWARD).unwrap();
        assert_eq!((hit.lambda, hit.part, hat.normal(&ray, &hit)), (2.0, WALL, DVec3::Z));
    }
    let ball = Sphere::UNIT;
    let ray = Ray::new([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]);
    let hit = ball.intersect(&ray, Interval::FORWARD).unwrap();
    assert_eq!(ball.texture_coordinates(&ray, &hit).y, 1.0);
}

/// h·r̂ − Δr·â at the exact hit, r̂ across the axis and â along it; `None` at an apex.
fn exact_wall_normal(case: &Case, lambda: &Big) -> Option<DVec3> {
    let Solid::Frustum { base, top, base_radius, top_radius } = case.solid else { panic!("a solid of revolution") };
    let base = Big3::from(base);
    let axis = Big3::from(top).minus(&base);
    let line = Line::from(&case.ray);
    let x = Big3(std::array::from_fn(|i| &line.o.0[i] + &(lambda * &line.d.0[i]))).minus(&base);
    let (h2, along) = (axis.norm2(), x.dot(&axis));
    let radial = Big3(std::array::from_fn(|i| &x.0[i] * &h2 - &axis.0[i] * &along)).direction()?;
    Some((h2.to_f64().sqrt() * radial - (top_radius - base_radius) * axis.direction()?).normalize())
}

const NEXT_TO_THE_APEX: &str = "origin [0x1.8000000000000p0, -0x1.0000000000000p2, -0x1.a789dd69b611dp0] direction [-0x1.8000000000000p1, 0x1.0000000000000p3, 0x1.a000000000000p2] within (0.0, inf) frustum [0.0, 0.0, 0.0] [0.0, 0.0, 0x1.9876229649ee4p0] 0x1.8e2983c228785p-1 0.0";

#[test]
fn wall_normals_are_within_their_bound_of_the_exact_ones_next_to_the_apex_too() {
    let (mut walls, mut worst, mut furthest) = (0, 0.0f64, 0.0f64);
    // Whole families, the apex's own (53 aimed at it, 54 passing it, 57 truncated next to it) among them.
    let wanted = [0, 5, 6, 12, 26, 27, 28, 46, 52, 53, 54, 57];
    for family in families::all() {
        if !matches!(family.kernel, Kernel::Cylinder | Kernel::Cone) || !wanted.contains(&family.number) {
            continue;
        }
        let mut of_family = 0;
        for i in 0..1500 {
            let case = family.case(i);
            let shape = shape(&case.solid).unwrap().unwrap();
            let (Some(truth), Some(hit)) = (truth(&case), shape.intersect(&case.ray, case.within)) else { continue };
            let Some(exact) =
                (hit.part == WALL).then(|| exact_wall_normal(&case, &truth.lambda.enclosure().lo)).flatten()
            else {
                continue;
            };
            let Tangent { normal: n, normal_error, curvature } = shape.tangent(&case.ray, &hit);
            assert_eq!(n, shape.normal(&case.ray, &hit));
            // λ's own error turns it by no more than 2⁻⁴⁰: beyond that it is asked for to a hundred bits.
            let turned = hit.error * case.ray.direction.length() * curvature;
            let bound = normal_error + turned.min(2f64.powi(-39));
            let off = (n - exact).length();
            assert!(off <= bound + 4.0 * f64::EPSILON, "{}: {off:e} > {bound:e}: {}", family.name, case.hex());
            worst = worst.max(off / bound);
            // A radial part among the subnormals has no digits to point with; the bound says so.
            if !case.ray.origin.to_array().iter().any(|x| x.is_subnormal()) {
                furthest = furthest.max(off);
            }
            of_family += 1;
        }
        walls += of_family;
    }
    // Met an ulp below its apex: the ends of the section are within an ulp of each other, on opposite sides.
    let case = Case::from_hex(NEXT_TO_THE_APEX);
    let shape = shape(&case.solid).unwrap().unwrap();
    let (truth, hit) = (truth(&case).unwrap(), shape.intersect(&case.ray, case.within).unwrap());
    let exact = exact_wall_normal(&case, &truth.lambda.enclosure().lo).unwrap();
    assert!((shape.normal(&case.ray, &hit) - exact).length() < 1e-11);
    println!("{walls} wall normals, off by at most {worst:.2} of their bound, {furthest:e}");
    assert!(walls > 8000);
    // A cone's apex from 1e-3 down to 1e-14 of its size away: as accurate as anywhere.
    assert!(furthest < 1e-11);
}

/// Far away λ's own ulp is many radii of a small sphere: the normal is still right.
#[test]
fn normals_are_accurate_from_far_away() {
    let ball = Sphere::new([0.0; 3], 1.0).unwrap();
    let mut n = 0;
    for i in 0..100 {
        let x = f64::from(i) / 128.0;
        // An exact ray: the hit is at (x, 0, √(1 − x²)).
        let ray = Ray::new([x, 0.0, 1e15], [0.0, 0.0, -1.0]);
        let hit = ball.intersect(&ray, Interval::FORWARD).unwrap();
        let exact = DVec3::new(x, 0.0, (1.0 - x * x).sqrt());
        assert!((ball.normal(&ray, &hit) - exact).length() < 1e-12);
        assert!((ball.point(&ray, &hit).position - exact).length() < 1e-12);
        n += 1;
    }
    assert_eq!(n, 100);
}

#[test]
fn every_scale_has_unit_normals_and_finite_points() {
    let mut n = 0;
    for e in [-1070, -1000, -600, -300, 0, 300, 600, 1000] {
        let s = truehit::kernel::float::ldexp(1.0, e);
        let shapes: [Box<dyn Shape>; 3] = [
            Box::new(Sphere::new([0.0; 3], 2.0 * s).unwrap()),
            Box::new(Cylinder::new([0.0; 3], [0.0, 0.0, 4.0 * s], 2.0 * s).unwrap()),
            Box::new(Cone::truncated([0.0; 3], [0.0, 0.0, 4.0 * s], 2.0 * s, s).unwrap()),
        ];
        for shape in shapes {
            let ray = Ray::new([8.0 * s, s, s], [-4.0, 0.0, 0.0]);
            let hit = shape.intersect(&ray, Interval::FORWARD).unwrap();
            let (normal, point) = (shape.normal(&ray, &hit), shape.point(&ray, &hit));
            assert!((normal.length() - 1.0).abs() < 1e-15 && normal.x > 0.5, "{shape:?} {normal}");
            assert!(point.position.is_finite() && point.error.is_finite());
            assert!(shape.texture_coordinates(&ray, &hit).is_finite());
            n += 1;
        }
    }
    assert_eq!(n, 24);
}

#[test]
fn bad_input_is_refused_by_name() {
    use InvalidShape::{Degenerate, Negative, NotFinite, NotPositive};
    let (o, z) = ([0.0; 3], [0.0, 0.0, 1.0]);
    let nan = [f64::NAN, 0.0, 0.0];
    let far = [0.0, f64::INFINITY, 0.0];
    assert_eq!(Sphere::new(nan, 1.0), Err(NotFinite { field: "center" }));
    assert_eq!(Sphere::new(o, f64::INFINITY), Err(NotFinite { field: "radius" }));
    assert_eq!(Sphere::new(o, 0.0), Err(NotPositive { field: "radius", value: 0.0 }));
    assert_eq!(Sphere::new(o, -1.0), Err(NotPositive { field: "radius", value: -1.0 }));
    assert!(Sphere::new(o, f64::from_bits(1)).is_ok());
    assert_eq!(Cylinder::new(nan, z, 1.0), Err(NotFinite { field: "base" }));
    assert_eq!(Cylinder::new(o, far, 1.0), Err(NotFinite { field: "top" }));
    assert_eq!(Cylinder::new(o, z, f64::NAN), Err(NotFinite { field: "radius" }));
    assert_eq!(Cylinder::new(o, z, 0.0), Err(NotPositive { field: "radius", value: 0.0 }));
    assert_eq!(Cylinder::new(z, z, 1.0), Err(Degenerate { field: "top" }));
    assert_eq!(Cone::new(o, far, 1.0), Err(NotFinite { field: "apex" }));
    assert_eq!(Cone::new(o, z, -2.0), Err(NotPositive { field: "radius", value: -2.0 }));
    assert_eq!(Cone::new(o, o, 2.0), Err(Degenerate { field: "apex" }));
    assert_eq!(Cone::truncated(o, z, -1.0, 1.0), Err(Negative { field: "base_radius", value: -1.0 }));
    assert_eq!(Cone::truncated(o, z, 1.0, f64::NAN), Err(NotFinite { field: "top_radius" }));
    assert_eq!(Cone::truncated(o, z, 0.0, 0.0), Err(NotPositive { field: "base_radius", value: 0.0 }));
    assert!(Cone::truncated(o, z, 1.0, 0.0).is_ok() && Cone::truncated(o, z, 1.0, 1.0).is_ok());
    // Any ray at all is answered.
    let mut n = 0;
    let odd = [0.0, -0.0, 1.0, f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE, f64::from_bits(1)];
    let shapes: [Box<dyn Shape>; 2] = [Box::new(Sphere::UNIT), Box::new(Cone::new(o, z, 1.0).unwrap())];
    for shape in shapes {
        for x in odd {
            for y in odd {
                for d in odd {
                    let ray = Ray::new([x, y, -2.0], [d, 0.0, y]);
                    let hit = shape.intersect(&ray, Interval::LINE);
                    assert!(hit.is_none() || ray.is_valid());
                    n += usize::from(hit.is_some());
                }
            }
        }
    }
    println!("{n} hits");
    assert!(n > 0);
}
