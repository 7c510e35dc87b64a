//! The course of a render: its tiles, its checkpoint, where and how often it is saved, and its time limit.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

mod timed;

use anyhow::{Context as _, Result};
use domelight::render::{
    Checkpoint, Counts, Film, Layers, Observer, RenderSettings, Renderer, Rendering, Stage,
    TileView, Tiling, Window,
};
use domelight::strategy::Strategy;

use crate::args::render_run::RenderRunArguments;
use crate::clock;
use crate::error::{UsageError, warn};
use crate::files;
use crate::interrupt;
use crate::memory;
use crate::output::{PictureFormat, PicturePath};
use crate::parse::{Shard, Tiles};
use crate::progress::RenderProgress;
use crate::report::Settings;
use domelight_lab::job::Job;
use domelight_lab::scene::PreparedScene;
use timed::{Pace, PassWatch, TimeLimit};

/// Says how long it takes to write a rendering.
pub(crate) type TryWriting<'a> = &'a dyn Fn(&Layers) -> Result<Duration>;

/// The course of a render.
pub(crate) struct RenderRun {
    /// The tiles; all tiles give a picture, fewer give a part.
    tiles: TileSelection,
    /// The file to which its state is saved.
    save: Option<PathBuf>,
    every: Duration,
    /// The file from which its state was restored.
    from: Option<(PathBuf, Checkpoint)>,
    /// Its time limit, including writing.
    end: Option<Instant>,
    interrupted: &'static AtomicBool,
    quiet: bool,
    identity: Vec<(String, String)>,
    provenance: Vec<(String, String)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TileSelection {
    All,
    Shard(Shard),
    Tiles(Tiles),
}

impl RenderRunArguments {
    /// Whether the render makes a part instead of pictures.
    pub(crate) fn is_part(&self) -> bool {
        self.shard.is_some() || self.tiles.is_some()
    }

    /// Whether the state of the render is saved.
    pub(crate) fn saves(&self) -> bool {
        self.is_part() || self.checkpoint.is_some() || self.resume.is_some()
    }

    /// The exit code of a render that is interrupted before its first sample: a farm runs a shard again.
    pub(crate) fn code_of_an_early_end(&self) -> i32 {
        if self.saves() { interrupt::RUN_AGAIN } else { interrupt::ENDED }
    }

    /// Checks the flags against the outputs before the work.
    pub(crate) fn check(&self, outputs: &[PicturePath]) -> Result<()> {
        if self.is_part() {
            let exr = |p: &PicturePath| p.format() == Some(PictureFormat::Exr);
            if !matches!(outputs, [one] if exr(one)) {
                let text = "--shard and --tiles write one part: give one -o PART.exr";
                return Err(UsageError(text.into()).into());
            }
        }
        for path in self.checkpoint.iter().chain(&self.resume) {
            if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
                let text = format!("{}: a checkpoint's name must end in .exr", path.display());
                return Err(UsageError(text).into());
            }
        }
        match (&self.checkpoint, &self.resume) {
            // If it continues in another file, this one is only read.
            (Some(to), Some(from)) if !same_file(to, from) => {
                files::reads(from)?;
                files::writes(to)
            }
            (Some(path), _) | (None, Some(path)) => files::writes(path),
            (None, None) => Ok(()),
        }
    }

    /// Reads the checkpoint to resume from, if there is one.
    pub(crate) fn render_run(
        &self,
        view: &PreparedScene,
        settings: &RenderSettings,
        job: &Job,
        report: &Settings,
        outputs: &[PicturePath],
        quiet: bool,
    ) -> Result<RenderRun> {
        let interrupted = interrupt::flag();
        let tiles = match (self.shard, self.tiles) {
            (Some(shard), _) => TileSelection::Shard(shard),
            (None, Some(tiles)) => TileSelection::Tiles(tiles),
            (None, None) => TileSelection::All,
        };
        let part = self.is_part().then(|| outputs[0].path.clone());
        let existing = part.clone().filter(|path| path.exists());
        let save = part.or_else(|| self.checkpoint.clone()).or_else(|| self.resume.clone());
        // Fingerprinting the scene and the environment takes time.
        let identity = if save.is_some() { identity(view, settings, job) } else { Vec::new() };
        let from = if let Some(path) = self.resume.clone().or(existing) {
            let checkpoint = read(&path)?;
            require_same(&path, &checkpoint, &identity)?;
            require_more(&path, &checkpoint, settings.n_samples)?;
            Some((path, checkpoint))
        } else {
            self.checkpoint.as_deref().map(refuse_to_replace).transpose()?;
            None
        };
        let Self { checkpoint_every: every, time, .. } = *self;
        let end = time.and_then(|time| clock::start().checked_add(time));
        let provenance = report.provenance(settings);
        Ok(RenderRun { tiles, save, every, from, end, interrupted, quiet, identity, provenance })
    }
}

