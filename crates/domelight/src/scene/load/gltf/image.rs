//! Textures: chooses and decodes a texture's image.

use std::collections::{HashMap, HashSet};

use super::error::{Failure, GltfErrorKind};
use super::json;
use super::ktx2::{Ktx2, is_ktx2};
use super::source::{Source, ViewBytes, percent_decoded};
use crate::scene::load::textures::Textures;
use crate::scene::load::{LoadError, read_referenced, relative};
use crate::scene::{Encoding, Texture, TextureFilter, TextureRef, UvTransform, Wrap};

/// The channels that a use of an image needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Channels {
    pub(super) encoding: Encoding,
    /// Whether alpha is used.
    pub(super) alpha: bool,
}

/// A color.
pub(super) const COLOR: Channels = Channels { encoding: Encoding::Srgb, alpha: false };
/// A color, and a value in the alpha channel.
pub(super) const COLOR_AND_ALPHA: Channels = Channels { encoding: Encoding::Srgb, alpha: true };
/// Linear values.
pub(super) const LINEAR: Channels = Channels { encoding: Encoding::Linear, alpha: false };
/// A value in the alpha channel.
pub(super) const ALPHA: Channels = Channels { encoding: Encoding::Linear, alpha: true };

/// The decoded images.
pub(super) struct Images<'a> {
    pub(super) textures: Textures<'a>,
    /// The texture of an image, and whether its alpha was read.
    known: HashMap<(usize, Encoding), (usize, bool)>,
    /// Unusable textures; their materials are rendered without them.
    unusable: HashSet<usize>,
    /// For each reason: the first message, and the number of other unusable textures.
    reasons: Vec<(Reason, String, usize)>,
}

/// Why a texture is unusable; each reason gives one warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    File,
    Remote,
    Decoding,
    Avif,
    Document,
}

impl<'a> Images<'a> {
    pub(super) fn new(textures: Textures<'a>) -> Self {
        let (known, unusable) = (HashMap::new(), HashSet::new());
        Self { textures, known, unusable, reasons: Vec::new() }
    }

    /// Decodes the image of a texture's use. Returns `None` with a warning if the texture has no image, or an
    /// unreadable one and the load is not strict.
    pub(super) fn texture(
        &mut self,
        source: &Source<'_>,
        material: &str,
        info: &json::TextureInfo,
        uv_set: usize,
        channels: Channels,
    ) -> Result<Option<TextureRef>, Failure> {
        if self.unusable.contains(&info.index) {
            return Ok(None);
        }
        let failure = match self.usable_texture(source, info, uv_set, channels) {
            Err(failure) if !source.strict => failure,
            result => return result,
        };
        let Some(reason) = Reason::of(&failure) else { return Err(failure) };
        self.unusable.insert(info.index);
        match self.reasons.iter_mut().find(|(known, ..)| *known == reason) {
            Some((.., more)) => *more += 1,
            None => self.reasons.push((reason, format!("material '{material}': {failure}"), 0)),
        }
        Ok(None)
    }

    /// Returns all textures, and warns once per reason of the textures left out.
    pub(super) fn finish(self, mut warn: impl FnMut(&str)) -> Vec<Texture> {
        for (_, first, more) in self.reasons {
            let all = match more {
                0 => "it is".into(),
                1 => "it and one more texture like it are".into(),
                n => format!("it and {n} more textures like it are"),
            };
            warn(&format!("{first}; {all} left out"));
        }
        self.textures.loaded
    }

