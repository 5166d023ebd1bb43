//! Eight triangles in f32, and the filter that no triangle met by the ray fails.
//!
//! The arrangement is Möller and Trumbore's (1997) with d × (v₀ − o) shared, in the frame of the tree. Each quantity is
//! compared with a bound on its own error, so that a triangle is dropped only where the exact answer is a miss:
//! docs/numerics.md §10.

use super::Mesh;
use crate::bvh::{Bundle, E, LocalRay, Sure};
use fearless_simd::{Simd, f32x8, mask32x8, prelude::*};
use glam::DVec3;

/// Triangles have 29 bits for their number.
pub(super) const MOST_TRIANGLES: usize = 1 << 29;
const NUMBER: u32 = (1 << 29) - 1;
/// Set where two edges, from the triangle's own first vertex, are vectors of floats.
pub(super) const PLAIN: u32 = 1 << 29;
pub(super) const ROTATION: u32 = 30;

/// Up to eight triangles, with v₀ opposite the longest edge.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Leaf {
    /// v₀, v₁ and v₂ where they are the mesh's own, exactly; else v₀, e₁ = v₁ − v₀ and e₂ = v₂ − v₀, which lose less.
    pub(super) vertices: [[[f32; 8]; 3]; 3],
    /// Not below |e₁| + |e₂|; −1 in a lane that holds no triangle.
    pub(super) size: [f32; 8],
    /// The triangle's number, [`PLAIN`], and by how many places its vertices are rotated.
    pub(super) id: [u32; 8],
}

impl Leaf {
    #[inline(always)]
    pub(super) fn number(&self, lane: usize) -> u32 {
        number(self.id[lane])
    }

    #[inline(always)]
    pub(super) fn has_plain_edges(&self, lane: usize) -> bool {
        self.id[lane] & PLAIN != 0
    }

    /// The vertices, without a look at the mesh's own arrays where the copy is exact.
    #[inline(always)]
    pub(super) fn vertices(&self, lane: usize, mesh: &Mesh) -> [DVec3; 3] {
        if !mesh.exact {
            return mesh.vertices(self.number(lane));
        }
        // Without a branch on the rotation, which nothing foretells.
        let first = 3 - (self.id[lane] >> ROTATION) as usize;
        let vertex = |i: usize| mesh.frame().world(column(&self.vertices[i % 3], lane));
        [vertex(first), vertex(first + 1), vertex(first + 2)]
    }
}

/// The triangle's number, of an `id`.
#[inline(always)]
pub(super) fn number(id: u32) -> u32 {
    id & NUMBER
}

/// A triangle, by where it stands.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    pub(super) leaf: u32,
    pub(super) lane: u32,
}

impl Spot {
    /// No triangle: there are fewer leaves than triangles.
    pub(super) const NOWHERE: u32 = u32::MAX;

    #[inline(always)]
    pub(super) fn packed(self) -> u32 {
        self.leaf << 3 | self.lane
    }

    #[inline(always)]
    pub(super) fn of(packed: u32) -> Self {
        Self { leaf: packed >> 3, lane: packed & 7 }
    }

    #[inline(always)]
    pub(super) fn at(self, mesh: &Mesh) -> (&Leaf, usize) {
        (&mesh.leaves[self.leaf as usize], self.lane as usize & 7)
    }

    /// What the leaf has for its `id`.
    #[inline(always)]
    pub(super) fn id(self, mesh: &Mesh) -> u32 {
        let (leaf, lane) = self.at(mesh);
        leaf.id[lane]
    }

    #[inline(always)]
    pub(super) fn number(self, mesh: &Mesh) -> u32 {
        number(self.id(mesh))
    }

    #[inline(always)]
    pub(super) fn vertices(self, mesh: &Mesh) -> [DVec3; 3] {
        let (leaf, lane) = self.at(mesh);
        leaf.vertices(lane, mesh)
    }
}

/// The ray as the filter wants it: in f32, with the margins' constants.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe {
    origin: [f32; 4],
    direction: [f32; 4],
    pub(super) margins: Margins,
    /// No hit has a t above this in absolute value.
    reach: f32,
    /// Leaves hold vertices, not edges.
    exact: bool,
}

/// What the filter's quantities may be off by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Margins {
    /// Of the edge functions: size·(`edge` + size·`edge2`).
    edge: f32,
    edge2: f32,
    /// Of t's denominator: size²·`det`.
    det: f32,
    /// Of t's numerator for the place of v₀ − o: |n|·`place`, and size²·`place` times a few ε once more.
    place: f32,
}

