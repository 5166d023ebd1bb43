//! The worst cases that the speed-against-error report has met, kept: `tests/worst-cases.txt` is written by it.

mod support;

use support::cases::{Case, Kernel};
use support::measure::{measure, scale};
use support::oracle::truth;
use support::sweep::SHIPPED;

#[test]
fn stay_right() {
    let (mut cases, mut worst) = (0, 0.0f64);
    for line in include_str!("worst-cases.txt").lines().filter(|l| !l.starts_with('#')) {
        let name = line.split_whitespace().next().unwrap();
        let Some(kernel) = Kernel::ALL.into_iter().find(|k| k.name() == name) else { panic!("{line}") };
        let case = Case::from_hex(line);
        // What is written is what is read.
        assert!(line.ends_with(&case.hex()), "{line}\n{}", case.hex());
        let Some(shipped) = SHIPPED.iter().find(|c| c.kernels.contains(&kernel)) else { continue };
        cases += 1;
        match (truth(&case), (shipped.answer)(&case)) {
            (None, None) => {}
            (Some(truth), Some(hit)) => {
                assert!(truth.parts.contains(&hit.part), "part {}: {line}", hit.part);
                let m = measure(&hit, &truth.lambda.enclosure(), scale(&case));
                assert!(!m.violated, "the bound {} does not hold: {line}", hit.error);
                assert!(m.ulps <= kernel.contract(), "{} ulp: {line}", m.ulps);
                worst = worst.max(m.ulps);
            }
            (truth, hit) => panic!("{hit:?} where the truth is {truth:?}: {line}"),
        }
    }
    println!("{cases} cases, {worst:.3} ulp at most");
    assert!(cases > 500, "only {cases} cases read");
}
