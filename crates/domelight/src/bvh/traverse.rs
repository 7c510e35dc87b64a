//! Traversal: one ray to its closest or any hit, and streams of rays.
//!
//! Everything here is generic over the instruction set and inlined into it.
#![allow(clippy::large_stack_arrays)] // A few streams, 50 KiB.

use std::marker::PhantomData;
use std::ops::Range;

use super::build::MAX_DEPTH;
use super::intersect::{Planes, Sheared, Slabs};
use super::prepare::{PreparedRays, octant};
use super::{Bvh, Child, Node, WIDTH};
use crate::geometry::{Hit, Ray, RayBatch};
use crate::math::Vec3;
use crate::simd::{Kernel, LaneMask, Simd, SimdBitSets, SimdF32x8, SimdFloat, set_bits};

/// The stack size: each node leaves at most seven children behind on the way down, and pushes eight.
pub(super) const STACK: usize = 256;
const _: () = assert!(MAX_DEPTH as usize * (WIDTH - 1) + WIDTH <= STACK);

/// The number of rays per stream, with one bit each in two words.
const STREAM: usize = 64;
/// The number of streams in flight: while one waits for memory, the others continue.
const INTERLEAVED: usize = 4;
/// Trees of at most this size \[bytes\] fit in the caches and are traversed by two streams, which wait little and leave
/// more of the nearest cache to the tree.
const CACHED: usize = 1 << 24;
/// The number of rays sorted at once: enough to fill the streams of all octants, but few enough to stay coherent.
const WINDOW: usize = 4096;

/// [`Bvh::closest_hit`]
pub(super) struct ClosestHit<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) ray: &'a Ray,
}

impl Kernel for ClosestHit<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Option<Hit> {
        let ray = prepare_one(simd, self.bvh, self.ray)?;
        closest_hit(simd, self.bvh, &ray, last_below(self.ray.t_max), &Everything)
    }
}

/// [`Bvh::closest_hit_where`]
pub(super) struct ClosestHitWhere<'a, F> {
    pub(super) bvh: &'a Bvh,
    pub(super) ray: &'a Ray,
    pub(super) accept: F,
}

impl<F: Fn(&Hit) -> bool> Kernel for ClosestHitWhere<'_, F> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Option<Hit> {
        let ray = prepare_one(simd, self.bvh, self.ray)?;
        let limit = last_below(self.ray.t_max);
        closest_hit(simd, self.bvh, &ray, limit, &Where(self.accept))
    }
}

/// [`Bvh::closest_hits`]; all `hits` must be empty initially.
pub(super) struct ClosestHits<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) rays: &'a [Ray],
    pub(super) hits: &'a mut [Option<Hit>],
}

impl Kernel for ClosestHits<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let starts = runs_of_an_octant(self.rays);
        interleave::<S, ClosestStream>(simd, self.bvh, (), starts, self.hits);
    }
}

/// [`Bvh::closest_hits_where`]; all `hits` must be empty initially.
pub(super) struct ClosestHitsWhere<'a, F> {
    pub(super) bvh: &'a Bvh,
    pub(super) rays: &'a [Ray],
    pub(super) accept: F,
    pub(super) hits: &'a mut [Option<Hit>],
}

impl<F: Fn(&[(usize, Hit)], &mut [bool])> Kernel for ClosestHitsWhere<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let starts = runs_of_an_octant(self.rays);
        interleave::<S, WhereStream<F>>(simd, self.bvh, &self.accept, starts, self.hits);
    }
}

/// Streams of neighboring rays in one octant, each with the index of its first ray.
#[inline(always)]
fn runs_of_an_octant(rays: &[Ray]) -> impl Iterator<Item = (usize, &[Ray])> {
    let same_octant = |a: &Ray, b: &Ray| octant(a.direction) == octant(b.direction);
    let mut first = 0;
    rays.chunk_by(same_octant).flat_map(|run| run.chunks(STREAM)).map(move |rays| {
        first += rays.len();
        (first - rays.len(), rays)
    })
}

/// [`Bvh::any_hit`]
pub(super) struct AnyHit<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) ray: &'a Ray,
}

impl Kernel for AnyHit<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Some(ray) = prepare_one(simd, self.bvh, self.ray) else { return false };
        any_hit(simd, self.bvh, &ray, last_below(self.ray.t_max))
    }
}

