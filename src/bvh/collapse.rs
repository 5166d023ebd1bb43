//! From the binary tree to nodes of eight: the cut of least cost by dynamic programming (Ylitie, Karras, Laine 2017).

use super::build::{Binary, Item};
use super::frame::{Frame, FrameBox};
use super::node::Node;
use super::reinsert;
use super::tasks;
use super::watch::Watch;
use super::wide::{LEAF, Wide, WideNode};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A tree and what its leaves hold.
#[derive(Debug)]
pub(crate) struct Built {
    pub(crate) tree: Wide,
    /// The objects in the order of the leaves.
    pub(crate) objects: Vec<u32>,
    /// Leaf i holds `objects[starts[i]..starts[i + 1]]`.
    pub(crate) starts: Vec<u32>,
}

/// The tree over objects 0..count with the boxes given in `frame`, empty ones for no object, with at most `leaf` of
/// them in a leaf.
///
/// `None` if `watch` has stopped it; a tenth of its time is left to the caller.
pub(crate) fn build(
    count: usize,
    frame: Frame,
    bounds: &(impl Fn(usize) -> FrameBox + Sync),
    leaf: u32,
    watch: &Watch,
) -> Option<Built> {
    let mut binary = Binary::new(count, frame, bounds, leaf, watch);
    reinsert::reinsert(&mut binary.nodes, watch);
    watch.phase(0.9, 1);
    if watch.stopped() {
        return None;
    }
    Some(Plan::new(&binary, leaf).collapse(&binary))
}

/// What becomes of each binary node. Written by many threads, each its own entries.
struct Plan {
    /// Items below.
    sizes: Vec<AtomicU32>,
    /// Three bits for each number of lanes 2–8: how many of them the left child gets, or 0 for one lane fewer; and
    /// [`AS_LEAF`].
    choices: Vec<AtomicU32>,
    leaf: u32,
}

const AS_LEAF: u32 = 1;

/// Down to here subtrees are planned at the same time.
const PARALLEL_DEPTH: u32 = 8;
/// Subtrees of fewer objects are collapsed at the same time. Not to depend on the number of threads.
const PARALLEL: u32 = 1 << 14;

fn lanes_of_left(choices: u32, lanes: usize) -> usize {
    (choices >> (3 * lanes) & 7) as usize
}

impl Plan {
    fn new(binary: &Binary, leaf: u32) -> Self {
        let n = binary.nodes.len();
        let zeros = || (0..n).map(|_| AtomicU32::new(0)).collect();
        let plan = Self { sizes: zeros(), choices: zeros(), leaf };
        if n > 0 {
            plan.costs(binary, 0, 0);
        }
        plan
    }

    fn size(&self, at: u32) -> u32 {
        self.sizes[at as usize].load(Relaxed)
    }

    fn choices(&self, at: u32) -> u32 {
        self.choices[at as usize].load(Relaxed)
    }

    fn is_leaf(&self, at: u32) -> bool {
        self.choices(at) & AS_LEAF != 0
    }

    /// The least cost of node `at` in up to 1, 2, … 7 lanes.
    fn costs(&self, binary: &Binary, at: u32, depth: u32) -> [f32; 7] {
        let node = &binary.nodes[at as usize];
        let area = node.half_area();
        if node.is_leaf() {
            let items = &binary.items[node.first() as usize..][..node.count() as usize];
            self.sizes[at as usize].store(items.iter().map(Item::count).sum(), Relaxed);
            self.choices[at as usize].store(AS_LEAF, Relaxed);
            return [area; 7];
        }
        let below = |at| self.costs(binary, at, depth + 1);
        let (l, r) = tasks::join(depth < PARALLEL_DEPTH, || below(node.first()), || below(node.first() + 1));
        let size = self.size(node.first()) + self.size(node.first() + 1);
        self.sizes[at as usize].store(size, Relaxed);
        let mut choices = 0u32;
        let mut costs = [0.0f32; 9];
        if l[6] == l[0] && r[6] == r[0] {
            // More than one lane each is of no use.
            choices = 1 << (3 * 2) | 1 << (3 * 8);
            costs = [l[0] + r[0]; 9];
        } else {
            // All numbers of lanes beside each other, each with k of them for the left child.
            let mut padded = [f32::INFINITY; 16];
            padded[8..15].copy_from_slice(&r);
            let (mut best, mut of_left) = ([f32::INFINITY; 8], [0u32; 8]);
            for k in 1..8 {
                let right = &padded[8 - k..16 - k];
                for lane in 0..8 {
                    let cost = l[k - 1] + right[lane];
                    let less = cost < best[lane];
                    best[lane] = if less { cost } else { best[lane] };
                    of_left[lane] = if less { k as u32 } else { of_left[lane] };
                }
            }
            for lanes in 2..=8 {
                costs[lanes] = best[lanes - 1];
                choices |= of_left[lanes - 1] << (3 * lanes);
            }
        }
        let inner = costs[8] + area;
        let leaf = if size <= self.leaf { area } else { f32::INFINITY };
        if leaf <= inner {
            choices |= AS_LEAF;
        }
        costs[1] = leaf.min(inner);
        for lanes in 2..=7usize {
            if costs[lanes - 1] <= costs[lanes] {
                costs[lanes] = costs[lanes - 1];
                choices &= !(7 << (3 * lanes));
            }
        }
        self.choices[at as usize].store(choices, Relaxed);
        std::array::from_fn(|i| costs[i + 1])
    }

