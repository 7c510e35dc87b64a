//! Textures from image files, each read once.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, Limits};

use super::{Budget, LoadError, last_part, read_referenced, relative};
use crate::picture;
use crate::scene::texture::{Encoding, Texture};

/// What an image file is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Content {
    /// A color in sRGB.
    Color,
    /// Linear numbers.
    Numbers,
    /// A number in the alpha channel: the file's own alpha, or its luminance if it is opaque throughout.
    Opacity,
}

/// The textures of one scene while it is loaded.
pub(super) struct Textures<'b> {
    pub(super) loaded: Vec<Texture>,
    files: HashMap<(PathBuf, Content), usize>,
    pub(super) budget: &'b Budget<'b>,
}

impl<'b> Textures<'b> {
    pub(super) fn new(budget: &'b Budget<'b>) -> Self {
        Self { loaded: Vec::new(), files: HashMap::new(), budget }
    }

    /// The index of a file's texture.
    pub(super) fn file_of(
        &mut self,
        path: &Path,
        content: Content,
        referrer: &str,
    ) -> Result<usize, LoadError> {
        let key = (path.to_owned(), content);
        if let Some(&index) = self.files.get(&key) {
            return Ok(index);
        }
        let bytes = read_referenced(path, referrer, self.budget)?;
        let name = path.display().to_string();
        let encoding = match content {
            Content::Color => Encoding::Srgb,
            Content::Numbers | Content::Opacity => Encoding::Linear,
        };
        let is_opacity = content == Content::Opacity;
        let mut texture = self.decode(&name, &bytes, encoding, is_opacity, referrer)?;
        if is_opacity && !texture.has_alpha() {
            let alpha = luminances(&texture);
            texture = texture.with_alpha(alpha).unwrap_or_else(|_| unreachable!("one a texel"));
        }
        self.loaded.push(texture);
        self.files.insert(key, self.loaded.len() - 1);
        Ok(self.loaded.len() - 1)
    }

    /// The index of the texture that the file `from` names: where it says, or else, if the name is a path of the computer
    /// where the file was made, its last part beside `from`.
    pub(super) fn named_in(
        &mut self,
        from: &Path,
        name: &str,
        content: Content,
        referrer: &str,
    ) -> Result<usize, LoadError> {
        let path = relative(from, name);
        self.file_of(&path, content, referrer).or_else(|error| {
            match (&error, relative(from, last_part(name))) {
                (LoadError::ReadReferenced { .. }, beside) if beside != path => {
                    self.file_of(&beside, content, referrer).map_err(|_| error)
                }
                _ => Err(error),
            }
        })
    }

    /// The index of a new texture with the green of one and the blue of another, as large as the larger one, and 1 for what
    /// is not given.
    pub(super) fn packed(
        &mut self,
        place: &str,
        green: Option<usize>,
        blue: Option<usize>,
    ) -> Result<usize, LoadError> {
        let [green, blue] = [green, blue].map(|index| index.map(|index| &self.loaded[index]));
        let size = |texture: Option<&Texture>| texture.map_or((1, 1), Texture::size);
        let ((w0, h0), (w1, h1)) = (size(green), size(blue));
        let (width, height) = (w0.max(w1), h0.max(h1));
        self.budget.take(place, 3 * u64::from(width) * u64::from(height))?;
        let byte = |texture: Option<&Texture>, x: u32, y: u32, channel: usize| {
            let Some(texture) = texture else { return 255 };
            let (w, h) = texture.size();
            let along =
                |i: u32, n: u32, of: u32| (u64::from(i) * u64::from(n) / u64::from(of)) as u32;
            let texel = texture.texel(along(x, w, width), along(y, h, height)).to_array();
            (255.0 * texel[channel] + 0.5) as u8
        };
        let texel = |x, y| [255, byte(green, x, y, 1), byte(blue, x, y, 2)];
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let texels = texels.map(|(x, y)| texel(x, y)).collect();
        let texture = Texture::from_rgb8(place, width, height, texels, Encoding::Linear);
        self.loaded.push(texture.unwrap_or_else(|_| unreachable!("one texel a place")));
        Ok(self.loaded.len() - 1)
    }

    /// Lets go of a texture that nothing refers to, if it is the last.
    pub(super) fn forget(&mut self, index: usize) {
        if index + 1 == self.loaded.len() {
            self.loaded.pop();
            self.files.retain(|_, known| *known != index);
        }
    }

