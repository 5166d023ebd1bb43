//! A frame of the gallery, on one thread: what its pixels see, their shadows, all of it. How many rays hit is asserted.
//! `cargo bench --bench frame`

#[path = "../examples/support/gallery.rs"]
mod gallery;
#[path = "../examples/support/stage.rs"]
mod stage;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use truehit::{Interval, Ray};

const SIZE: [u32; 2] = [96, 64];

/// On one thread, whatever the features.
fn alone<R: Send>(f: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "rayon")]
    return rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(f);
    #[cfg(not(feature = "rayon"))]
    f()
}

fn frame(criterion: &mut Criterion) {
    let stage = gallery::gallery().expect("the gallery");
    let camera = stage.camera(SIZE).expect("a camera");
    let scene = &stage.scene;
    let rays: Vec<Ray> = (0..SIZE[0] * SIZE[1]).map(|i| camera.pixel(i % SIZE[0], i / SIZE[0])).collect();
    let seen: Vec<_> = rays.iter().filter_map(|ray| Some((ray, scene.intersect(ray, Interval::FORWARD)?))).collect();
    let mut objects: Vec<usize> = seen.iter().map(|(_, hit)| hit.object).collect();
    objects.sort_unstable();
    objects.dedup();
    assert!(10 * seen.len() > 9 * rays.len(), "{} of {} pixels see something", seen.len(), rays.len());
    assert!(objects.len() >= 12, "{} objects are seen", objects.len());
    // Towards the lamp; λ = 1 is there.
    let lamp = stage.eye + truehit::glam::DVec3::new(-4.0, 2.5, 4.0);
    let shadows: Vec<Ray> = seen.iter().map(|(ray, hit)| scene.surface(ray, hit).spawn_to(lamp)).collect();
    let dark = shadows.iter().filter(|ray| scene.occludes(ray, Interval::new(0.0, 1.0))).count();
    assert!(20 * dark > shadows.len() && 2 * dark < shadows.len(), "{dark} of {} in the dark", shadows.len());

    let mut group = criterion.benchmark_group(format!("frame of {} × {}", SIZE[0], SIZE[1]));
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function("nearest", |b| {
        b.iter(|| rays.iter().filter(|ray| scene.intersect(black_box(ray), Interval::FORWARD).is_some()).count());
    });
    group.throughput(Throughput::Elements(shadows.len() as u64));
    group.bench_function("shadows", |b| {
        let within = Interval::new(0.0, 1.0);
        b.iter(|| shadows.iter().filter(|ray| scene.occludes(black_box(ray), within)).count());
    });
    let together: Vec<(Ray, Interval)> = rays.iter().map(|&ray| (ray, Interval::FORWARD)).collect();
    let mut nearest = vec![None; together.len()];
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function("nearest, all in one call", |b| {
        b.iter(|| scene.intersect_each(black_box(&together), &mut nearest));
    });
    assert_eq!(nearest.iter().flatten().count(), seen.len());
    let together: Vec<(Ray, Interval)> = shadows.iter().map(|&ray| (ray, Interval::new(0.0, 1.0))).collect();
    let mut shadowed = vec![false; together.len()];
    group.throughput(Throughput::Elements(shadows.len() as u64));
    group.bench_function("shadows, all in one call", |b| {
        b.iter(|| scene.occludes_each(black_box(&together), &mut shadowed));
    });
    assert_eq!(shadowed.iter().filter(|&&dark| dark).count(), dark);
    let whitted = stage.whitted();
    let cast = whitted.render(&camera, 1).rays;
    assert!(cast.total() > 2 * cast.camera && cast.mirror > cast.camera / 20, "{cast:?}");
    group.throughput(Throughput::Elements(cast.total()));
    group.sample_size(20);
    group.bench_function("whitted", |b| alone(|| b.iter(|| whitted.render(black_box(&camera), 1).rays.total())));
    group.finish();
}

criterion_group!(benches, frame);
criterion_main!(benches);
