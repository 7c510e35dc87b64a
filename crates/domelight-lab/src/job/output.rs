//! How pictures for viewing are developed.

use clap::Args;
use domelight::picture::exposure::Exposure;
use domelight::picture::tone::{ToneCurve, ToneMapping};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{Choice, Text};

/// Exposure and tone curve of pictures for viewing.
#[derive(Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tone {
    /// Exposure of pictures for viewing, in stops; auto exposes by the light of a render, and maps the median of
    /// other pictures to middle gray [default: auto; 0 for differences]
    #[arg(
        id = "output.exposure",
        long = "exposure",
        value_name = "EV|auto",
        allow_negative_numbers = true
    )]
    pub exposure: Option<Text<Exposure>>,
    /// Tone curve of pictures for viewing; agx is Blender's, standard clips at 1 [default: agx; standard for
    /// differences]
    #[arg(id = "output.tone", long = "tone", value_name = "CURVE")]
    pub tone: Option<Choice<ToneCurve>>,
}

impl Tone {
    /// The tone mapping of pictures for viewing; `automatic` computes the exposure if none was given.
    pub fn of_picture(&self, automatic: impl FnOnce() -> f32) -> ToneMapping {
        self.or(Exposure::Auto, ToneCurve::Agx, automatic)
    }

    /// The tone mapping of pictures for measurement or further use: none, unless requested.
    pub fn of_measurement(&self, automatic: impl FnOnce() -> f32) -> ToneMapping {
        self.or(Exposure::Stops(0.0), ToneCurve::Standard, automatic)
    }

    /// What was requested, or else these.
    fn or(
        &self,
        exposure: Exposure,
        curve: ToneCurve,
        automatic: impl FnOnce() -> f32,
    ) -> ToneMapping {
        let exposure = match self.exposure.map_or(exposure, |Text(exposure)| exposure) {
            Exposure::Auto => automatic(),
            Exposure::Stops(stops) => stops,
        };
        ToneMapping { exposure, curve: self.tone.map_or(curve, |Choice(curve)| curve) }
    }

    /// Whether pictures for viewing are exposed automatically.
    pub fn is_automatic(&self) -> bool {
        matches!(self.exposure, None | Some(Text(Exposure::Auto)))
    }
}
