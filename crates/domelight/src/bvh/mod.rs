//! Ray tracing: a bounding volume hierarchy with eight children per node.
//!
//! A [`Bvh`] answers two questions: which triangle a ray hits first, and whether a ray to the
//! environment is occluded. The second is asked far more often, for whole tiles of shadow rays at a
//! time ([`Bvh::occluded`]), and the layout is optimized for it.
//!
//! - **Build**: top-down, binned surface area heuristic, straight to eight children (Wald 2007, "On
//!   fast Construction of SAH-based Bounding Volume Hierarchies"; Wald, Benthin & Boulos 2008,
//!   "Getting Rid of Packets"). The tree is the same for any number of threads.
//! - **Triangle test**: Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection". A ray
//!   cannot slip between two triangles that share an edge or a vertex.
//! - **Box test**: boxes are widened by the rounding error of the triangle test, so that *the tree
//!   never changes the answer*: it equals that of a loop over all triangles, bit for bit. (The exception
//!   is a triangle seen so nearly edge-on that its distance has no correct digit.)
//! - **Many rays**: traced as streams of 64 rays in one octant, into which shadow rays are sorted (Tsakok
//!   2009, "Faster Incoherent Rays: Multi-BVH Ray Stream Tracing"; Fuetterling et al. 2015, "Efficient
//!   Ray Tracing Kernels for Modern CPU Architectures"). Two or four streams take turns, and each
//!   prefetches its next node before the others continue, which hides the latency.
//!
//! Every kernel is written once over vectors of eight numbers and compiled for each instruction set. Box tests
//! multiply and subtract in one rounding on all of them, and nothing else is fused, so all of them **give the same
//! bits** ([`InstructionSet`]).
//!
//! A few meshes in many places are traced through a second tree, over their copies (`instances.rs`).
//!
//! # Limits
//! Coordinates from about 1e-12 to 1e12 in magnitude, and directions from about 1e-18 to 1e20 in
//! length, keep all intermediate products finite and normal. Beyond that, rays may miss, but nothing
//! panics. Shadow rays that leave a surface need a size of at least 1e-6 and coordinates up to 1e7,
//! which [`Scene::new`](crate::scene::Scene::new) ensures by tracing other scenes at a moderate
//! size. From farther away than some 10⁴ times the scene's size, boxes are widened so much that rays
//! become slow.
//!
//! # Alternatives
//! Möller–Trumbore makes rays 3 to 7 % faster but leaks along shared edges. Fused multiply-adds in the
//! edge functions would make those of adjacent triangles differ.
//! Sorting shadow rays more finely than by octant loses more from incoherent origins than it gains.
//! Bottom-up clustering (PLOC) with reinsertion gives trees of similar quality but unbounded depth.
//! Packets of 16 camera rays are faster than streams if the tree fits the cache, but camera rays are
//! few. `docs/experiments.md` has figures.

mod build;
mod frustum;
mod instances;
mod intersect;
mod prepare;
mod traverse;
mod validate;

use crate::geometry::{Aabb, Hit, Ray, RayBatch};
use crate::math::Vec3;
use crate::simd;

pub use crate::simd::InstructionSet;
pub use frustum::Frustum;
pub(crate) use instances::Instance;
use instances::Instances;
pub use validate::BvhDefect;

/// The number of children of a node and of triangles in a block: the width of a vector.
const WIDTH: usize = 8;

/// One number per lane.
type Lanes = simd::Lanes;

/// A bounding volume hierarchy over triangles; see the [module](self).
#[derive(Clone, Debug)]
pub struct Bvh {
    /// The root is the first.
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    bounds: Aabb,
    triangle_count: usize,
    instruction_set: InstructionSet,
    instances: Option<Box<Instances>>,
}

/// A node with the boxes and references of eight children.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
struct Node {
    /// By axis, then lower and upper plane; a missing child's box is empty.
    planes: [[Lanes; 2]; 3],
    children: [Child; WIDTH],
}

/// The reference of a child: a node, or the single block of a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    fn node(index: usize) -> Self {
        Self(index as u32)
    }

    fn block(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// Up to eight triangles. A missing one has NaN vertices, which no ray hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Block {
    /// By vertex, then axis.
    vertices: [[Lanes; 3]; 3],
    /// The indices of the triangles; [`Block::NONE`] for a missing one.
    ids: [u32; WIDTH],
}

