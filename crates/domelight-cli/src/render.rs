//! `domelight render`: from files to a picture.

use std::str::FromStr as _;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use domelight::picture::tone::ToneCurve;
use domelight::render::survey;

use crate::args::render::{OutputArguments, RenderArguments};
use crate::interrupt;
use crate::output::{PicturePath, require_one_on_standard_output};
use crate::progress::RenderProgress;
use crate::report::{RenderReport, Settings, Stages};
use crate::scene::View;
use crate::strategy::Job;
use crate::usage::Stopwatch;

/// Runs the subcommand.
pub(crate) fn run(arguments: &RenderArguments, quiet: bool) -> Result<()> {
    let plan = arguments.strategy.plan()?;
    plan.refuse_repeating_points(arguments.spp)?;
    let outputs = arguments.output.paths()?;
    outputs.iter().try_for_each(PicturePath::require_writable)?;
    arguments.pixel.start_threads()?;
    let interrupted = interrupt::flag();
    let mut watch = Stopwatch::start();

    let loaded = arguments.scene.load(quiet)?;
    let load = watch.lap();

    let View { scene, camera, environment, probe, report } = &arguments.scene.build(loaded)?;
    let settings = &arguments.scene.render_settings(&arguments.pixel, arguments.spp);
    let plan = plan.for_scene(|| survey(scene, camera, settings), environment, settings.seed);
    let renderer = plan.prepare(environment).with_context(|| probe.clone())?;
    let build = watch.lap();
    if interrupted.load(Ordering::Relaxed) {
        bail!("interrupted before the first sample; nothing was written");
    }

    let n_pixels = (settings.width * settings.height) as u64;
    let progress =
        &RenderProgress::new(n_pixels * u64::from(settings.n_samples), quiet, interrupted);
    let rendering = renderer(&Job { scene, camera, environment, settings, progress })?;
    progress.finish();
    if rendering.counts.camera_rays == 0 {
        bail!("interrupted before the first sample; nothing was written");
    }
    let render = watch.lap();

    let hide_env = report.hide_env;
    let settings = Settings {
        scene: report.clone(),
        strategy: plan.describe(),
        spp: settings.n_samples,
        sampler: format!("{:?}", settings.sampler).to_lowercase(),
        filter: settings.filter.name(),
        seed: settings.seed,
        threads: rayon::current_num_threads(),
    };
    let tone = arguments.output.tone.mapping(ToneCurve::Agx);
    // A full disk under one file must not cost the others.
    let write = |path: &PicturePath| {
        let attributes = settings.provenance(rendering.complete);
        path.write_layers(&rendering.layers, &tone, hide_env, attributes)
    };
    outputs.iter().map(write).fold(Ok(()), Result::and)?;
    let stages = Stages { load, build, render, write: watch.lap() };
    let report = RenderReport::new(settings, &rendering, stages, &outputs);
    if arguments.output.json {
        report.print_json()?;
    } else if !quiet {
        report.print_summary();
    }
    report.check(quiet)
}

impl OutputArguments {
    fn paths(&self) -> Result<Vec<PicturePath>> {
        let paths: Vec<_> = if self.output.is_empty() {
            ["domelight.exr", "domelight.png"]
                .map(PicturePath::from_str)
                .into_iter()
                .flatten()
                .collect()
        } else {
            self.output.clone()
        };
        let all: Vec<_> = paths.iter().map(Some).collect();
        require_one_on_standard_output(&all, self.json)?;
        Ok(paths)
    }
}
