//! How good a tree is: its cost by the surface area heuristic, and what rays visit. Not a test of right or wrong.

use super::collapse::{Built, build};
use super::frame::{Frame, FrameBox};
use super::node::Node;
use super::watch::Watch;
use super::wide::{LEAF, NONE};
use crate::Aabb;
use crate::kernel::search::Random;
use glam::DVec3;

type Parts = (Vec<DVec3>, Vec<[u32; 3]>);

fn direction(random: &mut Random) -> DVec3 {
    let z = random.number();
    let (sin, cos) = (std::f64::consts::PI * random.number()).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

#[derive(Default, Clone, Copy)]
struct Visits {
    nodes: usize,
    leaves: usize,
    hits: usize,
}

struct Traced<'a> {
    parts: &'a Parts,
    built: &'a Built,
}

impl Traced<'_> {
    fn cost(&self) -> (f64, f64) {
        let nodes = &self.built.tree.nodes;
        let (mut inner, mut leaves, mut whole) = (0.0, 0.0, Aabb::EMPTY);
        for (n, node) in nodes.iter().enumerate() {
            for lane in 0..8 {
                let c = node.child(lane);
                if c == NONE {
                    continue;
                }
                let (min, max) = ([0, 2, 4].map(|a| node.rows[a][lane]), [1, 3, 5].map(|a| node.rows[a][lane]));
                let area = f64::from(Node::new(min, max, 0, 0).half_area());
                if c & LEAF != 0 {
                    leaves += area;
                } else {
                    inner += area;
                }
                if n == 0 {
                    let v = |a: [f32; 3]| DVec3::from(a.map(f64::from));
                    whole = whole.union(Aabb { min: v(min), max: v(max) });
                }
            }
        }
        let s = whole.size();
        let root = s.x * s.y + s.y * s.z + s.z * s.x;
        (1.0 + inner / root, leaves / root)
    }

    /// The nearest triangle, or any, but not `left`, which the ray starts on.
    fn trace(
        &self,
        origin: DVec3,
        direction: DVec3,
        left: Option<u32>,
        any: bool,
        visits: &mut Visits,
    ) -> Option<(f64, u32)> {
        let frame = &self.built.tree.frame;
        let (o, d) = (frame.local(origin), direction * frame.scale);
        let mut best: Option<(f64, u32)> = None;
        let mut limit = f64::INFINITY;
        let mut stack = vec![(0u32, 0.0)];
        while let Some((at, t)) = stack.pop() {
            if t > limit {
                continue;
            }
            if at & LEAF != 0 {
                visits.leaves += 1;
                let leaf = (at & !LEAF) as usize;
                let range = self.built.starts[leaf] as usize..self.built.starts[leaf + 1] as usize;
                for &object in &self.built.objects[range] {
                    let [a, b, c] = self.parts.1[object as usize].map(|v| self.parts.0[v as usize]);
                    let (e1, e2, s) = (b - a, c - a, origin - a);
                    let p = direction.cross(e2);
                    let q = s.cross(e1);
                    let det = e1.dot(p);
                    let (u, v, t) = (s.dot(p) / det, direction.dot(q) / det, e2.dot(q) / det);
                    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < limit && left != Some(object) {
                        limit = t;
                        best = Some((t, object));
                        if any {
                            visits.hits += 1;
                            return best;
                        }
                    }
                }
                continue;
            }
            visits.nodes += 1;
            let node = &self.built.tree.nodes[at as usize];
            let mut met = Vec::new();
            for lane in 0..8 {
                let c = node.child(lane);
                if c == NONE {
                    continue;
                }
                let (mut near, mut far) = (0.0f64, limit);
                for axis in 0..3 {
                    let x = (f64::from(node.rows[2 * axis][lane]) - o[axis]) / d[axis];
                    let y = (f64::from(node.rows[2 * axis + 1][lane]) - o[axis]) / d[axis];
                    near = near.max(x.min(y));
                    far = far.min(x.max(y));
                }
                if near <= far {
                    met.push((c, near));
                }
            }
            if any {
                met.reverse();
            } else {
                met.sort_by(|a, b| b.1.total_cmp(&a.1));
            }
            stack.extend(met);
        }
        visits.hits += usize::from(best.is_some());
        best
    }
}

fn load(path: &str) -> Parts {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let mut file = std::io::BufReader::new(std::fs::File::open(path).expect("the mesh"));
    let (models, _) =
        tobj::load_obj_buf(&mut file, &options, |_: &std::path::Path| tobj::load_mtl_buf(&mut std::io::empty()))
            .expect("an OBJ");
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for m in models {
        let base = positions.len() as u32;
        positions.extend(m.mesh.positions.chunks_exact(3).map(DVec3::from_slice));
        triangles.extend(m.mesh.indices.chunks_exact(3).map(|t| [t[0] + base, t[1] + base, t[2] + base]));
    }
    (positions, triangles)
}

