//! Work for all cores, or for one without the feature `rayon`; the results are the same.

/// Whether there is more than one thread.
#[inline]
pub(crate) fn are_parallel() -> bool {
    #[cfg(feature = "rayon")]
    return rayon::current_num_threads() > 1;
    #[cfg(not(feature = "rayon"))]
    false
}

/// Both, at the same time if `parallel`. Where there is one thread the caller's does it: the pool's would find nothing
/// in its cache.
#[inline]
pub(crate) fn join<A: Send, B: Send>(
    parallel: bool,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    #[cfg(feature = "rayon")]
    if parallel && are_parallel() {
        return rayon::join(a, b);
    }
    let _ = parallel;
    (a(), b())
}

/// f(0), f(1), … f(n − 1).
pub(crate) fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    map_with(true, n, || (), |(), i| f(i))
}

/// The same with something of its own for every thread; on this one unless `parallel`.
pub(crate) fn map_with<T: Send, R>(
    parallel: bool,
    n: usize,
    own: impl Fn() -> R + Sync + Send,
    f: impl Fn(&mut R, usize) -> T + Sync + Send,
) -> Vec<T> {
    #[cfg(feature = "rayon")]
    if parallel && are_parallel() {
        use rayon::prelude::*;
        return (0..n).into_par_iter().map_init(own, f).collect();
    }
    let _ = parallel;
    let mut own = own();
    (0..n).map(|i| f(&mut own, i)).collect()
}
