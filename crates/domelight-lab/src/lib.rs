//! Builds on renders of [`domelight`]: comparisons of strategies, converged references and their cache, benchmarks, the
//! lecture's figures, and the pages that show them.
//!
//! Every entry point takes a [`Host`], which makes the decisions of a front end: where messages go, how progress is shown,
//! and when to stop. [`Silent`] is the host for programs that want only results.
//!
//! ```no_run
//! use domelight_lab::compare::{Budget, Comparison, ComparisonSettings};
//! use domelight_lab::job::SceneSettings;
//! use domelight::render::RenderSettings;
//! use domelight_lab::Silent;
//!
//! let scene = SceneSettings::new("robot.glb", [256, 256]).load(&Silent)?.build(&Silent)?;
//! let render = RenderSettings { width: 256, height: 256, ..Default::default() };
//! let settings = ComparisonSettings { render, budget: Budget::Rays(32.0), ..Default::default() };
//! let mut comparison = Comparison::new(scene.view(), settings);
//! comparison.add_named("mis:1:1".parse()?)?;
//! comparison.add_named("product".parse()?)?;
//! let calibrated = comparison.calibrate(&Silent)?;
//! let reference = calibrated.reference(None)?;
//! let result = calibrated.run(&reference)?;
//! std::fs::write("compare.html", result.page()?.as_str())?;
//! # Ok::<(), domelight_lab::Error>(())
//! ```

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod acceptance;
pub mod bench;
pub mod black;
pub mod compare;
pub mod denoise;
mod depth_of_field;
pub mod display;
mod error;
pub mod figures;
mod ground;
mod host;
pub mod inspect;
pub mod job;
pub mod measure;
pub mod names;
mod page;
pub mod probe;
pub mod report;
pub mod scene;
mod strategy;
pub mod svg;
mod usage;

pub use acceptance::{Acceptance, count_tries, warn_of_rare_acceptance};
pub use error::{At, Error};
pub use ground::Ground;
pub use host::{Host, Silent, WorkProgress};
pub use strategy::{NamedStrategy, refuse_repeating_points};
pub use usage::{Seconds, Stopwatch, cpu_seconds, peak_memory, thread_seconds};
