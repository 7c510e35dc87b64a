//! Rejection and resampling: unbiased with every setting, what they keep follows the product of light
//! and reflectance, and their variance is what theory says.

use crate::common;

use std::cell::RefCell;

use common::{
    HEIGHT, MATERIALS, WIDTH, batches, bsdf, environment, hidden, integral, point, quadrature,
    texel_integrals, white_environment,
};
use domelight::bsdf::Brdf;
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::{Vec2, Vec3};
use domelight::sampling::{Heuristic, Sampler, SamplerKind};
use domelight::strategy::{
    CandidatePilot, Candidates, LightTable, MultipleImportanceSampling, PointStrategy, Proposal,
    RejectionSampling, RejectionScratch, Resampling, SampleIndex, SamplingImportanceResampling,
    ShadingPoint, SirScratch, StoppingRule,
};
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;
use testkit::quadrature::Adaptive;
use testkit::{Chi2, Suite, ZTest};

const CANDIDATES: [Candidates; 3] =
    [Candidates::Environment, Candidates::Brdf, Candidates::Mixture];

const RESAMPLINGS: [Resampling; 4] = [
    Resampling::Multinomial,
    Resampling::Systematic,
    Resampling::SystematicSorted,
    Resampling::Reservoir,
];

fn rejection(env: &Environment, proposal: Proposal, stop: StoppingRule) -> RejectionSampling<'_> {
    RejectionSampling::new(env, proposal, stop).unwrap()
}

/// `m` candidates, `n` picks.
fn sir(
    environment: &Environment,
    (m, n): (u32, u32),
    candidates: Candidates,
    resampling: Resampling,
) -> SamplingImportanceResampling<'_> {
    SamplingImportanceResampling {
        environment,
        n_candidates: m,
        n_samples: n,
        candidates,
        resampling,
    }
}

/// Every material, seen steeply and flatly, under colored noise with a bright spot and under even light.
fn each_case(check: impl Fn(&Environment, &ShadingPoint, [f64; 3], &str) + Sync) {
    let environments = [environment(true, UpAxis::Z), white_environment()];
    let views = [0.2, 1.1, 1.48];
    for (i, env) in environments.iter().enumerate() {
        MATERIALS.par_iter().for_each(|name| {
            for theta in views {
                let at = point(bsdf(name), theta);
                let label = format!("{name}, view {theta}, map {i}");
                check(env, &at, quadrature(env, &at), &label);
            }
        });
    }
}

const N_CASES: usize = 2 * 3 * MATERIALS.len();

#[test]
fn rejection_is_unbiased() {
    let variants = [
        (Proposal::Environment, StoppingRule::Tries(8), SamplerKind::Sobol),
        (Proposal::Brdf, StoppingRule::Tries(8), SamplerKind::Sobol),
        (Proposal::Tighter, StoppingRule::Tries(8), SamplerKind::Independent),
        // Limits that bind often.
        (Proposal::Tighter, StoppingRule::Accepted { n: 2, max_tries: 3 }, SamplerKind::Sobol),
        (Proposal::Brdf, StoppingRule::Accepted { n: 3, max_tries: 16 }, SamplerKind::Sobol),
        // A limit that hardly ever does.
        (Proposal::Tighter, StoppingRule::Accepted { n: 2, max_tries: 200 }, SamplerKind::Sobol),
    ];
    let suite = Suite::of(N_CASES * variants.len());
    let test = ZTest { suite, ..ZTest::default() };
    each_case(|env, at, reference, case| {
        for (proposal, stop, kind) in variants {
            let strategy = rejection(env, proposal, stop);
            let label = format!("{proposal:?}, {stop:?}, {case}");
            let batches = batches(&strategy, env, at, kind, 256);
            test.against(&label, &batches, reference).unwrap_or_else(|f| panic!("{f}"));
        }
    });
}

