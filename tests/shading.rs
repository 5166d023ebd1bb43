//! The Whitted model term by term, by the rays it casts and the light it returns.

use std::sync::Arc;
use truehit::glam::{DVec2, DVec3};
use truehit::shading::color::{decode, encode, srgb, to_srgb8};
use truehit::shading::{
    Background, Checker, ImageTexture, InvalidTexture, Light, Material, Mirror, RayCount, Rgb, Sides, Texture, Whitted,
    phong,
};
use truehit::{Aabb, Camera, Hit, Interval, InvalidShape, Plane, Ray, Scene, Shape, Sphere};

/// E seen by a ray, and the rays it took.
fn seen(whitted: &Whitted<'_>, origin: [f64; 3], direction: [f64; 3]) -> (Rgb, RayCount) {
    let mut rays = RayCount::default();
    let radiance = whitted.radiance(&Ray::new(origin, direction), &mut rays);
    (radiance, rays)
}

fn count(camera: u64, shadow: u64, mirror: u64) -> RayCount {
    RayCount { camera, shadow, mirror }
}

fn assert_near(a: Rgb, b: Rgb) {
    assert!((a - b).abs().max_element() <= 1e-12, "{a} is not {b}");
}

/// The ground, seen from above by [`seen`] at (0, 0, 0).
fn ground(material: Material) -> Result<Scene<Material>, InvalidShape> {
    let mut builder = Scene::builder();
    builder.push(Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, material);
    Ok(builder.build())
}

const ABOVE: [f64; 3] = [0.0, 0.0, 5.0];
const DOWN: [f64; 3] = [0.0, 0.0, -2.0];

#[test]
fn ambient_is_r_a_times_i_a() -> Result<(), InvalidShape> {
    let scene = ground(Material::matt([0.5, 0.25, 1.0]))?;
    let whitted = Whitted::new(&scene).ambient([0.2, 0.4, 0.6]);
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::new(0.1, 0.1, 0.6), count(1, 0, 0)));
    Ok(())
}

#[test]
fn diffuse_is_the_cosine_of_unit_vectors() -> Result<(), InvalidShape> {
    let scene = ground(Material::matt([0.5, 0.25, 1.0]))?;
    for length in [1e-3, 1.0, 700.0] {
        let slanted = DVec3::new(3.0, 0.0, 4.0) * length;
        let sun = Whitted::new(&scene).light(Light::directional(slanted, [1.0, 2.0, 3.0]));
        let (radiance, rays) = seen(&sun, ABOVE, DOWN);
        assert_near(radiance, 0.8 * Rgb::new(0.5, 0.5, 3.0));
        assert_eq!(rays, count(1, 1, 0));
        // A point light there is the same: its light does not fade.
        let lamp = Whitted::new(&scene).light(Light::point(slanted, [1.0, 2.0, 3.0]));
        assert_near(seen(&lamp, ABOVE, DOWN).0, radiance);
    }
    Ok(())
}

#[test]
fn highlights_are_the_mirrored_light_seen_from_the_camera() -> Result<(), InvalidShape> {
    let black = Material::matt([0.0; 3]);
    let scene = ground(black.clone().with_gloss(0.5, 20.0))?;
    let whitted = Whitted::new(&scene).light(Light::directional([3.0, 0.0, 4.0], [1.0, 2.0, 3.0]));
    // Straight into the mirrored light, …
    let (radiance, _) = seen(&whitted, [-3.0, 0.0, 4.0], [3.0, 0.0, -4.0]);
    assert_near(radiance, 0.5 * Rgb::new(1.0, 2.0, 3.0));
    // … and from above, where r·c = 0.8.
    let (radiance, _) = seen(&whitted, ABOVE, DOWN);
    assert_near(radiance, 0.5 * 0.8_f64.powi(20) * Rgb::new(1.0, 2.0, 3.0));
    // Where neither term could add anything, no shadow ray is cast.
    let scene = ground(black)?;
    let whitted = Whitted::new(&scene).light(Light::directional([3.0, 0.0, 4.0], [1.0; 3]));
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::ZERO, count(1, 0, 0)));
    Ok(())
}

