//! Bad input: an error that names the field, or a miss; never a false hit, never a panic.

mod support;

use support::cases::{Case, Kernel, Solid};
use support::families;
use support::rng::Rng;
use support::shapes::shape;
use truehit::glam::{DAffine3, DMat3, DVec2, DVec3};
use truehit::{
    Affine, Cone, Cylinder, Hit, Interval, InvalidShape, Mesh, Plane, Polygon, Ray, Shape, Sphere, Surface, Triangle,
};

const NOT_FINITE: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// `make` with one component of one of its vectors spoiled must name that vector.
fn each_component<const N: usize, S>(
    good: [DVec3; N],
    fields: [&str; N],
    make: impl Fn([DVec3; N]) -> Result<S, InvalidShape>,
) {
    assert!(make(good).is_ok(), "{fields:?} are good");
    for (i, expected) in fields.into_iter().enumerate() {
        for axis in 0..3 {
            for bad in NOT_FINITE {
                let mut v = good;
                v[i][axis] = bad;
                match make(v).err() {
                    Some(InvalidShape::NotFinite { field }) => assert_eq!(field, expected),
                    other => panic!("{expected}[{axis}] = {bad}: {other:?}"),
                }
            }
        }
    }
}

/// A length: not finite, and not above zero (or not below, where zero is legal).
fn each_length<S: std::fmt::Debug>(field: &'static str, zero: bool, make: impl Fn(f64) -> Result<S, InvalidShape>) {
    assert!(make(1.5).is_ok());
    for bad in NOT_FINITE {
        // −∞ may be called negative instead.
        let error = make(bad).unwrap_err();
        let negative = bad < 0.0
            && matches!(error, InvalidShape::NotPositive { field: f, .. } | InvalidShape::Negative { field: f, .. } if f == field);
        assert!(negative || error == InvalidShape::NotFinite { field }, "{field} = {bad}: {error}");
    }
    for bad in [-1.0, -f64::MIN_POSITIVE, -f64::from_bits(1)] {
        let error = make(bad).unwrap_err();
        let expected = if zero {
            InvalidShape::Negative { field, value: bad }
        } else {
            InvalidShape::NotPositive { field, value: bad }
        };
        assert_eq!(error, expected);
        assert!(error.to_string().contains(field), "{error}");
    }
    for none in [0.0, -0.0] {
        assert_eq!(make(none).is_ok(), zero, "{field} = {none:?}");
    }
    assert!(make(f64::from_bits(1)).is_ok(), "the smallest {field}");
}

#[test]
fn constructors_name_the_field() {
    let (o, p) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.5, -2.0, 4.0));
    each_component([o, p], ["point", "normal"], |[a, b]| Plane::new(a, b));
    assert_eq!(Plane::new(o, DVec3::ZERO).unwrap_err(), InvalidShape::ZeroVector { field: "normal" });
    assert_eq!(Plane::new(o, -DVec3::ZERO).unwrap_err(), InvalidShape::ZeroVector { field: "normal" });
    assert!(Plane::new(o, DVec3::X * f64::from_bits(1)).is_ok(), "any length but zero");

    each_component([o, p, DVec3::Z], ["a", "b", "c"], |[a, b, c]| Triangle::new(a, b, c));
    for [a, b, c] in [[o, o, o], [o, o, p], [o, p, o], [p, o, o], [o, 2.0 * o, 3.0 * o], [DVec3::ZERO, o, -o]] {
        assert!(matches!(Triangle::new(a, b, c), Err(InvalidShape::Degenerate { .. })), "{a} {b} {c}");
    }
    let tiny = 2f64.powi(-600);
    assert!(Triangle::new([0.0; 3], [tiny, 0.0, 0.0], [0.0, tiny, 0.0]).is_ok(), "its area underflows, it is there");

    each_component([o], ["center"], |[c]| Sphere::new(c, 1.0));
    each_length("radius", false, |r| Sphere::new(o, r));

    each_component([o, p], ["base", "top"], |[a, b]| Cylinder::new(a, b, 1.0));
    each_length("radius", false, |r| Cylinder::new(o, p, r));
    assert!(matches!(Cylinder::new(o, o, 1.0), Err(InvalidShape::Degenerate { .. })));
    each_component([o, p], ["base", "apex"], |[a, b]| Cone::new(a, b, 1.0));
    each_length("radius", false, |r| Cone::new(o, p, r));
    assert!(matches!(Cone::new(o, o, 1.0), Err(InvalidShape::Degenerate { .. })));
    each_component([o, p], ["base", "top"], |[a, b]| Cone::truncated(a, b, 1.0, 0.5));
    each_length("base_radius", true, |r| Cone::truncated(o, p, r, 0.5));
    each_length("top_radius", true, |r| Cone::truncated(o, p, 0.5, r));
    assert!(matches!(Cone::truncated(o, p, 0.0, 0.0), Err(InvalidShape::NotPositive { .. })));
    assert!(matches!(Cone::truncated(o, o, 1.0, 0.5), Err(InvalidShape::Degenerate { .. })));
}

