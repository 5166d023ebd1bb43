//! Walking the tree with one ray.
//!
//! Everything down to the box test is inlined into one function per instruction level; the leaves' closures too, if
//! they say so.

use super::slab::LocalRay;
use super::wide::{CHILDREN, LEAF, NONE, Wide, WideNode, near_rows};
use fearless_simd::{Simd, f32x8, i32x8, prelude::*};

/// What is left to visit. Kept in a fixed array; what does not fit, which no sensible tree needs, goes to the heap.
/// Array and heap are the caller's, so that the length stays in a register.
struct Stack<'a, E> {
    entries: &'a mut Entries<E>,
    len: usize,
    spilled: &'a mut Spilled<E>,
}

/// Nothing, as a rule, which one word tells.
type Spilled<E> = Option<Box<Vec<E>>>;

/// Aligned, since it is cleared by vectors.
#[repr(align(32))]
struct Entries<E>([E; ROOM]);

const ROOM: usize = 32;

impl<'a, E: Copy + PartialOrd> Stack<'a, E> {
    #[inline(always)]
    fn new(entries: &'a mut Entries<E>, spilled: &'a mut Spilled<E>) -> Self {
        Self { entries, len: 0, spilled }
    }

    #[inline(always)]
    fn slot(&mut self, at: usize) -> &mut E {
        &mut self.entries.0[at & (ROOM - 1)]
    }

