//! The rays: what a renderer asks, and what a watertight mesh must answer.

use crate::engine::{Engine, Found, Ray, RaySet};
use crate::mesh::Mesh;
use crate::reference;

type V = [f64; 3];

pub fn add(a: V, s: f64, b: V) -> V {
    std::array::from_fn(|i| a[i] + s * b[i])
}
fn sub(a: V, b: V) -> V {
    add(a, -1.0, b)
}
fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn unit(a: V) -> V {
    let l = dot(a, a).sqrt();
    a.map(|x| x / l)
}

/// SplitMix64: the same rays in every run.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn real(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.real() * n as f64) as usize
    }

    fn direction(&mut self) -> V {
        let z = 2.0 * self.real() - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * self.real()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * cos, r * sin, z]
    }

    fn in_box(&mut self, lo: V, hi: V) -> V {
        std::array::from_fn(|i| lo[i] + self.real() * (hi[i] - lo[i]))
    }
}

fn ray(origin: V, direction: V, max: f32) -> Ray {
    Ray { origin: origin.map(|x| x as f32), direction: direction.map(|x| x as f32), max }
}

struct Frame {
    lo: V,
    hi: V,
    centre: V,
    /// Half the diagonal.
    radius: f64,
}

fn frame(mesh: &Mesh) -> Frame {
    let (lo, hi) = mesh.bounds();
    let (lo, hi) = (lo.map(f64::from), hi.map(f64::from));
    let centre = std::array::from_fn(|i| f64::midpoint(lo[i], hi[i]));
    Frame { lo, hi, centre, radius: 0.5 * dot(sub(hi, lo), sub(hi, lo)).sqrt() }
}

/// The share of directions from the middle of the box that meet something: plain f64, only to choose a camera.
pub fn seen_from_the_middle(mesh: &Mesh) -> f64 {
    let mut random = Random::new(11);
    let centre = frame(mesh).centre;
    let meets = |d: V| {
        mesh.triangles.iter().any(|t| {
            let v = t.map(|i| sub(mesh.positions[i as usize].map(f64::from), centre));
            let sides = [0, 1, 2].map(|i| dot(d, cross(v[i], v[(i + 1) % 3])));
            let normal = cross(sub(v[1], v[0]), sub(v[2], v[0]));
            (sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0))
                && dot(normal, v[0]) / dot(normal, d) > 0.0
        })
    };
    (0..50).filter(|_| meets(random.direction())).count() as f64 / 50.0
}

/// About `count` camera rays of four pinhole views, in tiles of 4 × 4 pixels.
fn camera_rays(mesh: &Mesh, count: usize) -> Vec<Ray> {
    let Frame { lo, hi, centre, radius } = frame(mesh);
    let side = (((count / 4) as f64).sqrt() as usize).next_multiple_of(4);
    let mut rays = Vec::with_capacity(4 * side * side);
    for view in 0..4 {
        let turn = std::f64::consts::TAU * (f64::from(view) + 0.3) / 4.0;
        let (eye, forward, half_width) = if mesh.interior {
            let ahead = [turn.cos(), -0.05, turn.sin()];
            let aside = [-0.1 * turn.cos() * (hi[0] - lo[0]), 0.0, -0.1 * turn.sin() * (hi[2] - lo[2])];
            (add(centre, 1.0, aside), unit(ahead), 0.8)
        } else {
            let from = unit([turn.cos(), 0.4, turn.sin()]);
            (add(centre, 2.2 * radius, from), from.map(|x| -x), 0.42)
        };
        let right = unit(cross(forward, [0.0, 1.0, 0.0]));
        let up = cross(right, forward);
        for tile in 0..side * side / 16 {
            for pixel in 0..16 {
                let x = tile % (side / 4) * 4 + pixel % 4;
                let y = tile / (side / 4) * 4 + pixel / 4;
                let at = |p: usize| half_width * (2.0 * (p as f64 + 0.5) / side as f64 - 1.0);
                rays.push(ray(eye, add(add(forward, at(x), right), at(y), up), f32::INFINITY));
            }
        }
    }
    rays
}