#[test]
fn resampling_is_unbiased() {
    let kinds = [SamplerKind::Independent, SamplerKind::Sobol];
    let each_way = CANDIDATES
        .into_iter()
        .flat_map(|c| (0..4).map(move |i| (c, RESAMPLINGS[i], (7, 3), kinds[i & 1])));
    let few = [
        (Candidates::Environment, Resampling::Systematic, (1, 1), SamplerKind::Sobol),
        (Candidates::Mixture, Resampling::SystematicSorted, (2, 5), SamplerKind::Sobol),
        (Candidates::Mixture, Resampling::Reservoir, (16, 4), SamplerKind::Sobol),
    ];
    let variants: Vec<_> = each_way.chain(few).collect();
    let suite = Suite::of(N_CASES * variants.len());
    let test = ZTest { suite, ..ZTest::default() };
    each_case(|env, at, reference, case| {
        for &(candidates, resampling, counts, kind) in &variants {
            let strategy = sir(env, counts, candidates, resampling);
            let label = format!("{candidates:?}, {resampling:?} {counts:?}, {case}");
            let batches = batches(&strategy, env, at, kind, 256);
            test.against(&label, &batches, reference).unwrap_or_else(|f| panic!("{f}"));
        }
    });
}

/// A lobe too narrow for quadrature: all agree with multiple importance sampling.
#[test]
fn mirror_like_lobes_agree_with_multiple_importance_sampling() {
    let env = environment(true, UpAxis::Y);
    let at = point(bsdf("ggx:0.001"), 0.7);
    let kind = SamplerKind::Sobol;
    let mis =
        MultipleImportanceSampling::new(&env, LightTable::Full, Heuristic::Balance, 1, 1).unwrap();
    let expected = batches(&mis, &env, &at, kind, 1024);
    let test = ZTest::in_suite_of(4);
    let check = |label: &str, batches: Vec<[f64; 3]>| {
        test.two_sample(label, &batches, &expected).unwrap();
    };
    let tighter = rejection(&env, Proposal::Tighter, StoppingRule::Tries(8));
    check("rejection", batches(&tighter, &env, &at, kind, 1024));
    for resampling in [Resampling::Multinomial, Resampling::SystematicSorted, Resampling::Reservoir]
    {
        let strategy = sir(&env, (16, 2), Candidates::Mixture, resampling);
        check(&format!("{resampling:?}"), batches(&strategy, &env, &at, kind, 256));
    }
}

/// The luminance of the product, and the density of the BRDF times the luminance of the light.
fn products(at: &ShadingPoint, wi: Vec3, le: Rgb) -> [f64; 2] {
    let (value, pdf) = at.eval_pdf(wi);
    [f64::from((value * le).luminance()), f64::from(pdf) * f64::from(le.luminance())]
}

#[test]
fn what_rejection_keeps_follows_the_product() {
    let env = environment(true, UpAxis::Y);
    let cases: Vec<_> = ["diffuse:0.8,0.5,0.2", "phong:50:0.5:0.5", "ggx:0.4", "mix"]
        .into_iter()
        .flat_map(|name| [(name, Proposal::Environment), (name, Proposal::Brdf)])
        .collect();
    let quadrature = Adaptive { tolerance: 1e-5, min_depth: 1, max_depth: 7 };
    let test = Chi2 {
        samples: 30_000,
        cells: [13, 27],
        quadrature,
        mass_tolerance: 1e-3,
        ..Chi2::in_suite_of(cases.len())
    };
    cases.into_par_iter().for_each(|(name, proposal)| {
        let at = point(bsdf(name), 0.7);
        let which = usize::from(proposal == Proposal::Brdf);
        let rule = Adaptive { tolerance: 1e-4, min_depth: 2, max_depth: 9 };
        let total = integral(&env, rule, |wi, le, _| products(&at, wi, le))[which];
        let strategy =
            rejection(&env, proposal, StoppingRule::Accepted { n: 2, max_tries: 1_000_000 });
        let sampler = Sampler::new(SamplerKind::Independent, 3, which as u64);
        let (mut sample, mut scratch) = (0, RejectionScratch::default());
        let draw = |_: [f32; 2], _: f32| {
            sample += 1;
            let mut first = None;
            strategy.sample(&at, SampleIndex { sampler, sample }, &mut scratch, |wi, _| {
                first = first.or(Some(wi.to_array()));
            });
            first
        };
        let pdf = |wi: [f32; 3]| {
            let wi = Vec3::from(wi);
            products(&at, wi, env.le(wi))[which] / total
        };
        test.sphere(&format!("{name} {proposal:?}"), draw, pdf).unwrap();
    });
}

