//! The broad phase: finds pairs of shapes that may touch, in the engine's order.
//!
//! There are two bounding box trees: one of moving shapes and one of resting shapes (sleeping ones included).
//! Contacts are solved in the order in which pairs are found, and ten iterations do not converge where two contacts
//! act on one body. Therefore the shape of the trees, the order of the moving leaves and the order of remembered pairs
//! equal the engine's.

use educe::Educe;

use rapier2d::prelude::{Aabb, BoundingVolume, Vector};

/// No node, leaf or pair.
const NONE: u32 = u32::MAX;
/// A moving leaf's box extends beyond its shape by this fraction of its size or, in the direction of motion, of its
/// velocity if that is more.
const MARGIN: f64 = 0.1_f32 as f64;
/// Numbers of bins that the engine's hash table of moving leaves can have.
const BINS: [u64; 9] = [5, 13, 23, 47, 97, 193, 389, 769, 1543];

/// Two shapes that may touch, and the remembered pair they come from, or [`NONE`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub first: u32,
    pub second: u32,
    pub pair: u32,
}

/// Bounds and velocity of a shape.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub bounds: Aabb,
    pub velocity: Vector,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Aabb,
    parent: u32,
    kind: Kind,
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Branch { a: u32, b: u32 },
    Leaf(Leaf),
}

#[derive(Debug, Clone, Copy)]
struct Leaf {
    shape: u32,
    /// The stamp of its box's latest renewal.
    stamp: u64,
    number: u64,
}

/// A remembered pair of leaves; the second reports it.
#[derive(Debug, Clone, Copy)]
struct Pair {
    leaves: [u32; 2],
    hint: u32,
}

/// The broad phase.
#[derive(Debug, Educe)]
#[educe(Clone, Default)]
pub(super) struct BroadPhase {
    nodes: Vec<Node>,
    free_nodes: Vec<u32>,
    /// Remembered pairs, the newest last.
    pairs: Vec<Pair>,
    #[educe(Default = NONE)]
    moving: u32,
    #[educe(Default = NONE)]
    resting: u32,
    /// Moving leaves in the order of the engine's hash table: by bin, the newest of a bin first.
    movers: Vec<u32>,
    /// The number of its bins.
    #[educe(Default = BINS[0])]
    bins: u64,
    /// Leaf of each shape; [`NONE`] for removed shapes.
    leaves: Vec<u32>,
    stamp: u64,
}

impl BroadPhase {
    /// Adds a shape that does not move.
    pub fn insert_resting(&mut self, shape: u32, number: u64, bounds: Aabb) {
        let leaf = self.new_leaf(shape, number, bounds);
        self.resting = self.insert(self.resting, leaf);
        if self.moving != NONE {
            self.query(self.moving, leaf, true, &mut |_| {});
        }
        self.stamp += 1;
    }

    /// Adds a shape that moves.
    pub fn insert_moving(&mut self, shape: u32, number: u64, extent: &Extent) {
        let leaf = self.new_leaf(shape, number, widened(extent));
        self.put_in_bin(leaf);
        self.make_bins(self.movers.len());
        self.moving = self.insert(self.moving, leaf);
        self.mark_leaf(leaf, &mut |_| {});
        self.stamp += 1;
    }

    /// The lasting effect of adding a moving shape and removing it at once: the engine's table may have grown.
    pub fn make_room(&mut self) {
        self.make_bins(self.movers.len() + 1);
    }

    pub fn remove_resting(&mut self, shape: u32) {
        let leaf = self.take_leaf(shape);
        self.resting = self.remove(self.resting, leaf);
        self.free_leaf(leaf);
    }

    pub fn remove_moving(&mut self, shape: u32) {
        let leaf = self.take_leaf(shape);
        self.movers.retain(|other| *other != leaf);
        self.moving = self.remove(self.moving, leaf);
        self.free_leaf(leaf);
    }

    /// Renews the boxes of moving shapes that left theirs, and lists all pairs that may touch, in solving order.
    pub fn update(&mut self, extent: impl Fn(u32) -> Extent, found: &mut Vec<Candidate>) {
        found.clear();
        if self.moving == NONE {
            return;
        }
        for index in 0..self.movers.len() {
            let leaf = self.movers[index];
            self.renew(leaf, &extent(self.leaf(leaf).shape));
        }
        self.mark_subtree(self.moving, &mut |candidate| found.push(candidate));
        self.stamp += 1;
    }

