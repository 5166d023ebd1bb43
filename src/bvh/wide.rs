//! Nodes of eight children.

use super::frame::Frame;
use crate::Aabb;
use fearless_simd::{Simd, f32x8, prelude::*};

/// Eight children, 256 bytes, four cache lines.
///
/// Rows 0, 2, 4 are the least x, y, z of every child, 1, 3, 5 the greatest, [`CHILDREN`] what the child is, as the bits
/// of a float. One array of a power of two of rows, so that a row number needs no check.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    pub(crate) rows: [[f32; 8]; 8],
}

pub(crate) const CHILDREN: usize = 6;
/// Marks a leaf's number among the children; others are nodes' numbers.
pub(crate) const LEAF: u32 = 1 << 31;
/// No child, in a lane that every ray misses.
pub(crate) const NONE: u32 = u32::MAX;

impl WideNode {
    /// No children.
    pub(crate) const EMPTY: Self = {
        let (out, back) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Self { rows: [out, back, out, back, out, back, [f32::from_bits(NONE); 8], [0.0; 8]] }
    };

    /// See [`rows`](Self::rows).
    #[inline(always)]
    pub(crate) fn row<S: Simd>(&self, simd: S, row: u32) -> f32x8<S> {
        self.rows[row as usize & 7].simd_into(simd)
    }

    /// The row whose first float is number `start`, a multiple of eight.
    #[inline(always)]
    pub(crate) fn row_from<S: Simd>(&self, simd: S, start: usize) -> f32x8<S> {
        let start = start & 0x38;
        f32x8::from_slice(simd, &self.rows.as_flattened()[start..start + 8])
    }

    #[inline(always)]
    pub(crate) fn child(&self, lane: usize) -> u32 {
        self.rows[CHILDREN][lane & 7].to_bits()
    }

    pub(crate) fn set_box(&mut self, lane: usize, min: [f32; 3], max: [f32; 3]) {
        for axis in 0..3 {
            self.rows[2 * axis][lane] = min[axis];
            self.rows[2 * axis + 1][lane] = max[axis];
        }
    }

    pub(crate) fn set_child(&mut self, lane: usize, child: u32) {
        self.rows[CHILDREN][lane] = f32::from_bits(child);
    }

    /// Nodes are numbered from `node` on, leaves from `leaf` on.
    pub(crate) fn renumber(&mut self, node: u32, leaf: u32) {
        for lane in 0..8 {
            let child = self.child(lane);
            if child != NONE {
                self.set_child(lane, child + if child & LEAF != 0 { leaf } else { node });
            }
        }
    }
}

/// Which row of a node holds the plane met first, by axis, by rays for which bit i of `away` says that their
/// direction's coordinate i is negative; the other of the pair is met last.
#[inline(always)]
pub(super) fn near_rows(away: u32) -> [u32; 3] {
    [away & 1, 2 + (away >> 1 & 1), 4 + (away >> 2 & 1)]
}

/// A tree of wide nodes; the root is node 0.
#[derive(Clone, Debug)]
pub(crate) struct Wide {
    pub(crate) frame: Frame,
    /// Leaves are numbered from zero.
    pub(crate) nodes: Vec<WideNode>,
}

impl Wide {
    /// Boxes, eight at most, that hold everything in the tree.
    pub(crate) fn boxes(&self) -> impl Iterator<Item = Aabb> {
        let root = &self.nodes[0];
        (0..8).filter(|&lane| root.child(lane) != NONE).map(|lane| {
            let plane = |end: usize| [0, 2, 4].map(|row| root.rows[row + end][lane]);
            self.frame.back(plane(0), plane(1))
        })
    }

    pub(crate) fn memory(&self) -> usize {
        self.nodes.capacity() * size_of::<WideNode>()
    }
}
