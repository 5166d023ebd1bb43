//! Walking the tree with one ray.
//!
//! Everything down to the box test is inlined into one function per instruction level; the leaves' closures too, if
//! they say so.

use super::slab::LocalRay;
use super::wide::{LEAF, NONE, Wide, WideNode};
use fearless_simd::{Simd, f32x8, prelude::*};

/// What is left to visit: a child and the t where its box begins. Kept in a fixed array; what does not fit, which no
/// sensible tree needs, goes to the heap.
struct Stack {
    children: [u32; Stack::ROOM],
    ts: [f32; Stack::ROOM],
    len: usize,
    spilled: Vec<(u32, f32)>,
}

impl Stack {
    const ROOM: usize = 32;

    #[inline(always)]
    fn new() -> Self {
        Self { children: [0; Self::ROOM], ts: [0.0; Self::ROOM], len: 0, spilled: Vec::new() }
    }

    /// Room for eight more.
    #[inline(always)]
    fn reserve(&mut self) {
        if self.len > Self::ROOM - 8 {
            self.spill();
        }
    }

    #[cold]
    #[inline(never)]
    fn spill(&mut self) {
        self.spilled.extend(self.children.iter().copied().zip(self.ts).take(self.len));
        self.len = 0;
    }

    #[inline(always)]
    fn push(&mut self, child: u32, t: f32) {
        let at = self.len & (Self::ROOM - 1);
        self.children[at] = child;
        self.ts[at] = t;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(u32, f32)> {
        if self.len == 0 {
            return self.unspill();
        }
        self.len -= 1;
        let at = self.len & (Self::ROOM - 1);
        Some((self.children[at], self.ts[at]))
    }

    #[inline(always)]
    fn unspill(&mut self) -> Option<(u32, f32)> {
        if self.spilled.is_empty() { None } else { self.spilled.pop() }
    }

    /// Sorts the last `count`, the nearest to the top.
    #[inline(always)]
    fn sort(&mut self, count: usize) {
        let base = self.len - count;
        for i in base + 1..self.len {
            let (child, t) = (self.children[i & (Self::ROOM - 1)], self.ts[i & (Self::ROOM - 1)]);
            let mut j = i;
            while j > base && self.ts[(j - 1) & (Self::ROOM - 1)] < t {
                self.children[j & (Self::ROOM - 1)] = self.children[(j - 1) & (Self::ROOM - 1)];
                self.ts[j & (Self::ROOM - 1)] = self.ts[(j - 1) & (Self::ROOM - 1)];
                j -= 1;
            }
            self.children[j & (Self::ROOM - 1)] = child;
            self.ts[j & (Self::ROOM - 1)] = t;
        }
    }
}

#[inline(always)]
fn row<S: Simd>(simd: S, node: &WideNode, row: u32) -> f32x8<S> {
    node.rows[row as usize & 7].simd_into(simd)
}

#[inline(always)]
fn spread<S: Simd>(simd: S, v: &[f32; 4]) -> [f32x8<S>; 3] {
    [f32x8::splat(simd, v[0]), f32x8::splat(simd, v[1]), f32x8::splat(simd, v[2])]
}

/// The ray's constants in every lane.
struct Lanes<S: Simd> {
    inv: [f32x8<S>; 3],
    near_shift: [f32x8<S>; 3],
    far_shift: [f32x8<S>; 3],
    t_min: f32x8<S>,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn new(simd: S, ray: &LocalRay) -> Self {
        Self {
            inv: spread(simd, &ray.inv),
            near_shift: spread(simd, &ray.near_shift),
            far_shift: spread(simd, &ray.far_shift),
            t_min: f32x8::splat(simd, ray.t_min),
        }
    }

