//! A table for spreadsheets and scripts (RFC 4180): a light a row.
//!
//! Directions point toward the light, over the world's axes; irradiance is that of a surface that
//! faces the light \[W·m⁻²\], linear Rec. 709; angles are in degrees. The dome is not in the table.

use std::fmt::Write;

use super::RigExport;

const COLUMNS: &str = "name,x,y,z,red,green,blue,angular_radius_degrees,share,solid_angle";

pub(super) fn encode(rig: &RigExport) -> String {
    let mut text = format!("{COLUMNS}\r\n");
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let [x, y, z] = light.direction.to_array();
        let [r, g, b] = light.irradiance.to_array();
        let (radius, share) = (light.angular_radius.to_degrees(), light.share);
        let solid_angle = light.solid_angle;
        let _ = write!(text, "{name},{x},{y},{z},{r},{g},{b},{radius},{share},{solid_angle}\r\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;

    #[test]
    fn a_light_a_row() {
        with_example(|rig| {
            let text = encode(rig);
            let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
            assert_eq!(rows.len(), 1 + rig.lights.len());
            assert!(rows.iter().all(|row| row.len() == COLUMNS.split(',').count()));
            for (row, light) in rows[1..].iter().zip(rig.lights) {
                let numbers: Vec<f32> = row[1..].iter().map(|n| n.parse().unwrap()).collect();
                assert_eq!(numbers[..3], light.direction.to_array());
                assert_eq!(numbers[3..6], light.irradiance.to_array());
                assert_eq!(numbers[6], light.angular_radius.to_degrees());
            }
            assert_eq!((rows[1][0], rows[2][0], rows[3][0]), ("sun", "lamp_1", "light_1"));
        });
    }
}
