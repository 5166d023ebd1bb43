//! How often ordinary rays need more than a fast path.

use crate::kernels::{Entry, Origin};
use crate::support::cases::{Family, Kernel};
use truehit::kernel::tally::Tally;

/// How often a shipped kernel leaves its fast path on ordinary rays.
pub struct Fallbacks {
    pub kernel: Kernel,
    pub rays: usize,
    pub hits: usize,
    pub refined: usize,
    pub exact: usize,
}

pub fn of(family: &Family, entries: &[Entry], rays: usize) -> Fallbacks {
    let entry = entries.iter().find(|e| e.kernel == family.kernel && e.origin == Origin::Shipped);
    let entry = entry.expect("every shape has a shipped kernel");
    // Meshes and maps are made for each ray.
    let rays = if matches!(family.kernel, Kernel::Mesh | Kernel::Affine | Kernel::Polygon) { rays / 10 } else { rays };
    let mut f = Fallbacks { kernel: family.kernel, rays, hits: 0, refined: 0, exact: 0 };
    for i in 0..rays {
        let (answer, tally) = entry.counted(&family.case(i)).expect("ordinary shapes are legal");
        f.hits += usize::from(answer.is_some());
        f.refined += usize::from(tally != Tally::default());
        f.exact += usize::from(tally.exact > 0);
    }
    f
}