/// The longest way to a triangle along one axis, from an origin with the largest coordinate `size`; its error as if it
/// were part of that; 128 roundings cover those here and of what is made of it.
#[inline(always)]
fn steps(size: f32, origin_error: f32) -> f32 {
    (1.0 + size) * (1.0 + 128.0 * E) + origin_error * (1.0 / E)
}

/// Whether leaves are tested as others test them, to find out what certainty costs: CONTRIBUTING.md. The answers are
/// wrong then.
pub(super) const UNCERTIFIED: bool = cfg!(truehit_uncertified);

/// What underflow may add to an edge function.
const UNDERFLOW: f32 = 1e-36;

/// And to t's numerator, against its denominator times a limit of t: that is up to 45·2⁴⁰, and multiplies what the
/// denominator lost.
const DEPTH_UNDERFLOW: f32 = 1e-30;

impl Probe {
    #[inline(always)]
    pub(super) fn new(ray: &LocalRay, exact: bool) -> Self {
        let steps = steps(ray.size, ray.origin_error);
        Self {
            origin: ray.origin,
            direction: ray.direction,
            margins: Margins::new(steps, ray.length),
            reach: steps / ray.length,
            exact,
        }
    }

    /// The later end of what matters: `t_max`, but no farther than any triangle.
    #[inline(always)]
    fn last(&self, t_max: f32) -> f32 {
        if t_max < self.reach { t_max } else { self.reach }
    }

    /// The same of the earlier end, of a ray that may have one below zero.
    #[inline(always)]
    pub(super) fn first(&self, t_min: f32) -> f32 {
        if t_min > -self.reach { t_min } else { -self.reach }
    }

    /// Which triangles of `leaf` may be met between `t_min`, as of [`first`](Self::first), and `t_max`, and what is
    /// known of them; `None` if none.
    #[inline(always)]
    pub(super) fn test<S: Simd>(&self, simd: S, leaf: &Leaf, [t_min, t_max]: [f32; 2]) -> Option<OfEight<S>> {
        let triangles = leaf.triangles(simd, self.exact);
        let (o, d) = (spread(simd, &self.origin), spread(simd, &self.direction));
        let (t_min, last) = (splat(simd, t_min), splat(simd, self.last(t_max)));
        filter(simd, &triangles, [o, d], &self.margins, [t_min, last])
    }
}

/// v₀, e₁, e₂ and the size of the triangle of each lane.
pub(super) struct Triangles<S: Simd> {
    pub(super) v0: Vec8<S>,
    pub(super) e1: Vec8<S>,
    pub(super) e2: Vec8<S>,
    pub(super) size: f32x8<S>,
}

impl Leaf {
    /// The leaf's triangles.
    #[inline(always)]
    pub(super) fn triangles<S: Simd>(&self, simd: S, exact: bool) -> Triangles<S> {
        let [v0, v1, v2] = &self.vertices;
        let (v0, v1, v2) = (load(simd, v0), load(simd, v1), load(simd, v2));
        let (e1, e2) = if exact { (minus(v1, v0), minus(v2, v0)) } else { (v1, v2) };
        Triangles { v0, e1, e2, size: self.size.simd_into(simd) }
    }
}

/// The tests of a ray with eight triangles, for t between `t_min` and `last`; `None` if all are certain misses.
#[inline(always)]
pub(super) fn filter<S: Simd>(
    simd: S,
    triangles: &Triangles<S>,
    [o, d]: [Vec8<S>; 2],
    margins: &Margins,
    [t_min, last]: [f32x8<S>; 2],
) -> Option<OfEight<S>> {
    let &Triangles { v0, e1, e2, size } = triangles;
    let c = minus(v0, o);
    let r = cross(c, d);
    let n = cross(e1, e2);
    let det = dot(n, d);
    let sides = Sides::new([dot(r, e2), -dot(r, e1)], det, margins.edges(simd, size));
    if sides.maybe == 0 {
        return None;
    }
    let depths = sides.depths(simd, [dot(n, c), det], margins.depth(simd, size, c, n), [t_min, last]);
    if depths.maybe == 0 {
        return None;
    }
    Some(depths.verdict(simd))
}

/// On which sides of the triangle's edges a line passes, as far as is certain.
pub(super) struct Sides<M> {
    /// The lanes whose lines are not certain to pass outside.
    pub(super) maybe: u32,
    through: M,
}