/// [`Bvh::occluded`]; all `answers` must be false initially.
pub(super) struct Occluded<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) rays: &'a RayBatch,
    pub(super) answers: &'a mut [bool],
}

impl Kernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut order = [0; WINDOW];
        for start in (0..self.rays.len()).step_by(WINDOW) {
            let end = self.rays.len().min(start + WINDOW);
            let octants = sort_by_octant(&self.rays.directions[start..end], &mut order);
            let chunks = octants.iter().flat_map(|octant| order[octant.clone()].chunks(STREAM));
            let starts = chunks.map(|members| ShadowRays { batch: self.rays, start, members });
            interleave::<S, ShadowStream>(simd, self.bvh, (), starts, self.answers);
        }
    }
}

/// [`Bvh::transmittances`]; all `answers` must be 1 initially.
pub(super) struct Transmittances<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) rays: &'a RayBatch,
    pub(super) of_hit: &'a dyn Fn(usize, &Hit) -> f32,
    pub(super) answers: &'a mut [f32],
}

impl Kernel for Transmittances<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut order = [0; WINDOW];
        for start in (0..self.rays.len()).step_by(WINDOW) {
            let end = self.rays.len().min(start + WINDOW);
            let octants = sort_by_octant(&self.rays.directions[start..end], &mut order);
            let chunks = octants.iter().flat_map(|octant| order[octant.clone()].chunks(STREAM));
            let starts = chunks.map(|members| ShadowRays { batch: self.rays, start, members });
            let answers = &mut *self.answers;
            interleave::<S, TransmittanceStream>(simd, self.bvh, self.of_hit, starts, answers);
        }
    }
}

/// The largest t in the open interval that ends at `t_max`.
#[inline(always)]
fn last_below(t_max: f32) -> f32 {
    t_max.next_down()
}

/// `None` if the ray cannot hit anything.
#[inline(always)]
fn prepare_one<S: Simd>(simd: S, bvh: &Bvh, ray: &Ray) -> Option<PreparedRays<WIDTH>> {
    let mut rays = PreparedRays::EMPTY;
    rays.set(0, ray.origin, ray.direction);
    (rays.prepare(simd, octant(ray.direction), 1, &bvh.bounds) != 0).then_some(rays)
}

// ---- one ray -------------------------------------------------------------------------------------

/// A child to visit, and the distance where the ray enters it.
#[derive(Clone, Copy, Default)]
struct ClosestEntry {
    enter: f32,
    child: Child,
}

/// The children to visit, with the nearest child of a node on top.
struct ClosestStack {
    entries: [ClosestEntry; STACK],
    len: usize,
}

impl ClosestStack {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [ClosestEntry::default(); STACK], len: 0 }
    }

    /// Pops the next child that the ray enters at or before `limit`.
    #[inline(always)]
    fn pop(&mut self, limit: f32) -> Option<Child> {
        while self.len > 0 {
            self.len -= 1;
            let entry = self.entries[self.len];
            if entry.enter <= limit {
                return Some(entry.child);
            }
        }
        None
    }

    /// Pushes a child below all entries from `base` up that are nearer.
    #[inline(always)]
    fn insert(&mut self, base: usize, entry: ClosestEntry) {
        let mut at = self.len;
        while at > base && self.entries[at - 1].enter < entry.enter {
            self.entries[at] = self.entries[at - 1];
            at -= 1;
        }
        self.entries[at] = entry;
        self.len += 1;
    }
}

/// Selects the accepted hits of a leaf.
trait Accepting {
    /// The best accepted hit of a leaf, if it is nearer than `closest`, or equally near with a smaller index.
    fn closest_in_block<S: Simd>(
        &self,
        simd: S,
        bvh: &Bvh,
        leaf: Child,
        ray: &PreparedRays<WIDTH>,
        limit: f32,
        closest: Option<Hit>,
    ) -> Option<Hit>;
}

/// Accepts all hits.
struct Everything;

impl Accepting for Everything {
    #[inline(always)]
    fn closest_in_block<S: Simd>(
        &self,
        simd: S,
        bvh: &Bvh,
        leaf: Child,
        ray: &PreparedRays<WIDTH>,
        limit: f32,
        closest: Option<Hit>,
    ) -> Option<Hit> {
        closest_in_block(simd, bvh, leaf, ray, 0, limit, closest)
    }
}