    fn usable_texture(
        &mut self,
        source: &Source<'_>,
        info: &json::TextureInfo,
        uv_set: usize,
        channels: Channels,
    ) -> Result<Option<TextureRef>, Failure> {
        let texture: json::Texture = source.document.get(info.index)?;
        let Some(image) = image_of(&texture)? else {
            source.warn(&format!("texture {} has no supported image and is ignored", info.index));
            return Ok(None);
        };
        let sampler: json::Sampler = match texture.sampler {
            Some(sampler) => source.document.get(sampler)?,
            None => json::Sampler::default(),
        };
        let wrap = [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        });
        let filter = match sampler.mag_filter {
            Some(9728) => TextureFilter::Nearest,
            _ => TextureFilter::Linear,
        };
        let transform = info.extensions.transform.as_ref().map_or(UvTransform::IDENTITY, |t| {
            UvTransform::new(t.offset.into(), t.rotation, t.scale.into())
        });
        let texture = self.image(source, image, channels)?;
        Ok(Some(TextureRef { texture, uv_set, wrap, filter, transform }))
    }

    /// The texture of an image.
    fn image(
        &mut self,
        source: &Source<'_>,
        index: usize,
        channels: Channels,
    ) -> Result<usize, Failure> {
        let known = self.known.get(&(index, channels.encoding)).copied();
        match known {
            Some((texture, has_alpha)) if has_alpha || !channels.alpha => return Ok(texture),
            _ => {}
        }
        let texture = self.decode(source, index, channels)?;
        let loaded = &mut self.textures.loaded;
        // An image that is read again for its alpha keeps its slot.
        let place = known.map_or(loaded.len(), |(place, _)| place);
        if place == loaded.len() {
            loaded.push(texture);
        } else {
            loaded[place] = texture;
        }
        self.known.insert((index, channels.encoding), (place, channels.alpha));
        Ok(place)
    }

    fn decode(
        &self,
        source: &Source<'_>,
        index: usize,
        channels: Channels,
    ) -> Result<Texture, Failure> {
        let image: json::Image = source.document.get(index)?;
        let referrer = source.referrer(&format!("image {index}"));
        let in_file = |uri: &String| !uri.starts_with("data:") && !uri.contains("://");
        let (name, bytes) = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if in_file(uri) => {
                let path = relative(source.path, &percent_decoded(uri));
                let bytes = read_referenced(&path, &referrer, source.budget)?;
                (path.display().to_string(), ViewBytes::Decoded(bytes.into()))
            }
            (Some(uri), _) => {
                let bytes = source.uri("image", index, uri)?;
                (format!("image {index}"), ViewBytes::Decoded(bytes.into()))
            }
            (None, Some(view)) => (format!("image {index}"), source.view(view)?.0),
            (None, None) => {
                return Err(GltfErrorKind::NoSource { what: "image", index }.into());
            }
        };
        if bytes.get(4..12).is_some_and(|kind| kind == b"ftypavif" || kind == b"ftypavis") {
            return Err(GltfErrorKind::Avif { image: index }.into());
        }
        if is_ktx2(&bytes) {
            return ktx2(source, &name, &bytes, index, channels);
        }
        let Channels { encoding, alpha } = channels;
        Ok(self.textures.decode(&name, &bytes, encoding, alpha, &referrer)?)
    }
}

impl Reason {
    /// Why a texture is unusable; `None` for failures that end the load, such as a memory limit.
    fn of(failure: &Failure) -> Option<Self> {
        match failure {
            Failure::Load(error) if !error.is_about_one_image() => None,
            Failure::Load(LoadError::ReadReferenced { .. }) => Some(Self::File),
            Failure::Load(_) => Some(Self::Decoding),
            Failure::Problem(problem) => Some(match problem {
                GltfErrorKind::Uri { .. } => Self::Remote,
                GltfErrorKind::Avif { .. } => Self::Avif,
                GltfErrorKind::Ktx2 { .. } | GltfErrorKind::Base64 { .. } => Self::Decoding,
                _ => Self::Document,
            }),
        }
    }
}

/// The texture of a KTX2 image.
fn ktx2(
    source: &Source<'_>,
    name: &str,
    bytes: &[u8],
    index: usize,
    channels: Channels,
) -> Result<Texture, Failure> {
    let problem = |source| GltfErrorKind::Ktx2 { image: index, source };
    let image = Ktx2::new(bytes).map_err(problem)?;
    let (width, height) = (image.width, image.height);
    // The decoded texels, the stored texels, and their alpha.
    let place = format!("{}, image {index}", source.path.display());
    source.budget.take(&place, 12 * u64::from(width) * u64::from(height))?;
    let (texels, has_alpha) = image.decode().map_err(problem)?;
    let colors = texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let texture = Texture::from_rgb8(name, width, height, colors, channels.encoding);
    let texture = texture.map_err(GltfErrorKind::from)?;
    let alpha = texels.iter().map(|&[.., a]| a);
    let needs_alpha = channels.alpha && has_alpha && alpha.clone().any(|a| a != 255);
    if needs_alpha {
        return Ok(texture.with_alpha(alpha.collect()).map_err(GltfErrorKind::from)?);
    }
    Ok(texture)
}

/// The image of a texture: Basis Universal or WebP if present, otherwise the default image (also instead of AVIF).
fn image_of(texture: &json::Texture) -> Result<Option<usize>, GltfErrorKind> {
    let json::TextureExtensions { basisu, webp, avif } = &texture.extensions;
    let of = |source: &Option<json::TextureSource>| source.as_ref().and_then(|s| s.source);
    let image = of(basisu).or(of(webp)).or(texture.source);
    match (image, of(avif)) {
        (None, Some(image)) => Err(GltfErrorKind::Avif { image }),
        _ => Ok(image),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn avif_needs_a_fallback() {
        let image = |json: &str| image_of(&serde_json::from_str(json).unwrap());
        assert_eq!(image(r#"{"source":3}"#).unwrap(), Some(3));
        let both = r#"{"source":3,"extensions":{"EXT_texture_avif":{"source":1}}}"#;
        assert_eq!(image(both).unwrap(), Some(3));
        let webp = r#"{"source":3,"extensions":{"EXT_texture_webp":{"source":1}}}"#;
        assert_eq!(image(webp).unwrap(), Some(1));
        let error = image(r#"{"extensions":{"EXT_texture_avif":{"source":1}}}"#).unwrap_err();
        assert!(error.to_string().contains("image 1 is AVIF"));
        assert_eq!(image(r#"{"extensions":{"MSFT_texture_dds":{"source":1}}}"#).unwrap(), None);
    }
}