impl Block {
    const NONE: u32 = u32::MAX;
}

/// An error in building a BVH.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BvhError {
    /// A coordinate that is NaN or infinite.
    #[error("vertex {vertex} has a non-finite coordinate: {position}")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// Its position.
        position: Vec3,
    },
    /// An index beyond the vertices.
    #[error("triangle {triangle} refers to vertex {index}, but there are only {vertices} vertices")]
    Index {
        /// The triangle.
        triangle: usize,
        /// Its index.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// More triangles than indices.
    #[error("{count} triangles are too many: at most {max} fit in one BVH; split the scene")]
    TooManyTriangles {
        /// The number of triangles.
        count: usize,
        /// The maximum number.
        max: usize,
    },
}

impl Bvh {
    /// Builds a BVH over triangles given as indices into `positions`.
    ///
    /// The result does not depend on the number of threads. Triangles without area (the cross
    /// product of two edges is zero) are omitted, because nothing can hit them.
    ///
    /// # Errors
    /// If a vertex is not finite, an index is out of range, or there are 2³¹ triangles or more.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, BvhError> {
        build::build(positions, triangles)
    }

    /// The same BVH traced with another instruction set; `None` if this processor lacks it.
    ///
    /// All give the same answers. [`Bvh::build`] chooses the fastest; this is for comparisons.
    #[must_use]
    pub fn with_instruction_set(mut self, instruction_set: InstructionSet) -> Option<Self> {
        self.instruction_set = instruction_set;
        if let Some(instances) = &mut self.instances {
            instances.set_instruction_set(instruction_set);
        }
        instruction_set.is_available().then_some(self)
    }

    /// The instruction set that it is traced with.
    pub(crate) fn instruction_set(&self) -> InstructionSet {
        self.instruction_set
    }

    /// The same BVH with copies of `objects`. Triangles are numbered as [`Instance::first_triangle`] says.
    #[must_use]
    pub(crate) fn with_instances(mut self, objects: Vec<Self>, instances: Vec<Instance>) -> Self {
        self.instances = Instances::new(objects, instances).map(Box::new);
        self
    }

    /// The bounding box of all triangles with an area; that of instances may be a little larger.
    pub fn bounds(&self) -> Aabb {
        let of_instances = |instances: &Instances| instances.bounds();
        self.bounds.union(self.instances.as_deref().map_or(Aabb::EMPTY, of_instances))
    }

    /// The number of triangles with an area, which are in the tree.
    pub fn triangle_count(&self) -> usize {
        self.triangle_count + self.instances.as_deref().map_or(0, Instances::triangle_count)
    }

    /// The memory of nodes and triangles \[bytes\].
    pub fn bytes(&self) -> usize {
        let own = size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..]);
        own + self.instances.as_deref().map_or(0, Instances::bytes)
    }

    /// The first triangle that the ray hits in its open interval (0, `t_max`), from either side.
    ///
    /// Among hits at the same distance, the triangle with the smallest index is returned. A ray that is not finite or
    /// has a zero direction hits nothing.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let hit = simd::dispatch(self.instruction_set, traverse::ClosestHit { bvh: self, ray });
        match &self.instances {
            None => hit,
            Some(instances) => instances.closest_hit(ray, hit, &|_| true),
        }
    }

    /// [`Bvh::closest_hit`] among the hits for which `accept` returns true; other hits are ignored. `accept` may be
    /// called in any order, and must return the same answer each time.
    pub fn closest_hit_where(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let kernel = traverse::ClosestHitWhere { bvh: self, ray, accept: &accept };
        let hit = simd::dispatch(self.instruction_set, kernel);
        match &self.instances {
            None => hit,
            Some(instances) => instances.closest_hit(ray, hit, &accept),
        }
    }

    /// [`Bvh::closest_hit`] for many rays. Fastest for neighboring rays, such as a tile's camera rays.
    ///
    /// `hits` is overwritten, one entry per ray.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        hits.clear();
        hits.resize(rays.len(), None);
        simd::dispatch(self.instruction_set, traverse::ClosestHits { bvh: self, rays, hits });
        if let Some(instances) = &self.instances {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = instances.closest_hit(ray, *hit, &|_| true);
            }
        }
    }

    /// [`Bvh::closest_hit_where`] for many rays. `accept` receives a few hits at a time, with the indices of their
    /// rays, and sets whether each hit is accepted.
    ///
    /// `hits` is overwritten, one entry per ray.
    pub fn closest_hits_where(
        &self,
        rays: &[Ray],
        accept: impl Fn(&[(usize, Hit)], &mut [bool]),
        hits: &mut Vec<Option<Hit>>,
    ) {
        hits.clear();
        hits.resize(rays.len(), None);
        let kernel = traverse::ClosestHitsWhere { bvh: self, rays, accept: &accept, hits };
        simd::dispatch(self.instruction_set, kernel);
        if let Some(instances) = &self.instances {
            for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                let accept_one = |hit: &Hit| {
                    let mut is_accepted = [false];
                    accept(&[(i, *hit)], &mut is_accepted);
                    is_accepted[0]
                };
                *hit = instances.closest_hit(ray, *hit, &accept_one);
            }
        }
    }

    /// Whether each ray of a batch hits any triangle up to infinity (V = 0).
    ///
    /// Gives the same answers as [`Bvh::any_hit`], but much faster for some thousand rays at a time. Their
    /// order matters little, because they are sorted internally. `occluded` is overwritten, one entry per ray.
    ///
    /// # Panics
    /// If the batch has fewer directions than origins.
    pub fn occluded(&self, rays: &RayBatch, occluded: &mut Vec<bool>) {
        assert!(rays.directions.len() >= rays.origins.len(), "a ray without a direction");
        occluded.clear();
        occluded.resize(rays.len(), false);
        simd::dispatch(
            self.instruction_set,
            traverse::Occluded { bvh: self, rays, answers: occluded },
        );
        if let Some(instances) = &self.instances {
            for (i, occluded) in occluded.iter_mut().enumerate() {
                let ray = || Ray::new(rays.origins[i], rays.directions[i]);
                *occluded = *occluded || instances.any_hit(&ray());
            }
        }
    }

    /// The transmittance along each ray of a batch up to infinity: the product of `of_hit`, in \[0, 1\], over all
    /// triangles that the ray hits; 1 if it hits none. `of_hit` receives the index of the ray in the batch and the hit.
    ///
    /// A ray's result has the same bits regardless of the other rays. `transmittances` is overwritten, one entry per
    /// ray.
    ///
    /// # Panics
    /// If the batch has fewer directions than origins.
    pub fn transmittances(
        &self,
        rays: &RayBatch,
        of_hit: &dyn Fn(usize, &Hit) -> f32,
        transmittances: &mut Vec<f32>,
    ) {
        assert!(rays.directions.len() >= rays.origins.len(), "a ray without a direction");
        transmittances.clear();
        transmittances.resize(rays.len(), 1.0);
        let answers = &mut *transmittances;
        simd::dispatch(
            self.instruction_set,
            traverse::Transmittances { bvh: self, rays, of_hit, answers },
        );
        if let Some(instances) = &self.instances {
            for (i, transmittance) in transmittances.iter_mut().enumerate() {
                let ray = Ray::new(rays.origins[i], rays.directions[i]);
                *transmittance *= instances.transmittance(&ray, &|hit| of_hit(i, hit));
            }
        }
    }

    /// Whether the ray hits any triangle in its open interval (0, `t_max`).
    pub fn any_hit(&self, ray: &Ray) -> bool {
        simd::dispatch(self.instruction_set, traverse::AnyHit { bvh: self, ray })
            || self.instances.as_ref().is_some_and(|instances| instances.any_hit(ray))
    }

    /// Whether a ray within the frustum may hit anything; false only if none does.
    ///
    /// It tests only boxes, so it is cheap, and true near geometry.
    pub fn may_hit(&self, frustum: &Frustum) -> bool {
        simd::dispatch(self.instruction_set, frustum::MayHit { bvh: self, frustum })
            || self.instances.as_ref().is_some_and(|instances| instances.may_hit(frustum))
    }

    /// Checks that every triangle is in the tree once, each box contains its subtree, and every
    /// reference is in range.
    ///
    /// # Errors
    /// The first [`BvhDefect`] found.
    pub fn validate(&self) -> Result<(), BvhDefect> {
        validate::validate(self)
    }
}
