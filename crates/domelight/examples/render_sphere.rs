//! Renders a sphere under the built-in studio by multiple importance sampling into a PNG.

use domelight::Rgb;
use domelight::environment::{Environment, Orientation, builtin::BuiltinProbe};
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::picture::{png, write_atomically};
use domelight::render::{RenderSettings, render};
use domelight::sampling::Heuristic;
use domelight::scene::builtin::shapes;
use domelight::scene::{Camera, CameraSettings, Part, Scene, SceneDescription, Surface};
use domelight::strategy::{LightTable, MultipleImportanceSampling};

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sphere = Part { name: "sphere".into(), mesh: shapes::icosphere(4), surface: 0 };
    let scene = Scene::new(SceneDescription {
        parts: vec![sphere],
        surfaces: vec![Surface::diffuse("clay", Rgb::new(0.8, 0.5, 0.3))],
        ..SceneDescription::default()
    })?;
    let environment =
        Environment::new(BuiltinProbe::Studio.image(128), Orientation::default(), 1.0)?;

    let settings = RenderSettings { width: 160, height: 120, n_samples: 16, ..Default::default() };
    let aspect = settings.width as f32 / settings.height as f32;
    let view = CameraSettings::framing(&scene.bounds(), aspect, domelight::math::Vec3::Y);
    let camera = Camera::new(&view, settings.width, settings.height)?;
    let strategy =
        MultipleImportanceSampling::new(&environment, LightTable::Full, Heuristic::Power, 1, 1)?;
    let picture = render(&scene, &camera, &environment, &strategy, &settings, &());

    let path = std::env::temp_dir().join("domelight-sphere.png");
    let tone = ToneMapping { exposure: 0.0, curve: ToneCurve::Agx };
    let (color, depth) = (&picture.layers.color, png::Depth::Eight);
    write_atomically(&path, |out| png::encode(color, None, &tone, depth, out))?;
    println!("{} shadow rays -> {}", picture.counts.shadow_rays, path.display());
    Ok(())
}
