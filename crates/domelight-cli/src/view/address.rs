//! The job of the command line as the page's state, which its address holds behind `#`.

use std::fmt::Write as _;
use std::str::FromStr as _;

use anyhow::Result;
use domelight::environment::builtin::BuiltinProbe;
use domelight::picture::exposure::Exposure;
use domelight::render::Passes;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{EnvironmentSettings, SceneDescription};
use domelight_lab::job::value::{Choice, Rotation, Seed, Size, Text};
use domelight_lab::job::{Job, View, probe_name};
use domelight_lab::{Ground, Host};
use domelight_page::CameraState;
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::UsageError;

/// The most that the page's controls offer, as in `web/src/state.ts`.
const MAX_SIZE: usize = 2048;
const MAX_SPP: u32 = 1 << 16;
const MAX_ROWS: u32 = 4096;
/// The largest whole number that JavaScript has.
const MAX_SEED: u64 = (1 << 53) - 1;

/// A job as the page has it.
pub(super) struct PageJob {
    /// What follows `#` in the page's address.
    pub(super) fragment: String,
    /// What the page asks its engine to load.
    pub(super) scene: Value,
    pub(super) light: Value,
    /// Whether the light of the scene goes before.
    pub(super) takes_light_of_scene: bool,
}

/// What the page shows of a job. Scene and map are read if the camera or the light depend on them.
///
/// # Errors
/// If the page cannot show the job, or scene or map cannot be read.
pub(super) fn of_job(job: &Job, host: &dyn Host) -> Result<PageJob> {
    require_known(job)?;
    let Job { light, view, subject, sampling, pixel, output, .. } = job;
    let mut state = State::default();
    state.text("scene", &job.scene);
    let asks_for_view = *view != View { size: view.size, ..View::default() };
    let asks_for_light =
        light.rotate.is_some() || light.scale.is_some() || light.exposure.is_some();
    let is_auto = light.rotate == Some(Text(Rotation::Auto));
    let builtin = BuiltinScene::from_str(&job.scene).ok();
    let needs_scene = builtin.is_none() && light.map.is_none() && asks_for_light;
    let settings = if asks_for_view || is_auto || needs_scene {
        let loaded = job.scene_settings().load(host)?;
        if asks_for_view {
            state.json("camera", &CameraState::new(&loaded.camera));
        }
        Some(loaded.light)
    } else if builtin.is_some() || light.map.is_some() {
        let environment = builtin.map(BuiltinScene::environment);
        Some(light.over(&SceneDescription { environment, ..SceneDescription::default() }))
    } else {
        // The page takes the light that the scene names.
        None
    };
    if let Some(settings) = &settings {
        state.light(settings);
    }
    let rows = light.rows.get();
    state.json("rows", &rows);
    if let Some(Text(material)) = &subject.material {
        state.text("material", &material.text);
    }
    if subject.ground.is_some() {
        state.json("ground", &true);
    }
    if subject.hide_env {
        state.json("hide", &true);
    }
    state.json("size", &view.size.0.width);
    state.text("strategy", &sampling.strategy.0.to_string());
    state.json("spp", &sampling.spp.get());
    state.json("seed", &pixel.seed.0);
    if let Some(Text(Exposure::Stops(stops))) = output.exposure {
        state.json("exposure", &stops);
    }
    if let Some(Choice(curve)) = output.tone {
        state.text("curve", curve.name());
    }
    let material = subject.material.as_ref().map_or("", |Text(material)| &material.text);
    let ground = subject.ground.is_some();
    let scene =
        json!({ "scene": job.scene, "material": material, "materials": {}, "ground": ground });
    let takes_light_of_scene = settings.is_none();
    let settings = settings.unwrap_or_else(|| light.over(&SceneDescription::default()));
    let EnvironmentSettings { rotate_degrees, scale, exposure, .. } = settings;
    let light = json!({
        "probe": page_name(&settings), "rows": rows, "reduce": 1, "rotate": rotate_degrees, "scale": scale,
        "exposure": exposure,
    });
    Ok(PageJob { fragment: state.0, scene, light, takes_light_of_scene })
}

/// A light's map by its name in the page.
fn page_name(light: &EnvironmentSettings) -> String {
    let name = probe_name(&light.source);
    BuiltinProbe::from_str(&name).map_or(name, |probe| probe.name().to_owned())
}

/// Refuses what the page cannot show.
fn require_known(job: &Job) -> Result<(), UsageError> {
    let Text(Size { width, height }) = job.view.size;
    let Seed(seed) = job.pixel.seed;
    let out_of_range = [
        (width != height, format!("--size={width}x{height}: the page's pictures are square")),
        (
            width > MAX_SIZE,
            format!("--size={width}x{height}: the page's pictures have at most {MAX_SIZE} rows"),
        ),
        (
            job.sampling.spp.get() > MAX_SPP,
            format!("--spp={}: the page takes at most {MAX_SPP} samples", job.sampling.spp.get()),
        ),
        (
            job.light.rows.get() > MAX_ROWS,
            format!("--env-rows={}: the page's maps have at most {MAX_ROWS}", job.light.rows.get()),
        ),
        (seed > MAX_SEED, format!("--seed={seed}: the page's seeds are at most {MAX_SEED}")),
    ];
    if let Some((_, why)) = out_of_range.into_iter().find(|(is_wrong, _)| *is_wrong) {
        return Err(UsageError(why));
    }
    let words = unknown(job);
    if words.is_empty() {
        return Ok(());
    }
    let words = words.join(" ");
    Err(UsageError(format!("the page cannot show {words}: leave it out, or use domelight render")))
}

