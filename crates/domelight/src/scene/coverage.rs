//! Coverage, transmission and single-sided surfaces: what rays hit and what they pass through.
//!
//! A surface with coverage a and transmittance T lets 1 − a + a T through, a color if T is a color. T is that of
//! `KHR_materials_transmission`: the base color, for light that is not reflected, straight through.
//!
//! A camera ray hits a surface with a probability equal to its coverage. Each triangle along the ray has its own random
//! number, so that the transmittances of several layers multiply. A covered point of a transmissive surface is hit with
//! probability p = max(r/(r + t), ¼), where r ≥ 0.1 is about what it reflects and emits and t the luminance of T; the sample's
//! weight is 1/p if the surface is hit, and T/(1 − p) if not. So a surface before even surroundings contributes the same
//! to a sample that hits it as to one that passes. Where the background is behind all of them, the ray sees it as well,
//! through the product of their transmittances, and hits the last of them if no other: a pane before the sky has no noise
//! of its own. A shadow ray multiplies the transmittances of all surfaces along it, without noise, using the mean of T's
//! channels at normal incidence.
//!
//! A single-sided surface is invisible to a camera ray that comes from behind, so that a closed body is hit once. It
//! casts a shadow from either side, but T also counts only once per body for light: where light reaches the front,
//! that is, where the shadow ray leaves the body. So light is tinted if it falls into a body, through it, or through
//! an open pane that faces the light.

use std::cell::RefCell;

use super::corners::Corners;
use super::material::LightShares;
use super::texture::Uvs;
use super::{AlphaMode, Coverage, Material, Part, Scene};
use crate::Rgb;
use crate::bvh::{Bvh, Frustum};
use crate::geometry::{Hit, Ray, RayBatch};
use crate::math::Vec3;
use crate::sampling::{rng::hash2, sobol};

/// The triangles that may not be opaque.
#[derive(Debug)]
pub(super) struct Partial {
    bvh: Bvh,
    /// The index in the scene of the first of these triangles.
    first_triangle: u32,
}

impl Partial {
    pub(super) fn new(bvh: Bvh, first_triangle: u32) -> Self {
        Self { bvh, first_triangle }
    }

    /// The hit with the triangle's index in the scene.
    fn in_scene(&self, hit: &Hit) -> Hit {
        hit.numbered_from(self.first_triangle)
    }
}

/// What a camera ray sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// The surface that the ray hits; `None` for the background.
    pub hit: Option<Hit>,
    /// A factor ≥ 0 on the radiance from there; 1 without transmission.
    pub throughput: Rgb,
    /// The fraction of the background's radiance to add, in \[0, 1\]: what surfaces transmit that have nothing else
    /// behind them.
    pub beyond: Rgb,
}

impl Sight {
    fn clear(hit: Option<Hit>) -> Self {
        Self { hit, throughput: Rgb::WHITE, beyond: Rgb::BLACK }
    }

    /// What a ray sees that crosses transmissive surfaces, in order, before it ends at what is not transmissive.
    fn through(crossings: &[Crossing], end: Option<Hit>) -> Self {
        // The BVH may report a hit twice.
        let each_once = crossings.chunk_by(|a, b| a.hit.triangle == b.hit.triangle);
        let place = |hit: Hit| (hit.t, hit.triangle);
        let is_nearer =
            |crossing: &Crossing| end.is_none_or(|end| place(crossing.hit) < place(end));
        let crossings = each_once.map(|same| same[0]).take_while(is_nearer);
        let last = if end.is_none() { crossings.clone().last() } else { None };
        let beyond = match last {
            None => Rgb::BLACK,
            Some(_) => crossings.clone().fold(Rgb::WHITE, |t, crossing| t * crossing.layer.through),
        };
        let mut throughput = Rgb::WHITE;
        for Crossing { hit, layer, is_met, .. } in crossings {
            let Layer { probability, coverage, through } = layer;
            if last.is_some_and(|last| last.hit == hit) {
                return Self { hit: Some(hit), throughput: throughput * coverage, beyond };
            }
            if is_met {
                return Self {
                    hit: Some(hit),
                    throughput: throughput * (coverage / probability),
                    beyond,
                };
            }
            throughput = throughput * (through / (1.0 - probability).max(f32::MIN_POSITIVE));
        }
        Self { hit: end, throughput, beyond }
    }
}

