//! From the binary tree to nodes of eight: the child with the largest surface is opened until there are eight.

use super::build::{Binary, Item, Node, half_area};
use super::wide::{LEAF, NONE, Wide, WideNode};

impl Wide {
    /// Packs `binary`; reorders its items so that leaf i's come before leaf i + 1's, and its nodes' `first` with them.
    pub(crate) fn collapse(binary: &Binary) -> Self {
        let mut nodes = vec![WideNode::EMPTY];
        if !binary.nodes.is_empty() {
            let sizes = binary.sizes();
            // (binary node, wide node to fill)
            let mut work = vec![(0u32, 0u32)];
            while let Some((from, to)) = work.pop() {
                let (mut children, count) = open(&binary.nodes, from);
                // Any-hit queries take the lanes in turn: where there is least to test first.
                children[..count].sort_by_key(|&c| sizes[c as usize]);
                let mut wide = WideNode::EMPTY;
                let first = nodes.len() as u32;
                let mut inner = 0;
                for (lane, &child) in children[..count].iter().enumerate() {
                    let node = &binary.nodes[child as usize];
                    for axis in 0..3 {
                        wide.rows[axis][lane] = node.min[axis];
                        wide.rows[axis + 3][lane] = node.max[axis];
                    }
                    let word = if node.count > 0 {
                        // Numbered later, in the order of the items.
                        LEAF | node.first
                    } else {
                        nodes.push(WideNode::EMPTY);
                        inner += 1;
                        first + inner - 1
                    };
                    wide.set_child(lane, word);
                }
                for lane in (0..count).rev() {
                    if wide.child(lane) & LEAF == 0 {
                        work.push((children[lane], wide.child(lane)));
                    }
                }
                nodes[to as usize] = wide;
            }
            number_leaves(&mut nodes, binary.items.len());
        }
        nodes.shrink_to_fit();
        Self { frame: binary.frame, nodes }
    }
}

/// Leaves are known by their first item so far; the items' order, which is depth-first, gives them their numbers.
fn number_leaves(nodes: &mut [WideNode], items: usize) {
    let is_leaf = |c: u32| c != NONE && c & LEAF != 0;
    let mut number = vec![0u32; items];
    for n in &*nodes {
        for c in (0..8).map(|lane| n.child(lane)).filter(|&c| is_leaf(c)) {
            number[(c & !LEAF) as usize] = 1;
        }
    }
    let mut count = 0;
    for n in &mut number {
        let starts = *n;
        *n = count;
        count += starts;
    }
    for n in nodes {
        for lane in 0..8 {
            let c = n.child(lane);
            if is_leaf(c) {
                n.set_child(lane, LEAF | number[(c & !LEAF) as usize]);
            }
        }
    }
}

/// The up to eight descendants of `from` that become one node's children; a leaf is its own.
fn open(nodes: &[Node], from: u32) -> ([u32; 8], usize) {
    let mut children = [from; 8];
    let mut count = 1;
    while count < 8 {
        let area = |&c: &u32| {
            let n = &nodes[c as usize];
            if n.count > 0 { -1.0 } else { half_area(&n.min, &n.max) }
        };
        let (mut widest, mut most) = (0, -1.0);
        for (i, c) in children[..count].iter().enumerate() {
            let a = area(c);
            if a > most {
                (widest, most) = (i, a);
            }
        }
        if most < 0.0 {
            break;
        }
        let opened = children[widest];
        children[widest] = opened + 1;
        children[count] = nodes[opened as usize].first;
        count += 1;
    }
    (children, count)
}

impl Binary {
    /// The number of items below each node.
    fn sizes(&self) -> Vec<u32> {
        let mut sizes = vec![0; self.nodes.len()];
        // Children lie behind their parents.
        for (i, node) in self.nodes.iter().enumerate().rev() {
            sizes[i] = match node {
                Node { count: 0, first, .. } if *first as usize > i => sizes[i + 1] + sizes[*first as usize],
                node => node.count,
            };
        }
        sizes
    }

    /// The objects in the order of the leaves.
    pub(crate) fn order(&self) -> Vec<u32> {
        self.items.iter().map(Item::index).collect()
    }

    /// Where each leaf's items start, in order, and the end.
    pub(crate) fn leaf_starts(&self) -> Vec<u32> {
        let mut starts = Vec::new();
        if !self.nodes.is_empty() {
            let mut work = vec![0u32];
            while let Some(i) = work.pop() {
                let node = &self.nodes[i as usize];
                if node.count > 0 {
                    starts.push(node.first);
                } else {
                    work.extend([node.first, i + 1]);
                }
            }
        }
        starts.push(self.items.len() as u32);
        starts
    }
}
