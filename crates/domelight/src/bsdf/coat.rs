//! The clear coat of glTF (`KHR_materials_clearcoat`): a thin dielectric layer of refractive index 1.5.
//!
//! f_r = F D G₂/(4 cos θ_i cos θ_o), GGX about its own normal, because a coat is often smooth where the layer below has
//! relief. F is Schlick's reflectance with f0 = 0.04 at cos θ_o, as in the specification, whose coat reflects
//! F(N · V) D G and leaves 1 − strength · F(N · V) to the layers below ([`super::Bsdf::layered`]). So the coat is not
//! reciprocal. Cosines are with respect to the coat's normal.

use super::{Brdf, Fresnel, Ggx, HORIZON, Masking, fresnel, where_above};
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
        Self::fresnel(self.frame.z.dot(wo))
    }

    /// The Fresnel reflectance at a cosine to the coat's normal.
    #[inline(always)]
    fn fresnel<F: SimdFloat>(cos_theta_o: F) -> F {
        let one = |x| cos_theta_o.splat(x);
        one(Self::F0) + one(1.0 - Self::F0) * fresnel::schlick_weight(cos_theta_o)
    }

    /// The lobe without the Fresnel factor.
    fn ggx(&self) -> Ggx {
        Ggx::new([self.alpha; 2], Fresnel::One, Masking::Correlated)
    }

    /// Transforms from the frame of the layer below to the coat's.
    #[inline(always)]
    fn in_coat<F: SimdFloat>(&self, w: Vectors<F>) -> Vectors<F> {
        Vectors { x: w.dot(self.frame.x), y: w.dot(self.frame.y), z: w.dot(self.frame.z) }
    }
}

impl Brdf for Coat {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let to_viewer = self.in_coat(wo);
        let (value, pdf) = self.ggx().eval_lanes(to_viewer, self.in_coat(wi));
        let Colors([geometry, ..]) = value;
        let gray = Self::fresnel(to_viewer.z) * geometry;
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

    fn max_eval(&self, wo: Vec3) -> f32 {
        if wo.z <= HORIZON {
            return 0.0;
        }
        let wo = self.frame.to_local(wo);
        Self::fresnel(wo.z) * self.ggx().max_eval(wo)
    }

    /// The Fresnel reflectance at `cos_theta_o`, as if the coat's normal were the layer's.
    #[inline]
    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        Rgb::splat(Self::fresnel(cos_theta_o))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_one_way, toward};
    use crate::math::vec3;

    #[test]
    fn obeys_the_laws() {
        for alpha in [0.05, 0.3, 1.0] {
            let coat = Coat::new(alpha, Vec3::Z);
            check_one_way(&coat);
            check_bound(&coat, 2.5);
            for normal in [vec3(0.3, -0.1, 0.9), vec3(0.0, 0.8, 0.6)] {
                check_one_way(&Coat::new(alpha, normal));
            }
        }
    }

    #[test]
    fn the_narrowest_coat_is_finite() {
        for alpha in [f32::NAN, 0.0, 1e-30] {
            check_one_way(&Coat::new(alpha, Vec3::Z));
        }
        check_one_way(&Coat::new(0.0, vec3(0.5, 0.5, 0.7)));
    }

    #[test]
    fn a_coat_reflects_by_the_angle_of_the_view() {
        let ggx = Ggx::new([0.2; 2], Fresnel::One, Masking::Correlated);
        let coat = Coat::new(0.2, Vec3::Z);
        assert_eq!(coat.lean(), 0.0);
        for degrees in [0.0f32, 50.0, 80.0] {
            let wo = toward(degrees, 0.3);
            let reflected = 0.04 + 0.96 * (1.0 - degrees.to_radians().cos()).powi(5);
            for wi in [toward(40.0, 3.0), toward(70.0, 1.0)] {
                let ((value, pdf), (white, density)) =
                    (coat.eval_pdf(wo, wi), ggx.eval_pdf(wo, wi));
                assert!((value.g - reflected * white.g).abs() < 1e-5 * white.g, "{degrees} {wi}");
                assert_eq!(pdf, density);
            }
        }
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