impl<M> Sides<M> {
    /// From the edge functions and what they may be off by.
    #[inline(always)]
    pub(super) fn new<S, V>([u, v]: [V; 2], det: V, margin: V) -> Self
    where
        S: Simd,
        V: SimdFloat<S, Element = f32, Mask = M>,
        M: SimdMask<S>,
    {
        let w = det - u - v;
        // Certainly a miss: one edge function above zero, another below. An empty lane has a negative margin.
        // w last: it is what has to be waited for.
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let outside = (least.simd_lt(-margin) & most.simd_gt(margin)).to_bitmask() as u32;
        // Certainly through: all three above zero, or all below.
        let through = least.simd_gt(margin) | most.simd_lt(-margin);
        Self { maybe: !outside & ((1 << V::LEN) - 1), through }
    }

    /// What follows with t's numerator and denominator and what they may be off by.
    #[inline(always)]
    pub(super) fn depths<S, V>(
        self,
        simd: S,
        [t, det]: [V; 2],
        (of_t, of_det): (V, V),
        [t_min, last]: [V; 2],
    ) -> Sighting<V, M>
    where
        S: Simd,
        V: SimdFloat<S, Element = f32, Mask = M>,
        M: SimdMask<S>,
    {
        // The sign of det goes to t's numerator. Where it is uncertain the far margin is wide enough for both, and
        // nothing is said to lie before t_min.
        let size_of_det = det.abs();
        let signed = V::from_bits(t.to_bits() ^ (det.to_bits() & V::splat(simd, -0.0).to_bits()));
        let depth = of_det.mul_add(t_min.abs().max(last.abs()), of_t);
        let beyond = size_of_det.mul_sub(last, signed).simd_lt(-depth);
        let near = of_det.mul_add(t_min.abs(), of_t);
        let before = size_of_det.mul_sub(t_min, signed).simd_gt(near) & size_of_det.simd_gt(of_det);
        let maybe = self.maybe & !((beyond | before).to_bitmask() as u32);
        Sighting { maybe, through: self.through, signed, size_of_det, depth }
    }
}

/// All but the divisions of a [`Verdict`].
pub(super) struct Sighting<V, M> {
    pub(super) maybe: u32,
    through: M,
    signed: V,
    size_of_det: V,
    depth: V,
}

impl<V, M> Sighting<V, M> {
    /// Where along the lines the triangles are met.
    #[inline(always)]
    pub(super) fn verdict<S>(self, simd: S) -> Verdict<V, M>
    where
        S: Simd,
        V: SimdFloat<S, Element = f32, Mask = M>,
    {
        let Self { maybe, through, signed, size_of_det, depth } = self;
        // And the two roundings of each end.
        let depth = signed.abs().mul_add(V::splat(simd, 4.0 * E), depth);
        let (low, high) = ((signed - depth) / size_of_det, (signed + depth) / size_of_det);
        Verdict { maybe, through, low, high }
    }
}

/// What is known of pairs of a line and a triangle, not all of which are certain misses.
pub(super) struct Verdict<V, M> {
    /// The lanes that are not certain to miss.
    pub(super) maybe: u32,
    /// The lanes whose lines pass through the insides of their triangles, for certain.
    pub(super) through: M,
    /// t lies between these where the line certainly passes through; they mean nothing where it may not.
    pub(super) low: V,
    pub(super) high: V,
}

/// Of a line and eight triangles.
pub(super) type OfEight<S> = Verdict<f32x8<S>, mask32x8<S>>;

impl<S: Simd> OfEight<S> {
    /// The lanes whose triangles are hit inside `sure`, for certain.
    #[inline(always)]
    pub(super) fn certain(&self, simd: S, sure: Sure) -> u32 {
        let certain = self.through & sure.holds_each(simd, [self.low, self.high]);
        self.maybe & certain.to_bitmask() as u32
    }

    /// The same, lane by lane.
    #[inline(always)]
    pub(super) fn outcome(&self) -> Outcome {
        let depths = Depths { low: self.low.into(), high: self.high.into() };
        Outcome { maybe: self.maybe, through: self.through.to_bitmask() as u32, depths }
    }
}

impl Margins {
    /// Not below the largest coordinates of d and of s = o − v, in the frame and in units of ε.
    #[inline(always)]
    pub(super) fn sizes(&self) -> [f32; 2] {
        [self.det, self.place]
    }

