//! Walking the tree: one ray to its closest or any hit, and streams of shadow rays.
//!
//! Everything here is generic over the instruction set and inlined into it.

use std::ops::Range;

use super::build::MAX_DEPTH;
use super::intersect::{PreparedRay, Slabs, hit_block};
use super::{Bvh, Child, WIDTH};
use crate::geometry::{Hit, Ray, RayBatch};
use crate::math::Vec3;
use crate::simd::{Floats, Kernel, Mask, Sets, Simd};

/// A node leaves at most seven children behind on the way down.
const STACK: usize = 256;
const _: () = assert!(MAX_DEPTH as usize * (WIDTH - 1) + WIDTH <= STACK);

/// Rays of a stream: one bit each in a word.
const STREAM: usize = 32;
/// Rays sorted at once: enough to fill the streams of all octants, few enough to stay coherent.
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
        closest_hit(simd, self.bvh, self.ray, &mut ClosestStack::new())
    }
}

/// [`Bvh::closest_hits`]
pub(super) struct ClosestHits<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) rays: &'a [Ray],
    pub(super) hits: &'a mut Vec<Option<Hit>>,
}

impl Kernel for ClosestHits<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut stack = [StreamEntry::default(); STACK];
        let mut stream = ClosestStream::default();
        let octant = |ray: &Ray| PreparedRay::octant(ray.direction);
        for run in self.rays.chunk_by(|a, b| octant(a) == octant(b)) {
            for rays in run.chunks(STREAM) {
                closest_hits(simd, self.bvh, rays, &mut stream, &mut stack);
                self.hits.extend_from_slice(&stream.hits[..rays.len()]);
            }
        }
    }
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
        let Some(ray) = PreparedRay::new(self.ray, &self.bvh.bounds) else { return false };
        any_hit(simd, self.bvh, &ray, last_below(self.ray.t_max))
    }
}

/// [`Bvh::occluded`]; `answers` start all false.
pub(super) struct Occluded<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) rays: &'a RayBatch,
    pub(super) answers: &'a mut [bool],
}

impl Kernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut stack = [StreamEntry::default(); STACK];
        let mut stream = [PreparedRay::default(); STREAM];
        let mut members = [0; STREAM];
        let mut order = [0; WINDOW];
        for start in (0..self.rays.len()).step_by(WINDOW) {
            let end = self.rays.len().min(start + WINDOW);
            let octants = sort_by_octant(&self.rays.directions[start..end], &mut order);
            for chunk in octants.iter().flat_map(|octant| order[octant.clone()].chunks(STREAM)) {
                // Leave out the rays that can hit nothing.
                let mut len = 0;
                for i in chunk.iter().map(|&offset| start + usize::from(offset)) {
                    let ray = Ray::new(self.rays.origins[i], self.rays.directions[i]);
                    if let Some(ray) = PreparedRay::new(&ray, &self.bvh.bounds) {
                        stream[len] = ray;
                        members[len] = i;
                        len += 1;
                    }
                }
                let hit = occluded_stream(simd, self.bvh, &stream[..len], &mut stack);
                for i in lanes(hit) {
                    self.answers[members[i]] = true;
                }
            }
        }
    }
}

/// The greatest t of the open interval that ends at `t_max`.
#[inline(always)]
fn last_below(t_max: f32) -> f32 {
    t_max.next_down()
}

/// A child yet to visit, and where the ray enters it.
#[derive(Clone, Copy, Default)]
struct ClosestEntry {
    enter: f32,
    child: Child,
}

/// Children yet to visit, the nearest of a node on top.
struct ClosestStack {
    entries: [ClosestEntry; STACK],
    len: usize,
}

impl ClosestStack {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [ClosestEntry::default(); STACK], len: 0 }
    }

    /// The next child that the ray enters no later than `limit`.
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

