//! What the slides teach, and where they are wrong: each erratum by its counter-example, so that the slide's formula
//! fails the test. The numbers are those of docs/numerics.md §13.

#[path = "support/rng.rs"]
mod rng;

use rng::Rng;
use truehit::glam::{DAffine3, DMat3, DVec2, DVec3};
use truehit::kernel::textbook;
use truehit::shading::{Checker, Light, Material, RayCount, Rgb, Whitted, phong};
use truehit::{
    Affine, Camera, Cone, Cylinder, Hit, Interval, InvalidShape, Mesh, Plane, Polygon, Ray, Scene, Shape, Sphere,
    Surface, Triangle,
};

type Tested = Result<(), InvalidShape>;

fn hit(shape: &dyn Shape, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
    shape.intersect(&Ray::new(origin, direction), Interval::FORWARD)
}

fn lambda(shape: &dyn Shape, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    hit(shape, origin, direction).map(|h| h.lambda)
}

fn normal(shape: &dyn Shape, origin: [f64; 3], direction: [f64; 3]) -> DVec3 {
    let ray = Ray::new(origin, direction);
    shape.normal(&ray, &shape.intersect(&ray, Interval::FORWARD).expect("a hit"))
}

/// Far from singular.
fn some_map(random: &mut Rng) -> DAffine3 {
    let matrix = DMat3::from_cols(random.in_cube(1.0), random.in_cube(1.0), random.in_cube(1.0));
    DAffine3::from_mat3_translation(matrix * 0.3 + DMat3::IDENTITY, 3.0 * random.in_cube(1.0))
}

#[test]
fn line_1_the_closest_hit_of_all_objects() -> Tested {
    let mut builder = Scene::builder();
    for z in [-9.0, -3.0, -6.0] {
        builder.push(Sphere::new([0.0, 0.0, z], 1.0)?, ());
    }
    let scene = builder.build();
    let found = scene.intersect(&Ray::new([0.0; 3], [0.0, 0.0, -1.0]), Interval::FORWARD).unwrap();
    assert_eq!((found.object, found.hit.lambda), (1, 2.0));
    Ok(())
}

#[test]
fn lines_2_and_3_both_algorithms_agree_with_the_shipped_triangle() -> Tested {
    let mut random = Rng::new(1);
    let (mut hits, mut misses) = (0, 0);
    for _ in 0..2000 {
        let vertices = [random.in_cube(1.0), random.in_cube(1.0), random.in_cube(1.0)];
        // Aimed near the triangle.
        let (origin, target) = (4.0 * random.in_cube(1.0), 0.5 * random.in_cube(1.0));
        let ray = Ray::new(origin, target - origin);
        let shipped = Triangle::new(vertices[0], vertices[1], vertices[2])?.intersect(&ray, Interval::LINE);
        for textbook in [
            textbook::algorithm_1::<f64>(&ray, &vertices, Interval::LINE),
            textbook::algorithm_2::<f64>(&ray, &vertices, Interval::LINE),
        ] {
            assert_eq!(textbook.is_some(), shipped.is_some(), "{ray:?} {vertices:?}");
            if let (Some(textbook), Some(shipped)) = (textbook, shipped) {
                assert!((textbook.lambda / shipped.lambda - 1.0).abs() < 1e-6, "{ray:?} {vertices:?}");
            }
        }
        *(if shipped.is_some() { &mut hits } else { &mut misses }) += 1;
    }
    println!("{hits} hits, {misses} misses");
    assert!(hits > 100 && misses > 100, "{hits} {misses}");
    Ok(())
}

#[test]
fn line_5_the_cases_of_the_sphere() -> Tested {
    let ball = Sphere::new([0.0; 3], 1.0)?;
    assert_eq!(lambda(&ball, [0.0, 1.5, 4.0], [0.0, 0.0, -1.0]), None);
    assert_eq!(lambda(&ball, [0.0, 1.0, 4.0], [0.0, 0.0, -1.0]), Some(4.0));
    assert_eq!(lambda(&ball, [0.0, 0.0, 4.0], [0.0, 0.0, 1.0]), None);
    assert_eq!(lambda(&ball, [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]), Some(1.0));
    assert_eq!(lambda(&ball, [0.0, 0.0, 4.0], [0.0, 0.0, -1.0]), Some(3.0));
    Ok(())
}