    /// Room for eight more.
    #[inline(always)]
    fn reserve(&mut self) {
        if self.len > ROOM - 8 {
            spill(self.spilled, &self.entries.0[..self.len]);
            self.len = 0;
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: E) {
        *self.slot(self.len) = entry;
        self.len += 1;
    }

    #[inline(always)]
    fn push_if(&mut self, entry: E, really: bool) {
        *self.slot(self.len) = entry;
        self.len += usize::from(really);
    }

    /// Pushes below all of the last `count` that are nearer.
    #[inline(always)]
    fn insert(&mut self, entry: E, count: usize) {
        let mut at = self.len;
        while at > self.len - count && *self.slot(at - 1) < entry {
            *self.slot(at) = *self.slot(at - 1);
            at -= 1;
        }
        *self.slot(at) = entry;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<E> {
        if self.len == 0 {
            return if self.spilled.is_some() { spilled(self.spilled) } else { None };
        }
        self.len -= 1;
        Some(*self.slot(self.len))
    }
}

#[cold]
#[inline(never)]
fn spill<E: Copy>(to: &mut Spilled<E>, entries: &[E]) {
    to.get_or_insert_default().extend_from_slice(entries);
}

/// Out of line: inlined, its load and that of the array are made one, of an address that takes longer to find.
#[cold]
#[inline(never)]
fn spilled<E>(entries: &mut Spilled<E>) -> Option<E> {
    entries.as_mut()?.pop()
}

#[inline(always)]
fn in_order(a: i64, b: i64) -> (i64, i64) {
    if a < b { (a, b) } else { (b, a) }
}

/// A vector in memory. Where it straddles two cache lines its lanes reach their loads late; unaligned it does so in
/// every other process.
#[repr(align(32))]
struct Row([f32; 8]);

impl Row {
    #[inline(always)]
    fn of<S: Simd>(v: f32x8<S>) -> Self {
        Self(v.into())
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> f32 {
        self.0[lane & 7]
    }
}

/// The first lane of these.
#[inline(always)]
fn lane_of(hits: u32) -> usize {
    hits.trailing_zeros() as usize & 7
}

/// A child, and the t where its box begins in the highest bits: as signed integers they sort as t does, but for
/// negative ones among themselves. Boxes that the ray starts in come first.
#[inline(always)]
fn entry(child: u32, t: f32) -> i64 {
    (u64::from(t.to_bits()) << 32 | u64::from(child)) as i64
}

/// Whether a child's box begins by `t_max`. `FORWARD`: no t is below zero, so that they compare as integers do.
#[inline(always)]
fn begins_by<const FORWARD: bool>(t_max: f32, child: i64) -> bool {
    if FORWARD { child <= entry(u32::MAX, t_max) } else { f32::from_bits((child >> 32) as u32) <= t_max }
}

#[inline(always)]
fn spread<S: Simd>(simd: S, v: &[f32; 4]) -> [f32x8<S>; 3] {
    [f32x8::splat(simd, v[0]), f32x8::splat(simd, v[1]), f32x8::splat(simd, v[2])]
}

#[inline(always)]
fn bits<S: Simd>(v: f32x8<S>) -> i32x8<S> {
    v.bitcast()
}

/// The ray's constants in every lane. `FORWARD`: none of its t before zero matters, as [`LocalRay::new`] has it.
pub(crate) struct Lanes<S: Simd, const FORWARD: bool> {
    inv: [f32x8<S>; 3],
    near_shift: [f32x8<S>; 3],
    far_shift: [f32x8<S>; 3],
    t_min: f32x8<S>,
    /// Where the rows of the planes met first begin, see [`near_rows`], and of those met last: in floats, so that an
    /// address needs no shift.
    near: [usize; 3],
    far: [usize; 3],
}

impl<S: Simd, const FORWARD: bool> Lanes<S, FORWARD> {
    #[inline(always)]
    pub(crate) fn new(simd: S, ray: &LocalRay) -> Self {
        debug_assert!(!FORWARD || ray.ends.t_min.is_sign_positive(), "the integers sort as the floats do");
        Self {
            inv: spread(simd, &ray.inv),
            near_shift: spread(simd, &ray.near_shift),
            far_shift: spread(simd, &ray.far_shift),
            t_min: f32x8::splat(simd, ray.ends.t_min),
            near: near_rows(ray.away).map(|row| 8 * row as usize),
            far: near_rows(ray.away).map(|row| 8 * (row ^ 1) as usize),
        }
    }

    /// Which of the node's boxes may be met before `t_max`, and from which t on.
    #[inline(always)]
    fn test(&self, simd: S, node: &WideNode, t_max: f32) -> (u32, f32x8<S>) {
        let [inv, near, far] = [&self.inv, &self.near_shift, &self.far_shift];
        let (near_x, far_x) = (node.row_from(simd, self.near[0]), node.row_from(simd, self.far[0]));
        let (near_y, far_y) = (node.row_from(simd, self.near[1]), node.row_from(simd, self.far[1]));
        let (near_z, far_z) = (node.row_from(simd, self.near[2]), node.row_from(simd, self.far[2]));
        let enter_x = near_x.mul_sub(inv[0], near[0]);
        let enter_y = near_y.mul_sub(inv[1], near[1]);
        let enter_z = near_z.mul_sub(inv[2], near[2]);
        let exit_x = far_x.mul_sub(inv[0], far[0]);
        let exit_y = far_y.mul_sub(inv[1], far[1]);
        let exit_z = far_z.mul_sub(inv[2], far[2]);
        let t_max = f32x8::splat(simd, t_max);
        if FORWARD {
            // As integers, which AVX2 compares in a quarter of the time: of a box that matters every exit is above
            // zero, and above every entry (§10).
            let enter = bits(enter_x).max(bits(enter_y)).max(bits(enter_z).max(bits(self.t_min)));
            let exit = bits(exit_x).min(bits(exit_y)).min(bits(exit_z).min(bits(t_max)));
            return (enter.simd_lt(exit).to_bitmask() as u32, enter.bitcast());
        }
        let enter = enter_x.max(enter_y).max(enter_z.max(self.t_min));
        let exit = exit_x.min(exit_y).min(exit_z.min(t_max));
        // Certainly a miss only if it enters after it has left; none of the two is NaN (§10).
        (enter.simd_le(exit).to_bitmask() as u32, enter)
    }
}

/// What is done at the leaves on the way to the nearest hit.
pub(crate) trait Closest<S: Simd> {
    /// Tests what leaf `leaf` holds and returns the t from which on nothing matters any more.
    fn leaf(&mut self, simd: S, leaf: u32) -> f32;
}

/// What is done at the leaves on the way to any hit.
pub(crate) trait Any<S: Simd> {
    /// Whether leaf `leaf` holds a hit.
    fn leaf(&mut self, simd: S, leaf: u32) -> bool;
}

/// Visits the leaves whose boxes `ray` meets before `t_max`, nearest first.
#[inline(always)]
pub(crate) fn closest<S: Simd, const FORWARD: bool>(
    simd: S,
    tree: &Wide,
    ray: &Lanes<S, FORWARD>,
    mut t_max: f32,
    leaves: &mut impl Closest<S>,
) {
    let nodes = &tree.nodes[..];
    let (mut entries, mut spilled) = (Entries([0; ROOM]), None);
    let mut stack = Stack::new(&mut entries, &mut spilled);
    let mut at = 0u32;
    loop {
        // Down to a leaf, or to nothing.
        while at & LEAF == 0 {
            let node = &nodes[at as usize];
            let (mut hits, enter) = ray.test(simd, node, t_max);
            // Stored at once, since lanes are read as soon as it is known which.
            let enter = Row::of(enter);
            if hits == 0 {
                at = NONE;
                break;
            }
            let child = Row::of(node.row(simd, CHILDREN as u32));
            let child = |lane: usize| child.lane(lane).to_bits();
            let first = lane_of(hits);
            hits &= hits - 1;
            if hits == 0 {
                at = child(first);
                continue;
            }
            stack.reserve();
            let of = |hits: u32| entry(child(lane_of(hits)), enter.lane(lane_of(hits)));
            let (a, b) = (entry(child(first), enter.lane(first)), of(hits));
            hits &= hits - 1;
            let (nearer, farther) = in_order(a, b);
            // Two or three without a branch on which, or on their order: nothing foretells it.
            let third = of(hits);
            let c = if hits == 0 { i64::MAX } else { third };
            let (c, farthest) = in_order(c, farther);
            let (nearest, farther) = in_order(nearer, c);
            stack.push_if(farthest, hits != 0);
            stack.push(farther);
            hits &= hits.wrapping_sub(1);
            if hits == 0 {
                at = nearest as u32;
                continue;
            }
            stack.push(nearest);
            let mut count = 3;
            while hits != 0 {
                stack.insert(of(hits), count);
                hits &= hits - 1;
                count += 1;
            }
            let Some(nearest) = stack.pop() else { return };
            at = nearest as u32;
        }
        if at != NONE {
            t_max = leaves.leaf(simd, at & !LEAF);
        }
        loop {
            let Some(next) = stack.pop() else { return };
            if begins_by::<FORWARD>(t_max, next) {
                at = next as u32;
                break;
            }
        }
    }
}

/// Visits the leaves whose boxes `ray` meets before `t_max`, in the nodes' fixed order, until one holds a hit.
#[inline(always)]
pub(crate) fn any<S: Simd, const FORWARD: bool>(
    simd: S,
    tree: &Wide,
    ray: &Lanes<S, FORWARD>,
    t_max: f32,
    leaves: &mut impl Any<S>,
) -> bool {
    let nodes = &tree.nodes[..];
    let (mut entries, mut spilled) = (Entries([0; ROOM]), None);
    let mut stack = Stack::new(&mut entries, &mut spilled);
    let mut at = 0u32;
    loop {
        while at & LEAF == 0 {
            let node = &nodes[at as usize];
            let (mut hits, _) = ray.test(simd, node, t_max);
            let child = Row::of(node.row(simd, CHILDREN as u32));
            let child = |lane: usize| child.lane(lane).to_bits();
            if hits == 0 {
                at = NONE;
                break;
            }
            at = child(hits.trailing_zeros() as usize);
            hits &= hits - 1;
            stack.reserve();
            // Two of the others without a branch on whether they are there.
            for _ in 0..2 {
                let i = (hits | 1).ilog2();
                stack.push_if(child(i as usize), hits != 0);
                hits &= !(1 << i);
            }
            while hits != 0 {
                let i = hits.ilog2();
                hits &= !(1 << i);
                stack.push(child(i as usize));
            }
        }
        if at != NONE && leaves.leaf(simd, at & !LEAF) {
            return true;
        }
        let Some(next) = stack.pop() else { return false };
        at = next;
    }
}
