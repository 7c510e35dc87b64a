//! OpenEXR: reads one layer of any flat file, and writes several layers into one part.

mod attributes;
pub mod bands;
mod luminance_chroma;
mod read;
mod read_layers;
mod write;

pub use read::decode;
pub(crate) use read::texels;
pub(super) use read::{decode_reduced, size};
pub use write::{Compression, ExrLayers, Layer, Plane, plain_attributes, text_attributes};
