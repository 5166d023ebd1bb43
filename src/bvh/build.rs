//! The binary tree: binned surface area heuristic, top down (Wald 2007), in place and deterministic at any number of
//! threads.

use super::frame::Frame;
use crate::Aabb;

/// An object's box in the frame; four lanes, so that a box is two vectors. The fourth of `max` is the object's number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    min: [f32; 4],
    max: [f32; 4],
}

impl Item {
    pub(crate) fn index(&self) -> u32 {
        self.max[3].to_bits()
    }
}

/// A node of the binary tree. A leaf holds `count` items from `first`; an inner node (`count` = 0) has its left child
/// behind itself and its right child at `first`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) min: [f32; 3],
    pub(crate) first: u32,
    pub(crate) max: [f32; 3],
    pub(crate) count: u32,
}

/// The binary tree; `nodes[0]` is the root unless there are no items.
#[derive(Debug)]
pub(crate) struct Binary {
    pub(crate) frame: Frame,
    pub(crate) items: Vec<Item>,
    pub(crate) nodes: Vec<Node>,
}

const BINS: usize = 16;
/// Below this depth items are halved by number, which ends within 32 more levels.
const DEEPEST_SAH: u32 = 64;
/// Fewer items than this are not worth a thread.
#[cfg(feature = "rayon")]
const PARALLEL: usize = 4096;
/// What entering an inner node costs, in tests of a leaf.
const NODE_COST: f32 = 0.4;

/// Builds the tree over objects 0..count with the boxes given, with at most `leaf` of them in a leaf.
pub(crate) fn build(count: usize, bounds: &(dyn Fn(usize) -> Aabb + Sync), leaf: usize) -> Binary {
    assert!(count < 1 << 31, "{count} objects are too many for one tree");
    let mut whole = Aabb::EMPTY;
    for i in 0..count {
        let b = bounds(i);
        if !b.is_empty() && b.is_finite() {
            whole = whole.union(b);
        }
    }
    let frame = Frame::around(whole);
    let mut items = Vec::with_capacity(count);
    for i in 0..count {
        let b = bounds(i);
        let holds_nothing = b.is_empty() && !b.min.is_nan() && !b.max.is_nan();
        if !holds_nothing {
            let (min, max) = frame.outward(&b);
            let (min, max) = ([min[0], min[1], min[2], 0.0], [max[0], max[1], max[2], f32::from_bits(i as u32)]);
            items.push(Item { min, max });
        }
    }
    let vacant = Node { min: [0.0; 3], first: 0, max: [0.0; 3], count: 0 };
    let mut nodes = vec![vacant; (2 * items.len()).saturating_sub(1)];
    if !items.is_empty() {
        let bounds = Box3::around(&items);
        subdivide(&mut items, &mut nodes, bounds, Place { item: 0, node: 0, depth: 0 }, leaf);
    }
    Binary { frame, items, nodes }
}

#[derive(Clone, Copy)]
struct Place {
    item: u32,
    node: u32,
    depth: u32,
}

/// A box in f32 being grown; plain comparisons, so that NaN never enters and the compiler uses vector minima.
#[derive(Clone, Copy, Debug)]
struct Box3 {
    min: [f32; 4],
    max: [f32; 4],
}

impl Box3 {
    const EMPTY: Self = Self { min: [f32::INFINITY; 4], max: [f32::NEG_INFINITY; 4] };

    #[inline(always)]
    fn grow(&mut self, min: &[f32; 4], max: &[f32; 4]) {
        for i in 0..4 {
            self.min[i] = if min[i] < self.min[i] { min[i] } else { self.min[i] };
            self.max[i] = if max[i] > self.max[i] { max[i] } else { self.max[i] };
        }
    }

    #[inline(always)]
    fn half_area(&self) -> f32 {
        half_area(&three(self.min), &three(self.max))
    }

    fn around(items: &[Item]) -> Self {
        let mut b = Self::EMPTY;
        for i in items {
            b.grow(&i.min, &i.max);
        }
        b
    }
}

