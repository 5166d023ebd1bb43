//! The local model: r_d I_d max(0, s·n) + r_a I_a + r_s I_s max(0, r·c)^α (Phong 1975), by its factors.
//!
//! All vectors are unit vectors that point away from the surface: n the normal, s to the light, c to the camera. r is
//! s mirrored about n.
//!
//! Where this deviates from the lecture's slides: the highlight is gated on s·n > 0. max(0, r·c) alone shines through
//! from behind: for s = −n, r = −n too, and a camera at c = −n would see a full highlight of a light it does not face.

use glam::DVec3;

/// v mirrored about n: 2(v·n)n − v.
#[must_use]
pub fn reflect(v: DVec3, n: DVec3) -> DVec3 {
    2.0 * v.dot(n) * n - v
}

/// max(0, s·n); NaN is dark.
#[must_use]
pub fn diffuse(s: DVec3, n: DVec3) -> f64 {
    s.dot(n).max(0.0)
}

/// max(0, r·c)^α where s·n > 0, else nothing.
///
/// ```
/// use truehit::{glam::DVec3, shading::phong};
/// let n = DVec3::Z;
/// assert_eq!(phong::specular(n, n, n, 50.0), 1.0);
/// // The light is straight behind the surface, and so is the camera: r·c = 1, and still nothing shines.
/// assert_eq!(phong::reflect(-n, n).dot(-n), 1.0);
/// assert_eq!(phong::specular(-n, n, -n, 50.0), 0.0);
/// ```
#[must_use]
pub fn specular(s: DVec3, n: DVec3, c: DVec3, shininess: f64) -> f64 {
    if s.dot(n) > 0.0 { reflect(s, n).dot(c).max(0.0).powf(shininess) } else { 0.0 }
}

/// How much of a light on a facet with normal `facet` an interpolated normal `n` may show: 1 where they agree, and
/// smoothly down to 0 as the light goes below the facet, where its shadow would cut the shading off in steps.
///
/// Source: Chiang, Li, Burley 2019, *Taming the Shadow Terminator*: with G = min(1, (s·facet) / ((s·n)(facet·n))),
/// the factor is −G³ + G² + G.
#[must_use]
pub fn terminator(s: DVec3, n: DVec3, facet: DVec3) -> f64 {
    let above = s.dot(facet);
    let shown = s.dot(n) * facet.dot(n);
    if above <= 0.0 {
        return 0.0;
    }
    // Also where the interpolated normal has turned more than 90° from the facet's.
    if n == facet || above >= shown {
        return 1.0;
    }
    let g = above / shown;
    g + g * g - g * g * g
}
