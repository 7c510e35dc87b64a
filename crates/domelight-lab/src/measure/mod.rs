//! Pictures and what they cost, and the converged ones that they are measured against: for `compare` and
//! `bench`.

mod cache;
mod reference;
pub(crate) mod render;
pub(crate) mod work;

pub use cache::Cache;
pub(crate) use cache::Key;
pub use reference::{Goal, Reference, ReferencePicture, ReferenceReport, Source};
pub(crate) use reference::{MIS, PRODUCT, ReferenceRun};
