//! The scene signature: ids, colours, counts.

use std::collections::HashSet;
use truehit::signature::{Signature, color};
use truehit::{Camera, InvalidShape, Plane, Scene, Sphere};

/// A small ball before a large one, above a floor, under an open sky.
fn scene() -> Result<Scene<&'static str>, InvalidShape> {
    let mut builder = Scene::builder();
    builder.push(Plane::new([0.0, -1.0, 0.0], [0.0, 1.0, 0.0])?, "floor");
    builder.push(Sphere::new([0.0, 0.0, -1.0], 1.0)?, "large");
    builder.push(Sphere::new([0.0, 0.0, 0.5], 0.4)?, "small");
    builder.push(Sphere::new([0.0, 0.0, 50.0], 0.1)?, "behind the camera");
    Ok(builder.build())
}

#[test]
fn each_pixel_has_the_first_object() -> Result<(), Box<dyn std::error::Error>> {
    let scene = scene()?;
    let camera = Camera::look_at([0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 0.8, [41, 31])?;
    let signature = Signature::of(&scene, &camera);
    let ids = signature.ids();
    assert_eq!((ids.width(), ids.height()), (41, 31));
    assert_eq!(*ids.at(20, 15), Some(2));
    assert_eq!(*ids.at(20, 9), Some(1));
    assert_eq!(*ids.at(0, 0), None);
    assert_eq!(*ids.at(0, 30), Some(0));
    // Left and right are the same, above and below are not.
    for j in 0..31 {
        for i in 0..41 {
            assert_eq!(ids.at(i, j), ids.at(40 - i, j), "({i}, {j})");
        }
    }
    let counts: Vec<usize> = (0..5).map(|object| signature.count(object)).collect();
    let none = ids.values().iter().filter(|id| id.is_none()).count();
    assert_eq!(counts.iter().sum::<usize>() + none, 41 * 31);
    assert!(counts[..3].iter().all(|&n| n > 30), "{counts:?}");
    assert_eq!(counts[3..], [0, 0]);

    let bytes = signature.to_srgb8();
    for (id, pixel) in ids.values().iter().zip(bytes.as_chunks::<3>().0) {
        assert_eq!(*pixel, id.map_or([0; 3], color));
    }
    Ok(())
}

#[test]
fn an_empty_scene_has_a_black_signature() -> Result<(), Box<dyn std::error::Error>> {
    let camera = Camera::look_at([0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 0.8, [3, 2])?;
    let signature = Signature::of(&Scene::<()>::builder().build(), &camera);
    assert_eq!(signature.ids().values(), [None; 6]);
    assert_eq!(signature.to_srgb8(), [0; 18]);
    assert_eq!(signature.count(0), 0);
    Ok(())
}

#[test]
fn no_two_objects_share_a_colour() {
    let mut seen = HashSet::new();
    for object in 0..200_000 {
        let color = color(object);
        assert_ne!(color, [0; 3]);
        assert!(seen.insert(color), "object {object} repeats {color:?}");
    }
    assert_ne!(color((1 << 24) - 2), [0; 3]);
    assert_ne!(color(usize::MAX), [0; 3]);
    // The first dozens are told apart by eye.
    let distance =
        |a: [u8; 3], b: [u8; 3]| (0..3).map(|k| f64::from(a[k]) - f64::from(b[k])).map(|d| d * d).sum::<f64>().sqrt();
    for a in 0..24 {
        assert!(distance(color(a), [0; 3]) > 95.0, "object {a} is nearly black");
        for b in 0..a {
            assert!(distance(color(a), color(b)) > 95.0, "objects {a} and {b} look alike");
        }
    }
}
