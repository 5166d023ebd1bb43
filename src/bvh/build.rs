//! The binary tree: surface area heuristic, top down, in place and deterministic at any number of threads.

use super::frame::Frame;
use super::level::Level;
use super::split::{self, Split};
use super::tasks;
use crate::Aabb;
use fearless_simd::{Simd, dispatch, f32x4, f32x8, prelude::*};

/// An object's box in the frame. The last lanes hold the lower and the upper half of its number, as numbers: as bits
/// they would be subnormals, whose arithmetic is slow even where nobody wants its result.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item(pub(super) Box8);

impl Item {
    fn new(frame: &Frame, bounds: &Aabb, index: usize) -> Self {
        let ([x, y, z], [u, v, w]) = frame.outward(bounds);
        let (low, high) = ((index & 0xffff) as f32, (index >> 16 & 0xffff) as f32);
        Self(Box8([x, y, z, low, -u, -v, -w, high]))
    }

    pub(super) fn index(&self) -> u32 {
        self.0.0[3] as u32 | (self.0.0[7] as u32) << 16
    }

    /// Twice the centre; NaN for an infinite box.
    #[inline(always)]
    pub(super) fn middle<S: Simd>(&self, simd: S) -> f32x4<S> {
        let [x, y, z, i, u, v, w, j] = self.0.0;
        let (least, most): (f32x4<S>, f32x4<S>) = ([x, y, z, i].simd_into(simd), [u, v, w, j].simd_into(simd));
        least - most
    }
}

/// A box in f32: x, y, z of its least corner, anything, and those of its greatest corner negated, anything. So growing
/// it is one minimum.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Box8([f32; 8]);

impl Box8 {
    pub(super) const EMPTY: Self = Self([f32::INFINITY; 8]);

    #[inline(always)]
    pub(super) fn grow<S: Simd>(&mut self, simd: S, other: &Self) {
        let (a, b): (f32x8<S>, f32x8<S>) = (self.0.simd_into(simd), other.0.simd_into(simd));
        self.0 = a.min(b).into();
    }

    #[inline(always)]
    pub(super) fn around<S: Simd>(simd: S, items: &[Item]) -> Self {
        let mut b = Self::EMPTY;
        for i in items {
            b.grow(simd, &i.0);
        }
        b
    }

    /// Half the surface.
    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z, _, u, v, w, _] = self.0;
        let (x, y, z) = (x + u, y + v, z + w);
        x * y + y * z + z * x
    }

    fn corners(&self) -> ([f32; 3], [f32; 3]) {
        let [x, y, z, _, u, v, w, _] = self.0;
        ([x, y, z], [-u, -v, -w])
    }
}

/// A node of the binary tree. A leaf holds `count` items from `first`; an inner node (`count` = 0) has its children at
/// `first` and `first` + 1.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Node {
    pub(super) min: [f32; 3],
    pub(super) first: u32,
    pub(super) max: [f32; 3],
    pub(super) count: u32,
}

impl Node {
    const VACANT: Self = Self { min: [0.0; 3], first: 0, max: [0.0; 3], count: 0 };

    #[inline(always)]
    pub(super) fn is_leaf(&self) -> bool {
        self.count > 0
    }

    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        half_area(&self.min, &self.max)
    }
}

/// Half the surface of a box; infinite boxes have a large finite one, so that sums stay comparable.
#[inline(always)]
pub(super) fn half_area(min: &[f32; 3], max: &[f32; 3]) -> f32 {
    let side = |i: usize| if max[i] - min[i] < 1e9 { max[i] - min[i] } else { 1e9 };
    let (x, y, z) = (side(0), side(1), side(2));
    x * y + y * z + z * x
}

/// The binary tree; `nodes[0]` is the root, slot 1 is vacant, and siblings lie in pairs from slot 2 on. No nodes if
/// there are no items.
#[derive(Debug)]
pub(super) struct Binary {
    pub(super) frame: Frame,
    pub(super) items: Vec<Item>,
    pub(super) nodes: Vec<Node>,
}

