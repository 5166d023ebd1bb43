//! Every kernel against exact arithmetic, on ordinary and on hard cases: docs/numerics.md §12.

mod support;

use support::cases::{Family, Kernel};
use support::families;
use support::sweep::{Answer, Row, TEXTBOOK, quantile, sweep};

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
        "{:<9} {:>3} {:<46} {:>9} {:>9} {:>6} {:>6} {:>9} {:>9} {:>6} {:>7}",
        "kernel", "no", "family", "cases", "hits", "wrong", "parts", "max ulp", "p99 ulp", "viol.", "tight"
    );
}

fn print(family: &Family, row: &Row) {
    println!(
        "{:<9} {:>3} {:<46} {:>9} {:>9} {:>6} {:>6} {:>9.3} {:>9.3} {:>6} {:>7.2}",
        family.kernel.name(),
        family.number,
        family.name,
        row.cases,
        row.hits,
        row.wrong(),
        row.wrong_parts,
        row.max_ulps(),
        quantile(&row.ulps, 0.99),
        row.violations,
        quantile(&row.tightness, 0.5),
    );
}

fn rows(kernel: Kernel, answer: Answer, ordinary: usize, hard: usize) -> Vec<(Family, Row)> {
    let families: Vec<Family> = families::all().into_iter().filter(|f| f.kernel == kernel).collect();
    let each = hard / (families.len() - 1);
    families.into_iter().map(|f| (f, sweep(&f, answer, 0..if f.number == 0 { ordinary } else { each }))).collect()
}

/// The harness sees what is known to be wrong: the textbook kernels err on hard cases, and on ordinary ones hardly.
#[test]
fn textbook_kernels_show_their_errors() {
    header();
    for contender in TEXTBOOK[0] {
        let rows = rows(contender.kernels[0], contender.answer, 2000, 4000);
        println!("{}", contender.name);
        for (family, row) in &rows {
            print(family, row);
            assert_eq!(row.hits == 0, ALL_MISS.contains(&(family.kernel, family.number)), "{}", family.name);
            assert_eq!(row.violations, 0, "an infinite bound holds");
            if family.number == 0 {
                assert!(row.wrong() * 200 <= row.cases, "{} on ordinary rays", contender.name);
            }
        }
        let wrong: usize = rows.iter().map(|(_, row)| row.wrong()).sum();
        assert!(wrong > 0, "{} is never wrong on hard cases?", contender.name);
    }
}
