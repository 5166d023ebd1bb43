//! The worst cases that the speed-against-error report has met, kept: `tests/worst-cases.txt` is written by it.

mod support;

use support::cases::{Case, Kernel};
use support::shapes::as_stored;
use support::sweep::{Counts, Row, SHIPPED};

#[test]
fn stay_right() {
    let families = support::families::all();
    let mut rows = Kernel::ALL.map(|kernel| (kernel, Row::default()));
    for line in include_str!("worst-cases.txt").lines().filter(|l| !l.starts_with('#')) {
        let mut words = line.split_whitespace();
        let (name, number) = (words.next().unwrap(), words.next().unwrap().parse::<u32>().unwrap());
        let Some((kernel, row)) = rows.iter_mut().find(|r| r.0.name() == name) else { panic!("{line}") };
        let Some(family) = families.iter().find(|f| f.kernel == *kernel && f.number == number) else {
            panic!("{line}")
        };
        let case = Case::from_hex(line);
        // What is written is what is read.
        assert!(line.ends_with(&case.hex()), "{line}\n{}", case.hex());
        let case = as_stored(case);
        let shipped = SHIPPED.iter().find(|c| c.kernels.contains(kernel)).unwrap();
        let before = row.ulps.len();
        row.add(&case, (shipped.answer)(&case));
        assert!(row.failures.is_empty(), "{}: {line}", row.failures[0].0);
        let ulps = row.ulps[before..].first().copied().unwrap_or(0.0);
        assert!(f64::from(ulps) <= family.contract(), "{ulps} ulp: {line}");
    }
    for (kernel, row) in rows {
        let Counts { cases, hits, borderline, max_ulps, .. } = row.counts;
        println!("{}: {cases} cases, {hits} hits, {borderline} borderline, {max_ulps:.3} ulp at most", kernel.name());
        assert!(cases >= 20 && hits >= 20 && borderline * 2 < cases, "{}: {cases} cases", kernel.name());
    }
}

/// Of every row of the report its ten worst cases; of meshes, which are long, three.
#[test]
fn every_row_is_kept() {
    let lines: Vec<&str> = include_str!("worst-cases.txt").lines().filter(|l| !l.starts_with('#')).collect();
    for family in support::families::all() {
        let start = format!("{} {} truehit, ", family.kernel.name(), family.number);
        let kept = lines.iter().filter(|l| l.starts_with(&start)).count();
        let least = if family.kernel == Kernel::Mesh { 3 } else { 10 };
        assert!(kept >= least, "{start}: {kept}");
    }
    println!("{} cases of {} families", lines.len(), support::families::all().len());
}

/// Shapes of any length are written and read as they are.
#[test]
fn cases_of_every_family_are_read_as_written() {
    let mut cases = 0;
    for family in support::families::all() {
        for i in 0..8 {
            let case = as_stored(family.case(i));
            let read = as_stored(Case::from_hex(&case.hex()));
            // Debug writes floats so that they are read back the same.
            assert_eq!(format!("{read:?}"), format!("{case:?}"), "{} {}", family.kernel.name(), family.number);
            cases += 1;
        }
    }
    println!("{cases} cases");
    assert!(cases > 1000);
}
