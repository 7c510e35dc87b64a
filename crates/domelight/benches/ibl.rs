//! How well and how fast an environment is prefiltered, beside filtered importance sampling, the method of most tools.
//!
//! First a table of errors, of a one-texel sun, the cathedral and the studio, or of the probes whose paths the variable
//! `DOMELIGHT_PROBES` lists, separated by colons; then times. Errors are those of 96 texels a level beside quadrature over all
//! texels of the map, relative to the mean of the level: root mean square and largest.

use std::f32::consts::PI;
use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::{Environment, Orientation};
use domelight::math::{Frame, Vec3, vec3};
use domelight::rig::ibl::{FilteredMap, IblSettings, Layout, PrefilteredLight, prefilter};
use domelight::sampling::Pcg32;
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;

const SIZE: usize = 256;
const LEVELS: usize = 6;
const SAMPLES: usize = 1024;
const TEXELS: usize = 96;

fn settings() -> IblSettings {
    let linear = IblSettings::linear(SIZE);
    let roughness = (0..LEVELS).map(|level| level as f32 / (LEVELS - 1) as f32).collect();
    IblSettings { roughness, ..linear }
}

fn environments() -> Vec<(String, Environment)> {
    let of = |map: RgbImage| Environment::new(map, Orientation::default(), 1.0).expect("a map");
    if let Ok(paths) = std::env::var("DOMELIGHT_PROBES") {
        let load = |path: &str| {
            let probe = load_probe(Path::new(path), &ProbeOptions::default()).expect(path);
            (path.to_owned(), of(probe.image))
        };
        return paths.split(':').map(load).collect();
    }
    let mut sun = RgbImage::filled(1024, 512, Rgb::splat(0.2));
    sun.pixels[150 * 1024 + 300] = Rgb::splat(5e4);
    let builtin = |probe: BuiltinProbe| (probe.name().to_owned(), of(probe.image(512)));
    let mut all = vec![("a sun of one texel".to_owned(), of(sun))];
    all.extend([BuiltinProbe::Cathedral, BuiltinProbe::Studio].map(builtin));
    all
}

/// GGX's distribution of normals.
fn distribution(cos_h: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let d = cos_h * cos_h * (a2 - 1.0) + 1.0;
    a2 / (PI * d * d)
}

/// Křivánek & Colbert 2008, "Real-time Shading with Filtered Importance Sampling", as Filament's `cmgen` applies it: samples of
/// the lobe look up a level of the unfiltered cube whose texels have four times the solid angle of a sample.
struct FilteredSampling {
    levels: Vec<FilteredMap>,
}

impl FilteredSampling {
    fn new(mirror: &FilteredMap) -> Self {
        let mut levels = vec![mirror.clone()];
        while let Some(finer) = levels.last().filter(|cube| cube.size > 1) {
            levels.push(halved(finer));
        }
        Self { levels }
    }

    fn prefilter(&self) -> Vec<FilteredMap> {
        let level = |(level, &roughness): (usize, &f32)| {
            let size = SIZE >> level;
            if level == 0 {
                return self.levels[0].clone();
            }
            let texel =
                |i: usize| self.filter(Layout::Cube.direction(size, i), roughness * roughness);
            cube(size, (0..6 * size * size).into_par_iter().map(texel).collect())
        };
        settings().roughness.iter().enumerate().map(level).collect()
    }

    fn filter(&self, n: Vec3, alpha: f32) -> Rgb {
        let frame = Frame::from_z(n);
        let texel = 4.0 * PI / (6.0 * (SIZE * SIZE) as f32);
        let (mut sum, mut weight) = (Rgb::BLACK, 0.0);
        for i in 0..SAMPLES {
            let u = (i as f32 + 0.5) / SAMPLES as f32;
            let phi = 2.0 * PI * ((i as u32).reverse_bits() as f32 / 4_294_967_296.0);
            let cos_h = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
            let sin_h = (1.0 - cos_h * cos_h).max(0.0).sqrt();
            let h = vec3(sin_h * phi.cos(), sin_h * phi.sin(), cos_h);
            let l = 2.0 * cos_h * h - Vec3::Z;
            if l.z > 0.0 {
                let pdf = distribution(cos_h, alpha) / 4.0;
                let solid_angle = 1.0 / (SAMPLES as f32 * pdf);
                let level = 0.5 * (4.0 * solid_angle / texel).log2();
                sum += self.look_up(frame.to_world(l), level) * l.z;
                weight += l.z;
            }
        }
        sum / weight
    }

    fn look_up(&self, d: Vec3, level: f32) -> Rgb {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let (fine, t) = (level as usize, level.fract());
        let coarse = (fine + 1).min(self.levels.len() - 1);
        bilinear(&self.levels[fine], d) * (1.0 - t) + bilinear(&self.levels[coarse], d) * t
    }
}

/// The mean of each four texels.
fn halved(finer: &FilteredMap) -> FilteredMap {
    let (n, size) = (finer.size, finer.size / 2);
    let texel = |i: usize| {
        let (face, x, y) = (i / (size * size), i % size, i / size % size);
        let at = |dx: usize, dy: usize| finer.face(face)[(2 * y + dy) * n + 2 * x + dx];
        (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) * 0.25
    };
    cube(size, (0..6 * size * size).map(texel).collect())
}