/// Accepts the hits for which the function returns true.
struct Where<F>(F);

impl<F: Fn(&Hit) -> bool> Accepting for Where<F> {
    #[inline(always)]
    fn closest_in_block<S: Simd>(
        &self,
        simd: S,
        bvh: &Bvh,
        leaf: Child,
        ray: &PreparedRays<WIDTH>,
        limit: f32,
        closest: Option<Hit>,
    ) -> Option<Hit> {
        let mut best = None;
        for_hits_in_block(simd, bvh, leaf, ray, 0, limit, |hit| {
            if is_nearer(&hit, best.or(closest)) && (self.0)(&hit) {
                best = Some(hit);
            }
        });
        best
    }
}

/// Whether a hit is nearer than the closest so far; ties go to the smaller index.
#[inline(always)]
fn is_nearer(hit: &Hit, closest: Option<Hit>) -> bool {
    closest.is_none_or(|closest| (hit.t, hit.triangle) < (closest.t, closest.triangle))
}

#[inline(always)]
fn closest_hit<S: Simd>(
    simd: S,
    bvh: &Bvh,
    ray: &PreparedRays<WIDTH>,
    mut limit: f32,
    accepting: &impl Accepting,
) -> Option<Hit> {
    let mut stack = ClosestStack::new();
    let mut closest: Option<Hit> = None;
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            let hit = accepting.closest_in_block(simd, bvh, child, ray, limit, closest);
            if let Some(hit) = hit {
                limit = hit.t;
                closest = Some(hit);
            }
        } else {
            let node = &bvh.nodes[child.index()];
            let slabs = Slabs::load(simd, node, ray.octant);
            let (crossed, enter) = slabs.cross_within(simd, ray, limit);
            let crossed = crossed.bits();
            if crossed.is_power_of_two() {
                child = node.children[crossed.trailing_zeros() as usize % WIDTH];
                continue;
            }
            let enter = enter.store();
            let base = stack.len;
            for lane in set_bits(crossed) {
                let entry = ClosestEntry { enter: enter[lane], child: node.children[lane] };
                stack.insert(base, entry);
            }
        }
        match stack.pop(limit) {
            Some(next) => child = next,
            None => return closest,
        }
    }
}

#[inline(always)]
fn any_hit<S: Simd>(simd: S, bvh: &Bvh, ray: &PreparedRays<WIDTH>, limit: f32) -> bool {
    let mut stack = [Child::default(); STACK];
    let mut len = 0;
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            let block = &bvh.blocks[child.index()];
            let sheared = Sheared::new(simd, block, ray, 0);
            if sheared.hits(simd, &Planes::of(simd, block), limit).mask != 0 {
                return true;
            }
        } else {
            let node = &bvh.nodes[child.index()];
            let slabs = Slabs::load(simd, node, ray.octant);
            let (crossed, _) = slabs.cross_within(simd, ray, limit);
            // Push the last and largest on top.
            for lane in set_bits(crossed.bits()) {
                stack[len] = node.children[lane];
                len += 1;
            }
        }
        if len == 0 {
            return false;
        }
        len -= 1;
        child = stack[len];
    }
}

/// The best hit of a leaf, if it is nearer than `closest`, or equally near with a smaller index.
#[inline(always)]
fn closest_in_block<S: Simd, const N: usize>(
    simd: S,
    bvh: &Bvh,
    leaf: Child,
    rays: &PreparedRays<N>,
    i: usize,
    limit: f32,
    closest: Option<Hit>,
) -> Option<Hit> {
    let block = &bvh.blocks[leaf.index()];
    let sheared = Sheared::new(simd, block, rays, i);
    if sheared.misses() {
        return None;
    }
    let hits = sheared.hits(simd, &Planes::of(simd, block), limit);
    let t = hits.t.store();
    let lane = set_bits(hits.mask)
        .reduce(|a, b| if (t[b], block.ids[b]) < (t[a], block.ids[a]) { b } else { a })?;
    if closest.is_some_and(|c| (c.t, c.triangle) < (t[lane], block.ids[lane])) {
        return None;
    }
    let [u, v] = hits.barycentric();
    Some(Hit { t: t[lane], u: u[lane], v: v[lane], triangle: block.ids[lane] })
}

