//! What a material looks like from afar: the least that a density needs to follow it roughly.

use super::{Brdf as _, Lobe, Material};
use crate::math::Vec3;

/// A glossy lobe without its colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// Microfacets of roughness α along x and y. Gaussian slopes have short tails, GGX's long ones.
    Slopes {
        /// The roughness.
        alpha: [f32; 2],
        /// Whether tails fall as a Gaussian.
        gaussian: bool,
    },
    /// About the mirror direction, cosⁿ.
    Mirror {
        /// The exponent n.
        exponent: f32,
    },
}

impl Gloss {
    /// The roughness, of a mirror lobe that of the microfacets which reflect as widely: their normals
    /// turn by half the angle.
    pub fn width(&self) -> f32 {
        match *self {
            Self::Slopes { alpha: [x, y], .. } => x.min(y),
            Self::Mirror { exponent } => (2.0 / (exponent + 2.0)).sqrt() * 0.5,
        }
    }
}

/// A diffuse part and glossy lobes, weighed by the light that they reflect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outline {
    /// Albedo of what reflects by the cosine.
    pub diffuse: f32,
    /// The glossy lobes with their albedos; the first of none ends them.
    pub glossy: [Option<(f32, Gloss)>; super::MAX_LOBES],
}

impl Outline {
    /// The glossy lobes with their albedos.
    pub fn lobes(&self) -> impl Iterator<Item = (f32, Gloss)> {
        self.glossy.iter().copied().flatten()
    }
}

impl Material {
    /// The material seen from `wo`, in luminances.
    pub fn outline(&self, wo: Vec3) -> Outline {
        let mut outline = Outline::default();
        let mut n = 0;
        let mut add = |weight: f32, gloss| {
            outline.glossy[n] = Some((weight, gloss));
            n += 1;
        };
        let mut diffuse = 0.0;
        for (weight, lobe) in self.lobes() {
            let albedo = weight * lobe.directional_albedo(wo.z).luminance();
            match lobe {
                Lobe::Lambert(_) => diffuse += albedo,
                Lobe::Phong(l) => add(albedo, Gloss::Mirror { exponent: l.exponent() }),
                Lobe::Ward(l) => add(albedo, Gloss::Slopes { alpha: l.alpha(), gaussian: true }),
                Lobe::Ggx(l) => add(albedo, Gloss::Slopes { alpha: l.alpha(), gaussian: false }),
                Lobe::Beckmann(l) => {
                    add(albedo, Gloss::Slopes { alpha: l.alpha(), gaussian: true });
                }
                Lobe::MetallicRoughness(l) => {
                    let specular = l.specular_share(wo.z);
                    diffuse += (1.0 - specular) * albedo;
                    let alpha = l.alpha();
                    add(specular * albedo, Gloss::Slopes { alpha, gaussian: false });
                }
            }
        }
        outline.diffuse = diffuse;
        outline
    }
}