    pub fn hint(&self, pair: u32) -> u32 {
        if pair == NONE { 0 } else { self.pairs[pair as usize].hint }
    }

    pub fn set_hint(&mut self, pair: u32, hint: u32) {
        if pair != NONE {
            self.pairs[pair as usize].hint = hint;
        }
    }

    fn renew(&mut self, leaf: u32, extent: &Extent) {
        if self.nodes[leaf as usize].bounds.contains(&extent.bounds) {
            return;
        }
        self.nodes[leaf as usize].bounds = widened(extent);
        self.moving = self.remove(self.moving, leaf);
        self.moving = self.insert(self.moving, leaf);
        self.clear_pairs(leaf);
        if let Kind::Leaf(leaf) = &mut self.nodes[leaf as usize].kind {
            leaf.stamp = self.stamp;
        }
    }

    // Traversal.

    fn mark_subtree(&mut self, node: u32, found: &mut impl FnMut(Candidate)) {
        match self.nodes[node as usize].kind {
            Kind::Leaf(_) => self.mark_leaf(node, found),
            Kind::Branch { a, b } => {
                self.mark_subtree(a, found);
                self.mark_subtree(b, found);
            }
        }
    }

    fn mark_leaf(&mut self, leaf: u32, found: &mut impl FnMut(Candidate)) {
        let Leaf { stamp, shape, .. } = *self.leaf(leaf);
        if stamp == self.stamp {
            if self.resting != NONE {
                self.query(self.resting, leaf, false, found);
            }
            let mut node = leaf;
            while self.nodes[node as usize].parent != NONE {
                let parent = self.nodes[node as usize].parent;
                if let Kind::Branch { a, b } = self.nodes[parent as usize].kind {
                    if node == a {
                        self.query(b, leaf, true, found);
                    } else {
                        self.query(a, leaf, false, found);
                    }
                }
                node = parent;
            }
        } else {
            for (pair, Pair { leaves: [other, own], .. }) in self.pairs.iter().enumerate().rev() {
                if *own == leaf {
                    found(Candidate { first: self.leaf(*other).shape, second: shape, pair: pair as u32 });
                }
            }
        }
    }

    /// Finds the leaves of a subtree that intersect a leaf. If the leaf is left of the subtree, pairs are only
    /// remembered: they are reported when the other leaf is marked.
    fn query(&mut self, subtree: u32, leaf: u32, is_left: bool, found: &mut impl FnMut(Candidate)) {
        let node = self.nodes[subtree as usize];
        if !self.nodes[leaf as usize].bounds.intersects(&node.bounds) {
            return;
        }
        match node.kind {
            Kind::Branch { a, b } => {
                self.query(a, leaf, is_left, found);
                self.query(b, leaf, is_left, found);
            }
            Kind::Leaf(_) if is_left => self.remember(leaf, subtree),
            Kind::Leaf(other) => {
                let Leaf { stamp, shape, .. } = *self.leaf(leaf);
                if other.stamp < stamp {
                    self.remember(subtree, leaf);
                }
                found(Candidate { first: shape, second: other.shape, pair: NONE });
            }
        }
    }

    // Trees.

    /// Inserts a leaf where the boxes grow least; returns the subtree's root.
    fn insert(&mut self, subtree: u32, leaf: u32) -> u32 {
        if subtree == NONE {
            return leaf;
        }
        let bounds = self.nodes[leaf as usize].bounds;
        let Kind::Branch { a, b } = self.nodes[subtree as usize].kind else {
            return self.new_branch(leaf, subtree);
        };
        let (of_a, of_b) = (self.nodes[a as usize].bounds, self.nodes[b as usize].bounds);
        let mut cost_a = of_b.volume() + of_a.merged(&bounds).volume();
        let mut cost_b = of_a.volume() + of_b.merged(&bounds).volume();
        if cost_a == cost_b {
            (cost_a, cost_b) = (proximity(&of_a, &bounds), proximity(&of_b, &bounds));
        }
        let (a, b) = if cost_b < cost_a { (a, self.insert(b, leaf)) } else { (self.insert(a, leaf), b) };
        self.adopt(subtree, a, b);
        let node = &mut self.nodes[subtree as usize];
        node.bounds = node.bounds.merged(&bounds);
        subtree
    }

