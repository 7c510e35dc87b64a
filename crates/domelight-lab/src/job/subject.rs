//! The changes to the subject of a scene.

use std::fmt;
use std::str::FromStr;

use clap::Args;
use domelight::bsdf::{Bsdf, MaterialSpec, ParseMaterialError};
use domelight::math::{DVec3, Vec3};
use domelight::scene::{Scene, SceneDescription};
use domelight::strategy::{Portal, PortalError};
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
    /// Rectangles through which light enters, such as windows, in the scene's coordinates: a corner and two edges of
    /// each, X,Y,Z:X,Y,Z:X,Y,Z, with a semicolon between two. Strategy product looks for light through them first; wrong
    /// ones cost noise, not light
    #[arg(
        id = "subject.portal",
        long = "portal",
        value_name = "RECTANGLES",
        allow_hyphen_values = true
    )]
    pub portal: Option<Text<PortalList>>,
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

/// Portals in the notation of `--portal`.
#[derive(Clone, Debug, PartialEq)]
pub struct PortalList(Vec<([f64; 3], [Vec3; 2])>);

/// A text that lists no portals.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParsePortalError {
    /// A portal that is not three times three numbers.
    #[error("'{0}' is no portal: give a corner and two edges, X,Y,Z:X,Y,Z:X,Y,Z")]
    Notation(String),
    /// A portal without an area.
    #[error(transparent)]
    Portal(#[from] PortalError),
}

impl FromStr for PortalList {
    type Err = ParsePortalError;

    fn from_str(text: &str) -> Result<Self, ParsePortalError> {
        let vector = |text: &str| {
            let numbers: Option<Vec<f64>> =
                text.split(',').map(|x| x.trim().parse().ok()).collect();
            <[f64; 3]>::try_from(numbers?).ok()
        };
        let portal = |text: &str| {
            let wrong = || ParsePortalError::Notation(text.trim().to_owned());
            let vectors: Option<Vec<_>> = text.split(':').map(vector).collect();
            let vectors = vectors.and_then(|v| <[[f64; 3]; 3]>::try_from(v).ok());
            let [corner, a, b] = vectors.ok_or_else(wrong)?;
            let edges = [a, b].map(|edge| DVec3::from(edge).as_vec3());
            Portal::new(DVec3::from(corner).as_vec3(), edges)?;
            Ok((corner, edges))
        };
        text.split(';').map(portal).collect::<Result<_, _>>().map(Self)
    }
}

impl fmt::Display for PortalList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let vector = |numbers: [f64; 3]| numbers.map(|x| x.to_string()).join(",");
        let edge = |edge: Vec3| edge.to_array().map(|x| x.to_string()).join(",");
        let portal = |&(corner, [a, b]): &([f64; 3], [Vec3; 2])| {
            [vector(corner), edge(a), edge(b)].join(":")
        };
        f.pad(&self.0.iter().map(portal).collect::<Vec<_>>().join(";"))
    }
}

impl PortalList {
    /// Portals of a built scene, which are in units of [`Scene::unit`].
    pub fn of(portals: &[Portal], scene: &Scene) -> Self {
        // As many digits as the numbers have.
        let short = |x: f64| format!("{x:.6e}").parse::<f64>().unwrap_or(x) + 0.0;
        let unit = f64::from(scene.unit());
        let inside = |v: Vec3| (v.as_dvec3() * unit).to_array().map(short);
        let portal = |portal: &Portal| {
            let corner = DVec3::from(inside(portal.corner())) + scene.offset();
            let edges = portal.edges().map(|edge| DVec3::from(inside(edge)).as_vec3());
            (corner.to_array(), edges)
        };
        Self(portals.iter().map(portal).collect())
    }

    /// The portals, in the coordinates of the description.
    fn relative_to(&self, offset: DVec3) -> impl Iterator<Item = Portal> {
        let portal = move |&(corner, edges): &([f64; 3], [Vec3; 2])| {
            Portal::new((DVec3::from(corner) - offset).as_vec3(), edges).ok()
        };
        self.0.iter().filter_map(portal)
    }
}

impl Subject {
    /// Applies the changes to the scene.
    pub fn apply(&self, scene: &mut SceneDescription, up: Vec3) {
        if let Some(Text(portals)) = &self.portal {
            scene.portals.extend(portals.relative_to(scene.offset));
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn portals_are_read_as_they_are_written() {
        let text = "2,1,-0.5:0,1.2,0:0,0,1;448000.25,0,0:1,0,0:0,0,1";
        let portals: PortalList = text.parse().unwrap();
        assert_eq!(portals.to_string(), text);
        let offset = DVec3::new(448_000.0, 0.0, 0.0);
        let corners: Vec<Vec3> = portals.relative_to(offset).map(|p| p.corner()).collect();
        assert_eq!(corners[1], Vec3::new(0.25, 0.0, 0.0));
        for wrong in ["", "1,2,3", "1,2,3:1,0,0", "1,2,x:1,0,0:0,1,0", "1,2:1,0,0:0,1,0"] {
            let error = wrong.parse::<PortalList>().unwrap_err();
            assert_eq!(error, ParsePortalError::Notation(wrong.into()));
        }
        let flat = "0,0,0:1,0,0:2,0,0".parse::<PortalList>();
        assert_eq!(flat, Err(ParsePortalError::Portal(PortalError)));
    }
}