/// Both are there and the same.
fn same_file(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| fs::canonicalize(path).ok();
    a == b || real(a).is_some_and(|a| Some(a) == real(b))
}

/// Everything that decides the picture except the number of samples, by name.
fn identity(view: &PreparedScene, settings: &RenderSettings, job: &Job) -> Vec<(String, String)> {
    let of_inputs = [
        ("background", settings.background.name().to_owned()),
        ("camera", serde_json::to_string(&view.report.camera).unwrap_or_default()),
        ("environment", view.environment.fingerprint().to_string()),
        ("scene", view.scene.fingerprint().to_string()),
        ("size", job.view.size.to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    let of_inputs = of_inputs.map(|(name, value)| (name.to_owned(), value));
    of_inputs.into_iter().chain(job.of_samples()).collect()
}

/// Reads a checkpoint or a part.
pub(crate) fn read(path: &Path) -> Result<Checkpoint> {
    let name = || path.display().to_string();
    if let Ok(there) = fs::metadata(path) {
        // A pipe might never end.
        if !there.is_file() {
            return Err(UsageError(format!("{}: not a regular file", name())).into());
        }
        memory::allow(&name(), there.len())?;
    }
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(UsageError(format!("{}: {error}", name())).into());
        }
        read => read.with_context(name)?,
    };
    memory::allow(&name(), Checkpoint::memory_to_decode(&bytes).with_context(name)?)?;
    Checkpoint::decode(&bytes).with_context(name)
}

/// The name of a field as the command line spells it, for messages.
pub(crate) fn spelled(field: &str) -> String {
    field.replace('_', "-")
}

/// A value of a render's identity, for messages.
pub(crate) fn or_none(value: &str) -> &str {
    if value.is_empty() { "none" } else { value }
}

fn require_same(path: &Path, checkpoint: &Checkpoint, identity: &[(String, String)]) -> Result<()> {
    let Some(difference) = checkpoint.difference(identity) else { return Ok(()) };
    let text = format!(
        "{} belongs to another render: its {} is {}, that of this render {}",
        path.display(),
        spelled(difference.name),
        or_none(difference.here),
        or_none(difference.there)
    );
    Err(UsageError(text).into())
}

fn require_more(path: &Path, checkpoint: &Checkpoint, n_samples: u32) -> Result<()> {
    if checkpoint.n_samples <= n_samples {
        return Ok(());
    }
    let text = format!(
        "{} belongs to a render with {} samples per pixel, but --spp is {n_samples}; give at \
         least as many",
        path.display(),
        checkpoint.n_samples
    );
    Err(UsageError(text).into())
}

/// Refuses to overwrite the state of an unfinished render.
fn refuse_to_replace(path: &Path) -> Result<()> {
    if !path.exists() || read(path).is_ok_and(|checkpoint| checkpoint.complete) {
        return Ok(());
    }
    let text = format!(
        "{} exists and is not a finished checkpoint: continue with --resume, or remove it",
        path.display()
    );
    Err(UsageError(text).into())
}

impl RenderRun {
    /// Renders until the session is complete, the time is up, or an interruption.
    pub(crate) fn run<S: Strategy>(
        &self,
        session: Renderer<S>,
        settings: &RenderSettings,
        progress: &RenderProgress,
        try_writing: TryWriting,
    ) -> Result<Rendering> {
        let range = self.range(session.tiling())?;
        let window = session.tiling().window(&range);
        self.allow(window.width, window.height)?;
        let mut session = session.only(range.clone());
        if let Some((path, checkpoint)) = &self.from {
            restore(&mut session, path, checkpoint)?;
        }
        let pixels: usize = range.map(|t| session.tiling().tile(t).area()).sum();
        let total = pixels as u64 * u64::from(settings.n_samples);
        progress.begin(total, session.counts().camera_rays);
        if !session.is_complete() {
            match self.end {
                Some(end) => {
                    let limit = TimeLimit::new(end);
                    self.advance_until(limit, &mut session, settings, progress, try_writing)?;
                }
                None => self.advance(&mut session, settings, progress)?,
            }
        } else if self.save.as_ref() != self.from.as_ref().map(|(path, _)| path) {
            self.save(&session, settings)?;
        }
        Ok(session.rendering())
    }

