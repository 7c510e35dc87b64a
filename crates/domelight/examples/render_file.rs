//! Renders a scene file under an HDR environment: `render_file [SCENE HDRI]`, built-in ones by default.

use domelight::prelude::*;

pub(crate) fn main() -> Result<(), Error> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let (scene, environment) = match paths.as_slice() {
        [scene, hdri] => (Scene::load(scene)?, Environment::load(hdri)?),
        _ => (Scene::builtin(BuiltinScene::Spheres), Environment::builtin(BuiltinProbe::Sky)),
    };
    let settings = RenderSettings { width: 160, height: 120, n_samples: 8, ..Default::default() };
    let camera = Camera::framing(&scene, settings.width, settings.height);
    let strategy: StrategySpec = "product:8".parse()?;

    let mut renderer = Renderer::new(&scene, &camera, &environment, strategy, settings)?;
    while renderer.step() {
        let counts = renderer.counts();
        println!("{:3.0} %, {} rays", 100.0 * renderer.progress(), counts.shadow_rays);
    }

    let film = renderer.film();
    let folder = std::env::temp_dir();
    film.write(folder.join("render_file.exr"))?;
    film.develop(Exposure::Auto, ToneCurve::Agx).write(folder.join("render_file.png"))
}
