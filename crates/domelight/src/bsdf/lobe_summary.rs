//! A summary of a BSDF's lobes, from which a sampling density can follow the BSDF roughly.

use super::{Brdf as _, Bsdf, Lobe, MIN_ALPHA};
use crate::Rgb;
use crate::math::Vec3;

/// The shape of a glossy lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GlossyLobe {
    /// Microfacets with roughness α along x and y. Gaussian slopes have short tails, those of GGX long ones.
    Slopes {
        /// The roughness.
        alpha: [f32; 2],
        /// Whether the tails fall like a Gaussian.
        gaussian: bool,
        /// The normal around which the lobe lies, if it is not the surface's: a unit vector in the local frame.
        leaning: Option<Vec3>,
    },
    /// A cosⁿ lobe around the mirror direction.
    Mirror {
        /// The exponent n.
        exponent: f32,
    },
}

impl GlossyLobe {
    /// The roughness; for a mirror lobe, that of microfacets with an equally wide reflection, whose normals
    /// turn by half the angle.
    pub fn width(&self) -> f32 {
        match *self {
            Self::Slopes { alpha: [x, y], .. } => x.min(y),
            Self::Mirror { exponent } => (2.0 / (exponent + 2.0)).sqrt() * 0.5,
        }
    }
}

/// The albedo of a lobe that is black from a view, but not from all.
const LEAST_ALBEDO: f32 = 1e-4;

/// A diffuse part and glossy lobes, weighted by the light that they reflect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LobeSummary {
    /// The albedo of the diffuse part.
    pub diffuse: Rgb,
    /// The glossy lobes with their albedos, terminated by the first `None`.
    pub glossy: [Option<(Rgb, GlossyLobe)>; super::MAX_LOBES],
}

impl LobeSummary {
    /// The glossy lobes with their albedos.
    pub fn lobes(&self) -> impl Iterator<Item = (Rgb, GlossyLobe)> {
        self.glossy.iter().copied().flatten()
    }
}

impl Bsdf {
    /// Whether the BSDF is isotropic: invariant under rotation about the normal.
    #[cfg(feature = "render")]
    pub(crate) fn is_isotropic(&self) -> bool {
        self.lobes().all(|(_, lobe)| match lobe {
            Lobe::Ward(l) => l.alpha()[0] == l.alpha()[1],
            Lobe::Ggx(l) => l.alpha()[0] == l.alpha()[1],
            Lobe::Beckmann(l) => l.alpha()[0] == l.alpha()[1],
            Lobe::MetallicRoughness(l) => l.alpha()[0] == l.alpha()[1],
            Lobe::Lambert(_) | Lobe::Phong(_) | Lobe::Sheen(_) => true,
            Lobe::Coat(l) => l.lean() == 0.0,
            Lobe::Custom(_) => false,
        })
    }

    /// Summarizes the lobes as seen from `wo`.
    pub fn lobe_summary(&self, wo: Vec3) -> LobeSummary {
        let mut lobe_summary = LobeSummary::default();
        let mut n = 0;
        let mut add = |albedo: Rgb, gloss| {
            lobe_summary.glossy[n] = Some((albedo, gloss));
            n += 1;
        };
        let mut diffuse = Rgb::BLACK;
        for (weight, lobe) in self.lobes() {
            // One that reflects nothing toward this view by the Fresnel factor at the normal still does at others.
            let albedo = lobe.directional_albedo(wo.z);
            let albedo = if albedo.is_black() { Rgb::splat(LEAST_ALBEDO) } else { albedo } * weight;
            match lobe {
                Lobe::Lambert(_) | Lobe::Sheen(_) => diffuse += albedo,
                Lobe::Custom(l) => match l.bxdf().roughness() {
                    None => diffuse += albedo,
                    Some(alpha) => {
                        let alpha = [alpha.clamp(MIN_ALPHA, 1.0); 2];
                        add(albedo, GlossyLobe::Slopes { alpha, gaussian: false, leaning: None });
                    }
                },
                Lobe::Phong(l) => add(albedo, GlossyLobe::Mirror { exponent: l.exponent() }),
                Lobe::Ward(l) => {
                    add(
                        albedo,
                        GlossyLobe::Slopes { alpha: l.alpha(), gaussian: true, leaning: None },
                    );
                }
                Lobe::Ggx(l) => {
                    add(
                        albedo,
                        GlossyLobe::Slopes { alpha: l.alpha(), gaussian: false, leaning: None },
                    );
                }
                Lobe::Beckmann(l) => {
                    add(
                        albedo,
                        GlossyLobe::Slopes { alpha: l.alpha(), gaussian: true, leaning: None },
                    );
                }
                Lobe::Coat(l) => {
                    let leaning = (l.lean() > 0.0).then(|| l.normal());
                    let alpha = [l.alpha(); 2];
                    add(albedo, GlossyLobe::Slopes { alpha, gaussian: false, leaning });
                }
                Lobe::MetallicRoughness(l) => {
                    let specular = l.specular_share(wo.z);
                    diffuse += albedo * (1.0 - specular);
                    if specular > 0.0 {
                        let alpha = l.alpha();
                        add(
                            albedo * specular,
                            GlossyLobe::Slopes { alpha, gaussian: false, leaning: None },
                        );
                    }
                }
            }
        }
        lobe_summary.diffuse = diffuse;
        lobe_summary
    }
}
