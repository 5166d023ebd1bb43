//! What is asked of a triangle where it was hit: its normal, the point, and whether a ray has left it.

use super::{Forms, intersect, weights};
use crate::kernel::bound::{TRIANGLE_THICK, U};
use crate::kernel::bounded::Bounded;
use crate::kernel::cpu;
use crate::kernel::dyadic::Dyadic;
use crate::kernel::eft::Product;
use crate::kernel::float::{length, power};
use crate::kernel::lanes::Lanes;
use crate::kernel::leaving;
use crate::kernel::number::{self, Number, cross, difference, dot};
use crate::{Interval, Ray};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// The unit normal (b−a)×(c−a)/|…|, each component to a few ulps of the largest however thin the triangle; zero if it
/// is degenerate. All vertices finite.
#[must_use]
pub fn normal(vertices: &[DVec3; 3]) -> DVec3 {
    let ordinary = cpu::dispatch_function!(ordinary_normal(vertices: &[DVec3; 3]) -> Option<DVec3>);
    ordinary.unwrap_or_else(|| any_normal(vertices))
}

/// In double-double, without range. Off by 28u²M in each component: where the largest is above [`TRIANGLE_THICK`]·M by
/// no more than u of that.
#[inline(always)]
fn ordinary_normal<P: Product>(cpu: <P::Lanes as Lanes>::Cpu, vertices: &[DVec3; 3]) -> Option<DVec3> {
    let (n, size) = leaving::normal::<P>(cpu, vertices);
    let [x, y, z, _] = (n.hi + n.lo).to_array();
    let n = DVec3::new(x, y, z);
    let longest = n.abs().max_element();
    let known = (longest > TRIANGLE_THICK * size) & (longest > power(-400)) & (longest < power(400));
    known.then(|| n / n.length())
}

#[cold]
#[inline(never)]
fn any_normal(vertices: &[DVec3; 3]) -> DVec3 {
    number::unit(&normal_of::<Bounded>(vertices))
        .unwrap_or_else(|| number::unit(&normal_of::<Dyadic>(vertices)).unwrap_or_default())
}

#[inline(always)]
fn normal_of<N: Number>(&[a, b, c]: &[DVec3; 3]) -> [N; 3] {
    cross(&difference(b, a), &difference(c, a))
}

/// The point a + u·(b−a) + v·(c−a), and a bound on its distance from the triangle's plane. The weights u, v ≥ 0 are
/// those of a hit of `ray`; here they are found again, to the last bit or nearly.
#[must_use]
pub fn point(ray: &Ray, vertices: &[DVec3; 3], uv: DVec2) -> (DVec3, f64) {
    let forms = Forms::of(ray, vertices);
    let uv = if forms.lambda()[0].is_nan() { uv } else { weights(forms.uv[0], forms.uv[1]) };
    let [a, b, c] = *vertices;
    let (f, g) = (uv.x * (b - a), uv.y * (c - a));
    let position = a + (f + g);
    // Each of b−a, its multiple and their sum is rounded, then the sum with a; underflow is below the last place.
    let off = 3.0 * U * (f.abs() + g.abs()) + U * position.abs();
    (position, length(off) * (1.0 + 8.0 * U) + f64::MIN_POSITIVE)
}

/// On which side of the triangle's plane `point` lies, exactly: the sign of n·(point − a), n = (b−a)×(c−a).
/// [`Ordering::Equal`] also for a degenerate triangle. All arguments finite.
#[must_use]
pub fn side(vertices: &[DVec3; 3], point: DVec3) -> Ordering {
    fn form<N: Number>(vertices: &[DVec3; 3], point: DVec3) -> N {
        dot(&normal_of(vertices), &difference(point, vertices[0]))
    }
    number::sign_of(|| form(vertices, point), || form(vertices, point))
}

/// Whether `ray` starts strictly on the side of the triangle's plane that its normal points to, or for `outward` =
/// false on the other, and does not meet the triangle on its way: both exactly.
#[must_use]
pub fn departs(ray: &Ray, vertices: &[DVec3; 3], outward: bool) -> bool {
    leaving::triangle(ray, vertices, outward).unwrap_or_else(|| {
        ray.is_valid()
            && side(vertices, ray.origin) == leaving::side(outward)
            && intersect(ray, vertices, Interval::FORWARD).is_none()
    })
}
