//! Top-down construction with the binned surface area heuristic, eight children at once.
//!
//! A node starts as one range of triangles; the range of the largest surface is split in two until
//! there are eight. A split minimises area × blocks over equal bins of the centroids on each axis
//! (Wald 2007). Past a certain depth ranges are halved instead, which bounds the depth of the tree
//! and with it the traversal's stack, whatever the input.

use rayon::prelude::*;

use super::{Block, Bvh, BvhError, Child, InstructionSet, Lanes, Node, WIDTH};
use crate::geometry::Aabb;
use crate::math::Vec3;

/// Triangle numbers and block numbers share 31 bits.
const MAX_TRIANGLES: usize = (1 << 31) - 1;
/// Levels of nodes that the heuristic may make. Halving adds at most 10: 8¹⁰ blocks are plenty.
const MAX_HEURISTIC_DEPTH: u32 = 24;
/// Levels of nodes in any tree.
pub(super) const MAX_DEPTH: u32 = MAX_HEURISTIC_DEPTH + 10;
/// Ranges below this size are not worth a task of their own.
const PARALLEL_THRESHOLD: usize = 4096;
const MAX_BINS: usize = 32;

/// A triangle's box and number.
#[derive(Clone, Copy)]
struct Primitive {
    bounds: Aabb,
    id: u32,
}

impl Primitive {
    fn centroid(&self) -> Vec3 {
        0.5 * self.bounds.min + 0.5 * self.bounds.max
    }
}

/// The tree before it is laid out.
enum Tree<'a> {
    Leaf(&'a [Primitive]),
    Inner(Vec<(Aabb, Self)>),
}

pub(super) fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Bvh, BvhError> {
    let mut primitives = primitives(positions, triangles)?;
    let root = Range::new(&mut primitives);
    let bounds = root.bounds;
    let triangle_count = root.primitives.len();
    let tree = if triangle_count == 0 {
        Tree::Inner(Vec::new())
    } else if root.fits_a_leaf() {
        Tree::Inner(vec![(bounds, Tree::Leaf(root.primitives))])
    } else {
        subtree(root, 0)
    };
    let mut layout = Layout { positions, triangles, nodes: Vec::new(), blocks: Vec::new() };
    if let Tree::Inner(children) = &tree {
        layout.push_node(children);
    }
    let Layout { nodes, blocks, .. } = layout;
    Ok(Bvh { nodes, blocks, bounds, triangle_count, instruction_set: InstructionSet::best() })
}

/// Checks the input and boxes every triangle that has an area.
fn primitives(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<Primitive>, BvhError> {
    let (count, vertices) = (triangles.len(), positions.len());
    if count > MAX_TRIANGLES {
        return Err(BvhError::TooManyTriangles { count, max: MAX_TRIANGLES });
    }
    if let Some((vertex, &position)) = positions.iter().enumerate().find(|(_, p)| !p.is_finite()) {
        return Err(BvhError::NotFinite { vertex, position });
    }
    let mut primitives = Vec::with_capacity(count);
    for (triangle, indices) in triangles.iter().enumerate() {
        if let Some(&index) = indices.iter().find(|&&i| i as usize >= vertices) {
            return Err(BvhError::Index { triangle, index, vertices });
        }
        let corners = indices.map(|i| positions[i as usize]);
        if has_area(corners) {
            primitives.push(Primitive { bounds: Aabb::around(corners), id: triangle as u32 });
        }
    }
    Ok(primitives)
}

fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a) != glam::DVec3::ZERO
}

/// Consecutive primitives with their box and that of their centroids.
struct Range<'a> {
    primitives: &'a mut [Primitive],
    bounds: Aabb,
    centroids: Aabb,
}

impl<'a> Range<'a> {
    fn new(primitives: &'a mut [Primitive]) -> Self {
        let (mut bounds, mut centroids) = (Aabb::EMPTY, Aabb::EMPTY);
        for p in primitives.iter() {
            bounds = bounds.union(p.bounds);
            centroids = centroids.including(p.centroid());
        }
        Self { primitives, bounds, centroids }
    }

    fn fits_a_leaf(&self) -> bool {
        self.primitives.len() <= WIDTH
    }

    /// Splits where the heuristic is least, or in halves if all centroids fall into one bin.
    fn split(self) -> [Self; 2] {
        let Some(plane) = Bins::new(&self).best_plane() else {
            return self.halve();
        };
        let middle = partition(self.primitives, |p| plane.is_left(p));
        self.split_at(middle)
    }

