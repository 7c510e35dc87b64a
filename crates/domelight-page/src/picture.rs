//! Finished pictures as files: the Workers' parts put together.

use std::io::Cursor;
use std::str::FromStr;

use domelight::picture::exposure::Exposure;
use domelight::picture::png::{self, Depth};
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::render::{Checkpoint, Layers, Passes, Provenance, RenderSettings, VarianceSums};
use domelight::strategy::StrategySpec;
use serde::Deserialize;

use crate::error::refused;
use crate::setup::parse;
use crate::{Engine, Error};

/// The provenance of a picture, as the page knows it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Making {
    scene: String,
    environment: String,
    samples: u32,
    seed: u64,
    /// From [`Engine::automatic_exposure`] \[stops\].
    exposure: f32,
}

impl Engine {
    /// The sums of this Worker's shard as a part of the picture, for [`Engine::add_part`] of another.
    ///
    /// # Errors
    /// If nothing was started.
    pub fn part(&self) -> Result<Vec<u8>, Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NothingStarted)?;
        let checkpoint = rendering.with(|renderer| Checkpoint {
            identity: Vec::new(),
            provenance: vec![(
                "strategy".to_owned(),
                renderer.spec().map(StrategySpec::description).unwrap_or_default(),
            )],
            tiles: renderer.tiles(),
            n_tiles: renderer.tiling().n_tiles(),
            n_samples: renderer.settings().n_samples,
            complete: renderer.is_complete(),
            counts: renderer.counts(),
            film: renderer.film(),
        });
        checkpoint.encode().map_err(refused)
    }

    /// Keeps a part.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn add_part(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.parts.push(Checkpoint::decode(bytes).map_err(refused)?);
        Ok(())
    }

    /// The OpenEXR file of the parts with all layers, as `domelight render` writes it, made as `{"scene", "environment",
    /// "samples", "seed", "exposure"}` says; they are forgotten.
    ///
    /// # Errors
    /// If there are no parts.
    pub fn exr(&mut self, making: &str) -> Result<Vec<u8>, Error> {
        let Making { scene, environment, samples, seed, exposure } = parse(making)?;
        let (layers, parts) = self.merged()?;
        let strategy = parts[0].provenance.iter().find(|(name, _)| name == "strategy");
        let settings = RenderSettings {
            n_samples: samples,
            passes: Passes::Doubling,
            seed,
            ..RenderSettings::default()
        };
        let provenance = Provenance {
            scene: &scene,
            environment: &environment,
            strategy: strategy.map_or("", |(_, text)| text),
            settings: &settings,
            exposure,
        };
        let mut attributes = provenance.attributes();
        let complete = parts.iter().all(|part| part.complete);
        attributes.push(("domelight.complete".to_owned(), complete.to_string()));
        let mut bytes = Cursor::new(Vec::new());
        let written = layers.write_exr(&attributes, &mut bytes);
        written.map_err(refused)?;
        Ok(bytes.into_inner())
    }

    /// The PNG file of the parts; an exposure \[stops\] that is NaN brings the median to middle gray. They are forgotten.
    ///
    /// # Errors
    /// If there are no parts or no such curve.
    pub fn png(&mut self, exposure: f32, curve: &str) -> Result<Vec<u8>, Error> {
        let (layers, _) = self.merged()?;
        let alpha = layers.alpha.iter().any(|&a| a < 1.0).then_some(&layers.alpha[..]);
        let curve = ToneCurve::from_str(curve).map_err(refused)?;
        let exposure = if exposure.is_nan() { Exposure::Auto } else { Exposure::Stops(exposure) };
        let tone = ToneMapping { exposure: exposure.stops(&layers.color, alpha), curve };
        let mut bytes = Vec::new();
        png::encode(&layers.color, alpha, &tone, Depth::Eight, &mut bytes).map_err(refused)?;
        Ok(bytes)
    }

    fn merged(&mut self) -> Result<(Layers, Vec<Checkpoint>), Error> {
        let parts = std::mem::take(&mut self.parts);
        let first = parts.first().ok_or_else(|| refused("there are no parts"))?;
        let (width, height) = (first.film.width, first.film.height);
        let mut variance = VarianceSums::default();
        for part in &parts {
            variance.add(&part.film.variance_sums());
        }
        let mut layers = Layers::new(width, height);
        for part in &parts {
            if (part.film.width, part.film.height) != (width, height) {
                return Err(refused("the parts are of different pictures"));
            }
            layers.merge(&part.film, 0, &variance);
        }
        Ok((layers, parts))
    }
}
