//! Strategies in whole pictures: a small statue under a sky, on one thread. `domelight bench` tells what their error costs.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::math::Vec3;
use domelight::render::{RenderSettings, render};
use domelight::sampling::Heuristic;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{Camera, CameraSettings, Scene};
use domelight::strategy::{
    BrdfSampling, Candidates, EnvironmentSampling, LightTable, MultipleImportanceSampling,
    ProductSampling, Resampling, SamplingImportanceResampling,
};

fn pictures(criterion: &mut Criterion) {
    let description = BuiltinScene::Statue.description();
    let view = CameraSettings::framing(&description.subject_bounds(), 1.0, Vec3::Y);
    let scene = Scene::new(description).expect("a scene");
    let environment = &Environment::new(BuiltinProbe::Sky.image(256), Orientation::default(), 1.0)
        .expect("light");
    let settings =
        RenderSettings { width: 96, height: 96, n_samples: 4, ..RenderSettings::default() };
    let camera = Camera::new(&view, settings.width, settings.height).expect("a view");
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");

    let mut group = criterion.benchmark_group("render");
    let n_samples = settings.width as u64 * settings.height as u64 * u64::from(settings.n_samples);
    group.throughput(Throughput::Elements(n_samples)).sample_size(20);
    macro_rules! bench {
        ($name:expr, $strategy:expr) => {
            let strategy = $strategy;
            let draw = || render(&scene, &camera, environment, &strategy, &settings, &());
            group.bench_function($name, |bencher| one_thread.install(|| bencher.iter(draw)));
        };
    }
    bench!("brdf", BrdfSampling { environment, n_samples: 2 });
    bench!("environment", EnvironmentSampling { environment, n_samples: 2 });
    let mis = MultipleImportanceSampling::new;
    bench!(
        "mis",
        mis(environment, LightTable::Full, Heuristic::Power, 1, 1).expect("rays of both")
    );
    let sir = SamplingImportanceResampling {
        environment,
        n_candidates: 16,
        n_samples: 2,
        candidates: Candidates::default(),
        resampling: Resampling::default(),
    };
    bench!("sir", sir);
    bench!("product", ProductSampling::new(environment, 16));
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
