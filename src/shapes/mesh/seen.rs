//! Eight triangles seen from one place: what rays from there have in common.
//!
//! Edge functions, denominator and numerator of t are linear in the direction, with coefficients that are the same for
//! all rays: U = (e₂ × C)·d, V = (C × e₁)·d, det = (e₁ × e₂)·d. The bounds on their errors are those of the filter:
//! docs/numerics.md §10.

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

/// Triangles by lane, in memory: from there one goes to all lanes, or all go to both halves of a register, by a load.
#[repr(align(64))]
pub(super) struct Seen([[f32; 8]; ROWS]);

/// Coefficients of the direction in U, V and det, t's numerator, the margin of the edge functions and the two of the
/// depth.
const ROWS: usize = 13;

/// The margin of a test of all directions at once, against that of one: it loses 14 roundings of |e||r||d| where that
/// loses 12.
const OF_ALL: f32 = 1.25;

/// [`Seen`], in lanes that are compared with rays.
pub(super) struct Sight<V> {
    u: [V; 3],
    v: [V; 3],
    det: [V; 3],
    t: V,
    edges: V,
    of_depth: (V, V),
}

impl<V> Sight<V> {
    #[inline(always)]
    fn of(row: impl Fn(usize) -> V) -> Self {
        Self {
            u: [row(0), row(1), row(2)],
            v: [row(3), row(4), row(5)],
            det: [row(6), row(7), row(8)],
            t: row(9),
            edges: row(10),
            of_depth: (row(11), row(12)),
        }
    }
}

impl Seen {
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, triangles: &Triangles<S>, view: &View, margins: &Margins) -> Self {
        let &Triangles { v0, e1, e2, size } = triangles;
        let c = minus(v0, three(simd, view.place));
        let n = cross(e1, e2);
        let (u, v) = (cross(e2, c), cross(c, e1));
        let (of_t, of_det) = margins.depth(simd, size, c, n);
        let edges = margins.edges(simd, size);
        Self([
            u[0].into(),
            u[1].into(),
            u[2].into(),
            v[0].into(),
            v[1].into(),
            v[2].into(),
            n[0].into(),
            n[1].into(),
            n[2].into(),
            dot(n, c).into(),
            edges.into(),
            of_t.into(),
            of_det.into(),
        ])
    }

    /// The lanes whose triangles may be met by one of the rays.
    #[inline(always)]
    pub(super) fn lanes<S: Simd>(&self, simd: S, view: &View) -> u32 {
        let Sight { u, v, det, edges, .. } = Sight::of(
            #[inline(always)]
            |row| f32x8::simd_from(simd, self.0[row]),
        );
        let (middle, half) = (three(simd, view.middle), three(simd, view.half));
        let [u_low, u_high] = ends(u, middle, half);
        let [v_low, v_high] = ends(v, middle, half);
        let [w_low, w_high] = ends(minus(minus(det, u), v), middle, half);
        let [det_low, det_high] = ends(det, middle, half);
        // Certainly missed by all: the denominator, or one edge function, is above zero for all and another below. The
        // four are of one sign where a triangle is hit.
        let (most, least) = (u_low.max(v_low).max(w_low), u_high.min(v_high).min(w_high));
        let margin = edges * splat(simd, OF_ALL);
        let (below, above) = (least.simd_lt(-margin), most.simd_gt(margin));
        let missed = (below & most.max(det_low).simd_gt(margin)) | (above & least.min(det_high).simd_lt(-margin));
        !(missed.to_bitmask() as u32) & 0xff
    }

    /// One triangle, in every lane.
    #[inline(always)]
    pub(super) fn one<S: Simd>(&self, simd: S, lane: usize) -> Sight<f32x16<S>> {
        Sight::of(
            #[inline(always)]
            |row| f32x16::splat(simd, self.0[row][lane & 7]),
        )
    }

    /// All triangles, in the first eight lanes and in the last.
    #[inline(always)]
    pub(super) fn twice<S: Simd>(&self, simd: S) -> Sight<f32x16<S>> {
        Sight::of(
            #[inline(always)]
            |row| {
                let eight = f32x8::simd_from(simd, self.0[row]);
                eight.combine(eight)
            },
        )
    }
}

/// What is made of sixteen pairs of a ray and a triangle.
pub(super) type SixteenSighted<S> = Sighting<f32x16<S>, mask32x16<S>>;

impl<S: Simd> Sight<f32x16<S>> {
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
    let last = mask32x16::from_bitmask(simd, 0xff00);
    last.select(f32x16::splat(simd, b[lanes[1] & 15]), f32x16::splat(simd, a[lanes[0] & 15]))
}

/// One lane of each row, in every lane.
#[inline(always)]
pub(super) fn everywhere<S: Simd>(simd: S, rows: &[[f32; 16]; 3], lane: usize) -> Vec8<S> {
    three(simd, [rows[0][lane & 15], rows[1][lane & 15], rows[2][lane & 15]])
}
