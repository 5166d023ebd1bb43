use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::Rng;
use truehit::Interval;
use truehit::glam::DVec3;

const fn family(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Mesh, number, name, generate)
}

pub const FAMILIES: &[Family] = &[
    family(0, "ordinary", |rng, _| {
        let m = ball(rng, DVec3::ZERO);
        let (target, distance) = (rng.in_cube(1.2), rng.uniform(2.0, 9.0));
        super::towards(rng, target, distance, m.solid())
    }),
    family(31, "exactly at a point of a shared edge", |rng, i| {
        let m = ball(rng, DVec3::ZERO);
        let t = m.triangles[rng.below(m.triangles.len() as u64) as usize];
        let (a, b) = (m.positions[t[i % 3] as usize], m.positions[t[(i + 1) % 3] as usize]);
        let target = a + (b - a) * rng.pick(&[0.25, 0.5, 0.75]);
        super::exactly_towards(rng, target, m.solid())
    }),
    family(33, "exactly at a vertex of valence 3..12", |rng, _| {
        let m = fan(rng);
        super::exactly_towards(rng, m.positions[0], m.solid())
    }),
    family(34, "silhouette edge", |rng, i| {
        let m = ball(rng, DVec3::ZERO);
        let t = m.triangles[rng.below(m.triangles.len() as u64) as usize];
        let (a, b) = (m.positions[t[i % 3] as usize], m.positions[t[(i + 1) % 3] as usize]);
        let target = a + (b - a) * rng.pick(&[0.0, 0.25, 0.5]);
        // Along the surface: perpendicular to the point's own direction.
        let u = rng.across(target);
        Case::new(target - u * 3.0, u * rng.length(), m.solid())
    }),
    family(35, "T-junction, exact", |rng, _| {
        let m = junction(rng, 0.5);
        let target = m.positions[0].lerp(m.positions[1], rng.pick(&[0.25, 0.5, 0.75]));
        super::exactly_towards(rng, target, m.solid())
    }),
    family(36, "T-junction whose middle is rounded", |rng, i| {
        let t = rng.uniform(0.3, 0.7);
        let m = junction(rng, t);
        let along = m.positions[0].lerp(m.positions[1], rng.uniform(0.0, 1.0));
        // At the edge, or from so near the middle that rays tell points of the crack apart.
        let (target, distance) =
            if i.is_multiple_of(2) { (along, rng.log(0.5, 1e3)) } else { (m.positions[4], rng.log(1e-4, 1e-2)) };
        super::towards(rng, target, distance, m.solid())
    }),
    family(38, "integer grid, axis-parallel rays", |rng, _| {
        let m = grid();
        let o = DVec3::new(rng.integer(-1, 9) as f64, rng.integer(-1, 9) as f64, 5.0) * 0.5;
        Case::new(o, -DVec3::Z * rng.length(), m.solid())
    }),
    family(39, "sphere mesh at (148376, 1234, −223423), at its vertices", |rng, _| {
        let m = ball(rng, DVec3::new(148_376.0, 1234.0, -223_423.0));
        let target = m.positions[rng.below(m.positions.len() as u64) as usize];
        let distance = rng.log(1.0, 1e6);
        super::towards(rng, target, distance, m.solid())
    }),
    family(76, "coincident triangles: the lowest index", |rng, i| {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.25, 0.25, 0.0)];
        let triangles = if i.is_multiple_of(2) {
            vec![[2, 1, 3], [0, 1, 2], [1, 2, 0], [0, 2, 1]]
        } else {
            vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 2]]
        };
        let m = Mesh { positions: p.map(|v| v * 4.0).to_vec(), triangles };
        let target = DVec3::new(rng.eighths(4).abs(), rng.eighths(4).abs(), 0.0);
        super::exactly_towards(rng, target, m.solid())
    }),
    family(81, "identical centroids", |rng, _| {
        let m = soup(40, |_| {
            let (u, v) = (rng.small(3), rng.small(3));
            [u, v, -(u + v)]
        });
        let target = rng.small(1);
        super::exactly_towards(rng, target, m.solid())
    }),
    family(82, "needles in boxes of aspect 1e9", |rng, i| {
        let stretch = [DVec3::new(1e9, 1.0, 1.0), DVec3::new(1.0, 1.0, 1e-9), DVec3::ONE][i % 3];
        let m = soup(40, |_| {
            let (a, u, v) = (rng.in_cube(3.0), rng.unit(), rng.unit());
            // Long in space, or by the stretch.
            [a, a + u, a + if i % 3 == 2 { u * 0.5 + v * 1e-9 } else { v }].map(|p| p * stretch)
        });
        let t = m.triangles[rng.below(40) as usize].map(|k| m.positions[k as usize]);
        let (a, b) = (rng.uniform(0.0, 0.6), rng.uniform(0.0, 0.6));
        let target = t[0] + (t[1] - t[0]) * a + (t[2] - t[0]) * b;
        let o = target - rng.unit() * stretch * rng.uniform(1.0, 5.0);
        Case::new(o, (target - o) * rng.length(), m.solid())
    }),
    family(87, "each half of the one before: a deep tree", |rng, _| {
        let m = soup(60, |k| [DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * 0.5f64.powi(k as i32)));
        let scale = 0.5f64.powi(rng.integer(0, 62) as i32);
        let origin = DVec3::new(rng.eighths(2).abs(), rng.eighths(2).abs(), rng.eighths(2).abs()) * scale;
        let direction = if rng.chance(0.5) { DVec3::splat(rng.sign()) } else { rng.unit() };
        Case::new(origin, direction, m.solid())
    }),
    family(53, "origin on a vertex or an edge", |rng, i| {
        let m = ball(rng, DVec3::ZERO);
        let t = m.triangles[rng.below(m.triangles.len() as u64) as usize];
        let (a, b) = (m.positions[t[i % 3] as usize], m.positions[t[(i + 1) % 3] as usize]);
        let origin = if i.is_multiple_of(2) { a } else { a + (b - a) * 0.5 };
        let within = if rng.chance(0.5) { Interval::FORWARD } else { Interval::LINE };
        Case { within, ..Case::new(origin, rng.unit() * rng.length(), m.solid()) }
    }),
];

struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn solid(&self) -> Solid {
        Solid::Mesh { positions: self.positions.clone(), triangles: self.triangles.clone() }
    }
}

/// `n` triangles that share nothing.
fn soup(n: u32, triangle: impl FnMut(u32) -> [DVec3; 3]) -> Mesh {
    let positions = (0..n).flat_map(triangle).collect();
    Mesh { positions, triangles: (0..n).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect() }
}

/// A closed octahedron, each face split in four: 18 vertices, 32 faces, coordinates of few bits (about the origin).
fn ball(rng: &mut Rng, center: DVec3) -> Mesh {
    let corner = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
    let mut positions: Vec<DVec3> = corner.map(|c| center + c).to_vec();
    let mut middle = std::collections::HashMap::new();
    let mut triangles = Vec::new();
    let bulge = rng.pick(&[0.5, 0.625, 0.75]);
    for (x, y, z) in [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)] {
        let mut mid = |a: usize, b: usize| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(center + (corner[a] + corner[b]) * bulge);
                positions.len() as u32 - 1
            })
        };
        let (xy, yz, zx) = (mid(x, y), mid(y, z), mid(z, x));
        let (x, y, z) = (x as u32, y as u32, z as u32);
        triangles.extend([[x, xy, zx], [y, yz, xy], [z, zx, yz], [xy, yz, zx]]);
    }
    Mesh { positions, triangles }
}

/// A closed fan of 3 to 12 triangles around vertex 0.
fn fan(rng: &mut Rng) -> Mesh {
    let n = rng.integer(3, 12) as u32;
    let center = rng.small(4);
    let mut positions = vec![center];
    for k in 0..n {
        let a = f64::from(k) * std::f64::consts::TAU / f64::from(n);
        let p = DVec3::new(a.cos(), a.sin(), rng.uniform(-0.5, 0.5)) * rng.uniform(0.5, 2.0);
        positions.push(center + (p * 64.0).round() / 64.0);
    }
    Mesh { positions, triangles: (0..n).map(|k| [0, 1 + k, 1 + (k + 1) % n]).collect() }
}

/// One triangle on one side of an edge, two on the other that share a vertex on it.
fn junction(rng: &mut Rng, t: f64) -> Mesh {
    let (a, b) = (rng.small(3), rng.small(3) + DVec3::X * 8.0);
    let (up, down) = (a + DVec3::new(2.0, 4.0, 1.0), a + DVec3::new(3.0, -4.0, -1.0));
    Mesh { positions: vec![a, b, up, down, a + (b - a) * t], triangles: vec![[0, 1, 2], [0, 3, 4], [4, 3, 1]] }
}

/// [0, 4]² in unit squares.
fn grid() -> Mesh {
    let positions = (0..25).map(|k| DVec3::new(f64::from(k % 5), f64::from(k / 5), 0.0)).collect();
    let mut triangles = Vec::new();
    for y in 0..4 {
        for x in 0..4 {
            let k = 5 * y + x;
            triangles.extend([[k, k + 1, k + 6], [k, k + 6, k + 5]]);
        }
    }
    Mesh { positions, triangles }
}
