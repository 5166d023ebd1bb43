//! Many cases of a family through one kernel, counted.

use super::big::Big;
use super::cases::{Case, Family, Kernel, Solid};
use super::measure::{measure, scale};
use super::oracle::{Line, Truth, innermost, solid, truth};
use super::shapes::{as_stored, object_ray, shape};
use std::ops::AddAssign;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use truehit::bvh::Level;
use truehit::glam::{DVec2, DVec3};
use truehit::kernel::{frustum, plane, polygon, slab, sphere, textbook, triangle};
use truehit::{Hit, Mesh, Shape};

/// `job` of 0..`jobs` on all cores, taken up in that order; `done` is told each result, one at a time.
pub fn on_all_cores<T: Send>(jobs: usize, job: impl Fn(usize) -> T + Sync, done: impl FnMut(usize, T) + Send) {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(done));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    if i >= jobs {
                        break;
                    }
                    let result = job(i);
                    done.lock().expect("no other thread has panicked")(i, result);
                }
            });
        }
    });
}

/// What a kernel answers to a case; `None` for shapes it does not know.
pub type Answer = fn(&Case) -> Option<Hit>;

/// What was counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub cases: usize,
    /// By the exact truth.
    pub hits: usize,
    pub false_hits: usize,
    pub false_misses: usize,
    /// Decided otherwise than for the exact image of the ray, rightly for the rounded one: affine shapes only.
    pub borderline: usize,
    /// Hits that name a part the point does not belong to.
    pub wrong_parts: usize,
    /// Bounds that do not hold.
    pub violations: usize,
    /// The largest error in ulps.
    pub max_ulps: f64,
}

impl Counts {
    pub fn wrong(&self) -> usize {
        self.false_hits + self.false_misses
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.cases += other.cases;
        self.hits += other.hits;
        self.false_hits += other.false_hits;
        self.false_misses += other.false_misses;
        self.borderline += other.borderline;
        self.wrong_parts += other.wrong_parts;
        self.violations += other.violations;
        // A NaN is kept.
        self.max_ulps = if other.max_ulps <= self.max_ulps { self.max_ulps } else { other.max_ulps };
    }
}

/// What came out.
#[derive(Clone, Debug, Default)]
pub struct Row {
    pub counts: Counts,
    /// Of each right hit.
    pub ulps: Vec<f32>,
    /// bound / error of each right hit whose λ is not exact.
    pub tightness: Vec<f32>,
    /// The case of the largest error in ulps.
    pub worst: Option<Case>,
    /// The first cases of a wrong decision, a wrong part, a violated bound.
    pub failures: Vec<(&'static str, Case)>,
}

impl Row {
    pub fn add(&mut self, case: &Case, answer: Option<Hit>) {
        let truth = truth(case);
        self.counts.cases += 1;
        self.counts.hits += usize::from(truth.is_some());
        let failed = |row: &mut Self, what| {
            if row.failures.len() < 10 {
                row.failures.push((what, case.clone()));
            }
        };
        if matches!(case.solid, Solid::Affine { .. }) && is_borderline(case, truth.as_ref(), answer.as_ref()) {
            self.counts.borderline += 1;
            return;
        }
        match (truth, answer) {
            (None, None) => {}
            (None, Some(_)) => {
                self.counts.false_hits += 1;
                failed(self, "false hit");
            }
            (Some(_), None) => {
                self.counts.false_misses += 1;
                failed(self, "false miss");
            }
            (Some(truth), Some(hit)) => {
                if !truth.parts.contains(&hit.part) {
                    self.counts.wrong_parts += 1;
                    failed(self, "wrong part");
                }
                let m = measure(&hit, &truth.lambda.enclosure(), scale(case));
                if m.violated {
                    self.counts.violations += 1;
                    failed(self, "bound violated");
                }
                self.ulps.push(m.ulps as f32);
                if m.tightness.is_finite() {
                    self.tightness.push(m.tightness as f32);
                }
                if self.worst.is_none() || m.ulps > self.counts.max_ulps {
                    self.counts.max_ulps = m.ulps;
                    self.worst = Some(case.clone());
                }
            }
        }
    }

