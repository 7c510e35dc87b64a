//! The laws that every lobe obeys, checked in one place.

use super::{Brdf, above};
use crate::math::{Vec2, Vec3, from_spherical, vec2};
use testkit::Pcg;
use testkit::quadrature::Adaptive;

/// The direction at an angle from the normal in degrees and an azimuth in radians.
pub(crate) fn toward(degrees: f32, phi: f32) -> Vec3 {
    from_spherical(degrees.to_radians().cos(), phi)
}

/// Views from the normal to the very edge.
fn views() -> impl Iterator<Item = Vec3> {
    let angles = [0.0, 10.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.99];
    angles.into_iter().enumerate().map(|(i, angle)| toward(angle, 0.7 + 1.3 * i as f32))
}

fn point(rng: &mut Pcg) -> Vec2 {
    Vec2::from(rng.next_2d())
}

/// Black below the surface, finite, not negative, reciprocal; `eval`, `pdf` and `sample` agree with
/// `eval_pdf` exactly; the corners of the unit square do no harm.
pub(crate) fn check_lobe(lobe: &impl Brdf) {
    check(lobe, true);
}

/// [`check_lobe`] of what is not reciprocal.
pub(crate) fn check_one_way(lobe: &impl Brdf) {
    check(lobe, false);
}

fn check(lobe: &impl Brdf, is_reciprocal: bool) {
    let mut rng = Pcg::new(11);
    let last = 1.0 - f32::EPSILON / 2.0;
    let corners = [vec2(0.0, 0.0), vec2(last, 0.0), vec2(0.0, last), vec2(last, last)];
    for wo in views() {
        for i in 0..200 {
            let u = corners.get(i).copied().unwrap_or_else(|| point(&mut rng));
            let u_lobe = if i == 0 { last } else { rng.next_f32() };
            check_pair(lobe, wo, crate::sampling::warp::uniform_sphere(u), is_reciprocal);
            if let Some(s) = lobe.sample(wo, u_lobe, u) {
                assert_eq!((s.value, s.pdf), lobe.eval_pdf(wo, s.wi));
                assert!(above(wo, s.wi) && s.pdf > 0.0 && s.pdf.is_finite(), "{wo} {s:?}");
                assert!((s.wi.length() - 1.0).abs() < 1e-5, "{wo} {s:?}");
                check_pair(lobe, wo, s.wi, is_reciprocal);
            }
        }
    }
    for below in [toward(100.0, 0.0), -Vec3::Z, Vec3::X, Vec3::NAN] {
        assert!(lobe.sample(below, 0.5, vec2(0.3, 0.4)).is_none());
        check_pair(lobe, below, Vec3::Z, is_reciprocal);
        check_pair(lobe, Vec3::Z, below, is_reciprocal);
    }
}

fn check_pair(lobe: &impl Brdf, wo: Vec3, wi: Vec3, is_reciprocal: bool) {
    let (value, pdf) = lobe.eval_pdf(wo, wi);
    assert_eq!((lobe.eval(wo, wi), lobe.pdf(wo, wi)), (value, pdf));
    assert!(value.is_finite() && value.min_component() >= 0.0, "{wo} {wi} {value:?}");
    assert!(pdf.is_finite() && pdf >= 0.0, "{wo} {wi} {pdf}");
    if !above(wo, wi) {
        assert!(value.is_black() && pdf == 0.0, "{wo} {wi}");
        return;
    }
    if !is_reciprocal {
        return;
    }
    // f_r(wo, wi) = f_r(wi, wo): the same arithmetic but for the order of some products.
    let (f, swapped) = (value / wi.z, lobe.eval(wi, wo) / wo.z);
    let difference = (f - swapped).map(f32::abs).max_component();
    assert!(
        difference <= 1e-4 * f.max_component() + f32::MIN_POSITIVE,
        "{wo} {wi} {f:?} {swapped:?}"
    );
}

/// `max_eval` bounds a dense search over `wi` and exceeds what it finds by at most `factor`.
pub(crate) fn check_bound(lobe: &impl Brdf, factor: f32) {
    for wo in views().filter(|wo| wo.z > 0.01) {
        let bound = lobe.max_eval(wo);
        let (found, at) = search_maximum(lobe, wo);
        assert!(found <= bound, "{wo}: {found} at {at} > {bound}");
        assert!(bound <= factor * found, "{wo}: {bound} > {factor} · {found} at {at}");
    }
}

/// A grid of half vectors, fine round the normal, and one of directions; then a pattern search from
/// the best of them.
pub(crate) fn search_maximum(lobe: &impl Brdf, wo: Vec3) -> (f32, Vec3) {
    let value = |wi: Vec3| lobe.eval(wo, wi).max_component();
    let mut best = (0.0, Vec3::Z);
    let mut consider = |wi: Vec3| {
        if value(wi) > best.0 {
            best = (value(wi), wi);
        }
    };
    for i in 0..64 {
        let phi = i as f32 * std::f32::consts::TAU / 64.0;
        for j in 0..80 {
            let slope = 1e-5 * 1.2f32.powi(j);
            let h = crate::math::vec3(slope * phi.cos(), slope * phi.sin(), 1.0).normalize();
            consider(crate::math::reflect(wo, h));
            consider(from_spherical(j as f32 / 79.0, phi));
        }
    }
    let mut step = 0.02;
    while step > 1e-6 {
        let (before, at) = best;
        for offset in [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z] {
            let wi = (at + step * offset).normalize();
            if value(wi) > best.0 {
                best = (value(wi), wi);
            }
        }
        if best.0 <= before {
            step *= 0.5;
        }
    }
    best
}

const FINE: Adaptive = Adaptive { tolerance: 1e-7, min_depth: 3, max_depth: 10 };

/// ∫ f_r cos θ_i dω by quadrature.
pub(crate) fn directional_albedo(lobe: &impl Brdf, wo: Vec3) -> [f64; 3] {
    FINE.hemisphere(|w| lobe.eval(wo, Vec3::from(w.map(|c| c as f32))).to_array().map(f64::from))
}

/// 1 − ∫ pdf dω by quadrature: the fraction of samples that are none.
pub(crate) fn lost_fraction(lobe: &impl Brdf, wo: Vec3) -> f64 {
    let [kept] = FINE.hemisphere(|w| [f64::from(lobe.pdf(wo, Vec3::from(w.map(|c| c as f32))))]);
    1.0 - kept
}
