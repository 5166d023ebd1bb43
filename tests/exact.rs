//! Every kernel against exact arithmetic, on ordinary and on hard cases: docs/numerics.md §12.

mod support;

use support::cases::{Case, Family, Kernel};
use support::families;
use support::sweep::{Contender, Counts, Row, SHIPPED, TEXTBOOK, on_all_cores, quantile, sweep};

/// Families in which everything is a miss.
const ALL_MISS: [(Kernel, u32); 8] = [
    (Kernel::Plane, 8),
    (Kernel::Triangle, 8),
    (Kernel::Triangle, 42),
    (Kernel::Triangle, 43),
    (Kernel::Triangle, 44),
    (Kernel::Polygon, 8),
    (Kernel::Cone, 56),
    (Kernel::Slab, 62),
];

fn header() {
    println!(
        "{:<9} {:>3} {:<46} {:>9} {:>9} {:>6} {:>6} {:>6} {:>9} {:>9} {:>6} {:>7}",
        "kernel", "no", "family", "cases", "hits", "wrong", "edge", "parts", "max ulp", "p99 ulp", "viol.", "tight"
    );
}

fn print(family: &Family, row: &Row) {
    println!(
        "{:<9} {:>3} {:<46} {:>9} {:>9} {:>6} {:>6} {:>6} {:>9.3} {:>9.3} {:>6} {:>7.2}",
        family.kernel.name(),
        family.number,
        family.name,
        row.counts.cases,
        row.counts.hits,
        row.counts.wrong(),
        row.counts.borderline,
        row.counts.wrong_parts,
        row.counts.max_ulps,
        quantile(&row.ulps, 0.99),
        row.counts.violations,
        quantile(&row.tightness, 0.5),
    );
}

/// What came out of all families.
fn counts<'a>(rows: impl IntoIterator<Item = &'a Row>) -> String {
    let mut total = Counts::default();
    rows.into_iter().for_each(|row| total += row.counts);
    let Counts { cases, hits, borderline, wrong_parts, violations, max_ulps, .. } = total;
    let wrong = total.wrong();
    format!(
        "{cases} cases, {hits} hits, {wrong} wrong, {borderline} edge, {wrong_parts} wrong parts, {violations} bounds broken, {max_ulps:.3} ulp at most"
    )
}

/// Every family of one kernel: `ordinary` cases of its ordinary rays, `hard` of all others together.
fn rows(contender: &Contender, kernel: Kernel, ordinary: usize, hard: usize) -> Vec<(Family, Row)> {
    const CHUNK: usize = 2000;
    let families: Vec<Family> = families::all().into_iter().filter(|f| f.kernel == kernel).collect();
    let each = hard / (families.len() - 1);
    let of = |k: usize| if families[k].number == 0 { ordinary } else { each };
    let mut chunks: Vec<(usize, std::ops::Range<usize>)> = (0..families.len())
        .flat_map(|k| (0..of(k)).step_by(CHUNK).map(move |start| (k, start..(start + CHUNK).min(of(k)))))
        .collect();
    // All families side by side, so that what a run has done so far is a fair part of it.
    chunks.sort_by(|(j, a), (k, b)| (a.start * of(*k)).cmp(&(b.start * of(*j))));
    let mut rows = vec![Row::default(); families.len()];
    let mut finished = 0;
    on_all_cores(
        chunks.len(),
        |i| sweep(&families[chunks[i].0], contender.answer, chunks[i].1.clone()),
        |i, row| {
            rows[chunks[i].0].merge(row);
            finished += 1;
            if finished % 250 == 0 {
                eprintln!("{} so far: {}", kernel.name(), counts(&rows));
            }
        },
    );
    families.into_iter().zip(rows).collect()
}

/// The harness sees what is known to be wrong: the textbook kernels err on hard cases, and on ordinary ones hardly.
#[test]
fn textbook_kernels_show_their_errors() {
    header();
    for contender in TEXTBOOK[0] {
        let rows = rows(&contender, contender.kernels[0], 2000, 4000);
        println!("{}", contender.name);
        for (family, row) in &rows {
            print(family, row);
            assert_eq!(row.counts.hits == 0, ALL_MISS.contains(&(family.kernel, family.number)), "{}", family.name);
            assert_eq!(row.counts.violations, 0, "an infinite bound holds");
            if family.number == 0 {
                assert!(row.counts.wrong() * 200 <= row.counts.cases, "{} on ordinary rays", contender.name);
            }
        }
        let wrong: usize = rows.iter().map(|(_, row)| row.counts.wrong()).sum();
        assert!(wrong > 0, "{} is never wrong on hard cases?", contender.name);
    }
}

/// The contract of a shipped kernel: no wrong decision, no wrong part, no broken bound, λ within its ulps.
fn check(kernel: Kernel, ordinary: usize, hard: usize) {
    let contender = SHIPPED.iter().find(|c| c.kernels.contains(&kernel)).expect("a shipped kernel");
    let mut broken = Vec::new();
    header();
    let rows = rows(contender, kernel, ordinary, hard);
    for (family, row) in &rows {
        print(family, row);
        let named = |what: &str, case: &Case| {
            format!("{} {} {}: {what}: {}", kernel.name(), family.number, family.name, case.hex())
        };
        broken.extend(row.failures.iter().map(|(what, case)| named(what, case)));
        let ulps = row.counts.max_ulps;
        if let Some(case) = &row.worst
            && (ulps > family.contract() || ulps.is_nan())
        {
            broken.push(named(&format!("{ulps} ulp"), case));
        }
        let misses = ALL_MISS.contains(&(kernel, family.number));
        assert_eq!(row.counts.hits == 0, misses, "{}: {} hits", family.name, row.counts.hits);
    }
    println!("{}: {}", kernel.name(), counts(rows.iter().map(|(_, row)| row)));
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

macro_rules! contracts {
    ($($kernel:ident $quick:ident $long:ident)*) => {$(
        #[test]
        fn $quick() {
            check(Kernel::$kernel, 50_000, 50_000);
        }

        /// `cargo test --release --test exact -- --ignored --nocapture --test-threads 1`: 1e7 cases a kernel, half
        /// hard; other numbers by the environment variable `TRUEHIT_CASES`.
        #[test]
        #[ignore = "minutes to an hour"]
        fn $long() {
            let cases = support::cases_wanted(10_000_000);
            check(Kernel::$kernel, cases / 2, cases / 2);
        }
    )*};
}
contracts! {
    Plane plane_keeps_its_contract plane_ten_million_times
    Triangle triangle_keeps_its_contract triangle_ten_million_times
    Polygon polygon_keeps_its_contract polygon_ten_million_times
    Sphere sphere_keeps_its_contract sphere_ten_million_times
    Cylinder cylinder_keeps_its_contract cylinder_ten_million_times
    Cone cone_keeps_its_contract cone_ten_million_times
    Slab box_keeps_its_contract box_ten_million_times
    Mesh mesh_keeps_its_contract mesh_ten_million_times
    Affine affine_keeps_its_contract affine_ten_million_times
}
