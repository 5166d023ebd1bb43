//! Subtrees are moved to where they cost less (Meister and Bittner 2018, "Parallel reinsertion for bounding volume
//! hierarchy optimization").
//!
//! In every pass the largest nodes, the largest first, look for their best place in the tree as it is, some dozens of
//! them in parallel; their moves are then made one after the other, the best first, but for those that touch a node
//! already touched. So the tree does not depend on the number of threads. Deviations: few at a time, so that most find
//! the tree as it will be; moves that would make the tree deeper than [`DEEPEST`] are left out.

use super::build;
use super::node::Node;
use super::tasks;
use super::watch::Watch;
use std::collections::BinaryHeap;

/// In each pass one node in so many looks around; more do where the first ones have found something.
const SHARES: [usize; 4] = [20, 10, 10, 10];
const STEPS: usize = 64;
/// The last pass is one in which no more than one node in so many has found a better place.
const CONTENT: usize = 32;
/// Fewer are not worth a step, nor threads.
const FEW: usize = 16;
const PARALLEL: usize = 32;

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
    let count = nodes.len();
    watch.phase(0.8, SHARES.iter().map(|share| count.div_ceil(*share)).sum());
    if count > 8 {
        let mut tree = Tree::new(nodes);
        for share in SHARES {
            let chosen = tree.count.div_ceil(share);
            if tree.pass(chosen, watch) <= chosen / CONTENT || watch.stopped() {
                return;
            }
        }
    }
}

struct Tree<'a> {
    nodes: &'a mut [Node],
    parents: Vec<u32>,
    /// Levels below each node.
    heights: Vec<u8>,
    /// How many nodes may look around.
    count: usize,
    /// Nodes that this step has changed, and which they are.
    touched: Vec<bool>,
    changed: Vec<u32>,
}

impl<'a> Tree<'a> {
    fn new(nodes: &'a mut [Node]) -> Self {
        let n = nodes.len();
        let (mut parents, mut heights) = (vec![0; n], vec![0u8; n]);
        let mut count = 0usize;
        // Children lie after their parents.
        for (i, node) in nodes.iter().enumerate().rev() {
            if !node.is_leaf() {
                let first = node.first() as usize;
                parents[first] = i as u32;
                parents[first + 1] = i as u32;
                heights[i] = 1 + heights[first].max(heights[first + 1]);
                count += 2;
            }
        }
        // The root's children have nowhere else to go.
        let count = count.saturating_sub(2);
        Self { nodes, parents, heights, count, touched: vec![false; n], changed: Vec::new() }
    }

    /// The largest nodes, in order, but for the root and its children. No node is larger than its parent.
    fn largest(&self, chosen: usize) -> Vec<u32> {
        // Areas are not negative, so their bits sort as they do.
        let key = |i: u32| u64::from(self.node(i).half_area().to_bits()) << 32 | u64::from(!i);
        let mut heap = BinaryHeap::from([key(0)]);
        let mut largest = Vec::with_capacity(chosen);
        while largest.len() < chosen
            && let Some(top) = heap.pop()
        {
            let i = !(top as u32);
            if i != 0 && self.parent(i) != 0 {
                largest.push(i);
            }
            let node = self.node(i);
            if !node.is_leaf() {
                heap.extend([key(node.first()), key(node.first() + 1)]);
            }
        }
        largest
    }

