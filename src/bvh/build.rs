//! The binary tree: surface area heuristic, top down, in place and deterministic at any number of threads.

use super::frame::{Frame, FrameBox};
use super::level::Level;
use super::node::Node;
use super::split::{self, Split};
use super::tasks;
use super::watch::Watch;
use fearless_simd::{Simd, dispatch, f32x4, f32x8, prelude::*};
use std::ops::Range;

/// The box in the frame around a run of objects. The last lanes hold the lower and the upper half of a number, as
/// numbers: as bits they would be subnormals, whose arithmetic is slow even where nobody wants its result. The number
/// is the first object's, and from bit [`COUNT`] on how many follow it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item(pub(super) Box8);

/// Objects have so many bits for their number.
const COUNT: u32 = 29;
/// The most objects of a run.
const LONGEST_RUN: u32 = 2;

impl Item {
    #[inline(always)]
    fn new(bounds: &FrameBox, first: usize, count: u32) -> Self {
        let ([x, y, z, _], [u, v, w, _]) = (bounds.least.to_array(), bounds.most.to_array());
        let number = first as u32 | (count - 1) << COUNT;
        let (low, high) = ((number & 0xffff) as f32, (number >> 16) as f32);
        Self(Box8([x, y, z, low, u, v, w, high]))
    }

    /// The numbers of its objects.
    pub(super) fn objects(&self) -> Range<u32> {
        let number = self.0.0[3] as u32 | (self.0.0[7] as u32) << 16;
        let first = number & ((1 << COUNT) - 1);
        first..first + (number >> COUNT) + 1
    }

    #[inline(always)]
    pub(super) fn count(&self) -> u32 {
        const { assert!(LONGEST_RUN == 2) };
        1 + u32::from(self.0.0[7] >= (1u32 << (COUNT - 16)) as f32)
    }

    /// Twice the centre; NaN for an infinite box.
    #[inline(always)]
    pub(super) fn middle<S: Simd>(&self, simd: S) -> f32x4<S> {
        let (least, most) = self.0.load(simd).split();
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
    pub(super) fn load<S: Simd>(&self, simd: S) -> f32x8<S> {
        self.0.simd_into(simd)
    }

    #[inline(always)]
    pub(super) fn grow<S: Simd>(&mut self, simd: S, other: &Self) {
        self.0 = self.load(simd).min(other.load(simd)).into();
    }

    #[inline(always)]
    pub(super) fn around<S: Simd>(simd: S, items: &[Item]) -> Self {
        let mut b = Self::EMPTY.load(simd);
        for i in items {
            b = b.min(i.0.load(simd));
        }
        Self(b.into())
    }

    /// Half the surface.
    #[inline(always)]
    fn half_area(&self) -> f32 {
        let [x, y, z, _, u, v, w, _] = self.0;
        let (x, y, z) = (x + u, y + v, z + w);
        x * y + y * z + z * x
    }

    /// Twice the centre's coordinate.
    #[inline(always)]
    pub(super) fn middle(&self, axis: usize) -> f32 {
        self.0[axis & 3] - self.0[4 + (axis & 3)]
    }

    fn corners(&self) -> ([f32; 3], [f32; 3]) {
        let [x, y, z, _, u, v, w, _] = self.0;
        ([x, y, z], [-u, -v, -w])
    }
}

/// The sides of a [`Box8`] in a register.
#[inline(always)]
pub(super) fn sides<S: Simd>(b: f32x8<S>) -> f32x4<S> {
    let (least, most) = b.split();
    least + most
}

/// The binary tree; `nodes[0]` is the root, slot 1 is vacant, and siblings lie in pairs from slot 2 on, after their
/// parents. No nodes if there are no items.
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
    /// The tree over objects 0..count, whose boxes in `frame` are given; empty ones hold no object.
    pub(super) fn new(
        count: usize,
        frame: Frame,
        bounds: &(impl Fn(usize) -> FrameBox + Sync),
        leaf: u32,
        watch: &Watch,
    ) -> Self {
        assert!(count < 1 << COUNT, "{count} objects are too many for one tree");
        let run = if leaf > 1 { LONGEST_RUN } else { 1 };
        watch.phase(0.2, count);
        let level = Level::detect();
        let around = |items: &[Item]| dispatch!(level.token(), simd => Box8::around(simd, items));
        let chunks = tasks::map(count.div_ceil(CHUNK), |chunk| {
            watch.add(CHUNK);
            let items = runs(chunk * CHUNK..count.min((chunk + 1) * CHUNK), bounds, run);
            let all = around(&items);
            (items, all)
        });
        let mut items = Vec::with_capacity(chunks.iter().map(|(items, _)| items.len()).sum());
        let mut all = Box8::EMPTY;
        for (chunk, b) in chunks {
            items.extend_from_slice(&chunk);
            all = Box8(std::array::from_fn(|i| all.0[i].min(b.0[i])));
        }
        // Those of infinite size last.
        let mut finite = items.len();
        if all.half_area() == f32::INFINITY {
            let infinite = |i: &Item| i.0.half_area() == f32::INFINITY;
            finite -= items.iter().filter(|i| infinite(i)).count();
            items.sort_by_key(infinite);
        }
        let mut nodes = Vec::with_capacity(items.len());
        watch.phase(0.6, items.len());
        if !items.is_empty() {
            nodes.extend([Node::VACANT; 2]);
            let builder = Builder { level, leaf, unit: unit(leaf), watch };
            let at = Place { item: 0, depth: 0 };
            nodes[0] = if 0 < finite && finite < items.len() {
                let (left, right) = items.split_at(finite);
                let (left, right) = (around(left), around(right));
                builder.inner(&mut items, &mut nodes, right, at, &Split { mid: finite, left, right })
            } else {
                builder.subdivide(&mut items, &mut nodes, all, at)
            };
        }
        Self { frame, items, nodes }
    }
}

