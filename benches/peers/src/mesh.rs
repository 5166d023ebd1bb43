//! The meshes: OBJ files, and generated ones.

use ruzstd::decoding::StreamingDecoder;
use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::Path;

/// Triangles whose coordinates are floats of 24 bits, so that f32 and f64 engines hold the same mesh.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub name: String,
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Every edge has two sides: no ray gets out.
    pub closed: bool,
    /// Looked at from inside: buildings.
    pub interior: bool,
}

impl Mesh {
    /// From an OBJ file, or one packed by zstd. Vertices of equal position are one.
    pub fn load(path: &Path) -> Result<Self, String> {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = std::fs::File::open(path).map_err(|e| fail(&e))?;
        let mut text = Vec::new();
        if path.extension().is_some_and(|e| e == "zst") {
            let mut decoder = StreamingDecoder::new(BufReader::new(file)).map_err(|e| fail(&e))?;
            decoder.read_to_end(&mut text).map_err(|e| fail(&e))?;
        } else {
            BufReader::new(file).read_to_end(&mut text).map_err(|e| fail(&e))?;
        }
        let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
        let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
        let (models, _) = tobj::load_obj_buf(&mut text.as_slice(), &options, no_materials).map_err(|e| fail(&e))?;
        let (mut corners, mut indices) = (Vec::new(), Vec::new());
        for model in models {
            let base = corners.len() as u32;
            corners.extend(model.mesh.positions.chunks_exact(3).map(|p| [p[0] as f32, p[1] as f32, p[2] as f32]));
            indices.extend(model.mesh.indices.chunks_exact(3).map(|t| [t[0] + base, t[1] + base, t[2] + base]));
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = name.trim_end_matches(".zst").trim_end_matches(".obj");
        Ok(Self::new(name, &corners, &indices))
    }

    /// Welds equal positions, drops triangles with two equal corners, and finds out what it is.
    pub fn new(name: &str, corners: &[[f32; 3]], indices: &[[u32; 3]]) -> Self {
        let (mut positions, mut at) = (Vec::new(), HashMap::new());
        let merged: Vec<u32> = corners
            .iter()
            .map(|&p| {
                // + 0: −0 and 0 are one position.
                *at.entry(p.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                    positions.push(p);
                    positions.len() as u32 - 1
                })
            })
            .collect();
        let triangles: Vec<[u32; 3]> = indices
            .iter()
            .map(|t| t.map(|i| merged[i as usize]))
            .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
            .collect();
        let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
        for t in &triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let odd = edges.values().filter(|&&n| n % 2 == 1).count();
        let mut mesh = Self { name: name.to_owned(), positions, triangles, closed: odd == 0, interior: false };
        // A building is a heap of open sheets, and looks out nowhere from its middle.
        mesh.interior = odd * 20 > edges.len() && crate::rays::seen_from_the_middle(&mesh) > 0.9;
        mesh
    }

    pub fn corner(&self, triangle: u32, i: usize) -> [f32; 3] {
        self.positions[self.triangles[triangle as usize][i] as usize]
    }

