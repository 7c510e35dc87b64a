//! Numbered pictures of a camera that goes once around the subject.

use std::ops::Range;

use anyhow::{Result, bail};
use domelight::render::Rendering;
use domelight::scene::Camera;
use domelight_lab::scene::PreparedScene;

use crate::args::turntable::TurntableArguments;
use crate::error::{Interrupted, UsageError};
use crate::output::PicturePath;

/// The frames to render.
pub(crate) struct Turntable {
    /// Of the whole turn.
    n_frames: u32,
    range: Range<u32>,
    outputs: Vec<PicturePath>,
}

/// A frame.
pub(crate) struct Frame {
    /// Its number.
    pub(crate) index: u32,
    /// Of the whole turn.
    pub(crate) n_frames: u32,
    /// The outputs of the frame.
    pub(crate) outputs: Vec<PicturePath>,
}

impl TurntableArguments {
    /// The frames, whose pictures go to numbered `outputs`; none if one picture is wanted.
    pub(crate) fn turntable(&self, outputs: &[PicturePath]) -> Result<Option<Turntable>> {
        let Some(n_frames) = self.turntable else { return Ok(None) };
        if outputs.iter().any(PicturePath::is_standard_output) {
            let text = "--turntable writes several files; give a file name instead of -";
            return Err(UsageError(text.into()).into());
        }
        let range = match self.frames {
            None => 0..n_frames,
            Some(frames) if frames.last < n_frames => frames.first..frames.last + 1,
            Some(frames) => {
                let (asked, last) = (frames.last, n_frames - 1);
                let text = format!("--frames: there is no frame {asked}; they are 0-{last}");
                return Err(UsageError(text).into());
            }
        };
        Ok(Some(Turntable { n_frames, range, outputs: outputs.to_vec() }))
    }
}

impl Turntable {
    /// The number of frames to render.
    pub(crate) fn len(&self) -> u64 {
        u64::from(self.range.end - self.range.start)
    }

    fn frame(&self, index: u32) -> Frame {
        let outputs = self.outputs.iter().map(|path| path.numbered(index)).collect();
        Frame { index, n_frames: self.n_frames, outputs }
    }

    /// The files of all frames.
    pub(crate) fn outputs(&self) -> Vec<PicturePath> {
        self.range.clone().flat_map(|index| self.frame(index).outputs).collect()
    }

    /// Renders and writes one frame after the other; returns the last, with the work of all.
    ///
    /// # Errors
    /// If a picture cannot be written, or the render was interrupted; finished frames are kept.
    pub(crate) fn render(
        &self,
        view: &PreparedScene,
        mut render: impl FnMut(&Camera) -> Result<Rendering>,
        mut write: impl FnMut(&Rendering, &Frame) -> Result<()>,
    ) -> Result<Rendering> {
        let mut last: Option<Rendering> = None;
        for index in self.range.clone() {
            let degrees = 360.0 * index as f32 / self.n_frames as f32;
            let mut rendering = render(&view.camera_around(degrees)?)?;
            if !rendering.complete {
                let text = format!("interrupted; {}", self.left(index));
                return Err(Interrupted(text).into());
            }
            write(&rendering, &self.frame(index))?;
            rendering.counts += last.map_or_else(Default::default, |last| last.counts);
            last = Some(rendering);
        }
        last.map_or_else(|| bail!("a turntable without frames"), Ok)
    }

    /// Describes the finished frames and those missing from frame `index` on.
    fn left(&self, index: u32) -> String {
        let Range { start, end } = self.range;
        let rest = format!("--frames {index}-{} renders the rest", end - 1);
        match index - start {
            0 => "no frame was finished".to_owned(),
            1 => format!("frame {start} is finished; {rest}"),
            _ => format!("frames {start} to {} are finished; {rest}", index - 1),
        }
    }
}