#[test]
fn erratum_1_the_origin_goes_back_by_t_and_lambda_stays() -> Tested {
    let moved = Affine::new(Sphere::UNIT, DAffine3::from_translation(DVec3::new(0.0, 0.0, 5.0)))?;
    let ray = Ray::new([0.0, 0.0, 3.0], [0.0, 0.0, 1.0]);
    // The slide's a + t gives −9 and −7.
    let first = moved.intersect(&ray, Interval::LINE).unwrap();
    assert!((first.lambda - 1.0).abs() <= first.error, "{first:?}");
    let second = moved.intersect(&ray, Interval::new(2.0, f64::INFINITY)).unwrap();
    assert!((second.lambda - 3.0).abs() <= second.error, "{second:?}");
    Ok(())
}

#[test]
fn erratum_2_a_cone_is_not_half_an_ellipsoid() -> Tested {
    let cone = Cone::new([0.0; 3], [0.0, 0.0, 1.0], 0.5)?;
    for z in [0.125, 0.25, 0.5, 0.75, 0.9375] {
        let radius = 5.0 - lambda(&cone, [5.0, 0.0, z], [-1.0, 0.0, 0.0]).unwrap();
        // The slide's ¼(1 − z²) is .1875 at ½.
        assert!((radius * radius - 0.25 * (1.0 - z) * (1.0 - z)).abs() < 1e-15, "radius {radius} at {z}");
    }
    // Nor does it go on above its apex.
    for z in [1.0625, 1.5, 2.0, -0.0625] {
        assert_eq!(lambda(&cone, [5.0, 0.0, z], [-1.0, 0.0, 0.0]), None, "{z}");
    }
    Ok(())
}

#[test]
fn errata_3_and_4_the_deformed_surface_and_its_tangent_plane() -> Tested {
    let mut random = Rng::new(3);
    let mut hits = 0;
    for _ in 0..300 {
        let map = some_map(&mut random);
        let deformed = Affine::new(Sphere::UNIT, map)?;
        let origin = 8.0 * random.in_cube(1.0);
        let ray = Ray::new(origin, map.translation + random.in_cube(1.0) - origin);
        let Some(hit) = deformed.intersect(&ray, Interval::LINE) else { continue };
        hits += 1;
        // F(q) = f(A⁻¹(q − t)) at the hit point q: q, not the p that q is the image of.
        let q = deformed.point(&ray, &hit).position;
        let p = map.inverse().transform_point3(q);
        assert!((p.length() - 1.0).abs() < 1e-12, "{p}");
        // qᵀ(A⁻ᵀn) = D + (A⁻¹t)·n, a scalar: n of the sphere at p is p itself, and D = p·n.
        let n = p.normalize();
        let scaled = map.matrix3.inverse().transpose() * n;
        let right = p.dot(n) + (map.matrix3.inverse() * map.translation).dot(n);
        assert!((q.dot(scaled) - right).abs() < 1e-11);
        assert!((deformed.normal(&ray, &hit) - scaled.normalize()).length() < 1e-11);
        // The image of the tangent plane is the tangent plane.
        let (u, v) = n.any_orthonormal_pair();
        for tangent in [u, v] {
            assert!(deformed.normal(&ray, &hit).dot((map.matrix3 * tangent).normalize()).abs() < 1e-11);
        }
    }
    println!("{hits} hits");
    assert!(hits > 40, "{hits}");
    Ok(())
}

#[test]
fn erratum_5_the_unit_sphere_has_radius_one_around_the_origin() {
    let mut random = Rng::new(5);
    for _ in 0..100 {
        // From the centre every ray meets it at distance one; "at a point p, ‖p‖ = 1" would be another sphere.
        let direction = random.in_cube(1.0).normalize();
        let ray = Ray::new([0.0; 3], direction);
        let hit = Sphere::UNIT.intersect(&ray, Interval::FORWARD).unwrap();
        assert!((Sphere::UNIT.point(&ray, &hit).position.length() - 1.0).abs() < 1e-15);
    }
}

#[test]
fn erratum_6_lambda_zero_tangency_behind_and_no_direction() -> Tested {
    let ball = Sphere::new([0.0; 3], 1.0)?;
    // On the surface, outward and inward: λ = 0 is outside the open interval, the far side is not.
    assert_eq!(lambda(&ball, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), None);
    assert_eq!(lambda(&ball, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]), Some(2.0));
    // D = 0, and the one hit is behind: none. Or at the origin: none.
    assert_eq!(lambda(&ball, [0.0, 1.0, -4.0], [0.0, 0.0, -1.0]), None);
    assert_eq!(lambda(&ball, [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]), None);
    for direction in [[0.0; 3], [f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0]] {
        assert_eq!(lambda(&ball, [0.0, 0.0, 0.5], direction), None, "{direction:?}");
    }
    Ok(())
}

