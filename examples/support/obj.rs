//! Wavefront OBJ → one indexed mesh, smooth where its faces meet at shallow angles.

use std::collections::HashMap;
use std::fs;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use truehit::glam::{DVec2, DVec3};

/// What `Mesh::new`, `.with_normals` and `.with_uvs` take.
#[derive(Debug, Default)]
pub(crate) struct Obj {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) normals: Vec<DVec3>,
    /// Empty if a face has none.
    pub(crate) uvs: Vec<DVec2>,
}

/// Faces that meet at a sharper angle keep their edge.
const CREASE: f64 = 40.0;

/// Reads `path`. Polygons are cut into fans; normals and texture coordinates are taken from the file where every
/// corner has them. An error names the line.
pub(crate) fn load(path: &Path) -> Result<Obj, String> {
    let name = path.display();
    let file = fs::File::open(path).map_err(|error| format!("cannot read {name}: {error}"))?;
    let mut reader = LineCounter { inner: BufReader::new(file), lines: 0, mid_line: false, failed: None };
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    // Materials are not used; a missing library is no error.
    let loaded = tobj::load_obj_buf(&mut reader, &options, |_| tobj::load_mtl_buf(&mut io::empty()));
    let (models, _) = loaded.map_err(|error| {
        if let Some(failure) = reader.failed.take() {
            return format!("cannot read {name}: {failure}");
        }
        // tobj looks faces' indices up at the end of their group, so those are searched for.
        let line = out_of_range(path).unwrap_or(reader.lines + usize::from(reader.mid_line));
        format!("{name}, line {line}: {error}")
    })?;
    let mut corners = Corners::default();
    for model in models {
        corners.add(&model.mesh);
    }
    if corners.positions.is_empty() {
        return Err(format!("{name}: no faces"));
    }
    if let Some(line) = not_finite(path) {
        return Err(format!("{name}, line {line}: a coordinate is not a finite number"));
    }
    Ok(corners.indexed())
}

/// Three in a row make a triangle.
#[derive(Default)]
struct Corners {
    positions: Vec<DVec3>,
    normals: Vec<Option<DVec3>>,
    uvs: Vec<Option<DVec2>>,
}

impl Corners {
    fn add(&mut self, mesh: &tobj::Mesh) {
        let vector = |values: &[f64], i: u32| DVec3::from_slice(&values[3 * i as usize..]);
        for (corner, &position) in mesh.indices.iter().enumerate() {
            self.positions.push(vector(&mesh.positions, position));
            let normal = mesh.normal_indices.get(corner).map(|&i| vector(&mesh.normals, i));
            self.normals.push(normal.and_then(DVec3::try_normalize));
            let uv = mesh.texcoord_indices.get(corner).map(|&i| DVec2::from_slice(&mesh.texcoords[2 * i as usize..]));
            self.uvs.push(uv);
        }
    }

    /// Corners that agree in everything become one vertex.
    fn indexed(self) -> Obj {
        let normals = match self.normals.iter().copied().collect::<Option<Vec<_>>>() {
            Some(given) => given,
            None => smooth(&self.positions),
        };
        let uvs = self.uvs.iter().copied().collect::<Option<Vec<_>>>();
        let mut obj = Obj::default();
        let mut known = HashMap::new();
        let mut indices = Vec::with_capacity(self.positions.len());
        for (corner, &position) in self.positions.iter().enumerate() {
            let uv = uvs.as_ref().map_or(DVec2::ZERO, |uvs| uvs[corner]);
            let key = (bits(position), bits(normals[corner]), bits(uv.extend(0.0)));
            let index = *known.entry(key).or_insert_with(|| {
                obj.positions.push(position);
                obj.normals.push(normals[corner]);
                if uvs.is_some() {
                    obj.uvs.push(uv);
                }
                obj.positions.len() as u32 - 1
            });
            indices.push(index);
        }
        obj.triangles = indices.as_chunks::<3>().0.to_vec();
        obj
    }
}

