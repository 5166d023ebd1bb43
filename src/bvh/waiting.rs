//! The boxes that a bundle has yet to visit, nearest first, without a branch that could be mistaken: boxes are sorted
//! by a network, and all eight of a node are written wherever the next begin.

use fearless_simd::{Simd, f32x8, i32x8, mask32x8, prelude::*, u8x32};

/// Where the lane stands in a key, whose other bits are those of t.
const LANE: i32 = 7;

/// Of t, before it loses its last bits to the lane: seven units in the last place are less.
const ROUNDED: f32 = 1.0 / 524_288.0; // 2⁻¹⁹

/// From which t on the box is met, or a little less.
#[inline(always)]
pub(super) fn t_of(key: i32) -> f32 {
    f32::from_bits((key & !LANE).cast_unsigned())
}

/// Which of the node's boxes it is.
#[inline(always)]
pub(super) fn lane_of(key: i32) -> usize {
    (key & LANE) as usize
}

/// Keys of those lanes that are hit, the farthest first, and after them what means nothing. As signed integers they
/// sort as t does, but for negative ones among themselves. By Batcher's network, without a branch.
#[inline(always)]
pub(super) fn in_order<S: Simd>(simd: S, hits: mask32x8<S>, enter: f32x8<S>) -> [i32; 8] {
    let t: i32x8<S> = enter.abs().mul_add(f32x8::splat(simd, -ROUNDED), enter).bitcast();
    let lanes = i32x8::simd_from(simd, [0, 1, 2, 3, 4, 5, 6, 7]);
    let keys = hits.select(t & i32x8::splat(simd, !LANE) | lanes, i32x8::splat(simd, i32::MIN));
    let keys = exchange(simd, keys, turned(simd, keys, 1), 0b0101_0101);
    let keys = exchange(simd, keys, turned(simd, keys, 3), 0b0011_0011);
    let keys = exchange(simd, keys, turned(simd, keys, 1), 0b0101_0101);
    let keys = exchange(simd, keys, keys.reverse(), 0b0000_1111);
    let keys = exchange(simd, keys, turned(simd, keys, 2), 0b0011_0011);
    exchange(simd, keys, turned(simd, keys, 1), 0b0101_0101).into()
}

/// The larger of the two in these lanes, the lesser in the others.
#[inline(always)]
fn exchange<S: Simd>(simd: S, a: i32x8<S>, b: i32x8<S>, larger: u64) -> i32x8<S> {
    mask32x8::from_bitmask(simd, larger).select(a.max(b), a.min(b))
}

/// In lane i what was in lane i ^ `by`, which is less than four.
#[inline(always)]
fn turned<S: Simd>(simd: S, keys: i32x8<S>, by: u8) -> i32x8<S> {
    let mut bytes = [0; 32];
    for i in 0..32 {
        bytes[i as usize] = (i ^ (by << 2)) & 15;
    }
    keys.swizzle_dyn_within_blocks(u8x32::simd_from(simd, bytes))
}

/// Boxes left to visit, by node and lane. What does not fit, which no sensible tree needs, goes to the heap.
pub(super) struct Waiting {
    keys: [i32; ROOM + 8],
    nodes: [u32; ROOM + 8],
    len: usize,
    spilled: Vec<(i32, u32)>,
}

const ROOM: usize = 40;

impl Waiting {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { keys: [0; ROOM + 8], nodes: [0; ROOM + 8], len: 0, spilled: Vec::new() }
    }

    /// Adds the first `count` boxes of `node`.
    #[inline(always)]
    pub(super) fn push(&mut self, node: u32, count: u32, keys: [i32; 8]) {
        if self.len > ROOM {
            self.spill();
        }
        let at = self.len.min(ROOM);
        self.keys[at..at + 8].copy_from_slice(&keys);
        self.nodes[at..at + 8].copy_from_slice(&[node; 8]);
        self.len = at + count as usize;
    }

    #[cold]
    #[inline(never)]
    fn spill(&mut self) {
        let entries = self.keys.iter().zip(&self.nodes).map(|(&key, &node)| (key, node));
        self.spilled.extend(entries.take(self.len));
        self.len = 0;
    }

    /// The last one.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<(i32, u32)> {
        if self.len == 0 {
            return self.spilled.pop();
        }
        self.len -= 1;
        let at = self.len.min(ROOM + 7);
        Some((self.keys[at], self.nodes[at]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Level;
    use crate::kernel::search::Random;
    use fearless_simd::dispatch;

    /// Each lane that is hit once, farthest first, its t never more than it was and hardly less.
    #[test]
    fn keys_are_in_order() {
        let (mut random, mut keys_in_all) = (Random::new(3), 0);
        for case in 0..3_000 {
            let scale = 2f64.powf(40.0 * random.number());
            let mut t = [0.0; 8].map(|_: f32| (random.number() * scale) as f32);
            // Boxes that begin at once, or where the ray does.
            if case % 4 == 0 {
                (t[1], t[3], t[5]) = (t[2], t[2].next_up(), -(2f32.powi(-60)));
            }
            let hits = (random.number().abs() * 256.0) as u64 & 0xff;
            for (level, detected) in Level::all() {
                let keys: [i32; 8] = dispatch!(detected.token(), simd => {
                    in_order(simd, mask32x8::from_bitmask(simd, hits), f32x8::simd_from(simd, t))
                });
                let keys = &keys[..hits.count_ones() as usize];
                assert_eq!(keys.iter().fold(0, |lanes, &key| lanes | 1 << lane_of(key)), hits, "{level}: {t:?}");
                assert!(keys.is_sorted_by(|a, b| a > b), "{level}: {t:?}");
                for &key in keys {
                    let (was, is) = (t[lane_of(key)], t_of(key));
                    assert!(is <= was && was - is <= was.abs() * 4e-6, "{level}: {was} became {is}");
                }
                keys_in_all += keys.len();
            }
        }
        println!("{keys_in_all} keys in order");
        assert!(keys_in_all > 6_000);
    }

    #[test]
    fn what_does_not_fit_is_not_lost() {
        let (mut waiting, mut all) = (Waiting::new(), Vec::new());
        for node in 0..40 {
            let count = node * 5 % 9;
            waiting.push(node, count, [0, 1, 2, 3, 4, 5, 6, 7]);
            all.extend((0..count.cast_signed()).map(|key| (key, node)));
            for _ in 0..node % 3 {
                assert_eq!(waiting.pop(), all.pop());
            }
        }
        assert!(all.len() > ROOM + 8);
        while let Some(last) = all.pop() {
            assert_eq!(waiting.pop(), Some(last));
        }
        assert_eq!(waiting.pop(), None);
    }
}
