//! What every shape promises: what its constructor refuses, and of a hit under any map.

mod support;

use support::rng::Rng;
use truehit::glam::{DAffine3, DMat3, DQuat, DVec3};
use truehit::{Affine, Cylinder, Interval, InvalidShape, Mesh, Plane, Polygon, Ray, Shape, Sphere, Triangle};

const F: Interval = Interval::FORWARD;

#[test]
fn constructors_name_what_they_refuse() {
    use InvalidShape::{Degenerate, NotFinite, NotPlanar, Singular, TooFew, ZeroVector};
    let nan = [0.0, f64::NAN, 0.0];
    assert_eq!(Plane::new(nan, [1.0; 3]).unwrap_err(), NotFinite { field: "point" });
    assert_eq!(Plane::new([0.0; 3], nan).unwrap_err(), NotFinite { field: "normal" });
    assert_eq!(Plane::new([0.0; 3], [0.0, -0.0, 0.0]).unwrap_err(), ZeroVector { field: "normal" });
    assert_eq!(Triangle::new([0.0; 3], nan, [1.0; 3]).unwrap_err(), NotFinite { field: "b" });
    let line = Triangle::new([0.1; 3], [0.2; 3], [0.7; 3]);
    assert_eq!(line.unwrap_err(), Degenerate { field: "a, b, c" });
    assert!(Triangle::new([0.1; 3], [0.2; 3], [0.7, 0.7, 0.7f64.next_up()]).is_ok());
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 5.0));
    let hole: Vec<DVec3> = square.iter().map(|v| 0.5 * *v + DVec3::Z * 2.5).collect();
    assert_eq!(Polygon::new(&square[..2]).unwrap_err(), TooFew { field: "outer", needed: 3, given: 2 });
    let short = Polygon::with_holes(&square, &[&hole[..1]]).unwrap_err();
    assert_eq!(short, TooFew { field: "holes", needed: 3, given: 1 });
    let bow = [square[0], square[1], square[3], square[2]];
    assert_eq!(Polygon::new(&bow).unwrap_err(), Degenerate { field: "outer" });
    let mut off = hole.clone();
    off[2].z = 5.0f64.next_up();
    assert!(Polygon::with_holes(&square, &[&off]).is_ok(), "an ulp is rounding");
    for size in [1e-13, 1e-9, 1e-3] {
        off[2].z = 5.0 + size;
        let error = Polygon::with_holes(&square, &[&off]).unwrap_err();
        let NotPlanar { contour: 1, vertex: 2, distance, allowed } = error else { panic!("{error}") };
        assert!((distance / size - 1.0).abs() < 1e-2 && allowed < 1e-14, "{error}");
    }
    let flat = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y));
    assert_eq!(Affine::new(Sphere::UNIT, flat).unwrap_err(), Singular { field: "world_from_object" });
    let bad = DAffine3::from_translation(DVec3::from(nan));
    assert_eq!(Affine::new(Sphere::UNIT, bad).unwrap_err(), NotFinite { field: "world_from_object" });
    for scale in [1e-120, 1e120] {
        assert!(Affine::new(Sphere::UNIT, DAffine3::from_scale(DVec3::splat(scale))).is_ok());
    }
}

