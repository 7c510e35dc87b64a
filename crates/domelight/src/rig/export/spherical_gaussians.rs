//! Lobes as an array of shape \[K, 7\]: axis x, y and z, sharpness, amplitude red, green and blue.

use serde_json::json;

use crate::rig::SphericalGaussians;

/// The version of the JSON format; it grows when a reader of an older version would be wrong.
const VERSION: u32 = 1;

impl SphericalGaussians {
    /// A NumPy file: single precision in little-endian order, row by row.
    pub fn to_npy(&self) -> Vec<u8> {
        /// The header is padded to whole blocks of so many bytes.
        const BLOCK: usize = 64;
        let rows = self.rows();
        let shape =
            format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, 7), }}", rows.len());
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        let end = (bytes.len() + 2 + shape.len() + 1).next_multiple_of(BLOCK);
        let length = end - bytes.len() - 2;
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(format!("{shape:<width$}\n", width = length - 1).bytes());
        bytes.extend(rows.iter().flatten().flat_map(|number| number.to_le_bytes()));
        bytes
    }

    /// JSON with a lobe on each line; `probe` is the map's name.
    pub fn to_json(&self, probe: &str) -> String {
        let rows: Vec<String> = self.rows().iter().map(|row| json!(row).to_string()).collect();
        let rows = rows.join(",\n    ");
        let (probe, has_sun) = (json!(probe), self.has_sun);
        format!(
            "{{\n  \"format\": \"domelight-spherical-gaussians\",\n  \"version\": {VERSION},\n  \"probe\": {probe},\n  \
             \"has_sun\": {has_sun},\n  \"columns\": [\"x\", \"y\", \"z\", \"sharpness\", \"red\", \"green\", \"blue\"],\n  \
             \"lobes\": [\n    {rows}\n  ]\n}}\n"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::math::{Vec3, vec3};
    use crate::rig::SphericalGaussian;

    fn example() -> SphericalGaussians {
        let lobe = |axis: Vec3, sharpness: f32, amplitude: Rgb| SphericalGaussian {
            axis,
            sharpness,
            amplitude,
        };
        SphericalGaussians {
            lobes: vec![
                lobe(vec3(0.0, 0.6, -0.8), 180_000.5, Rgb::new(3.0, 2.5, 0.1)),
                lobe(Vec3::X, 0.001, Rgb::new(0.0, 0.25, 1e-7)),
            ],
            has_sun: true,
        }
    }

    #[test]
    fn a_numpy_file_has_its_rows_behind_a_padded_header() {
        let bytes = example().to_npy();
        assert_eq!(bytes[..10], *b"\x93NUMPY\x01\x00\x76\x00");
        let header = std::str::from_utf8(&bytes[10..128]).unwrap();
        assert!(header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 7), }"));
        assert!(header.ends_with(" \n"));
        let numbers: Vec<f32> =
            bytes[128..].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(numbers, example().rows().concat());
    }

    #[test]
    fn json_keeps_single_precision() {
        let text = example().to_json("a \"b\".hdr");
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["probe"], "a \"b\".hdr");
        let lobes = value["lobes"].as_array().unwrap();
        for (lobe, row) in lobes.iter().zip(example().rows()) {
            let read = |i: usize| lobe[i].as_f64().unwrap() as f32;
            assert_eq!(std::array::from_fn(read), row);
        }
    }
}
