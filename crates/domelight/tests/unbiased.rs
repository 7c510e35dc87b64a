//! Every unbiased strategy estimates ∫ f_r · cos θ · L · V dω: each against quadrature texel by
//! texel, on every kind of material, with some texels hidden from the point.

use crate::common;

use common::{
    HEIGHT, MATERIALS, WIDTH, batches, bsdf, environment, estimate, hidden, point, quadrature,
    white_environment,
};
use domelight::bsdf::MaterialSpec;
use domelight::environment::{CompensatedTable, Environment, Orientation, UpAxis};
use domelight::math::{Vec3, vec3};
use domelight::sampling::{Heuristic, Sampler, SamplerKind};
use domelight::strategy::{
    BrdfSampling, Contributions, EnvironmentSampling, InstructionSet, LightTable,
    MultipleImportanceSampling, PixelPoints, PointStrategy, Portal, SampleScratch, TileShading,
};
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;
use testkit::{Suite, ZTest};

#[test]
fn strategies_agree_with_quadrature() {
    let views = [0.2, 1.1, 1.48];
    let environments =
        [environment(false, UpAxis::Y), environment(true, UpAxis::Z), white_environment()];
    let suite = Suite::of(MATERIALS.len() * views.len() * environments.len() * 10);
    let test = ZTest { suite, ..ZTest::default() };
    for env in &environments {
        let table = CompensatedTable::new(env);
        MATERIALS.par_iter().for_each(|name| {
            let bsdf = bsdf(name);
            for theta in views {
                let at = point(bsdf, theta);
                let reference = quadrature(env, &at);
                let check = |what: &str, batches: Vec<[f64; 3]>| {
                    let label = format!("{what}, {name}, view {theta}");
                    test.against(&label, &batches, reference).unwrap_or_else(|f| panic!("{f}"));
                };
                for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
                    let brdf = BrdfSampling { environment: env, n_samples: 2 };
                    check("brdf", batches(&brdf, env, &at, kind, 1024));
                    let light = EnvironmentSampling { environment: env, n_samples: 2 };
                    check("environment", batches(&light, env, &at, kind, 1024));
                }
                let mis = |table, heuristic, m, n| {
                    MultipleImportanceSampling::new(env, table, heuristic, m, n).unwrap()
                };
                for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
                    let table = LightTable::Compensated(table.clone());
                    let default = mis(table, Heuristic::Power, 1, 1);
                    check("mis power compensated", batches(&default, env, &at, kind, 1024));
                }
                let kind = SamplerKind::Sobol;
                let balance = mis(LightTable::Full, Heuristic::Balance, 1, 1);
                check("mis balance", batches(&balance, env, &at, kind, 1024));
                let power = mis(LightTable::Full, Heuristic::Power, 3, 1);
                check("mis power 3:1", batches(&power, env, &at, kind, 1024));
                let compensated = LightTable::Compensated(table.clone());
                let compensated = mis(compensated, Heuristic::Balance, 1, 2);
                check("mis compensated", batches(&compensated, env, &at, kind, 1024));
                let alone = mis(LightTable::Full, Heuristic::Balance, 2, 0);
                check("mis 2:0", batches(&alone, env, &at, SamplerKind::Independent, 1024));
            }
        });
    }
}

