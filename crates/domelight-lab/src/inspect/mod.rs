//! The pixel X-ray of a view: strategies at one pixel, as numbers and as a page.

mod page;

use domelight::inspect::{
    Advice, Decomposition, DirectionHistogram, Enclosure, Hemisphere, Inspector, PixelSummary,
    Source, advice,
};
use domelight::quote::{Code, Html};
use domelight::render::RenderSettings;
use domelight::strategy::Strategy;
use serde::Serialize;

use crate::report::SceneReport;
use crate::scene::PreparedSceneRef;
use crate::{At as _, Error, Host, NamedStrategy};

/// Pixels along an edge of the maps of light and reflectance.
const RESOLUTION: usize = 128;
/// The resolution of the maps of densities, whose pixels need some rays each.
const DENSITY_RESOLUTION: usize = 64;

/// One pixel of a view under some strategies.
pub struct Inspection<'a> {
    view: PreparedSceneRef<'a>,
    settings: RenderSettings,
    inspector: Inspector<'a>,
    command: String,
    hemisphere: Option<Hemisphere>,
    strategies: Vec<InspectedStrategy>,
}

/// A strategy at the pixel.
struct InspectedStrategy {
    settings: String,
    decomposition: Decomposition,
    directions: Option<DirectionHistogram>,
}

/// All numbers.
#[derive(Debug, Serialize)]
pub struct InspectionReport<'a> {
    /// Version of domelight.
    pub version: &'static str,
    /// As it was typed.
    pub command: &'a str,
    /// What was rendered.
    pub scene: &'a SceneReport,
    /// What the pixel shows.
    pub pixel: PixelSummary,
    /// The light by parts.
    pub sources: &'a [Source],
    /// In the order in which they were given.
    pub strategies: Vec<StrategyReport<'a>>,
    /// What would help.
    pub advice: Advice,
    /// The same as a sentence.
    pub advice_text: String,
    /// How much of the map the pixel's surface sees; null unless it is in a room.
    pub enclosure: Option<Enclosure>,
    /// Maps of the hemisphere; null of a pixel that shows nothing of the scene.
    pub maps: Option<Maps>,
}

/// The numbers of a strategy.
#[derive(Debug, Serialize)]
pub struct StrategyReport<'a> {
    /// In full.
    pub settings: &'a str,
    /// Variance of the estimate from one shadow ray.
    pub variance_per_ray: f64,
    /// Why the pixel is noisy, as a sentence.
    pub diagnosis: String,
    /// The variance by causes.
    #[serde(flatten)]
    pub decomposition: &'a Decomposition,
    /// Where its rays go \[sr⁻¹\], in the projection of [`Maps`] with 64 pixels along an edge; null of a pixel that shows nothing of the scene.
    pub density: Option<&'a [f32]>,
}

/// Maps of the hemisphere above the hit nearest to the pixel's center: luminance, row by row, of the disk of Lambert's
/// azimuthal equal-area projection in a square.
#[derive(Debug, Serialize)]
pub struct Maps {
    /// Pixels along an edge.
    pub resolution: usize,
    /// The axes of the maps in world space: to the right, to the top, and the shading normal.
    pub frame: [[f32; 3]; 3],
    /// L \[W·m⁻²·sr⁻¹\].
    pub radiance: Vec<f32>,
    /// f_r · cos θ \[sr⁻¹\].
    pub bsdf_cos: Vec<f32>,
    /// V.
    pub visibility: Vec<f32>,
    /// f_r · cos θ · L · V.
    pub product: Vec<f32>,
}

impl<'a> Inspection<'a> {
    /// Looks at the pixel in that column and row, counted from the upper left. `command` is what makes the report again.
    ///
    /// # Errors
    /// If the pixel is not in the picture.
    pub fn new(
        view: PreparedSceneRef<'a>,
        settings: RenderSettings,
        pixel: [usize; 2],
        command: impl Into<String>,
    ) -> Result<Self, Error> {
        let PreparedSceneRef { scene, camera, environment, .. } = view;
        let inspector = Inspector::new(scene, camera, environment, &settings, pixel)
            .map_err(|error| Error::Usage(error.to_string()))?;
        let hemisphere = inspector.hemisphere(RESOLUTION);
        let (command, strategies) = (command.into(), Vec::new());
        Ok(Self { view, settings, inspector, command, hemisphere, strategies })
    }

