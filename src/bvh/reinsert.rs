//! Subtrees are moved to where they cost less (Meister and Bittner 2018, "Parallel reinsertion for bounding volume
//! hierarchy optimization").
//!
//! In every pass the largest nodes look for their best place in the tree as it is, in parallel; the moves are then made
//! one after the other, the best first, but for those that touch a node already touched. So the tree does not depend on
//! the number of threads. Deviation: moves that would make the tree deeper than [`DEEPEST`] are left out.

use super::build::{self, Node};
use super::tasks;
use super::watch::Watch;
use std::collections::BinaryHeap;

/// Passes after which little is left to gain, and how many nodes, one in so many, look around in each.
const PASSES: u32 = 6;
const SHARE: usize = 20;

/// No leaf lies deeper than this.
pub(super) const DEEPEST: u32 = build::DEEPEST + 32;

/// Moving `from` to beside `to` saves this much area.
#[derive(Clone, Copy, Debug)]
struct Move {
    gain: f32,
    from: u32,
    to: u32,
}

/// Makes the tree cheaper in place; siblings stay in pairs.
pub(super) fn reinsert(nodes: &mut [Node], watch: &Watch) {
    watch.phase(0.8, PASSES as usize);
    if nodes.len() > 8 {
        let mut tree = Tree::new(nodes);
        for _ in 0..PASSES {
            if watch.stopped() {
                return;
            }
            tree.pass();
            watch.add(1);
        }
    }
}

struct Tree<'a> {
    nodes: &'a mut [Node],
    parents: Vec<u32>,
    /// Levels below each node.
    heights: Vec<u8>,
    /// How many nodes look around in a pass.
    chosen: usize,
    /// Nodes that this pass has changed.
    touched: Vec<bool>,
}

impl<'a> Tree<'a> {
    fn new(nodes: &'a mut [Node]) -> Self {
        let n = nodes.len();
        let (mut parents, mut heights) = (vec![0; n], vec![0u8; n]);
        let mut count = 0usize;
        // Children lie after their parents.
        for (i, node) in nodes.iter().enumerate().rev() {
            if !node.is_leaf() {
                let first = node.first as usize;
                parents[first] = i as u32;
                parents[first + 1] = i as u32;
                heights[i] = 1 + heights[first].max(heights[first + 1]);
                count += 2;
            }
        }
        // The root's children have nowhere else to go.
        let chosen = if count > 2 { (count - 2).div_ceil(SHARE) } else { 0 };
        Self { nodes, parents, heights, chosen, touched: vec![false; n] }
    }

    /// The largest nodes but for the root and its children. No node is larger than its parent.
    fn largest(&self) -> Vec<u32> {
        // Areas are not negative, so their bits sort as they do.
        let key = |i: u32| u64::from(self.node(i).half_area().to_bits()) << 32 | u64::from(!i);
        let mut heap = BinaryHeap::from([key(0)]);
        let mut largest = Vec::with_capacity(self.chosen);
        while largest.len() < self.chosen
            && let Some(top) = heap.pop()
        {
            let i = !(top as u32);
            if i != 0 && self.parent(i) != 0 {
                largest.push(i);
            }
            let node = self.node(i);
            if !node.is_leaf() {
                heap.extend([key(node.first), key(node.first + 1)]);
            }
        }
        // Neighbours one after the other.
        largest.sort_unstable();
        largest
    }