#[test]
fn polygons_name_the_contour() {
    let square = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]].map(DVec3::from);
    let hole = [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]].map(DVec3::from);
    assert!(Polygon::with_holes(&square, &[&hole]).is_ok());
    for n in 0..3 {
        assert!(matches!(Polygon::new(&square[..n]), Err(InvalidShape::TooFew { needed: 3, given, .. }) if given == n));
        let error = Polygon::with_holes(&square, &[&hole, &hole[..n]]).unwrap_err();
        assert!(matches!(error, InvalidShape::TooFew { needed: 3, given, .. } if given == n));
    }
    for bad in NOT_FINITE {
        for (i, axis) in (0..4).flat_map(|i| (0..3).map(move |axis| (i, axis))) {
            let mut spoiled = square;
            spoiled[i][axis] = bad;
            assert!(matches!(Polygon::new(&spoiled), Err(InvalidShape::NotFinite { .. })));
            let mut spoiled = hole;
            spoiled[i % 3][axis] = bad;
            assert!(matches!(Polygon::with_holes(&square, &[&spoiled]), Err(InvalidShape::NotFinite { .. })));
        }
    }
    for flat in [[DVec3::ONE; 4], [0.0, 1.0, 2.0, 3.0].map(DVec3::splat)] {
        assert!(matches!(Polygon::new(&flat), Err(InvalidShape::Degenerate { .. })));
    }
    // A vertex off the plane: a unit in the last place is rounding, a thousandth is not, and its size is told.
    for off in [1e-3, 1e-6, 1e-12] {
        let mut bent = square;
        bent[2].z = off;
        let Err(InvalidShape::NotPlanar { contour: 0, distance, allowed, .. }) = Polygon::new(&bent) else {
            panic!("{off} is flat?")
        };
        assert!(distance > 0.1 * off && distance < 2.0 * off && allowed < 1e-13, "{distance} {allowed}");
        let mut bent = hole;
        bent[1].z = off;
        let error = Polygon::with_holes(&square, &[&bent]).unwrap_err();
        assert!(matches!(error, InvalidShape::NotPlanar { contour: 1, vertex: 1, .. }), "{error}");
    }
    let mut rounded = square;
    rounded[2].z = 4.0 * f64::EPSILON;
    assert!(Polygon::new(&rounded).is_ok());
}

