//! How cost grows: meshes of 10⁴ to 10⁷ triangles, scenes of 10³ to 10⁶ instances. Prints tables, no statistics:
//! `cargo bench --bench scaling [-- LARGEST]`, the largest number of triangles, 10⁶ unless told; a tenth of it of
//! instances. `-- instances LARGEST` for the largest number of instances, and no meshes.

#[path = "../tests/meshes/mod.rs"]
mod meshes;
#[path = "../tests/support/rng.rs"]
mod rng;

use meshes::{Parts, icosphere};
use rng::Rng;
use std::sync::Arc;
use std::time::Instant;
use truehit::glam::{DAffine3, DQuat, DVec3};
use truehit::{Affine, Interval, Mesh, Ray, Scene, Shape};

const RAYS: usize = 200_000;

/// Hills over a square of about n triangles.
fn terrain(n: usize) -> Parts {
    let side = (n as f64 / 2.0).sqrt().round() as u32;
    let at = |i: u32| f64::from(i) / f64::from(side);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=side {
        for j in 0..=side {
            let (x, y) = (at(i), at(j));
            let hills = (0..6).map(|octave| {
                let f = f64::from(1 << octave);
                (7.0 * f * x + 0.3 * f).sin() * (9.0 * f * y + 4.0 * f * x).cos() / f
            });
            positions.push(DVec3::new(x, y, 0.05 * hills.sum::<f64>()));
            if i < side && j < side {
                let quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| (i + a) * (side + 1) + j + b);
                triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
    }
    (positions, triangles)
}

/// Bytes of memory in use, where the system tells.
fn resident() -> f64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let pages = pages.and_then(|text| text.split(' ').nth(1)?.parse::<f64>().ok());
    pages.map_or(f64::NAN, |pages| 4096.0 * pages)
}

/// Seconds, and what came of it.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    #[cfg(feature = "rayon")]
    return rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(work);
    #[cfg(not(feature = "rayon"))]
    work()
}

/// Millions of rays a second, and the share that hit.
fn rate(rays: &[Ray], hit: impl Fn(&Ray) -> bool) -> (f64, f64) {
    let (seconds, hits) = timed(|| rays.iter().filter(|r| hit(r)).count());
    assert!(hits * 10 > rays.len(), "{hits} hits");
    (rays.len() as f64 / seconds / 1e6, hits as f64 / rays.len() as f64)
}

fn mesh(parts: &Parts) {
    let n = parts.1.len();
    // By turns, the least of three; large meshes once.
    let times = if n > 2_000_000 { 1 } else { 3 };
    let (mut serial, mut seconds, mut mesh) = (f64::INFINITY, f64::INFINITY, None);
    for _ in 0..times {
        let [a, b] = [parts.clone(), parts.clone()];
        serial = serial.min(timed(|| on_one_thread(|| Mesh::new(a.0, a.1))).0);
        // The last one is gone before the next is built.
        drop(mesh.take());
        let (time, built) = timed(|| Mesh::new(b.0, b.1).expect("a terrain"));
        seconds = seconds.min(time);
        mesh = Some(built);
    }
    let mesh = mesh.expect("at least one");
    let mut random = Rng::new(1);
    let down: Vec<Ray> = (0..RAYS)
        .map(|_| {
            let from = DVec3::new(random.fraction(), random.fraction(), 0.3);
            Ray::new(from, DVec3::new(0.5 * random.uniform(-1.0, 1.0), 0.5 * random.uniform(-1.0, 1.0), -1.0))
        })
        .collect();
    let (rate, hits) = rate(&down, |r| mesh.intersect(r, Interval::FORWARD).is_some());
    println!(
        "| {n} | {serial:.3} s, {:.2} | {seconds:.3} s, {:.2} | {:.0} | {rate:.2} ({:.0} % hit) |",
        n as f64 / serial / 1e6,
        n as f64 / seconds / 1e6,
        mesh.memory() as f64 / n as f64,
        100.0 * hits
    );
}

/// So many instances are placed at a time.
const CHUNK: usize = 1 << 14;

/// On all cores: every instance is made by itself.
fn place(ball: &Arc<Mesh>, places: Vec<DAffine3>) -> Vec<Affine<Arc<Mesh>>> {
    let instance = |place| Affine::new(ball.clone(), place).expect("a place");
    #[cfg(feature = "rayon")]
    return {
        use rayon::prelude::*;
        places.into_par_iter().map(instance).collect()
    };
    #[cfg(not(feature = "rayon"))]
    places.into_iter().map(instance).collect()
}

fn instances(n: usize) {
    let (positions, triangles) = icosphere(2);
    let ball = Arc::new(Mesh::new(positions, triangles).expect("a ball"));
    let mut random = Rng::new(2);
    // About as many of them along a ray whatever their number.
    let size = 0.5 / (n as f64).cbrt();
    let before = resident();
    let mut builder = Scene::builder();
    let mut placing = 0.0;
    for chunk in (0..n).step_by(CHUNK) {
        let places: Vec<DAffine3> = (chunk..n.min(chunk + CHUNK))
            .map(|_| {
                let turn = DQuat::from_axis_angle(random.unit(), random.fraction());
                DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, random.in_cube(1.0))
            })
            .collect();
        placing += timed(|| place(&ball, places).into_iter().for_each(|instance| _ = builder.push(instance, ()))).0;
    }
    let (seconds, scene) = timed(|| builder.build());
    let bytes = (resident() - before) / n as f64;
    let rays: Vec<Ray> = (0..RAYS).map(|_| Ray::new(2.0 * random.unit(), random.in_cube(1.0))).collect();
    let rays: Vec<Ray> = rays.into_iter().map(|r| Ray::new(r.origin, r.direction - r.origin)).collect();
    let (rate, hits) = rate(&rays, |r| scene.intersect(r, Interval::FORWARD).is_some());
    println!("| {n} | {placing:.3} s | {seconds:.3} s | {bytes:.0} | {rate:.2} ({:.0} % hit) |", 100.0 * hits);
}

fn main() {
    let largest = std::env::args().skip(1).find_map(|a| a.parse::<f64>().ok()).unwrap_or(1e6) as usize;
    let only_instances = std::env::args().any(|a| a == "instances");
    if !only_instances {
        println!(
            "| triangles | build, one thread (M/s) | build (M/s) | bytes a triangle | Mray/s |\n|---|---|---|---|---|"
        );
        for n in [10_000, 100_000, 1_000_000, 10_000_000].into_iter().filter(|&n| n <= largest) {
            mesh(&terrain(n));
        }
    }
    let largest = if only_instances { largest } else { largest / 10 };
    println!("\n| instances | placing | scene | bytes an instance | Mray/s |\n|---|---|---|---|---|");
    for n in [1000, 10_000, 100_000, 1_000_000].into_iter().filter(|&n| n <= largest) {
        instances(n);
    }
}