#[test]
fn a_light_behind_the_surface_costs_no_ray_and_shows_no_highlight() -> Result<(), InvalidShape> {
    let scene = ground(Material::matt([1.0; 3]).with_gloss(1.0, 1.0))?;
    for towards in [[0.0, 0.0, -1.0], [5.0, 0.0, -1e-3], [1.0, 0.0, 0.0]] {
        let whitted = Whitted::new(&scene).light(Light::directional(towards, [1.0; 3]));
        assert_eq!(seen(&whitted, [-4.0, 0.0, 4.0], [1.0, 0.0, -1.0]), (Rgb::ZERO, count(1, 0, 0)), "{towards:?}");
    }
    // Nor does a light on the very point, or one without a direction.
    for light in [Light::point([0.0; 3], [1.0; 3]), Light::directional([0.0; 3], [1.0; 3])] {
        let whitted = Whitted::new(&scene).light(light);
        assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::ZERO, count(1, 0, 0)), "{light:?}");
    }
    Ok(())
}

#[test]
fn shadows_end_at_the_light() -> Result<(), InvalidShape> {
    let mut builder = Scene::builder();
    builder.push(Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, Material::matt([1.0; 3]));
    builder.push(Sphere::new([0.0, 4.0, 5.0], 1.0)?, Material::matt([1.0; 3]));
    let scene = builder.build();
    let lit_by = |light| seen(&Whitted::new(&scene).light(light), ABOVE, DOWN);
    let behind = DVec3::new(0.0, 8.0, 10.0);
    assert_eq!(lit_by(Light::point(behind, [1.0; 3])), (Rgb::ZERO, count(1, 1, 0)));
    assert_eq!(lit_by(Light::directional(behind, [1.0; 3])), (Rgb::ZERO, count(1, 1, 0)));
    // A light in front of the ball, on the same line.
    let (radiance, rays) = lit_by(Light::point(0.3 * behind, [1.0; 3]));
    assert!(radiance.x > 0.5);
    assert_eq!(rays, count(1, 1, 0));
    Ok(())
}

#[test]
fn nothing_shadows_itself_at_any_scale() -> Result<(), InvalidShape> {
    for scale in [1e-12, 1e-3, 1.0, 1e6, 1e12] {
        let mut builder = Scene::builder();
        let center = DVec3::new(3.0, -2.0, 7.0) * scale;
        builder.push(Sphere::new(center, scale)?, Material::matt([1.0; 3]));
        let scene = builder.build();
        let whitted = Whitted::new(&scene).light(Light::directional([0.0, 0.0, 1.0], [1.0; 3]));
        let (mut lit, mut rays) = (0, RayCount::default());
        for i in 0..40 {
            for j in 0..40 {
                let at = center + scale * DVec3::new(f64::from(i) / 20.0 - 0.975, f64::from(j) / 20.0 - 0.975, 3.0);
                let radiance = whitted.radiance(&Ray::new(at, [0.0, 0.0, -scale]), &mut rays);
                // The whole upper half is lit by the cosine alone.
                let offset = at - center;
                let r2 = (offset.x * offset.x + offset.y * offset.y) / (scale * scale);
                let expected = if r2 < 1.0 { (1.0 - r2).sqrt() } else { 0.0 };
                assert!((radiance.x - expected).abs() < 1e-6, "{} instead of {expected} at {scale}", radiance.x);
                lit += u64::from(radiance.x > 0.0);
            }
        }
        assert!(lit > 1200, "{lit}");
        assert_eq!(rays, count(1600, lit, 0));
    }
    Ok(())
}

#[test]
fn a_mirror_shows_what_is_in_its_direction_times_r_g() -> Result<(), InvalidShape> {
    let scene = ground(Material::matt([0.0; 3]).with_mirror(Mirror::even([0.5, 0.25, 1.0])))?;
    let sky = Background::Sky { up: DVec3::Z, horizon: Rgb::ONE, zenith: Rgb::ZERO };
    let whitted = Whitted::new(&scene).background(sky);
    let (radiance, rays) = seen(&whitted, [-3.0, 0.0, 4.0], [3.0, 0.0, -4.0]);
    // The mirrored ray rises by 0.8 of its length.
    assert_near(radiance, 0.2 * Rgb::new(0.5, 0.25, 1.0));
    assert_eq!(rays, count(1, 0, 1));
    Ok(())
}