/// The share of tries that are kept is the product's integral over the envelope's mass, and the
/// tighter envelope keeps more.
#[test]
fn the_acceptance_is_the_share_of_the_envelope() {
    let env = environment(true, UpAxis::Y);
    let rule = Adaptive { tolerance: 1e-4, min_depth: 2, max_depth: 9 };
    let test = ZTest::in_suite_of(6);
    for name in ["diffuse:0.8", "phong:50:0.5:0.5", "ggx:0.2"] {
        let at = point(bsdf(name), 0.7);
        let [product, density] = integral(&env, rule, |wi, le, _| products(&at, wi, le));
        let light = env.power() * f64::from(at.bsdf.max_eval(at.wo));
        let expected = [product / light, density / f64::from(env.max_luminance())];
        let scratch = RefCell::new(RejectionScratch::default());
        let acceptance = |proposal, sample| {
            let sampler = Sampler::new(SamplerKind::Independent, 4, 4);
            let strategy = rejection(&env, proposal, StoppingRule::Tries(1000));
            let numbers = SampleIndex { sampler, sample };
            strategy.sample_counted(&at, numbers, &mut scratch.borrow_mut(), |_, _| {})
        };
        for (proposal, expected) in
            [Proposal::Environment, Proposal::Brdf].into_iter().zip(expected)
        {
            let batches: Vec<[f64; 1]> =
                (0..100).map(|i| [f64::from(acceptance(proposal, i).acceptance())]).collect();
            test.against(&format!("{name} {proposal:?}"), &batches, [expected]).unwrap();
        }
        let better = if expected[0] > expected[1] { Proposal::Environment } else { Proposal::Brdf };
        assert_eq!(acceptance(Proposal::Tighter, 0).proposal, better, "{name} {expected:?}");
    }
}

/// With one pick the direction follows the density of the candidates for M = 1 and comes the nearer
/// to the product the more candidates there are: Pearson's statistic against the product falls until
/// no difference is left that the number of samples could show.
#[test]
fn picks_approach_the_product() {
    let env = environment(true, UpAxis::Y);
    let at = point(bsdf("phong:50:0.5:0.5"), 0.7);
    let rule = Adaptive { tolerance: 1e-4, min_depth: 2, max_depth: 9 };
    let product = texel_integrals(&env, rule, |wi, le, _| products(&at, wi, le));
    let total: f64 = product.iter().map(|p| p[0]).sum();
    let statistic = |resampling, n_candidates| {
        let strategy = sir(&env, (n_candidates, 1), Candidates::Mixture, resampling);
        let mut scratch = SirScratch::default();
        let mut counts = [0.0; WIDTH * HEIGHT];
        let sampler = Sampler::new(SamplerKind::Independent, 6, u64::from(n_candidates));
        for sample in 0..20_000 {
            strategy.sample(&at, SampleIndex { sampler, sample }, &mut scratch, |wi, _| {
                let uv = env.uv(wi);
                let column = ((uv.x * WIDTH as f32) as usize).min(WIDTH - 1);
                let row = ((uv.y * HEIGHT as f32) as usize).min(HEIGHT - 1);
                counts[row * WIDTH + column] += 1.0;
            });
        }
        let n: f64 = counts.iter().sum();
        let expected = product.iter().map(|p| n * p[0] / total);
        // Texels of which little is seen count together.
        let (mut chi2, mut rest, mut cells) = (0.0, (0.0, 0.0), 0);
        for (observed, expected) in counts.iter().zip(expected) {
            if expected < 5.0 {
                rest = (rest.0 + observed, rest.1 + expected);
            } else {
                chi2 += (observed - expected).powi(2) / expected;
                cells += 1;
            }
        }
        (chi2 + (rest.0 - rest.1).powi(2) / rest.1.max(1.0), cells)
    };
    [Resampling::SystematicSorted, Resampling::Reservoir].into_par_iter().for_each(|resampling| {
        let falling = [1, 4, 16].map(|m| statistic(resampling, m).0);
        assert!(falling.windows(2).all(|w| w[1] < w[0]), "{falling:?}");
        let (chi2, cells) = statistic(resampling, 64);
        // The normal approximation's quantile of 1 − 10⁻⁵.
        let bound = f64::from(cells) + 4.26 * f64::from(2 * cells).sqrt();
        assert!(chi2 < bound, "{chi2} {bound}");
    });
}

