//! The exact oracle against answers worked out by hand, and against laws that a wrong formula would break.

mod support;

use std::cmp::Ordering;
use support::big::{Big, Big3, Real};
use support::cases::{Case, Kernel, Solid};
use support::families;
use support::oracle::{self, BASE, Line, TOP, WALL, truth};
use truehit::glam::DVec3;
use truehit::{Interval, Ray};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// λ in `within`, which must be an exact float.
fn lambda(origin: DVec3, direction: DVec3, within: Interval, solid: Solid) -> Option<(f64, [u32; 4])> {
    let t = truth(&Case { within, ..Case::new(origin, direction, solid) })?;
    let e = t.lambda.enclosure();
    assert_eq!(e.lo.cmp(&e.hi), Ordering::Equal, "not exact");
    Some((e.to_f64(), t.parts))
}

#[test]
fn answers_worked_out_by_hand() {
    let (f, line) = (Interval::FORWARD, Interval::LINE);
    let ball = || Solid::Sphere { center: v(1.0, 0.0, 0.0), radius: 5.0 };
    assert_eq!(lambda(v(-9.0, 3.0, 0.0), v(2.0, 0.0, 0.0), f, ball()).unwrap().0, 3.0);
    assert_eq!(lambda(v(1.0, 0.0, 0.0), v(0.0, 0.0, 2.0), f, ball()).unwrap().0, 2.5);
    assert_eq!(lambda(v(9.0, 5.0, 0.0), v(-4.0, 0.0, 0.0), f, ball()).unwrap().0, 2.0, "tangent");
    assert!(lambda(v(9.0, 5.0f64.next_up(), 0.0), v(-4.0, 0.0, 0.0), f, ball()).is_none());
    assert!(lambda(v(9.0, 0.0, 0.0), v(4.0, 0.0, 0.0), f, ball()).is_none());
    // The limits are open: the nearer hit at λ = 3 is left out, the farther one at 7 is in.
    let limited = |max| lambda(v(-9.0, 3.0, 0.0), v(2.0, 0.0, 0.0), Interval::new(3.0, max), ball());
    assert_eq!(limited(7.0f64.next_up()).unwrap().0, 7.0);
    assert!(limited(7.0).is_none());

    // Base radius 2 at z = 0, apex at z = 4.
    let cone = || Solid::Frustum { base: DVec3::ZERO, top: v(0.0, 0.0, 4.0), base_radius: 2.0, top_radius: 0.0 };
    let hit = |o, d, w| lambda(o, d, w, cone());
    assert_eq!(hit(v(-3.0, 0.0, 2.0), DVec3::X, f), Some((2.0, [WALL; 4])));
    assert_eq!(hit(v(0.5, 0.0, -3.0), v(0.0, 0.0, 1.0), f), Some((3.0, [BASE; 4])));
    assert_eq!(hit(v(0.5, 0.0, 0.5), v(0.0, 0.0, 1.0), f), Some((2.5, [WALL; 4])), "from inside");
    assert_eq!(hit(v(0.0, 0.0, 9.0), v(0.0, 0.0, -1.0), f).unwrap().0, 5.0, "the apex");
    assert_eq!(hit(v(-1.0, 0.0, 4.0), DVec3::X, f).unwrap().0, 1.0, "across the apex: one point");
    assert!(hit(v(-3.0, 0.0, 5.0), DVec3::X, f).is_none(), "the mirror nappe");
    assert_eq!(hit(v(-3.0, 0.0, 0.0), DVec3::X, f).unwrap().0, 1.0, "in the base's plane");
    assert_eq!(hit(v(2.0, -1.0, 0.0), DVec3::Y, f).unwrap().0, 1.0, "touching the rim");
    assert_eq!(hit(v(4.0, 0.0, -4.0), v(-1.0, 0.0, 2.0), f).unwrap().0, 2.0, "along a generator: from the rim");
    assert_eq!(hit(v(4.0, 0.0, -4.0), v(-1.0, 0.0, 2.0), Interval::new(2.0, 9.0)).unwrap().0, 4.0, "to the apex");
    assert!(hit(v(4.0f64.next_up(), 0.0, -4.0), v(-1.0, 0.0, 2.0), line).is_none(), "beside it");
    let drum = || Solid::Frustum { base: DVec3::ZERO, top: v(0.0, 0.0, 4.0), base_radius: 5.0, top_radius: 5.0 };
    assert_eq!(lambda(v(3.0, 4.0, 9.0), v(0.0, 0.0, -2.0), f, drum()), Some((2.5, [TOP; 4])), "along the wall");
    assert!(lambda(v(3.0, 4.0f64.next_up(), 9.0), v(0.0, 0.0, -2.0), f, drum()).is_none());

    let triangle = || Solid::Triangle([DVec3::ZERO, v(4.0, 0.0, 0.0), v(0.0, 4.0, 0.0)]);
    let down = |x, y| lambda(v(x, y, 3.0), v(0.0, 0.0, -2.0), f, triangle()).is_some();
    assert!(down(1.0, 1.0) && down(2.0, 2.0) && down(0.0, 0.0) && down(4.0, 0.0) && down(0.0, 1.0));
    assert!(!down(2.0f64.next_up(), 2.0) && !down(-f64::MIN_POSITIVE, 1.0) && !down(4.0, 4.0));
    assert!(lambda(v(-1.0, 1.0, 0.0), DVec3::X, line, triangle()).is_none(), "in its plane");

    let square = [v(-2.0, -2.0, 1.0), v(2.0, -2.0, 1.0), v(2.0, 2.0, 1.0), v(-2.0, 2.0, 1.0)];
    let hole = [v(-1.0, -1.0, 1.0), v(1.0, -1.0, 1.0), v(0.0, 1.0, 1.0)];
    let polygon = || Solid::Polygon(vec![square.to_vec(), hole.to_vec()]);
    let down = |x, y| lambda(v(x, y, 3.0), v(0.0, 0.0, -2.0), f, polygon()).map(|h| h.0);
    for (x, y, inside) in [
        (1.5, 0.0, true),
        (0.0, 0.0, false),
        (2.0, 1.0, true),
        (2.0, 2.0, true),
        (0.0, 1.0, true),
        (0.0, -1.0, true),
        (1.0, 1.0, true),
        (2.5, 1.0, false),
        (2.5, 2.0, false),
        (-2.5, -2.0, false),
    ] {
        assert_eq!(down(x, y), inside.then_some(1.0), "({x}, {y})");
    }

    let unit = || Solid::Slab { min: DVec3::ZERO, max: DVec3::ONE };
    assert_eq!(lambda(v(-1.0, -1.0, -1.0), v(2.0, 2.0, 2.0), f, unit()).unwrap().0, 0.5);
    assert_eq!(lambda(v(-1.0, 1.0, 0.5), v(2.0, 0.0, -0.0), f, unit()).unwrap().0, 0.5, "in a face");
    assert!(lambda(v(-1.0, 1.0f64.next_up(), 0.5), v(2.0, 0.0, 0.0), f, unit()).is_none());
    assert!(lambda(v(0.5, 0.5, 0.5), DVec3::X, f, unit()).unwrap().0 < 0.0, "from inside: enters behind");
}