    fn expand(&self, nodes: &[Node], at: u32, mut lanes: usize, children: &mut Vec<u32>) {
        let choices = self.choices(at);
        while lanes > 1 && lanes_of_left(choices, lanes) == 0 {
            lanes -= 1;
        }
        if lanes == 1 {
            children.push(at);
            return;
        }
        let (first, k) = (nodes[at as usize].first(), lanes_of_left(choices, lanes));
        self.expand(nodes, first, k, children);
        self.expand(nodes, first + 1, lanes - k, children);
    }

    fn collapse(&self, binary: &Binary) -> Built {
        let mut top = Part::default();
        let mut subtrees = Vec::new();
        if binary.nodes.is_empty() {
            top.nodes.push(WideNode::EMPTY);
        } else {
            top.fill(self, binary, 0, |child| self.size(child) <= PARALLEL, &mut subtrees);
        }
        let parts = tasks::map(subtrees.len(), |i| {
            let mut part = Part::default();
            part.fill(self, binary, subtrees[i].0, |_| false, &mut Vec::new());
            part
        });
        let Part { mut nodes, mut objects, mut starts } = top;
        let total = |length: fn(&Part) -> usize| parts.iter().map(length).sum::<usize>();
        nodes.reserve_exact(total(|p| p.nodes.len() - 1));
        objects.reserve_exact(total(|p| p.objects.len()));
        starts.reserve_exact(total(|p| p.starts.len()) + 1);
        for (part, &(_, root)) in parts.into_iter().zip(&subtrees) {
            // Its root has a place among its siblings.
            let (node, leaf, object) = (nodes.len() as u32 - 1, starts.len() as u32, objects.len() as u32);
            let mut own = part.nodes.into_iter().map(|mut wide| {
                wide.renumber(node, leaf);
                wide
            });
            nodes[root as usize] = own.next().expect("a root");
            nodes.extend(own);
            objects.extend(part.objects);
            starts.extend(part.starts.into_iter().map(|s| s + object));
        }
        starts.push(objects.len() as u32);
        Built { tree: Wide { frame: binary.frame, nodes }, objects, starts }
    }
}

/// Wide nodes, the first of them the root of the others, and their leaves.
#[derive(Default)]
struct Part {
    nodes: Vec<WideNode>,
    objects: Vec<u32>,
    starts: Vec<u32>,
}

impl Part {
    /// The tree from the binary node `root` on. Children that `elsewhere` names are not filled but listed, with the
    /// numbers of their wide nodes.
    fn fill(
        &mut self,
        plan: &Plan,
        binary: &Binary,
        root: u32,
        elsewhere: impl Fn(u32) -> bool,
        list: &mut Vec<(u32, u32)>,
    ) {
        let mut children = Vec::new();
        let mut below = Vec::new();
        self.nodes.push(WideNode::EMPTY);
        // (binary node, wide node to fill)
        let mut work = vec![(root, 0u32)];
        while let Some((from, to)) = work.pop() {
            children.clear();
            if plan.is_leaf(from) {
                children.push(from);
            } else {
                plan.expand(&binary.nodes, from, 8, &mut children);
            }
            // Any-hit queries take the lanes in turn: where there is least to test first.
            children.sort_by_key(|&c| plan.size(c));
            let mut wide = WideNode::EMPTY;
            let inner_from = work.len();
            for (lane, &child) in children.iter().enumerate() {
                let node = &binary.nodes[child as usize];
                wide.set_box(lane, node.min(), node.max());
                let word = if plan.is_leaf(child) {
                    let number = self.starts.len() as u32;
                    self.starts.push(self.objects.len() as u32);
                    below.push(child);
                    while let Some(i) = below.pop() {
                        let node = &binary.nodes[i as usize];
                        if node.is_leaf() {
                            for item in &binary.items[node.first() as usize..][..node.count() as usize] {
                                self.objects.extend(item.objects());
                            }
                        } else {
                            below.extend([node.first() + 1, node.first()]);
                        }
                    }
                    LEAF | number
                } else {
                    let number = self.nodes.len() as u32;
                    self.nodes.push(WideNode::EMPTY);
                    if elsewhere(child) { &mut *list } else { &mut work }.push((child, number));
                    number
                };
                wide.set_child(lane, word);
            }
            work[inner_from..].reverse();
            self.nodes[to as usize] = wide;
        }
    }
}