    /// Renders and saves periodically.
    fn advance<S: Strategy>(
        &self,
        session: &mut Renderer<S>,
        settings: &RenderSettings,
        progress: &RenderProgress,
    ) -> Result<()> {
        loop {
            let pause = self.save.as_ref().map(|_| Instant::now() + self.every);
            let complete =
                session.run(&Deadline { progress, pause, advanced: AtomicBool::new(false) });
            if complete || self.interrupted.load(Ordering::Relaxed) {
                return self.save(session, settings);
            }
            self.save_meanwhile(session, settings);
        }
    }

    /// What was saved before is still there if this fails, and the render may yet be written elsewhere.
    fn save_meanwhile<S: Strategy>(&self, session: &Renderer<S>, settings: &RenderSettings) {
        if let Err(error) = self.save(session, settings) {
            warn(self.quiet, &format!("no checkpoint: {error:#}"));
        }
    }

    /// Renders until nothing more fits before the end but writing, and saves from time to time. Passes of a picture
    /// that is not saved become shorter toward the end; such a picture never gets its last sample, so that complete
    /// pictures have the same bits with and without a time.
    fn advance_until<S: Strategy>(
        &self,
        mut limit: TimeLimit,
        session: &mut Renderer<S>,
        settings: &RenderSettings,
        progress: &RenderProgress,
        try_writing: TryWriting,
    ) -> Result<()> {
        let n_pixels = settings.width * settings.height;
        let may_divide = self.save.is_none() && settings.target_error.is_none();
        let mut pace = Pace::default();
        let mut was_shortened = false;
        let mut trial_at = Some(limit.trial_at(Instant::now()));
        let mut next_save = self.save.as_ref().map(|_| Instant::now() + self.every);
        loop {
            let start = session.least_samples();
            let left = settings.n_samples.saturating_sub(start);
            let stop = limit.stop();
            let seconds_left = stop.saturating_duration_since(Instant::now()).as_secs_f64();
            let share = session.share_behind();
            let mut most =
                if may_divide { pace.most_samples(seconds_left, share) } else { u32::MAX };
            if seconds_left == 0.0 && may_divide {
                most = 1;
            }
            if was_shortened {
                most = most.min(left.saturating_sub(1));
            }
            // A picture has a sample of each pixel, however short the time.
            let must_cover = may_divide && start == 0 && most == 1;
            let pause = [Some(stop), next_save, trial_at].into_iter().flatten().min();
            let watch = PassWatch::new(progress, pause.filter(|_| !must_cover), pace.tile_seconds)
                .replanned(may_divide && most > 1, share * n_pixels as f64);
            if most == 0 || !session.step_at_most(most, &watch) {
                return self.save(session, settings);
            }
            pace.measure(&watch, n_pixels);
            was_shortened |= watch.samples() == most && most < left;
            let now = Instant::now();
            let covers = session.least_samples() > 0;
            let is_over = now + Duration::from_secs_f64(pace.tile_seconds) >= limit.stop();
            if self.interrupted.load(Ordering::Relaxed)
                || session.is_complete()
                || is_over && (covers || !may_divide)
            {
                return self.save(session, settings);
            }
            if trial_at.is_some_and(|at| now >= at) {
                trial_at = None;
                limit.keep_for_writing(self.try_writing(session, settings, try_writing)?);
            } else if next_save.is_some_and(|at| now >= at) {
                self.save_meanwhile(session, settings);
                next_save = Some(Instant::now() + self.every);
            }
        }
    }