/// Moments of a candidate's contribution: for the counts and densities of both techniques, the
/// variance of the sum of all visible ones and the expectation of visible sum times hidden sum.
struct Moments {
    mean: f64,
    all_traced: f64,
    hidden_times_visible: f64,
}

fn moments(env: &Environment, at: &ShadingPoint, [m, n]: [f64; 2]) -> Moments {
    let rule = Adaptive { tolerance: 1e-3, min_depth: 3, max_depth: 8 };
    let sums = integral(env, rule, |wi, le, hidden| {
        let (value, p_brdf) = at.eval_pdf(wi);
        let (p_light, p_brdf) = (f64::from(env.pdf(wi)), f64::from(p_brdf));
        let density = m * p_light + n * p_brdf;
        let w = if density > 0.0 { f64::from((value * le).luminance()) / density } else { 0.0 };
        let (visible, hidden) = if hidden { (0.0, w) } else { (w, 0.0) };
        let of = |p: f64| [p * visible, p * hidden, p * visible * visible];
        let (a, b) = (of(p_light), of(p_brdf));
        [a[0], a[1], a[2], b[0], b[1], b[2]]
    });
    let (a, b) = ([sums[0], sums[1], sums[2]], [sums[3], sums[4], sums[5]]);
    let mean = m * a[0] + n * b[0];
    let hidden = m * a[1] + n * b[1];
    Moments {
        mean,
        all_traced: m * (a[2] - a[0] * a[0]) + n * (b[2] - b[0] * b[0]),
        hidden_times_visible: mean * hidden - m * a[0] * a[1] - n * b[0] * b[1],
    }
}

/// Estimates of luminance as batches of their mean and mean squared distance from `mean`.
fn squares<S: PointStrategy>(
    strategy: &S,
    env: &Environment,
    at: &ShadingPoint,
    mean: f64,
) -> Vec<[f64; 2]> {
    let batch = |b: u64| {
        let sampler = Sampler::new(SamplerKind::Independent, 8, b);
        let (mut sums, mut scratch) = ([0.0; 2], S::Scratch::default());
        let n = 1000;
        for sample in 0..n {
            let mut x = 0.0;
            strategy.sample(at, SampleIndex { sampler, sample }, &mut scratch, |wi, weight| {
                x += if hidden(env, wi) { 0.0 } else { f64::from(weight.luminance()) };
            });
            sums = [sums[0] + x, sums[1] + (x - mean).powi(2)];
        }
        sums.map(|s| s / f64::from(n))
    };
    (0..60).into_par_iter().map(batch).collect()
}

/// Var = A/M + (1 − 1/M) B/N for candidates of one density, A the variance of plain importance
/// sampling and B = I (L_ns − I); for two techniques the same with their own moments.
#[test]
fn the_variance_of_resampling_is_the_sum_of_two() {
    let env = environment(true, UpAxis::Y);
    let at = point(bsdf("phong:20:0.5:0.5"), 0.7);
    let counts = [(8, 1), (8, 4), (32, 4)];
    let test = ZTest::in_suite_of(2 * 3 * counts.len());
    for (m, n) in counts {
        for (candidates, split) in CANDIDATES.into_iter().zip([[1.0, 0.0], [0.0, 1.0], [0.5, 0.5]])
        {
            let expected = moments(&env, &at, split.map(|s: f64| s * f64::from(m)));
            let variance = expected.all_traced + expected.hidden_times_visible / f64::from(n);
            for resampling in [Resampling::Multinomial, Resampling::Reservoir] {
                let strategy = sir(&env, (m, n), candidates, resampling);
                let measured = squares(&strategy, &env, &at, expected.mean);
                let label = format!("{candidates:?} {resampling:?} {m} {n}");
                test.against(&label, &measured, [expected.mean, variance]).unwrap();
            }
        }
    }
    // The moments of one density are the law.
    let [one, many] = [1.0, 10.0].map(|m| moments(&env, &at, [m, 0.0]));
    assert!((one.all_traced / 10.0 - many.all_traced).abs() < 1e-3 * many.all_traced);
    let [product, _] =
        integral(&env, Adaptive { tolerance: 1e-3, min_depth: 3, max_depth: 8 }, |wi, le, _| {
            products(&at, wi, le)
        });
    let b = one.mean * (product - one.mean);
    assert!((many.hidden_times_visible - 0.9 * b).abs() < 1e-3 * b);
}

