//! Top-down construction with the binned surface area heuristic, straight to eight children.
//!
//! A node starts as one range of triangles. The range with the largest surface area is split in two until
//! there are eight. A split minimizes area × blocks over equal bins of the centroids on each axis (Wald
//! 2007). Boxes are four-wide vectors, of which x, y and z are used. Beyond a certain depth, ranges are
//! halved instead, which bounds the depth of the tree and so the traversal's stack for any input.

use rayon::prelude::*;

use super::{Block, Bvh, BvhError, Child, InstructionSet, Lanes, Node, WIDTH};
use crate::geometry::Aabb;
use crate::math::{Vec3, Vec4};
use glam::Vec4Swizzles;

/// Triangle numbers and block numbers share 31 bits.
const MAX_TRIANGLES: usize = (1 << 31) - 1;
/// The maximum number of levels split by the heuristic. Halving adds at most 10, because 8¹⁰ blocks suffice.
const MAX_HEURISTIC_DEPTH: u32 = 24;
/// The maximum number of levels in any tree.
pub(super) const MAX_DEPTH: u32 = MAX_HEURISTIC_DEPTH + 10;
/// Ranges below this size do not get their own task.
const PARALLEL_THRESHOLD: usize = 4096;
const MAX_BINS: usize = 32;

/// A box as two vectors whose fourth components are unused.
#[derive(Clone, Copy)]
struct Box4 {
    lower: Vec4,
    upper: Vec4,
}

impl Box4 {
    const EMPTY: Self = Self { lower: Vec4::INFINITY, upper: Vec4::NEG_INFINITY };

    fn union(self, o: Self) -> Self {
        Self { lower: self.lower.min(o.lower), upper: self.upper.max(o.upper) }
    }

    fn including(self, p: Vec4) -> Self {
        Self { lower: self.lower.min(p), upper: self.upper.max(p) }
    }

    /// Half the surface area; 0 for an empty box.
    fn area(self) -> f32 {
        let size = (self.upper - self.lower).max(Vec4::ZERO);
        let faces = size * size.yzxw();
        faces.x + faces.y + faces.z
    }

    fn aabb(self) -> Aabb {
        Aabb { min: self.lower.truncate(), max: self.upper.truncate() }
    }
}

/// A triangle's box, with the lower half of its number in `lower.w` and the upper half in `upper.w`.
///
/// Stored as integral floats, because an integer's bits would be slow denormals.
#[derive(Clone, Copy)]
struct Primitive(Box4);

impl Primitive {
    fn new(bounds: &Aabb, id: u32) -> Self {
        let half = |half: u32| (half & 0xffff) as f32;
        let (lower, upper) = (bounds.min.extend(half(id)), bounds.max.extend(half(id >> 16)));
        Self(Box4 { lower, upper })
    }

    fn id(self) -> u32 {
        self.0.lower.w as u32 | (self.0.upper.w as u32) << 16
    }

    fn centroid(self) -> Vec4 {
        0.5 * self.0.lower + 0.5 * self.0.upper
    }
}

/// The tree before it is laid out.
enum Tree<'a> {
    Leaf(&'a [Primitive]),
    Inner(Vec<(Box4, Self)>),
}

impl Tree<'_> {
    /// The numbers of nodes and leaves.
    fn counts(&self) -> (usize, usize) {
        match self {
            Self::Leaf(_) => (0, 1),
            Self::Inner(children) => children
                .iter()
                .map(|(_, tree)| tree.counts())
                .fold((1, 0), |a, b| (a.0 + b.0, a.1 + b.1)),
        }
    }
}

pub(super) fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Bvh, BvhError> {
    let mut primitives = primitives(positions, triangles)?;
    let triangle_count = primitives.len();
    let root = Range::new(&mut primitives);
    let bounds = root.bounds;
    let tree = if triangle_count == 0 {
        Tree::Inner(Vec::new())
    } else if root.fits_a_leaf() {
        Tree::Inner(vec![(bounds, Tree::Leaf(root.primitives))])
    } else {
        subtree(root, 0)
    };
    let (nodes, blocks) = lay_out(positions, triangles, &tree);
    let (bounds, instruction_set) = (bounds.aabb(), InstructionSet::best());
    Ok(Bvh { nodes, blocks, bounds, triangle_count, instruction_set, instances: None })
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
            primitives.push(Primitive::new(&Aabb::around(corners), triangle as u32));
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
    bounds: Box4,
    centroids: Box4,
}

