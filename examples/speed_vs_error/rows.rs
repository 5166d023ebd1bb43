//! What one kernel does on one family, counted against the exact answers.

use crate::aftermath::Aftermath;
use crate::kernels::{Answer, Entry, Origin};
use crate::support::big::Enclosure;
use crate::support::cases::{Case, Family, Kernel, Solid};
use crate::support::measure;
use crate::support::oracle::{self, Truth};
use crate::support::sweep::is_borderline;
use crate::timing::Speed;
use truehit::kernel::tally::Tally;

/// A family's cases with their exact answers, made once for all kernels.
pub struct Sheet {
    pub cases: Vec<Case>,
    pub truths: Vec<Option<Truth>>,
    /// The exact λ of the hits, to 250 bits.
    pub exact: Vec<Option<Enclosure>>,
}

impl Sheet {
    pub fn new(family: &Family, n: usize) -> Self {
        Self::of(cases(family, n))
    }

    pub fn of(cases: Vec<Case>) -> Self {
        let truths: Vec<_> = cases.iter().map(oracle::truth).collect();
        let exact = truths.iter().map(|t| Some(t.as_ref()?.lambda.enclosure())).collect();
        Self { cases, truths, exact }
    }

    pub fn hits(&self) -> usize {
        self.truths.iter().flatten().count()
    }
}

/// The first cases of a family, with the maps that the crate's shapes store.
pub fn cases(family: &Family, n: usize) -> Vec<Case> {
    let stored = |case: Case| Case { solid: crate::table::as_stored(case.solid), ..case };
    (0..n).map(|i| stored(family.case(i))).collect()
}

/// Upper ends of the bins that errors in ulps are counted in; what is above the last has a bin of its own.
pub const BINS: [f64; 6] = [0.0, 0.5, 1.0, 4.0, 1e3, 1e6];

/// How many of the worst cases are kept.
pub const KEPT: usize = 10;

/// On ordinary rays the median bound is to be less than so many times the error.
const TIGHT: f64 = 8.0;

/// Counts and errors of one kernel on one family.
#[derive(Clone, Default)]
pub struct Accuracy {
    /// Cases answered: all but those refused at the door.
    pub answered: usize,
    pub refused: usize,
    /// Misses where exact arithmetic hits, and the other way round.
    pub false_misses: usize,
    pub false_hits: usize,
    /// Of these, those that are exact for the ray's rounded image: the crate's affine shapes promise no more.
    pub edges: usize,
    /// Hits that exact arithmetic has too: what all below is counted of.
    pub hits: usize,
    pub wrong_parts: usize,
    /// |λ − exact λ| in ulps of max(|λ|, 2⁻⁴⁰ s), ascending.
    pub ulps: Vec<f64>,
    /// Hits with |λ| < 2⁻²⁰ s, and the largest |λ − exact λ|·|d| among them in ulps of the largest coordinate.
    pub near_zero: usize,
    pub coordinate_ulps: f64,
    pub violations: usize,
    /// Bound over error where both are finite and above zero, ascending.
    pub tightness: Vec<f64>,
    /// Rays that left a fast path; of those, rays that needed integers.
    pub refined: usize,
    pub exact: usize,
    /// The ten worst, how bad and the case; where less is wrong than ten, others follow.
    pub worst: Vec<(f64, String)>,
}

impl Accuracy {
    pub fn of(entry: &Entry, sheet: &Sheet) -> Self {
        let mut a = Self::default();
        for (i, (case, truth)) in sheet.cases.iter().zip(&sheet.truths).enumerate() {
            let Some((answer, tally)) = entry.counted(case) else {
                a.refused += 1;
                continue;
            };
            a.answered += 1;
            a.refined += usize::from(tally != Tally::default());
            a.exact += usize::from(tally.exact > 0);
            match (truth, &answer) {
                (None, None) => a.note(-1.0, || format!("missed rightly: {}", case.hex())),
                (Some(_), None) => {
                    a.false_misses += 1;
                    a.edges += usize::from(is_edge(entry, case, truth.as_ref(), &answer));
                    a.note(f64::INFINITY, || format!("missed: {}", case.hex()));
                }
                (None, Some(_)) => {
                    a.false_hits += 1;
                    a.edges += usize::from(is_edge(entry, case, truth.as_ref(), &answer));
                    a.note(f64::INFINITY, || format!("invented: {}", case.hex()));
                }
                (Some(truth), Some(hit)) => {
                    a.hits += 1;
                    if has_parts(&case.solid) && !truth.parts.contains(&hit.part) {
                        a.wrong_parts += 1;
                    }
                    let exact = sheet.exact[i].as_ref().expect("a hit's λ");
                    let scale = measure::scale(case);
                    let m = measure::measure(hit, exact, scale);
                    a.violations += usize::from(m.violated);
                    if m.tightness.is_finite() && m.tightness > 0.0 {
                        a.tightness.push(m.tightness);
                    }
                    let ulps = if m.ulps.is_nan() { f64::INFINITY } else { m.ulps };
                    a.ulps.push(ulps);
                    // Near λ = 0 its own ulps say little: those of the coordinates do.
                    let size = exact.to_f64().abs();
                    if size < scale * 2f64.powi(-20) {
                        a.near_zero += 1;
                        let coordinate = ulps * measure::ulp(size.max(scale * 2f64.powi(-40))) / measure::ulp(scale);
                        a.coordinate_ulps = a.coordinate_ulps.max(coordinate);
                    }
                    a.note(ulps, || format!("{ulps:.3e} ulp: {}", case.hex()));
                }
            }
        }
        a.ulps.sort_by(f64::total_cmp);
        a.tightness.sort_by(f64::total_cmp);
        a
    }