    pub fn merge(&mut self, other: Self) {
        if self.worst.is_none() || other.counts.max_ulps > self.counts.max_ulps {
            self.worst = other.worst.or(self.worst.take());
        }
        self.counts += other.counts;
        self.ulps.extend(other.ulps);
        self.tightness.extend(other.tightness);
        self.failures.extend(other.failures);
        self.failures.truncate(10);
    }
}

/// Whether an affine shape's answer is not that of the exact image of the ray, but that of the rounded image: another
/// decision, or another piece or end of the surface. How far the two images are apart is checked in every case.
pub fn is_borderline(case: &Case, truth: Option<&Truth>, answer: Option<&Hit>) -> bool {
    let ray = object_ray(case);
    let right = match (truth, answer) {
        (None, None) => true,
        (Some(t), Some(hit)) => {
            t.parts.contains(&hit.part) && !measure(hit, &t.lambda.enclosure(), scale(case)).violated
        }
        _ => false,
    };
    if right {
        return false;
    }
    let (inner, ..) = innermost(case);
    match (solid(inner, &Line::from(&ray), case.within), answer) {
        (None, None) => true,
        (Some(rounded), Some(hit)) => {
            // λ is corrected by what the surface moves along the ray: the rounding of its point over the slope.
            let n = shape(inner).expect("a shape").expect("a legal shape").normal(&ray, hit);
            let size = |v: DVec3| v.abs().element_sum();
            let moved = f64::EPSILON / 2.0 * (size(ray.origin) + hit.lambda.abs() * size(ray.direction));
            let off = rounded.lambda.enclosure().minus(&Big::from(hit.lambda)).abs().hi.to_f64();
            rounded.parts.contains(&hit.part) && off <= hit.error + 1.1 * moved / n.dot(ray.direction).abs()
        }
        _ => false,
    }
}

/// The `q` quantile of what is in `values`; 0 of nothing.
pub fn quantile(values: &[f32], q: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    f64::from(sorted[((sorted.len() - 1) as f64 * q).round() as usize])
}

pub fn sweep(family: &Family, answer: Answer, cases: std::ops::Range<usize>) -> Row {
    let mut row = Row::default();
    for i in cases {
        let case = as_stored(family.case(i));
        row.add(&case, answer(&case));
    }
    row
}

/// A kernel to be lined up with others: its name, the shapes it answers, the answer.
#[derive(Clone, Copy)]
pub struct Contender {
    pub name: &'static str,
    pub kernels: &'static [Kernel],
    pub answer: Answer,
}

macro_rules! textbook {
    ($r:ty, $suffix:literal) => {
        [
            textbook!($suffix, "plane", [Plane], |c| match &c.solid {
                Solid::Plane { point, normal } => textbook::plane::<$r>(&c.ray, *point, *normal, c.within),
                _ => None,
            }),
            textbook!($suffix, "algorithm 1", [Triangle], |c| match &c.solid {
                Solid::Triangle(v) => textbook::algorithm_1::<$r>(&c.ray, v, c.within),
                _ => None,
            }),
            textbook!($suffix, "algorithm 2", [Triangle], |c| match &c.solid {
                Solid::Triangle(v) => textbook::algorithm_2::<$r>(&c.ray, v, c.within),
                _ => None,
            }),
            textbook!($suffix, "Möller–Trumbore", [Triangle], |c| match &c.solid {
                Solid::Triangle(v) => textbook::moller_trumbore::<$r>(&c.ray, v, c.within),
                _ => None,
            }),
            textbook!($suffix, "Woop", [Triangle], |c| match &c.solid {
                Solid::Triangle(v) => textbook::woop::<$r>(&c.ray, v, c.within),
                _ => None,
            }),
            textbook!($suffix, "polygon", [Polygon], |c| match &c.solid {
                Solid::Polygon(contours) => {
                    let contours: Vec<&[DVec3]> = contours.iter().map(Vec::as_slice).collect();
                    textbook::polygon::<$r>(&c.ray, &contours, c.within)
                }
                _ => None,
            }),
            textbook!($suffix, "slide formula", [Sphere], |c| match &c.solid {
                Solid::Sphere { center, radius } => textbook::sphere::<$r>(&c.ray, *center, *radius, c.within),
                _ => None,
            }),
            textbook!($suffix, "Gems ch. 7", [Sphere], |c| match &c.solid {
                Solid::Sphere { center, radius } => textbook::sphere_gems::<$r>(&c.ray, *center, *radius, c.within),
                _ => None,
            }),
            textbook!($suffix, "cylinder", [Cylinder], |c| match &c.solid {
                Solid::Frustum { base, top, base_radius, top_radius } => {
                    textbook::cylinder::<$r>(&c.ray, *base, *top, *base_radius, *top_radius, c.within)
                }
                _ => None,
            }),
            textbook!($suffix, "cone", [Cone], |c| match &c.solid {
                Solid::Frustum { base, top, base_radius, top_radius } => {
                    textbook::cone::<$r>(&c.ray, *base, *top, *base_radius, *top_radius, c.within)
                }
                _ => None,
            }),
            textbook!($suffix, "slab", [Slab], |c| match &c.solid {
                Solid::Slab { min, max } => {
                    let enter = textbook::slab::<$r>(&c.ray, *min, *max, c.within)?.0;
                    Some(Hit { lambda: enter, error: f64::INFINITY, uv: DVec2::ZERO, part: 0 })
                }
                _ => None,
            }),
        ]
    };
    ($suffix:literal, $name:literal, [$kernel:ident], $answer:expr) => {
        Contender { name: concat!($name, " ", $suffix), kernels: &[Kernel::$kernel], answer: $answer }
    };
}

/// The textbook kernels, f64 first.
pub const TEXTBOOK: [[Contender; 11]; 2] = [textbook!(f64, "f64"), textbook!(f32, "f32")];

const fn shipped(name: &'static str, kernels: &'static [Kernel], answer: Answer) -> Contender {
    Contender { name, kernels, answer }
}

/// The crate's own kernels.
pub const SHIPPED: &[Contender] = &[
    shipped("plane", &[Kernel::Plane], |c| match &c.solid {
        Solid::Plane { point, normal } => plane::intersect(&c.ray, *point, *normal, c.within),
        _ => None,
    }),
    shipped("triangle", &[Kernel::Triangle], |c| match &c.solid {
        Solid::Triangle(v) => triangle::intersect(&c.ray, v, c.within),
        _ => None,
    }),
    shipped("sphere", &[Kernel::Sphere], |c| match &c.solid {
        Solid::Sphere { center, radius } => sphere::intersect(&c.ray, *center, *radius, c.within),
        _ => None,
    }),
    shipped("frustum", &[Kernel::Cylinder, Kernel::Cone], |c| match &c.solid {
        Solid::Frustum { base, top, base_radius, top_radius } => {
            frustum::intersect(&c.ray, *base, *top, *base_radius, *top_radius, c.within)
        }
        _ => None,
    }),
    shipped("affine", &[Kernel::Affine], |c| match &c.solid {
        Solid::Affine { .. } => shape(&c.solid)?.expect("a legal shape").intersect(&c.ray, c.within),
        _ => None,
    }),
    shipped("mesh", &[Kernel::Mesh], |c| match &c.solid {
        Solid::Mesh { positions, triangles } => {
            // With every instruction set that this CPU has: one answer.
            let mut mesh = Mesh::new(positions.clone(), triangles.clone()).expect("a legal mesh");
            let mut answers = Level::all().into_iter().map(|(_, level)| {
                mesh.set_level(level);
                mesh.intersect(&c.ray, c.within)
            });
            let answer = answers.next().expect("a portable level");
            assert!(answers.all(|other| other == answer), "levels differ: {}", c.hex());
            answer
        }
        _ => None,
    }),
    shipped("polygon", &[Kernel::Polygon], |c| match &c.solid {
        Solid::Polygon(contours) => {
            let contours: Vec<&[DVec3]> = contours.iter().map(Vec::as_slice).collect();
            polygon::intersect(&c.ray, &polygon::Contours::new(&contours).expect("a legal polygon"), c.within)
        }
        _ => None,
    }),
    shipped("slab", &[Kernel::Slab], |c| match &c.solid {
        Solid::Slab { min, max } => {
            let (enter, _) = slab::intersect(&c.ray, *min, *max, c.within)?;
            Some(Hit { lambda: enter, error: f64::INFINITY, uv: DVec2::ZERO, part: 0 })
        }
        _ => None,
    }),
];