#[test]
fn erratum_7_what_counts_is_the_origin_not_the_view_plane() -> Result<(), Box<dyn std::error::Error>> {
    // Camera rays cross the view plane at λ = 1. A ball between it and the eye is seen.
    let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0, [3, 3])?;
    let ball = Sphere::new([0.0, 0.0, -0.5], 0.125)?;
    let hit = ball.intersect(&camera.pixel(1, 1), Interval::FORWARD).unwrap();
    assert_eq!(hit.lambda, 0.375);
    Ok(())
}

#[test]
fn erratum_8_the_textbook_roots_lose_what_the_shipped_ones_keep() {
    // From 2²⁷ away along the axis, where the answer is a float.
    let ray = Ray::new([0.0, 0.0, 134_217_728.0], [0.0, 0.0, -1.0]);
    let exact = 134_217_727.0;
    assert_eq!(Sphere::UNIT.intersect(&ray, Interval::FORWARD).unwrap().lambda, exact);
    // From 3e8 away, aslant.
    let ray = Ray::new([1e8, 2e8, -2e8], [-0.1, -0.2, 0.2]);
    let shipped = Sphere::UNIT.intersect(&ray, Interval::FORWARD).unwrap();
    assert!(shipped.error <= f64::EPSILON * shipped.lambda);
    let slide = textbook::sphere::<f64>(&ray, DVec3::ZERO, 1.0, Interval::FORWARD);
    let off = slide.map_or(f64::INFINITY, |slide| (slide.lambda - shipped.lambda).abs());
    println!("the slide's λ is off by {off:e}, the bound is {:e}", shipped.error);
    assert!(off > 100.0 * shipped.error, "{off:e}");
}

#[test]
fn erratum_9_parallel_rays_planes_behind_and_either_orientation() -> Tested {
    let plane = Plane::new([0.0; 3], [0.0, 0.0, 2.0])?;
    assert_eq!(lambda(&plane, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), None);
    assert_eq!(lambda(&plane, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]), None);
    assert_eq!(lambda(&plane, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), None);
    let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for triangle in [Triangle::new(a, b, c)?, Triangle::new(a, c, b)?] {
        for (origin, direction) in [([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]), ([0.25, 0.25, -1.0], [0.0, 0.0, 1.0])] {
            assert_eq!(lambda(&triangle, origin, direction), Some(1.0));
        }
        assert_eq!(lambda(&triangle, [0.75, 0.75, 1.0], [0.0, 0.0, -1.0]), None);
    }
    Ok(())
}

/// A concave polygon in z = 0: an arrowhead whose first corner is a wing.
fn arrowhead() -> Result<Polygon, InvalidShape> {
    Polygon::new(&[[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [4.0, 0.0, 0.0], [2.0, 4.0, 0.0]].map(DVec3::from))
}

#[test]
fn erratum_10_a_polygon_is_not_its_first_triangle() -> Tested {
    let arrowhead = arrowhead()?;
    let inside = |x: f64, y: f64| lambda(&arrowhead, [x, y, 1.0], [0.0, 0.0, -1.0]).is_some();
    // In the coordinates of the first three corners α ≥ 0, β ≥ 0, α + β ≤ 1 describes the notch.
    assert!(!inside(2.0, 0.5));
    assert!(inside(2.0, 2.0) && inside(1.0, 1.0) && inside(3.0, 1.0));
    Ok(())
}

#[test]
fn erratum_11_counting_through_vertices_and_along_edges() -> Tested {
    let down = |polygon: &Polygon, x: f64, y: f64| lambda(polygon, [x, y, 1.0], [0.0, 0.0, -1.0]).is_some();
    // A diamond: the horizontal through its middle passes both side corners; a slide's count may be 0, 1, 2, 3.
    let diamond = Polygon::new(&[[1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from))?;
    assert!(down(&diamond, 1.0, 1.0) && down(&diamond, 0.5, 1.0) && down(&diamond, 1.5, 1.0));
    assert!(!down(&diamond, -0.5, 1.0) && !down(&diamond, 2.5, 1.0));
    assert!(down(&diamond, 1.0, 0.5) && down(&diamond, 1.0, 1.5) && !down(&diamond, 1.0, -0.5));
    // Steps: horizontals and verticals along edges.
    let steps = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 3.0], [0.0, 3.0]];
    let steps = Polygon::new(&steps.map(|[x, y]| DVec3::new(x, y, 0.0)))?;
    assert!(down(&steps, 0.5, 1.0) && down(&steps, 0.5, 2.0) && down(&steps, 1.5, 1.0) && down(&steps, 1.0, 0.5));
    assert!(!down(&steps, 3.5, 1.0) && !down(&steps, 2.5, 2.0) && !down(&steps, -0.5, 2.0) && !down(&steps, 2.0, 2.5));
    // A pentagram is even-odd: its arms are inside, its middle is not.
    let star: Vec<DVec3> =
        (0..5).map(|k| DVec2::from_angle(0.5 + 0.8 * std::f64::consts::PI * f64::from(k)).extend(0.0)).collect();
    let star = Polygon::new(&star)?;
    assert!(!down(&star, 0.0, 0.0));
    let arm = DVec2::from_angle(0.5) * 0.8;
    assert!(down(&star, arm.x, arm.y));
    Ok(())
}

