//! Triangles against exact arithmetic of this file's own: neither truehit's nor the oracle's.

mod support;

use dashu::integer::IBig;
use std::cmp::Ordering;
use std::fmt::Debug;
use support::rng::Rng;
use truehit::glam::DVec3;
use truehit::kernel::tally::Tally;
use truehit::kernel::{eft, triangle};
use truehit::{Hit, Interval, Ray};

/// m·2^e, exactly: dashu's integers, nothing of truehit's.
#[derive(Clone, Debug)]
struct Exact {
    m: IBig,
    e: isize,
}

impl Exact {
    fn new(x: f64) -> Self {
        assert!(x.is_finite());
        let bits = x.to_bits();
        let field = ((bits >> 52) & 0x7ff) as isize;
        let fraction = (bits & ((1 << 52) - 1)) as i64;
        let (m, e) = if field == 0 { (fraction, -1074) } else { (fraction | 1 << 52, field - 1075) };
        let shift = if m == 0 { 0 } else { m.trailing_zeros() };
        let m = m >> shift;
        Self { m: IBig::from(if x < 0.0 { -m } else { m }), e: e + shift as isize }
    }
    fn add(&self, other: &Self) -> Self {
        let e = self.e.min(other.e);
        Self { m: (&self.m << (self.e - e) as usize) + (&other.m << (other.e - e) as usize), e }
    }
    fn neg(&self) -> Self {
        Self { m: -&self.m, e: self.e }
    }
    fn sub(&self, other: &Self) -> Self {
        self.add(&other.neg())
    }
    fn mul(&self, other: &Self) -> Self {
        Self { m: &self.m * &other.m, e: self.e + other.e }
    }
    fn sign(&self) -> Ordering {
        self.m.cmp(&IBig::ZERO)
    }
    fn abs(&self) -> Self {
        if self.sign() == Ordering::Less { self.neg() } else { self.clone() }
    }
    /// |self| ≈ mantissa · 2^exponent, 1 ≤ mantissa < 2.
    fn approximate(&self) -> (f64, isize) {
        if self.sign() == Ordering::Equal {
            return (0.0, 0);
        }
        let m = self.abs().m;
        let bits = m.in_radix(16).to_string().len() as isize * 4;
        let top = if bits > 60 { m >> (bits - 60) as usize } else { m << (60 - bits) as usize };
        let top: u64 = top.try_into().unwrap();
        (top as f64 / 2f64.powi(59), self.e + bits - 1)
    }
}

type V = [Exact; 3];

fn ev(v: DVec3) -> V {
    [Exact::new(v.x), Exact::new(v.y), Exact::new(v.z)]
}
fn sub(a: &V, b: &V) -> V {
    [a[0].sub(&b[0]), a[1].sub(&b[1]), a[2].sub(&b[2])]
}
fn dot(a: &V, b: &V) -> Exact {
    a[0].mul(&b[0]).add(&a[1].mul(&b[1])).add(&a[2].mul(&b[2]))
}
fn cross(a: &V, b: &V) -> V {
    let m = |i: usize, j: usize| a[i].mul(&b[j]).sub(&a[j].mul(&b[i]));
    [m(1, 2), m(2, 0), m(0, 1)]
}

/// The exact λ = n/d, d > 0.
#[derive(Clone, Debug)]
struct Lambda {
    n: Exact,
    d: Exact,
}

impl Lambda {
    fn new(n: Exact, d: Exact) -> Self {
        if d.sign() == Ordering::Less { Self { n: n.neg(), d: d.neg() } } else { Self { n, d } }
    }
    fn cmp(&self, limit: f64) -> Ordering {
        if limit.is_infinite() {
            return 0f64.total_cmp(&limit);
        }
        self.n.sub(&Exact::new(limit).mul(&self.d)).sign()
    }
    fn is_inside(&self, within: Interval) -> bool {
        self.cmp(within.min) == Ordering::Greater && self.cmp(within.max) == Ordering::Less
    }
    /// (|λ − value| in units of the last place of value, whether |λ − value| ≤ bound)
    fn check(&self, value: f64, bound: f64) -> (f64, bool) {
        let error = self.n.sub(&Exact::new(value).mul(&self.d)).abs();
        let holds = bound == f64::INFINITY || Exact::new(bound).mul(&self.d).sub(&error).sign() != Ordering::Less;
        let ((em, ee), (dm, de)) = (error.approximate(), self.d.approximate());
        let (um, ue) = Exact::new(ulp(value)).approximate();
        (em / dm / um * 2f64.powi((ee - de - ue).clamp(-1000, 1000) as i32), holds)
    }
}