/// Selects the random numbers that decide what a camera ray sees. The numbers of the samples of one key, such as a pixel,
/// are stratified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SightKey {
    /// For example, the pixel.
    pub key: u64,
    /// The index of the sample.
    pub sample: u32,
}

impl SightKey {
    /// Whether the ray hits a triangle, given the probability that it does.
    #[inline]
    fn meets(self, triangle: u32, probability: f32) -> bool {
        // Cut-outs need no random number.
        if probability <= 0.0 || probability >= 1.0 {
            return probability >= 1.0;
        }
        uniform(self.key, self.sample, triangle) < probability
    }
}

/// What a batch of camera rays sees; see [`Scene::sights`]. Its memory serves the next batch.
#[derive(Debug, Default)]
pub struct Sights {
    /// The surface that each ray hits; `None` for the background.
    pub hits: Vec<Option<Hit>>,
    /// The factor ≥ 0 on the radiance from there, for each ray; empty if nothing transmits.
    pub throughputs: Vec<Rgb>,
    /// The fraction of the background's radiance to add, for each ray; empty if nothing transmits.
    pub beyond: Vec<Rgb>,
    /// The rays, ending at the closest opaque surface.
    rays: Vec<Ray>,
    /// The hits of these rays on surfaces that are not opaque.
    met: Vec<Option<Hit>>,
    crossings: Vec<Crossing>,
}

/// Hits whose texture coordinates are fetched together, so that the latency of memory counts once.
const TOGETHER: usize = 16;

/// The minimum probability with which a camera ray hits a transmissive surface. It reflects only a few percent of the
/// light, but that may include a sun.
const LEAST_REFLECTED: f32 = 0.25;

/// What a surface at least counts as contributing, because what it reflects may be brighter than what is behind it.
const LEAST_CONTRIBUTION: f32 = 0.1;

/// How a camera ray meets a transmissive surface.
#[derive(Clone, Copy, Debug)]
struct Layer {
    /// The probability that a ray hits it.
    probability: f32,
    coverage: f32,
    /// The fraction of the light that passes.
    through: Rgb,
}

/// A transmissive surface along a camera ray.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// The index of the ray in its batch.
    ray: usize,
    hit: Hit,
    layer: Layer,
    is_met: bool,
}

/// The order by ray, and by distance along each ray.
fn sort(crossings: &mut [Crossing]) {
    crossings.sort_unstable_by(|a, b| {
        let (first, second) = (&a.hit, &b.hit);
        a.ray
            .cmp(&b.ray)
            .then(first.t.total_cmp(&second.t))
            .then(first.triangle.cmp(&second.triangle))
    });
}

impl Coverage {
    /// The effective opacity in \[0, 1\], where `opacity` is the product of factor, texture and vertices; 0 if that is
    /// NaN.
    pub fn of(&self, opacity: f32) -> f32 {
        match self.mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } if opacity >= cutoff => 1.0,
            AlphaMode::Mask { .. } => 0.0,
            AlphaMode::Blend => super::material::unit(opacity),
        }
    }
}

impl Part {
    /// Whether it is opaque everywhere.
    pub(super) fn is_opaque(&self, materials: &[Material]) -> bool {
        let material = &materials[self.material];
        if material.transmits() || material.catches_shadows {
            return false;
        }
        let coverage = &material.coverage;
        let is_uniform = coverage.texture.is_none() && self.mesh.alphas.is_empty();
        coverage.mode == AlphaMode::Opaque || is_uniform && coverage.of(coverage.opacity) >= 1.0
    }
}

impl Scene {
    /// The first surface that a camera ray sees. A surface with partial coverage or transmission is seen with a
    /// probability, using random numbers that are a function of `key`, `sample` and the triangle. A single-sided
    /// surface is not seen from behind. The numbers for many samples of one key, such as a pixel, are stratified.
    pub fn sight(&self, ray: &Ray, key: u64, sample: u32) -> Sight {
        self.seen(ray, self.bvh.closest_hit(ray), SightKey { key, sample })
    }

