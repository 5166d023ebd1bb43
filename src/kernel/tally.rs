//! How often an answer takes more than its fast path: for reports and tests.
//!
//! What stands out of line counts itself, a thread at a time; fast paths know nothing of it and cost nothing for it. No
//! answer depends on it.

use std::cell::Cell;

/// What one thread has counted since it began. One ray may count several times: a mesh's, once a triangle that needs
/// it.
///
/// ```
/// use truehit::glam::DVec3;
/// use truehit::kernel::{sphere, tally::Tally};
/// use truehit::{Interval, Ray};
/// let counted = |x: f64| {
///     let before = Tally::now();
///     let hit = sphere::intersect(&Ray::new([x, -5.0, 0.0], [0.0, 1.0, 0.0]), DVec3::ZERO, 1.0, Interval::FORWARD);
///     assert!(hit.is_some());
///     Tally::now().since(before)
/// };
/// assert_eq!(counted(0.3), Tally { refined: 0, exact: 0 });
/// // A tangent.
/// assert_eq!(counted(1.0).refined, 1);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Fast paths that could not decide.
    pub refined: usize,
    /// Refinements in double-double that could not either, and went on in integers.
    pub exact: usize,
}

impl Tally {
    /// The calling thread's.
    #[must_use]
    pub fn now() -> Self {
        COUNTED.get()
    }

    /// What came on top of `before`.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self { refined: self.refined - before.refined, exact: self.exact - before.exact }
    }
}

thread_local! {
    static COUNTED: Cell<Tally> = const { Cell::new(Tally { refined: 0, exact: 0 }) };
}

/// A fast path was left.
pub(crate) fn refined() {
    let Tally { refined, exact } = COUNTED.get();
    COUNTED.set(Tally { refined: refined + 1, exact });
}

/// Integers were needed.
pub(crate) fn exact() {
    let Tally { refined, exact } = COUNTED.get();
    COUNTED.set(Tally { refined, exact: exact + 1 });
}
