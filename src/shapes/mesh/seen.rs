//! Eight triangles seen from one place: what rays from there have in common.
//!
//! Edge functions, denominator and numerator of t are linear in the direction, with coefficients that are the same for all rays:
//! U = (e₂ × C)·d, V = (C × e₁)·d, det = (e₁ × e₂)·d. The bounds on their errors are those of the filter: docs/numerics.md §10.

use super::leaf::{Margins, Sides, Sighting, Triangles, Vec8, Verdict, cross, dot, minus, splat, three};
use crate::bvh::{Bundle, E, SIXTEENS, Sixteen};
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
pub(super) struct Seen<V> {
    u: [V; 3],
    v: [V; 3],
    det: [V; 3],
    t: V,
    edges: V,
    of_depth: (V, V),
}

/// The margin of a test of all directions at once, against that of one: it loses 14 roundings of |e||r||d| where that loses 12.
const OF_ALL: f32 = 1.25;

impl<S: Simd> Seen<f32x8<S>> {
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

    /// One triangle, in every lane.
    #[inline(always)]
    pub(super) fn one(&self, simd: S, lane: usize) -> Seen<f32x16<S>> {
        self.each(
            #[inline(always)]
            |x| f32x16::splat(simd, x[lane & 7]),
        )
    }

    /// All triangles, in the first eight lanes and in the last.
    #[inline(always)]
    pub(super) fn twice(&self) -> Seen<f32x16<S>> {
        self.each(
            #[inline(always)]
            |x| x.combine(x),
        )
    }

    #[inline(always)]
    fn each(&self, of: impl Fn(f32x8<S>) -> f32x16<S>) -> Seen<f32x16<S>> {
        let Self { u, v, det, t, edges, of_depth } = *self;
        Seen {
            u: [of(u[0]), of(u[1]), of(u[2])],
            v: [of(v[0]), of(v[1]), of(v[2])],
            det: [of(det[0]), of(det[1]), of(det[2])],
            t: of(t),
            edges: of(edges),
            of_depth: (of(of_depth.0), of(of_depth.1)),
        }
    }
}

/// What is made of sixteen pairs of a ray and a triangle.
pub(super) type SixteenSighted<S> = Sighting<f32x16<S>, mask32x16<S>>;

impl<S: Simd> Seen<f32x16<S>> {
    /// One triangle against sixteen rays.
    #[inline(always)]
    pub(super) fn by(&self, simd: S, Sixteen { direction: d, t_min, t_max, .. }: &Sixteen) -> SixteenSighted<S> {
        let d = [d[0].simd_into(simd), d[1].simd_into(simd), d[2].simd_into(simd)];
        self.along(simd, d, [(*t_min).simd_into(simd), (*t_max).simd_into(simd)])
    }

    /// Eight triangles, here twice, against two rays of a bundle.
    #[inline(always)]
    pub(super) fn by_two(&self, simd: S, rays: &[Sixteen; SIXTEENS], two: [usize; 2]) -> SixteenSighted<S> {
        let [a, b] = [&rays[two[0] / 16 % SIXTEENS], &rays[two[1] / 16 % SIXTEENS]];
        let d = [
            halves(simd, [&a.direction[0], &b.direction[0]], two),
            halves(simd, [&a.direction[1], &b.direction[1]], two),
            halves(simd, [&a.direction[2], &b.direction[2]], two),
        ];
        self.along(simd, d, [halves(simd, [&a.t_min, &b.t_min], two), halves(simd, [&a.t_max, &b.t_max], two)])
    }

    #[inline(always)]
    fn along(&self, simd: S, d: [f32x16<S>; 3], stretch: [f32x16<S>; 2]) -> SixteenSighted<S> {
        let det = dot(self.det, d);
        let sides = Sides::new([dot(self.u, d), dot(self.v, d)], det, self.edges);
        sides.depths(simd, [self.t, det], self.of_depth, stretch)
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

/// A lane of one row in the first eight lanes, a lane of another in the last.
#[inline(always)]
fn halves<S: Simd>(simd: S, [a, b]: [&[f32; 16]; 2], lanes: [usize; 2]) -> f32x16<S> {
    splat(simd, a[lanes[0] & 15]).combine(splat(simd, b[lanes[1] & 15]))
}

/// One lane of each row, in every lane.
#[inline(always)]
pub(super) fn everywhere<S: Simd>(simd: S, rows: &[[f32; 16]; 3], lane: usize) -> Vec8<S> {
    three(simd, [rows[0][lane & 15], rows[1][lane & 15], rows[2][lane & 15]])
}
