//! The strategy of product tables and learned visibility: every round of every pass is unbiased, on
//! every material, with some texels hidden.

use crate::common;

use common::{
    HEIGHT, MATERIALS, WIDTH, batches, bsdf, environment, hidden, integral, point, quadrature,
    white_environment,
};
use domelight::bvh::InstructionSet;
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::{Frame, Vec3, vec3};
use domelight::sampling::{Heuristic, Sampler, SamplerKind};
use domelight::strategy::levels::{N_LEVELS, level};
use domelight::strategy::product::{ProductPass, ProductScratch};
use domelight::strategy::{
    Contributions, LightTable, MultipleImportanceSampling, PixelPoints, Portal, ProductSampling,
    ShadingPoint, Strategy, TileShading,
};
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;
use testkit::quadrature::Adaptive;
use testkit::{Suite, ZTest};

/// A tile of 5 × 5 pixels, all with the same hits.
const SIDE: usize = 5;
/// Passes under one seed.
const N_PASSES: usize = 2;
/// Those that trace all their candidates, and those that choose by what the former taught.
const KINDS: [&str; N_LEVELS as usize] = ["pilots", "first", "second", "third", "last"];

/// Who tells a pass what is visible before it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scouts {
    None,
    /// They see what the tile sees.
    Honest,
    /// They see what is hidden, and nothing else.
    Liars,
}

/// What a tile is made of.
#[derive(Clone, Copy)]
struct TestTile<'a> {
    strategy: &'a ProductSampling<'a>,
    env: &'a Environment,
    hits: &'a [ShadingPoint],
    portals: &'a [Portal],
    scouts: Scouts,
    sampler: SamplerKind,
}

impl TestTile<'_> {
    /// The mean estimate of each kind of pixel under one seed.
    fn estimates(&self, seed: u64) -> [[f64; 3]; KINDS.len()] {
        let Self { strategy, env, hits, .. } = *self;
        let mut scratch = ProductScratch::default();
        let (mut sums, mut counts) = ([[0.0; 3]; KINDS.len()], [0.0; KINDS.len()]);
        for pass in 0..N_PASSES {
            let first = (pass * hits.len()) as u32;
            let mut shared = self.begin_pass(seed, first);
            if self.scouts != Scouts::None {
                // Scouts have their own random numbers.
                let pool = self.begin_pass(!seed, first);
                let is_liar = self.scouts == Scouts::Liars;
                let visible = |wi| if hidden(env, wi) == is_liar { 1.0 } else { 0.0 };
                self.render(&pool, (!seed, first), &mut scratch, visible, |_, _| {});
                strategy.brief(&mut shared, vec![strategy.findings(&scratch)]);
            }
            let visible = |wi| if hidden(env, wi) { 0.0 } else { 1.0 };
            self.render(&shared, (seed, first), &mut scratch, visible, |kind, sum| {
                counts[kind] += hits.len() as f64;
                sums[kind].iter_mut().zip(sum.to_array()).for_each(|(s, v)| *s += f64::from(v));
            });
        }
        let in_tile = (0..SIDE * SIDE).map(|i| level(i % SIDE, i / SIDE) as usize);
        let mut n_pixels = [0.0; KINDS.len()];
        in_tile.for_each(|kind| n_pixels[kind] += 1.0);
        std::array::from_fn(|kind| sums[kind].map(|s| s / (counts[kind] * n_pixels[kind])))
    }

    fn begin_pass(&self, seed: u64, first: u32) -> ProductPass {
        let sampler = Sampler::for_pass(self.sampler, seed, first);
        self.strategy.begin_pass(sampler, self.hits.len() as u32)
    }

    /// Renders a tile whose camera samples begin at `first`. Calls `of_kind` with the sum over the pixels of each kind.
    fn render(
        &self,
        shared: &ProductPass,
        (seed, first): (u64, u32),
        scratch: &mut ProductScratch,
        visible: impl Fn(Vec3) -> f32,
        mut of_kind: impl FnMut(usize, Rgb),
    ) {
        let Self { strategy, hits, portals, sampler, .. } = *self;
        let mut out = Contributions::default();
        for round in 0..strategy.n_rounds() {
            let (mut points, mut samples) = (Vec::new(), Vec::new());
            let pixels: Vec<PixelPoints> = (0..SIDE * SIDE)
                .map(|i| {
                    let start = points.len();
                    if level(i % SIDE, i / SIDE) == round {
                        points.extend(hits);
                        samples.extend((0..hits.len() as u32).map(|j| first + j));
                    }
                    PixelPoints {
                        points: start..points.len(),
                        n_samples: (points.len() - start) as u32,
                        sampler: Sampler::new(sampler, seed, i as u64),
                        one_material: hits.iter().all(|h| h.bsdf == hits[0].bsdf),
                    }
                })
                .collect();
            let tile =
                TileShading { portals, ..TileShading::new(&points, &samples, &pixels, SIDE) };
            out.reset(points.len());
            strategy.push(shared, &tile, round, scratch, &mut out);
            let visibility: Vec<f32> = out.wi.iter().map(|&wi| visible(wi)).collect();
            let seen =
                out.weight.iter().zip(&visibility).filter(|(_, v)| **v > 0.0).map(|(w, _)| w);
            of_kind(round as usize, out.base.iter().chain(seen).copied().sum());
            strategy.learn(&tile, &out, &visibility, scratch);
        }
    }
}