#[test]
fn without_r_g_no_mirror_ray_is_cast() -> Result<(), InvalidShape> {
    let scene = ground(Material::matt([1.0; 3]))?;
    let whitted = Whitted::new(&scene).background(Background::Uniform(Rgb::ONE));
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::ZERO, count(1, 0, 0)));
    Ok(())
}

/// A mirror on the ground under a ceiling of `height` that glows.
fn under_a_ceiling(height: f64, mirror: Mirror) -> Result<Scene<Material>, InvalidShape> {
    let mut builder = Scene::builder();
    builder.push(Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, Material::matt([0.0; 3]).with_mirror(mirror));
    builder.push(Plane::new([0.0, 0.0, height], [0.0, 0.0, -1.0])?, Material::matt([1.0; 3]));
    Ok(builder.build())
}

#[test]
fn r_g_may_fade_with_distance() -> Result<(), InvalidShape> {
    let mirror = Mirror::fading([0.8; 3], 10.0);
    for (height, expected) in [(6.0, 0.8 * 0.4), (9.0, 0.8 * 0.1), (10.0, 0.0), (11.0, 0.0)] {
        let scene = under_a_ceiling(height, mirror)?;
        let whitted = Whitted::new(&scene).ambient([1.0; 3]).background(Background::Uniform(Rgb::ONE));
        // Directions of any length: distances are distances.
        for direction in [[0.0, 0.0, -0.01], DOWN] {
            let (radiance, rays) = seen(&whitted, [0.0, 0.0, 5.0], direction);
            assert_near(radiance, Rgb::splat(expected));
            assert_eq!(rays, count(1, 0, 1));
        }
    }
    assert_eq!(Mirror::fading([1.0; 3], 4.0).at(f64::INFINITY), Rgb::ZERO);
    assert_eq!(Mirror::fading([1.0; 3], f64::NAN).at(1.0), Rgb::ZERO);
    assert_eq!(Mirror::fading([1.0; 3], -1.0).at(f64::INFINITY), Rgb::ZERO);
    assert_eq!(Mirror::even([1.0; 3]).at(f64::INFINITY), Rgb::ONE);
    Ok(())
}

/// Two mirrors that face each other.
fn hall(r_g: f64) -> Result<Scene<Material>, InvalidShape> {
    let mut builder = Scene::builder();
    let mirror = Material::matt([1.0; 3]).with_mirror(Mirror::even([r_g; 3]));
    builder.push(Plane::new([0.0; 3], [0.0, 0.0, 1.0])?, mirror.clone());
    builder.push(Plane::new([0.0, 0.0, 10.0], [0.0, 0.0, -1.0])?, mirror);
    Ok(builder.build())
}

#[test]
fn depth_and_cutoff_end_the_recursion() -> Result<(), InvalidShape> {
    let scene = hall(0.5)?;
    let whitted = Whitted { depth: 3, cutoff: 0.0, ..Whitted::new(&scene).ambient([1.0; 3]) };
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::splat(1.0 + 0.5 + 0.25 + 0.125), count(1, 0, 3)));
    let whitted = Whitted { depth: 0, ..whitted };
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::ONE, count(1, 0, 0)));
    // Shares are ½, ¼, ⅛: the fourth mirror could count for no more than 1/16.
    let whitted = Whitted { depth: 1000, cutoff: 1.0 / 16.0, ..whitted };
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::splat(1.875), count(1, 0, 3)));
    // A perfect hall of mirrors is cut off by depth alone, and needs no stack for it.
    let scene = hall(1.0)?;
    let whitted = Whitted { depth: 100_000, ..Whitted::new(&scene).ambient([1.0; 3]) };
    assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::splat(100_001.0), count(1, 0, 100_000)));
    Ok(())
}

#[test]
fn sides_are_shadings_business() -> Result<(), InvalidShape> {
    const BELOW: [f64; 3] = [0.0, 0.0, -5.0];
    const UP: [f64; 3] = [0.0, 0.0, 2.0];
    let material = Material::matt([1.0; 3]).with_mirror(Mirror::even([0.5; 3]));
    for (sides, from_below, rays) in [
        // The light from below, then the dark: r_g·0.
        (Sides::Both, 0.25 + 1.0, count(1, 1, 1)),
        (Sides::Front, 0.25, count(1, 0, 0)),
    ] {
        let scene = ground(Material { sides, ..material.clone() })?;
        let whitted = Whitted::new(&scene)
            .ambient([0.25; 3])
            .light(Light::directional([0.0, 0.0, -1.0], [1.0; 3]))
            .light(Light::directional([0.0, 0.0, 1.0], [2.0; 3]));
        assert_eq!(seen(&whitted, BELOW, UP), (Rgb::splat(from_below), rays), "{sides:?}");
        assert_eq!(seen(&whitted, ABOVE, DOWN), (Rgb::splat(0.25 + 2.0), count(1, 1, 1)), "{sides:?}");
    }
    Ok(())
}

