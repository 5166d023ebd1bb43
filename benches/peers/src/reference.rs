//! The exact answer, by brute force: a float filter that only rejects what certainly misses, and rationals for the
//! rest. Shares no line with truehit.

use crate::engine::{Found, Ray};
use crate::mesh::Mesh;
use dashu::rational::RBig;
use std::cmp::Ordering;

/// Everything a ray exactly meets.
pub struct Crossings {
    /// The nearest; of equal ones the lowest triangle.
    pub nearest: Found,
    /// All triangles met at the nearest λ, in order.
    pub ties: Vec<u32>,
    pub count: usize,
}

/// Triangles are closed, a ray in a triangle's plane misses it, 0 < λ < max.
pub fn trace(mesh: &Mesh, ray: &Ray) -> Crossings {
    let o = ray.origin.map(f64::from);
    let d = ray.direction.map(f64::from);
    let mut best: Option<RBig> = None;
    let mut crossings = Crossings { nearest: Found::MISS, ties: Vec::new(), count: 0 };
    for triangle in 0..mesh.triangles.len() as u32 {
        let v: [[f64; 3]; 3] = std::array::from_fn(|i| mesh.corner(triangle, i).map(f64::from));
        if certainly_misses(&v, o, d) {
            continue;
        }
        let Some(lambda) = exactly(&v, o, d) else { continue };
        if lambda <= RBig::ZERO || (ray.max.is_finite() && lambda >= rational(f64::from(ray.max))) {
            continue;
        }
        crossings.count += 1;
        match best.as_ref().map_or(Ordering::Less, |b| lambda.cmp(b)) {
            Ordering::Less => {
                crossings.nearest = Found { triangle, lambda: lambda.to_f64().value() };
                crossings.ties = vec![triangle];
                best = Some(lambda);
            }
            Ordering::Equal => crossings.ties.push(triangle),
            Ordering::Greater => {}
        }
    }
    crossings
}

/// Whether all corners lie beyond doubt on one side of a plane through the ray: two edges whose signs are certain and
/// differ.
fn certainly_misses(v: &[[f64; 3]; 3], o: [f64; 3], d: [f64; 3]) -> bool {
    let rel: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| v[i][k] - o[k]));
    let (mut positive, mut negative) = (false, false);
    for i in 0..3 {
        let (a, b) = (rel[i], rel[(i + 1) % 3]);
        let (mut s, mut size) = (0.0, 0.0);
        for k in 0..3 {
            let (p, q) = ((k + 1) % 3, (k + 2) % 3);
            let (m, n) = (a[p] * b[q], a[q] * b[p]);
            s += d[k] * (m - n);
            size += d[k].abs() * (m.abs() + n.abs());
        }
        // Two roundings of the differences, and six of the rest: below 16 u of the sum of absolute values.
        let bound = 1e-14 * size;
        positive |= s > bound;
        negative |= s < -bound;
    }
    positive && negative
}

fn rational(x: f64) -> RBig {
    RBig::try_from(x).expect("finite")
}

/// λ if the line meets the closed triangle in one point.
fn exactly(v: &[[f64; 3]; 3], o: [f64; 3], d: [f64; 3]) -> Option<RBig> {
    let o = o.map(rational);
    let d = d.map(rational);
    let rel: [[RBig; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| rational(v[i][k]) - &o[k]));
    let cross = |a: &[RBig; 3], b: &[RBig; 3]| -> [RBig; 3] {
        std::array::from_fn(|k| {
            let (p, q) = ((k + 1) % 3, (k + 2) % 3);
            &a[p] * &b[q] - &a[q] * &b[p]
        })
    };
    let dot = |a: &[RBig; 3], b: &[RBig; 3]| &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2];
    let sides: [RBig; 3] = std::array::from_fn(|i| dot(&d, &cross(&rel[i], &rel[(i + 1) % 3])));
    let (above, below) = (sides.iter().any(|s| *s > RBig::ZERO), sides.iter().any(|s| *s < RBig::ZERO));
    if above && below {
        return None;
    }
    // N · d is the sum of the sides: both are the volume spanned by the edges and the direction.
    let e1: [RBig; 3] = std::array::from_fn(|k| &rel[1][k] - &rel[0][k]);
    let e2: [RBig; 3] = std::array::from_fn(|k| &rel[2][k] - &rel[0][k]);
    let normal = cross(&e1, &e2);
    let denominator = dot(&normal, &d);
    if denominator == RBig::ZERO {
        return None;
    }
    Some(dot(&normal, &rel[0]) / denominator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_belong_to_both_sides_and_the_lowest_wins() {
        let square = Mesh::new(
            "square",
            &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            &[[0, 1, 2], [0, 2, 3]],
        );
        let down = |x: f32, y: f32| Ray { origin: [x, y, 2.0], direction: [0.0, 0.0, -0.5], max: f32::INFINITY };
        let diagonal = trace(&square, &down(0.25, 0.25));
        assert_eq!((diagonal.ties.as_slice(), diagonal.nearest.lambda), ([0, 1].as_slice(), 4.0));
        assert_eq!(trace(&square, &down(1.0, 1.0)).nearest.triangle, 0);
        assert_eq!(trace(&square, &down(1.0 + f32::EPSILON, 0.5)).count, 0);
        assert_eq!(trace(&square, &Ray { max: 4.0, ..down(0.25, 0.25) }).count, 0, "open at its end");
        assert_eq!(trace(&square, &Ray { origin: [-1.0, 0.5, 0.0], direction: [1.0, 0.0, 0.0], max: 9.0 }).count, 0);
    }
}