fn ulp(x: f64) -> f64 {
    let x = x.abs().min(f64::MAX.next_down());
    x.next_up() - x
}

/// What one family showed.
#[derive(Debug, Default)]
struct Report {
    rays: u32,
    hits: u32,
    wrong: u32,
    broken: u32,
    differ: u32,
    max_ulp: f64,
    max_ratio: f64,
}

impl Report {
    fn add(&mut self, found: Option<Hit>, exact: Option<&Lambda>, within: Interval, what: &dyn Debug) {
        self.rays += 1;
        let inside = exact.filter(|l| l.is_inside(within));
        if found.is_some() != inside.is_some() {
            if self.wrong < 3 {
                println!("wrong: found {found:?}, {what:?}");
            }
            self.wrong += 1;
            return;
        }
        let (Some(hit), Some(lambda)) = (found, inside) else { return };
        self.hits += 1;
        let (off, holds) = lambda.check(hit.lambda, hit.error);
        if !holds {
            if self.broken < 3 {
                println!("bound: {hit:?} off by {off} ulp, {what:?}");
            }
            self.broken += 1;
        }
        self.max_ulp = self.max_ulp.max(off);
        self.max_ratio = self.max_ratio.max(off / (hit.error / ulp(hit.lambda)));
        assert!((0.0..=1.0).contains(&hit.uv.x) && (0.0..=1.0).contains(&hit.uv.y), "{hit:?} {what:?}");
    }

    fn finish(&self, name: &str, min_hits: u32, max_ulp: f64) {
        println!(
            "{name:26} rays {:6} hits {:6} wrong {} bounds broken {} bits differ {} max ulp {:.4} |err|/bound {:.3}",
            self.rays, self.hits, self.wrong, self.broken, self.differ, self.max_ulp, self.max_ratio
        );
        assert_eq!((self.wrong, self.broken, self.differ), (0, 0, 0), "{name}");
        assert!(self.hits >= min_hits, "{name}: only {} hits", self.hits);
        assert!(self.max_ulp <= max_ulp, "{name}: {} ulp", self.max_ulp);
    }
}

/// The exact answer for a closed triangle: λ, or `None` for a miss.
fn exact_triangle(ray: &Ray, t: &[DVec3; 3]) -> Option<Lambda> {
    let (o, d) = (ev(ray.origin), ev(ray.direction));
    let r = t.map(|v| sub(&ev(v), &o));
    let signs = [0, 1, 2].map(|i| dot(&d, &cross(&r[i], &r[(i + 1) % 3])).sign());
    let n = cross(&sub(&r[1], &r[0]), &sub(&r[2], &r[0]));
    let den = dot(&n, &d);
    let misses = signs.contains(&Ordering::Less) && signs.contains(&Ordering::Greater);
    if misses || den.sign() == Ordering::Equal { None } else { Some(Lambda::new(dot(&n, &r[0]), den)) }
}

fn triangles(
    name: &str,
    count: u32,
    min_hits: u32,
    max_ulp: f64,
    mut make: impl FnMut(&mut Rng) -> (Ray, [DVec3; 3], Interval),
) {
    let mut random = Rng::named(name);
    let mut report = Report::default();
    for _ in 0..count {
        let (ray, t, within) = make(&mut random);
        let exact = exact_triangle(&ray, &t);
        let found = triangle::intersect(&ray, &t, within);
        report.differ += u32::from(found != triangle::intersect_with::<eft::Split>(&ray, &t, within));
        report.add(found, exact.as_ref(), within, &(ray, t, within));
    }
    report.finish(name, min_hits, max_ulp);
}

fn around(r: &mut Rng, t: &[DVec3; 3]) -> DVec3 {
    let (u, v) = (r.uniform(-0.1, 1.1), r.uniform(-0.1, 1.1));
    let (u, v) = if u + v > 1.1 { (1.0 - u, 1.0 - v) } else { (u, v) };
    t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])
}