/// The options of a job that the page does not know, word by word.
fn unknown(job: &Job) -> Vec<String> {
    let usual = Job::default();
    let mut rest = job.clone();
    rest.scene = usual.scene;
    rest.view = View { dof: job.view.dof, ..View::default() };
    rest.light.map = None;
    rest.light.rotate = None;
    rest.light.scale = None;
    rest.light.exposure = None;
    rest.light.rows = usual.light.rows;
    rest.subject.material = None;
    rest.subject.hide_env = false;
    if job.subject.ground == Some(Choice(Ground::Plate)) {
        rest.subject.ground = None;
    }
    rest.sampling.strategy = usual.sampling.strategy;
    rest.sampling.spp = usual.sampling.spp;
    // The page's own.
    if job.sampling.passes == Choice(Passes::Doubling) {
        rest.sampling.passes = usual.sampling.passes;
    }
    rest.pixel.seed = usual.pixel.seed;
    rest.output = usual.output;
    rest.arguments()
}

/// The page's state as its address has it.
#[derive(Default)]
struct State(String);

impl State {
    fn text(&mut self, key: &str, value: &str) {
        if !self.0.is_empty() {
            self.0.push('&');
        }
        self.0.push_str(key);
        self.0.push('=');
        for byte in value.bytes() {
            if byte.is_ascii_alphanumeric() || b"-._~/:,".contains(&byte) {
                self.0.push(byte.into());
            } else {
                let _ = write!(self.0, "%{byte:02X}");
            }
        }
    }

    fn json(&mut self, key: &str, value: &impl Serialize) {
        self.text(key, &serde_json::to_string(value).unwrap_or_default());
    }

    fn light(&mut self, settings: &EnvironmentSettings) {
        self.text("env", &page_name(settings));
        self.json("rotate", &settings.rotate_degrees);
        self.json("scale", &settings.scale);
        self.json("ev", &settings.exposure);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use clap::Parser;
    use domelight_lab::Silent;

    use super::*;

    #[derive(Parser)]
    #[command(no_binary_name = true)]
    struct CommandLine {
        #[command(flatten)]
        job: Job,
    }

    pub(in crate::view) fn page_job(words: &str) -> Result<PageJob> {
        let job = CommandLine::try_parse_from(words.split_whitespace()).unwrap().job;
        of_job(&job, &Silent)
    }

    fn fragment_of(words: &str) -> Result<String> {
        page_job(words).map(|job| job.fragment)
    }

    #[test]
    fn a_job_is_the_page_s_state() {
        assert_eq!(
            fragment_of("").unwrap(),
            "scene=statue&env=sky&rotate=125.0&scale=1.0&ev=0.0&rows=1024&size=640&strategy=product&spp=32&seed=0"
        );
        let words = "a&b.glb --env my.hdr --env-rotate=30 --env-scale=2 --env-exposure=-1 --material ggx:0.2 --ground \
                     --hide-env --size 64x64 --strategy mis:3:1 --spp 4 --seed 7 --exposure=-0.5 --tone standard \
                     --passes doubling";
        assert_eq!(
            fragment_of(words).unwrap(),
            "scene=a%26b.glb&env=my.hdr&rotate=30.0&scale=2.0&ev=-1.0&rows=1024&material=ggx:0.2&ground=true&hide=true\
             &size=64&strategy=mis:3:1&spp=4&seed=7&exposure=-0.5&curve=standard"
        );
        // The page takes the light that the scene names.
        let of_scene = fragment_of("a.glb").unwrap();
        assert!(of_scene.starts_with("scene=a.glb&rows="), "{of_scene}");
    }

    #[test]
    fn a_view_is_a_camera() {
        let state = fragment_of("sphere --view=left --fov=30").unwrap();
        assert!(state.contains("&camera=%7B%22origin%22:%5B"), "{state}");
        assert!(state.contains("%22fov%22:30.0,%22ortho%22:null%7D"), "{state}");
    }

    #[test]
    fn what_the_page_cannot_show_is_refused() {
        let refused = |words: &str| fragment_of(words).unwrap_err().to_string();
        assert_eq!(
            refused("--env-mapping=octahedral --sampler=independent --no-adaptive"),
            "the page cannot show --env-mapping=octahedral --no-adaptive --sampler=independent: leave it out, or use \
             domelight render"
        );
        assert!(refused("--ground=shadow").contains("--ground=shadow"));
        assert_eq!(refused("--size=64x32"), "--size=64x32: the page's pictures are square");
        assert!(refused("--seed=18446744073709551615").contains("at most 9007199254740991"));
    }
}
