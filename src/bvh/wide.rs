//! Nodes of eight children.

use super::frame::Frame;

/// Eight children, 256 bytes, four cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    /// Least x, y, z, then greatest x, y, z, of every child.
    pub(crate) planes: [[f32; 8]; 6],
    /// A node's number, or [`LEAF`] | a leaf's number, or [`NONE`].
    pub(crate) children: [u32; 8],
    pub(crate) spare: [u32; 8],
}

pub(crate) const LEAF: u32 = 1 << 31;
pub(crate) const NONE: u32 = u32::MAX;

impl WideNode {
    /// No children: boxes that every ray misses.
    pub(crate) const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [-f32::INFINITY; 8],
            [-f32::INFINITY; 8],
            [-f32::INFINITY; 8],
        ],
        children: [NONE; 8],
        spare: [0; 8],
    };
}

/// A tree of wide nodes; the root is node 0.
#[derive(Clone, Debug)]
pub(crate) struct Wide {
    pub(crate) frame: Frame,
    /// Leaves are numbered from zero in depth-first order.
    pub(crate) nodes: Vec<WideNode>,
}

impl Wide {
    pub(crate) fn memory(&self) -> usize {
        self.nodes.capacity() * size_of::<WideNode>()
    }
}