/// Passes each hit of a leaf to the function, in the order of its triangles.
#[inline(always)]
fn for_hits_in_block<S: Simd, const N: usize>(
    simd: S,
    bvh: &Bvh,
    leaf: Child,
    rays: &PreparedRays<N>,
    i: usize,
    limit: f32,
    mut each: impl FnMut(Hit),
) {
    let block = &bvh.blocks[leaf.index()];
    let sheared = Sheared::new(simd, block, rays, i);
    if sheared.misses() {
        return;
    }
    let hits = sheared.hits(simd, &Planes::of(simd, block), limit);
    if hits.mask == 0 {
        return;
    }
    let (t, [u, v]) = (hits.t.store(), hits.barycentric());
    for lane in set_bits(hits.mask) {
        each(Hit { t: t[lane], u: u[lane], v: v[lane], triangle: block.ids[lane] });
    }
}

// ---- streams -------------------------------------------------------------------------------------

/// Rays of one octant that traverse the tree together: a node's planes are loaded once for all rays that
/// reach it. The order of visits does not change the answers.
trait Stream: Sized {
    const EMPTY: Self;
    /// The rays to start with.
    type Rays<'a>;
    /// Additional context.
    type Context<'a>: Copy
    where
        Self: 'a;
    type Answer;

    /// Begins at the root.
    fn start<S: Simd>(&mut self, simd: S, bvh: &Bvh, rays: Self::Rays<'_>);
    /// Visits the next node or leaf. Returns false if there is none.
    fn advance<S: Simd>(&mut self, simd: S, bvh: &Bvh, context: Self::Context<'_>) -> bool;
    /// Writes the answers.
    fn finish(&mut self, answers: &mut [Self::Answer]);
}

/// Runs streams in turns, with their number chosen by the size of the tree.
#[inline(always)]
fn interleave<'a, S: Simd, T: Stream>(
    simd: S,
    bvh: &Bvh,
    context: T::Context<'_>,
    starts: impl Iterator<Item = T::Rays<'a>>,
    answers: &mut [T::Answer],
) {
    if bvh.bytes() <= CACHED {
        take_turns::<S, T, 2>(simd, bvh, context, starts, answers);
    } else {
        take_turns::<S, T, INTERLEAVED>(simd, bvh, context, starts, answers);
    }
}

/// Runs `N` streams in turns until no rays are left.
#[inline(always)]
fn take_turns<'a, S: Simd, T: Stream, const N: usize>(
    simd: S,
    bvh: &Bvh,
    context: T::Context<'_>,
    mut starts: impl Iterator<Item = T::Rays<'a>>,
    answers: &mut [T::Answer],
) {
    let mut streams = [const { T::EMPTY }; N];
    let mut running = true;
    while running {
        running = false;
        for stream in &mut streams {
            if stream.advance(simd, bvh, context) {
                running = true;
                continue;
            }
            stream.finish(answers);
            if let Some(rays) = starts.next() {
                stream.start(simd, bvh, rays);
                running = true;
            }
        }
    }
}

/// The bit of each ray, in two halves.
static BITS: [[u32; 2]; STREAM] = {
    let mut bits = [[0; 2]; STREAM];
    let mut i = 0;
    while i < STREAM {
        bits[i][i / 32] = 1 << (i % 32);
        i += 1;
    }
    bits
};

/// The rays that enter each child of a node, in two halves.
#[derive(Clone, Copy)]
struct Entering<S: Simd>([S::BitSets; 2]);

impl<S: Simd> Entering<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Self([simd.empty(); 2])
    }

    /// Adds ray `i` to the sets of the children in `crossed`.
    #[inline(always)]
    fn insert(&mut self, i: usize, crossed: <S::F32x8 as SimdFloat>::Mask) {
        let [low, high] = self.0;
        let [in_low, in_high] = BITS[i % STREAM];
        self.0 = [low.insert(crossed, in_low), high.insert(crossed, in_high)];
    }
}

impl<S: Simd> Entering<S> {
    /// The rays of `members` that cross each child of a node, within their limits if they have any, and the distances
    /// where the last one enters them.
    #[inline(always)]
    fn of_node(
        simd: S,
        node: &Node,
        rays: &PreparedRays<STREAM>,
        limits: Option<&[f32; STREAM]>,
        members: u64,
    ) -> (Self, S::F32x8) {
        if rays.need_exact_products::<S>() {
            Self::exact(simd, node, rays, limits, members)
        } else {
            Self::test::<false>(simd, node, rays, limits, members)
        }
    }