    /// The hit of [`Scene::sight`].
    pub fn camera_hit(&self, ray: &Ray, key: u64, sample: u32) -> Option<Hit> {
        self.sight(ray, key, sample).hit
    }

    /// Whether [`Scene::sight`] may differ from the closest hit in [`Scene::bvh`].
    #[inline]
    pub(crate) fn has_see_through(&self) -> bool {
        self.has_single_sided || self.partial.is_some()
    }

    /// [`Scene::sight`] of many rays; fastest for neighboring rays, such as a tile's. Needs a key for each ray, or none if
    /// all surfaces are opaque. Overwrites `sights`.
    pub fn sights(&self, rays: &[Ray], keys: &[SightKey], sights: &mut Sights) {
        let Sights { hits, throughputs, beyond, rays: nearer, met, crossings } = sights;
        self.bvh.closest_hits(rays, hits);
        throughputs.clear();
        beyond.clear();
        if self.has_single_sided {
            rays.iter().zip(&mut *hits).for_each(|(ray, hit)| *hit = self.facing(ray, *hit));
        }
        let Some(partial) = &self.partial else { return };
        // Find what each ray hits before that.
        nearer.clear();
        nearer.extend(rays.iter().zip(&*hits).map(|(ray, hit)| up_to(ray, hit.as_ref())));
        crossings.clear();
        let noted = RefCell::new(std::mem::take(crossings));
        let crossed = |crossing| noted.borrow_mut().push(crossing);
        let accept = |candidates: &[(usize, Hit)], is_met: &mut [bool]| {
            for (hits, is_met) in candidates.chunks(TOGETHER).zip(is_met.chunks_mut(TOGETHER)) {
                let uvs = self.fetch_uvs(partial, hits);
                for ((&(i, hit), is_met), uvs) in hits.iter().zip(is_met).zip(&uvs) {
                    *is_met =
                        self.meets(i, &rays[i], keys[i], &partial.in_scene(&hit), uvs, crossed);
                }
            }
        };
        partial.bvh.closest_hits_where(nearer, accept, met);
        for (hit, met) in hits.iter_mut().zip(&*met) {
            *hit = met.map(|met| partial.in_scene(&met)).or(*hit);
        }
        *crossings = noted.into_inner();
        if !self.transmits {
            return;
        }
        // Select one of the transmissive surfaces before that, or what is behind them.
        sort(crossings);
        let mut rest = &crossings[..];
        for (i, hit) in hits.iter_mut().enumerate() {
            let (of_ray, others) = rest.split_at(rest.partition_point(|c| c.ray <= i));
            rest = others;
            let sight = Sight::through(of_ray, *hit);
            *hit = sight.hit;
            throughputs.push(sight.throughput);
            beyond.push(sight.beyond);
        }
    }

    /// The texture coordinates of up to [`TOGETHER`] hits of the second BVH.
    fn fetch_uvs(&self, partial: &Partial, hits: &[(usize, Hit)]) -> [Uvs; TOGETHER] {
        let mut corners = [const { None }; TOGETHER];
        for (corners, (_, hit)) in corners.iter_mut().zip(hits) {
            let hit = partial.in_scene(hit);
            let (part, triangle) = self.locate(hit.triangle);
            *corners = Some((&part.mesh, Corners::new(&part.mesh, triangle, &hit)));
        }
        corners.map(|of| of.map_or_else(Uvs::default, |(mesh, corners)| corners.uvs(mesh)))
    }

    /// [`Scene::sight`], given the closest opaque `hit`.
    fn seen(&self, ray: &Ray, hit: Option<Hit>, key: SightKey) -> Sight {
        let hit = self.facing(ray, hit);
        let Some(partial) = &self.partial else { return Sight::clear(hit) };
        let crossings = RefCell::new(Vec::new());
        let crossed = |crossing| crossings.borrow_mut().push(crossing);
        let accept = |hit: &Hit| {
            let hit = partial.in_scene(hit);
            let (part, triangle) = self.locate(hit.triangle);
            let uvs = Corners::new(&part.mesh, triangle, &hit).uvs(&part.mesh);
            self.meets(0, ray, key, &hit, &uvs, crossed)
        };
        let met = partial.bvh.closest_hit_where(&up_to(ray, hit.as_ref()), accept);
        let hit = met.map(|hit| partial.in_scene(&hit)).or(hit);
        let mut crossings = crossings.into_inner();
        sort(&mut crossings);
        Sight::through(&crossings, hit)
    }