#[test]
fn erratum_12_clip_before_comparing() -> Tested {
    let can = Cylinder::new([0.0, 0.0, 0.0], [0.0, 0.0, 2.0], 1.0)?;
    // Down through the open end: the infinite wall is met first, at z = 3, and does not count; the cap does.
    let (origin, direction) = ([2.0, 0.0, 4.0], [-1.0, 0.0, -1.0]);
    assert_eq!(lambda(&can, origin, direction), Some(2.0));
    assert_eq!(normal(&can, origin, direction), DVec3::Z);
    // Along the axis the wall has no quadratic at all; across it, d_z = 0, the caps have no λ.
    assert_eq!(lambda(&can, [0.5, 0.0, 5.0], [0.0, 0.0, -1.0]), Some(3.0));
    assert_eq!(lambda(&can, [2.0, 0.0, 5.0], [0.0, 0.0, -1.0]), None);
    assert_eq!(lambda(&can, [5.0, 0.0, 1.0], [-1.0, 0.0, 0.0]), Some(4.0));
    assert_eq!(lambda(&can, [5.0, 0.0, 3.0], [-1.0, 0.0, 0.0]), None);
    // A cone's cap has the wall's radius at that height, a truncated one's two caps have two.
    let cup = Cone::truncated([0.0; 3], [0.0, 0.0, 1.0], 2.0, 1.0)?;
    assert_eq!(lambda(&cup, [1.5, 0.0, 5.0], [0.0, 0.0, -1.0]), Some(4.5));
    assert_eq!(lambda(&cup, [0.5, 0.0, 5.0], [0.0, 0.0, -1.0]), Some(4.0));
    assert_eq!(lambda(&cup, [1.5, 0.0, -5.0], [0.0, 0.0, 1.0]), Some(5.0));
    assert_eq!(lambda(&cup, [2.5, 0.0, -5.0], [0.0, 0.0, 1.0]), None);
    Ok(())
}

#[test]
fn erratum_13_mirrored_maps_keep_normals_outward() -> Tested {
    let mirrored = Affine::new(Sphere::UNIT, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)))?;
    // cross(Su, Sv) = det(S)·S⁻ᵀ(u×v) points inward.
    let mut random = Rng::new(13);
    for _ in 0..50 {
        let outside = 3.0 * random.in_cube(1.0).normalize();
        let n = normal(&mirrored, outside.to_array(), (-outside).to_array());
        assert!((n - outside.normalize()).length() < 1e-12, "{n}");
    }
    let (u, v) = (DVec3::Y, DVec3::Z);
    let s = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    assert_eq!((s * u).cross(s * v), -(s.inverse().transpose() * u.cross(v)));
    // At the poles, where the explicit form vanishes, there is a unit normal too.
    assert_eq!(normal(&Sphere::UNIT, [0.0, 0.0, 5.0], [0.0, 0.0, -1.0]), DVec3::Z);
    Ok(())
}

#[test]
fn erratum_14_unit_normals_at_the_apex_and_vertex_normals_on_meshes() -> Tested {
    let cone = Cone::new([0.0; 3], [0.0, 0.0, 1.0], 0.5)?;
    for direction in [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [-3.0, 1.0, -2.0]] {
        let origin = DVec3::new(0.0, 0.0, 1.0) - 2.0 * DVec3::from(direction);
        let n = normal(&cone, origin.to_array(), direction);
        assert!((n.length() - 1.0).abs() < 1e-12, "{n}");
    }
    // One triangle whose corners lean three ways: in the middle the mean of the three, and the facet's own beside it.
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]].map(DVec3::from);
    let lean = [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8)];
    let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2]])?.with_normals(lean.to_vec())?;
    let ray = Ray::new([1.0, 1.0, 1.0], [0.0, 0.0, -1.0]);
    let hit = mesh.intersect(&ray, Interval::FORWARD).unwrap();
    let surface = Surface::new(&mesh, &ray, &hit);
    assert_eq!(surface.normal(), DVec3::Z);
    let mean = (lean[0] + lean[1] + lean[2]).normalize();
    assert!((surface.shading_normal() - mean).length() < 1e-15);
    Ok(())
}

