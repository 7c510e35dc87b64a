//! Scene and light are loaded while the browser starts.

use std::sync::Mutex;
use std::thread::{self, JoinHandle};

use domelight_page::{Engine, Error, Host};
use serde_json::Value;

use super::address::PageJob;

/// The engine that loads what the page will ask for, until the page's first engine takes it.
pub(super) struct Ahead(Mutex<Option<JoinHandle<Engine>>>);

impl Ahead {
    /// Loads in a thread of its own.
    pub(super) fn load(host: Host, job: PageJob) -> Self {
        let loading = thread::spawn(move || {
            let mut engine = Engine::new(host);
            // The page asks for the same, and hears what is wrong with it.
            let _ = load(&mut engine, job);
            engine
        });
        Self(Mutex::new(Some(loading)))
    }

    /// The engine when it has loaded, for the first that asks.
    pub(super) fn take(&self) -> Option<Engine> {
        let loading = self.0.lock().ok()?.take()?;
        loading.join().ok()
    }
}

fn load(engine: &mut Engine, job: PageJob) -> Result<(), Error> {
    let PageJob { scene, mut light, takes_light_of_scene, .. } = job;
    let report = engine.load_scene(&scene.to_string())?;
    if takes_light_of_scene {
        adopt(&mut light, &report);
    }
    engine.load_environment(&light.to_string()).map(drop)
}

/// Replaces what the report of a scene says of its own light.
fn adopt(light: &mut Value, report: &str) {
    let report: Value = serde_json::from_str(report).unwrap_or_default();
    let of_scene = report["environment"].as_object();
    for (key, value) in of_scene.into_iter().flatten() {
        light[key] = value.clone();
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::address::tests::page_job;
    use super::*;

    #[test]
    fn what_a_job_names_is_loaded() {
        let words = "sphere --env studio --env-rows 16 --env-rotate 30 --material ggx:0.2 --ground";
        let mut engine = Engine::new(Host::new(|| 0.0, None, Vec::new()));
        load(&mut engine, page_job(words).unwrap()).unwrap();
        assert!(engine.map(16).is_ok());
    }

    #[test]
    fn the_light_of_a_scene_goes_before() {
        let mut light = json!({ "probe": "sky", "rows": 8, "rotate": 0.0 });
        adopt(&mut light, r#"{"environment":null}"#);
        assert_eq!(light, json!({ "probe": "sky", "rows": 8, "rotate": 0.0 }));
        adopt(&mut light, r#"{"environment":{"probe":"a.hdr","rotate":30.0}}"#);
        assert_eq!(light, json!({ "probe": "a.hdr", "rows": 8, "rotate": 30.0 }));
    }
}