fn cube(size: usize, texels: Vec<Rgb>) -> FilteredMap {
    FilteredMap { layout: Layout::Cube, size, texels }
}

fn bilinear(cube: &FilteredMap, d: Vec3) -> Rgb {
    let a = d.abs();
    // Vulkan 1.3, table "Cube Map Face Selection".
    let (face, s, t, major) = if a.x >= a.y && a.x >= a.z {
        if d.x > 0.0 { (0, -d.z, -d.y, a.x) } else { (1, d.z, -d.y, a.x) }
    } else if a.y >= a.z {
        if d.y > 0.0 { (2, d.x, d.z, a.y) } else { (3, d.x, -d.z, a.y) }
    } else if d.z > 0.0 {
        (4, d.x, -d.y, a.z)
    } else {
        (5, -d.x, -d.y, a.z)
    };
    let last = (cube.size - 1) as f32;
    let at = |c: f32| ((c / major + 1.0) * 0.5 * cube.size as f32 - 0.5).clamp(0.0, last);
    let (x, y) = (at(s), at(t));
    let (x0, y0, fx, fy) = (x as usize, y as usize, x.fract(), y.fract());
    let (x1, y1) = ((x0 + 1).min(cube.size - 1), (y0 + 1).min(cube.size - 1));
    let texel = |x: usize, y: usize| cube.face(face)[y * cube.size + x];
    let row = |y: usize| texel(x0, y) * (1.0 - fx) + texel(x1, y) * fx;
    row(y0) * (1.0 - fy) + row(y1) * fy
}

/// The integral over all texels of the map.
fn exact(env: &Environment, n: Vec3, alpha: f32) -> Rgb {
    let map = env.map();
    let (mut sum, mut weight) = ([0f64; 3], 0.0);
    for y in 0..map.height {
        for x in 0..map.width {
            let uv = [(x as f32 + 0.5) / map.width as f32, (y as f32 + 0.5) / map.height as f32];
            let l = env.direction(uv.into());
            let cos = n.dot(l);
            if cos > 0.0 {
                let cos_h = ((1.0 + cos) * 0.5).sqrt();
                let w = f64::from(distribution(cos_h, alpha) * cos) * env.texel_solid_angle(y);
                let le = map.get(x, y).to_array();
                (0..3).for_each(|c| sum[c] += w * f64::from(le[c]));
                weight += w;
            }
        }
    }
    Rgb::from(sum.map(|c| (c / weight) as f32))
}

/// The errors of levels 1 and higher: root mean square and largest.
fn errors(env: &Environment, levels: &[FilteredMap]) -> Vec<[f32; 2]> {
    let of = |(level, cube): (usize, &FilteredMap)| {
        let alpha = settings().roughness[level].powi(2);
        let mut pcg = Pcg32::new(level as u64, 1);
        let picks: Vec<usize> =
            (0..TEXELS).map(|_| (pcg.next_f32() * cube.texels.len() as f32) as usize).collect();
        let mean =
            cube.texels.iter().map(|t| t.luminance()).sum::<f32>() / cube.texels.len() as f32;
        let off = picks.par_iter().map(|&i| {
            let d = cube.layout.direction(cube.size, i);
            (cube.texels[i].luminance() - exact(env, d, alpha).luminance()).abs() / mean
        });
        let off: Vec<f32> = off.collect();
        let square = off.iter().map(|e| e * e).sum::<f32>() / TEXELS as f32;
        [square.sqrt(), off.iter().copied().fold(0.0, f32::max)]
    };
    levels.iter().enumerate().skip(1).map(of).collect()
}

fn print_errors(name: &str, env: &Environment) {
    let PrefilteredLight { levels, .. } = prefilter(env, &settings()).expect("light");
    let sampled = FilteredSampling::new(&levels[0]).prefilter();
    println!("{name}: errors relative to the mean of the level [%], root mean square (largest)");
    print!("{:>28}", "roughness");
    for roughness in &settings().roughness[1..] {
        print!("{roughness:>18.1}");
    }
    println!();
    for (method, levels) in [("domelight ibl", &levels), ("1024 filtered samples", &sampled)] {
        print!("{method:>28}");
        for [rms, largest] in errors(env, levels) {
            print!("{:>18}", format!("{:.3} ({:.2})", 100.0 * rms, 100.0 * largest));
        }
        println!();
    }
}

fn benches(criterion: &mut Criterion) {
    let all = environments();
    for (name, env) in &all {
        print_errors(name, env);
    }
    let (name, env) = &all[all.len() - 1];
    let mut group = criterion.benchmark_group(format!("{name}, {SIZE} columns"));
    group.sample_size(10);
    let light = prefilter(env, &settings()).expect("light");
    group.bench_function("domelight ibl", |b| b.iter(|| black_box(prefilter(env, &settings()))));
    let sampling = FilteredSampling::new(&light.levels[0]);
    group.bench_function("1024 filtered samples", |b| b.iter(|| black_box(sampling.prefilter())));
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