#[inline(always)]
fn closest_hit<S: Simd>(simd: S, bvh: &Bvh, ray: &Ray, stack: &mut ClosestStack) -> Option<Hit> {
    let prepared = PreparedRay::new(ray, &bvh.bounds)?;
    let mut limit = last_below(ray.t_max);
    let mut closest: Option<Hit> = None;
    stack.len = 0;
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            if let Some(hit) = closest_in_block(simd, bvh, child, &prepared, limit, closest) {
                limit = hit.t;
                closest = Some(hit);
            }
        } else {
            let node = &bvh.nodes[child.index()];
            let (crossed, enter) = Slabs::load(simd, node, &prepared).cross(simd, &prepared, limit);
            let crossed = crossed.bits();
            if crossed.is_power_of_two() {
                child = node.children[crossed.trailing_zeros() as usize % WIDTH];
                continue;
            }
            let enter = enter.store();
            let base = stack.len;
            for lane in lanes(crossed) {
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

/// Rays of one octant on their way to their closest hits.
struct ClosestStream {
    rays: [PreparedRay; STREAM],
    limits: [f32; STREAM],
    hits: [Option<Hit>; STREAM],
}

impl Default for ClosestStream {
    fn default() -> Self {
        Self { rays: [PreparedRay::default(); STREAM], limits: [0.0; STREAM], hits: [None; STREAM] }
    }
}

/// [`closest_hit`] of up to [`STREAM`] rays of one octant, together: a node's planes are loaded once for
/// all rays that reach it. Children are visited in the order in which one of them enters; the answer
/// does not depend on the order.
#[inline(always)]
fn closest_hits<S: Simd>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    stream: &mut ClosestStream,
    stack: &mut [StreamEntry; STACK],
) {
    let ClosestStream { rays: prepared, limits, hits } = stream;
    hits[..rays.len()].fill(None);
    let (mut all, mut first) = (0, 0);
    for (i, ray) in rays.iter().enumerate() {
        if let Some(ray) = PreparedRay::new(ray, &bvh.bounds) {
            (prepared[i], first) = (ray, i);
            all |= 1 << i;
        }
        limits[i] = last_below(ray.t_max);
    }
    stack[0] = StreamEntry { child: Child::node(0), rays: all };
    let mut len = usize::from(all != 0);
    while len > 0 {
        len -= 1;
        let StreamEntry { child, rays } = stack[len];
        if child.is_leaf() {
            for i in lanes(rays) {
                let hit = closest_in_block(simd, bvh, child, &prepared[i], limits[i], hits[i]);
                if let Some(hit) = hit {
                    limits[i] = hit.t;
                    hits[i] = Some(hit);
                }
            }
            continue;
        }
        let node = &bvh.nodes[child.index()];
        let slabs = Slabs::load(simd, node, &prepared[first]);
        let mut crossing = simd.empty();
        let mut enter = simd.splat(0.0);
        for i in lanes(rays) {
            let (crossed, entered) = slabs.cross(simd, &prepared[i], limits[i]);
            crossing = crossing.insert(crossed, 1 << i);
            enter = entered;
        }
        let (sets, enter) = (crossing.store(), enter.store());
        // The nearest child of the last ray on top.
        let base = len;
        let mut keys = [0.0; WIDTH];
        for lane in lanes(crossing.not_empty()) {
            let mut at = len;
            while at > base && keys[at - 1 - base] < enter[lane] {
                stack[at] = stack[at - 1];
                keys[at - base] = keys[at - 1 - base];
                at -= 1;
            }
            stack[at] = StreamEntry { child: node.children[lane], rays: sets[lane] };
            keys[at - base] = enter[lane];
            len += 1;
        }
    }
}

/// The best hit of a leaf if it is nearer than `closest`, or as near and of a lower number.
#[inline(always)]
fn closest_in_block<S: Simd>(
    simd: S,
    bvh: &Bvh,
    leaf: Child,
    ray: &PreparedRay,
    limit: f32,
    closest: Option<Hit>,
) -> Option<Hit> {
    let block = &bvh.blocks[leaf.index()];
    let hits = hit_block(simd, block, ray, limit)?;
    let t = hits.t.store();
    let lane = lanes(hits.mask)
        .reduce(|a, b| if (t[b], block.ids[b]) < (t[a], block.ids[a]) { b } else { a })?;
    if closest.is_some_and(|c| (c.t, c.triangle) < (t[lane], block.ids[lane])) {
        return None;
    }
    let [u, v] = hits.barycentric();
    Some(Hit { t: t[lane], u: u[lane], v: v[lane], triangle: block.ids[lane] })
}

#[inline(always)]
fn any_hit<S: Simd>(simd: S, bvh: &Bvh, ray: &PreparedRay, limit: f32) -> bool {
    let mut stack = [Child::default(); STACK];
    let mut len = 0;
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            if hit_block(simd, &bvh.blocks[child.index()], ray, limit).is_some() {
                return true;
            }
        } else {
            let node = &bvh.nodes[child.index()];
            let (crossed, _) = Slabs::load(simd, node, ray).cross(simd, ray, limit);
            // On with the first and largest; the others wait.
            let mut crossed = lanes(crossed.bits());
            if let Some(first) = crossed.next() {
                for lane in crossed {
                    stack[len] = node.children[lane];
                    len += 1;
                }
                child = node.children[first];
                continue;
            }
        }
        if len == 0 {
            return false;
        }
        len -= 1;
        child = stack[len];
    }
}