/// The deepest leaf of a tree from `Binary::new`.
pub(super) const DEEPEST: u32 = 1 + split::DEEPEST_SAH + 32;

/// Fewer items than this are not worth a thread.
const PARALLEL: usize = 4096;

impl Binary {
    /// The tree over objects 0..count, whose boxes, if finite, lie in `whole`.
    pub(super) fn new(count: usize, whole: Aabb, bounds: &(impl Fn(usize) -> Aabb + Sync), leaf: u32) -> Self {
        assert!(count < 1 << 31, "{count} objects are too many for one tree");
        let frame = Frame::around(whole);
        // An item of no number stands for a box that holds nothing.
        let mut items = tasks::map(count, |i| {
            let b = bounds(i);
            let holds_nothing = b.is_empty() && !b.min.is_nan() && !b.max.is_nan();
            Item::new(&frame, &b, if holds_nothing { u32::MAX as usize } else { i })
        });
        items.retain(|i| i.index() != u32::MAX);
        // Those of infinite size last.
        let infinite = |i: &Item| i.0.half_area() == f32::INFINITY;
        let finite = items.len() - items.iter().filter(|i| infinite(i)).count();
        if finite < items.len() {
            items.sort_by_key(infinite);
        }
        let mut nodes = vec![Node::VACANT; 2 * items.len()];
        if !items.is_empty() {
            let (root, slots) = nodes.split_at_mut(2);
            let builder = Builder { level: Level::detect(), leaf, unit: unit(leaf) };
            let around = |items: &[Item]| dispatch!(builder.level.token(), simd => Box8::around(simd, items));
            let at = Place { item: 0, slot: 2, depth: 0 };
            root[0] = if 0 < finite && finite < items.len() {
                let (left, right) = items.split_at(finite);
                let (left, right) = (around(left), around(right));
                builder.inner(&mut items, slots, right, at, &Split { mid: finite, left, right })
            } else {
                let bounds = around(&items);
                builder.subdivide(&mut items, slots, bounds, at)
            };
        }
        Self { frame, items, nodes }
    }
}

/// So few items are not split any further: the collapse puts them into leaves as they are, or together with their
/// neighbours. Smaller units make better trees in less full leaves, and take longer.
fn unit(leaf: u32) -> usize {
    (leaf as usize * 3 / 4).max(1)
}

#[derive(Clone, Copy)]
struct Builder {
    level: Level,
    leaf: u32,
    unit: usize,
}

#[derive(Clone, Copy)]
struct Place {
    item: u32,
    slot: u32,
    depth: u32,
}

impl Builder {
    /// The subtree over `items`; the nodes below its root go to `slots`, at most 2·n − 2 of them.
    fn subdivide(self, items: &mut [Item], slots: &mut [Node], bounds: Box8, at: Place) -> Node {
        if items.len() <= self.unit {
            let (min, max) = bounds.corners();
            return Node { min, first: at.item, max, count: items.len() as u32 };
        }
        let split = dispatch!(self.level.token(), simd => split::split(simd, items, at.depth, self.leaf));
        self.inner(items, slots, bounds, at, &split)
    }

    fn inner(self, items: &mut [Item], slots: &mut [Node], bounds: Box8, at: Place, split: &Split) -> Node {
        let parallel = items.len() >= PARALLEL;
        let &Split { mid, left, right } = split;
        let (pair, rest) = slots.split_at_mut(2);
        let (before, after) = rest.split_at_mut(2 * mid - 2);
        let (lower, upper) = items.split_at_mut(mid);
        let left_at = Place { item: at.item, slot: at.slot + 2, depth: at.depth + 1 };
        let right_at = Place { item: at.item + mid as u32, slot: at.slot + 2 * mid as u32, depth: at.depth + 1 };
        let (l, r) = tasks::join(
            parallel,
            || self.subdivide(lower, before, left, left_at),
            || self.subdivide(upper, after, right, right_at),
        );
        pair[0] = l;
        pair[1] = r;
        let (min, max) = bounds.corners();
        Node { min, first: at.slot, max, count: 0 }
    }
}