/// The six ray sets of the race. `tracer` finds the first hits that the secondary rays start from.
pub fn sets(mesh: &Mesh, tracer: &mut dyn Engine, count: usize, seed: u64) -> Vec<RaySet> {
    let mut random = Random::new(seed);
    let Frame { lo, hi, centre, radius } = frame(mesh);
    let primary = RaySet::new("primary", false, true, camera_rays(mesh, count));
    let mut first = vec![Found::MISS; primary.rays.len()];
    tracer.closest(&primary, &mut first);

    // Points just off the surface, on the side they were seen from, with the normal there.
    let points: Vec<(V, V)> = primary
        .rays
        .iter()
        .zip(&first)
        .filter(|(_, f)| f.is_hit())
        .map(|(r, f)| {
            let (o, d) = (r.origin.map(f64::from), r.direction.map(f64::from));
            let v: [V; 3] = std::array::from_fn(|i| mesh.corner(f.triangle, i).map(f64::from));
            let n = unit(cross(sub(v[1], v[0]), sub(v[2], v[0])));
            let n = if dot(n, d) > 0.0 { n.map(|x| -x) } else { n };
            (add(add(o, f.lambda, d), 1e-5 * radius, n), n)
        })
        .filter(|(_, n)| n.iter().all(|x| x.is_finite()))
        .collect();
    assert!(points.len() * 20 > count, "{}: the camera sees too little", mesh.name);

    let light = if mesh.interior {
        add(centre, 0.3 * (hi[1] - lo[1]), [0.05, 1.0, 0.03])
    } else {
        add(centre, 3.0 * radius, unit([0.5, 1.0, 0.3]))
    };
    let shadow = points.iter().map(|&(p, _)| {
        let from = ray(p, [0.0; 3], 1.0);
        ray(p, sub(light, from.origin.map(f64::from)), 1.0)
    });
    let bounce: Vec<Ray> = (0..count)
        .map(|i| {
            // Every point in turn, spread over the picture as a renderer's wavefront is.
            let (p, n) = points[i * points.len() / count];
            // A point of the unit sphere around the tip of n: cosine-distributed.
            let d = add(n, 1.0, random.direction());
            ray(p, if dot(d, d) > 1e-8 { d } else { n }, f32::INFINITY)
        })
        .collect();
    let grow = |v: V| add(centre, 1.1, sub(v, centre));
    let scattered: Vec<Ray> =
        (0..count).map(|_| ray(random.in_box(grow(lo), grow(hi)), random.direction(), f32::INFINITY)).collect();
    let shadow = shadow.collect();
    vec![
        primary,
        RaySet::new("bounce", false, false, bounce.clone()),
        RaySet::new("random", false, false, scattered.clone()),
        RaySet::new("shadow", true, true, shadow),
        RaySet::new("bounce any", true, false, bounce),
        RaySet::new("random any", true, false, scattered),
    ]
}

/// Rays from inside a closed mesh, about `count` of each kind: every one of them must hit.
pub fn aimed(mesh: &Mesh, count: usize, seed: u64) -> Vec<RaySet> {
    let mut random = Random::new(seed);
    let Frame { lo, hi, .. } = frame(mesh);
    let mut inside = Vec::new();
    for _ in 0..4000 {
        let p = random.in_box(lo, hi);
        let probe = ray(p, random.direction(), f32::INFINITY);
        // A random direction meets no edge; if it does, the parity says nothing.
        let crossings = reference::trace(mesh, &probe);
        if crossings.ties.len() == 1 && crossings.count % 2 == 1 {
            inside.push(probe.origin);
        }
        if inside.len() == 16 {
            break;
        }
    }
    assert!(!inside.is_empty(), "{}: no point inside found", mesh.name);
    let mut kinds = [("vertices", 0usize), ("edges", 1), ("faces", 2)].map(|(name, kind)| {
        let rays = (0..count)
            .map(|i| {
                let origin = inside[i % inside.len()];
                // In turn while they last: an even step through all triangles.
                let t = ((i as u64 * 0x9e37_79b1) % mesh.triangles.len() as u64) as u32;
                let v: [V; 3] = std::array::from_fn(|k| mesh.corner(t, k).map(f64::from));
                let corner = random.below(3);
                let target = match kind {
                    0 => v[corner],
                    1 => {
                        let w = (1 + random.below(3)) as f64 / 4.0;
                        add(v[corner].map(|x| x * (1.0 - w)), w, v[(corner + 1) % 3])
                    }
                    _ => {
                        let (a, b) = (random.real(), random.real());
                        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
                        add(add(v[0], a, sub(v[1], v[0])), b, sub(v[2], v[0]))
                    }
                };
                let from = origin.map(f64::from);
                ray(from, sub(target, from), f32::INFINITY)
            })
            .filter(|r| r.direction != [0.0; 3])
            .collect();
        RaySet::new(name, false, false, rays)
    });
    kinds.sort_by_key(|k| k.name == "faces");
    kinds.into()
}
