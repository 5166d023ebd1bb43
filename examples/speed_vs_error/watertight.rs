//! Closed convex meshes from inside: every ray must hit, leave once, and meet first what exact arithmetic meets first.

use crate::meshes::{Parts, grid_cube, icosphere, moved};
use crate::support::big::Real;
use crate::support::oracle::{self, Line};
use crate::support::rng::Rng;
use truehit::glam::DVec3;
use truehit::kernel::{textbook, triangle};
use truehit::{Hit, Interval, Mesh, Ray, Shape};

/// What rays are aimed at.
pub const AIMS: [&str; 3] = ["vertices", "edges", "faces"];

/// One ray in so many is compared with exact arithmetic over all triangles.
const CHECKED: usize = 4;

/// A mesh, rays from inside it, and of some the triangles that they meet first.
pub struct Setting {
    mesh: Mesh,
    corners: Vec<[DVec3; 3]>,
    rays: Vec<(Ray, Interval)>,
    aims: Vec<usize>,
    first: Vec<Option<Vec<u32>>>,
}

/// What is said about one ray.
#[derive(Clone, Copy, Default)]
pub struct Found {
    pub hit: bool,
    /// The triangle met first, where it is said.
    pub part: Option<u32>,
    /// How many triangles are counted, where they are.
    pub crossed: Option<usize>,
}

/// One way to answer, over all meshes; counts by aim.
pub struct Sieve {
    pub name: &'static str,
    pub shipped: bool,
    pub rays: [usize; 3],
    pub leaks: [usize; 3],
    /// More triangles than the one that a ray leaves through.
    pub doubles: Option<[usize; 3]>,
    /// Of `checked` hits, those on a triangle that others lie in front of, or that is not met at all.
    pub others: Option<usize>,
    pub checked: usize,
}

type Triangle = fn(&Ray, &[DVec3; 3], Interval) -> Option<Hit>;

/// Unit spheres here and far away, a small one farther, and a cube of integers; `n` rays a mesh and aim.
pub fn settings(n: usize) -> Vec<Setting> {
    let far = DVec3::new(148_376.0, 1234.0, -223_423.0);
    let mut random = Rng::new(41);
    [
        (icosphere(2), DVec3::ZERO, 0.1),
        (moved(icosphere(2), 1.0, far), far, 0.1),
        (moved(icosphere(2), 1e-3, 2.0 * far), 2.0 * far, 1e-4),
        (grid_cube(5), DVec3::splat(2.0), 0.0),
    ]
    .map(|(parts, inside, spread)| setting(parts, inside, spread, n, &mut random))
    .into()
}

fn setting((positions, triangles): Parts, inside: DVec3, spread: f64, n: usize, random: &mut Rng) -> Setting {
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|i| positions[i as usize])).collect();
    let (mut rays, mut aims, mut first) = (Vec::new(), Vec::new(), Vec::new());
    for aim in 0..AIMS.len() {
        for i in 0..n {
            let [a, b, c] = corners[random.index(corners.len())];
            let target = match aim {
                0 => a,
                1 if i % 2 == 0 => 0.5 * (a + b),
                1 => a + random.fraction() * (b - a),
                _ => a + 0.25 * (1.0 + random.fraction()) * (b - a) + 0.4 * random.fraction() * (c - a),
            };
            let origin = inside + spread * random.in_cube(1.0);
            let direction = if i % 3 == 0 { (target - origin).normalize() } else { target - origin };
            let ray = Ray::new(origin, direction);
            rays.push((ray, Interval::FORWARD));
            aims.push(aim);
            first.push((i % CHECKED == 0).then(|| met_first(&ray, &corners)));
        }
    }
    let mesh = Mesh::new(positions, triangles).expect("a legal mesh");
    Setting { mesh, corners, rays, aims, first }
}

/// The triangles at exactly the smallest λ > 0.
fn met_first(ray: &Ray, corners: &[[DVec3; 3]]) -> Vec<u32> {
    let line = Line::from(ray);
    let mut best: Option<(Real, Vec<u32>)> = None;
    for (i, t) in (0..).zip(corners) {
        let Some(lambda) = oracle::triangle(&line, t).filter(|l| l.within(Interval::FORWARD)) else { continue };
        let Real::Ratio(n, d) = &lambda else { unreachable!("a triangle's λ is a ratio") };
        let order = best.as_ref().map(|b| b.0.cmp_ratio(n, d));
        match (order, &mut best) {
            (Some(std::cmp::Ordering::Less), _) => {}
            (Some(std::cmp::Ordering::Equal), Some(b)) => b.1.push(i),
            _ => best = Some((lambda, vec![i])),
        }
    }
    let met = best.map_or(Vec::new(), |b| b.1);
    assert!(!met.is_empty(), "exact arithmetic leaves a closed mesh: {ray:?}");
    met
}

