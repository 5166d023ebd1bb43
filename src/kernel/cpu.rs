//! Which instructions this CPU has, asked once; code is compiled for each and chosen at run time.

use fearless_simd::Level;

/// Runs `fused` compiled for a CPU with fused multiply-add if this one has it, else `portable`.
///
/// The choice is made around a whole kernel; both closures must be `#[inline(always)]` down to the arithmetic, or the
/// instructions become calls. Both must give the same bits: they differ only in the
/// [`Product`](super::eft::Product) they are generic over.
#[inline(always)]
pub fn dispatch<R>(fused: impl FnOnce() -> R, portable: impl FnOnce() -> R) -> R {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        use fearless_simd::Simd;
        match Level::new().as_avx2() {
            Some(avx2) => avx2.vectorize(fused),
            None => portable(),
        }
    }
    #[cfg(target_arch = "aarch64")]
    {
        let _ = portable;
        fused()
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
    {
        let _ = fused;
        portable()
    }
}