    /// Least and greatest coordinates.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        self.positions.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(lo, hi), p| {
            (std::array::from_fn(|i| lo[i].min(p[i])), std::array::from_fn(|i| hi[i].max(p[i])))
        })
    }

    /// An icosahedron's faces split until there are about `triangles`, pushed out to a sphere with bumps, so that rays
    /// that leave it meet it again; closed.
    pub fn bumpy_sphere(triangles: usize) -> Self {
        // n² faces for each of the twenty.
        let n = ((triangles as f64 / 20.0).sqrt().round() as u32).max(1);
        let g = f64::midpoint(1.0, 5f64.sqrt());
        let corners: Vec<[f64; 3]> = (0..12)
            .map(|i| {
                let (a, b) = (if i & 1 == 0 { 1.0 } else { -1.0 }, if i & 2 == 0 { g } else { -g });
                [[0.0, a, b], [a, b, 0.0], [b, 0.0, a]][i / 4]
            })
            .collect();
        let distance = |i: usize, j: usize| (0..3).map(|k| (corners[i][k] - corners[j][k]).powi(2)).sum::<f64>();
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for i in 0..12 {
            for j in i + 1..12 {
                for k in j + 1..12 {
                    if distance(i, j) > 4.1 || distance(j, k) > 4.1 || distance(i, k) > 4.1 {
                        continue;
                    }
                    let base = positions.len() as u32;
                    // Rows of the face, from corner i down. Symmetric in the corners, so that neighbouring faces
                    // compute the same bits on their common edge.
                    for row in 0..=n {
                        for column in 0..=row {
                            let weights = [n - row, row - column, column].map(|w| f64::from(w) / f64::from(n));
                            let p: [f64; 3] = std::array::from_fn(|c| {
                                let mut terms = [
                                    weights[0] * corners[i][c],
                                    weights[1] * corners[j][c],
                                    weights[2] * corners[k][c],
                                ];
                                terms.sort_by(f64::total_cmp);
                                terms[0] + terms[1] + terms[2]
                            });
                            let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
                            let p = p.map(|x| x / length);
                            let bump = (9.0 * p[0]).sin() * (11.0 * p[1]).sin() * (10.0 * p[2] + 1.0).sin();
                            positions.push(p.map(|x| (x * (1.0 + 0.35 * bump)) as f32));
                        }
                    }
                    let at = |row: u32, column: u32| base + row * (row + 1) / 2 + column;
                    for row in 0..n {
                        for column in 0..=row {
                            indices.push([at(row, column), at(row + 1, column), at(row + 1, column + 1)]);
                            if column < row {
                                indices.push([at(row, column), at(row + 1, column + 1), at(row, column + 1)]);
                            }
                        }
                    }
                }
            }
        }
        Self::new("bumpy sphere", &positions, &indices)
    }

    /// Hills over a square grid; open.
    pub fn terrain(triangles: usize) -> Self {
        let n = ((triangles as f64 / 2.0).sqrt().round() as usize).max(2);
        let height = |x: f64, y: f64| {
            (0..6).fold(0.0, |h, octave| {
                let f = f64::from(1 << octave);
                h + (1.7 * f * x + 0.3 * f).sin() * (2.3 * f * y + 1.1 * f * f * x).cos() / f
            })
        };
        let grid = |i: usize, j: usize| (i * (n + 1) + j) as u32;
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for i in 0..=n {
            for j in 0..=n {
                let (x, y) = (4.0 * i as f64 / n as f64, 4.0 * j as f64 / n as f64);
                positions.push([x as f32, y as f32, 0.3 * height(x, y) as f32]);
                if i < n && j < n {
                    indices.push([grid(i, j), grid(i + 1, j), grid(i + 1, j + 1)]);
                    indices.push([grid(i, j), grid(i + 1, j + 1), grid(i, j + 1)]);
                }
            }
        }
        Self::new("terrain", &positions, &indices)
    }

    /// A tube along the (2, 3) torus knot; closed.
    pub fn knot(triangles: usize) -> Self {
        let around = ((triangles as f64 / 24.0).sqrt().round() as usize).max(3);
        let along = (triangles / (2 * around)).max(3);
        let centre = |t: f64| {
            let r = 2.0 + (3.0 * t).cos();
            [r * (2.0 * t).cos(), r * (2.0 * t).sin(), (3.0 * t).sin()]
        };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let unit = |a: [f64; 3]| {
            let l = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
            a.map(|x| x / l)
        };
        let at = |i: usize, j: usize| ((i % along) * around + j % around) as u32;
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for i in 0..along {
            let t = std::f64::consts::TAU * i as f64 / along as f64;
            let (p, q) = (centre(t), centre(t + 1e-3));
            let tangent: [f64; 3] = std::array::from_fn(|c| q[c] - p[c]);
            let side = unit(cross(tangent, std::array::from_fn(|c| p[c] + q[c])));
            let up = unit(cross(side, tangent));
            for j in 0..around {
                let (sin, cos) = (std::f64::consts::TAU * j as f64 / around as f64).sin_cos();
                positions.push(std::array::from_fn(|c| (p[c] + 0.4 * (cos * side[c] + sin * up[c])) as f32));
                indices.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                indices.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        Self::new("knot", &positions, &indices)
    }
}