/// Runs begin anew every so many objects, however many threads look for them.
const CHUNK: usize = 4096;

/// Objects that follow each other and lie together, as a mesh's neighbouring triangles often do, are one item: their
/// common box has at most this share of the surface of their own boxes.
const TOGETHER: f32 = 0.7;

fn runs(objects: Range<usize>, bounds: &impl Fn(usize) -> FrameBox, longest: u32) -> Vec<Item> {
    let mut items = Vec::with_capacity(objects.len());
    let mut run = (FrameBox::EMPTY, objects.start, 0, 0.0);
    for i in objects {
        let own = bounds(i);
        if own.is_empty() {
            continue;
        }
        let (common, first, count, sum) = run;
        let (union, area) = (common.union(&own), own.half_area());
        let sum = sum + area;
        // Not if anything is infinite, whose areas are too.
        if first + count as usize == i && count < longest && union.half_area() <= TOGETHER * sum && sum < f32::INFINITY
        {
            run = (union, first, count + 1, sum);
        } else {
            if count > 0 {
                items.push(Item::new(&common, first, count));
            }
            run = (own, i, 1, area);
        }
    }
    if run.2 > 0 {
        items.push(Item::new(&run.0, run.1, run.2));
    }
    items
}

/// So few objects are not split any further: the collapse puts them into leaves as they are, or together with their
/// neighbours. Smaller units make better trees in less full leaves, and take longer.
fn unit(leaf: u32) -> u32 {
    (leaf * 3 / 4).max(1)
}

#[derive(Clone, Copy)]
struct Builder<'a, 'b> {
    level: Level,
    leaf: u32,
    unit: u32,
    watch: &'a Watch<'b>,
}

#[derive(Clone, Copy)]
struct Place {
    item: u32,
    depth: u32,
}

impl Builder<'_, '_> {
    /// The subtree over `items`; the nodes below its root are appended to `nodes`.
    fn subdivide(self, items: &mut [Item], nodes: &mut Vec<Node>, bounds: Box8, at: Place) -> Node {
        let few = |items: &[Item]| {
            items.len() <= self.unit as usize && items.iter().map(Item::count).sum::<u32>() <= self.unit
        };
        if items.len() == 1 || few(items) || self.watch.stopped() {
            let (min, max) = bounds.corners();
            return Node::new(min, max, at.item, items.len() as u32);
        }
        let split = dispatch!(self.level.token(), simd => split::split(simd, items, at.depth, self.leaf.ilog2()));
        self.inner(items, nodes, bounds, at, &split)
    }

    fn inner(self, items: &mut [Item], nodes: &mut Vec<Node>, bounds: Box8, at: Place, split: &Split) -> Node {
        let n = items.len();
        let &Split { mid, left, right } = split;
        let pair = nodes.len();
        nodes.extend([Node::VACANT; 2]);
        let (lower, upper) = items.split_at_mut(mid);
        let left_at = Place { item: at.item, depth: at.depth + 1 };
        let right_at = Place { item: at.item + mid as u32, depth: at.depth + 1 };
        let (l, r) = if n >= PARALLEL && tasks::are_parallel() {
            let mut others = Vec::with_capacity(upper.len());
            let (l, r) = tasks::join(
                // As was just asked.
                true,
                || self.subdivide(lower, nodes, left, left_at),
                || self.subdivide(upper, &mut others, right, right_at),
            );
            let behind = nodes.len() as u32;
            nodes.extend(others.iter().map(|node| node.moved(behind)));
            (l, r.moved(behind))
        } else {
            (self.subdivide(lower, nodes, left, left_at), self.subdivide(upper, nodes, right, right_at))
        };
        if n >= PARALLEL {
            self.watch.add([mid, n - mid].into_iter().filter(|&n| n < PARALLEL).sum());
        }
        nodes[pair] = l;
        nodes[pair + 1] = r;
        let (min, max) = bounds.corners();
        Node::new(min, max, pair as u32, 0)
    }
}
