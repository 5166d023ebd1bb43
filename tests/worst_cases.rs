//! The worst cases that the speed-against-error report has met, kept: `tests/worst-cases.txt` is written by it.

mod support;

use support::cases::{Case, Kernel, Solid};
use support::measure::{measure, scale};
use support::oracle::truth;
use support::sweep::SHIPPED;
use truehit::glam::DVec3;
use truehit::{Interval, Ray};

/// A float as `support::cases::hex` writes it: C's %a, or `inf`, `0.0` and their negatives.
fn float(text: &str) -> f64 {
    let (sign, digits) = text.strip_prefix('-').map_or((1.0, text), |t| (-1.0, t));
    let Some(hex) = digits.strip_prefix("0x") else {
        return sign * digits.parse::<f64>().unwrap();
    };
    let (mantissa, exponent) = hex.split_once('p').unwrap();
    let (lead, fraction) = mantissa.split_once('.').unwrap();
    let fraction = u64::from_str_radix(fraction, 16).unwrap();
    let exponent: i64 = exponent.parse().unwrap();
    let field = if lead == "1" { (exponent + 1023) as u64 } else { 0 };
    sign * f64::from_bits(field << 52 | fraction)
}

fn case(text: &str) -> Case {
    let (_, text) = text.split_once("origin").unwrap();
    let shape = ["plane", "triangle", "sphere", "frustum", "slab"].into_iter().find(|s| text.contains(s)).unwrap();
    let x: Vec<f64> = text
        .split(|c: char| c.is_whitespace() || "[](),".contains(c))
        .filter(|t| !t.is_empty() && !["direction", "within", shape].contains(t))
        .map(float)
        .collect();
    let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
    let solid = match shape {
        "plane" => Solid::Plane { point: v(8), normal: v(11) },
        "triangle" => Solid::Triangle([v(8), v(11), v(14)]),
        "sphere" => Solid::Sphere { center: v(8), radius: x[11] },
        "frustum" => Solid::Frustum { base: v(8), top: v(11), base_radius: x[14], top_radius: x[15] },
        _ => Solid::Slab { min: v(8), max: v(11) },
    };
    Case { ray: Ray { origin: v(0), direction: v(3) }, within: Interval::new(x[6], x[7]), solid }
}

#[test]
fn stay_right() {
    let (mut cases, mut worst) = (0, 0.0f64);
    for line in include_str!("worst-cases.txt").lines().filter(|l| !l.starts_with('#')) {
        let name = line.split_whitespace().next().unwrap();
        let Some(kernel) = Kernel::ALL.into_iter().find(|k| k.name() == name) else { panic!("{line}") };
        let case = case(line);
        // What is written is what is read.
        assert!(line.ends_with(&case.hex()), "{line}\n{}", case.hex());
        let Some(shipped) = SHIPPED.iter().find(|c| c.kernels.contains(&kernel)) else { continue };
        cases += 1;
        match (truth(&case), (shipped.answer)(&case)) {
            (None, None) => {}
            (Some(truth), Some(hit)) => {
                assert!(truth.parts.contains(&hit.part), "part {}: {line}", hit.part);
                let m = measure(&hit, &truth.lambda.enclosure(), scale(&case));
                assert!(!m.violated, "the bound {} does not hold: {line}", hit.error);
                assert!(m.ulps <= kernel.contract(), "{} ulp: {line}", m.ulps);
                worst = worst.max(m.ulps);
            }
            (truth, hit) => panic!("{hit:?} where the truth is {truth:?}: {line}"),
        }
    }
    println!("{cases} cases, {worst:.3} ulp at most");
    assert!(cases > 500, "only {cases} cases read");
}