    /// Removes a leaf; its sibling takes the parent's place. Returns the subtree's root.
    fn remove(&mut self, subtree: u32, leaf: u32) -> u32 {
        if leaf == subtree {
            return NONE;
        }
        let parent = self.nodes[leaf as usize].parent;
        let Kind::Branch { a, b } = self.nodes[parent as usize].kind else { return subtree };
        let sibling = if a == leaf { b } else { a };
        let above = self.nodes[parent as usize].parent;
        self.free_nodes.push(parent);
        self.nodes[sibling as usize].parent = above;
        if parent == subtree {
            return sibling;
        }
        if let Kind::Branch { a, b } = self.nodes[above as usize].kind {
            let (a, b) = if a == parent { (sibling, b) } else { (a, sibling) };
            self.adopt(above, a, b);
        }
        let mut node = above;
        while node != NONE {
            if let Kind::Branch { a, b } = self.nodes[node as usize].kind {
                let merged = self.nodes[a as usize].bounds.merged(&self.nodes[b as usize].bounds);
                self.nodes[node as usize].bounds = merged;
            }
            node = self.nodes[node as usize].parent;
        }
        subtree
    }

    fn adopt(&mut self, parent: u32, a: u32, b: u32) {
        self.nodes[parent as usize].kind = Kind::Branch { a, b };
        self.nodes[a as usize].parent = parent;
        self.nodes[b as usize].parent = parent;
    }

    fn new_branch(&mut self, a: u32, b: u32) -> u32 {
        let bounds = self.nodes[a as usize].bounds.merged(&self.nodes[b as usize].bounds);
        let node = self.new_node(Node { bounds, parent: NONE, kind: Kind::Branch { a, b } });
        self.adopt(node, a, b);
        node
    }

    fn new_leaf(&mut self, shape: u32, number: u64, bounds: Aabb) -> u32 {
        let leaf = Leaf { shape, stamp: self.stamp, number };
        let node = self.new_node(Node { bounds, parent: NONE, kind: Kind::Leaf(leaf) });
        if self.leaves.len() <= shape as usize {
            self.leaves.resize(shape as usize + 1, NONE);
        }
        self.leaves[shape as usize] = node;
        node
    }

    fn new_node(&mut self, node: Node) -> u32 {
        if let Some(free) = self.free_nodes.pop() {
            self.nodes[free as usize] = node;
            return free;
        }
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    fn take_leaf(&mut self, shape: u32) -> u32 {
        std::mem::replace(&mut self.leaves[shape as usize], NONE)
    }

    fn free_leaf(&mut self, leaf: u32) {
        self.clear_pairs(leaf);
        self.free_nodes.push(leaf);
    }

    fn leaf(&self, node: u32) -> &Leaf {
        match &self.nodes[node as usize].kind {
            Kind::Leaf(leaf) => leaf,
            Kind::Branch { .. } => unreachable!("tables, pairs and `leaves` hold leaves"),
        }
    }

    // The order of moving leaves.

    /// Increases the number of bins if it does not exceed that of leaves.
    fn make_bins(&mut self, leaves: usize) {
        if (leaves as u64) < self.bins {
            return;
        }
        let Some(&more) = BINS.iter().find(|bins| **bins > self.bins) else { return };
        self.bins = more;
        for leaf in std::mem::take(&mut self.movers) {
            self.put_in_bin(leaf);
        }
    }

    fn put_in_bin(&mut self, leaf: u32) {
        let bin = |leaf: u32| self.leaf(leaf).number % self.bins;
        let place = self.movers.partition_point(|other| bin(*other) < bin(leaf));
        self.movers.insert(place, leaf);
    }

    // Remembered pairs.

    fn remember(&mut self, a: u32, b: u32) {
        self.pairs.push(Pair { leaves: [a, b], hint: 0 });
    }

    /// Forgets a leaf's pairs.
    fn clear_pairs(&mut self, leaf: u32) {
        self.pairs.retain(|pair| !pair.leaves.contains(&leaf));
    }
}

/// Twice the Manhattan distance between the centres.
fn proximity(a: &Aabb, b: &Aabb) -> f64 {
    (a.mins.x + a.maxs.x - b.mins.x - b.maxs.x).abs() + (a.mins.y + a.maxs.y - b.mins.y - b.maxs.y).abs()
}

/// A moving leaf's box, larger than the shape so that it need not be renewed in every step.
fn widened(extent: &Extent) -> Aabb {
    let Extent { bounds, velocity } = extent;
    let margin = (bounds.maxs - bounds.mins) * MARGIN;
    let ahead = *velocity * MARGIN;
    Aabb { mins: bounds.mins + (-margin).min(ahead), maxs: bounds.maxs + margin.max(ahead) }
}