#[test]
fn erratum_15_the_eye_may_be_inside_the_box() -> Tested {
    // In the middle of a scene, and of a mesh: an entry λ < 0 must not end the search.
    let mut builder = Scene::builder();
    for x in [-2.0, 2.0] {
        for y in [-2.0, 2.0] {
            builder.push(Sphere::new([x, y, 0.0], 1.0)?, ());
        }
    }
    let scene = builder.build();
    for (object, direction) in
        [[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]].into_iter().enumerate()
    {
        let ray = Ray::new([0.0; 3], direction);
        assert_eq!(scene.intersect(&ray, Interval::FORWARD).map(|found| found.object), Some(object));
        assert!(scene.occludes(&ray, Interval::FORWARD));
    }
    let corners = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    let octahedron = Mesh::new(corners.to_vec(), faces.to_vec())?;
    let mut random = Rng::new(15);
    for _ in 0..100 {
        let ray = Ray::new(0.2 * random.in_cube(1.0), random.in_cube(1.0));
        assert!(octahedron.intersect(&ray, Interval::FORWARD).is_some(), "{ray:?}");
    }
    Ok(())
}

#[test]
fn erratum_16_no_highlight_from_behind() -> Tested {
    let n = DVec3::Z;
    assert!(phong::reflect(-n, n).dot(-n) > 0.0, "the slide's term shines");
    assert_eq!(phong::specular(-n, n, -n, 10.0), 0.0);
    // In a picture: a plane lit from behind, seen at the angle of the mirrored light.
    let mut builder = Scene::builder();
    builder.push(Plane::new([0.0; 3], n)?, Material::matt([0.0; 3]).with_gloss(1.0, 10.0));
    let scene = builder.build();
    let dark = Whitted::new(&scene).light(Light::directional(-n, [1.0; 3]));
    let ray = Ray::new([0.0, 0.0, 2.0], [0.0, 0.0, -1.0]);
    let mut rays = RayCount::default();
    assert_eq!(dark.radiance(&ray, &mut rays), Rgb::ZERO);
    assert_eq!(rays, RayCount { camera: 1, shadow: 0, mirror: 0 });
    Ok(())
}

#[test]
fn line_12_textures_by_surface_parameters_of_every_shape() -> Tested {
    let mut random = Rng::new(12);
    let shapes: [&dyn Shape; 5] = [
        &Sphere::UNIT,
        &Cylinder::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], 0.5)?,
        &Cone::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], 0.7)?,
        &Triangle::new([-1.0, -1.0, 0.0], [1.0, -1.0, 0.1], [0.0, 1.0, 0.2])?,
        &Affine::new(Sphere::UNIT, some_map(&mut random))?,
    ];
    for shape in shapes {
        let (mut hits, mut low, mut high) = (0, DVec2::INFINITY, DVec2::NEG_INFINITY);
        for _ in 0..2000 {
            let (origin, target) = (6.0 * random.in_cube(1.0), shape.bounds().center() + random.in_cube(1.0));
            let ray = Ray::new(origin, target - origin);
            let Some(hit) = shape.intersect(&ray, Interval::FORWARD) else { continue };
            let uv = shape.texture_coordinates(&ray, &hit);
            assert!(uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all(), "{uv} on {shape:?}");
            (low, high) = (low.min(uv), high.max(uv));
            hits += 1;
        }
        println!("{hits} hits, uv from {low} to {high} on {shape:?}");
        assert!(hits > 100, "{hits} on {shape:?}");
        assert!((high - low).min_element() > 0.5, "{low} {high} on {shape:?}");
    }
    // The texel is the material's factor: white and black fields of a checker at the poles' two sides.
    let mut builder = Scene::builder();
    builder.push(Sphere::UNIT, Material::matt([1.0; 3]).with_texture(Checker::new([1.0; 3], [0.0; 3], [2.0, 1.0])));
    let scene = builder.build();
    let whitted = Whitted::new(&scene).ambient([1.0; 3]);
    let seen = |from: [f64; 3]| whitted.radiance(&Ray::new(from, -DVec3::from(from)), &mut RayCount::default());
    assert_eq!((seen([1.0, 3.0, 0.5]), seen([1.0, -3.0, 0.5])), (Rgb::ONE, Rgb::ZERO));
    Ok(())
}
