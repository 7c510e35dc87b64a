//! What rays see and pass through: surfaces that do not hide all behind them, or are not seen from behind.
//!
//! A camera ray meets a surface with a probability that is its opacity; each triangle along the ray has a random number
//! of its own, so that what is seen through several layers is their product. A shadow ray takes the product of
//! 1 − opacity over all surfaces along it, without noise. A single-sided surface is not there for a camera ray that
//! comes from behind; its shadow falls from either side, as that of a closed body does.

use super::shading::Corners;
use super::{AlphaMode, Coverage, Material, Part, Scene};
use crate::bvh::{Bvh, Frustum};
use crate::geometry::{Hit, Ray, RayBatch};
use crate::sampling::{rng::hash2, sobol};

/// The triangles that may not hide what is behind them.
#[derive(Debug)]
pub(super) struct Partial {
    bvh: Bvh,
    /// The number in the scene of the first.
    first_triangle: u32,
}

impl Partial {
    pub(super) fn new(bvh: Bvh, first_triangle: u32) -> Self {
        Self { bvh, first_triangle }
    }

    /// The hit with the triangle's number in the scene.
    fn in_scene(&self, hit: &Hit) -> Hit {
        Hit { triangle: hit.triangle + self.first_triangle, ..*hit }
    }
}

impl Coverage {
    /// The share in \[0, 1\] of the surface in what is seen, where the product of factor, texture and vertices is
    /// `opacity`; 0 if that is NaN.
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
    /// Whether it hides all behind it, everywhere.
    pub(super) fn is_opaque(&self, materials: &[Material]) -> bool {
        let coverage = &materials[self.material].coverage;
        let is_uniform = coverage.texture.is_none() && self.mesh.alphas.is_empty();
        coverage.mode == AlphaMode::Opaque || is_uniform && coverage.of(coverage.opacity) >= 1.0
    }
}

impl Scene {
    /// What a camera ray sees first. A surface that covers only a share of what is behind it is seen with that
    /// probability, by random numbers that are a function of `key`, `sample` and the triangle; a single-sided one not from behind. Numbers of many samples of
    /// one key, which may be a pixel, are stratified.
    pub fn camera_hit(&self, ray: &Ray, key: u64, sample: u32) -> Option<Hit> {
        self.seen(ray, self.bvh.closest_hit(ray), key, sample)
    }

    /// Whether [`Scene::camera_hit`] may differ from the closest hit of the hierarchy of [`Scene::bvh`].
    #[inline]
    pub(crate) fn has_see_through(&self) -> bool {
        self.has_single_sided || self.partial.is_some()
    }

    /// [`Scene::camera_hit`], given the closest `hit` of what is opaque.
    pub(crate) fn seen(
        &self,
        ray: &Ray,
        mut hit: Option<Hit>,
        key: u64,
        sample: u32,
    ) -> Option<Hit> {
        if hit.is_some_and(|hit| !self.faces(ray, &hit)) {
            hit = self.bvh.closest_hit_where(ray, |hit| self.faces(ray, hit));
        }
        let Some(partial) = &self.partial else { return hit };
        let nearer = Ray { t_max: hit.map_or(ray.t_max, |hit| hit.t), ..*ray };
        let accept = |hit: &Hit| {
            let hit = partial.in_scene(hit);
            self.faces(ray, &hit) && uniform(key, sample, hit.triangle) < self.opacity(&hit)
        };
        partial.bvh.closest_hit_where(&nearer, accept).map(|hit| partial.in_scene(&hit)).or(hit)
    }

    /// Whether a camera ray within the frustum may see anything; false only if none does.
    pub(crate) fn may_hit(&self, frustum: &Frustum) -> bool {
        self.bvh.may_hit(frustum) || self.partial.as_ref().is_some_and(|p| p.bvh.may_hit(frustum))
    }

    /// Whether anything lets a share of light through.
    #[inline]
    pub(crate) fn has_partial(&self) -> bool {
        self.partial.is_some()
    }

    /// What share of light, in \[0, 1\], the surfaces that are not in [`Scene::bvh`] let through along each shadow ray:
    /// the product of 1 − opacity. `transmittances` is overwritten, one entry a ray.
    pub fn transmittances(&self, rays: &RayBatch, transmittances: &mut Vec<f32>) {
        let Some(partial) = &self.partial else {
            transmittances.clear();
            transmittances.resize(rays.len(), 1.0);
            return;
        };
        let of_hit = |hit: &Hit| 1.0 - self.opacity(&partial.in_scene(hit));
        partial.bvh.transmittances(rays, &of_hit, transmittances);
    }

    /// The share in \[0, 1\] of the surface in what is seen at a hit.
    pub fn opacity(&self, hit: &Hit) -> f32 {
        let (part, triangle) = self.locate(hit.triangle);
        let (mesh, coverage) = (&part.mesh, &self.materials[part.material].coverage);
        let corners = Corners::new(mesh, triangle, hit);
        let mut opacity = coverage.opacity * corners.mix(&mesh.alphas).unwrap_or(1.0);
        if let Some(texture) = &coverage.texture {
            opacity *= texture.alpha_at(&self.textures, &corners.uvs(mesh));
        }
        coverage.of(opacity)
    }

    /// Whether the surface is seen from the ray's side.
    fn faces(&self, ray: &Ray, hit: &Hit) -> bool {
        if !self.has_single_sided {
            return true;
        }
        let (part, triangle) = self.locate(hit.triangle);
        if self.materials[part.material].double_sided {
            return true;
        }
        let [a, b, c] = part.mesh.triangles[triangle].map(|i| part.mesh.positions[i as usize]);
        (b - a).cross(c - a).dot(ray.direction) <= 0.0
    }
}

/// The number in [0, 1) of a camera sample for a triangle: those of many samples are stratified, those of two triangles
/// independent.
fn uniform(key: u64, sample: u32, triangle: u32) -> f32 {
    let [bits, _] = sobol::first_two(sample, hash2(key, u64::from(triangle)));
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}