impl<'a> Range<'a> {
    fn new(primitives: &'a mut [Primitive]) -> Self {
        let (mut bounds, mut centroids) = (Box4::EMPTY, Box4::EMPTY);
        for p in primitives.iter() {
            bounds = bounds.union(p.0);
            centroids = centroids.including(p.centroid());
        }
        Self { primitives, bounds, centroids }
    }

    fn fits_a_leaf(&self) -> bool {
        self.primitives.len() <= WIDTH
    }

    /// Splits at the minimum of the heuristic, or in halves if all centroids are in one bin.
    fn split(self) -> [Self; 2] {
        let bins = Bins::new(&self);
        let Some(plane) = bins.best_plane() else {
            return self.halve();
        };
        let [left, right] = bins.sides(&plane);
        let (middle, centroids) = partition(self.primitives, &plane);
        let (first, second) = self.primitives.split_at_mut(middle);
        [
            Self { primitives: first, bounds: left, centroids: centroids[0] },
            Self { primitives: second, bounds: right, centroids: centroids[1] },
        ]
    }

    /// Splits at the median of the longest axis of the centroids.
    fn halve(self) -> [Self; 2] {
        let Aabb { min, max } = self.centroids.aabb();
        let axis = (max - min).max_position();
        let middle = self.primitives.len() / 2;
        self.primitives.select_nth_unstable_by(middle, |a, b| {
            a.centroid()[axis].total_cmp(&b.centroid()[axis]).then(a.id().cmp(&b.id()))
        });
        let (left, right) = self.primitives.split_at_mut(middle);
        [Self::new(left), Self::new(right)]
    }
}

/// Moves the primitives left of the plane to the front. Returns their number, and the boxes of the centroids on both
/// sides.
fn partition(primitives: &mut [Primitive], plane: &Plane) -> (usize, [Box4; 2]) {
    let mut centroids = [Box4::EMPTY; 2];
    let mut side = |p: &Primitive| {
        let side = usize::from(!plane.is_left(p));
        centroids[side] = centroids[side].including(p.centroid());
        side
    };
    let (mut i, mut end) = (0, primitives.len());
    while i < end {
        if side(&primitives[i]) == 0 {
            i += 1;
            continue;
        }
        end -= 1;
        while i < end && side(&primitives[end]) == 1 {
            end -= 1;
        }
        primitives.swap(i, end);
        i += usize::from(i < end);
    }
    (i, centroids)
}

/// Maps centroids to equal bins on each axis.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec4,
    scale: Vec4,
    count: usize,
}

impl Binning {
    fn new(range: &Range<'_>) -> Self {
        let count = (16 + range.primitives.len() / 16).min(MAX_BINS);
        let Box4 { lower, upper } = range.centroids;
        let scale = (count as f32 / (upper - lower)).to_array();
        Self {
            origin: lower,
            // If all centroids are equal on an axis, they go into the first bin.
            scale: scale.map(|s| if s.is_finite() { s } else { 0.0 }).into(),
            count,
        }
    }

    /// The bins of a primitive on the three axes.
    fn bins(&self, p: &Primitive) -> [usize; 3] {
        // Floats from 2²³ have no fraction, so the last bits of this sum are an integer.
        const WHOLE: f32 = (1 << 23) as f32;
        let at = (p.centroid() - self.origin) * self.scale - 0.5;
        let at = at.max(Vec4::ZERO).min(Vec4::splat((self.count - 1) as f32));
        let [x, y, z, _] = (at + WHOLE).to_array();
        [x, y, z].map(|x| x.to_bits() as usize % MAX_BINS)
    }
}

