//! Custom lobes, from functions of single directions.

use std::fmt::Debug;

use super::{Brdf, ROUNDING, above};
use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::simd::{Colors, SimdFloat, Vectors};

/// A custom reflectance lobe. One implementation serves every strategy.
///
/// Directions are unit vectors in the local frame, where z is the shading normal, and those passed to
/// [`Bxdf::eval_pdf`] lie above the surface. The density must be positive wherever the value is, and must be the
/// density of [`Bxdf::sample`]; `testkit`'s χ² test proves it.
pub trait Bxdf: Debug + Send + Sync {
    /// f_r(wo, wi) · cos θ_i ≥ 0 \[sr⁻¹\], including the cosine, and the density of [`Bxdf::sample`] \[sr⁻¹\].
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32);

    /// Samples `wi` from uniform numbers in [0, 1); `None` is a sample with value zero. The default is cosine-weighted, for
    /// densities of cos θ / π.
    fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Vec3> {
        let _ = (wo, u_lobe);
        Some(crate::sampling::warp::cosine_hemisphere(u))
    }

    /// An upper bound over all `wi` on the largest channel of the value \[sr⁻¹\], which rejection sampling requires.
    fn max_eval(&self, wo: Vec3) -> f32;

    /// The approximate, non-negative fraction of uniform light that is reflected toward `wo` = (·, ·, `cos_theta_o`).
    fn albedo(&self, cos_theta_o: f32) -> Rgb;

    /// The GGX roughness α of an equally wide lobe around the mirror direction, or `None` if the lobe resembles a diffuse one.
    /// It guides `product`; a poor guess costs rays but adds no bias.
    fn roughness(&self) -> Option<f32> {
        None
    }
}

/// A [`Bxdf`] as a lobe. It is a pointer, so that BSDFs stay plain data.
// Packed, because the alignment of pointers would make every BSDF larger.
#[derive(Clone, Copy)]
#[repr(C, packed(4))]
pub struct CustomLobe(&'static dyn Bxdf);

impl CustomLobe {
    /// Wraps a lobe that lives as long as the program: a `static`, or a leaked one.
    pub fn new(bxdf: &'static dyn Bxdf) -> Self {
        Self(bxdf)
    }

    /// Keeps a lobe until the program ends. Its memory is never freed, so call this once per lobe, not once per
    /// shading point.
    pub fn leak(bxdf: impl Bxdf + 'static) -> Self {
        Self(Box::leak(Box::new(bxdf)))
    }

    /// The wrapped lobe.
    pub fn bxdf(&self) -> &'static dyn Bxdf {
        self.0
    }
}

impl PartialEq for CustomLobe {
    /// The same object in memory.
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(self.bxdf(), other.bxdf())
    }
}

impl Debug for CustomLobe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.bxdf().fmt(f)
    }
}

impl Brdf for CustomLobe {
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let bxdf = self.bxdf();
        let arguments = [wo.x, wo.y, wo.z, wi.x, wi.y, wi.z];
        let [r, g, b, pdf] = F::each(arguments, |[ox, oy, oz, ix, iy, iz]| {
            let (wo, wi) = (Vec3::new(ox, oy, oz), Vec3::new(ix, iy, iz));
            if !above(wo, wi) {
                return [0.0; 4];
            }
            let (value, pdf) = bxdf.eval_pdf(wo, wi);
            [value.r, value.g, value.b, pdf]
        });
        (Colors([r, g, b]), pdf)
    }

    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, [u, v]: [F; 2]) -> Vectors<F> {
        let bxdf = self.bxdf();
        let arguments = [wo.x, wo.y, wo.z, u_lobe, u, v];
        let [x, y, z] = F::each(arguments, |[x, y, z, u_lobe, u, v]| {
            let wi = bxdf.sample(Vec3::new(x, y, z), u_lobe, Vec2::new(u, v));
            wi.unwrap_or(Vec3::NEG_Z).to_array()
        });
        Vectors { x, y, z }
    }

    fn max_eval(&self, wo: Vec3) -> f32 {
        self.bxdf().max_eval(wo) * ROUNDING
    }

    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        self.bxdf().albedo(cos_theta_o)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_lobe, toward};
    use crate::bsdf::{Bsdf, Lambert, Lobe};
    use crate::math::{PI, vec2};

    /// Lambert's law, written as a caller would.
    #[derive(Debug)]
    struct Diffuse(Rgb);

    impl Bxdf for Diffuse {
        fn eval_pdf(&self, _wo: Vec3, wi: Vec3) -> (Rgb, f32) {
            (self.0 * (wi.z / PI), wi.z / PI)
        }

        fn max_eval(&self, _wo: Vec3) -> f32 {
            self.0.max_component() / PI
        }

        fn albedo(&self, _cos_theta_o: f32) -> Rgb {
            self.0
        }
    }

    #[test]
    fn a_callers_lobe_obeys_the_laws_and_equals_the_librarys() {
        let albedo = Rgb::new(0.5, 0.3, 0.1);
        let custom = CustomLobe::leak(Diffuse(albedo));
        check_lobe(&custom);
        check_bound(&custom, 1.1);
        let (mine, theirs) = (Bsdf::single(custom), Bsdf::single(Lambert::new(albedo)));
        for view in [0.0, 50.0, 89.0] {
            let (wo, wi) = (toward(view, 0.3), toward(40.0, 2.0));
            let (a, b) = (mine.eval_pdf(wo, wi), theirs.eval_pdf(wo, wi));
            assert!((a.0 - b.0).max_component().abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6);
            let (a, b) =
                (mine.sample(wo, 0.3, vec2(0.2, 0.7)), theirs.sample(wo, 0.3, vec2(0.2, 0.7)));
            assert!((a.unwrap().wi - b.unwrap().wi).length() < 1e-6);
        }
        assert_eq!(size_of::<Lobe>(), 56);
        assert_eq!(mine, mine);
    }
}