    /// Which of the node's boxes the ray may meet before `t_max`, and from which t on.
    #[inline(always)]
    fn test(&self, simd: S, node: &WideNode, ray: &LocalRay, t_max: f32) -> (u32, f32x8<S>) {
        let [inv, near, far] = [&self.inv, &self.near_shift, &self.far_shift];
        let (near_x, far_x) = (row(simd, node, ray.planes[0]), row(simd, node, ray.planes[3]));
        let (near_y, far_y) = (row(simd, node, ray.planes[1]), row(simd, node, ray.planes[4]));
        let (near_z, far_z) = (row(simd, node, ray.planes[2]), row(simd, node, ray.planes[5]));
        let enter_x = near_x.mul_sub(inv[0], near[0]);
        let enter_y = near_y.mul_sub(inv[1], near[1]);
        let enter_z = near_z.mul_sub(inv[2], near[2]);
        let exit_x = far_x.mul_sub(inv[0], far[0]);
        let exit_y = far_y.mul_sub(inv[1], far[1]);
        let exit_z = far_z.mul_sub(inv[2], far[2]);
        let enter = enter_x.max(enter_y).max(enter_z.max(self.t_min));
        let exit = exit_x.min(exit_y).min(exit_z.min(f32x8::splat(simd, t_max)));
        // Certainly a miss only if it enters after it has left.
        let miss = enter.simd_gt(exit);
        (!(miss.to_bitmask() as u32) & 0xff, enter)
    }
}

/// What is done at the leaves on the way to the nearest hit.
pub(crate) trait Closest {
    /// Tests what leaf `leaf` holds and returns the t from which on nothing matters any more.
    fn leaf<S: Simd>(&mut self, simd: S, leaf: u32) -> f32;
}

/// What is done at the leaves on the way to any hit.
pub(crate) trait Any {
    /// Whether leaf `leaf` holds a hit.
    fn leaf<S: Simd>(&mut self, simd: S, leaf: u32) -> bool;
}

/// Visits the leaves whose boxes the ray meets, nearest first.
#[inline(always)]
pub(crate) fn closest<S: Simd>(simd: S, tree: &Wide, ray: &LocalRay, leaves: &mut impl Closest) {
    let lanes = Lanes::new(simd, ray);
    let nodes = &tree.nodes[..];
    let mut t_max = ray.t_max;
    let mut stack = Stack::new();
    let mut at = 0u32;
    loop {
        // Down to a leaf, or to nothing.
        while at & LEAF == 0 {
            let node = &nodes[at as usize];
            let (mut hits, enter) = lanes.test(simd, node, ray, t_max);
            if hits == 0 {
                at = NONE;
                break;
            }
            let enter: [f32; 8] = enter.into();
            let first = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            if hits == 0 {
                at = node.child(first);
                continue;
            }
            stack.reserve();
            let second = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            if hits == 0 {
                let (a, b) = if enter[first] <= enter[second] { (first, second) } else { (second, first) };
                stack.push(node.child(b), enter[b]);
                at = node.child(a);
                continue;
            }
            stack.push(node.child(first), enter[first]);
            stack.push(node.child(second), enter[second]);
            let mut count = 2;
            while hits != 0 {
                let i = hits.trailing_zeros() as usize & 7;
                hits &= hits - 1;
                stack.push(node.child(i), enter[i]);
                count += 1;
            }
            stack.sort(count);
            let Some((child, _)) = stack.pop() else { return };
            at = child;
        }
        if at != NONE {
            t_max = leaves.leaf(simd, at & !LEAF);
        }
        loop {
            let Some((child, t)) = stack.pop() else { return };
            if t <= t_max {
                at = child;
                break;
            }
        }
    }
}

/// Visits the leaves whose boxes the ray meets, in the nodes' fixed order, until one holds a hit.
#[inline(always)]
pub(crate) fn any<S: Simd>(simd: S, tree: &Wide, ray: &LocalRay, leaves: &mut impl Any) -> bool {
    let lanes = Lanes::new(simd, ray);
    let nodes = &tree.nodes[..];
    let mut stack = Stack::new();
    let mut at = 0u32;
    loop {
        if at & LEAF == 0 {
            let node = &nodes[at as usize];
            let (mut hits, _) = lanes.test(simd, node, ray, ray.t_max);
            stack.reserve();
            while hits != 0 {
                let i = 31 - hits.leading_zeros() as usize;
                hits &= !(1 << i);
                stack.push(node.child(i), 0.0);
            }
        } else if at != NONE && leaves.leaf(simd, at & !LEAF) {
            return true;
        }
        let Some((child, _)) = stack.pop() else { return false };
        at = child;
    }
}