/// From the environment every kept direction is worth the same luminance C/M, so a fixed number of
/// tries has the variance I (C − I) / M.
#[test]
fn the_variance_of_rejection_is_that_of_its_envelope() {
    let env = environment(true, UpAxis::Y);
    let test = ZTest::in_suite_of(4);
    for name in ["diffuse:0.8,0.5,0.2", "phong:20:0.5:0.5"] {
        let at = point(bsdf(name), 0.7);
        let mean = moments(&env, &at, [1.0, 0.0]).mean;
        let mass = env.power() * f64::from(at.bsdf.max_eval(at.wo));
        for tries in [1, 16] {
            let strategy = rejection(&env, Proposal::Environment, StoppingRule::Tries(tries));
            let measured = squares(&strategy, &env, &at, mean);
            let variance = mean * (mass - mean) / f64::from(tries);
            test.against(&format!("{name} {tries}"), &measured, [mean, variance]).unwrap();
        }
    }
}

/// Every strategy of this file at a point: the sum of the weights, all visible.
fn unoccluded(env: &Environment, at: &ShadingPoint) -> Vec<Rgb> {
    let mut sums = Vec::new();
    for resampling in RESAMPLINGS {
        for candidates in CANDIDATES {
            sums.push(sum_of_weights(&sir(env, (8, 3), candidates, resampling), at));
        }
    }
    for stop in [StoppingRule::Tries(16), StoppingRule::Accepted { n: 2, max_tries: 16 }] {
        for proposal in [Proposal::Environment, Proposal::Brdf, Proposal::Tighter] {
            sums.push(sum_of_weights(&rejection(env, proposal, stop), at));
        }
    }
    sums
}

fn sum_of_weights<S: PointStrategy>(strategy: &S, at: &ShadingPoint) -> Rgb {
    let sampler = Sampler::new(SamplerKind::Sobol, 1, 1);
    let (mut sum, mut scratch) = (Rgb::BLACK, S::Scratch::default());
    for sample in 0..64 {
        strategy.sample(at, SampleIndex { sampler, sample }, &mut scratch, |_, w| sum += w);
    }
    sum
}

#[test]
fn darkness_is_dark() {
    let black = Environment::constant(Rgb::BLACK).unwrap();
    // All light from below.
    let map = RgbImage::from_fn(8, 6, |_, y| if y == 5 { Rgb::splat(9.0) } else { Rgb::BLACK });
    let below = Environment::new(map, Orientation::default(), 1.0).unwrap();
    for name in MATERIALS.into_iter().chain(["diffuse:0"]) {
        let at = point(bsdf(name), 0.7);
        for env in [&black, &below] {
            assert!(unoccluded(env, &at).iter().all(|sum| sum.is_black()), "{name}");
        }
        // Seen from behind the shading normal.
        let behind = ShadingPoint { wo: -at.wo, ..at };
        let env = environment(true, UpAxis::Y);
        assert!(unoccluded(&env, &behind).iter().all(|sum| sum.is_black()), "{name}");
    }
    let black_surface = point(bsdf("diffuse:0"), 0.7);
    let env = environment(true, UpAxis::Y);
    assert!(unoccluded(&env, &black_surface).iter().all(|sum| sum.is_black()));
}

/// One lit texel of a fine map, two thirds of a degree across: the integrand varies by less than a
/// percent over it, and the BRDF practically never finds it.
#[test]
fn one_lit_texel() {
    let mut map = RgbImage::filled(512, 256, Rgb::BLACK);
    map.pixels[40 * 512 + 300] = Rgb::new(3e5, 2e5, 1e5);
    let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
    let at = point(bsdf("diffuse:0.8,0.5,0.2"), 0.7);
    let le = env.sample(Vec2::splat(0.5)).unwrap();
    // The texel is so small that its center stands for all of it.
    let expected = at.eval(env.direction([300.5 / 512.0, 40.5 / 256.0].into())) * le.le / le.pdf;
    let close = |strategy: &str, sum: Rgb, samples: f32, tolerance: f32| {
        let difference = sum / samples - expected;
        let largest = difference.to_array().into_iter().fold(0.0, |m: f32, d| m.max(d.abs()));
        assert!(largest < tolerance * expected.max_component(), "{strategy}: {difference:?}");
    };
    for candidates in [Candidates::Environment, Candidates::Mixture] {
        for resampling in RESAMPLINGS {
            let strategy = sir(&env, (8, 3), candidates, resampling);
            close(&format!("{candidates:?}"), sum_of_weights(&strategy, &at), 64.0, 0.01);
        }
    }
}

