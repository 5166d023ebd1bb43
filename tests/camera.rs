//! Pixel → ray.

use approx::assert_relative_eq;
use truehit::glam::DVec3;
use truehit::{Camera, InvalidCamera};

fn camera(size: [u32; 2]) -> Camera {
    Camera::look_at([1.0, 2.0, 3.0], [1.0, 2.0, -7.0], [0.3, 5.0, 2.0], 60_f64.to_radians(), size).unwrap()
}

#[test]
fn rows_run_down_and_columns_right() {
    // Looking along −z with y up, whatever the sideways part of `up`… here it tilts the picture a little.
    let level = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0, [4, 2]).unwrap();
    let upper_left = level.pixel(0, 0).direction;
    assert!(upper_left.x < 0.0 && upper_left.y > 0.0);
    let lower_right = level.pixel(3, 1).direction;
    assert!(lower_right.x > 0.0 && lower_right.y < 0.0);
    assert_eq!(level.pixel(0, 0), level.ray(0.5, 0.5));
}

#[test]
fn the_vertical_angle_spans_the_height_and_pixels_are_square() {
    for size in [[640, 480], [10, 500], [500, 10], [1, 1]] {
        let camera = camera(size);
        let [w, h] = size.map(f64::from);
        let upper = camera.ray(0.5 * w, 0.0).direction;
        let lower = camera.ray(0.5 * w, h).direction;
        assert_relative_eq!(upper.angle_between(lower), 60_f64.to_radians(), max_relative = 1e-14);
        let right = camera.ray(1.0, 0.0).direction - camera.ray(0.0, 0.0).direction;
        let down = camera.ray(0.0, 1.0).direction - camera.ray(0.0, 0.0).direction;
        assert_relative_eq!(right.length(), down.length(), max_relative = 1e-12);
        assert!(right.dot(down).abs() <= 1e-12 * right.length_squared());
    }
}

#[test]
fn lambda_is_depth() {
    let camera = camera([64, 48]);
    assert_eq!(camera.eye(), DVec3::new(1.0, 2.0, 3.0));
    assert!((camera.forward() - DVec3::NEG_Z).length() < 1e-15);
    for (i, j) in [(0, 0), (63, 47), (20, 40)] {
        let ray = camera.pixel(i, j);
        assert_eq!(ray.origin, camera.eye());
        assert_relative_eq!(ray.direction.dot(camera.forward()), 1.0, max_relative = 1e-15);
    }
}

#[test]
fn samples_are_stratified_and_depend_on_their_name_alone() {
    let camera = camera([8, 6]);
    let strata = 5;
    let mut seen = Vec::new();
    for index in 0..strata * strata {
        let ray = camera.sample(3, 2, index, strata);
        assert_eq!(ray, camera.sample(3, 2, index, strata));
        // Back to raster coordinates, by the picture's corner and its two edges.
        let corner = camera.ray(0.0, 0.0).direction;
        let right = camera.ray(1.0, 0.0).direction - corner;
        let down = camera.ray(0.0, 1.0).direction - corner;
        let offset = ray.direction - corner;
        let x = (offset.dot(right) / right.length_squared() - 3.0) * f64::from(strata);
        let y = (offset.dot(down) / down.length_squared() - 2.0) * f64::from(strata);
        assert_eq!((x.floor() as u32, y.floor() as u32), (index % strata, index / strata), "({x}, {y})");
        seen.push([x.fract(), y.fract()]);
    }
    // Jittered: not the same place in every cell, and not the same jitter in the next pixel.
    assert!(seen.iter().any(|s| (s[0] - seen[0][0]).abs() > 0.2));
    assert_ne!(
        camera.sample(3, 2, 0, strata).direction - camera.pixel(3, 2).direction,
        camera.sample(4, 2, 0, strata).direction - camera.pixel(4, 2).direction
    );
    for strata in [0, 1] {
        assert_eq!(camera.sample(3, 2, 0, strata), camera.pixel(3, 2));
    }
}

#[test]
fn any_scale_will_do() {
    for scale in [1e-300, 1e-9, 1.0, 1e9, 1e300] {
        let camera =
            Camera::look_at([scale, 0.0, 0.0], [-scale, 0.0, 0.0], [0.0, scale, 0.0], 90_f64.to_radians(), [2, 2])
                .unwrap();
        let corner = camera.ray(2.0, 0.0).direction;
        assert!((corner - DVec3::new(-1.0, 1.0, -1.0)).length() < 1e-15, "{corner}");
    }
}

#[test]
fn bad_input_is_refused_by_name() {
    let eye = [0.0, 0.0, 5.0];
    let up = [0.0, 1.0, 0.0];
    let look_at = |eye: [f64; 3], target: [f64; 3], up: [f64; 3], fov, size| {
        Camera::look_at(eye, target, up, fov, size).map(|_| ())
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let v = [0.0, bad, 1.0];
        assert_eq!(look_at(v, [0.0; 3], up, 1.0, [1, 1]), Err(InvalidCamera::NotFinite { field: "eye" }));
        assert_eq!(look_at(eye, v, up, 1.0, [1, 1]), Err(InvalidCamera::NotFinite { field: "target" }));
        assert_eq!(look_at(eye, [0.0; 3], v, 1.0, [1, 1]), Err(InvalidCamera::NotFinite { field: "up" }));
    }
    assert_eq!(look_at(eye, eye, up, 1.0, [1, 1]), Err(InvalidCamera::EyeAtTarget));
    for along in [[0.0; 3], [0.0, 0.0, 3.0], [0.0, 0.0, -1e-200], [0.0, 1e-17, 1.0]] {
        assert_eq!(look_at(eye, [0.0; 3], along, 1.0, [1, 1]), Err(InvalidCamera::UpParallel), "{along:?}");
    }
    // Nearly parallel is not parallel.
    assert_eq!(look_at(eye, [0.0; 3], [0.0, 1e-12, 1.0], 1.0, [1, 1]), Ok(()));
    for fov in [0.0, -1.0, std::f64::consts::PI, 4.0, f64::INFINITY, 5e-324] {
        assert_eq!(look_at(eye, [0.0; 3], up, fov, [1, 1]), Err(InvalidCamera::FieldOfView { radians: fov }));
    }
    assert!(matches!(
        look_at(eye, [0.0; 3], up, f64::NAN, [1, 1]),
        Err(InvalidCamera::FieldOfView { radians }) if radians.is_nan()
    ));
    for size in [[0, 1], [1, 0], [0, 0]] {
        assert_eq!(look_at(eye, [0.0; 3], up, 1.0, size), Err(InvalidCamera::NoPixels { size }));
    }
    assert_eq!(InvalidCamera::NoPixels { size: [0, 7] }.to_string(), "size must be at least 1 × 1 pixels, got 0 × 7");
}