fn some_triangle(r: &mut Rng) -> [DVec3; 3] {
    [r.in_cube(1.0), r.in_cube(1.0), r.in_cube(1.0)]
}

fn sliver(r: &mut Rng) -> [DVec3; 3] {
    let [a, b, _] = some_triangle(r);
    [a, b, a + (b - a) * r.fraction() + r.in_cube(1.0) * r.decades(-9.0, -3.0)]
}

fn normal(t: &[DVec3; 3]) -> DVec3 {
    (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero()
}

fn towards(o: DVec3, p: DVec3) -> Ray {
    Ray::new(o, if p == o { DVec3::X } else { p - o })
}

const F: Interval = Interval::FORWARD;
const L: Interval = Interval::LINE;
const ANY: f64 = f64::INFINITY;

#[test]
fn triangles_on_ordinary_rays() {
    triangles("ordinary", 20000, 6000, 1.0, |r| {
        let (t, o) = (some_triangle(r), 5.0 * r.in_cube(1.0));
        let p = around(r, &t);
        (Ray::new(o, (p - o) * r.decades(-2.0, 2.0)), t, F)
    });
    triangles("anywhere", 5000, 100, 1.0, |r| (Ray::new(r.in_cube(1.0), r.in_cube(1.0)), some_triangle(r), L));
    triangles("far (13)", 10000, 3000, 1.0, |r| {
        let (t, o) = (some_triangle(r), r.in_cube(1.0).normalize() * r.decades(3.0, 12.0));
        (towards(o, around(r, &t)), t, F)
    });
    triangles("on the plane (24)", 10000, 2000, ANY, |r| {
        let t = some_triangle(r);
        let o = around(r, &t);
        (Ray::new(o, r.in_cube(1.0) * r.decades(2.0, 8.0)), t, L)
    });
}

#[test]
fn triangles_near_parallel_to_the_ray() {
    triangles("grazing (7)", 10000, 2000, 4.0, |r| {
        let t = some_triangle(r);
        let (n, p) = (normal(&t), around(r, &t));
        let o = p - 3.0 * n.cross(r.in_cube(1.0)).normalize() + n * r.decades(-16.0, -3.0);
        (towards(o, p), t, L)
    });
    triangles("in plane (8)", 4000, 0, 4.0, |r| {
        let t = [r.grid(5), r.grid(5), r.grid(5)];
        let (e1, e2) = (t[1] - t[0], t[2] - t[0]);
        let mut along = || e1 * r.whole(4) + e2 * r.whole(4);
        (Ray::new(along() + t[0], along()), t, L)
    });
    triangles("along an edge (9)", 4000, 0, 4.0, |r| {
        let t = some_triangle(r);
        (towards(t[0], t[1]), t, L)
    });
    triangles("slivers (40)", 10000, 3000, 4.0, |r| {
        let (t, o) = (sliver(r), 4.0 * r.in_cube(1.0));
        (towards(o, around(r, &t)), t, F)
    });
    triangles("slivers, grazing (41)", 10000, 1000, 4.0, |r| {
        let t = sliver(r);
        let (n, p) = (normal(&t), around(r, &t));
        let o = p - 3.0 * n.cross(r.in_cube(1.0)).normalize() + n * r.decades(-10.0, -3.0);
        (towards(o, p), t, L)
    });
    triangles("collinear (42-44)", 5000, 0, 4.0, |r| {
        let (a, e, o) = (r.grid(9), r.grid(9), r.grid(9));
        let t = [a, a + e * r.whole(1), a + e * r.whole(2)];
        (towards(o, a + e * 0.5), t, L)
    });
}

#[test]
fn triangles_at_every_scale() {
    triangles("scale (15-19, 22)", 20000, 5000, 4.0, |r| {
        let (k, kd) = (2f64.powi(r.whole(300) as i32), 2f64.powi(r.whole(450) as i32));
        let (t, o) = (some_triangle(r), 3.0 * r.in_cube(1.0));
        let p = around(r, &t);
        (Ray::new(k * o, kd * (p - o)), t.map(|v| k * v), F)
    });
    triangles("subnormal direction (21)", 4000, 500, ANY, |r| {
        let (t, o) = (some_triangle(r), 3.0 * r.in_cube(1.0));
        let d = (around(r, &t) - o) * r.decades(-323.0, -305.0);
        (Ray::new(o, if d == DVec3::ZERO { DVec3::X * 5e-324 } else { d }), t, F)
    });
    triangles("every magnitude", 10000, 1000, ANY, |r| {
        let k = r.decades(-320.0, 300.0);
        let t = some_triangle(r).map(|v| v * k);
        let o = 3.0 * r.in_cube(1.0) * k * r.decades(-3.0, 3.0);
        let p = around(r, &t) - o;
        let d = p * r.decades(-300.0, 300.0);
        (Ray::new(o, if d.is_finite() && d != DVec3::ZERO { d } else { DVec3::Z }), t, L)
    });
    triangles("every component", 10000, 100, ANY, |r| {
        let mut v = || {
            DVec3::new(r.decades(-320.0, 308.0), r.decades(-320.0, 308.0), r.decades(-320.0, 308.0)) * r.in_cube(1.0)
        };
        (Ray::new(v(), v() + DVec3::splat(5e-324)), [v(), v(), v()], L)
    });
    triangles("area underflows (45)", 4000, 1000, 4.0, |r| {
        let (t, o) = (some_triangle(r).map(|v| v * 1e-170), 3e-170 * r.in_cube(1.0));
        (Ray::new(o, (around(r, &t) - o) * 1e170), t, F)
    });
}

#[test]
fn triangles_on_edges_and_vertices() {
    triangles("edge points, dyadic (31)", 10000, 9000, 4.0, |r| {
        let t = [8.0 * r.grid(20), 8.0 * r.grid(20), 8.0 * r.grid(20)];
        let (a, b) = (r.pick(&t), r.pick(&t));
        (towards(r.grid(1000) * 0.125, a + 0.125 * r.below(9) as f64 * (b - a)), t, L)
    });
    triangles("edge points, rounded (32)", 10000, 3000, 4.0, |r| {
        let (t, o) = (some_triangle(r), 4.0 * r.in_cube(1.0));
        let (a, b) = (r.pick(&t), r.pick(&t));
        (towards(o, a + r.fraction() * (b - a)), t, F)
    });
    triangles("vertices (33)", 10000, 1000, 4.0, |r| {
        let (t, o) = (some_triangle(r), 4.0 * r.in_cube(1.0));
        (towards(o, r.pick(&t)), t, F)
    });
    triangles("grid and axis (38, 58)", 10000, 300, 4.0, |r| {
        let axis = r.pick(&[DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::new(-0.0, 0.0, -1.0)]);
        (Ray::new(r.grid(3), axis), [r.grid(3), r.grid(3), r.grid(3)], L)
    });
    triangles("leg 2e-4 (23)", 1, 1, 1.0, |_| {
        let s = 2e-4;
        let t = [DVec3::ZERO, DVec3::X * s, DVec3::Y * s];
        (Ray::new([s / 3.0, s / 3.0, -1.0], [0.0, 0.0, 1.0]), t, F)
    });
}

#[test]
fn triangle_intervals_are_open() {
    triangles("interval limits (63)", 10000, 1000, 4.0, |r| {
        let z = r.whole(9);
        let t = [DVec3::new(-9.0, -9.0, z), DVec3::new(9.0, -9.0, z), DVec3::new(0.0, 9.0, z)];
        let ray = Ray::new([r.uniform(-1.0, 1.0), 0.0, r.whole(9)], [0.0, 0.0, r.whole(2) + 2.5]);
        let lambda = (z - ray.origin.z) / ray.direction.z;
        let limits = [lambda, lambda.next_up(), lambda.next_down(), f64::NEG_INFINITY, f64::INFINITY, -0.0];
        (ray, t, Interval::new(r.pick(&limits), r.pick(&limits)))
    });
}

#[test]
fn triangles_take_any_input() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 5e-324, 0.0];
    let mut r = Rng::named("bad");
    let mut answers = [0u32; 2];
    for _ in 0..100_000 {
        let mut x: Vec<f64> = (0..17).map(|_| if r.below(6) == 0 { r.pick(&bad) } else { r.whole(3) }).collect();
        if r.below(3) == 0 {
            x[3..6].fill(0.0);
        }
        let v = |i: usize| DVec3::new(x[i], x[i + 1], x[i + 2]);
        let (ray, t) = (Ray::new(v(0), v(3)), [v(6), v(9), v(12)]);
        let within = Interval::new(x[15], x[16]);
        let hit = triangle::intersect(&ray, &t, within);
        let finite = ray.is_valid() && t.iter().all(|v| v.is_finite()) && !within.is_empty();
        let exact = if finite { exact_triangle(&ray, &t).filter(|l| l.is_inside(within)) } else { None };
        assert_eq!(hit.is_some(), exact.is_some(), "{ray:?} {t:?} {within:?}");
        answers[usize::from(hit.is_some())] += 1;
    }
    println!("any input: {} misses, {} hits", answers[0], answers[1]);
    assert!(answers[1] > 100);
}