    /// Measures how long saving and writing take.
    fn try_writing<S: Strategy>(
        &self,
        session: &Renderer<S>,
        settings: &RenderSettings,
        try_writing: TryWriting,
    ) -> Result<Duration> {
        let start = Instant::now();
        if self.save.is_some() {
            self.save_meanwhile(session, settings);
        }
        let layers = session.rendering().layers;
        let so_far = start.elapsed();
        // A part is its own checkpoint.
        let is_part = self.tiles != TileSelection::All;
        Ok(so_far + if is_part { Duration::ZERO } else { try_writing(&layers)? })
    }

    fn save<S: Strategy>(&self, session: &Renderer<S>, settings: &RenderSettings) -> Result<()> {
        let Some(path) = &self.save else { return Ok(()) };
        let checkpoint = Checkpoint {
            identity: self.identity.clone(),
            provenance: self.provenance.clone(),
            tiles: session.tiles(),
            n_tiles: session.tiling().n_tiles(),
            n_samples: settings.n_samples,
            complete: session.is_complete(),
            counts: session.counts(),
            film: session.film(),
        };
        let bytes = checkpoint.encode()?;
        files::write(path, |out| out.write_all(&bytes))
    }

    /// Rejects more pixels than fit in memory.
    fn allow(&self, width: usize, height: usize) -> Result<()> {
        let pixel = if self.save.is_some() { memory::SAVED_PIXEL } else { Film::MEMORY_PER_PIXEL };
        memory::allow_picture(width, height, pixel)
    }

    fn range(&self, tiling: Tiling) -> Result<Range<usize>> {
        match self.tiles {
            TileSelection::All => Ok(0..tiling.n_tiles()),
            TileSelection::Shard(Shard { k, n }) => Ok(tiling.shard(k, n)),
            TileSelection::Tiles(Tiles { first, last }) if last < tiling.n_tiles() => {
                Ok(first..last + 1)
            }
            TileSelection::Tiles(Tiles { last, .. }) => {
                let n = tiling.n_tiles();
                let text =
                    format!("--tiles: there is no tile {last}; the picture has tiles 0-{}", n - 1);
                Err(UsageError(text).into())
            }
        }
    }

    /// The work of earlier runs, which this run continues.
    pub(crate) fn earlier_counts(&self) -> Counts {
        self.from.as_ref().map_or_else(Counts::default, |(_, checkpoint)| checkpoint.counts)
    }

    /// The file of the state, if it was saved.
    pub(crate) fn saved(&self) -> Option<&Path> {
        self.save.as_deref()
    }
}

/// Restores a session from a checkpoint of the same tiles.
fn restore<S: Strategy>(
    session: &mut Renderer<S>,
    path: &Path,
    checkpoint: &Checkpoint,
) -> Result<()> {
    if checkpoint.tiles != session.tiles() {
        let name = |t: &Range<usize>| match t.len() {
            0 => "no tiles".to_owned(),
            1 => format!("tile {}", t.start),
            _ => format!("tiles {}-{}", t.start, t.end - 1),
        };
        let text = format!(
            "{} holds {} of the picture, not {}",
            path.display(),
            name(&checkpoint.tiles),
            name(&session.tiles())
        );
        return Err(UsageError(text).into());
    }
    let restored = session.restore(&checkpoint.film, checkpoint.counts);
    restored.with_context(|| path.display().to_string())
}

/// Ends a run at a given time.
struct Deadline<'a> {
    progress: &'a RenderProgress,
    pause: Option<Instant>,
    /// A tile was finished: however short the time, every run gets further.
    advanced: AtomicBool,
}

impl Observer for Deadline<'_> {
    fn pass_started(&self, samples: Range<u32>) {
        self.progress.pass_started(samples);
    }

    fn tile_started(&self, window: Window) {
        self.progress.tile_started(window);
    }

    fn stage_started(&self, stage: Stage) {
        self.progress.stage_started(stage);
    }

    fn tile_finished(&self, counts: &Counts) {
        self.progress.tile_finished(counts);
        self.advanced.store(true, Ordering::Relaxed);
    }

    fn tile_rendered(&self, tile: &TileView) {
        self.progress.tile_rendered(tile);
    }

    fn canceled(&self) -> bool {
        let late = || self.pause.is_some_and(|pause| Instant::now() >= pause);
        self.progress.canceled() || (self.advanced.load(Ordering::Relaxed) && late())
    }
}