    fn pass(&mut self) {
        let largest = self.largest();
        let moves = tasks::map_with(largest.len(), Vec::new, |stack, i| self.best_move(largest[i], stack));
        let mut moves: Vec<Move> = moves.into_iter().filter(|m| m.gain > 0.0).collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.from.cmp(&b.from)));
        for m in &moves {
            self.make(m);
        }
        self.touched.fill(false);
    }

    fn node(&self, i: u32) -> &Node {
        &self.nodes[i as usize]
    }

    fn parent(&self, i: u32) -> u32 {
        self.parents[i as usize]
    }

    /// The best new place of `from`; no gain if there is none better than where it is.
    fn best_move(&self, from: u32, stack: &mut Vec<(f32, u32)>) -> Move {
        let node = self.node(from);
        let area = node.half_area();
        let parent = self.parent(from);
        let mut best = Move { gain: 0.0, from, to: 0 };
        // What taking it away saves: its parent vanishes, and those above shrink to what is left in them.
        let mut saved = self.node(parent).half_area();
        let mut rest = *self.node(from ^ 1);
        let (mut sibling, mut above) = (from ^ 1, parent);
        loop {
            // What is saved, less what those on the way down to here grow by; where.
            stack.push((saved, sibling));
            while let Some((left, at)) = stack.pop() {
                // Whatever it joins becomes no smaller than itself.
                if left - area <= best.gain {
                    continue;
                }
                let there = self.node(at);
                let gain = left - union(there, node).half_area();
                if gain > best.gain && at != from ^ 1 && at != parent {
                    best = Move { gain, from, to: at };
                }
                if !there.is_leaf() {
                    let left = gain + there.half_area();
                    if left - area > best.gain {
                        stack.push((left, there.first + 1));
                        stack.push((left, there.first));
                    }
                }
            }
            if above != parent {
                rest = union(&rest, self.node(sibling));
                saved += self.node(above).half_area() - rest.half_area();
            }
            if above == 0 {
                return best;
            }
            sibling = above ^ 1;
            above = self.parent(above);
        }
    }

    /// The nodes that a move gives a new content or a new parent.
    fn changed_by(&self, m: &Move) -> [u32; 5] {
        [m.to, m.from, m.from ^ 1, self.parent(m.to), self.parent(m.from)]
    }

    /// Makes the move unless it meets an earlier one of the pass.
    fn make(&mut self, m: &Move) {
        let &Move { from, to, .. } = m;
        let changed = self.changed_by(m);
        if changed.iter().any(|&i| self.touched[i as usize]) || self.depth_after(m) > DEEPEST {
            return;
        }
        for i in changed {
            self.touched[i as usize] = true;
        }
        let (sibling, parent) = (from ^ 1, self.parent(from));
        let (stays, there) = (*self.node(sibling), *self.node(to));
        // The pair of `from` moves below `to`; what was at `to` becomes the other one of it.
        self.nodes[to as usize] = Node { first: from & !1, count: 0, ..there };
        self.nodes[sibling as usize] = there;
        self.nodes[parent as usize] = stays;
        self.heights[parent as usize] = self.heights[sibling as usize];
        self.heights[sibling as usize] = self.heights[to as usize];
        for i in [sibling, parent] {
            let node = self.nodes[i as usize];
            if !node.is_leaf() {
                self.parents[node.first as usize] = i;
                self.parents[node.first as usize + 1] = i;
            }
        }
        self.parents[sibling as usize] = to;
        self.parents[from as usize] = to;
        self.refit(to);
        self.refit(parent);
    }

    fn depth_after(&self, m: &Move) -> u32 {
        let (mut depth, mut at) = (1, m.to);
        while at != 0 {
            at = self.parent(at);
            depth += 1;
        }
        depth + u32::from(self.heights[m.from as usize].max(self.heights[m.to as usize]))
    }

    /// Boxes and heights from `at` up to the root.
    fn refit(&mut self, mut at: u32) {
        loop {
            let node = *self.node(at);
            if !node.is_leaf() {
                let (l, r) = (node.first, node.first + 1);
                let Node { min, max, .. } = union(self.node(l), self.node(r));
                self.nodes[at as usize] = Node { min, max, ..node };
                self.heights[at as usize] = 1 + self.heights[l as usize].max(self.heights[r as usize]);
            }
            if at == 0 {
                return;
            }
            at = self.parent(at);
        }
    }
}

/// `a` grown to hold `b`.
#[inline(always)]
fn union(a: &Node, b: &Node) -> Node {
    let lesser = |x: f32, y: f32| if x < y { x } else { y };
    let greater = |x: f32, y: f32| if x > y { x } else { y };
    Node {
        min: std::array::from_fn(|i| lesser(a.min[i], b.min[i])),
        max: std::array::from_fn(|i| greater(a.max[i], b.max[i])),
        ..*a
    }
}