/// For each corner the mean normal of the faces around its vertex that lie within the crease angle of its own,
/// weighted by their angles there.
fn smooth(positions: &[DVec3]) -> Vec<DVec3> {
    let triangles = positions.as_chunks::<3>().0;
    let faces: Vec<DVec3> =
        triangles.iter().map(|[a, b, c]| (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO)).collect();
    let mut around: HashMap<[u64; 3], Vec<(DVec3, f64)>> = HashMap::new();
    for (triangle, &face) in triangles.iter().zip(&faces) {
        for i in 0..3 {
            let [apex, next, last] = [0, 1, 2].map(|k| triangle[(i + k) % 3]);
            let angle = (next - apex).angle_between(last - apex);
            if angle > 0.0 {
                around.entry(bits(apex)).or_default().push((face, angle));
            }
        }
    }
    let limit = CREASE.to_radians().cos();
    let corner_normal = |(corner, position): (usize, &DVec3)| {
        let own = faces[corner / 3];
        let near = around.get(&bits(*position)).into_iter().flatten().filter(|(face, _)| face.dot(own) >= limit);
        let sum: DVec3 = near.map(|&(face, angle)| angle * face).sum();
        sum.try_normalize().or(own.try_normalize()).unwrap_or(DVec3::Z)
    };
    positions.iter().enumerate().map(corner_normal).collect()
}

/// −0 and 0 are one place.
fn bits(v: DVec3) -> [u64; 3] {
    v.to_array().map(|x| (x + 0.0).to_bits())
}

/// The first line with a face that names an element the file does not have.
fn out_of_range(path: &Path) -> Option<usize> {
    let text = fs::read_to_string(path).ok()?;
    let mut counts = [0_i64; 3];
    let element = |line: &str| ["v", "vt", "vn"].iter().position(|&kind| line.split_whitespace().next() == Some(kind));
    let mut totals = [0_i64; 3];
    text.lines().filter_map(element).for_each(|kind| totals[kind] += 1);
    for (number, line) in text.lines().enumerate() {
        if let Some(kind) = element(line) {
            counts[kind] += 1;
        }
        let Some(corners) = line.trim_start().strip_prefix("f ") else { continue };
        let exists = |kind: usize, text: &str| match text.parse::<i64>() {
            Ok(index) => (1..=totals[kind]).contains(&if index < 0 { counts[kind] + 1 + index } else { index }),
            Err(_) => text.is_empty(),
        };
        if corners.split_whitespace().any(|corner| !corner.split('/').enumerate().all(|(k, i)| k < 3 && exists(k, i))) {
            return Some(number + 1);
        }
    }
    None
}

/// The first line with a coordinate that is infinite or not a number.
fn not_finite(path: &Path) -> Option<usize> {
    let lines = BufReader::new(fs::File::open(path).ok()?).lines();
    let bad = |line: io::Result<String>| {
        line.is_ok_and(|line| {
            line.trim_start().starts_with('v')
                && line.split_whitespace().skip(1).any(|x| x.parse::<f64>().is_ok_and(|x| !x.is_finite()))
        })
    };
    lines.map(bad).position(|bad| bad).map(|index| index + 1)
}

/// Counts the lines that its reader has taken.
struct LineCounter<R> {
    inner: R,
    lines: usize,
    mid_line: bool,
    /// What tobj reports as "read error".
    failed: Option<io::Error>,
}

impl<R: BufRead> Read for LineCounter<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let taken = self.fill_buf()?.read(buffer)?;
        self.consume(taken);
        Ok(taken)
    }
}

impl<R: BufRead> BufRead for LineCounter<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.inner.fill_buf().inspect_err(|error| self.failed = Some(error.kind().into()))
    }

    fn consume(&mut self, amount: usize) {
        if let Ok(taken) = self.inner.fill_buf() {
            let taken = &taken[..amount];
            self.lines += taken.split(|&byte| byte == b'\n').count() - 1;
            if let Some(&last) = taken.last() {
                self.mid_line = last != b'\n';
            }
        }
        self.inner.consume(amount);
    }
}
