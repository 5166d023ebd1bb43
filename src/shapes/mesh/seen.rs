//! Eight triangles seen from one place: what rays from there have in common.
//!
//! Edge functions, denominator and numerator of t are linear in the direction, with coefficients that are the same for all rays:
//! U = (e₂ × C)·d, V = (C × e₁)·d, det = (e₁ × e₂)·d. The bounds on their errors are those of the filter: docs/numerics.md §10.

use super::leaf::{Margins, OfEight, Sides, Sighting, Triangles, Vec8, Verdict, cross, dot, minus, splat, three};
use crate::bvh::{Bundle, E, Sixteen};
use fearless_simd::{Simd, f32x8, f32x16, mask32x16, prelude::*};

/// Whence, and whither.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    place: [f32; 3],
    /// All directions lie within `half` of `middle`.
    middle: [f32; 3],
    half: [f32; 3],
}

impl View {
    /// `None` if the rays do not start at one place.
    #[inline(always)]
    pub(super) fn of(bundle: &Bundle) -> Option<Self> {
        let (place, [low, high]) = (bundle.place?, bundle.directions);
        let [mut middle, mut half] = [[0.0; 3]; 2];
        for axis in 0..3 {
            let (low, high) = (low[axis], high[axis]);
            middle[axis] = 0.5 * low + 0.5 * high;
            let (below, above) = (middle[axis] - low, high - middle[axis]);
            half[axis] = (if above > below { above } else { below }) * (1.0 + 4.0 * E);
        }
        Some(Self { place, middle, half })
    }
}

/// Triangles by lane: coefficients of the direction, t's numerator, and margins.
pub(super) struct Seen<S: Simd> {
    u: Vec8<S>,
    v: Vec8<S>,
    det: Vec8<S>,
    t: f32x8<S>,
    edges: f32x8<S>,
    of_depth: (f32x8<S>, f32x8<S>),
}

/// The margin of a test of all directions at once, against that of one: it loses 14 roundings of |e||r||d| where that loses 12.
const OF_ALL: f32 = 1.25;

impl<S: Simd> Seen<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, triangles: &Triangles<S>, view: &View, margins: &Margins) -> Self {
        let &Triangles { v0, e1, e2, size } = triangles;
        let c = minus(v0, three(simd, view.place));
        let n = cross(e1, e2);
        let (edges, of_depth) = (margins.edges(simd, size), margins.depth(simd, size, c, n));
        Self { u: cross(e2, c), v: cross(c, e1), det: n, t: dot(n, c), edges, of_depth }
    }

    /// The lanes whose triangles may be met by one of the rays.
    #[inline(always)]
    pub(super) fn lanes(&self, simd: S, view: &View) -> u32 {
        let (middle, half) = (three(simd, view.middle), three(simd, view.half));
        let [u_low, u_high] = ends(self.u, middle, half);
        let [v_low, v_high] = ends(self.v, middle, half);
        let [w_low, w_high] = ends(minus(minus(self.det, self.u), self.v), middle, half);
        let [det_low, det_high] = ends(self.det, middle, half);
        // Certainly missed by all: the denominator, or one edge function, is above zero for all and another below. The four are
        // of one sign where a triangle is hit.
        let (most, least) = (u_low.max(v_low).max(w_low), u_high.min(v_high).min(w_high));
        let margin = self.edges * splat(simd, OF_ALL);
        let (below, above) = (least.simd_lt(-margin), most.simd_gt(margin));
        let missed = (below & most.max(det_low).simd_gt(margin)) | (above & least.min(det_high).simd_lt(-margin));
        !(missed.to_bitmask() as u32) & 0xff
    }

    /// The triangle of a lane against sixteen rays.
    #[inline(always)]
    pub(super) fn triangle(&self, simd: S, lane: usize, rays: &Sixteen) -> Sighting<f32x16<S>, mask32x16<S>> {
        let d =
            [rays.direction[0].simd_into(simd), rays.direction[1].simd_into(simd), rays.direction[2].simd_into(simd)];
        let [u, v, det] = [&self.u, &self.v, &self.det];
        let [u, v, det] = [dot(of(simd, u, lane), d), dot(of(simd, v, lane), d), dot(of(simd, det, lane), d)];
        let everywhere = |x: &f32x8<S>| f32x16::splat(simd, x[lane & 7]);
        Sides::new([u, v], det, everywhere(&self.edges)).depths(
            simd,
            [everywhere(&self.t), det],
            (everywhere(&self.of_depth.0), everywhere(&self.of_depth.1)),
            [rays.t_min.simd_into(simd), rays.t_max.simd_into(simd)],
        )
    }

    /// All triangles against one of sixteen rays; `None` if all are certain misses.
    #[inline(always)]
    pub(super) fn ray(&self, simd: S, rays: &Sixteen, at: usize) -> Option<OfEight<S>> {
        let d = everywhere(simd, &rays.direction, at);
        let det = dot(self.det, d);
        let sides = Sides::new([dot(self.u, d), dot(self.v, d)], det, self.edges);
        if sides.maybe == 0 {
            return None;
        }
        let stretch = [splat(simd, rays.t_min[at & 15]), splat(simd, rays.t_max[at & 15])];
        let depths = sides.depths(simd, [self.t, det], self.of_depth, stretch);
        if depths.maybe == 0 {
            return None;
        }
        Some(depths.verdict(simd))
    }
}

/// Of sixteen lines and a triangle.
pub(super) type OfSixteen<S> = Verdict<f32x16<S>, mask32x16<S>>;

/// The least and the greatest of a·d for d within `half` of `middle`, but for roundings.
#[inline(always)]
fn ends<S: Simd>(a: Vec8<S>, middle: Vec8<S>, half: Vec8<S>) -> [f32x8<S>; 2] {
    let (at, reach) = (dot(a, middle), dot([a[0].abs(), a[1].abs(), a[2].abs()], half));
    [at - reach, at + reach]
}

/// One lane of a vector's components, in every lane.
#[inline(always)]
fn of<S: Simd>(simd: S, v: &Vec8<S>, lane: usize) -> [f32x16<S>; 3] {
    let everywhere = |x: f32| f32x16::splat(simd, x);
    [everywhere(v[0][lane & 7]), everywhere(v[1][lane & 7]), everywhere(v[2][lane & 7])]
}

/// One lane of each row, in every lane.
#[inline(always)]
pub(super) fn everywhere<S: Simd>(simd: S, rows: &[[f32; 16]; 3], lane: usize) -> Vec8<S> {
    three(simd, [rows[0][lane & 15], rows[1][lane & 15], rows[2][lane & 15]])
}