#[test]
fn a_root_is_where_the_polynomial_changes_its_sign() {
    let mut roots = 0;
    for family in families::all().into_iter().filter(|f| f.kernel == Kernel::Sphere) {
        for i in 0..50 {
            let case = family.case(i);
            let Solid::Sphere { center, radius } = case.solid else { unreachable!() };
            let line = Line::from(&case.ray);
            let Some(ends) = oracle::sphere(&line, center, radius) else { continue };
            let value = |l: &Big| {
                let p = Big3(std::array::from_fn(|k| &line.o.0[k] + &line.d.0[k] * l)).minus(&center.into());
                (p.norm2() - Big::from(radius).squared()).sign()
            };
            let double = ends[0].enclosure().lo.cmp(&ends[1].enclosure().lo).is_eq();
            for (end, outside_first) in ends.iter().zip([true, false]) {
                let e = end.enclosure();
                let (lo, hi) = (value(&e.lo), value(&e.hi));
                if e.lo.cmp(&e.hi).is_eq() {
                    assert_eq!(lo, Ordering::Equal, "{} {i}", family.name);
                } else if !double {
                    let (a, b) = if outside_first { (lo, hi) } else { (hi, lo) };
                    assert!(a.is_ge() && b.is_le(), "{} {i}: {a:?} {b:?}", family.name);
                    let width = (&e.hi - &e.lo).exponent() - e.hi.abs().exponent();
                    assert!(width < -250, "{width}");
                }
                roots += 1;
            }
        }
    }
    println!("{roots} roots");
    assert!(roots > 1000);
}

/// A second wording of "inside": t = q·a/a² ∈ [0, 1] and |q − ta| ≤ r₀ + (r₁ − r₀)t, over rationals.
fn contains(solid: &Solid, p: &Big3) -> bool {
    let Solid::Frustum { base, top, base_radius, top_radius } = solid else { unreachable!() };
    let a = Big3::from(*top).minus(&(*base).into());
    let q = p.minus(&(*base).into());
    let (aa, qa) = (a.norm2(), q.dot(&a));
    if qa.sign().is_lt() || qa.cmp(&aa).is_gt() {
        return false;
    }
    // All times aa: |q·aa − a·qa| ≤ r₀·aa + (r₁ − r₀)·qa.
    let off = Big3(std::array::from_fn(|k| &q.0[k] * &aa - &a.0[k] * &qa)).norm2();
    let radius = Big::from(*base_radius) * &aa + (Big::from(*top_radius) - Big::from(*base_radius)) * &qa;
    off.cmp(&radius.squared()).is_le()
}