/// The number of primitives in each bin of each axis, and their boxes.
struct Bins {
    binning: Binning,
    counts: [[u32; MAX_BINS]; 3],
    bounds: [[Box4; MAX_BINS]; 3],
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
            Self { binning, counts: [[0; MAX_BINS]; 3], bounds: [[Box4::EMPTY; MAX_BINS]; 3] };
        for p in range.primitives.iter() {
            for (axis, bin) in binning.bins(p).into_iter().enumerate() {
                bins.counts[axis][bin] += 1;
                bins.bounds[axis][bin] = bins.bounds[axis][bin].union(p.0);
            }
        }
        bins
    }

    /// The plane with the smallest area × blocks; `None` if every plane has an empty side.
    fn best_plane(&self) -> Option<Plane> {
        let mut best = (f32::INFINITY, None);
        for axis in 0..3 {
            let right_costs = self.right_costs(axis);
            let (mut count, mut bounds) = (0, Box4::EMPTY);
            for bin in 1..self.binning.count {
                count += self.counts[axis][bin - 1];
                bounds = bounds.union(self.bounds[axis][bin - 1]);
                let cost = cost(count, bounds) + right_costs[bin];
                if count > 0 && cost < best.0 {
                    best = (cost, Some(Plane { binning: self.binning, axis, bin }));
                }
            }
        }
        best.1
    }

    /// The cost of the right side of each plane; infinite for an empty side.
    fn right_costs(&self, axis: usize) -> [f32; MAX_BINS] {
        let mut costs = [f32::INFINITY; MAX_BINS];
        let (mut count, mut bounds) = (0, Box4::EMPTY);
        for bin in (1..self.binning.count).rev() {
            count += self.counts[axis][bin];
            bounds = bounds.union(self.bounds[axis][bin]);
            if count > 0 {
                costs[bin] = cost(count, bounds);
            }
        }
        costs
    }

    /// The boxes left and right of a plane.
    fn sides(&self, plane: &Plane) -> [Box4; 2] {
        let (left, right) = self.bounds[plane.axis].split_at(plane.bin);
        [left, right].map(|bins| bins.iter().copied().fold(Box4::EMPTY, Box4::union))
    }
}

/// Area × blocks: the cost of the range as leaves.
fn cost(count: u32, bounds: Box4) -> f32 {
    bounds.area() * count.div_ceil(WIDTH as u32) as f32
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

fn child(range: Range<'_>, depth: u32) -> (Box4, Tree<'_>) {
    let bounds = range.bounds;
    let tree =
        if range.fits_a_leaf() { Tree::Leaf(range.primitives) } else { subtree(range, depth) };
    (bounds, tree)
}

/// Splits the largest range until there are eight or all fit a leaf; sorts the largest surface last.
fn split_in_eight(range: Range<'_>, depth: u32) -> Vec<Range<'_>> {
    let by_heuristic = depth < MAX_HEURISTIC_DEPTH;
    let size =
        |r: &Range<'_>| if by_heuristic { r.bounds.area() } else { r.primitives.len() as f32 };
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
    children.sort_by(|a, b| a.bounds.area().total_cmp(&b.bounds.area()));
    children
}

/// The nodes and blocks of a tree.
fn lay_out(positions: &[Vec3], triangles: &[[u32; 3]], tree: &Tree<'_>) -> (Vec<Node>, Vec<Block>) {
    let (nodes, blocks) = tree.counts();
    let (nodes, blocks) = (Vec::with_capacity(nodes), Vec::with_capacity(blocks));
    let mut layout = Layout { positions, triangles, nodes, blocks };
    if let Tree::Inner(children) = tree {
        layout.push_node(children);
    }
    (layout.nodes, layout.blocks)
}

/// Writes the tree depth first.
struct Layout<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Layout<'_> {
    fn push_node(&mut self, children: &[(Box4, Tree<'_>)]) -> Child {
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
                node.planes[axis][0][lane] = bounds.lower[axis];
                node.planes[axis][1][lane] = bounds.upper[axis];
            }
        }
        Child::node(index)
    }

    fn push_block(&mut self, primitives: &[Primitive]) -> Child {
        let missing: Lanes = [f32::NAN; WIDTH];
        let mut block = Block { vertices: [[missing; 3]; 3], ids: [Block::NONE; WIDTH] };
        for (lane, p) in primitives.iter().enumerate() {
            block.ids[lane] = p.id();
            for (vertex, &index) in self.triangles[p.id() as usize].iter().enumerate() {
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
                Primitive::new(&Aabb { min: corner, max: corner + 1.0 }, i as u32)
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
                Primitive::new(&bounds, id)
            })
            .collect();
        assert!(depth(&subtree(Range::new(&mut primitives), 0)) <= 3);
    }
}
