//! Who wants to know how far a long build has come, and may end it.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

/// Called with the share that is done, from 0 to 1, never less than before.
pub(crate) type Observer<'a> = &'a mut (dyn FnMut(f64) -> ControlFlow<()> + Send);

/// An observer or none. Threads report work to it; whoever finds another one reporting does not wait.
pub(crate) struct Watch<'a> {
    calls: Option<Mutex<Calls<'a>>>,
    done: AtomicUsize,
    stopped: AtomicBool,
}

struct Calls<'a> {
    observer: Observer<'a>,
    /// The phase: its part of the whole, and its pieces of work.
    from: f64,
    to: f64,
    total: usize,
    last: f64,
}

impl<'a> Watch<'a> {
    /// Nobody.
    pub(crate) fn nobody() -> Self {
        Self { calls: None, done: AtomicUsize::new(0), stopped: AtomicBool::new(false) }
    }

    pub(crate) fn new(observer: Observer<'a>) -> Self {
        let calls = Calls { observer, from: 0.0, to: 0.0, total: 1, last: -1.0 };
        let watch = Self { calls: Some(Mutex::new(calls)), ..Self::nobody() };
        watch.phase(0.0, 1);
        watch
    }

    /// From now on `total` pieces of work are what lies between the last phase's end and the share `to`.
    pub(crate) fn phase(&self, to: f64, total: usize) {
        if let Some(calls) = &self.calls
            && let Ok(mut calls) = calls.lock()
        {
            self.done.store(0, Relaxed);
            (calls.from, calls.to, calls.total) = (calls.to, to, total.max(1));
            let from = calls.from;
            self.report(&mut calls, from);
        }
    }

    /// So many pieces are done.
    #[inline]
    pub(crate) fn add(&self, pieces: usize) {
        if let Some(calls) = &self.calls {
            let done = self.done.fetch_add(pieces, Relaxed) + pieces;
            if let Ok(mut calls) = calls.try_lock() {
                let part = (done as f64 / calls.total as f64).min(1.0);
                let share = calls.from + part * (calls.to - calls.from);
                self.report(&mut calls, share);
            }
        }
    }

    fn report(&self, calls: &mut Calls, share: f64) {
        if share > calls.last && !self.stopped() {
            calls.last = share;
            if (calls.observer)(share).is_break() {
                self.stopped.store(true, Relaxed);
            }
        }
    }

    /// Whether to give up; what is built by then is nobody's.
    #[inline]
    pub(crate) fn stopped(&self) -> bool {
        self.stopped.load(Relaxed)
    }
}