/// What this thread has had of a CPU, in nanoseconds: on a busy machine, unlike the clock, the same every time. Linux
/// only.
fn cpu_time() -> u64 {
    let schedule = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    schedule.split(' ').next().and_then(|ns| ns.parse().ok()).expect("nanoseconds")
}

fn on_one_thread(work: impl FnOnce() + Send) {
    #[cfg(feature = "rayon")]
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(work);
    #[cfg(not(feature = "rayon"))]
    work();
}

fn report(name: &str, parts: &Parts, rays: usize) {
    let corners = |i: usize| parts.1[i].map(|v| parts.0[v as usize]);
    let whole = Aabb::around(&parts.0);
    let frame = Frame::around(whole);
    let points: Vec<_> = parts.0.iter().map(|&p| frame.nearest(p)).collect();
    let bounds = |i: usize| {
        let [a, b, c] = parts.1[i].map(|v| points[v as usize]);
        FrameBox::around(a, b, c).widened()
    };
    let again = || build(parts.1.len(), frame, &bounds, 8, &Watch::nobody());
    let built = again().expect("nobody stops it");
    let mut least = f64::INFINITY;
    let times = 200_000 / parts.1.len() + 1;
    for _ in 0..8 {
        let start = cpu_time();
        for _ in 0..times {
            std::hint::black_box(again());
        }
        least = least.min((cpu_time() - start) as f64 / times as f64);
    }
    let traced = Traced { parts, built: &built };
    let (inner, leaves) = traced.cost();
    let n = parts.1.len() as f64;
    let (node_count, leaf_count) = (built.tree.nodes.len() as f64, (built.starts.len() - 1) as f64);
    let bytes = (256.0 * node_count + 352.0 * leaf_count) / n;
    let bounds = Aabb::around(&parts.0);
    let (center, radius) = (bounds.center(), 0.5 * bounds.size().length());
    let interior = ["sponza", "kitchen"].iter().any(|s| name.contains(s));
    let mut random = Random::new(1);
    let mut sets = [Visits::default(); 5];
    let mut points = Vec::new();
    let side = (rays as f64 / 4.0).sqrt() as usize;
    let count = 4 * side * side;
    for view in 0..4 {
        let turn = std::f64::consts::TAU * (f64::from(view) + 0.3) / 4.0;
        let size = bounds.size();
        let (eye, forward, half) = if interior {
            let ahead = DVec3::new(turn.cos(), -0.05, turn.sin());
            (center + DVec3::new(-0.1 * turn.cos() * size.x, 0.0, -0.1 * turn.sin() * size.z), ahead.normalize(), 0.8)
        } else {
            let from = DVec3::new(turn.cos(), 0.4, turn.sin()).normalize();
            (center + 2.2 * radius * from, -from, 0.42)
        };
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        for i in 0..side * side {
            let at = |p: usize| half * (2.0 * (p as f64 + 0.5) / side as f64 - 1.0);
            let d = forward + at(i % side) * right + at(i / side) * up;
            if let Some((t, object)) = traced.trace(eye, d, None, false, &mut sets[0]) {
                let [a, b, c] = corners(object as usize);
                let normal = (b - a).cross(c - a).normalize();
                let normal = if normal.dot(d) > 0.0 { -normal } else { normal };
                if normal.is_finite() {
                    points.push((eye + t * d, normal, object));
                }
            }
        }
    }
    for i in 0..count {
        let (p, normal, object) = points[i * points.len() / count];
        let d = normal + direction(&mut random);
        traced.trace(p, d, Some(object), false, &mut sets[1]);
        traced.trace(p, d, Some(object), true, &mut sets[3]);
        let at = center + 0.55 * DVec3::new(random.number(), random.number(), random.number()) * bounds.size();
        let d = direction(&mut random);
        traced.trace(at, d, None, false, &mut sets[2]);
        traced.trace(at, d, None, true, &mut sets[4]);
    }
    print!(
        "{name:<16} {:4.0} ns and {bytes:5.1} bytes a triangle, fill {:4.2} | SAH {inner:5.2} + {leaves:5.2}",
        least / n,
        n / leaf_count / 8.0
    );
    for v in sets {
        print!(" | {:5.2} {:4.2}", v.nodes as f64 / count as f64, v.leaves as f64 / count as f64);
    }
    println!();
    assert!(sets.iter().all(|v| v.hits > 0));
}

#[test]
#[ignore = "prints the quality of trees over the meshes named in TRUEHIT_MESHES (OBJ files, separated by colons)"]
fn quality() {
    let meshes = std::env::var("TRUEHIT_MESHES").expect("TRUEHIT_MESHES");
    println!("nodes and leaves visited: primary | bounce | random | bounce any | random any");
    for path in meshes.split(':') {
        let parts = load(path);
        let name = path.rsplit('/').next().unwrap_or(path).trim_end_matches(".obj").to_owned();
        on_one_thread(|| report(&name, &parts, 20_000));
    }
}