/// The unshadowed luminance does not depend on the picks, and picks of one candidate are one ray.
#[test]
fn the_sum_of_the_weights_is_the_unshadowed_estimate() {
    let env = environment(true, UpAxis::Y);
    let at = point(bsdf("phong:50:0.5,0.2,0.1:0.5"), 0.7);
    let numbers = SampleIndex { sampler: Sampler::new(SamplerKind::Sobol, 1, 7), sample: 5 };
    for candidates in CANDIDATES {
        let luminances: Vec<f32> = RESAMPLINGS
            .into_iter()
            .flat_map(|r| [1, 3, 40].map(|n| sir(&env, (9, n), candidates, r)))
            .map(|strategy| {
                let (mut sum, mut rays) = (0.0, Vec::new());
                strategy.sample(&at, numbers, &mut SirScratch::default(), |wi, w| {
                    sum += w.luminance();
                    assert!(!rays.contains(&wi));
                    rays.push(wi);
                });
                assert!(rays.len() <= strategy.n_samples as usize);
                sum
            })
            .collect();
        assert!(luminances.iter().all(|y| (y / luminances[0] - 1.0).abs() < 1e-5));
    }
}

/// The pilot's choice is not worse than half and twice as many candidates by more than three standard errors of another
/// pilot, under ten lights and materials half of whose light is hidden.
#[test]
fn the_pilot_chooses_what_it_measures_as_best() {
    let half = |_: &ShadingPoint, wi: Vec3| if wi.x > 0.0 { 1.0 } else { 0.0 };
    let (even, spotted) = (white_environment(), environment(true, UpAxis::Y));
    for text in ["diffuse:0.8", "ggx:0.3", "ggx:0.05", "beckmann:1e-4", "phong:50:0.5"] {
        for (env, name) in [(&even, "even"), (&spotted, "spotted")] {
            let points: Vec<ShadingPoint> =
                (0..64).map(|i| point(bsdf(text), 0.3 + 0.01 * i as f32)).collect();
            let sir = |n_candidates| SamplingImportanceResampling {
                environment: env,
                n_candidates,
                n_samples: 1,
                candidates: Candidates::Mixture,
                resampling: Resampling::default(),
            };
            let best = CandidatePilot::new(env, &points, half, 1).optimal_number(&sir(1));
            let judge = CandidatePilot::new(env, &points, half, 2);
            let work = judge.work(&sir(best));
            for other in [best / 2, 2 * best].into_iter().filter(|&m| m > 0) {
                let losses = work.iter().zip(judge.work(&sir(other))).map(|(a, b)| a - b);
                let (loss, squares) = losses.fold((0.0, 0.0), |s, d| (s.0 + d, s.1 + d * d));
                let total: f64 = work.iter().sum();
                assert!(
                    loss <= 3.0 * squares.sqrt(),
                    "{text} {name}: {best} for {other}, {loss} of {total}"
                );
            }
        }
    }
}

/// A narrow lobe under even light, of which samples of the environment see nothing: the odd candidate comes from both.
#[test]
fn one_candidate_comes_from_the_mixture() {
    let at = point(bsdf("beckmann:1e-4"), 0.7);
    let env = white_environment();
    let sir = SamplingImportanceResampling {
        environment: &env,
        n_candidates: 1,
        n_samples: 1,
        candidates: Candidates::Mixture,
        resampling: Resampling::default(),
    };
    let n = 4096;
    let mut sum = 0.0;
    for sample in 0..n {
        let sampler = Sampler::new(SamplerKind::Sobol, 1, 0);
        let index = SampleIndex { sampler, sample };
        sir.sample(&at, index, &mut SirScratch::default(), |_, w| sum += w.luminance());
    }
    let albedo = f64::from(sum) / f64::from(n);
    let expected = f64::from(at.bsdf.albedo().luminance());
    assert!((albedo / expected - 1.0).abs() < 0.05, "{albedo} {expected}");
}
