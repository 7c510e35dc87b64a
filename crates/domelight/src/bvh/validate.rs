//! Checks a finished tree against the assumptions of the traversal.

use super::build::MAX_DEPTH;
use super::{Block, Bvh, Child, Node, WIDTH};
use crate::geometry::Aabb;
use crate::math::Vec3;
use crate::simd::lane_of;

/// A defect in a BVH, which would be a bug in the builder.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BvhDefect {
    /// A child's box does not contain a triangle or box below it.
    #[error("child {child} of node {node} does not contain its subtree: {bounds:?}")]
    Bounds {
        /// The node.
        node: usize,
        /// Which of its children.
        child: usize,
        /// The child's box.
        bounds: Aabb,
    },
    /// A reference beyond the nodes or blocks.
    #[error("child {child} of node {node} refers to nothing")]
    Dangling {
        /// The node.
        node: usize,
        /// Which of its children.
        child: usize,
    },
    /// A path that overflows the traversal's stack.
    #[error("node {node} is deeper than {MAX_DEPTH} levels")]
    Depth {
        /// The node.
        node: usize,
    },
    /// Nodes, blocks or triangles that are reached by no path or by several paths.
    #[error("the tree reaches {reached} of {count} {what}")]
    Coverage {
        /// The kind of object.
        what: &'static str,
        /// The number of visits.
        reached: usize,
        /// The number of objects.
        count: usize,
    },
    /// A triangle that is in two blocks.
    #[error("triangle {triangle} is in the BVH twice")]
    Repeated {
        /// The triangle.
        triangle: u32,
    },
}

pub(super) fn validate(bvh: &Bvh) -> Result<(), BvhDefect> {
    if let Some(instances) = &bvh.instances {
        instances.objects().iter().try_for_each(validate)?;
    }
    let mut seen = Seen::default();
    let root = seen.visit(bvh, 0, 0)?;
    if root != bvh.bounds {
        return Err(BvhDefect::Bounds { node: 0, child: 0, bounds: bvh.bounds });
    }
    seen.ids.sort_unstable();
    if let Some(pair) = seen.ids.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(BvhDefect::Repeated { triangle: pair[0] });
    }
    covers("nodes", seen.nodes, bvh.nodes.len())?;
    covers("blocks", seen.blocks, bvh.blocks.len())?;
    covers("triangles", seen.ids.len(), bvh.triangle_count)
}

fn covers(what: &'static str, reached: usize, count: usize) -> Result<(), BvhDefect> {
    if reached == count { Ok(()) } else { Err(BvhDefect::Coverage { what, reached, count }) }
}

/// The nodes, blocks and triangles reached so far.
#[derive(Default)]
struct Seen {
    nodes: usize,
    blocks: usize,
    ids: Vec<u32>,
}

impl Seen {
    /// Checks the subtree of a node; returns the exact box of its triangles.
    fn visit(&mut self, bvh: &Bvh, index: usize, depth: u32) -> Result<Aabb, BvhDefect> {
        if depth >= MAX_DEPTH {
            return Err(BvhDefect::Depth { node: index });
        }
        self.nodes += 1;
        let node = &bvh.nodes[index];
        let mut whole = Aabb::EMPTY;
        for lane in 0..WIDTH {
            let bounds = child_bounds(node, lane);
            if bounds.is_empty() {
                continue;
            }
            let child = node.children[lane];
            let end = if child.is_leaf() { bvh.blocks.len() } else { bvh.nodes.len() };
            // Depth first: a node comes after its parent, so the tree has no cycle.
            if child.index() >= end || !child.is_leaf() && child.index() <= index {
                return Err(BvhDefect::Dangling { node: index, child: lane });
            }
            if self.content(bvh, child, depth)? != bounds {
                return Err(BvhDefect::Bounds { node: index, child: lane, bounds });
            }
            whole = whole.union(bounds);
        }
        Ok(whole)
    }

    fn content(&mut self, bvh: &Bvh, child: Child, depth: u32) -> Result<Aabb, BvhDefect> {
        if !child.is_leaf() {
            return self.visit(bvh, child.index(), depth + 1);
        }
        self.blocks += 1;
        let block = &bvh.blocks[child.index()];
        self.ids.extend(block.ids.iter().filter(|&&id| id != Block::NONE));
        Ok(block_bounds(block))
    }
}

fn child_bounds(node: &Node, lane: usize) -> Aabb {
    let corner =
        |side: usize| Vec3::from_array([0, 1, 2].map(|axis| node.planes[axis][side][lane]));
    Aabb { min: corner(0), max: corner(1) }
}

fn block_bounds(block: &Block) -> Aabb {
    let present = (0..WIDTH).filter(|&lane| block.ids[lane] != Block::NONE);
    Aabb::around(
        present.flat_map(|lane| {
            block.vertices.each_ref().map(|vertex| Vec3::from(lane_of(vertex, lane)))
        }),
    )
}