/// The plane z = 0, a facet of a smooth surface that leans over to one side.
#[derive(Debug)]
struct Leaning(DVec3);

impl Shape for Leaning {
    fn intersect(&self, ray: &Ray, within: Interval) -> Option<Hit> {
        Plane::new([0.0; 3], [0.0, 0.0, 1.0]).ok()?.intersect(ray, within)
    }
    fn normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        DVec3::Z
    }
    fn shading_normal(&self, _: &Ray, _: &Hit) -> DVec3 {
        self.0.normalize()
    }
    fn bounds(&self) -> Aabb {
        Aabb::new([-1e3, -1e3, 0.0], [1e3, 1e3, 0.0])
    }
}

#[test]
fn geometric_and_shading_normal_have_each_their_part() {
    let mut builder = Scene::builder();
    builder.push(Leaning(DVec3::new(1.0, 0.0, 1.0)), Material::matt([1.0; 3]).with_mirror(Mirror::even([1.0; 3])));
    let scene = builder.build();
    let sun =
        |towards: [f64; 3]| Whitted { depth: 0, ..Whitted::new(&scene) }.light(Light::directional(towards, [1.0; 3]));
    // Well above the facet the shading normal alone counts.
    let (radiance, _) = seen(&sun([0.0, 0.0, 1.0]), ABOVE, DOWN);
    assert_near(radiance, Rgb::splat(0.5_f64.sqrt()));
    // Below the facet it is night, however the shading normal leans: no shadow ray either.
    assert_eq!(seen(&sun([1.0, 0.0, -0.1]), ABOVE, DOWN), (Rgb::ZERO, count(1, 0, 0)));
    // Between, light fades in without a step.
    let at = |height: f64| seen(&sun([1.0, 0.0, height]), ABOVE, DOWN).0.x;
    assert!(at(1e-6) < 1e-5);
    let mut last = 0.0;
    for step in 1..=1000 {
        let now = at(1e-3 * f64::from(step));
        assert!((now - last).abs() < 4e-3, "a step from {last} to {now}");
        last = now;
    }
    // A mirrored ray never enters the facet: c mirrored about the leaning normal would.
    let glance = [-5.0, 0.0, 0.5];
    let n = DVec3::new(1.0, 0.0, 1.0).normalize();
    assert!(
        phong::reflect(DVec3::new(-1.0, 0.0, 0.1), -n).z < 0.0 || phong::reflect(DVec3::new(-1.0, 0.0, 0.1), n).z < 0.0
    );
    let whitted =
        Whitted::new(&scene).background(Background::Sky { up: DVec3::Z, horizon: Rgb::ZERO, zenith: Rgb::ONE });
    let (radiance, rays) = seen(&whitted, glance, [1.0, 0.0, -0.1]);
    assert_eq!(rays, count(1, 0, 1));
    assert!(radiance.x > 0.5, "{radiance}");
}

#[test]
fn terminator_factor_is_one_for_equal_normals_and_falls_to_zero() {
    let n = DVec3::Z;
    assert_eq!(phong::terminator(DVec3::new(0.6, 0.0, 0.8), n, n), 1.0);
    let lean = DVec3::new(0.6, 0.0, 0.8);
    assert_eq!(phong::terminator(DVec3::Z, lean, n), 1.0);
    assert_eq!(phong::terminator(DVec3::X, lean, n), 0.0);
    assert_eq!(phong::terminator(DVec3::NEG_Z, lean, n), 0.0);
}

