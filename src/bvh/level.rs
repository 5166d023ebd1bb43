//! Which vector instructions a traversal is compiled for.

use fearless_simd::Level as Detected;

/// The vector instructions that a tree is walked with: chosen once when it is built, the best the CPU has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Level {
    /// What every CPU of the target has: SSE2 on x86-64.
    Baseline,
    /// SSE4.2.
    Sse42,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 as Ice Lake has it.
    Avx512,
}

impl Level {
    /// Every level, lowest first.
    pub const ALL: [Self; 4] = [Self::Baseline, Self::Sse42, Self::Avx2, Self::Avx512];

    /// The best level of this CPU that pays.
    #[must_use]
    pub fn detect() -> Self {
        [Self::Avx2, Self::Sse42].into_iter().find(|l| l.is_supported()).unwrap_or(Self::Baseline)
    }

    /// Whether this CPU has it; elsewhere than on x86 only [`Baseline`](Self::Baseline) is told apart.
    #[must_use]
    pub fn is_supported(self) -> bool {
        self == Self::Baseline || self.token().1
    }

    /// The token that the vector code is generic over, the best the CPU has if it lacks this one, and whether it has
    /// this one.
    #[inline]
    pub(crate) fn token(self) -> (Detected, bool) {
        let best = Detected::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            let found = match self {
                Self::Baseline => best.as_sse2().map(Detected::Sse2),
                Self::Sse42 => best.as_sse4_2().map(Detected::Sse4_2),
                Self::Avx2 => best.as_avx2().map(Detected::Avx2),
                Self::Avx512 => best.as_avx512().map(Detected::Avx512),
            };
            (found.unwrap_or(best), found.is_some())
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        {
            (best, false)
        }
    }
}
