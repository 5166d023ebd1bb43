//! Meshes for the tests of trees and meshes. Whoever includes this has `rng` of `tests/support` beside it.
#![allow(dead_code, unreachable_pub, reason = "each test uses some")]

use super::rng::Rng;
use glam::DVec3;
use std::collections::HashMap;
use truehit::glam;

pub type Parts = (Vec<DVec3>, Vec<[u32; 3]>);

/// A sphere of radius about 1: an icosahedron whose triangles are quartered `times` times.
pub fn icosphere(times: u32) -> Parts {
    let t = f64::midpoint(1.0, 5f64.sqrt());
    let mut positions: Vec<DVec3> = [
        [-1.0, t, 0.0],
        [1.0, t, 0.0],
        [-1.0, -t, 0.0],
        [1.0, -t, 0.0],
        [0.0, -1.0, t],
        [0.0, 1.0, t],
        [0.0, -1.0, -t],
        [0.0, 1.0, -t],
        [t, 0.0, -1.0],
        [t, 0.0, 1.0],
        [-t, 0.0, -1.0],
        [-t, 0.0, 1.0],
    ]
    .map(|p| DVec3::from(p).normalize())
    .to_vec();
    let mut triangles = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1u32],
    ];
    for _ in 0..times {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32, positions: &mut Vec<DVec3>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let ab = middle(a, b, &mut positions);
            let bc = middle(b, c, &mut positions);
            let ca = middle(c, a, &mut positions);
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (positions, triangles)
}

/// A torus of radii 1 and 0.3 with 2·n² triangles.
pub fn torus(n: u32) -> Parts {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let angle = |i: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
    for i in 0..n {
        for j in 0..n {
            let (u, v) = (angle(i), angle(j));
            let r = 1.0 + 0.3 * v.cos();
            positions.push(DVec3::new(r * u.cos(), r * u.sin(), 0.3 * v.sin()));
            let at = |i: u32, j: u32| (i % n) * n + j % n;
            let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
        }
    }
    (positions, triangles)
}

/// The unit cube [0, n]³ with every face an n × n grid of squares, integer coordinates, closed.
pub fn grid_cube(n: u32) -> Parts {
    let mut index = HashMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let mut at = |p: [u32; 3]| {
        *index.entry(p).or_insert_with(|| {
            positions.push(DVec3::from(p.map(f64::from)));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let mut corner = |di: u32, dj: u32| {
                        let mut p = [side; 3];
                        p[(axis + 1) % 3] = i + di;
                        p[(axis + 2) % 3] = j + dj;
                        at(p)
                    };
                    let q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                }
            }
        }
    }
    (positions, triangles)
}

/// Unconnected triangles of sizes from `size`·1e-3 to `size` in the unit cube.
pub fn soup(random: &mut Rng, n: usize, size: f64) -> Parts {
    let mut positions = Vec::new();
    for _ in 0..n {
        let at = random.in_cube(1.0);
        let size = size * 10f64.powf(-3.0 * random.fraction());
        for _ in 0..3 {
            positions.push(at + size * random.in_cube(1.0));
        }
    }
    (positions, (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// x ↦ scale·x + offset for every position.
pub fn moved((positions, triangles): Parts, scale: f64, offset: DVec3) -> Parts {
    (positions.into_iter().map(|p| scale * p + offset).collect(), triangles)
}
