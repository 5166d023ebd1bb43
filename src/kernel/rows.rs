//! Rays as they lie in memory, eight numbers each, and the same number of many beside each other.

use crate::{Interval, Ray};
use fearless_simd::{Simd, SimdBase, f64x8, prelude::*};

/// All that a ray is: origin, direction, and the ends of its interval.
#[inline(always)]
pub(crate) fn row<S: Simd>(
    simd: S,
    (Ray { origin: o, direction: d }, Interval { min, max }): &(Ray, Interval),
) -> f64x8<S> {
    f64x8::simd_from(simd, [o.x, o.y, o.z, d.x, d.y, d.z, *min, *max])
}

/// Of rows of eight numbers, one or more a vector, the columns.
#[inline(always)]
pub(crate) fn columns<S: Simd, V: SimdBase<S>>(rows: [V; 8]) -> [V; 8] {
    let [a, b, c, d, e, f, g, h] = rows;
    // Every other number of the row, the even ones and the odd; then every fourth; every eighth.
    let ((a, e), (b, f), (c, g), (d, h)) = (a.deinterleave(b), c.deinterleave(d), e.deinterleave(f), g.deinterleave(h));
    let ((a, c), (b, d), (e, g), (f, h)) = (a.deinterleave(b), c.deinterleave(d), e.deinterleave(f), g.deinterleave(h));
    let ((x0, x4), (x2, x6)) = (a.deinterleave(b), c.deinterleave(d));
    let ((x1, x5), (x3, x7)) = (e.deinterleave(f), g.deinterleave(h));
    [x0, x1, x2, x3, x4, x5, x6, x7]
}
