//! The distant light: radiance over directions, its importance table and its look-up.

#[cfg(feature = "io")]
pub mod io;
pub mod mapping;
