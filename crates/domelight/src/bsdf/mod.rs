//! Reflectance: lobes and the materials that they add up to.

use crate::Rgb;
use crate::math::{Vec2, Vec3};

/// A reflectance lobe in the local frame (z the shading normal).
pub trait Brdf: Copy + Send + Sync {
    /// f_r(wo, wi) · max(0, cos θ_i) \[sr⁻¹\], the cosine inside; black when either direction lies
    /// at or below the surface.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb;

    /// Density of [`Brdf::sample`] per solid angle of `wi` \[sr⁻¹\]; zero below the surface.
    /// It may integrate to less than one: the rest is the probability of no sample.
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32;

    /// Draws `wi` from the uniform numbers `u` and `u_lobe` in [0, 1). `None` is a sample of value
    /// zero, to be counted and never redrawn.
    fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BrdfSample>;

    /// An upper bound over all `wi` of the greatest channel of [`Brdf::eval`] \[sr⁻¹\].
    fn max_eval(&self, wo: Vec3) -> f32;
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrdfSample {
    /// Toward the light, local frame, above the surface.
    pub wi: Vec3,
    /// [`Brdf::eval`] at `wi` \[sr⁻¹\].
    pub value: Rgb,
    /// [`Brdf::pdf`] at `wi` \[sr⁻¹\], positive and finite.
    pub pdf: f32,
}

/// STUB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// STUB.
    pub albedo: Rgb,
}

impl Lambert {
    /// STUB.
    pub const fn new(albedo: Rgb) -> Self {
        Self { albedo }
    }
}

/// STUB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// STUB.
    pub specular: Rgb,
    /// STUB.
    pub exponent: f32,
}

impl Phong {
    /// STUB.
    pub const fn new(specular: Rgb, exponent: f32) -> Self {
        Self { specular, exponent }
    }
}

/// STUB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// STUB.
    Lambert(Lambert),
    /// STUB.
    Phong(Phong),
}

/// STUB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    albedo: Rgb,
    /// STUB.
    pub roughness: f32,
}

impl Material {
    /// STUB.
    pub fn new(lobes: &[Lobe]) -> Self {
        let albedo = lobes
            .iter()
            .map(|l| match l {
                Lobe::Lambert(l) => l.albedo,
                Lobe::Phong(p) => p.specular,
            })
            .sum();
        Self { albedo, roughness: 1.0 }
    }

    /// STUB.
    pub fn metallic_roughness(base_color: Rgb, _metallic: f32, roughness: f32) -> Self {
        Self { albedo: base_color, roughness }
    }

    /// STUB.
    pub fn albedo(&self) -> Rgb {
        self.albedo
    }
}

/// STUB.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("STUB")]
pub struct ParseMaterialError;

impl std::str::FromStr for Material {
    type Err = ParseMaterialError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let (kind, rest) = s.split_once(':').ok_or(ParseMaterialError)?;
        let value: f32 = rest.parse().map_err(|_| ParseMaterialError)?;
        match kind {
            "diffuse" => Ok(Self::new(&[Lobe::Lambert(Lambert::new(Rgb::splat(value)))])),
            "ggx" => Ok(Self { albedo: Rgb::WHITE, roughness: value }),
            _ => Err(ParseMaterialError),
        }
    }
}