/// Samples of portals are a third technique: the mean does not depend on where portals stand, nor on the instruction set.
#[test]
fn portals_beside_light_and_brdf_are_unbiased() {
    const N: usize = 512;
    let env = environment(true, UpAxis::Z);
    let portal = |corner, a, b| Portal::new(corner, [a, b]).unwrap();
    let portals = [
        portal(vec3(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z),
        portal(vec3(0.5, 0.3, 0.5), vec3(0.2, 0.7, 0.0), vec3(1.0, 0.0, -2.0)),
        portal(vec3(-1.0, -2.0, -1.0), 2.0 * Vec3::X, 2.0 * Vec3::Z),
    ];
    let counts = [(1, 1, 2), (0, 1, 1), (2, 0, 3), (0, 0, 1)];
    let table = CompensatedTable::new(&env);
    let suite = Suite::of(MATERIALS.len() * (counts.len() - 1));
    let test = ZTest { suite, ..ZTest::default() };
    MATERIALS.par_iter().enumerate().for_each(|(i, name)| {
        let at = point(bsdf(name), [0.2, 1.1, 1.48][i % 3]);
        let expected = quadrature(&env, &at);
        for (k, (n_light, n_brdf, n_portal)) in counts.into_iter().enumerate() {
            let (table, heuristic) = if (i + k) % 2 == 0 && n_brdf > 0 {
                (LightTable::Compensated(table.clone()), Heuristic::Power)
            } else {
                (LightTable::Full, Heuristic::Balance)
            };
            let mis =
                MultipleImportanceSampling::new(&env, table, heuristic, n_light, n_brdf).unwrap();
            let mis = mis.with_portal_samples(n_portal);
            let estimate = |seed, instruction_set| {
                let sampler = Sampler::new(SamplerKind::Sobol, seed, 3);
                let pixels = [PixelPoints::new(0..N, N as u32, sampler)];
                let (points, samples) = (vec![at; N], (0..N as u32).collect::<Vec<_>>());
                let tile = TileShading::new(&points, &samples, &pixels, 1);
                let tile = TileShading { portals: &portals, instruction_set, ..tile };
                let mut out = Contributions::default();
                out.reset(N);
                mis.sample_tile(&tile, &mut SampleScratch::default(), &mut out);
                let rays = out.wi.iter().zip(&out.weight).filter(|(wi, _)| !hidden(&env, **wi));
                let sum: Rgb = rays.map(|(_, &weight)| weight).sum();
                sum.to_array().map(|c| f64::from(c) / N as f64)
            };
            let batches: Vec<_> =
                (0..48).map(|seed| estimate(seed, InstructionSet::best())).collect();
            assert_eq!(batches[0], estimate(0, InstructionSet::Scalar), "{name}");
            let label = format!("{name}, {n_light}:{n_brdf}, {n_portal} of portals");
            // Portals alone miss the light beside them.
            if n_light + n_brdf > 0 {
                test.against(&label, &batches, expected).unwrap_or_else(|f| panic!("{f}"));
            } else {
                let mean = |c: usize| batches.iter().map(|b| b[c]).sum::<f64>() / 48.0;
                assert!((0..3).all(|c| mean(c) < expected[c]), "{label}");
            }
        }
    });
}

/// Two techniques whose weights sum to one, divided by the common count as some slides have it,
/// give exactly half of the answer; this estimator does not.
#[test]
fn weights_that_sum_to_one_go_with_their_own_counts() {
    let env = environment(true, UpAxis::Y);
    let bsdf = "diffuse:0.8".parse::<MaterialSpec>().unwrap().into();
    let at = point(bsdf, 0.5);
    let mis =
        MultipleImportanceSampling::new(&env, LightTable::Full, Heuristic::Balance, 1, 1).unwrap();
    let mean = estimate(&mis, &env, &at, Sampler::new(SamplerKind::Sobol, 1, 1), 1 << 16)[1];
    let expected = quadrature(&env, &at)[1];
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} {expected}");
    assert!(mean > 1.9 * 0.5 * expected);
}

/// One channel keeps its own value although directions follow luminance.
#[test]
fn colors_are_not_lost_in_luminance() {
    let map = RgbImage::from_fn(WIDTH, HEIGHT, |x, _| match x % 3 {
        0 => Rgb::new(1.0, 0.0, 0.0),
        1 => Rgb::new(0.0, 1.0, 0.0),
        _ => Rgb::new(0.0, 0.0, 1.0),
    });
    let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
    let at = point("diffuse:0.8".parse::<MaterialSpec>().unwrap().into(), 0.4);
    let light = EnvironmentSampling { environment: &env, n_samples: 1 };
    let reference = quadrature(&env, &at);
    let batches = batches(&light, &env, &at, SamplerKind::Independent, 1024);
    ZTest::default().against("colored map", &batches, reference).unwrap();
}