    fn note(&mut self, badness: f64, text: impl FnOnce() -> String) {
        if self.worst.len() == KEPT && self.worst[KEPT - 1].0 >= badness {
            return;
        }
        let at = self.worst.partition_point(|w| w.0 >= badness);
        self.worst.insert(at, (badness, text()));
        self.worst.truncate(KEPT);
    }

    pub fn quantile(&self, q: f64) -> Option<f64> {
        quantile(&self.ulps, q)
    }

    pub fn max(&self) -> Option<f64> {
        self.ulps.last().copied()
    }

    pub fn wrong(&self) -> usize {
        self.false_misses + self.false_hits
    }

    /// Hits by their error, in [`BINS`].
    pub fn histogram(&self) -> [usize; BINS.len() + 1] {
        histogram(&self.ulps)
    }

    /// Every decision and part right, every λ the float next to the exact one.
    pub fn is_exact(&self) -> bool {
        self.wrong() == 0 && self.wrong_parts == 0 && self.max().is_none_or(|ulps| ulps <= 0.5)
    }
}

/// Of ascending errors in ulps, how many lie in each of [`BINS`].
pub fn histogram(ulps: &[f64]) -> [usize; BINS.len() + 1] {
    let below = |end: f64| ulps.partition_point(|u| *u <= end);
    let mut counts = [ulps.len(); BINS.len() + 1];
    for (count, end) in counts.iter_mut().zip(BINS) {
        *count = below(end);
    }
    for i in (1..counts.len()).rev() {
        counts[i] -= counts[i - 1];
    }
    counts
}

/// Whether a decision other than the exact image's is right for the rounded image of the ray.
fn is_edge(entry: &Entry, case: &Case, truth: Option<&Truth>, answer: &Answer) -> bool {
    entry.origin == Origin::Shipped
        && matches!(case.solid, Solid::Affine { .. })
        && is_borderline(case, truth, answer.as_ref())
}

/// Of an ascending list.
pub fn quantile(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(last as f64 * q).ceil() as usize])
}

fn has_parts(solid: &Solid) -> bool {
    match solid {
        Solid::Frustum { .. } | Solid::Mesh { .. } => true,
        Solid::Affine { inner, .. } => has_parts(inner),
        _ => false,
    }
}

/// Whether its hits lie on one of several parts.
pub fn has_parts_of(kernel: Kernel) -> bool {
    matches!(kernel, Kernel::Cylinder | Kernel::Cone | Kernel::Mesh | Kernel::Affine)
}

/// One line of the report.
pub struct Row {
    pub entry: Entry,
    pub number: u32,
    pub family: &'static str,
    /// λ's contract in ulps, for the crate's own kernels.
    pub contract: f64,
    pub cases: usize,
    pub truth_hits: usize,
    pub accuracy: Accuracy,
    pub aftermath: Aftermath,
    pub speed: Speed,
}

impl Row {
    /// All but its speed. What follows a hit is looked at in `followed` cases.
    pub fn new(entry: &Entry, family: &Family, sheet: &Sheet, followed: usize) -> Self {
        Self {
            entry: *entry,
            number: family.number,
            family: family.name,
            contract: family.contract(),
            cases: sheet.cases.len(),
            truth_hits: sheet.hits(),
            accuracy: Accuracy::of(entry, sheet),
            aftermath: Aftermath::of(entry, sheet, followed),
            speed: Speed::default(),
        }
    }

    pub fn is_shipped(&self) -> bool {
        self.entry.origin == Origin::Shipped
    }

    /// Whether the kernel gives a bound on λ: the textbook's do not, and a box is only passed through.
    pub fn is_bounded(&self) -> bool {
        self.is_shipped() && self.entry.kernel != Kernel::Slab
    }

    /// What is less than promised, of a row of the crate's own.
    pub fn shortcomings(&self) -> Vec<String> {
        let (a, f) = (&self.accuracy, &self.aftermath);
        let mut parts = Vec::new();
        let mut count = |n: usize, what: &str, of: usize| {
            if n > 0 {
                parts.push(format!("{n} {what} of {of}"));
            }
        };
        count(a.wrong() - a.edges, "wrong decisions", a.answered);
        count(a.wrong_parts, "wrong parts", a.hits);
        if self.is_bounded() {
            count(a.violations, "bounds on λ broken", a.hits);
            count(f.violations, "bounds on points broken", f.points.len());
            count(f.rehits, "re-hits", f.spawned);
        }
        if let Some(tight) = quantile(&a.tightness, 0.5).filter(|t| self.number == 0 && *t >= TIGHT) {
            parts.push(format!("bounds {tight:.1} times the error, in the median"));
        }
        if let Some(most) = a.max().filter(|m| *m > self.contract) {
            parts.push(format!("λ off by {most:.3e} ulp"));
        }
        parts
    }
}

/// A count of `n` as a rate per million; 0 of n is below 3/n with 95 % confidence.
pub fn per_million(count: usize, n: usize) -> String {
    match (count, n) {
        (_, 0) => "–".to_owned(),
        (0, n) => format!("0 (< {:.0})", (3e6 / n as f64).min(1e6)),
        (count, n) => format!("{:.0}", 1e6 * count as f64 / n as f64),
    }
}