/// Checks the mean over many seeds of every kind of pixel.
fn check(
    test: ZTest,
    label: &str,
    strategy: &ProductSampling,
    env: &Environment,
    hits: &[ShadingPoint],
    expected: [f64; 3],
) {
    check_hints(test, label, strategy, env, hits, (&[], Scouts::None), expected);
}

/// [`check`] with portals and scouts.
fn check_hints(
    test: ZTest,
    label: &str,
    strategy: &ProductSampling,
    env: &Environment,
    hits: &[ShadingPoint],
    (portals, scouts): (&[Portal], Scouts),
    expected: [f64; 3],
) {
    let sampler =
        if hits.len().is_multiple_of(2) { SamplerKind::Sobol } else { SamplerKind::Independent };
    let tile = TestTile { strategy, env, hits, portals, scouts, sampler };
    let batches: Vec<_> = (0..48).map(|seed| tile.estimates(seed)).collect();
    for (kind, name) in KINDS.iter().enumerate() {
        let batches: Vec<[f64; 3]> = batches.iter().map(|b| b[kind]).collect();
        let label = format!("{label}, {name}");
        test.against(&label, &batches, expected).unwrap_or_else(|f| panic!("{f}"));
    }
}

/// A portal above the points, one that leans, and one behind their surface.
fn portals() -> Vec<Portal> {
    let portal = |corner, a, b| Portal::new(corner, [a, b]).unwrap();
    vec![
        portal(vec3(-0.5, 1.0, -0.5), vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)),
        portal(vec3(0.5, 0.3, 0.5), vec3(0.2, 0.7, 0.0), vec3(1.0, 0.0, -2.0)),
        portal(vec3(-1.0, -2.0, -1.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 0.0, 2.0)),
    ]
}

/// Portals are hints: where they stand changes noise, never the mean, though light is hidden within them and free beside
/// them.
#[test]
fn portals_are_unbiased_wherever_they_stand() {
    let env = environment(true, UpAxis::Z);
    let portals = portals();
    let sets = [&portals[..1], &portals[1..2], &portals[2..], &portals[..]];
    let cases = [(0.2, 8, 3), (1.3, 2, 12), (0.7, 1, 2)];
    let suite = Suite::of(MATERIALS.len() * sets.len() * KINDS.len());
    let test = ZTest { suite, ..ZTest::default() };
    MATERIALS.par_iter().enumerate().for_each(|(i, name)| {
        for (k, portals) in sets.iter().enumerate() {
            let (theta, n_rays, n_hits) = cases[(i + k) % cases.len()];
            let at = point(bsdf(name), theta);
            let expected = quadrature(&env, &at);
            let strategy = ProductSampling::new(&env, n_rays);
            let label = format!("{name}, portals {k}, {n_rays} rays, {n_hits} hits");
            let hits = vec![at; n_hits];
            let hints = (*portals, Scouts::None);
            check_hints(test, &label, &strategy, &env, &hits, hints, expected);
        }
    });
}

