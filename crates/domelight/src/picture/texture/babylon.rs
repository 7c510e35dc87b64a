//! Prefiltered light as the `.env` files of Babylon.js: a description in JSON and the faces of all levels as PNG.
//!
//! Texels are RGBD: color over a common divisor in alpha, raised to the power 1/2.2, 8 bits each.

use std::io::{self, Write};

use serde_json::json;

use crate::Rgb;
use crate::math::functions;
use crate::parallel::in_order;
use crate::rig::ibl::{BABYLON_SCALE, FilteredMap, PrefilteredLight};

const MAGIC: [u8; 8] = [0x86, 0x16, 0x87, 0x96, 0xf6, 0xd6, 0x96, 0x36];

/// The largest value of a channel.
pub(super) const LARGEST: f32 = 255.0;

/// Writes levels and harmonics.
///
/// # Errors
/// If writing to `out` fails.
pub(super) fn encode(light: &PrefilteredLight, out: &mut dyn Write) -> io::Result<()> {
    let n_faces = 6 * light.levels.len();
    let faces = in_order(n_faces, |i| face(&light.levels[i / 6], i % 6));
    let faces = faces.into_iter().collect::<io::Result<Vec<_>>>()?;
    let mut end = 0;
    let places = faces.iter().map(|bytes| {
        let position = end;
        end += bytes.len();
        json!({ "length": bytes.len(), "position": position })
    });
    let description = json!({
        "version": 2,
        "width": light.levels.first().map_or(0, |cube| cube.size),
        "imageType": "image/png",
        "specular": { "mipmaps": places.collect::<Vec<_>>(), "lodGenerationScale": BABYLON_SCALE },
        "irradiance": irradiance(light),
    });
    out.write_all(&MAGIC)?;
    out.write_all(&serde_json::to_vec(&description)?)?;
    out.write_all(&[0])?;
    faces.iter().try_for_each(|bytes| out.write_all(bytes))
}

/// Irradiance over π as a polynomial of degree 2, without a constant because x² + y² + z² = 1.
///
/// Babylon.js divides each degree by the cosine's weight there, 1, 2/3 and 1/4 (`SphericalHarmonics.FromPolynomial`), so the file
/// has these weights twice.
fn irradiance(light: &PrefilteredLight) -> serde_json::Value {
    let [c, y, z, x, xy, yz, zz, xz, xx_yy] = light.harmonics.irradiance_polynomial();
    let first = |c: Rgb| (c * (2.0 / 3.0)).to_array();
    let second = |c: Rgb| (c * 0.25).to_array();
    let square = |c2: Rgb| (c + c2 * 0.25).to_array();
    json!({
        "x": first(x), "y": first(y), "z": first(z),
        "xx": square(xx_yy - zz), "yy": square(-xx_yy - zz), "zz": square(zz * 2.0),
        "yz": second(yz), "zx": second(xz), "xy": second(xy),
    })
}

/// A face as PNG, whose rows are those of the texture from the last to the first.
fn face(cube: &FilteredMap, face: usize) -> io::Result<Vec<u8>> {
    let size = cube.size;
    let rows = cube.texels.chunks_exact(size).skip(face * size).take(size).rev();
    let texels: Vec<u8> = rows.flatten().flat_map(|&texel| rgbd(texel)).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size as u32, size as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(&texels).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)?;
    Ok(bytes)
}

/// Color over the largest divisor that keeps it at most 1.
fn rgbd(texel: Rgb) -> [u8; 4] {
    // NaN becomes 0, too.
    let texel = texel.map(|c| if c > 0.0 { c.min(LARGEST) } else { 0.0 });
    let divisor = (LARGEST / texel.max_component().max(1e-7)).clamp(1.0, 255.0).floor();
    let byte = |c: f32| {
        let display = functions::powf(f64::from((c * divisor / 255.0).min(1.0)), 1.0 / 2.2);
        (255.0 * display).round() as u8
    };
    [byte(texel.r), byte(texel.g), byte(texel.b), divisor as u8]
}

/// A texel as Babylon's shader decodes it.
pub(super) fn rounded(texel: Rgb) -> Rgb {
    let [r, g, b, divisor] = rgbd(texel);
    let display = |byte: u8| functions::powf(f64::from(byte) / 255.0, 2.2);
    Rgb::from([r, g, b].map(|byte| (display(byte) * 255.0 / f64::from(divisor)) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Babylon's shader decodes texels within half a step of 8 bits.
    #[test]
    fn texels_are_read_again() {
        for i in 0..2000 {
            let at = |k: i32| functions::exp2((i * k % 97) as f32 / 97.0 * 14.0 - 6.0);
            let texel = Rgb::new(at(1), at(3), at(7)).map(|c| c.min(LARGEST));
            let [r, g, b, d] = rgbd(texel);
            for (byte, exact) in [r, g, b].into_iter().zip(texel.to_array()) {
                let decoded = |byte: f32| (byte / 255.0).powf(2.2) / (f32::from(d) / 255.0);
                let (byte, slack) = (f32::from(byte), 1e-5 * exact);
                let range = decoded((byte - 0.5).max(0.0)) - slack..=decoded(byte + 0.5) + slack;
                assert!(range.contains(&exact), "{texel:?}: {range:?}");
            }
        }
        assert_eq!(rgbd(Rgb::BLACK), [0, 0, 0, 255]);
        assert_eq!(rgbd(Rgb::splat(1e9)), [255, 255, 255, 1]);
        assert_eq!(rgbd(Rgb::splat(f32::NAN))[..3], [0; 3]);
    }
}