    /// How many of the `chosen` largest nodes have found a better place.
    fn pass(&mut self, chosen: usize, watch: &Watch) -> usize {
        let largest = self.largest(chosen);
        let mut found = 0;
        for step in largest.chunks((chosen / STEPS).max(FEW)) {
            let search = |stack: &mut Vec<_>, i: usize| self.best_move(step[i], stack);
            let moves = tasks::map_with(step.len() >= PARALLEL, step.len(), Vec::new, search);
            let mut moves: Vec<Move> = moves.into_iter().filter(|m| m.gain > 0.0).collect();
            moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.from.cmp(&b.from)));
            found += moves.len();
            for m in &moves {
                self.make(m);
            }
            for i in self.changed.drain(..) {
                self.touched[i as usize] = false;
            }
            watch.add(step.len());
            if watch.stopped() {
                break;
            }
        }
        found
    }

    fn node(&self, i: u32) -> &Node {
        &self.nodes[i as usize]
    }

    fn parent(&self, i: u32) -> u32 {
        self.parents[i as usize]
    }

    /// The best new place of `from`; no gain if there is none better than where it is.
    fn best_move(&self, from: u32, stack: &mut Vec<(f32, u32)>) -> Move {
        let node = *self.node(from);
        let area = node.half_area();
        let parent = self.parent(from);
        let mut best = Move { gain: 0.0, from, to: 0 };
        // What taking it away saves: its parent vanishes, and those above shrink to what is left in them.
        let mut saved = self.node(parent).half_area();
        let mut rest = *self.node(from ^ 1);
        let (mut sibling, mut above) = (from ^ 1, parent);
        loop {
            self.consider(saved, sibling, &node, area, &mut best, stack);
            while let Some((left, first)) = stack.pop() {
                if left - area > best.gain {
                    self.consider(left, first + 1, &node, area, &mut best, stack);
                    self.consider(left, first, &node, area, &mut best, stack);
                }
            }
            if above != parent {
                rest = rest.union(self.node(sibling));
                saved += self.node(above).half_area() - rest.half_area();
            }
            if above == 0 {
                return best;
            }
            sibling = above ^ 1;
            above = self.parent(above);
        }
    }

    /// The place beside `at`, where `left` is what is saved less what those above grow by; and, on the stack, those
    /// below.
    #[inline(always)]
    fn consider(&self, left: f32, at: u32, node: &Node, area: f32, best: &mut Move, stack: &mut Vec<(f32, u32)>) {
        let there = self.node(at);
        let gain = left - there.common_area(node);
        if gain > best.gain && at != best.from ^ 1 && at != self.parent(best.from) {
            best.gain = gain;
            best.to = at;
        }
        // Whatever it joins becomes no smaller than itself.
        let left = gain + there.half_area();
        if left - area > best.gain && !there.is_leaf() {
            stack.push((left, there.first()));
        }
    }

    /// The nodes that a move gives a new content or a new parent.
    fn changed_by(&self, m: &Move) -> [u32; 5] {
        [m.to, m.from, m.from ^ 1, self.parent(m.to), self.parent(m.from)]
    }

    /// Makes the move unless it meets an earlier one of the step.
    fn make(&mut self, m: &Move) {
        let &Move { from, to, .. } = m;
        let changed = self.changed_by(m);
        if changed.iter().any(|&i| self.touched[i as usize]) || self.depth_after(m) > DEEPEST {
            return;
        }
        for i in changed {
            self.touched[i as usize] = true;
        }
        self.changed.extend(changed);
        let (sibling, parent) = (from ^ 1, self.parent(from));
        let (stays, there) = (*self.node(sibling), *self.node(to));
        // The pair of `from` moves below `to`; what was at `to` becomes the other one of it.
        self.nodes[to as usize] = there.above(from & !1);
        self.nodes[sibling as usize] = there;
        self.nodes[parent as usize] = stays;
        self.heights[parent as usize] = self.heights[sibling as usize];
        self.heights[sibling as usize] = self.heights[to as usize];
        for i in [sibling, parent] {
            let node = self.nodes[i as usize];
            if !node.is_leaf() {
                self.parents[node.first() as usize] = i;
                self.parents[node.first() as usize + 1] = i;
            }
        }
        self.parents[sibling as usize] = to;
        self.parents[from as usize] = to;
        self.refit(to);
        self.refit(parent);
    }

    /// Too deep if earlier moves have taken its new place below it: in exact arithmetic no two moves that both gain
    /// could.
    fn depth_after(&self, m: &Move) -> u32 {
        let (mut depth, mut at) = (1, m.to);
        while at != 0 {
            at = self.parent(at);
            depth += 1;
            if at == m.from {
                return u32::MAX;
            }
        }
        depth + u32::from(self.heights[m.from as usize].max(self.heights[m.to as usize]))
    }

    /// Boxes and heights from `at` up to the root.
    fn refit(&mut self, mut at: u32) {
        loop {
            let node = *self.node(at);
            if !node.is_leaf() {
                let (l, r) = (node.first(), node.first() + 1);
                self.nodes[at as usize] = self.node(l).union(self.node(r)).above(l);
                self.heights[at as usize] = 1 + self.heights[l as usize].max(self.heights[r as usize]);
            }
            if at == 0 {
                return;
            }
            at = self.parent(at);
        }
    }
}