    /// Whether ray `i` of a batch ends at a surface that is not opaque, at a hit with texture coordinates `uvs`. It passes
    /// through transmissive surfaces, which go to `crossed`.
    #[inline]
    fn meets(
        &self,
        i: usize,
        ray: &Ray,
        key: SightKey,
        hit: &Hit,
        uvs: &Uvs,
        crossed: impl FnOnce(Crossing),
    ) -> bool {
        if !self.faces(ray, hit) {
            return false;
        }
        let (part, triangle) = self.locate(hit.triangle);
        let coverage = self.opacity_at(part, triangle, hit, uvs);
        if !self.materials[part.material].transmits() {
            return key.meets(hit.triangle, coverage);
        }
        if coverage > 0.0 {
            let layer = self.layer(ray, hit, coverage);
            let is_met = key.meets(hit.triangle, layer.probability);
            crossed(Crossing { ray: i, hit: *hit, layer, is_met });
        }
        false
    }

    /// The closest hit of what is opaque and seen from the ray's side, given the closest of what is opaque.
    fn facing(&self, ray: &Ray, hit: Option<Hit>) -> Option<Hit> {
        if hit.is_some_and(|hit| !self.faces(ray, &hit)) {
            self.bvh.closest_hit_where(ray, |hit| self.faces(ray, hit))
        } else {
            hit
        }
    }

    /// How a camera ray meets a transmissive surface of some coverage.
    fn layer(&self, ray: &Ray, hit: &Hit, coverage: f32) -> Layer {
        let (part, triangle) = self.locate(hit.triangle);
        let normal = part.mesh.area_normal(triangle).normalize_or_zero();
        let cos_theta = normal.dot(ray.direction.normalize()).abs();
        let LightShares { transmitted, reflected } = self.shares(part, triangle, hit, cos_theta);
        let through = Rgb::splat(1.0 - coverage) + transmitted * coverage;
        let emission = self.materials[part.material].emission.as_ref();
        let emitted = emission.map_or(0.0, |e| e.radiance.luminance());
        let probability = meeting_probability(reflected + emitted, coverage, through);
        Layer { probability, coverage, through }
    }

    /// What becomes of light at a hit, where the surface exists.
    fn shares(&self, part: &Part, triangle: usize, hit: &Hit, cos_theta: f32) -> LightShares {
        let corners = Corners::new(&part.mesh, triangle, hit);
        let tint = corners.mix(&part.mesh.colors).unwrap_or(Rgb::WHITE);
        let uvs = corners.uvs(&part.mesh);
        self.materials[part.material].shares(&self.textures, &uvs, tint, cos_theta)
    }

    /// The mean share of light that a surface that transmits lets through to a shadow ray in `direction`, where it is
    /// there. Light that leaves a single-sided body has been tinted where it entered; what lets nothing through hides
    /// light from either side.
    fn shadow_transmittance(
        &self,
        part: &Part,
        triangle: usize,
        hit: &Hit,
        direction: Vec3,
    ) -> f32 {
        let through = self.shares(part, triangle, hit, 1.0).transmitted.mean();
        let is_front = || part.mesh.area_normal(triangle).dot(direction) > 0.0;
        if self.materials[part.material].double_sided || through <= 0.0 || is_front() {
            through
        } else {
            1.0
        }
    }

    /// Whether a camera ray within the frustum may see anything; false only if none does.
    pub(crate) fn may_hit(&self, frustum: &Frustum) -> bool {
        self.bvh.may_hit(frustum) || self.partial.as_ref().is_some_and(|p| p.bvh.may_hit(frustum))
    }

    /// Whether any surface transmits a fraction of the light.
    #[inline]
    pub(crate) fn has_partial(&self) -> bool {
        self.dims_light
    }

    /// Whether the surface at a hit is a shadow catcher.
    #[inline]
    pub(crate) fn catches_shadows(&self, hit: &Hit) -> bool {
        self.catches_shadows && self.materials[self.locate(hit.triangle).0.material].catches_shadows
    }

