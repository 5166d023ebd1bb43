//! The tree over a mesh's triangles, and its leaves.

use super::leaf::{Leaf, PLAIN, ROTATION, Vec8, load, minus};
use crate::Aabb;
use crate::bvh::{self, E, Frame, FrameBox, Level, Wide};
use crate::kernel::float::power;
use fearless_simd::{Simd, dispatch, f32x8, mask32x8, prelude::*, u32x8};
use glam::{DVec3, Vec4};

pub(super) struct Built {
    pub(super) tree: Wide,
    pub(super) leaves: Vec<Leaf>,
    /// The leaves hold the vertices themselves, not rounded ones.
    pub(super) exact: bool,
    /// Around all triangles.
    pub(super) bounds: Aabb,
}

/// `None` if `watch` has stopped it. Each position is moved into the frame once, whatever the number of its triangles.
pub(super) fn build(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    used: &[bool],
    level: Level,
    watch: &bvh::Watch,
) -> Option<Built> {
    let bounds = positions.iter().zip(used).filter(|(_, used)| **used).fold(Aabb::EMPTY, |b, (&p, _)| grown(b, p));
    let frame = Frame::around(bounds);
    let points = bvh::map(positions.len(), |i| {
        let point = frame.nearest(positions[i]);
        // The fourth coordinate says whether it is another point.
        let changed = frame.world(point.truncate().as_dvec3()) != positions[i];
        point.with_w(f32::from(u8::from(changed)))
    });
    let exact = points.iter().all(|p| p.w == 0.0);
    // The frame's own subtraction may round.
    let wide = !exact || frame.center != DVec3::ZERO;
    let boxes = |i: usize| {
        let t = &triangles[i];
        // A triangle of two points is never hit.
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            return FrameBox::EMPTY;
        }
        let [a, b, c] = t.map(|v| points[v as usize]);
        let b = FrameBox::around(a, b, c);
        if wide { b.widened() } else { b }
    };
    let built = bvh::build(triangles.len(), frame, &boxes, 8, watch)?;
    let corners = Corners { frame, positions, points: &points, triangles, exact };
    let count = built.starts.len() - 1;
    watch.phase(1.0, count);
    let leaves = bvh::map(count, |i| {
        let numbers = &built.objects[built.starts[i] as usize..built.starts[i + 1] as usize];
        if i % 1024 == 1023 {
            watch.add(1024);
        }
        dispatch!(level.token(), simd => corners.leaf(simd, numbers))
    });
    watch.add(count);
    (!watch.stopped()).then_some(Built { tree: built.tree, leaves, exact, bounds })
}

fn grown(b: Aabb, p: DVec3) -> Aabb {
    b.union(Aabb { min: p, max: p })
}

const EMPTY: Leaf = Leaf { vertices: [[[0.0; 8]; 3]; 3], size: [-1.0; 8], id: [0; 8] };

/// What leaves are made of. `points` are the positions in the frame.
struct Corners<'a> {
    frame: Frame,
    positions: &'a [DVec3],
    points: &'a [Vec4],
    triangles: &'a [[u32; 3]],
    exact: bool,
}

