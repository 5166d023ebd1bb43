//! Exact truth and hard cases, shared by the tests and the speed-against-error report (which includes this folder by
//! `#[path]`).
//!
//! `big`: exact numbers over dashu's integers. `oracle`: what exact real arithmetic answers. `measure`: how far a
//! kernel's answer is from that. `families`: a generator for every family of hard cases. docs/numerics.md §12.
#![allow(dead_code, unreachable_pub, missing_docs)]

pub mod big;
pub mod cases;
pub mod families;
pub mod measure;
pub mod oracle;
pub mod rng;
pub mod shapes;
pub mod sweep;

/// How many cases a long sweep is to run: the environment variable `TRUEHIT_CASES`, or its own number.
pub fn cases_wanted(own: usize) -> usize {
    match std::env::var("TRUEHIT_CASES") {
        Ok(text) => text.parse().expect("TRUEHIT_CASES is a number"),
        Err(_) => own,
    }
}
