//! The first level of a cube texture as a picture.

use super::{Container, dds, ktx2};
use crate::environment::mapping::{CubeLayout, EnvmapKind, Mapping};
use crate::picture::{Format, Picture, PictureErrorKind, allocate, checked_area};
use crate::{Rgb, RgbImage};

/// The number of texels of the picture, by the header alone.
pub(in crate::picture) fn texels(
    bytes: &[u8],
    container: Container,
) -> Result<usize, PictureErrorKind> {
    let columns = match container {
        Container::Ktx2 => ktx2::columns(bytes)?,
        Container::Dds => dds::columns(bytes)?,
    };
    checked_area(columns, columns.saturating_mul(6))
}

/// The first level as a strip of faces as they are seen from inside: [`CubeLayout::StripVertical`].
///
/// Graphics interfaces look a cube up from outside: the faces on the horizon are mirrored, and those above and below
/// stand upside down.
pub(in crate::picture) fn decode(
    bytes: &[u8],
    container: Container,
) -> Result<Picture, PictureErrorKind> {
    let (cube, format) = match container {
        Container::Ktx2 => (ktx2::faces(bytes)?, Format::Ktx2),
        Container::Dds => (dds::faces(bytes)?, Format::Dds),
    };
    let size = cube.size;
    checked_area(size, 6 * size)?;
    let mut pixels = allocate(Rgb::BLACK, size, 6 * size)?;
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let (face, x, y) = (i / (size * size), i % size, i / size % size);
        let is_vertical = matches!(face, 2 | 3);
        let [x, y] = if is_vertical { [x, size - 1 - y] } else { [size - 1 - x, y] };
        *pixel = cube.texel(face, x, y);
    }
    let image = RgbImage::new(size, 6 * size, pixels);
    let envmap = Mapping::Cube(CubeLayout::StripVertical).envmap();
    debug_assert_eq!(envmap, Some(EnvmapKind::Cube));
    Ok(Picture { envmap, ..Picture::opaque(image, format) })
}

#[cfg(test)]
mod tests {
    use super::super::{TexelFormat, Texture};
    use super::*;
    use crate::math::vec2;
    use crate::rig::ibl::{FilteredMap, Layout};

    /// A cube with a color of its own in every direction, and smaller levels.
    fn cubes() -> Vec<FilteredMap> {
        let cube = |size: usize| {
            let layout = Layout::Cube;
            let texel = |i: usize| {
                let d = layout.direction(size, i);
                Rgb::new(2.0 + d.x, 2.0 + d.y, 2.0 + d.z)
            };
            FilteredMap { layout, size, texels: (0..layout.texels(size)).map(texel).collect() }
        };
        vec![cube(5), cube(2), cube(1)]
    }

    fn files(format: TexelFormat) -> [(Container, Vec<u8>); 2] {
        let (texture, _) = Texture::light(&cubes(), format);
        let (mut ktx, mut direct3d) = (Vec::new(), Vec::new());
        ktx2::encode(&texture, &mut ktx).unwrap();
        dds::encode(&texture, &mut direct3d).unwrap();
        [(Container::Ktx2, ktx), (Container::Dds, direct3d)]
    }

    /// What is written for a direction is read in that direction.
    #[test]
    fn cubes_are_read_as_they_are_looked_up() {
        let mapping = Mapping::Cube(CubeLayout::StripVertical);
        for format in TexelFormat::RADIANCE {
            for (container, bytes) in files(format) {
                assert_eq!(texels(&bytes, container).unwrap(), 150);
                let picture = decode(&bytes, container).unwrap();
                assert_eq!(picture.envmap, Some(EnvmapKind::Cube));
                let RgbImage { width, height, .. } = picture.image;
                for (i, texel) in picture.image.pixels.iter().enumerate() {
                    let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
                    let uv = vec2(at(i % width, width), at(i / width, height));
                    let d = mapping.direction(uv).unwrap();
                    for (found, exact) in texel.to_array().into_iter().zip(d.to_array()) {
                        assert!((found - 2.0 - exact).abs() < 6e-3, "{format:?} {container:?} {i}");
                    }
                }
            }
        }
    }

    #[test]
    fn damaged_files_are_errors() {
        for (container, bytes) in files(TexelFormat::Half) {
            for length in 0..bytes.len() {
                let result = decode(&bytes[..length], container);
                // DDS needs no more than its first level of the last face.
                assert!(result.is_err() || container == Container::Dds || length > 1500);
            }
            for at in 12..bytes.len().min(200) {
                for value in [0, 1, 0x7f, 0xff] {
                    let mut damaged = bytes.clone();
                    damaged[at] = value;
                    drop(decode(&damaged, container));
                    drop(texels(&damaged, container));
                }
            }
        }
    }

    #[test]
    fn errors_say_what_to_do() {
        let [(_, ktx), (_, direct3d)] = files(TexelFormat::SharedExponent);
        let changed = |bytes: &[u8], container: Container, at: usize, value: u8| {
            let mut bytes = bytes.to_vec();
            bytes[at] = value;
            decode(&bytes, container).unwrap_err().to_string()
        };
        for (at, value, text) in [
            (12, 143, "byte 12: vkFormat 143 (BC6H) is not read"),
            (20, 4, "byte 20: the faces are 4x5x0 texels"),
            (36, 1, "byte 36: the texture has 1 faces"),
            (32, 2, "array of 2 cubes"),
            (44, 2, "supercompression scheme 2"),
            (88, 1, "level 0 has 513"),
        ] {
            let error = changed(&ktx, Container::Ktx2, at, value);
            assert!(error.contains(text), "{error}");
        }
        for (at, value, text) in [
            (128, 95, "byte 128: DXGI format 95 (BC6H) is not read"),
            (84, b'X', "FourCC"),
            (113, 0, "no cube"),
            (140, 3, "array of 3 cubes"),
        ] {
            let error = changed(&direct3d, Container::Dds, at, value);
            assert!(error.contains(text), "{error}");
        }
        let error = decode(&direct3d[..400], Container::Dds).unwrap_err().to_string();
        assert!(error.contains("the file at byte 400: it is truncated"), "{error}");
    }
}