/// Scouts are hints: what they say changes noise, never the mean, though all of it be wrong.
#[test]
fn scouts_are_unbiased_whatever_they_say() {
    let env = environment(true, UpAxis::Z);
    let cases = [(0.2, 8, 3), (1.3, 2, 12), (0.7, 1, 2)];
    let scouts = [Scouts::Honest, Scouts::Liars];
    let portals = portals();
    let suite = Suite::of(MATERIALS.len() * 2 * scouts.len() * KINDS.len());
    let test = ZTest { suite, ..ZTest::default() };
    MATERIALS.par_iter().enumerate().for_each(|(i, name)| {
        for (k, scouts) in scouts.into_iter().enumerate() {
            for portals in [&[], &portals[..]] {
                let (theta, n_rays, n_hits) = cases[(i + k) % cases.len()];
                let at = point(bsdf(name), theta);
                let expected = quadrature(&env, &at);
                let strategy = ProductSampling::new(&env, n_rays);
                let n = portals.len();
                let label =
                    format!("{name}, {scouts:?}, {n} portals, {n_rays} rays, {n_hits} hits");
                let (hits, hints) = (vec![at; n_hits], (portals, scouts));
                check_hints(test, &label, &strategy, &env, &hits, hints, expected);
            }
        }
    });
}

/// The numbers that a processor's vectors compute are those of one number at a time.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    let env = environment(true, UpAxis::Z);
    for (name, sampler) in
        MATERIALS.iter().zip([SamplerKind::Sobol, SamplerKind::Independent].iter().cycle())
    {
        let hits = [0.2, 0.7, 1.3].map(|theta| point(bsdf(name), theta));
        // In a short pass and in a long one.
        let [short, long] = [(hits.to_vec(), 7), (hits.repeat(3), 2)];
        let portals = portals();
        for ((hits, n_rays), portals, scouts) in [
            (short.clone(), &[][..], Scouts::None),
            (long, &[], Scouts::Honest),
            (short, &portals[..], Scouts::Liars),
        ] {
            let of = |set| {
                let strategy = &ProductSampling::new(&env, n_rays).with_instruction_set(set)?;
                let (env, hits, sampler) = (&env, &hits[..], *sampler);
                let tile = TestTile { strategy, env, hits, portals, scouts, sampler };
                Some(tile.estimates(5))
            };
            let scalar = of(InstructionSet::Scalar);
            for set in InstructionSet::ALL {
                assert!(of(set).is_none_or(|other| Some(other) == scalar), "{name}, {set:?}");
            }
        }
    }
}

#[test]
fn every_round_is_unbiased_on_every_material() {
    let environments = [environment(true, UpAxis::Z), white_environment()];
    // Views, rays of each camera sample, and camera samples: two short passes and a long one.
    let cases = [(0.2, 8, 3), (1.3, 3, 4), (0.7, 1, 12)];
    let suite = Suite::of(MATERIALS.len() * environments.len() * cases.len() * KINDS.len());
    let test = ZTest { suite, ..ZTest::default() };
    for env in &environments {
        MATERIALS.par_iter().for_each(|name| {
            for (theta, n_rays, n_hits) in cases {
                let at = point(bsdf(name), theta);
                let expected = quadrature(env, &at);
                let strategy = ProductSampling::new(env, n_rays);
                let label = format!("{name}, view {theta}, {n_rays} rays, {n_hits} hits");
                check(test, &label, &strategy, env, &vec![at; n_hits], expected);
            }
        });
    }
}

/// Hits of every normal and material in one pixel, and single candidates.
#[test]
fn pixels_of_many_surfaces_are_unbiased() {
    let env = environment(false, UpAxis::Y);
    let turned = |i: usize| {
        let mut at = point(bsdf(MATERIALS[i]), 0.3 + 0.1 * i as f32);
        let normal = (at.frame.z + 0.4 * i as f32 * Vec3::X).normalize();
        at.frame = Frame::from_z(normal);
        at
    };
    // The narrowest lobe would need larger batches for single candidates.
    let hits: Vec<ShadingPoint> =
        (0..9).filter(|&i| MATERIALS[i] != "ggx:0.05").map(turned).collect();
    let each: Vec<_> = hits.iter().map(|at| quadrature(&env, at)).collect();
    let mean = |n: usize| {
        let sum = |c: usize| each[..n].iter().map(|e| e[c]).sum::<f64>();
        [0, 1, 2].map(|c| sum(c) / n as f64)
    };
    let cases = [(1, 1), (1, 2), (1, 8), (2, 5), (7, 8)];
    let test = ZTest::in_suite_of(cases.len() * KINDS.len());
    cases.into_par_iter().for_each(|(n_rays, n_hits)| {
        let strategy = ProductSampling::new(&env, n_rays);
        let label = format!("{n_rays} rays, {n_hits} hits");
        check(test, &label, &strategy, &env, &hits[..n_hits], mean(n_hits));
    });
}

