//! Ground under a subject.

use serde::Serialize;

/// What is put under a subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Ground {
    /// A diffuse plate that fades to nothing toward its rim.
    Plate,
    /// Ground that shows nothing but shadows on the background.
    Shadow,
}