#[test]
fn comparisons_of_two_triangles_are_exact() {
    let mut r = Rng::named("compare");
    let mut seen = [0u32; 3];
    for i in 0..20000 {
        let (t, o) = match i % 3 {
            0 => ([r.grid(9), r.grid(9), r.grid(9)], r.grid(50)),
            _ => (some_triangle(&mut r), 4.0 * r.in_cube(1.0)),
        };
        let w = match i % 2 {
            0 => r.grid(9),
            _ => r.in_cube(1.0),
        };
        // The second shares an edge that the ray meets, exactly or nearly.
        let s = [t[1], t[0], w];
        let ray = towards(o, t[0] + 0.25 * r.below(5) as f64 * (t[1] - t[0]));
        let plane = |t: &[DVec3; 3]| {
            let (o, d) = (ev(ray.origin), ev(ray.direction));
            let n = cross(&sub(&ev(t[1]), &ev(t[0])), &sub(&ev(t[2]), &ev(t[0])));
            Lambda::new(dot(&n, &sub(&ev(t[0]), &o)), dot(&n, &d))
        };
        let (a, b) = (plane(&t), plane(&s));
        if a.d.sign() == Ordering::Equal || b.d.sign() == Ordering::Equal {
            continue;
        }
        let truth = a.n.mul(&b.d).sub(&b.n.mul(&a.d)).sign();
        assert_eq!(triangle::compare(&ray, &t, &s), truth, "{ray:?} {t:?} {s:?}");
        seen[(truth as i8 + 1) as usize] += 1;
    }
    println!("compare: less, equal, greater {seen:?}");
    assert!(seen.iter().all(|&n| n > 1000));
}