    /// Tests one ray after the other against the eight boxes, while the node's planes stay in registers.
    #[inline(always)]
    fn test<const EXACT: bool>(
        simd: S,
        node: &Node,
        rays: &PreparedRays<STREAM>,
        limits: Option<&[f32; STREAM]>,
        members: u64,
    ) -> (Self, S::F32x8) {
        let slabs = Slabs::load(simd, node, rays.octant);
        let mut entering = Self::none(simd);
        let mut last = simd.splat(0.0);
        for i in set_bits(members) {
            let [enter, leave] = slabs.cross::<STREAM, EXACT>(simd, rays, i);
            let leave = limits.map_or(leave, |limits| leave.min(simd.splat(limits[i])));
            entering.insert(i, enter.le(leave));
            last = enter;
        }
        (entering, last)
    }

    /// [`Self::test`] with exact products: rare, and kept apart, because their conversions would fill the registers of
    /// the other loop.
    #[cold]
    #[inline(never)]
    fn exact(
        simd: S,
        node: &Node,
        rays: &PreparedRays<STREAM>,
        limits: Option<&[f32; STREAM]>,
        members: u64,
    ) -> (Self, S::F32x8) {
        Self::test::<true>(simd, node, rays, limits, members)
    }
}

/// The children to visit, each with the rays of the stream that enter it.
struct StreamStack {
    children: [u32; STACK],
    /// The lower and the upper half of the rays.
    rays: [[u32; STACK]; 2],
    len: usize,
}

impl StreamStack {
    const EMPTY: Self = Self { children: [0; STACK], rays: [[0; STACK]; 2], len: 0 };

    #[inline(always)]
    fn push(&mut self, child: Child, rays: u64) {
        self.children[self.len] = child.0;
        self.rays[0][self.len] = rays as u32;
        self.rays[1][self.len] = (rays >> 32) as u32;
        self.len += 1;
    }

    /// Pushes the children of a node whose boxes any of `members`, rays of the stream as bits, crosses.
    #[inline(always)]
    fn push_crossed<S: Simd>(
        &mut self,
        simd: S,
        node: &Node,
        rays: &PreparedRays<STREAM>,
        members: u64,
    ) {
        let (entering, _) = Entering::of_node(simd, node, rays, None, members);
        self.push_entered(&node.children, entering);
    }

    /// Pushes the children that any ray enters, with the last on top.
    #[inline(always)]
    fn push_entered<S: Simd>(&mut self, children: &[Child; WIDTH], rays: Entering<S>) {
        let (rays, children, count) = SimdBitSets::pack(rays.0, children.map(|child| child.0));
        // Entries beyond `count` are overwritten by the next push.
        self.children[self.len..self.len + WIDTH].copy_from_slice(&children);
        for (stack, rays) in self.rays.iter_mut().zip(&rays) {
            stack[self.len..self.len + WIDTH].copy_from_slice(rays);
        }
        self.len += count;
    }

    /// Pushes the children of a node whose boxes any of `members` crosses within its limit, with the nearest child of
    /// the last ray on top.
    #[inline(always)]
    fn push_by_distance<S: Simd>(
        &mut self,
        simd: S,
        node: &Node,
        rays: &PreparedRays<STREAM>,
        limits: &[f32; STREAM],
        members: u64,
    ) {
        let (entering, enter) = Entering::of_node(simd, node, rays, Some(limits), members);
        let not_empty = entering.0.map(SimdBitSets::not_empty);
        let (halves, enter) = (entering.0.map(SimdBitSets::store), enter.store());
        let base = self.len;
        let mut keys = [0.0; WIDTH];
        for lane in set_bits(not_empty[0] | not_empty[1]) {
            let mut at = self.len;
            while at > base && keys[at - 1 - base] < enter[lane] {
                self.children[at] = self.children[at - 1];
                for rays in &mut self.rays {
                    rays[at] = rays[at - 1];
                }
                keys[at - base] = keys[at - 1 - base];
                at -= 1;
            }
            self.children[at] = node.children[lane].0;
            for (rays, sets) in self.rays.iter_mut().zip(&halves) {
                rays[at] = sets[lane];
            }
            keys[at - base] = enter[lane];
            self.len += 1;
        }
    }

