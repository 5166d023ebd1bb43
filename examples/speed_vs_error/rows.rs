//! What one kernel does on one family, counted against the exact answers.

use crate::kernels::Entry;
use crate::support::cases::{Case, Solid};
use crate::support::measure;
use crate::support::oracle::{self, Truth};
use crate::timing::Speed;

/// A family's cases with their exact answers, made once for all kernels.
pub struct Sheet {
    pub cases: Vec<Case>,
    pub truths: Vec<Option<Truth>>,
}

impl Sheet {
    pub fn new(family: &crate::support::cases::Family, n: usize) -> Self {
        let stored = |case: Case| Case { solid: crate::table::as_stored(case.solid), ..case };
        let cases: Vec<Case> = (0..n).map(|i| stored(family.case(i))).collect();
        let truths = cases.iter().map(oracle::truth).collect();
        Self { cases, truths }
    }

    pub fn hits(&self) -> usize {
        self.truths.iter().flatten().count()
    }
}

/// Counts and errors of one kernel on one family.
#[derive(Clone, Default)]
pub struct Accuracy {
    /// Cases answered: all but those refused at the door.
    pub answered: usize,
    pub refused: usize,
    /// Misses where exact arithmetic hits, and the other way round.
    pub false_misses: usize,
    pub false_hits: usize,
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
    /// The ten worst: what is wrong, and the case.
    pub worst: Vec<(f64, String)>,
}

impl Accuracy {
    pub fn of(entry: &Entry, sheet: &Sheet) -> Self {
        let mut a = Self::default();
        for (case, truth) in sheet.cases.iter().zip(&sheet.truths) {
            let Some(answer) = entry.answer(case) else {
                a.refused += 1;
                continue;
            };
            a.answered += 1;
            match (truth, &answer) {
                (None, None) => {}
                (Some(_), None) => {
                    a.false_misses += 1;
                    a.note(f64::INFINITY, || format!("missed: {}", case.hex()));
                }
                (None, Some(_)) => {
                    a.false_hits += 1;
                    a.note(f64::INFINITY, || format!("invented: {}", case.hex()));
                }
                (Some(truth), Some(hit)) => {
                    a.hits += 1;
                    if has_parts(&case.solid) && !truth.parts.contains(&hit.part) {
                        a.wrong_parts += 1;
                    }
                    let exact = truth.lambda.enclosure();
                    let scale = measure::scale(case);
                    let m = measure::measure(hit, &exact, scale);
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
        if badness == 0.0 || (self.worst.len() == 10 && self.worst[9].0 >= badness) {
            return;
        }
        let at = self.worst.partition_point(|w| w.0 >= badness);
        self.worst.insert(at, (badness, text()));
        self.worst.truncate(10);
    }

    pub fn quantile(&self, q: f64) -> Option<f64> {
        quantile(&self.ulps, q)
    }

    pub fn wrong(&self) -> usize {
        self.false_misses + self.false_hits
    }
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

/// One line of the report.
pub struct Row {
    pub entry: Entry,
    pub number: u32,
    pub family: &'static str,
    pub cases: usize,
    pub truth_hits: usize,
    pub accuracy: Accuracy,
    pub speed: Speed,
    /// The share of rays above four times this kernel's ordinary ray.
    pub slow: f64,
}

/// A count of `n` as a rate per million; 0 of n is below 3/n with 95 % confidence.
pub fn per_million(count: usize, n: usize) -> String {
    match (count, n) {
        (_, 0) => "–".to_owned(),
        (0, n) => format!("0 (< {:.0})", (3e6 / n as f64).min(1e6)),
        (count, n) => format!("{:.0}", 1e6 * count as f64 / n as f64),
    }
}