    /// Splits at the median of the longest axis of the centroids.
    fn halve(self) -> [Self; 2] {
        let axis = self.centroids.size().max_position();
        let middle = self.primitives.len() / 2;
        self.primitives.select_nth_unstable_by(middle, |a, b| {
            a.centroid()[axis].total_cmp(&b.centroid()[axis]).then(a.id.cmp(&b.id))
        });
        self.split_at(middle)
    }

    fn split_at(self, middle: usize) -> [Self; 2] {
        let (left, right) = self.primitives.split_at_mut(middle);
        [Self::new(left), Self::new(right)]
    }
}

/// Moves what is left to the front; returns how many those are.
fn partition(primitives: &mut [Primitive], is_left: impl Fn(&Primitive) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..primitives.len() {
        if is_left(&primitives[i]) {
            primitives.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

/// Maps centroids to equal bins on each axis.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3,
    scale: Vec3,
    count: usize,
}

impl Binning {
    fn new(range: &Range<'_>) -> Self {
        let count = (16 + range.primitives.len() / 16).min(MAX_BINS);
        Self {
            origin: range.centroids.min,
            scale: Vec3::splat(count as f32) / range.centroids.size(),
            count,
        }
    }

    /// The bins of a primitive on the three axes; 0 where all centroids agree.
    fn bins(&self, p: &Primitive) -> [usize; 3] {
        let at = (p.centroid() - self.origin) * self.scale;
        at.to_array().map(|x| (x as usize).min(self.count - 1))
    }
}

/// How many primitives fall into each bin of each axis, and their boxes.
struct Bins {
    binning: Binning,
    counts: [[usize; MAX_BINS]; 3],
    bounds: [[Aabb; MAX_BINS]; 3],
}

/// A split: the bins below `bin` are left.
struct Plane {
    binning: Binning,
    axis: usize,
    bin: usize,
}

impl Plane {
    fn is_left(&self, p: &Primitive) -> bool {
        self.binning.bins(p)[self.axis] < self.bin
    }
}

impl Bins {
    fn new(range: &Range<'_>) -> Self {
        let binning = Binning::new(range);
        let mut bins =
            Self { binning, counts: [[0; MAX_BINS]; 3], bounds: [[Aabb::EMPTY; MAX_BINS]; 3] };
        for p in range.primitives.iter() {
            for (axis, bin) in binning.bins(p).into_iter().enumerate() {
                bins.counts[axis][bin] += 1;
                bins.bounds[axis][bin] = bins.bounds[axis][bin].union(p.bounds);
            }
        }
        bins
    }

    /// The plane of least area × blocks; none if one side of each would be empty.
    fn best_plane(&self) -> Option<Plane> {
        let mut best = (f64::INFINITY, None);
        for axis in 0..3 {
            let right_costs = self.right_costs(axis);
            let (mut count, mut bounds) = (0, Aabb::EMPTY);
            for bin in 1..self.binning.count {
                count += self.counts[axis][bin - 1];
                bounds = bounds.union(self.bounds[axis][bin - 1]);
                let cost = cost(count, &bounds) + right_costs[bin];
                if count > 0 && cost < best.0 {
                    best = (cost, Some(Plane { binning: self.binning, axis, bin }));
                }
            }
        }
        best.1
    }

    /// The cost of the right side of each plane; infinite where it is empty.
    fn right_costs(&self, axis: usize) -> [f64; MAX_BINS] {
        let mut costs = [f64::INFINITY; MAX_BINS];
        let (mut count, mut bounds) = (0, Aabb::EMPTY);
        for bin in (1..self.binning.count).rev() {
            count += self.counts[axis][bin];
            bounds = bounds.union(self.bounds[axis][bin]);
            if count > 0 {
                costs[bin] = cost(count, &bounds);
            }
        }
        costs
    }
}

/// Area × blocks: what the range would cost as leaves.
fn cost(count: usize, bounds: &Aabb) -> f64 {
    area(bounds) * count.div_ceil(WIDTH) as f64
}

/// Half the surface area, in f64 so that no finite box overflows.
fn area(bounds: &Aabb) -> f64 {
    let s = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max(glam::DVec3::ZERO);
    s.x * s.y + s.y * s.z + s.z * s.x
}

/// The subtree of a range that is too large for a leaf.
fn subtree(range: Range<'_>, depth: u32) -> Tree<'_> {
    let is_large = range.primitives.len() >= PARALLEL_THRESHOLD;
    let children = split_in_eight(range, depth);
    Tree::Inner(if is_large {
        children.into_par_iter().map(|range| child(range, depth + 1)).collect()
    } else {
        children.into_iter().map(|range| child(range, depth + 1)).collect()
    })
}

fn child(range: Range<'_>, depth: u32) -> (Aabb, Tree<'_>) {
    let bounds = range.bounds;
    let tree =
        if range.fits_a_leaf() { Tree::Leaf(range.primitives) } else { subtree(range, depth) };
    (bounds, tree)
}

/// Splits the largest range until there are eight or all fit a leaf; the largest surface first.
fn split_in_eight(range: Range<'_>, depth: u32) -> Vec<Range<'_>> {
    let by_heuristic = depth < MAX_HEURISTIC_DEPTH;
    let size =
        |r: &Range<'_>| if by_heuristic { area(&r.bounds) } else { r.primitives.len() as f64 };
    let mut children = Vec::with_capacity(WIDTH);
    children.push(range);
    while children.len() < WIDTH {
        let largest = (0..children.len())
            .filter(|&i| !children[i].fits_a_leaf())
            .max_by(|&i, &j| size(&children[i]).total_cmp(&size(&children[j])));
        let Some(largest) = largest else { break };
        let range = children.swap_remove(largest);
        children.extend(if by_heuristic { range.split() } else { range.halve() });
    }
    children.sort_by(|a, b| area(&b.bounds).total_cmp(&area(&a.bounds)));
    children
}

/// Writes the tree depth first.
struct Layout<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Layout<'_> {
    fn push_node(&mut self, children: &[(Aabb, Tree<'_>)]) -> Child {
        let index = self.nodes.len();
        let empty = [[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]];
        self.nodes.push(Node { planes: [empty; 3], children: [Child::block(0); WIDTH] });
        for (lane, (bounds, tree)) in children.iter().enumerate() {
            let child = match tree {
                Tree::Leaf(primitives) => self.push_block(primitives),
                Tree::Inner(children) => self.push_node(children),
            };
            let node = &mut self.nodes[index];
            node.children[lane] = child;
            for axis in 0..3 {
                node.planes[axis][0][lane] = bounds.min[axis];
                node.planes[axis][1][lane] = bounds.max[axis];
            }
        }
        Child::node(index)
    }

    fn push_block(&mut self, primitives: &[Primitive]) -> Child {
        let missing: Lanes = [f32::NAN; WIDTH];
        let mut block = Block { vertices: [[missing; 3]; 3], ids: [Block::NONE; WIDTH] };
        for (lane, p) in primitives.iter().enumerate() {
            block.ids[lane] = p.id;
            for (vertex, &index) in self.triangles[p.id as usize].iter().enumerate() {
                for axis in 0..3 {
                    block.vertices[vertex][axis][lane] = self.positions[index as usize][axis];
                }
            }
        }
        self.blocks.push(block);
        Child::block(self.blocks.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(tree: &Tree<'_>) -> u32 {
        match tree {
            Tree::Leaf(primitives) => {
                assert!((1..=WIDTH).contains(&primitives.len()));
                0
            }
            Tree::Inner(children) => {
                assert!(children.len() <= WIDTH);
                1 + children.iter().map(|(_, tree)| depth(tree)).max().unwrap_or(0)
            }
        }
    }

    #[test]
    fn halving_makes_trees_of_least_depth() {
        let mut primitives: Vec<_> = (0..8 * 8 * 8 * 8)
            .map(|i| {
                let corner = Vec3::new((i * i % 97) as f32, (i % 31) as f32, 1.5f32.powi(i % 50));
                Primitive { bounds: Aabb { min: corner, max: corner + 1.0 }, id: i as u32 }
            })
            .collect();
        assert_eq!(depth(&subtree(Range::new(&mut primitives), MAX_HEURISTIC_DEPTH)), 3);
    }

    #[test]
    fn boxes_too_large_for_arithmetic_in_f32_are_split() {
        let mut primitives: Vec<_> = (0..100)
            .map(|id| {
                let x = f32::MAX * (id as f32 / 50.0 - 1.0);
                let bounds = Aabb { min: Vec3::splat(x), max: Vec3::splat(x) };
                Primitive { bounds, id }
            })
            .collect();
        assert!(depth(&subtree(Range::new(&mut primitives), 0)) <= 3);
    }
}
