//! A node of the binary tree.

use glam::{Vec4, Vec4Swizzles};

/// A leaf holds `count` items from `first`; an inner node (`count` = 0) has its children at `first` and `first` + 1.
/// Both are bits of the fourth coordinates, of floats that are not subnormal, whose arithmetic is slow even where
/// nobody wants its result. Some are NaN, and are only copied.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Node {
    min: Vec4,
    max: Vec4,
}

/// Numbers are below it.
const ORDINARY: u32 = 1 << 30;

const fn ordinary(number: u32) -> f32 {
    f32::from_bits(number | ORDINARY)
}

/// No side is longer, so that the areas of infinite boxes stay comparable.
const LONGEST: Vec4 = Vec4::splat(1e9);

impl Node {
    /// Not there yet.
    pub(super) const VACANT: Self = Self::new([0.0; 3], [0.0; 3], 0, ORDINARY - 1);

    pub(super) const fn new([x, y, z]: [f32; 3], [u, v, w]: [f32; 3], first: u32, count: u32) -> Self {
        Self { min: Vec4::new(x, y, z, ordinary(first)), max: Vec4::new(u, v, w, ordinary(count)) }
    }

    pub(super) fn min(&self) -> [f32; 3] {
        self.min.truncate().into()
    }

    pub(super) fn max(&self) -> [f32; 3] {
        self.max.truncate().into()
    }

    #[inline(always)]
    pub(super) fn first(&self) -> u32 {
        self.min.w.to_bits() & !ORDINARY
    }

    #[inline(always)]
    pub(super) fn count(&self) -> u32 {
        self.max.w.to_bits() & !ORDINARY
    }

    #[inline(always)]
    pub(super) fn is_leaf(&self) -> bool {
        self.count() > 0
    }

    /// Half the surface of the box.
    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let sides = (self.max - self.min).min(LONGEST);
        let p = sides * sides.yzxw();
        p.x + p.y + p.z
    }

    /// Grown to hold `other`, the rest as it is.
    #[inline(always)]
    pub(super) fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min).with_w(self.min.w), max: self.max.max(other.max).with_w(self.max.w) }
    }

    /// Half the surface of the box around both.
    #[inline(always)]
    pub(super) fn common_area(&self, other: &Self) -> f32 {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }.half_area()
    }

    /// The same box around the children at `first`.
    #[inline(always)]
    pub(super) fn above(&self, first: u32) -> Self {
        Self::new(self.min(), self.max(), first, 0)
    }

    /// With its children, if it has any, so many slots further.
    pub(super) fn moved(&self, by: u32) -> Self {
        if self.is_leaf() { *self } else { self.above(self.first() + by) }
    }
}