    /// The directions that surfaces face which show nothing but shadows, if there are any: that of the first triangle of
    /// the first of them.
    pub(crate) fn catcher_normal(&self) -> Option<Vec3> {
        let catches = |part: &&Part| self.materials[part.material].catches_shadows;
        let mesh = &self.parts.iter().find(catches)?.mesh;
        if mesh.triangles.is_empty() { None } else { mesh.area_normal(0).try_normalize() }
    }

    /// The transmittance in \[0, 1\] along each shadow ray of the surfaces that are not in [`Scene::bvh`]: a product
    /// over all of them. `transmittances` is overwritten, one entry per ray.
    pub fn transmittances(&self, rays: &RayBatch, transmittances: &mut Vec<f32>) {
        let Some(partial) = self.partial.as_ref().filter(|_| self.dims_light) else {
            transmittances.clear();
            transmittances.resize(rays.len(), 1.0);
            return;
        };
        let of_hit = |ray: usize, hit: &Hit| {
            let hit = partial.in_scene(hit);
            if self.catches_shadows(&hit) {
                return 1.0;
            }
            let coverage = self.opacity(&hit);
            let (part, triangle) = self.locate(hit.triangle);
            if self.transmits && self.materials[part.material].transmits() {
                let direction = rays.directions[ray];
                let body = self.shadow_transmittance(part, triangle, &hit, direction);
                return 1.0 - coverage + body * coverage;
            }
            1.0 - coverage
        };
        partial.bvh.transmittances(rays, &of_hit, transmittances);
    }

    /// The opacity in \[0, 1\] of the surface at a hit.
    pub fn opacity(&self, hit: &Hit) -> f32 {
        let (part, triangle) = self.locate(hit.triangle);
        let uvs = Corners::new(&part.mesh, triangle, hit).uvs(&part.mesh);
        self.opacity_at(part, triangle, hit, &uvs)
    }

    /// [`Scene::opacity`] at a place on a part.
    fn opacity_at(&self, part: &Part, triangle: usize, hit: &Hit, uvs: &Uvs) -> f32 {
        let (mesh, coverage) = (&part.mesh, &self.materials[part.material].coverage);
        let mut opacity = coverage.opacity;
        if !mesh.alphas.is_empty() {
            opacity *= Corners::new(mesh, triangle, hit).mix_within(&mesh.alphas);
        }
        if let Some(texture) = &coverage.texture {
            opacity *= texture.alpha_at(&self.textures, uvs);
        }
        coverage.of(opacity)
    }

    /// Whether the surface is visible from the ray's side.
    fn faces(&self, ray: &Ray, hit: &Hit) -> bool {
        if !self.has_single_sided {
            return true;
        }
        let (part, triangle) = self.locate(hit.triangle);
        if self.materials[part.material].double_sided {
            return true;
        }
        let direction = match self.placement(hit.triangle) {
            None => ray.direction,
            Some(placement) => placement.inverse_direction(ray.direction),
        };
        part.mesh.area_normal(triangle).dot(direction) <= 0.0
    }
}

/// The probability that a camera ray hits a transmissive surface of some coverage: the share of what the surface
/// contributes, its coverage times `contribution`, in all that is seen, under even light.
fn meeting_probability(contribution: f32, coverage: f32, through: Rgb) -> f32 {
    let (met, passed) = (coverage * contribution.max(LEAST_CONTRIBUTION), through.luminance());
    if passed <= 0.0 {
        return 1.0;
    }
    (met / (met + passed)).max(LEAST_REFLECTED * coverage)
}

/// The ray as far as what it hits.
#[inline]
fn up_to(ray: &Ray, hit: Option<&Hit>) -> Ray {
    Ray { t_max: hit.map_or(ray.t_max, |hit| hit.t), ..*ray }
}

/// The number in [0, 1) of a camera sample for a triangle: those of many samples are stratified, those of two triangles
/// independent.
fn uniform(key: u64, sample: u32, triangle: u32) -> f32 {
    let [bits, _] = sobol::first_two(sample, hash2(key, u64::from(triangle)));
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}
