//! The clear coat of glTF (`KHR_materials_clearcoat`): a thin dielectric layer of refractive index 1.5.
//!
//! f_r = F D G₂/(4 cos θ_i cos θ_o), GGX with f0 = 0.04, about its own normal, because a coat is often smooth where the
//! layer below has relief. Cosines are with respect to the coat's normal. The layers below are scaled by
//! 1 − strength · F(cos θ_o), as in the specification; see [`super::Bsdf::layered`].

use super::{Brdf, Fresnel, Ggx, HORIZON, Masking, where_above};
use crate::Rgb;
use crate::math::{Frame, Vec3};
use crate::simd::{Colors, SimdFloat, Vectors};

/// A clear coat with full strength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    frame: Frame,
    alpha: f32,
}

impl Coat {
    /// The coat's reflectance at normal incidence.
    pub const F0: f32 = 0.04;

    /// Creates the coat with GGX roughness `alpha`, clamped to \[[`super::MIN_ALPHA`], [`super::MAX_ALPHA`]\], about
    /// a unit `normal` in the local frame of the layer below. A normal that is not finite or not above that layer is
    /// replaced by +z.
    pub fn new(alpha: f32, normal: Vec3) -> Self {
        let normal = normal.try_normalize().filter(|n| n.z > 0.0).unwrap_or(Vec3::Z);
        let [alpha, _] = super::range::alpha([alpha; 2]);
        Self { frame: Frame::from_z(normal), alpha }
    }

    pub(super) fn alpha(&self) -> f32 {
        self.alpha
    }

    /// A unit vector in the local frame of the layer below.
    pub(super) fn normal(&self) -> Vec3 {
        self.frame.z
    }

    /// The tilt of the coat's normal from that of the layer below: the tangent of the angle.
    pub(super) fn lean(&self) -> f32 {
        let n = self.frame.z;
        n.truncate().length() / n.z
    }

    /// The Fresnel reflectance toward `wo`, in \[0, 1\].
    pub(super) fn reflectance(&self, wo: Vec3) -> f32 {
        Fresnel::Schlick { f0: Rgb::splat(Self::F0) }.eval(self.frame.z.dot(wo).max(0.0)).r
    }

    fn ggx(&self) -> Ggx {
        let fresnel = Fresnel::Schlick { f0: Rgb::splat(Self::F0) };
        Ggx::new([self.alpha; 2], fresnel, Masking::Correlated)
    }

    /// Transforms from the frame of the layer below to the coat's.
    #[inline(always)]
    fn in_coat<F: SimdFloat>(&self, w: Vectors<F>) -> Vectors<F> {
        let along = |axis: Vec3| w.dot_each(Vectors::splat(w.z, axis));
        Vectors { x: along(self.frame.x), y: along(self.frame.y), z: along(self.frame.z) }
    }
}

impl Brdf for Coat {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let (value, pdf) = self.ggx().eval_lanes(self.in_coat(wo), self.in_coat(wi));
        let Colors([gray, ..]) = value;
        (Colors([where_above(wo, wi, gray); 3]), where_above(wo, wi, pdf))
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, u: [F; 2]) -> Vectors<F> {
        let to_viewer = self.in_coat(wo);
        let wi = self.ggx().sample_lanes(to_viewer, u_lobe, u);
        let axis = |axis| Vectors::splat(wo.z, axis);
        let Frame { x, y, z } = self.frame;
        let in_layer = axis(x).times(wi.x).plus(axis(y).times(wi.y)).plus(axis(z).times(wi.z));
        // A direction below a tilted coat but above the layer has no density here, but may have one in a mixture.
        let horizon = wo.z.splat(HORIZON);
        let is_above = horizon.lt(to_viewer.z) & horizon.lt(wi.z);
        Vectors::select(is_above, in_layer, axis(-Vec3::Z))
    }

    /// The density of its microfacets.
    fn max_eval(&self, wo: Vec3) -> f32 {
        if wo.z <= HORIZON {
            return 0.0;
        }
        self.ggx().max_eval(self.frame.to_local(wo))
    }

    /// The Fresnel reflectance at `cos_theta_o`, as if the coat's normal were the layer's.
    #[inline]
    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        Fresnel::Schlick { f0: Rgb::splat(Self::F0) }.eval(cos_theta_o)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_lobe, check_one_way, toward};
    use crate::math::vec3;

    #[test]
    fn obeys_the_laws() {
        for alpha in [0.05, 0.3, 1.0] {
            let coat = Coat::new(alpha, Vec3::Z);
            check_lobe(&coat);
            // The bound takes the Fresnel factor for 1 where it may be: 25 times f0.
            check_bound(&coat, 2.5 * 25.0);
            // Its cosines are not to the normal that the law of reciprocity divides by.
            for normal in [vec3(0.3, -0.1, 0.9), vec3(0.0, 0.8, 0.6)] {
                check_one_way(&Coat::new(alpha, normal));
            }
        }
    }

    #[test]
    fn the_narrowest_coat_is_finite() {
        for alpha in [f32::NAN, 0.0, 1e-30] {
            check_lobe(&Coat::new(alpha, Vec3::Z));
        }
        check_one_way(&Coat::new(0.0, vec3(0.5, 0.5, 0.7)));
    }

    #[test]
    fn a_coat_that_does_not_lean_is_a_dielectric_ggx_lobe() {
        let fresnel = Fresnel::Schlick { f0: Rgb::splat(0.04) };
        let ggx = Ggx::new([0.2; 2], fresnel, Masking::Correlated);
        let coat = Coat::new(0.2, Vec3::Z);
        let (wo, wi) = (toward(50.0, 0.3), toward(40.0, 3.0));
        assert_eq!(coat.eval_pdf(wo, wi), ggx.eval_pdf(wo, wi));
        assert_eq!(coat.lean(), 0.0);
    }

    #[test]
    fn a_leaning_coat_reflects_about_its_own_normal() {
        let normal = vec3(0.3, 0.0, 1.0).normalize();
        let coat = Coat::new(0.01, normal);
        let wo = toward(20.0, 1.0);
        let mirror = 2.0 * normal.dot(wo) * normal - wo;
        assert!(coat.eval(wo, mirror).r > 10.0);
        assert_eq!(Coat::new(0.2, vec3(0.0, 0.0, -1.0)), Coat::new(0.2, Vec3::Z));
        assert_eq!(Coat::new(0.2, Vec3::NAN), Coat::new(0.2, Vec3::Z));
    }
}