#[test]
fn srgb_is_the_piecewise_function() {
    // IEC 61966-2-1: the linear piece, the join, mid grey, white. A power of 2.2 gives 0.0333 and 0.5 for 0.001,
    // 0.2140.
    for (linear, encoded) in
        [(0.0, 0.0), (0.001, 0.01292), (0.003_130_8, 0.040_449_936), (0.214_041_14, 0.5), (1.0, 1.0)]
    {
        assert!((encode(linear) - encoded).abs() < 1e-7, "{linear}");
        assert!((decode(encoded) - linear).abs() < 1e-7, "{encoded}");
    }
    for byte in 0..=255 {
        assert_eq!(to_srgb8(srgb(byte, 255 - byte, 7)), [byte, 255 - byte, 7]);
    }
    assert_eq!(to_srgb8(Rgb::new(-1.0, 2.0, f64::NAN)), [0, 255, 0]);
    assert_eq!(to_srgb8(Rgb::new(f64::INFINITY, f64::NEG_INFINITY, 1e-9)), [255, 0, 0]);
}

#[test]
fn textures_modulate_ambient_and_diffuse_and_nothing_else() -> Result<(), InvalidShape> {
    #[derive(Debug)]
    struct Red;
    impl Texture for Red {
        fn color(&self, _: DVec2) -> Rgb {
            Rgb::X
        }
    }
    let shiny = Material::matt([0.5; 3]).with_gloss(0.25, 1.0).with_mirror(Mirror::even([0.125; 3]));
    let scene = ground(shiny.with_texture(Red))?;
    let whitted = Whitted::new(&scene)
        .ambient([1.0; 3])
        .light(Light::directional([0.0, 0.0, 1.0], [1.0; 3]))
        .background(Background::Uniform(Rgb::ONE));
    let (radiance, _) = seen(&whitted, ABOVE, DOWN);
    assert_near(radiance, Rgb::new(0.5 + 0.5, 0.0, 0.0) + Rgb::splat(0.25 + 0.125));
    Ok(())
}

