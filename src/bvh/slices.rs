//! Which rays of a slice are walked together: neighbours that look alike at a glance.

use super::RAYS;
use crate::{Interval, Ray};
use glam::DVec3;

/// A ray and the stretch of it that counts.
pub(crate) type Stretch = (Ray, Interval);

/// A bundle at a time by `together`, which is told how many rays count and may refuse, the others one by one. After a
/// refusal bundles are tried ever more seldom, so that rays without any order cost no more than alone. What is left of
/// the slice is tried if it `may` be a bundle.
pub(crate) fn each<T: Copy + Default>(
    rays: &[Stretch],
    hits: &mut [T],
    mut together: impl FnMut(&[Stretch; RAYS], usize, &mut [T; RAYS]) -> bool,
    may: impl Fn(&[Stretch]) -> bool,
    alone: impl Fn(&Stretch, &mut T),
) {
    const MOST_PATIENT: u32 = 64;
    let (mut wait, mut patience) = (0, 0);
    let (bundles, rest) = rays.as_chunks::<RAYS>();
    let (of_bundles, of_rest) = hits.as_chunks_mut::<RAYS>();
    for (rays, hits) in bundles.iter().zip(of_bundles) {
        if wait > 0 {
            wait -= 1;
        } else if together(rays, RAYS, hits) {
            patience = 0;
            continue;
        } else {
            wait = patience;
            patience = (2 * patience).clamp(1, MOST_PATIENT);
        }
        for (hit, ray) in hits.iter_mut().zip(rays) {
            alone(ray, hit);
        }
    }
    // The first two before all others: farther on memory would have to be waited for.
    if rest.len() >= FEWEST && wait == 0 && is_near(rest[0].0.direction, rest[1].0.direction) && may(rest) {
        // The last of them stands for those that are not there.
        let (mut rays, mut answers) = ([rest[rest.len() - 1]; RAYS], [T::default(); RAYS]);
        rays[..rest.len()].copy_from_slice(rest);
        if together(&rays, rest.len(), &mut answers) {
            of_rest.copy_from_slice(&answers[..rest.len()]);
            return;
        }
    }
    for (hit, ray) in of_rest.iter_mut().zip(rest) {
        alone(ray, hit);
    }
}

/// Fewer rays than this are no bundle; [`end_together`] looks at six.
const FEWEST: usize = 8;

/// Rays turned by more than this against each other, and ends farther apart, in lengths of the ray, are not tried as a
/// bundle: of the way that answers are found, not of the answers.
const TURNED: f64 = 0.5;
const APART: f64 = 1e-5;

/// A first look that costs next to nothing: whether a few directions are alike. [`Bundle::take`] looks at all.
pub(crate) fn go_together(rays: &[Stretch]) -> bool {
    let first = rays[0].0.direction;
    (1..4).all(|i| is_near(first, rays[i * (rays.len() - 1) / 3].0.direction))
}

/// Alike, whether the rays may end at one place, and most come there the way their neighbours do: they start at
/// surfaces, here and there at another than the one before.
pub(crate) fn end_together(rays: &[Stretch]) -> bool {
    let end = |(ray, within): &Stretch| ray.origin + within.max * ray.direction;
    let (first, last) = (end(&rays[0]), end(&rays[rays.len() - 1]));
    let way = rays[0].1.max.abs() * rays[0].0.direction.abs().max_element();
    let neighbours = |i: &usize| {
        let i = i * rays.len() / 5;
        is_near(rays[i].0.direction, rays[i + 1].0.direction)
    };
    (first - last).abs().max_element() <= way * APART && (1..5).filter(neighbours).count() >= 3
}

fn is_near(a: DVec3, b: DVec3) -> bool {
    (b - a).abs().max_element() <= TURNED * a.abs().max_element()
}