impl Sieve {
    pub fn of(name: &'static str, shipped: bool, settings: &[Setting], all: impl Fn(&Setting) -> Vec<Found>) -> Self {
        let mut s = Self { name, shipped, rays: [0; 3], leaks: [0; 3], doubles: None, others: None, checked: 0 };
        for setting in settings {
            let found = all(setting);
            assert_eq!(found.len(), setting.rays.len());
            for (i, found) in found.iter().enumerate() {
                let aim = setting.aims[i];
                s.rays[aim] += 1;
                s.leaks[aim] += usize::from(!found.hit);
                if let Some(n) = found.crossed {
                    s.doubles.get_or_insert_default()[aim] += usize::from(n > 1);
                }
                if let (Some(part), Some(first)) = (found.part, &setting.first[i]) {
                    s.checked += 1;
                    *s.others.get_or_insert_default() += usize::from(!first.contains(&part));
                }
            }
        }
        s
    }

    /// Nothing leaks, nothing else is met first.
    pub fn is_tight(&self) -> bool {
        self.leaks == [0; 3] && self.others.is_none_or(|n| n == 0)
    }
}

fn whole(hit: Option<Hit>) -> Found {
    Found { hit: hit.is_some(), part: hit.map(|h| h.part), crossed: None }
}

/// Each ray against each triangle: the nearest, and how many.
pub fn in_a_loop(setting: &Setting, triangle: Triangle) -> Vec<Found> {
    let one = |&(ray, within): &(Ray, Interval)| {
        let (mut nearest, mut found) = (f64::INFINITY, Found { crossed: Some(0), ..Found::default() });
        for (i, t) in (0..).zip(&setting.corners) {
            let Some(hit) = triangle(&ray, t, within) else { continue };
            found.hit = true;
            found.crossed = found.crossed.map(|n| n + 1);
            if hit.lambda < nearest {
                (nearest, found.part) = (hit.lambda, Some(i));
            }
        }
        found
    };
    setting.rays.iter().map(one).collect()
}

/// A hit of a triangle that the crossing rule gives the ray to.
fn crossing(ray: &Ray, t: &[DVec3; 3], within: Interval) -> Option<Hit> {
    triangle::intersect(ray, t, within).filter(|_| triangle::crosses(ray, t))
}

/// The crate's ways and the textbook's, on the same rays.
pub fn all(n: usize) -> Vec<Sieve> {
    let settings = settings(n);
    let mut sieves = Vec::new();
    let loops: [(&str, bool, Triangle); 6] = [
        ("loop, Möller–Trumbore f32", false, textbook::moller_trumbore::<f32>),
        ("loop, Möller–Trumbore f64", false, textbook::moller_trumbore::<f64>),
        ("loop, Woop f32", false, textbook::woop::<f32>),
        ("loop, Woop f64", false, textbook::woop::<f64>),
        ("loop, `triangle::intersect`", true, triangle::intersect),
        ("loop, and `triangle::crosses`", true, crossing),
    ];
    for (name, shipped, function) in loops {
        sieves.push(Sieve::of(name, shipped, &settings, |s| in_a_loop(s, function)));
    }
    sieves.push(Sieve::of("`Mesh::intersect`", true, &settings, |s| {
        s.rays.iter().map(|(ray, within)| whole(s.mesh.intersect(ray, *within))).collect()
    }));
    sieves.push(Sieve::of("`Mesh::intersect_each`", true, &settings, |s| {
        let mut hits = vec![None; s.rays.len()];
        s.mesh.intersect_each(&s.rays, &mut hits);
        hits.into_iter().map(whole).collect()
    }));
    sieves.push(Sieve::of("`Mesh::occludes`", true, &settings, |s| {
        let one = |(ray, within): &(Ray, Interval)| Found { hit: s.mesh.occludes(ray, *within), ..Found::default() };
        s.rays.iter().map(one).collect()
    }));
    sieves.push(Sieve::of("`Mesh::occludes_each`", true, &settings, |s| {
        let mut hits = vec![false; s.rays.len()];
        s.mesh.occludes_each(&s.rays, &mut hits);
        hits.into_iter().map(|hit| Found { hit, ..Found::default() }).collect()
    }));
    sieves
}
