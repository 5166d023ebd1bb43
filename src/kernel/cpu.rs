//! Which instructions this CPU has, asked once; code is compiled for each and chosen at run time.

use super::lanes::Lanes;
use fearless_simd::{Level, Simd};

/// Runs `fused` compiled for a CPU with fused multiply-add if this one has it, else `portable`.
///
/// The choice is made around a whole kernel; both closures must be `#[inline(always)]` down to the arithmetic, or the
/// instructions become calls. Both must give the same bits: they differ only in the
/// [`Product`](super::eft::Product) they are generic over.
#[inline(always)]
pub fn dispatch<R>(fused: impl FnOnce() -> R, portable: impl FnOnce() -> R) -> R {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
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

/// [`dispatch`] to code that computes with [`Lanes`]: `fused` is given the proof that they are there.
#[inline(always)]
pub fn dispatch_lanes<R>(fused: impl FnOnce(<FusedLanes as Lanes>::Cpu) -> R, portable: impl FnOnce() -> R) -> R {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        match Level::new().as_avx2() {
            Some(avx2) => avx2.vectorize(
                #[inline(always)]
                || fused(avx2),
            ),
            None => portable(),
        }
    }
    #[cfg(target_arch = "aarch64")]
    {
        let _ = portable;
        fused(fused_lanes())
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
    {
        let _ = fused;
        portable()
    }
}

/// [`dispatch_lanes`] to one function of references, generic over the [`Product`](super::eft::Product) and given the
/// proof: they are passed in registers, where a closure would be passed in memory.
macro_rules! dispatch_function {
    ($function:ident($($argument:ident: $type:ty),*) -> $answer:ty) => {{
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let answer = {
            fearless_simd::kernel!(
                #[inline(always)]
                fn fused(cpu: Avx2, $($argument: $type),*) -> $answer {
                    $function::<$crate::kernel::eft::Fused>(cpu, $($argument),*)
                }
            );
            /// Out of line: it would take the caller's registers and never run.
            #[cold]
            #[inline(never)]
            fn portable($($argument: $type),*) -> $answer {
                $function::<$crate::kernel::eft::Split>((), $($argument),*)
            }
            match fearless_simd::Level::new().as_avx2() {
                Some(cpu) => fused(cpu, $($argument),*),
                None => portable($($argument),*),
            }
        };
        #[cfg(target_arch = "aarch64")]
        let answer = $function::<$crate::kernel::eft::Fused>($crate::kernel::cpu::fused_lanes(), $($argument),*);
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
        let answer = $function::<$crate::kernel::eft::Split>((), $($argument),*);
        answer
    }};
}
pub(super) use dispatch_function;

/// Whether code compiled for the instructions of `simd` has fused multiply-add, known when it is compiled.
#[inline(always)]
pub fn has_fused<S: Simd>(simd: S) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return matches!(simd.level(), Level::Avx2(_) | Level::Avx512(_));
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    {
        let _ = simd;
        cfg!(target_arch = "aarch64")
    }
}

/// Vectors of a CPU with fused multiply-add.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
pub type FusedLanes = fearless_simd::f64x4<fearless_simd::Avx2>;
/// Vectors of a CPU with fused multiply-add.
#[cfg(target_arch = "aarch64")]
pub type FusedLanes = fearless_simd::f64x4<fearless_simd::Neon>;
/// Vectors of a CPU with fused multiply-add: none is known here.
#[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
pub type FusedLanes = super::lanes::Plain;

/// The proof that there is fused multiply-add, if [`has_fused`].
#[inline(always)]
pub(super) fn fused_lanes_of<S: Simd>(simd: S) -> Option<<FusedLanes as Lanes>::Cpu> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return simd.level().as_avx2();
    #[cfg(target_arch = "aarch64")]
    return simd.level().as_neon();
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
    {
        let _ = simd;
        None
    }
}

/// The proof that there is fused multiply-add.
///
/// # Panics
/// If there is none: a caller's bug.
#[inline(always)]
pub(super) fn fused_lanes() -> <FusedLanes as Lanes>::Cpu {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return Level::new().as_avx2().expect("a CPU with AVX2");
    #[cfg(target_arch = "aarch64")]
    return Level::new().as_neon().expect("a CPU with NEON");
}