#[test]
fn a_frustum_holds_what_is_between_its_ends_and_nothing_beside() {
    let (mut inside, mut missed) = (0, 0);
    for family in families::all().into_iter().filter(|f| matches!(f.kernel, Kernel::Cylinder | Kernel::Cone)) {
        for i in 0..50 {
            let case = family.case(i);
            let Solid::Frustum { base, top, base_radius, top_radius } = case.solid else { unreachable!() };
            let line = Line::from(&case.ray);
            let at = |l: &Big| Big3(std::array::from_fn(|k| &line.o.0[k] + &line.d.0[k] * l));
            if let Some([enter, exit]) = oracle::frustum(&line, base, top, base_radius, top_radius) {
                let (enter, exit) = (enter.lambda.enclosure(), exit.lambda.enclosure());
                if enter.hi.cmp(&exit.lo).is_lt() {
                    let span = &exit.hi - &enter.lo;
                    for (k, within) in [(-1.0, false), (0.001, true), (0.5, true), (0.999, true), (2.0, false)] {
                        let l = &enter.lo + &(&span * Big::from(k));
                        assert_eq!(contains(&case.solid, &at(&l)), within, "{} {i} at {k}", family.name);
                    }
                    inside += 1;
                }
            } else {
                // Nothing of the line is inside: neither at its ends nor anywhere near the solid.
                let d = case.ray.direction / case.ray.direction.abs().max_element();
                let near = (0.5 * (base + top) - case.ray.origin).dot(d) / d.dot(d);
                let size = (top - base).length().max(base_radius).max(top_radius);
                for k in -20..=20 {
                    let l = (near + size * 0.1 * f64::from(k)) / case.ray.direction.abs().max_element();
                    if l.is_finite() {
                        assert!(!contains(&case.solid, &at(&Big::from(l))), "{} {i}", family.name);
                    }
                }
                missed += 1;
            }
        }
    }
    println!("{inside} chords, {missed} misses");
    assert!(inside > 500 && missed > 300);
}

/// s(a, b) = d·((a − o) × (b − o)) for the three edges: all of one sign, zeros allowed.
#[test]
fn edge_determinants_decide_triangles_alike() {
    let (mut hits, mut misses) = (0, 0);
    for family in families::all().into_iter().filter(|f| f.kernel == Kernel::Triangle) {
        for i in 0..100 {
            let case = family.case(i);
            let Solid::Triangle(t) = case.solid else { unreachable!() };
            let line = Line::from(&case.ray);
            let [a, b, c] = t.map(|p| Big3::from(p).minus(&line.o));
            let side = |p: &Big3, q: &Big3| line.d.dot(&p.cross(q));
            let sides = [side(&a, &b), side(&b, &c), side(&c, &a)];
            let sum = &sides[0] + &sides[1] + &sides[2];
            let all = |o: Ordering| sides.iter().all(|s| s.sign() != o);
            let crossed = !sum.is_zero() && (all(Ordering::Less) || all(Ordering::Greater));
            assert_eq!(oracle::triangle(&line, &t).is_some(), crossed, "{} {i}", family.name);
            if crossed { hits += 1 } else { misses += 1 }
        }
    }
    println!("{hits} hits, {misses} misses");
    assert!(hits > 500 && misses > 500);
}

/// ±√2 and 1/3 against the floats on both sides.
#[test]
fn comparisons_are_exact_next_to_a_root() {
    let big = Big::from;
    // λ² − 2 = 0: ±√2.
    for plus in [false, true] {
        let root = Real::Root { a: big(1.0), b: big(0.0), c: big(-2.0), disc: big(2.0), plus };
        let s = if plus { std::f64::consts::SQRT_2 } else { -std::f64::consts::SQRT_2 };
        // The float nearest to √2 is above it.
        assert_eq!(root.cmp_f64(s), if plus { Ordering::Less } else { Ordering::Greater });
        assert_eq!(root.cmp_f64(s.next_down()), Ordering::Greater);
        assert_eq!(root.cmp_f64(s.next_up()), Ordering::Less);
        assert_eq!(root.cmp_f64(f64::INFINITY), Ordering::Less);
        assert_eq!(root.cmp_f64(f64::NEG_INFINITY), Ordering::Greater);
        let e = root.enclosure().abs();
        assert!(e.lo.squared().cmp(&big(2.0)).is_le() && e.hi.squared().cmp(&big(2.0)).is_ge());
    }
    // 1/3 with signs.
    for (n, d) in [(1.0, 3.0), (-1.0, -3.0)] {
        let third = Real::Ratio(big(n), big(d));
        assert_eq!(third.cmp_f64(1.0 / 3.0), Ordering::Greater);
        assert_eq!(third.cmp_f64((1.0f64 / 3.0).next_up()), Ordering::Less);
        assert_eq!(third.cmp_ratio(&big(-2.0), &big(-6.0)), Ordering::Equal);
    }
    let ray = Ray::new([0.0; 3], [f64::NAN, 1.0, 0.0]);
    let solid = Solid::Slab { min: -DVec3::ONE, max: DVec3::ONE };
    assert!(truth(&Case { ray, within: Interval::FORWARD, solid }).is_none());
}