/// Overlapping faces, and rays through shared edges and vertices, are common in models: ties that short integers find.
#[test]
fn ties_of_short_coordinates_need_no_long_numbers() {
    let mut r = Rng::named("ties");
    let (before, mut compared) = (Tally::now(), 0);
    for i in 0..9000 {
        let t = [r.grid(60), r.grid(60), r.grid(60)];
        let (e1, e2) = (t[1] - t[0], t[2] - t[0]);
        let mut whole = || r.below(9) as f64 - 4.0;
        let (in_plane, s, at);
        match i % 3 {
            0 => {
                in_plane = [0; 3].map(|_| t[0] + whole() * e1 + whole() * e2);
                (s, at) = (in_plane, t[0] + 0.3 * e1 + 0.3 * e2);
            }
            1 => (s, at) = ([r.grid(60), t[2], t[1]], t[1] + 0.25 * (t[2] - t[1])),
            _ => (s, at) = ([r.grid(60), r.grid(60), t[1]], t[1]),
        }
        let origin = r.grid(50);
        let ray = Ray::new(origin, at - origin);
        let slanted = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).dot(ray.direction).abs() > 1e-6;
        if slanted(&t) && slanted(&s) {
            assert_eq!(triangle::compare(&ray, &t, &s), Ordering::Equal, "{ray:?} {t:?} {s:?}");
            compared += 1;
        }
    }
    println!("ties: {compared}");
    assert!(compared > 7000);
    assert_eq!(Tally::now().since(before).exact, 0);
}
