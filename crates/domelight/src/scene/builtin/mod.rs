//! Scenes made in code, for pictures and tests.

pub mod shapes;
pub mod statue;
mod surface_nets;