    /// Pops the next child that any of the rays `free` enters, with those rays.
    #[inline(always)]
    fn pop(&mut self, free: u64) -> Option<(Child, u64)> {
        while self.len > 0 {
            self.len -= 1;
            let [low, high] = [self.rays[0][self.len], self.rays[1][self.len]];
            let rays = (u64::from(high) << 32 | u64::from(low)) & free;
            if rays != 0 {
                return Some((Child(self.children[self.len]), rays));
            }
        }
        None
    }

    /// Prefetches the next child.
    #[inline(always)]
    fn prefetch<S: Simd>(&self, simd: S, bvh: &Bvh) {
        let Some(&top) = self.children[..self.len].last() else { return };
        let child = Child(top);
        if child.is_leaf() {
            simd.prefetch(&bvh.blocks[child.index()]);
        } else {
            simd.prefetch(&bvh.nodes[child.index()]);
        }
    }
}

/// [`closest_hit`] of up to [`STREAM`] rays.
struct ClosestStream {
    rays: PreparedRays<STREAM>,
    limits: [f32; STREAM],
    hits: [Option<Hit>; STREAM],
    /// The indices of the rays in their batch.
    members: Range<usize>,
    stack: StreamStack,
}

impl ClosestStream {
    /// Ends ray `i` at a hit.
    #[inline(always)]
    fn shorten(&mut self, i: usize, hit: Hit) {
        self.limits[i] = hit.t;
        self.hits[i] = Some(hit);
    }

    /// Pushes the children of a node that any of `rays` enters.
    #[inline(always)]
    fn descend<S: Simd>(&mut self, simd: S, bvh: &Bvh, child: Child, rays: u64) {
        let node = &bvh.nodes[child.index()];
        self.stack.push_by_distance(simd, node, &self.rays, &self.limits, rays);
    }
}

impl Stream for ClosestStream {
    const EMPTY: Self = Self {
        rays: PreparedRays::EMPTY,
        limits: [0.0; STREAM],
        hits: [None; STREAM],
        members: 0..0,
        stack: StreamStack::EMPTY,
    };

    /// The rays and the index of the first.
    type Rays<'a> = (usize, &'a [Ray]);
    type Context<'a> = ();
    type Answer = Option<Hit>;

    #[inline(always)]
    fn start<S: Simd>(&mut self, simd: S, bvh: &Bvh, (first, rays): (usize, &[Ray])) {
        for (i, ray) in rays.iter().enumerate() {
            self.rays.set(i, ray.origin, ray.direction);
            self.limits[i] = last_below(ray.t_max);
        }
        self.hits[..rays.len()].fill(None);
        self.members = first..first + rays.len();
        let valid = self.rays.prepare(simd, octant(rays[0].direction), rays.len(), &bvh.bounds);
        self.stack.push(Child::node(0), valid);
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, bvh: &Bvh, (): ()) -> bool {
        let Some((child, rays)) = self.stack.pop(u64::MAX) else { return false };
        if child.is_leaf() {
            for i in set_bits(rays) {
                let (limit, closest) = (self.limits[i], self.hits[i]);
                if let Some(hit) = closest_in_block(simd, bvh, child, &self.rays, i, limit, closest)
                {
                    self.shorten(i, hit);
                }
            }
        } else {
            self.descend(simd, bvh, child, rays);
        }
        self.stack.prefetch(simd, bvh);
        true
    }

    #[inline(always)]
    fn finish(&mut self, answers: &mut [Option<Hit>]) {
        let members = std::mem::take(&mut self.members);
        let count = members.len();
        answers[members].copy_from_slice(&self.hits[..count]);
    }
}

/// [`Bvh::closest_hit_where`] of up to [`STREAM`] rays.
struct WhereStream<F> {
    /// The rays and their closest accepted hits.
    closest: ClosestStream,
    /// Hits that are not yet accepted or rejected, with the indices of their rays in the batch.
    candidates: [(usize, Hit); STREAM],
    n_candidates: usize,
    accept: PhantomData<F>,
}

/// The number of candidates decided together: enough to wait for memory once, but few enough that their rays do not
/// traverse far beyond their hits.
const TOGETHER: usize = 16;

