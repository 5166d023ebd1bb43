//! Which vector instructions a traversal is compiled for.

use fearless_simd::Level as Detected;

/// The vector instructions that a tree is walked with: chosen once when it is built, the best the CPU has.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    one: Detected,
    many: Detected,
}

impl Level {
    /// The level that queries use by themselves: the best of this CPU that pays. AVX-512 does where many rays are
    /// walked together.
    #[must_use]
    pub fn detect() -> Self {
        let many = Detected::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let one = many.as_avx2().map_or(many, Detected::Avx2);
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        let one = many;
        Self { one, many }
    }

    /// Every level this CPU has, with its name: on x86-64 up to SSE2, SSE4.2, AVX2 and AVX-512, elsewhere one.
    #[must_use]
    pub fn all() -> Vec<(&'static str, Self)> {
        let best = Detected::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let levels = [
            ("SSE2", best.as_sse2().map(Detected::Sse2)),
            ("SSE4.2", best.as_sse4_2().map(Detected::Sse4_2)),
            ("AVX2", best.as_avx2().map(Detected::Avx2)),
            ("AVX-512", best.as_avx512().map(Detected::Avx512)),
        ];
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        let levels = [("baseline", Some(best))];
        levels.into_iter().filter_map(|(name, level)| Some((name, Self { one: level?, many: level? }))).collect()
    }

    /// For one ray.
    #[inline(always)]
    pub(crate) fn token(self) -> Detected {
        self.one
    }

    /// For rays that are walked together.
    #[inline(always)]
    pub(crate) fn of_many(self) -> Detected {
        self.many
    }
}