#[test]
fn meshes_and_maps_name_the_field() {
    let corners = || [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from).to_vec();
    let mesh = || Mesh::new(corners(), vec![[0, 1, 2]]).unwrap();
    for bad in NOT_FINITE {
        for (i, axis) in (0..3).flat_map(|i| (0..3).map(move |axis| (i, axis))) {
            let mut spoiled = corners();
            spoiled[i][axis] = bad;
            let not_finite = |field| InvalidShape::NotFinite { field };
            assert_eq!(Mesh::new(spoiled.clone(), vec![[0, 1, 2]]).unwrap_err(), not_finite("positions"));
            assert_eq!(mesh().with_normals(spoiled).unwrap_err(), not_finite("normals"));
            let mut uvs = vec![DVec2::ZERO; 3];
            uvs[i][axis % 2] = bad;
            assert_eq!(mesh().with_uvs(uvs).unwrap_err(), not_finite("uvs"));
        }
    }
    for index in [3, 4, u32::MAX] {
        let error = Mesh::new(corners(), vec![[0, 1, 2], [0, index, 2]]).unwrap_err();
        assert_eq!(error, InvalidShape::IndexOutOfRange { field: "triangles", at: 1, index, count: 3 });
    }
    for given in [0, 2, 4] {
        let error = mesh().with_normals(vec![DVec3::Z; given]).unwrap_err();
        assert_eq!(error, InvalidShape::LengthMismatch { field: "normals", needed: 3, given });
        assert!(matches!(mesh().with_uvs(vec![DVec2::ZERO; given]), Err(InvalidShape::LengthMismatch { .. })));
    }
    let empty = Mesh::new(Vec::new(), Vec::new()).unwrap();
    assert!(empty.bounds().is_empty());
    assert!(empty.intersect(&Ray::new([0.0; 3], [0.0, 0.0, 1.0]), Interval::LINE).is_none());

    let map = DAffine3::from_scale(DVec3::new(1.0, 2.0, 3.0));
    for k in 0..12 {
        for bad in NOT_FINITE {
            let mut entries = map.to_cols_array();
            entries[k] = bad;
            let error = Affine::new(Sphere::UNIT, DAffine3::from_cols_array(&entries)).unwrap_err();
            assert!(matches!(error, InvalidShape::NotFinite { .. }), "{error}");
        }
    }
    for flat in [
        DMat3::ZERO,
        DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)),
        DMat3::from_cols(DVec3::X, DVec3::X, DVec3::Z),
        // 0.1, 0.2, 0.3 are not in proportion 1 : 2 : 3 as floats, but these rows are.
        DMat3::from_cols(DVec3::splat(0.1), DVec3::splat(0.7), DVec3::Z),
    ] {
        let error = Affine::new(Sphere::UNIT, DAffine3 { matrix3: flat, translation: DVec3::ONE }).unwrap_err();
        assert!(matches!(error, InvalidShape::Singular { .. }), "{flat}: {error}");
    }
    for s in [1e-120, 1e120] {
        assert!(Affine::new(Sphere::UNIT, DAffine3::from_scale(DVec3::splat(s))).is_ok(), "{s} is invertible");
    }
    let error = Affine::new(Sphere::UNIT, DAffine3::from_scale(DVec3::splat(1e-310))).unwrap_err();
    assert!(matches!(error, InvalidShape::OutOfRange { .. }), "{error}");
}

/// One shape of each kind, and one under a map, with rays that hit them.
fn specimens() -> Vec<(Case, Box<dyn Shape>)> {
    let mut all = Vec::new();
    for kernel in Kernel::ALL.into_iter().filter(|&k| k != Kernel::Slab) {
        let family = families::ordinary(kernel);
        let hit = (0..).map(|i| family.case(i)).find_map(|case| {
            let s = shape(&case.solid)?.unwrap();
            s.occludes(&case.ray, Interval::FORWARD).then_some((case, s))
        });
        all.push(hit.unwrap());
    }
    all
}

fn misses(shape: &dyn Shape, ray: &Ray, within: Interval) {
    assert_eq!(shape.intersect(ray, within), None, "{shape:?} {ray:?} {within:?}");
    assert!(!shape.occludes(ray, within), "{shape:?} {ray:?} {within:?}");
}

#[test]
fn rays_and_intervals_that_hold_nothing_miss() {
    let specimens = specimens();
    assert_eq!(specimens.len(), 8);
    let mut tried = 0;
    for (case, shape) in &specimens {
        let mut miss = |ray: Ray, within: Interval| {
            tried += 1;
            misses(&**shape, &ray, within);
        };
        for within in [Interval::FORWARD, Interval::LINE] {
            for bad in NOT_FINITE {
                for axis in 0..3 {
                    let (mut o, mut d) = (case.ray, case.ray);
                    o.origin[axis] = bad;
                    d.direction[axis] = bad;
                    miss(o, within);
                    miss(d, within);
                }
            }
            for zero in [0.0, -0.0] {
                miss(Ray { direction: DVec3::splat(zero), ..case.ray }, within);
            }
            miss(Ray { origin: DVec3::NAN, direction: DVec3::NAN }, within);
        }
        let hit = shape.intersect(&case.ray, Interval::FORWARD).unwrap();
        for (min, max) in [
            (f64::NAN, f64::INFINITY),
            (0.0, f64::NAN),
            (f64::NAN, f64::NAN),
            (f64::INFINITY, 0.0),
            (2.0 * hit.lambda, 0.0),
            (hit.lambda, hit.lambda),
            (f64::INFINITY, f64::INFINITY),
            (f64::NEG_INFINITY, f64::NEG_INFINITY),
        ] {
            miss(case.ray, Interval::new(min, max));
        }
    }
    println!("{tried} rays and intervals");
    // Of each specimen, in two intervals: not finite in each component of origin and direction, no direction, nothing
    // at all; and eight empty intervals.
    assert_eq!(tried, specimens.len() * (2 * (6 * NOT_FINITE.len() + 2 + 1) + 8));
}

