//! Scenes made in code, for pictures and tests.

pub mod material_ball;
pub mod shapes;
pub mod statue;
mod surface_nets;