    /// A texture from the bytes of an image file, with its alpha if that is asked for and not all opaque.
    pub(super) fn decode(
        &self,
        name: &str,
        bytes: &[u8],
        encoding: Encoding,
        alpha: bool,
        referrer: &str,
    ) -> Result<Texture, LoadError> {
        let error =
            |source| LoadError::Image { image: name.into(), referrer: referrer.into(), source };
        // Where nothing else limits it, as much as the crate thinks right. A color profile is unpacked with the header.
        let mut limits = Limits::default();
        limits.max_alloc = self.budget.left().or(limits.max_alloc);
        if picture::format_of(bytes) == Some(picture::Format::Png) {
            limits = picture::png::limits(bytes, picture::Format::Png, limits.max_alloc)
                .unwrap_or(limits);
        }
        let mut decoder =
            reader(name, bytes, limits).and_then(ImageReader::into_decoder).map_err(error)?;
        // What the decoder makes, what it becomes as RGB, and what is kept.
        let (width, height) = decoder.dimensions();
        let rgb = if is_deep(decoder.color_type()) { 6 } else { 3 };
        let converted = if alpha { rgb + rgb / 3 } else { rgb };
        let texels = u64::from(width) * u64::from(height);
        let kept = converted + rgb + u64::from(alpha);
        self.budget
            .take(name, decoder.total_bytes().saturating_add(kept.saturating_mul(texels)))?;
        let mut limits = Limits::default();
        limits.max_alloc = self.budget.left().or(limits.max_alloc);
        limits.reserve(decoder.total_bytes()).map_err(error)?;
        decoder.set_limits(limits).map_err(error)?;
        decode(decoder, name, encoding, alpha).map_err(error)
    }
}

fn reader<'a>(
    name: &str,
    bytes: &'a [u8],
    limits: Limits,
) -> Result<ImageReader<Cursor<&'a [u8]>>, image::ImageError> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    reader.limits(limits);
    if reader.format().is_none()
        && let Ok(format) = image::ImageFormat::from_path(name)
    {
        reader.set_format(format);
    }
    Ok(reader)
}

/// The luminance of each texel as 0 to 255.
fn luminances(texture: &Texture) -> Vec<u8> {
    let (width, height) = texture.size();
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    texels.map(|(x, y)| (255.0 * texture.texel(x, y).luminance() + 0.5) as u8).collect()
}

fn is_deep(color: ColorType) -> bool {
    use ColorType::{L16, La16, Rgb16, Rgba16};
    matches!(color, L16 | La16 | Rgb16 | Rgba16)
}

fn decode(
    decoder: impl ImageDecoder,
    name: &str,
    encoding: Encoding,
    alpha: bool,
) -> Result<Texture, image::ImageError> {
    let deep = is_deep(decoder.color_type());
    let image = DynamicImage::from_decoder(decoder)?;
    let (width, height) = (image.width(), image.height());
    let mut alphas: Vec<u8> = Vec::new();
    let keep_alpha = alpha && image.color().has_alpha();
    let texture = if deep {
        let texels = if keep_alpha {
            let image = image.into_rgba16();
            alphas = image.pixels().map(|p| (p.0[3] / 257) as u8).collect();
            image.pixels().map(|p| [p.0[0], p.0[1], p.0[2]]).collect()
        } else {
            image.into_rgb16().pixels().map(|p| p.0).collect()
        };
        Texture::from_rgb16(name, width, height, texels, encoding)
    } else {
        let texels = if keep_alpha {
            let image = image.into_rgba8();
            alphas = image.pixels().map(|p| p.0[3]).collect();
            image.pixels().map(|p| [p.0[0], p.0[1], p.0[2]]).collect()
        } else {
            image.into_rgb8().pixels().map(|p| p.0).collect()
        };
        Texture::from_rgb8(name, width, height, texels, encoding)
    };
    let is_opaque = alphas.iter().all(|&a| a == 255);
    let texture = if is_opaque { texture } else { texture.and_then(|t| t.with_alpha(alphas)) };
    texture.map_err(|e| {
        let hint = image::error::ImageFormatHint::Unknown;
        image::ImageError::Decoding(image::error::DecodingError::new(hint, e))
    })
}
