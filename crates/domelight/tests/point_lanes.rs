//! The library's strategies compute several points side by side: the same shadow rays as one point after the other, to the
//! bit, with every instruction set.

use crate::common;

use common::{MATERIALS, bsdf, environment, point};
use domelight::Rgb;
use domelight::bsdf::{Bsdf, Bxdf, CustomLobe};
use domelight::bvh::InstructionSet;
use domelight::environment::{CompensatedTable, Environment, UpAxis};
use domelight::math::{FRAC_1_PI, Vec3, vec3};
use domelight::sampling::{Heuristic, Sampler, SamplerKind};
use domelight::strategy::{
    BrdfSampling, Candidates, Contributions, EnvironmentSampling, LightTable,
    MultipleImportanceSampling, PixelPoints, PointStrategy, Resampling, SampleIndex,
    SamplingImportanceResampling, ShadingPoint, Strategy, TileShading,
};

/// A lobe of the caller's.
#[derive(Debug)]
struct Diffuse;

impl Bxdf for Diffuse {
    fn eval_pdf(&self, _wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let pdf = wi.z * FRAC_1_PI;
        (Rgb::new(0.8, 0.5, 0.2) * pdf, pdf)
    }

    fn max_eval(&self, _wo: Vec3) -> f32 {
        0.8 * FRAC_1_PI
    }

    fn albedo(&self, _cos_theta_o: f32) -> Rgb {
        Rgb::new(0.8, 0.5, 0.2)
    }
}

/// Pixels of 0 to 20 points: of one material seen from many sides, and of materials that change from point to point.
fn pixels() -> (Vec<ShadingPoint>, Vec<PixelPoints>) {
    let custom = Bsdf::single(CustomLobe::leak(Diffuse));
    let materials: Vec<Bsdf> =
        MATERIALS.iter().map(|name| bsdf(name)).chain([custom, Bsdf::BLACK]).collect();
    let mut points = Vec::new();
    let mut pixels = Vec::new();
    for (i, &n) in [20, 0, 1, 7, 16, 3, 20, 9].iter().enumerate() {
        let start = points.len();
        for (m, bsdf) in materials.iter().enumerate() {
            for k in 0..n {
                let bsdf = if i < 5 { bsdf } else { &materials[(m + k) % materials.len()] };
                let at = point(*bsdf, 0.1 + 1.4 * (k as f32 / 20.0));
                let ng = (at.ng + vec3(0.05 * k as f32, 0.02, 0.0)).normalize();
                points.push(ShadingPoint { ng, bsdf: bsdf.for_view(at.wo), ..at });
            }
        }
        let kind = if i == 3 { SamplerKind::Independent } else { SamplerKind::Sobol };
        let sampler = Sampler::new(kind, 5, i as u64);
        pixels.push(PixelPoints::new(start..points.len(), n as u32, sampler));
    }
    (points, pixels)
}

fn check<S: PointStrategy>(name: &str, strategy: &S) {
    let (points, pixels) = pixels();
    let samples: Vec<u32> = (0..points.len() as u32).map(|i| i * 7 % 64).collect();
    let mut expected = Contributions::default();
    expected.reset(points.len());
    let mut scratch = S::Scratch::default();
    for pixel in &pixels {
        for i in pixel.points.clone() {
            let sample_index = SampleIndex { sampler: pixel.sampler, sample: samples[i] };
            let push = |wi, weight| expected.push(i as u32, wi, weight);
            strategy.sample(&points[i], sample_index, &mut scratch, push);
        }
    }
    assert!(expected.len() > points.len() / 2, "{name}: {} rays", expected.len());
    for instruction_set in InstructionSet::ALL.into_iter().filter(|i| i.is_available()) {
        let tile =
            TileShading { instruction_set, ..TileShading::new(&points, &samples, &pixels, 8) };
        let mut found = Contributions::default();
        found.reset(points.len());
        strategy.push(&(), &tile, 0, &mut scratch, &mut found);
        assert_eq!(found.point, expected.point, "{name}, {instruction_set:?}");
        assert_eq!(found.wi, expected.wi, "{name}, {instruction_set:?}");
        assert_eq!(found.weight, expected.weight, "{name}, {instruction_set:?}");
    }
}

/// Runs `check` for every strategy under a map with black texels, +Z up.
fn check_all(environment: &Environment) {
    check("brdf", &BrdfSampling { environment, n_samples: 3 });
    check("environment", &EnvironmentSampling { environment, n_samples: 3 });
    let compensated = || LightTable::Compensated(CompensatedTable::new(environment));
    for (table, heuristic) in
        [(LightTable::Full, Heuristic::Balance), (compensated(), Heuristic::Power)]
    {
        let mis = MultipleImportanceSampling::new(environment, table, heuristic, 2, 3);
        check("mis", &mis.expect("samples of both"));
    }
    let sir = |[n_candidates, n_samples]: [u32; 2], candidates, resampling| {
        let sir = SamplingImportanceResampling {
            environment,
            n_candidates,
            n_samples,
            candidates,
            resampling,
        };
        check(&format!("sir {n_samples}/{n_candidates} {candidates:?} {resampling:?}"), &sir);
    };
    for candidates in [Candidates::Environment, Candidates::Brdf, Candidates::Mixture] {
        for resampling in
            [Resampling::Multinomial, Resampling::SystematicSorted, Resampling::Reservoir]
        {
            for numbers in [[3, 2], [21, 4], [40, 2]] {
                sir(numbers, candidates, resampling);
            }
        }
    }
    sir([1, 1], Candidates::Mixture, Resampling::default());
}

#[test]
fn points_side_by_side_request_the_rays_of_one_after_the_other() {
    check_all(&environment(true, UpAxis::Z));
    check_all(&environment(false, UpAxis::Y));
}
