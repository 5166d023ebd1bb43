//! From the binary tree to nodes of eight: the cut of least cost by dynamic programming (Ylitie, Karras, Laine 2017).

use super::build::{Binary, Item, Node};
use super::reinsert;
use super::watch::Watch;
use super::wide::{LEAF, Wide, WideNode};
use crate::Aabb;

/// A tree and what its leaves hold.
#[derive(Debug)]
pub(crate) struct Built {
    pub(crate) tree: Wide,
    /// The objects in the order of the leaves.
    pub(crate) objects: Vec<u32>,
    /// Leaf i holds `objects[starts[i]..starts[i + 1]]`.
    pub(crate) starts: Vec<u32>,
}

/// The tree over objects 0..count with the boxes given, which lie in `whole` if they are finite, with at most `leaf` of
/// them in a leaf.
///
/// `None` if `watch` has stopped it; a tenth of its time is left to the caller.
pub(crate) fn build(
    count: usize,
    whole: Aabb,
    bounds: &(impl Fn(usize) -> Aabb + Sync),
    leaf: u32,
    watch: &Watch,
) -> Option<Built> {
    let mut binary = Binary::new(count, whole, bounds, leaf, watch);
    reinsert::reinsert(&mut binary.nodes, watch);
    watch.phase(0.9, 1);
    if watch.stopped() {
        return None;
    }
    Some(Plan::new(&binary, leaf).collapse(&binary))
}

/// What becomes of each binary node.
struct Plan {
    /// Items below.
    sizes: Vec<u32>,
    /// Three bits for each number of lanes 2–8: how many of them the left child gets, or 0 for one lane fewer; and
    /// [`AS_LEAF`].
    choices: Vec<u32>,
    leaf: u32,
}

const AS_LEAF: u32 = 1;

fn lanes_of_left(choices: u32, lanes: usize) -> usize {
    (choices >> (3 * lanes) & 7) as usize
}

impl Plan {
    fn new(binary: &Binary, leaf: u32) -> Self {
        let n = binary.nodes.len();
        let mut plan = Self { sizes: vec![0; n], choices: vec![0; n], leaf };
        if n > 0 {
            plan.costs(binary, 0);
        }
        plan
    }

    /// The least cost of node `at` in up to 1, 2, … 7 lanes.
    fn costs(&mut self, binary: &Binary, at: u32) -> [f32; 7] {
        let node = &binary.nodes[at as usize];
        let area = node.half_area();
        if node.is_leaf() {
            let items = &binary.items[node.first as usize..][..node.count as usize];
            self.sizes[at as usize] = items.iter().map(Item::count).sum();
            self.choices[at as usize] = AS_LEAF;
            return [area; 7];
        }
        let l = self.costs(binary, node.first);
        let r = self.costs(binary, node.first + 1);
        let size = self.sizes[node.first as usize] + self.sizes[node.first as usize + 1];
        self.sizes[at as usize] = size;
        let mut choices = 0u32;
        let mut costs = [0.0f32; 9];
        for lanes in 2..=8usize {
            let mut best = (f32::INFINITY, 0);
            for k in 1..lanes {
                let c = l[k - 1] + r[lanes - k - 1];
                if c < best.0 {
                    best = (c, k);
                }
            }
            costs[lanes] = best.0;
            choices |= (best.1 as u32) << (3 * lanes);
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
        self.choices[at as usize] = choices;
        std::array::from_fn(|i| costs[i + 1])
    }

    fn expand(&self, nodes: &[Node], at: u32, mut lanes: usize, children: &mut Vec<u32>) {
        let choices = self.choices[at as usize];
        while lanes > 1 && lanes_of_left(choices, lanes) == 0 {
            lanes -= 1;
        }
        if lanes == 1 {
            children.push(at);
            return;
        }
        let (first, k) = (nodes[at as usize].first, lanes_of_left(choices, lanes));
        self.expand(nodes, first, k, children);
        self.expand(nodes, first + 1, lanes - k, children);
    }

    fn collapse(&self, binary: &Binary) -> Built {
        let mut wide_nodes = vec![WideNode::EMPTY];
        let (mut objects, mut starts) = (Vec::with_capacity(binary.items.len()), Vec::new());
        let mut children = Vec::new();
        let mut below = Vec::new();
        let mut work = Vec::new();
        if !binary.nodes.is_empty() {
            // (binary node, wide node to fill)
            work.push((0u32, 0u32));
        }
        while let Some((from, to)) = work.pop() {
            children.clear();
            if self.choices[from as usize] & AS_LEAF != 0 {
                children.push(from);
            } else {
                self.expand(&binary.nodes, from, 8, &mut children);
            }
            // Any-hit queries take the lanes in turn: where there is least to test first.
            children.sort_by_key(|&c| self.sizes[c as usize]);
            let mut wide = WideNode::EMPTY;
            let inner_from = work.len();
            for (lane, &child) in children.iter().enumerate() {
                let node = &binary.nodes[child as usize];
                wide.set_box(lane, node.min, node.max);
                let word = if self.choices[child as usize] & AS_LEAF != 0 {
                    let number = starts.len() as u32;
                    starts.push(objects.len() as u32);
                    below.push(child);
                    while let Some(i) = below.pop() {
                        let node = &binary.nodes[i as usize];
                        if node.is_leaf() {
                            let items = &binary.items[node.first as usize..][..node.count as usize];
                            objects.extend(items.iter().flat_map(Item::objects));
                        } else {
                            below.extend([node.first + 1, node.first]);
                        }
                    }
                    LEAF | number
                } else {
                    let number = wide_nodes.len() as u32;
                    wide_nodes.push(WideNode::EMPTY);
                    work.push((child, number));
                    number
                };
                wide.set_child(lane, word);
            }
            work[inner_from..].reverse();
            wide_nodes[to as usize] = wide;
        }
        starts.push(objects.len() as u32);
        wide_nodes.shrink_to_fit();
        Built { tree: Wide { frame: binary.frame, nodes: wide_nodes }, objects, starts }
    }
}