    /// Measures one of the library's strategies.
    ///
    /// # Errors
    /// If it does not suit the environment, or the host ended the work.
    pub fn add_named(&mut self, strategy: &NamedStrategy, host: &dyn Host) -> Result<(), Error> {
        host.check_canceled()?;
        let PreparedSceneRef { scene, camera, environment, .. } = self.view;
        let spec = strategy.spec.for_picture(scene, camera, environment, &self.settings);
        let prepared = host.prepare(spec, environment).at(&strategy.text)?;
        self.measure(&strategy.text, spec.description(), &prepared);
        Ok(())
    }

    /// Measures a strategy of any type.
    pub fn add(&mut self, name: &str, strategy: &impl Strategy) {
        self.measure(name, name.to_owned(), strategy);
    }

    fn measure(&mut self, name: &str, settings: String, strategy: &impl Strategy) {
        let decomposition = self.inspector.decompose(name, strategy);
        let directions = self.inspector.directions(strategy, DENSITY_RESOLUTION);
        self.strategies.push(InspectedStrategy { settings, decomposition, directions });
    }

    fn decompositions(&self) -> Vec<Decomposition> {
        self.strategies.iter().map(|s| s.decomposition.clone()).collect()
    }

    /// What would help.
    pub fn advice(&self) -> Advice {
        advice(&self.decompositions())
    }

    /// A sentence for each strategy, what would help, and whether the pixel is in a room.
    pub fn summary(&self) -> Vec<String> {
        let all = self.decompositions();
        let width = all.iter().map(|d| d.name.chars().count()).max().unwrap_or(0);
        let line = |d: &Decomposition| {
            let (variance, diagnosis) = (d.variance_per_ray(), d.diagnosis(&all));
            format!("{:width$}  variance per ray {variance:.2e}  {diagnosis}", d.name)
        };
        let mut lines: Vec<String> = all.iter().map(line).collect();
        lines.push(self.advice().to_string());
        lines.extend(self.inspector.enclosure().map(|enclosure| enclosure.to_string()));
        lines
    }

    /// All numbers.
    pub fn report(&self) -> InspectionReport<'_> {
        let luminance = |map: &[domelight::Rgb]| map.iter().map(|c| c.luminance()).collect();
        let maps = |h: &Hemisphere| Maps {
            resolution: h.resolution,
            frame: h.frame,
            radiance: luminance(&h.radiance),
            bsdf_cos: luminance(&h.bsdf_cos),
            visibility: h.visibility.clone(),
            product: luminance(&h.product),
        };
        let (advice, all) = (self.advice(), self.decompositions());
        InspectionReport {
            version: env!("CARGO_PKG_VERSION"),
            command: &self.command,
            scene: self.view.report,
            pixel: self.inspector.summary(),
            sources: self.inspector.sources(),
            strategies: self
                .strategies
                .iter()
                .map(|s| StrategyReport {
                    settings: &s.settings,
                    variance_per_ray: s.decomposition.variance_per_ray(),
                    diagnosis: s.decomposition.diagnosis(&all).to_string(),
                    decomposition: &s.decomposition,
                    density: s.directions.as_ref().map(|d| &d.density[..]),
                })
                .collect(),
            advice_text: advice.to_string(),
            enclosure: self.inspector.enclosure(),
            advice,
            maps: self.hemisphere.as_ref().map(maps),
        }
    }

    /// The report as one page of HTML that needs nothing else.
    ///
    /// # Errors
    /// If a picture cannot be encoded.
    pub fn page(&self) -> Result<Code<Html>, Error> {
        page::page(self)
    }
}
