//! The distant light: radiance over directions, its importance table and its look-up.
pub mod builtin;