impl<F: Fn(&[(usize, Hit)], &mut [bool])> WhereStream<F> {
    /// Shortens the rays to the accepted candidates.
    #[inline(always)]
    fn decide(&mut self, accept: &F) {
        let candidates = &self.candidates[..self.n_candidates];
        let mut accepted = [false; STREAM];
        accept(candidates, &mut accepted[..self.n_candidates]);
        for (&(ray, hit), &is_accepted) in candidates.iter().zip(&accepted) {
            let i = (ray - self.closest.members.start) % STREAM;
            if is_accepted && is_nearer(&hit, self.closest.hits[i]) {
                self.closest.shorten(i, hit);
            }
        }
        self.n_candidates = 0;
    }
}

impl<F: Fn(&[(usize, Hit)], &mut [bool])> Stream for WhereStream<F> {
    const EMPTY: Self = Self {
        closest: ClosestStream::EMPTY,
        candidates: [(0, Hit { t: 0.0, u: 0.0, v: 0.0, triangle: 0 }); STREAM],
        n_candidates: 0,
        accept: PhantomData,
    };

    type Rays<'a> = <ClosestStream as Stream>::Rays<'a>;
    type Context<'a>
        = &'a F
    where
        F: 'a;
    type Answer = Option<Hit>;

    #[inline(always)]
    fn start<S: Simd>(&mut self, simd: S, bvh: &Bvh, rays: Self::Rays<'_>) {
        self.closest.start(simd, bvh, rays);
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, bvh: &Bvh, accept: &F) -> bool {
        let Some((child, rays)) = self.closest.stack.pop(u64::MAX) else {
            if self.n_candidates > 0 {
                self.decide(accept);
            }
            return false;
        };
        if child.is_leaf() {
            for i in set_bits(rays) {
                let (limit, closest) = (self.closest.limits[i], self.closest.hits[i]);
                let ray = self.closest.members.start + i;
                for_hits_in_block(simd, bvh, child, &self.closest.rays, i, limit, |hit| {
                    if is_nearer(&hit, closest) {
                        self.candidates[self.n_candidates] = (ray, hit);
                        self.n_candidates += 1;
                    }
                });
                // Leave room for all hits of a leaf.
                if self.n_candidates > STREAM - WIDTH {
                    self.decide(accept);
                }
            }
            if self.n_candidates >= TOGETHER {
                self.decide(accept);
            }
        } else {
            self.closest.descend(simd, bvh, child, rays);
        }
        self.closest.stack.prefetch(simd, bvh);
        true
    }

    #[inline(always)]
    fn finish(&mut self, answers: &mut [Option<Hit>]) {
        self.closest.finish(answers);
    }
}

/// [`any_hit`] to infinity of up to [`STREAM`] rays.
struct ShadowStream {
    rays: PreparedRays<STREAM>,
    /// The indices of the rays in their batch.
    members: [usize; STREAM],
    /// Bit masks of the rays that have hit nothing yet, and of those that have.
    free: u64,
    hit: u64,
    stack: StreamStack,
}

/// Rays of a batch, with indices `start` plus one of `members`.
struct ShadowRays<'a> {
    batch: &'a RayBatch,
    start: usize,
    members: &'a [u16],
}

impl Stream for ShadowStream {
    const EMPTY: Self = Self {
        rays: PreparedRays::EMPTY,
        members: [0; STREAM],
        free: 0,
        hit: 0,
        stack: StreamStack::EMPTY,
    };

    type Rays<'a> = ShadowRays<'a>;
    type Context<'a> = ();
    type Answer = bool;

    #[inline(always)]
    fn start<S: Simd>(&mut self, simd: S, bvh: &Bvh, rays: ShadowRays<'_>) {
        let RayBatch { origins, directions } = rays.batch;
        let numbers = rays.members.iter().map(|&member| rays.start + usize::from(member));
        for (i, number) in numbers.enumerate() {
            self.rays.set(i, origins[number], directions[number]);
            self.members[i] = number;
        }
        let octant = octant(directions[self.members[0]]);
        self.free = self.rays.prepare(simd, octant, rays.members.len(), &bvh.bounds);
        self.stack.push(Child::node(0), self.free);
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, bvh: &Bvh, (): ()) -> bool {
        let Some((child, rays)) = self.stack.pop(self.free) else { return false };
        if child.is_leaf() {
            let block = &bvh.blocks[child.index()];
            let planes = Planes::of(simd, block);
            let mut hit = 0;
            for i in set_bits(rays) {
                // Avoid branches: a shadow ray starts on a triangle, so half of them would be mispredicted.
                let sheared = Sheared::new(simd, block, &self.rays, i);
                let mask = sheared.hits(simd, &planes, f32::MAX).mask;
                hit |= u64::from(mask != 0) << i;
            }
            self.hit |= hit;
            self.free &= !self.hit;
        } else {
            self.stack.push_crossed(simd, &bvh.nodes[child.index()], &self.rays, rays);
        }
        self.stack.prefetch(simd, bvh);
        true
    }