/// A child yet to visit, and the rays of the stream that enter it.
#[derive(Clone, Copy, Default)]
struct StreamEntry {
    child: Child,
    rays: u32,
}

/// The rays of a stream, all of one octant, that hit anything, as bits.
///
/// The node's planes stay in registers while one ray after the other is tested against the eight
/// boxes and its bit added to the sets of those that it crosses.
#[inline(always)]
fn occluded_stream<S: Simd>(
    simd: S,
    bvh: &Bvh,
    stream: &[PreparedRay],
    stack: &mut [StreamEntry; STACK],
) -> u32 {
    if stream.is_empty() {
        return 0;
    }
    let all = u32::MAX >> (STREAM - stream.len());
    let mut free = all;
    stack[0] = StreamEntry { child: Child::node(0), rays: all };
    let mut len = 1;
    while len > 0 {
        len -= 1;
        let StreamEntry { child, rays } = stack[len];
        let rays = rays & free;
        if rays == 0 {
            continue;
        }
        if child.is_leaf() {
            let block = &bvh.blocks[child.index()];
            for i in lanes(rays) {
                if hit_block(simd, block, &stream[i], f32::MAX).is_some() {
                    free &= !(1 << i);
                }
            }
            continue;
        }
        let node = &bvh.nodes[child.index()];
        let slabs = Slabs::load(simd, node, &stream[0]);
        let mut crossing = simd.empty();
        for i in lanes(rays) {
            let (crossed, _) = slabs.cross(simd, &stream[i], f32::MAX);
            crossing = crossing.insert(crossed, 1 << i);
        }
        let sets = crossing.store();
        for lane in lanes_from_last(crossing.not_empty()) {
            stack[len] = StreamEntry { child: node.children[lane], rays: sets[lane] };
            len += 1;
        }
    }
    all & !free
}

/// Orders the rays of a window by octant and keeps their order within; returns the octants' ranges.
fn sort_by_octant(directions: &[Vec3], order: &mut [u16; WINDOW]) -> [Range<usize>; 8] {
    let mut counts = [0; 8];
    for &direction in directions {
        counts[PreparedRay::octant(direction)] += 1;
    }
    let mut end = 0;
    let octants = counts.map(|count| {
        end += count;
        end - count..end
    });
    let mut next = octants.clone().map(|range| range.start);
    for (i, &direction) in directions.iter().enumerate() {
        let slot = &mut next[PreparedRay::octant(direction)];
        order[*slot] = i as u16;
        *slot += 1;
    }
    octants
}

/// The set bits, from the lowest.
#[inline(always)]
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (lane < u32::BITS).then_some(lane as usize)
    })
}

/// The set bits of a byte, from the highest: what is pushed last comes off the stack first.
#[inline(always)]
fn lanes_from_last(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.checked_ilog2()?;
        bits ^= 1 << lane;
        Some(lane as usize)
    })
}
