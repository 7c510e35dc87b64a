//! The distant light: radiance over directions, its importance table and its look-up.

pub mod builtin;
#[cfg(feature = "io")]
pub mod io;
pub mod mapping;
pub mod statistics;
