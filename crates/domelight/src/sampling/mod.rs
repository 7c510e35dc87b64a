//! Drawing from densities.

pub mod warp;
