//! Direct light at one shading point by three strategies, no renderer: the sampling core alone.

use domelight::bsdf::{Bsdf, Lambert, Lobe, Phong};
use domelight::environment::{Environment, Orientation, builtin::BuiltinProbe};
use domelight::math::{Frame, Vec3, vec3};
use domelight::sampling::{Heuristic, Sampler, SamplerKind};
use domelight::strategy::{
    BrdfSampling, EnvironmentSampling, LightTable, MultipleImportanceSampling, PointStrategy,
    SampleIndex, ShadingPoint,
};
use domelight::{Rgb, RgbImage};

/// What hides the light: here everything left of x = −0.5.
fn visible(wi: Vec3) -> bool {
    wi.x > -0.5
}

/// The mean of (Σ weight · V) over `n` camera samples.
fn estimate<S: PointStrategy>(strategy: &S, at: &ShadingPoint, n: u32) -> Rgb {
    let sampler = Sampler::new(SamplerKind::Sobol, 0, 0);
    let (mut sum, mut scratch) = (Rgb::BLACK, S::Scratch::default());
    for sample in 0..n {
        strategy.sample(at, SampleIndex { sampler, sample }, &mut scratch, |wi, weight| {
            if visible(wi) {
                sum += weight;
            }
        });
    }
    sum / n as f32
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let map: RgbImage = BuiltinProbe::Sky.image(256);
    let environment = &Environment::new(map, Orientation::default(), 1.0)?;

    let normal = vec3(0.2, 0.9, 0.1).normalize();
    let frame = Frame::from_z(normal);
    let wo = frame.to_local(vec3(0.3, 0.6, 0.7).normalize());
    let diffuse = Lambert::new(Rgb::splat(0.5));
    let gloss = Phong::new(Rgb::splat(0.3), 50.0);
    let bsdf = Bsdf::new(&[Lobe::from(diffuse), Lobe::from(gloss)])?.for_view(wo);
    let at = ShadingPoint { position: Vec3::ZERO, ng: normal, frame, wo, bsdf };

    let n = 1 << 14;
    let brdf = estimate(&BrdfSampling { environment, n_samples: 1 }, &at, n);
    let light = estimate(&EnvironmentSampling { environment, n_samples: 1 }, &at, n);
    let (table, heuristic) = (LightTable::Full, Heuristic::Balance);
    let mis = MultipleImportanceSampling::new(environment, table, heuristic, 1, 1)?;
    let both = estimate(&mis, &at, n);
    println!("brdf {brdf:?}\nenvironment {light:?}\nmis {both:?}");
    Ok(())
}
