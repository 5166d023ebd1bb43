//! Every row: as tables of the page, as CSV; and the worst cases, for the tests.

use crate::kernels::Origin;
use crate::page::{ns, ulps};
use crate::rows::{BINS, KEPT, Row, has_parts_of, quantile};
use crate::support::cases::Kernel;
use crate::timing::Spread;
use std::fmt::Write;

/// Bars in names would end a table's cell.
pub fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// A count, or where it is zero 3/n, which its rate is below with 95 % confidence.
fn count_of(count: usize, n: usize) -> String {
    match (count, n) {
        (_, 0) => "–".to_owned(),
        (0, n) => format!("0 (< 3/{n})"),
        (count, _) => count.to_string(),
    }
}

/// Two counts that go together.
fn counts_of(a: usize, b: usize, n: usize) -> String {
    if a + b == 0 { count_of(0, n) } else { format!("{a} + {b}") }
}

fn spread(s: &Spread) -> String {
    format!("{} [{}–{}]", ns(s.median), ns(s.low), ns(s.high))
}

/// Shares in per cent, as they stand in the bins.
fn shares(counts: &[usize]) -> String {
    let n: usize = counts.iter().sum();
    if n == 0 {
        return "–".to_owned();
    }
    let share = |c: &usize| match 100.0 * *c as f64 / n as f64 {
        x if x > 0.0 && x < 0.5 => "<1".to_owned(),
        x => format!("{x:.0}"),
    };
    counts.iter().map(share).collect::<Vec<_>>().join(" · ")
}

const HEAD: &str = "| family | n (hits) | ns | ns, chained | refined | exact | λ ulp p50 | p99 | max | histogram | near 0 | \
    missed + invented | part | bound broken | bound/error p50 | point p50 / max | its bound broken | normal p50 / max | re-hits |\n";