impl Corners<'_> {
    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, numbers: &[u32]) -> Leaf {
        let mut leaf = EMPTY;
        // No triangle's size is more, or less.
        let mut most = [-1.0; 8];
        for (lane, &number) in numbers.iter().enumerate().take(8) {
            for (rows, v) in leaf.vertices.iter_mut().zip(self.triangles[number as usize]) {
                let [x, y, z, _] = self.points[v as usize].to_array();
                (rows[0][lane], rows[1][lane], rows[2][lane]) = (x, y, z);
            }
            leaf.id[lane] = number;
            most[lane] = f32::INFINITY;
        }
        let [a, b, c] = [load(simd, &leaf.vertices[0]), load(simd, &leaf.vertices[1]), load(simd, &leaf.vertices[2])];
        let (of_a, of_b, of_c) = (square(minus(c, b)), square(minus(a, c)), square(minus(b, a)));
        // Which vertex comes first: b, c, or else a.
        let last = of_c.simd_gt(of_a.max(of_b));
        let middle = of_b.simd_gt(of_a) & !last;
        let pick = |p: f32x8<S>, q: f32x8<S>, r: f32x8<S>| last.select(r, middle.select(q, p));
        for i in 0..3 {
            leaf.vertices[0][i] = pick(a[i], b[i], c[i]).into();
            leaf.vertices[1][i] = pick(b[i], c[i], a[i]).into();
            leaf.vertices[2][i] = pick(c[i], a[i], b[i]).into();
        }
        let turned = |places: u32| u32x8::splat(simd, places << ROTATION);
        let id: u32x8<S> = leaf.id.simd_into(simd);
        leaf.id = (id | last.select(turned(2), middle.select(turned(1), turned(0)))).into();
        let lengths = if self.exact {
            let id: u32x8<S> = leaf.id.simd_into(simd);
            leaf.id = (id | is_short(simd, [a, b, c]).select(u32x8::splat(simd, PLAIN), turned(0))).into();
            pick(of_b, of_c, of_a).sqrt() + pick(of_c, of_a, of_b).sqrt()
        } else {
            self.edges(&mut leaf, numbers);
            square(load(simd, &leaf.vertices[1])).sqrt() + square(load(simd, &leaf.vertices[2])).sqrt()
        };
        // Differences, squares, sums, roots, the last sum and these two: less than 8 roundings; and squares that
        // underflow, here and in the filter, which relies on it (docs/numerics.md §10).
        let size = lengths * f32x8::splat(simd, 1.0 + 16.0 * E) + f32x8::splat(simd, 2e-22);
        let most: f32x8<S> = most.simd_into(simd);
        leaf.size = size.min(most).into();
        leaf
    }

    /// Instead of v₁ and v₂.
    #[inline(always)]
    fn edges(&self, leaf: &mut Leaf, numbers: &[u32]) {
        for (lane, &number) in numbers.iter().enumerate().take(8) {
            let [a, b, c] = self.triangles[number as usize].map(|v| self.positions[v as usize]);
            let [a, b, c] = match leaf.id[lane] >> ROTATION {
                0 => [a, b, c],
                1 => [b, c, a],
                _ => [c, a, b],
            };
            for (rows, v) in leaf.vertices[1..].iter_mut().zip([b, c]) {
                let e = self.frame.local_difference(v, a);
                for i in 0..3 {
                    rows[i][lane] = e[i] as f32;
                }
            }
        }
    }
}

/// Whether all coordinates are multiples of 2⁻⁵², as those of f32 are that do not lie between 0 and 2⁻²⁹. They are at
/// most 1, so that no difference needs more than the 53 bits of f64: it is exact, here and out of the frame.
#[inline(always)]
fn is_short<S: Simd>(simd: S, vertices: [[f32x8<S>; 3]; 3]) -> mask32x8<S> {
    let (zero, least) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, power(-29) as f32));
    let mut long = zero.simd_lt(zero);
    for x in vertices.as_flattened() {
        long |= x.abs().simd_lt(least) & x.abs().simd_gt(zero);
    }
    !long
}

#[inline(always)]
fn square<S: Simd>(a: Vec8<S>) -> f32x8<S> {
    a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
}

#[cfg(test)]
mod tests {
    use super::super::Mesh;
    use crate::kernel::search::Random;
    use crate::kernel::triangle::has_plain_edges;
    use glam::DVec3;

    /// From coordinates of all sizes, near the origin and far from it.
    #[test]
    fn leaves_know_plain_edges() {
        let mut random = Random::new(3);
        let mut number = || f64::from(random.number() as f32);
        let (mut plain, mut other) = (0, 0);
        for (scale, center) in [(1.0, 0.0), (1e-3, 0.0), (1e30, 0.0), (1e-38, 0.0), (1.0, 4096.0)] {
            let mut coordinate = || {
                let fine = if number() > 0.9 { f64::powi(2.0, (30.0 * number()) as i32 - 30) } else { 1.0 };
                f64::from((center + scale * fine * number()) as f32)
            };
            let positions: Vec<DVec3> =
                (0..3000).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
            let triangles = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mesh = Mesh::new(positions, triangles).unwrap();
            assert!(mesh.exact, "{scale} about {center}");
            for leaf in &mesh.leaves {
                for lane in (0..8).filter(|&lane| leaf.size[lane] >= 0.0) {
                    let floats = has_plain_edges(&mesh.vertices(leaf.number(lane)));
                    assert!(floats || !leaf.has_plain_edges(lane));
                    plain += usize::from(leaf.has_plain_edges(lane));
                    other += usize::from(!floats);
                }
            }
        }
        println!("{plain} triangles known to have plain edges, {other} that have not");
        assert!(plain > 2000 && other > 300);
    }
}