/// Any bits, in the ray and in the shape: what the constructors let through answers, whatever is asked of it.
#[test]
fn any_bits_give_an_answer() {
    let mut rng = Rng::new(80);
    let (mut built, mut hits) = (0, 0);
    for i in 0..8_000 {
        // All bits; or a range of exponents in which something can be hit; or the edges of the range of floats.
        let kind = i % 4;
        let mut x = || match kind {
            0 => f64::from_bits(rng.next()),
            1 => rng.sign() * rng.log(0.1, 10.0),
            2 => {
                rng.pick(&[0.0, -0.0, 1.0, -1.0, f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, -5e-324, 1e200, 1e-200])
            }
            _ => rng.integer(-3, 3) as f64 * rng.pick(&[1.0, 1e300, 1e-300, 1e-320, 1e150]),
        };
        let mut v = || DVec3::new(x(), x(), x());
        let (ray, points) = (Ray { origin: v(), direction: v() }, [v(), v(), v(), v()]);
        let [a, b, c, d] = points;
        let radius = [a.x.abs(), d.y.abs()];
        let solid = match i / 4 % 6 {
            0 => Solid::Plane { point: a, normal: b },
            1 => Solid::Triangle([a, b, c]),
            2 => Solid::Sphere { center: b, radius: radius[0] },
            3 => Solid::Frustum { base: b, top: c, base_radius: radius[0], top_radius: radius[1] },
            4 => Solid::Polygon(vec![vec![a, b, c]]),
            _ => Solid::Mesh { positions: points.to_vec(), triangles: vec![[0, 1, 2], [1, 2, 3], [3, 3, 0]] },
        };
        let Some(Ok(shape)) = shape(&solid) else { continue };
        built += 1;
        let map = DAffine3 { matrix3: DMat3::from_cols(d, c, a), translation: b };
        let mapped = Affine::new(&*shape, map).ok();
        let both = [Some(&*shape), mapped.as_ref().map(|m| m as &dyn Shape)];
        for s in both.into_iter().flatten() {
            for within in [Interval::FORWARD, Interval::LINE, Interval::new(a.z, b.z)] {
                let hit = s.intersect(&ray, within);
                assert_eq!(hit.is_some(), s.occludes(&ray, within));
                let Some(hit) = hit else { continue };
                hits += 1;
                assert!(!hit.lambda.is_nan() && hit.error >= 0.0, "{solid:?} {ray:?} {hit:?}");
                assert!(ray.is_valid() && !within.is_empty());
                ask_everything(s, &ray, &hit, d);
            }
        }
    }
    println!("{built} shapes, {hits} hits");
    assert!(built > 5_000 && hits > 500);
}

fn ask_everything(s: &dyn Shape, ray: &Ray, hit: &Hit, direction: DVec3) {
    let n = s.normal(ray, hit);
    assert!((n.length() - 1.0).abs() < 1e-9, "{s:?} {ray:?} {hit:?}: normal {n}");
    let _ = (s.bounds(), s.shading_normal(ray, hit), s.texture_coordinates(ray, hit), s.precise_lambda(ray, hit));
    let _ = (s.tangent(ray, hit), s.point(ray, hit));
    let surface = Surface::new(s, ray, hit);
    let _ = (surface.spawn(direction), surface.spawn_to(direction));
}