/// A table for each kernel, a line for each family.
pub fn details(out: &mut String, rows: &[Row], kernels: &[(Kernel, Vec<(&'static str, Origin)>)]) {
    out.push_str(
        "## Every family\n\n\
         Counts are of the cases or hits of their row; a zero in n is below 3/n with 95 % confidence.\n\n\
         - *n (hits)*: cases, and hits by exact count. *ns*: independent rays, median [quartiles]; *chained*: each ray waits\n  \
         for the answer to the one before. 2048 rays (256 of meshes), kernels of a shape in turns.\n\
         - *refined*: rays that left a fast path; *exact*: those that double-double could not settle either, so that integers\n  \
         had to. Counted by the kernels themselves (`kernel::tally`).\n\
         - *histogram*: per cent of hits with λ exact · off by up to ½ · 1 · 4 · 10³ · 10⁶ ulp · by more. *near 0*: of hits with\n  \
         |λ| < 2⁻²⁰ s, the largest error of λ·|d| in ulps of the largest coordinate.\n\
         - *missed + invented*: wrong decisions. *part*: right hits on the wrong part. *bound broken*: |λ − exact| > `error`.\n\
         - *point*: distance from the surface in ulps of the largest coordinate of point and shape. *normal*: angle to the exact\n  \
         normal in 2⁻⁵³ rad. *re-hits*: rays that leave outward and meet the surface again.\n\n\
         The ten worst cases of each of truehit's rows (three of a mesh's) and the two worst of each of the textbook's in f64\n\
         are kept, as hexadecimal floats, in tests/worst-cases.txt: `cargo test --test worst_cases` runs them.\n\n",
    );
    for (kernel, names) in kernels {
        let _ = writeln!(out, "<details><summary>{}</summary>\n", kernel.name());
        for (name, _) in names {
            let _ = write!(out, "**{} {name}**\n\n{HEAD}|---|{}\n", kernel.name(), "---:|".repeat(18));
            for row in rows.iter().filter(|r| r.entry.kernel == *kernel && r.entry.name == *name) {
                line(out, row);
            }
            out.push('\n');
        }
        out.push_str("</details>\n\n");
    }
}

fn line(out: &mut String, r: &Row) {
    let (a, f) = (&r.accuracy, &r.aftermath);
    let none = || "–".to_owned();
    let refused = if a.refused > 0 { format!(", {} refused", a.refused) } else { String::new() };
    let edges = match a.edges {
        0 => String::new(),
        n if n == a.wrong() => " (exact for the rounded ray)".to_owned(),
        n => format!(" ({n} of them exact for the rounded ray)"),
    };
    let two = |v: &[f64]| {
        if v.is_empty() { none() } else { format!("{} / {}", ulps(quantile(v, 0.5)), ulps(v.last().copied())) }
    };
    let _ = writeln!(
        out,
        "| {} {} | {} ({}{refused}) | {} | {} | {} | {} | {} | {} | {} | {} | {} | {}{edges} | {} | {} | {} | {} | {} | {} | {} |",
        r.number,
        cell(r.family),
        r.cases,
        r.truth_hits,
        spread(&r.speed.throughput),
        spread(&r.speed.latency),
        if r.is_shipped() { count_of(a.refined, a.answered) } else { none() },
        if r.is_shipped() { count_of(a.exact, a.answered) } else { none() },
        ulps(a.quantile(0.5)),
        ulps(a.quantile(0.99)),
        ulps(a.max()),
        shares(&a.histogram()),
        if a.near_zero > 0 { ulps(Some(a.coordinate_ulps)) } else { none() },
        counts_of(a.false_misses, a.false_hits, a.answered),
        if has_parts_of(r.entry.kernel) { count_of(a.wrong_parts, a.hits) } else { none() },
        if r.is_bounded() { count_of(a.violations, a.hits) } else { none() },
        if r.is_bounded() { ulps(quantile(&a.tightness, 0.5)) } else { none() },
        two(&f.points),
        if r.is_bounded() { count_of(f.violations, f.points.len()) } else { none() },
        two(&f.normals),
        count_of(f.rehits, f.spawned),
    );
}

/// The columns of the CSV that the page of another run reads.
pub const COLUMNS: &str = "shape,kernel,origin,family number,family,cases,hits,refused,answered,false misses,false hits,\
    exact for the rounded ray,right hits,wrong parts,bounds broken,refined,exact";

/// Every figure of every row, below a line that says where it comes from.
pub fn csv(provenance: &str, rows: &[Row]) -> String {
    let ends: Vec<String> = BINS.iter().map(|b| format!("ulp <= {b}")).collect();
    let mut out = format!(
        "# {provenance}\n{COLUMNS},ulp p50,ulp p99,ulp max,{},ulp above,coordinate ulp max,bound/error p50,\
         points,point ulp p50,point ulp max,point bounds broken,normal p50,normal max,spawned,re-hits,\
         ns,ns low quartile,ns high quartile,ns chained,ns chained low quartile,ns chained high quartile\n",
        ends.join(",")
    );
    let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.4e}"));
    for r in rows {
        let (a, f, t, l) = (&r.accuracy, &r.aftermath, &r.speed.throughput, &r.speed.latency);
        let counts = [
            r.cases,
            r.truth_hits,
            a.refused,
            a.answered,
            a.false_misses,
            a.false_hits,
            a.edges,
            a.hits,
            a.wrong_parts,
            a.violations,
            a.refined,
            a.exact,
        ];
        let mut cells = vec![
            r.entry.kernel.name().to_owned(),
            r.entry.name.to_owned(),
            format!("{:?}", r.entry.origin),
            r.number.to_string(),
            format!("\"{}\"", r.family),
        ];
        cells.extend(counts.map(|c| c.to_string()));
        cells.extend([number(a.quantile(0.5)), number(a.quantile(0.99)), number(a.max())]);
        cells.extend(a.histogram().map(|c| c.to_string()));
        cells.extend([format!("{:.4e}", a.coordinate_ulps), number(quantile(&a.tightness, 0.5))]);
        cells.extend([f.points.len().to_string(), number(quantile(&f.points, 0.5)), number(f.points.last().copied())]);
        cells.extend([f.violations.to_string(), number(quantile(&f.normals, 0.5)), number(f.normals.last().copied())]);
        cells.extend([f.spawned.to_string(), f.rehits.to_string()]);
        cells.extend([t.median, t.low, t.high, l.median, l.low, l.high].map(|x| format!("{x:.2}")));
        let _ = writeln!(out, "{}", cells.join(","));
    }
    out
}

/// The ten worst cases of each of the crate's own rows, three of meshes, which are long; and those in which the
/// textbook's kernels err most.
pub fn worst_cases(rows: &[Row]) -> String {
    let mut out = String::from(
        "# Written by examples/speed_vs_error: shape, family, kernel, what is wrong or how far λ is off, the case.\n",
    );
    for r in rows {
        let kept = match r.entry.origin {
            Origin::Shipped if r.entry.kernel == Kernel::Mesh => 3,
            Origin::Shipped => KEPT,
            Origin::TextbookF64 => 2,
            Origin::TextbookF32 => 0,
        };
        let kept = r.accuracy.worst.iter().take(kept);
        for (_, text) in kept.filter(|(badness, _)| r.is_shipped() || *badness > 4.0) {
            let _ = writeln!(out, "{} {} {}, {text}", r.entry.kernel.name(), r.number, r.entry.name);
        }
    }
    out
}
