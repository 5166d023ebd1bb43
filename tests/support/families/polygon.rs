use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::Rng;
use super::shared_families;
use truehit::Interval;
use truehit::glam::DVec3;

const fn family(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Polygon, number, name, generate)
}

const OWN: [Family; 7] = [
    family(78, "exactly at vertices", |rng, i| {
        at(rng, i, |rng, contour| {
            let k = rng.below(contour.len() as u64) as usize;
            contour[k]
        })
    }),
    family(31, "exactly at points of edges", |rng, i| {
        at(rng, i, |rng, contour| {
            let k = rng.below(contour.len() as u64) as usize;
            let (a, b) = (contour[k], contour[(k + 1) % contour.len()]);
            a + (b - a) * rng.pick(&[0.25, 0.5, 0.75])
        })
    }),
    family(32, "on the line of an edge, beyond it", |rng, i| {
        at(rng, i, |rng, contour| {
            let k = rng.below(contour.len() as u64) as usize;
            let (a, b) = (contour[k], contour[(k + 1) % contour.len()]);
            a + (b - a) * rng.pick(&[-1.0, -0.5, 1.5, 2.0])
        })
    }),
    family(7, "met grazing", |rng, i| {
        let (contours, [p, x, y]) = exact(rng, i);
        let n = x.cross(y).normalize();
        let target = p + x * rng.uniform(-5.0, 5.0) + y * rng.uniform(-5.0, 5.0);
        let u = rng.across(n) + n * rng.log(1e-10, 1e-3) * rng.sign();
        Case::new(target - u * 8.0, u * rng.length(), Solid::Polygon(contours))
    }),
    family(8, "ray in its plane", |rng, i| {
        let (contours, [p, x, y]) = exact(rng, i);
        let o = p + x * rng.eighths(6) + y * rng.eighths(6);
        let d = x * rng.eighths(2) + y * rng.eighths(2);
        Case { within: Interval::LINE, ..Case::new(o, if d == DVec3::ZERO { x } else { d }, Solid::Polygon(contours)) }
    }),
    family(13, "from 1e6, 1e12", |rng, i| {
        let (contours, [p, x, y]) = exact(rng, i);
        let target = p + x * rng.uniform(-5.0, 5.0) + y * rng.uniform(-5.0, 5.0);
        let distance = rng.pick(&[1e6, 1e12]);
        super::towards(rng, target, distance, Solid::Polygon(contours))
    }),
    family(53, "origin in its plane", |rng, i| {
        let (contours, [p, x, y]) = exact(rng, i);
        let o = p + x * rng.eighths(4) + y * rng.eighths(4);
        Case { within: Interval::LINE, ..Case::new(o, rng.unit() * rng.length(), Solid::Polygon(contours)) }
    }),
];
pub fn polygons() -> Vec<Family> {
    [&OWN[..], &shared_families!(Kernel::Polygon, super::polygon::ordinary)].concat()
}

pub fn ordinary(rng: &mut Rng, i: usize) -> Case {
    let (contours, [p, x, y]) = exact(rng, i);
    let target = p + x * rng.uniform(-5.0, 5.0) + y * rng.uniform(-5.0, 5.0);
    let distance = rng.uniform(3.0, 30.0);
    super::towards(rng, target, distance, Solid::Polygon(contours))
}

fn at(rng: &mut Rng, i: usize, target: fn(&mut Rng, &[DVec3]) -> DVec3) -> Case {
    let (contours, _) = exact(rng, i);
    let k = rng.below(contours.len() as u64) as usize;
    let target = target(rng, &contours[k]);
    super::exactly_towards(rng, target, Solid::Polygon(contours))
}

/// Flat shapes with integer corners within ±5, outer contour first.
fn plan(i: usize, rng: &mut Rng) -> Vec<Vec<(i32, i32)>> {
    match i % 8 {
        0 => vec![vec![(-4, -3), (4, -3), (5, 2), (-1, 5), (-5, 1)]],
        // Concave: an L, a comb.
        1 => vec![vec![(-4, -4), (4, -4), (4, 0), (0, 0), (0, 4), (-4, 4)]],
        2 => vec![vec![(-5, -4), (5, -4), (5, 4), (3, -2), (1, 4), (-1, -2), (-3, 4), (-5, -2)]],
        // A pentagram: its middle is outside by the even-odd rule.
        3 => vec![vec![(0, 5), (3, -4), (-5, 2), (5, 2), (-3, -4)]],
        // A hole; a hole that touches the outer edge; one that leaves it.
        4 => vec![vec![(-5, -5), (5, -5), (5, 5), (-5, 5)], vec![(-2, -2), (3, -2), (0, 3)]],
        5 => {
            vec![vec![(-5, -5), (5, -5), (5, 5), (-5, 5)], vec![(-5, 0), (0, -2), (0, 2)], vec![(1, 1), (3, 1), (3, 3)]]
        }
        // Duplicate vertices, zero-length edges, a spike.
        6 => vec![vec![(-4, -4), (-4, -4), (4, -4), (4, 4), (4, 4), (4, 5), (4, 4), (-4, 4)]],
        _ => {
            let n = rng.integer(3, 9);
            let mut contour: Vec<(i32, i32)> =
                (0..n).map(|_| (rng.integer(-5, 5) as i32, rng.integer(-5, 5) as i32)).collect();
            // Area is needed: Newell's normal must not vanish.
            let area: i32 = (0..contour.len())
                .map(|k| {
                    let (a, b) = (contour[k], contour[(k + 1) % contour.len()]);
                    a.0 * b.1 - a.1 * b.0
                })
                .sum();
            if area == 0 {
                contour = vec![(-4, -3), (4, -3), (1, 5)];
            }
            vec![contour]
        }
    }
}

/// Exactly planar: a plan on small-integer axes from a dyadic point.
fn exact(rng: &mut Rng, i: usize) -> (Vec<Vec<DVec3>>, [DVec3; 3]) {
    let integer =
        |rng: &mut Rng| DVec3::new(rng.integer(-3, 3) as f64, rng.integer(-3, 3) as f64, rng.integer(-3, 3) as f64);
    let (mut x, mut y) = (DVec3::X, DVec3::X);
    while x.cross(y) == DVec3::ZERO {
        (x, y) = (integer(rng), integer(rng));
    }
    let (p, s) = (rng.small(4), 0.25);
    let (x, y) = (x * s, y * s);
    let contours = plan(i, rng);
    let contours =
        contours.iter().map(|c| c.iter().map(|&(a, b)| p + x * f64::from(a) + y * f64::from(b)).collect()).collect();
    (contours, [p, x, y])
}