    /// Of every ray of a bundle, and the t beyond which, either way, none has a hit.
    pub(super) fn of_bundle(bundle: &Bundle) -> (Self, f32) {
        let steps = steps(bundle.size, bundle.origin_error);
        (Self::new(steps, bundle.lengths[1]), steps / bundle.lengths[0])
    }

    /// For directions whose largest coordinate is at most `length`.
    #[inline(always)]
    fn new(steps: f32, length: f32) -> Self {
        // |direction| ≤ √3·length, |v₀ − o| ≤ √3·steps
        const ROOT: f32 = 1.7321;
        Self {
            edge: (13.0 * E * ROOT * ROOT) * (length * steps),
            edge2: (3.1 * E * ROOT) * length,
            place: E * steps,
            det: (2.75 * E * ROOT) * length,
        }
    }

    #[inline(always)]
    pub(super) fn edges<S: Simd>(&self, simd: S, size: f32x8<S>) -> f32x8<S> {
        if UNCERTIFIED {
            return size.min(splat(simd, 0.0));
        }
        size.mul_add(size.mul_add(splat(simd, self.edge2), splat(simd, self.edge)), splat(simd, UNDERFLOW))
    }

    /// What t's numerator n·c and its denominator may be off by.
    #[inline(always)]
    pub(super) fn depth<S: Simd>(&self, simd: S, size: f32x8<S>, c: Vec8<S>, n: Vec8<S>) -> (f32x8<S>, f32x8<S>) {
        if UNCERTIFIED {
            return (splat(simd, 0.0), splat(simd, 0.0));
        }
        let square = size * size;
        let of_c = taxicab(c).mul_add(splat(simd, 2.5 * E), splat(simd, 16.0 * E * self.place));
        let of_t = taxicab(n).mul_add(splat(simd, self.place), square.mul_add(of_c, splat(simd, DEPTH_UNDERFLOW)));
        (of_t, square * splat(simd, self.det))
    }
}

/// What the filter says of a leaf that it cannot drop.
pub(super) struct Outcome {
    /// The lanes that are not certain to miss.
    pub(super) maybe: u32,
    /// The lanes whose triangles' insides the ray's line passes through, for certain.
    pub(super) through: u32,
    pub(super) depths: Depths,
}

/// t of a leaf's triangles, by lane: between these where the line certainly passes through, and nothing where it may
/// not.
pub(super) struct Depths {
    low: [f32; 8],
    high: [f32; 8],
}

impl Depths {
    #[inline(always)]
    pub(super) fn interval(&self, lane: usize) -> [f32; 2] {
        [self.low[lane & 7], self.high[lane & 7]]
    }
}

pub(super) type Vec8<S> = [f32x8<S>; 3];

#[inline(always)]
pub(super) fn splat<S: Simd>(simd: S, x: f32) -> f32x8<S> {
    f32x8::splat(simd, x)
}

#[inline(always)]
fn spread<S: Simd>(simd: S, v: &[f32; 4]) -> Vec8<S> {
    [splat(simd, v[0]), splat(simd, v[1]), splat(simd, v[2])]
}

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, rows: &[[f32; 8]; 3]) -> Vec8<S> {
    [rows[0].simd_into(simd), rows[1].simd_into(simd), rows[2].simd_into(simd)]
}

#[inline(always)]
pub(super) fn three<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> Vec8<S> {
    [splat(simd, x), splat(simd, y), splat(simd, z)]
}

/// The sum of the components' sizes.
#[inline(always)]
fn taxicab<S: Simd>(a: Vec8<S>) -> f32x8<S> {
    a[0].abs() + a[1].abs() + a[2].abs()
}

#[inline(always)]
pub(super) fn minus<S: Simd>(a: Vec8<S>, b: Vec8<S>) -> Vec8<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn dot<S: Simd, V: SimdFloat<S, Element = f32>>(a: [V; 3], b: [V; 3]) -> V {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(super) fn cross<S: Simd>(a: Vec8<S>, b: Vec8<S>) -> Vec8<S> {
    [a[1].mul_sub(b[2], a[2] * b[1]), a[2].mul_sub(b[0], a[0] * b[2]), a[0].mul_sub(b[1], a[1] * b[0])]
}

#[inline(always)]
pub(super) fn column(rows: &[[f32; 8]; 3], lane: usize) -> DVec3 {
    DVec3::new(f64::from(rows[0][lane]), f64::from(rows[1][lane]), f64::from(rows[2][lane]))
}
