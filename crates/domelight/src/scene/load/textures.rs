//! Textures from image files, each read once.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageReader};

use super::{LoadError, read_referenced};
use crate::scene::texture::{Encoding, Texture};

/// The textures of one scene while it is loaded.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) textures: Vec<Texture>,
    files: HashMap<(PathBuf, Encoding), usize>,
}

impl Textures {
    /// The index of a file's texture.
    pub(super) fn file(
        &mut self,
        path: &Path,
        encoding: Encoding,
        referrer: &str,
    ) -> Result<usize, LoadError> {
        let key = (path.to_owned(), encoding);
        if let Some(&index) = self.files.get(&key) {
            return Ok(index);
        }
        let bytes = read_referenced(path, referrer)?;
        let index = self.bytes(&path.display().to_string(), &bytes, encoding, referrer)?;
        self.files.insert(key, index);
        Ok(index)
    }

    /// The index of a new texture from the bytes of an image file.
    pub(super) fn bytes(
        &mut self,
        name: &str,
        bytes: &[u8],
        encoding: Encoding,
        referrer: &str,
    ) -> Result<usize, LoadError> {
        let texture = decode(name, bytes, encoding).map_err(|source| LoadError::Image {
            image: name.into(),
            referrer: referrer.into(),
            source,
        })?;
        self.textures.push(texture);
        Ok(self.textures.len() - 1)
    }
}

fn decode(name: &str, bytes: &[u8], encoding: Encoding) -> Result<Texture, image::ImageError> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    if reader.format().is_none()
        && let Ok(format) = image::ImageFormat::from_path(name)
    {
        reader.set_format(format);
    }
    let image = reader.decode()?;
    let (width, height) = (image.width(), image.height());
    let deep = matches!(
        image,
        DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
            | DynamicImage::ImageRgb16(_)
            | DynamicImage::ImageRgba16(_)
    );
    let texture = if deep {
        let texels = image.into_rgb16().pixels().map(|p| p.0).collect();
        Texture::from_rgb16(name, width, height, texels, encoding)
    } else {
        let texels = image.into_rgb8().pixels().map(|p| p.0).collect();
        Texture::from_rgb8(name, width, height, texels, encoding)
    };
    texture.map_err(|e| {
        let hint = image::error::ImageFormatHint::Unknown;
        image::ImageError::Decoding(image::error::DecodingError::new(hint, e))
    })
}
