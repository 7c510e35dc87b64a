//! The changes to the subject of a scene.

use std::fmt;
use std::str::FromStr;

use clap::Args;
use domelight::bsdf::{Bsdf, MaterialSpec, ParseMaterialError};
use domelight::math::Vec3;
use domelight::scene::SceneDescription;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::value::{Choice, Text};
use crate::ground::Ground;

/// The changes to the subject and what surrounds it.
#[derive(Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[command(next_help_heading = "Scene")]
#[serde(default, deny_unknown_fields)]
pub struct Subject {
    /// Material of the subject: diffuse:0.8, phong:50:1:0.5, ward:0.15:0.5, ggx:0.2, mix, …
    #[arg(id = "subject.material", long = "material", value_name = "M")]
    pub material: Option<Text<NamedMaterial>>,
    /// Move and scale the scene: center of the bounds to 0, longest half-extent to 1
    #[arg(id = "subject.normalize", long = "normalize")]
    pub normalize: bool,
    /// Put ground under the subject: plate, a diffuse plate (reflectance 0.5) that fades out toward its rim, or
    /// shadow, a shadow catcher that shows only shadows, on the environment or, with --hide-env, in alpha
    #[arg(id = "subject.ground", long = "ground", value_name = "KIND", num_args = 0..=1, default_missing_value = "plate")]
    pub ground: Option<Choice<Ground>>,
    /// Hide the environment behind the scene: pixels without a surface are transparent
    #[arg(id = "subject.hide_env", long = "hide-env")]
    pub hide_env: bool,
}

/// A material in the notation of `--material`, with its original text.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterial {
    /// As it was given.
    pub text: String,
    /// What it says.
    pub spec: MaterialSpec,
}

impl FromStr for NamedMaterial {
    type Err = ParseMaterialError;

    fn from_str(text: &str) -> Result<Self, ParseMaterialError> {
        Ok(Self { text: text.to_owned(), spec: text.parse()? })
    }
}

impl fmt::Display for NamedMaterial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.text)
    }
}

impl Subject {
    /// Applies the changes to the scene.
    pub(crate) fn apply(&self, scene: &mut SceneDescription, up: Vec3) {
        if self.normalize {
            scene.normalize();
        }
        if let Some(Text(material)) = &self.material {
            scene.set_subject_material(Bsdf::from(material.spec));
        }
        match self.ground.map(|Choice(ground)| ground) {
            None => {}
            Some(Ground::Plate) => scene.add_ground(up),
            Some(Ground::Shadow) => scene.add_shadow_catcher(up),
        }
    }
}