fn three([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

/// Half the surface of a box; infinite boxes have a large finite one, so that sums stay comparable.
#[inline(always)]
pub(crate) fn half_area(min: &[f32; 3], max: &[f32; 3]) -> f32 {
    let side = |i: usize| (max[i] - min[i]).clamp(0.0, 1e9);
    let (x, y, z) = (side(0), side(1), side(2));
    x * y + y * z + z * x
}

/// Twice the centre, kept finite.
#[inline(always)]
fn middle(item: &Item, axis: usize) -> f32 {
    let sum = item.min[axis] + item.max[axis];
    if sum.abs() <= 4.0 { sum } else { 0.0 }
}

fn subdivide(items: &mut [Item], nodes: &mut [Node], bounds: Box3, at: Place, leaf: usize) {
    let n = items.len();
    let (min, max) = (three(bounds.min), three(bounds.max));
    let Some((mid, left, right)) = split(items, &bounds, at.depth, leaf) else {
        nodes[0] = Node { min, first: at.item, max, count: n as u32 };
        return;
    };
    let (node, rest) = nodes.split_at_mut(1);
    let (before, after) = rest.split_at_mut(2 * mid - 1);
    let (lower, upper) = items.split_at_mut(mid);
    let left_at = Place { item: at.item, node: at.node + 1, depth: at.depth + 1 };
    let right_at = Place { item: at.item + mid as u32, node: at.node + 2 * mid as u32, depth: at.depth + 1 };
    node[0] = Node { min, first: right_at.node, max, count: 0 };
    let mut first = || subdivide(lower, before, left, left_at, leaf);
    let mut second = || subdivide(upper, after, right, right_at, leaf);
    #[cfg(feature = "rayon")]
    if n >= PARALLEL {
        rayon::join(first, second);
        return;
    }
    first();
    second();
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box3,
    count: u32,
}

/// Reorders the items into two parts: the number in the first, and their boxes. `None` if they should be one leaf.
fn split(items: &mut [Item], bounds: &Box3, depth: u32, leaf: usize) -> Option<(usize, Box3, Box3)> {
    let n = items.len();
    if n == 1 {
        return None;
    }
    let halve = |items: &mut [Item]| {
        let (a, b) = items.split_at(n / 2);
        Some((n / 2, Box3::around(a), Box3::around(b)))
    };
    let mut centers = Box3::EMPTY;
    for i in &*items {
        let m = [middle(i, 0), middle(i, 1), middle(i, 2), 0.0];
        centers.grow(&m, &m);
    }
    let mut scale = [0.0f32; 3];
    for (axis, scale) in scale.iter_mut().enumerate() {
        let extent = centers.max[axis] - centers.min[axis];
        // Just below BINS, so that the largest centre falls into the last bin. Subnormal extents divide to infinity.
        let s = BINS as f32 * (1.0 - 1e-6) / extent;
        *scale = if extent > 0.0 && s.is_finite() { s } else { 0.0 };
    }
    if scale == [0.0; 3] || depth >= DEEPEST_SAH {
        return if n <= leaf { None } else { halve(items) };
    }
    let bin_of =
        |item: &Item, axis: usize| (((middle(item, axis) - centers.min[axis]) * scale[axis]) as usize).min(BINS - 1);
    let mut bins = [[Bin { bounds: Box3::EMPTY, count: 0 }; BINS]; 3];
    for item in &*items {
        for (axis, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[bin_of(item, axis)];
            bin.count += 1;
            bin.bounds.grow(&item.min, &item.max);
        }
    }
    // A leaf is tested as one, however many lanes it fills.
    let leaves = |count: u32| count.div_ceil(leaf as u32) as f32;
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&a| scale[a] > 0.0) {
        let bins = &bins[axis];
        let mut costs = [0.0f32; BINS];
        let (mut b, mut count) = (Box3::EMPTY, 0);
        for i in (1..BINS).rev() {
            b.grow(&bins[i].bounds.min, &bins[i].bounds.max);
            count += bins[i].count;
            costs[i] = if count == 0 { f32::INFINITY } else { b.half_area() * leaves(count) };
        }
        let (mut b, mut count) = (Box3::EMPTY, 0);
        for i in 1..BINS {
            b.grow(&bins[i - 1].bounds.min, &bins[i - 1].bounds.max);
            count += bins[i - 1].count;
            let cost = if count == 0 { f32::INFINITY } else { b.half_area() * leaves(count) + costs[i] };
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    let area = bounds.half_area();
    if n <= leaf && best.0 + NODE_COST * area >= area {
        return None;
    }
    let (_, axis, boundary) = best;
    if boundary == 0 {
        return halve(items);
    }
    let (mut left, mut right) = (Box3::EMPTY, Box3::EMPTY);
    let (mut i, mut j) = (0, n);
    while i < j {
        if bin_of(&items[i], axis) < boundary {
            left.grow(&items[i].min, &items[i].max);
            i += 1;
        } else {
            j -= 1;
            right.grow(&items[i].min, &items[i].max);
            items.swap(i, j);
        }
    }
    Some((i, left, right))
}
