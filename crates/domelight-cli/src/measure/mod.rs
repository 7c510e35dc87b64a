//! Pictures and what they cost, and the converged ones that they are measured against: for `compare` and
//! `bench`.

pub(crate) mod cache;
pub(crate) mod reference;
pub(crate) mod render;