/// What every shape promises of a hit, over random maps: the point is on the surface within its bound and inside the
/// box, the normal is the gradient, pointer and value agree, a spawned ray leaves.
#[test]
fn shapes_under_maps_keep_their_promises() {
    let mut r = Rng::named("maps");
    let pentagram =
        [[0.0, 5.0], [3.0, -4.0], [-5.0, 2.0], [5.0, 2.0], [-3.0, -4.0]].map(|[x, y]| DVec3::new(x, y, 1.0));
    let mut seen = [0u32; 2];
    for i in 0..6000 {
        let inner: Box<dyn Shape> = match i % 5 {
            0 => Box::new(Sphere::UNIT),
            1 => Box::new(Triangle::new(r.in_cube(1.0), r.in_cube(1.0), r.in_cube(1.0)).unwrap()),
            2 => Box::new(Polygon::new(&pentagram).unwrap()),
            3 => Box::new(Cylinder::new([0.0; 3], [0.0, 1.0, 2.0], 0.5).unwrap()),
            _ => Box::new(Plane::new(r.in_cube(1.0), r.in_cube(1.0)).unwrap()),
        };
        let turn =
            |r: &mut Rng| DMat3::from_quat(DQuat::from_axis_angle(r.in_cube(1.0).normalize(), r.uniform(0.0, 6.0)));
        let mirror = if i % 2 == 0 { 1.0 } else { -1.0 };
        let scale = DVec3::new(mirror * r.decades(-1.0, 1.0), r.decades(-1.0, 1.0), r.decades(-1.0, 1.0));
        let offset = if i % 3 == 0 { 1e6 } else { 3.0 };
        let map = DAffine3 {
            matrix3: turn(&mut r) * DMat3::from_diagonal(scale) * turn(&mut r),
            translation: offset * r.in_cube(1.0),
        };
        let shape = Affine::new(inner, map).unwrap();
        let target = map.transform_point3(0.7 * r.in_cube(1.0) + DVec3::Z * if i % 5 == 2 { 1.0 } else { 0.0 });
        let origin = target + 10.0 * r.in_cube(1.0);
        let ray = Ray::new(origin, target - origin);
        let Some(hit) = shape.intersect(&ray, F) else {
            assert!(!shape.occludes(&ray, F));
            continue;
        };
        seen[0] += 1;
        assert!(shape.occludes(&ray, F));
        assert_eq!((&shape as &dyn Shape).intersect(&ray, F), Some(hit));
        let (point, normal) = (shape.point(&ray, &hit), shape.normal(&ray, &hit));
        assert!((normal.length() - 1.0).abs() < 1e-12);
        let size = origin.abs().max_element().max(1.0);
        assert!(point.error <= 1e-12 * size && point.error > 0.0, "{point:?}");
        let off = (point.position - ray.at(hit.lambda)).length();
        assert!(off <= 1e-12 * size, "{off} {shape:?}");
        let (low, high) = (shape.bounds().min - point.error, shape.bounds().max + point.error);
        assert!(low.cmple(point.position).all() && point.position.cmple(high).all(), "{shape:?} {point:?}");
        // The normal is the direction in which the object-space normal's function grows: Mᵀn.
        let object_ray = Ray::new(
            shape.object_from_world().transform_point3(ray.origin),
            shape.object_from_world().transform_vector3(ray.direction),
        );
        let across = shape.world_from_object().matrix3.transpose() * normal;
        let object_normal = shape.shape().normal(&object_ray, &hit);
        assert!((across.normalize() - object_normal).length() < 1e-7, "{across} {object_normal}");
        let surface = truehit::Surface::new(&shape, &ray, &hit);
        for _ in 0..3 {
            let direction = r.in_cube(1.0);
            let away = surface.spawn(direction);
            let outward = direction.dot(normal) > 1e-6;
            // A flat shape is never met again; a solid not from outside.
            if !matches!(i % 5, 0 | 3) || outward {
                assert!(shape.intersect(&away, F).is_none(), "{shape:?} {away:?}");
                seen[1] += 1;
            }
            assert!((away.origin - point.position).length() < 1e-10 * size);
        }
    }
    println!("{} hits, {} rays spawned that must not come back", seen[0], seen[1]);
    assert!(seen[0] > 2500 && seen[1] > 5000);
}

#[test]
fn flat_shapes_have_points_at_every_scale() {
    let mut hits = 0;
    for e in [-950, -600, -300, 0, 300, 600, 990, 1000, 1018] {
        let s = truehit::kernel::float::ldexp(1.0, e);
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(|[x, y]| DVec3::new(x * s, y * s, s));
        let [a, b, c, d] = corners;
        let shapes: [Box<dyn Shape>; 4] = [
            Box::new(Plane::new(a, DVec3::Z).unwrap()),
            Box::new(Polygon::new(&corners).unwrap()),
            Box::new(Triangle::new(a, b, c).unwrap()),
            Box::new(Mesh::new(vec![a, b, c, d], vec![[0, 1, 2], [0, 2, 3]]).unwrap()),
        ];
        for shape in shapes {
            let ray = Ray::new([2.0 * s, s, 5.0 * s], [0.0, 0.0, -2.0]);
            let hit = shape.intersect(&ray, F).unwrap();
            let point = shape.point(&ray, &hit);
            // Of the order of an ulp of its coordinates.
            let bound = point.error / s;
            assert!(hit.lambda == 2.0 * s, "{shape:?}: {hit:?}");
            assert!((1e-17..1e-13).contains(&bound), "{shape:?}: {point:?}");
            assert!((point.position / s - DVec3::new(2.0, 1.0, 1.0)).length() < 1e-14, "{shape:?}: {point:?}");
            assert!(shape.texture_coordinates(&ray, &hit).is_finite(), "{shape:?}");
            assert_eq!(shape.normal(&ray, &hit), DVec3::Z);
            hits += 1;
        }
    }
    assert_eq!(hits, 36);
}