#[test]
fn checkers_alternate_across_zero_and_far_away() {
    let checker = Checker::new([1.0; 3], [0.0; 3], [2.0, 4.0]);
    let at = |u: f64, v: f64| checker.color(DVec2::new(u, v)).x;
    assert_eq!([at(0.1, 0.1), at(0.6, 0.1), at(0.1, 0.3), at(0.6, 0.3)], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!([at(-0.1, 0.1), at(0.1, -0.1), at(-0.1, -0.1)], [0.0, 0.0, 1.0]);
    assert_eq!([at(1e9 + 0.1, 0.1), at(1e9 + 0.6, 0.1)], [1.0, 0.0]);
    assert!(at(f64::NAN, f64::INFINITY).is_finite());
}

#[test]
fn images_lie_upright_repeat_and_interpolate_in_linear_light() {
    // Red, green over blue, white.
    let bytes = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    let image = ImageTexture::from_srgb8(2, 2, &bytes).unwrap();
    let at = |u: f64, v: f64| image.color(DVec2::new(u, v));
    for (u, v) in [(0.25, 0.75), (1.25, 0.75), (-0.75, -0.25), (5.25, 8.75)] {
        assert_eq!(at(u, v), Rgb::X, "({u}, {v})");
    }
    assert_eq!([at(0.75, 0.75), at(0.25, 0.25), at(0.75, 0.25)], [Rgb::Y, Rgb::Z, Rgb::ONE]);
    // Halfway between texels, and across the seam.
    assert_near(at(0.5, 0.75), Rgb::new(0.5, 0.5, 0.0));
    assert_near(at(0.0, 0.75), Rgb::new(0.5, 0.5, 0.0));
    assert_near(at(0.25, 0.0), Rgb::new(0.5, 0.0, 0.5));
    assert!(at(f64::NAN, f64::INFINITY).is_finite());
    // An sRGB grey of 128 is a linear 0.2158, as f32.
    let grey = ImageTexture::from_srgb8(1, 1, &[128; 3]).unwrap();
    assert!((grey.color(DVec2::ZERO).x - 0.215_860_5).abs() < 1e-6);
}

#[test]
fn bad_pictures_are_no_textures() {
    for (width, height, bytes) in [(0, 0, 0), (0, 5, 0), (2, 2, 11), (2, 2, 13), (1, 1, 0), (u32::MAX, u32::MAX, 3)] {
        let error = ImageTexture::from_srgb8(width, height, &vec![0; bytes]).unwrap_err();
        assert_eq!(error, InvalidTexture { width, height, bytes });
    }
    let error = InvalidTexture { width: 2, height: 3, bytes: 1 };
    assert_eq!(error.to_string(), "a texture of 2 × 3 texels cannot be made of 1 bytes");
}

#[cfg(feature = "image")]
#[test]
fn pictures_of_the_image_crate_are_textures() {
    let picture =
        image::DynamicImage::from(image::RgbaImage::from_fn(2, 1, |i, _| image::Rgba([255 * i as u8, 0, 0, 9])));
    let texture = ImageTexture::try_from(&picture).unwrap();
    assert_eq!(texture.color(DVec2::new(0.75, 0.5)), Rgb::X);
    assert_eq!(texture, ImageTexture::from_srgb8(2, 1, &[0, 0, 0, 255, 0, 0]).unwrap());
    assert!(ImageTexture::try_from(&image::DynamicImage::new_rgb8(0, 4)).is_err());
}

#[test]
fn textures_are_mapped_by_surface_parameters() {
    /// u and v as red and green.
    #[derive(Debug)]
    struct Chart;
    impl Texture for Chart {
        fn color(&self, at: DVec2) -> Rgb {
            at.extend(0.0)
        }
    }
    let mut builder = Scene::builder();
    let chart: Arc<dyn Texture> = Arc::new(Chart);
    builder.push(Sphere::UNIT, Material::matt([1.0; 3]).with_texture(chart));
    let scene = builder.build();
    let whitted = Whitted::new(&scene).ambient([1.0; 3]);
    for (from, shape_says) in
        [([5.0, 0.3, 0.2], 0.0), ([0.2, 5.0, -0.7], 0.25), ([-5.0, 0.1, 0.4], 0.5), ([0.0, -5.0, 0.6], 0.75)]
    {
        let direction = -DVec3::from(from);
        let ray = Ray::new(from, direction);
        let hit = Sphere::UNIT.intersect(&ray, Interval::FORWARD).unwrap();
        let uv = Sphere::UNIT.texture_coordinates(&ray, &hit);
        assert_near(seen(&whitted, from, direction.to_array()).0, uv.extend(0.0));
        assert!((uv.x - shape_says).abs() < 0.1);
    }
}

#[test]
fn a_pixel_is_the_mean_of_its_samples_and_rays_are_counted() -> Result<(), Box<dyn std::error::Error>> {
    let scene = ground(Material::matt([1.0; 3]))?;
    let whitted = Whitted::new(&scene).light(Light::point([1.0, 2.0, 3.0], [1.0; 3]));
    let camera = Camera::look_at(ABOVE, [0.0; 3], [0.0, 1.0, 0.0], 1.0, [5, 4])?;
    let progress = std::sync::Mutex::new((0, RayCount::default()));
    let rendering = whitted.render_with(&camera, 3, |rays| {
        let mut progress = progress.lock().unwrap();
        progress.0 += 1;
        progress.1 += rays;
    });
    assert_eq!(rendering.rays, count(5 * 4 * 9, 5 * 4 * 9, 0));
    assert_eq!(rendering.rays.total(), 360);
    assert_eq!(progress.into_inner().unwrap(), (4, rendering.rays));
    let mut rays = RayCount::default();
    let mean = (0..9).map(|s| whitted.radiance(&camera.sample(3, 1, s, 3), &mut rays)).sum::<Rgb>() / 9.0;
    assert_eq!(*rendering.picture.at(3, 1), mean);
    assert_eq!(rendering, whitted.render(&camera, 3));
    assert_eq!(rendering.picture.to_srgb8().len(), 5 * 4 * 3);
    Ok(())
}

#[test]
fn the_sky_is_seen_by_direction() {
    let scene = Scene::builder().build();
    let sky = Background::Sky { up: DVec3::Z, horizon: Rgb::ONE, zenith: Rgb::ZERO };
    let whitted = Whitted::new(&scene).background(sky);
    for (direction, expected) in
        [([0.0, 0.0, 3.0], 0.0), ([4.0, 0.0, 3.0], 0.4), ([1.0, 0.0, 0.0], 1.0), ([1.0, 0.0, -9.0], 1.0)]
    {
        let (radiance, rays) = seen(&whitted, ABOVE, direction);
        assert_near(radiance, Rgb::splat(expected));
        assert_eq!(rays, count(1, 0, 0));
    }
}
