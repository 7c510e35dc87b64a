//! Prefiltered light as files of textures.

use domelight::Rgb;
use domelight::picture::texture::{Container, TexelFormat, Texture};
use domelight::rig::RigError;
use domelight::rig::ibl::{
    BrdfTable, Engine, IblSettings, Layout, PrefilteredLight, SunError, SunTreatment,
    TreatedEnvironment, prefilter,
};
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use crate::map::LightMap;
use crate::options::{named, parse, to_json};

/// The options of prefiltered light, as those of `domelight ibl`.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct IblOptions {
    layout: String,
    size: usize,
    #[serde(rename = "for")]
    engine: Option<String>,
    sun: String,
    #[serde(rename = "shWindow")]
    sh_window: bool,
    texels: String,
    container: String,
}

impl Default for IblOptions {
    fn default() -> Self {
        Self {
            layout: Layout::default().name().to_owned(),
            size: 256,
            engine: None,
            sun: "keep".to_owned(),
            sh_window: true,
            texels: TexelFormat::SharedExponent.name().to_owned(),
            container: Container::Ktx2.name().to_owned(),
        }
    }
}

/// Files of prefiltered light.
#[wasm_bindgen]
pub struct Prefiltered {
    radiance: Vec<u8>,
    irradiance: Vec<u8>,
    brdf: Vec<u8>,
    report: String,
}

/// What prefiltered light is, for JavaScript.
#[derive(Serialize)]
struct Report {
    levels: Vec<Level>,
    harmonics: [[f32; 3]; 9],
    #[serde(rename = "harmonicsWindow")]
    harmonics_window: f32,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct Level {
    size: usize,
    roughness: f32,
}

impl IblOptions {
    fn engine(&self) -> Result<Option<Engine>, JsError> {
        self.engine.as_deref().map(|name| named("ibl", "for", name)).transpose()
    }

    fn settings(&self, engine: Option<Engine>) -> Result<IblSettings, JsError> {
        if !(1..=IblSettings::MAX_SIZE).contains(&self.size) {
            let (size, most) = (self.size, IblSettings::MAX_SIZE);
            return Err(JsError::new(&format!("ibl: option size: {size} is not in [1, {most}]")));
        }
        let settings = IblSettings::for_engine(engine, self.size);
        let layout = named("ibl", "layout", &self.layout)?;
        Ok(IblSettings { layout, harmonics_window: self.sh_window, ..settings })
    }
}

fn encoded(container: Container, texture: &Texture) -> Result<Vec<u8>, JsError> {
    let mut bytes = Vec::new();
    container.encode(texture, &mut bytes).map_err(|e| JsError::new(&e.to_string()))?;
    Ok(bytes)
}

/// The light with its sun treated, and what there is to say of it.
fn treated(
    map: &LightMap,
    sun: SunTreatment,
) -> Result<(TreatedEnvironment<'_>, Option<String>), JsError> {
    let LightMap { environment, name, .. } = map;
    let failed = |e: SunError| JsError::new(&format!("{name}: {e}"));
    match sun.apply(environment) {
        Err(SunError::Extraction(e @ RigError::NoSun { .. })) => {
            let kept = SunTreatment::Keep.apply(environment).map_err(failed)?;
            Ok((kept, Some(format!("{name}: {e}; nothing is removed"))))
        }
        applied => {
            let treated = applied.map_err(failed)?;
            let percent = 100.0 * treated.clamped;
            let warning =
                (percent > 0.0).then(|| format!("{name}: clamped, -{percent:.2} % light"));
            Ok((treated, warning))
        }
    }
}

#[wasm_bindgen]
impl LightMap {
    /// Prefilters the map.
    ///
    /// # Errors
    /// If it is black, or an option is wrong.
    pub fn ibl(&self, options: &str) -> Result<Prefiltered, JsError> {
        let options: IblOptions = parse("ibl", options)?;
        let engine = options.engine()?;
        let settings = options.settings(engine)?;
        let texels: TexelFormat = named("ibl", "texels", &options.texels)?;
        let container: Container = named("ibl", "container", &options.container)?;
        let (treated, warning) = treated(self, named("ibl", "sun", &options.sun)?)?;
        let light =
            prefilter(&treated.environment, &settings).map_err(|e| JsError::new(&e.to_string()))?;
        let (radiance, loss) = Texture::light(&light.levels, texels);
        let (irradiance, _) = Texture::light(std::slice::from_ref(&light.irradiance), texels);
        let loss = loss.warning().map(|text| format!("{}: {text}", self.name));
        let brdf = Texture::table(&BrdfTable::new(BrdfTable::SIZE, Engine::terms(engine)));
        Ok(Prefiltered {
            radiance: encoded(container, &radiance)?,
            irradiance: encoded(container, &irradiance)?,
            brdf: encoded(container, &brdf)?,
            report: to_json(&Report {
                levels: levels(&light, &settings),
                harmonics: light.harmonics.coefficients.map(Rgb::to_array),
                harmonics_window: light.harmonics_window,
                warnings: warning.into_iter().chain(loss).collect(),
            }),
        })
    }
}

fn levels(light: &PrefilteredLight, settings: &IblSettings) -> Vec<Level> {
    let levels = light.levels.iter().zip(&settings.roughness);
    levels.map(|(map, &roughness)| Level { size: map.size, roughness }).collect()
}

#[wasm_bindgen]
impl Prefiltered {
    /// The file of the radiance, once.
    #[wasm_bindgen(js_name = takeRadiance)]
    pub fn take_radiance(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.radiance)
    }

    /// The file of the irradiance over π, once.
    #[wasm_bindgen(js_name = takeIrradiance)]
    pub fn take_irradiance(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.irradiance)
    }

    /// The file of the table of the BRDF, once.
    #[wasm_bindgen(js_name = takeBrdf)]
    pub fn take_brdf(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.brdf)
    }

    /// What the files hold, as JSON.
    pub fn report(&self) -> String {
        self.report.clone()
    }
}
