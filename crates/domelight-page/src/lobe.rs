//! Reflectance lobes by themselves, for figures.

use domelight::bsdf::{Brdf, Bsdf, MaterialSpec};
use domelight::math::vec3;
use domelight::sampling::{Dimension, Sampler, SamplerKind};

use crate::error::error;
use crate::{Engine, Error};

impl Engine {
    /// f · cos θ (luminance) and density \[sr⁻¹\] of a material in the plane of incidence, at `n` angles of incidence from
    /// −90° to 90°, alternating; the viewer is at `theta_o` \[degrees\] on the negative side.
    ///
    /// # Errors
    /// If the text names no material.
    pub fn lobe_section(&self, material: &str, theta_o: f32, n: usize) -> Result<Vec<f32>, Error> {
        let (bsdf, wo) = view(material, theta_o)?;
        let mut out = Vec::with_capacity(2 * n);
        for i in 0..n {
            let theta = std::f32::consts::PI * ((i as f32 + 0.5) / n as f32 - 0.5);
            let (value, pdf) = bsdf.eval_pdf(wo, vec3(theta.sin(), 0.0, theta.cos()));
            out.extend([value.luminance(), pdf]);
        }
        Ok(out)
    }

    /// `n` directions drawn from a material: x, y and z, each by each; those of value zero are left out.
    ///
    /// # Errors
    /// If the text names no material.
    pub fn lobe_samples(
        &self,
        material: &str,
        theta_o: f32,
        n: usize,
        seed: u32,
    ) -> Result<Vec<f32>, Error> {
        let (bsdf, wo) = view(material, theta_o)?;
        let sampler = Sampler::new(SamplerKind::Independent, seed.into(), 0);
        let numbers = (0..n as u32).map(|i| sampler.numbers(Dimension::Brdf, i));
        let drawn = numbers.filter_map(|u| bsdf.sample(wo, u.u_lobe(), u.u()));
        Ok(drawn.flat_map(|sample| sample.wi.to_array()).collect())
    }
}

fn view(material: &str, theta_o: f32) -> Result<(Bsdf, domelight::math::Vec3), Error> {
    let spec: MaterialSpec = material.parse().map_err(error)?;
    let theta = theta_o.clamp(0.0, 89.0).to_radians();
    let wo = vec3(-theta.sin(), 0.0, theta.cos());
    Ok((Bsdf::from(spec).for_view(wo), wo))
}