/// A lobe too narrow for quadrature agrees with multiple importance sampling.
#[test]
fn mirror_like_lobes_agree_with_multiple_importance_sampling() {
    let env = environment(true, UpAxis::Y);
    let at = point(bsdf("ggx:0.001"), 0.7);
    let mis =
        MultipleImportanceSampling::new(&env, LightTable::Full, Heuristic::Balance, 1, 1).unwrap();
    let expected = batches(&mis, &env, &at, SamplerKind::Sobol, 1024);
    let strategy = ProductSampling::new(&env, 8);
    let tile = TestTile {
        strategy: &strategy,
        env: &env,
        hits: &[at; 4],
        portals: &[],
        scouts: Scouts::None,
        sampler: SamplerKind::Sobol,
    };
    let found: Vec<_> = (0..48).map(|seed| tile.estimates(seed)).collect();
    for (kind, name) in KINDS.iter().enumerate() {
        let found: Vec<[f64; 3]> = found.iter().map(|b| b[kind]).collect();
        ZTest::in_suite_of(KINDS.len()).two_sample(name, &found, &expected).unwrap();
    }
}

/// Maps with nothing to follow: constant, black, a single lit texel, a single row or column.
#[test]
fn odd_maps_are_unbiased() {
    let spot = |width, height, i: usize| {
        let mut map = RgbImage::filled(width, height, Rgb::BLACK);
        map.pixels[i] = Rgb::new(3.0, 2.0, 1.0);
        map
    };
    // `quadrature` goes by texels of this size.
    let maps = [
        RgbImage::filled(WIDTH, HEIGHT, Rgb::new(1.0, 2.0, 3.0)),
        spot(WIDTH, HEIGHT, WIDTH + 3),
        RgbImage::filled(WIDTH, HEIGHT, Rgb::BLACK),
    ];
    let test = ZTest::in_suite_of(maps.len() * 2 * KINDS.len());
    for (i, map) in maps.into_iter().enumerate() {
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        for name in ["diffuse:0.8", "ggx:0.4"] {
            let at = point(bsdf(name), 0.7);
            let strategy = ProductSampling::new(&env, 6);
            let label = format!("map {i}, {name}");
            check(test, &label, &strategy, &env, &[at; 2], quadrature(&env, &at));
        }
    }
    for (width, height) in [(1, 1), (1, 7), (300, 1), (5, 1000)] {
        let map = RgbImage::filled(width, height, Rgb::WHITE);
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let at = point(bsdf("diffuse:1"), 0.7);
        let strategy = ProductSampling::new(&env, 6);
        let batches: Vec<[f64; 3]> = (0..40)
            .map(|seed| {
                let sampler = Sampler::new(SamplerKind::Sobol, seed, 0);
                let pixels =
                    [PixelPoints { points: 0..1, n_samples: 1, sampler, one_material: true }];
                let points = [at];
                let tile = TileShading::new(&points, &[0], &pixels, 1);
                let pass = strategy.begin_pass(Sampler::for_pass(SamplerKind::Sobol, seed, 0), 32);
                let mut out = Contributions::default();
                out.reset(1);
                let mut scratch = ProductScratch::default();
                strategy.push(&pass, &tile, 0, &mut scratch, &mut out);
                out.weight.iter().copied().sum::<Rgb>().to_array().map(f64::from)
            })
            .collect();
        let rule = Adaptive { tolerance: 1e-5, min_depth: 2, max_depth: 8 };
        let open = |wi, le: Rgb, _| (at.eval(wi) * le).to_array().map(f64::from);
        let whole = integral(&white_environment(), rule, open);
        let label = format!("{width}x{height}");
        ZTest::in_suite_of(4).against(&label, &batches, whole).unwrap();
    }
}