    #[inline(always)]
    fn finish(&mut self, answers: &mut [bool]) {
        for i in set_bits(self.hit) {
            answers[self.members[i]] = true;
        }
        self.hit = 0;
    }
}

/// The transmittance of up to [`STREAM`] rays. A ray visits its leaves in the same order regardless of the other rays,
/// so that its product has the same bits.
struct TransmittanceStream {
    rays: PreparedRays<STREAM>,
    /// The indices of the rays in their batch.
    members: [usize; STREAM],
    count: usize,
    transmittances: [f32; STREAM],
    /// The rays with transmittance left, as bits.
    free: u64,
    stack: StreamStack,
}

impl Stream for TransmittanceStream {
    const EMPTY: Self = Self {
        rays: PreparedRays::EMPTY,
        members: [0; STREAM],
        count: 0,
        transmittances: [1.0; STREAM],
        free: 0,
        stack: StreamStack::EMPTY,
    };

    type Rays<'a> = ShadowRays<'a>;
    type Context<'a> = &'a dyn Fn(usize, &Hit) -> f32;
    type Answer = f32;

    #[inline(always)]
    fn start<S: Simd>(&mut self, simd: S, bvh: &Bvh, rays: ShadowRays<'_>) {
        let RayBatch { origins, directions } = rays.batch;
        let numbers = rays.members.iter().map(|&member| rays.start + usize::from(member));
        for (i, number) in numbers.enumerate() {
            self.rays.set(i, origins[number], directions[number]);
            self.members[i] = number;
        }
        self.count = rays.members.len();
        self.transmittances[..self.count].fill(1.0);
        let octant = octant(directions[self.members[0]]);
        self.free = self.rays.prepare(simd, octant, self.count, &bvh.bounds);
        self.stack.push(Child::node(0), self.free);
    }

    #[inline(always)]
    fn advance<S: Simd>(
        &mut self,
        simd: S,
        bvh: &Bvh,
        of_hit: &dyn Fn(usize, &Hit) -> f32,
    ) -> bool {
        let Some((child, rays)) = self.stack.pop(self.free) else { return false };
        if child.is_leaf() {
            for i in set_bits(rays) {
                let mut transmittance = self.transmittances[i];
                for_hits_in_block(simd, bvh, child, &self.rays, i, f32::MAX, |hit| {
                    if transmittance > 0.0 {
                        transmittance *= of_hit(self.members[i], &hit);
                    }
                });
                self.transmittances[i] = transmittance;
                self.free &= !(u64::from(transmittance <= 0.0) << i);
            }
        } else {
            self.stack.push_crossed(simd, &bvh.nodes[child.index()], &self.rays, rays);
        }
        self.stack.prefetch(simd, bvh);
        true
    }

    #[inline(always)]
    fn finish(&mut self, answers: &mut [f32]) {
        for (&member, &transmittance) in
            self.members.iter().zip(&self.transmittances).take(self.count)
        {
            answers[member] = transmittance;
        }
        self.count = 0;
    }
}

/// Sorts the rays of a window by octant, preserving their order within. Returns the octants' ranges.
fn sort_by_octant(directions: &[Vec3], order: &mut [u16; WINDOW]) -> [Range<usize>; 8] {
    let mut counts = [0; 8];
    for &direction in directions {
        counts[octant(direction) as usize] += 1;
    }
    let mut end = 0;
    let octants = counts.map(|count| {
        end += count;
        end - count..end
    });
    let mut next = octants.clone().map(|range| range.start);
    for (i, &direction) in directions.iter().enumerate() {
        let slot = &mut next[octant(direction) as usize];
        order[*slot] = i as u16;
        *slot += 1;
    }
    octants
}
