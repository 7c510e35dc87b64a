//! Lights for a pbrt-v4 scene: `Include "rig.pbrt"` after `WorldBegin`.
//!
//! A light is a `distant` one: `L` is the irradiance of a surface that faces it \[W·m⁻²\], light
//! travels from `from` to `to`. It has no size. The dome is an `infinite` light, whose picture must
//! be a square in the equal-area octahedral mapping ([`Mapping::Octahedral`]). Axes are those of
//! the rig's world, as numbers; pbrt's own camera looks at a right-handed world in a mirror, which
//! `Scale -1 1 1` before `LookAt` undoes for geometry and lights alike.
//!
//! [`Mapping::Octahedral`]: crate::environment::mapping::Mapping::Octahedral

use super::RigExport;
use super::axes::Axes;
use super::text::{numbers, vector};
use super::{ExportError, Format};
use crate::code;
use crate::math::{Mat3, Mat4, Vec3};
use crate::quote::{Code, Pbrt, pbrt};

pub(super) fn encode(rig: &RigExport) -> Result<Code<Pbrt>, ExportError> {
    let mut text = code!(
        Pbrt,
        "# The lights of {probe}, by domelight.\n# Include them after WorldBegin.\n",
        probe = pbrt::comment(rig.probe)
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        text += code!(
            Pbrt,
            r#"
# {name}
LightSource "distant"
    "rgb L" [ {irradiance} ]
    "point3 from" [ {from} ]
    "point3 to" [ 0 0 0 ]
"#,
            name = pbrt::comment(&name),
            irradiance = numbers(light.irradiance.to_array(), " "),
            from = numbers(vector(light.direction), " "),
        );
    }
    if let Some(file) = rig.dome_file() {
        let to_world = Mat4::from_mat3(Axes::of_world(rig).dome * octahedral_to_map());
        let columns = to_world.to_cols_array().map(|value| (value + 0.0).to_string()).join(" ");
        text += code!(
            Pbrt,
            r#"
# The probe without the light of these lights, as an octahedral map
AttributeBegin
    ConcatTransform [ {columns} ]
    LightSource "infinite"
        "string filename" [ {file} ]
AttributeEnd
"#,
            columns = Code::generated(columns),
            file = pbrt::string(file).ok_or_else(|| Format::Pbrt.cannot_name(file))?,
        );
    }
    Ok(text)
}

/// From pbrt's axes of an octahedral picture to the map's own frame: its (x, y, z) is our
/// (−y, z, x), a mirror image as the world that pbrt's camera sees.
fn octahedral_to_map() -> Mat3 {
    Mat3::from_cols(Vec3::Z, Vec3::NEG_X, Vec3::Y)
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;
    use crate::environment::mapping::Mapping;
    use crate::math::vec2;

    #[test]
    fn lights_come_from_their_direction() {
        with_example(|rig| {
            let text = encode(rig).unwrap().into_string();
            assert_eq!(text.matches("LightSource \"distant\"").count(), rig.lights.len());
            assert!(text.contains(r#""point3 from" [ 0 0.6 -0.8 ]"#));
            assert!(text.contains(r#""rgb L" [ 3 0.1 0 ]"#));
            let without = encode(&RigExport { dome: None, ..*rig }).unwrap();
            assert!(!without.as_str().contains("infinite"));
        });
    }

    /// pbrt-v4, `EqualAreaSquareToSphere`: the center is +z, the middle of the right edge +x and
    /// the middle of the lower edge (larger v) +y.
    #[test]
    fn the_octahedral_picture_is_where_pbrt_sees_it() {
        let at = |u, v| Mapping::Octahedral.direction(vec2(u, v)).unwrap();
        for (uv, axis) in [((0.5, 0.5), Vec3::Z), ((1.0, 0.5), Vec3::X), ((0.5, 1.0), Vec3::Y)] {
            let expected = octahedral_to_map() * axis;
            assert!((at(uv.0, uv.1) - expected).length() < 1e-5, "{uv:?}");
        }
    }

    #[test]
    fn names_are_escaped() {
        with_dome_file("a\".exr", |rig| {
            let rig = RigExport { probe: "x\nMakeNamedMedium", ..*rig };
            let text = encode(&rig).unwrap().into_string();
            assert!(text.contains(r#"[ "a\".exr" ]"#));
            assert!(!text.contains("\nMakeNamedMedium"));
        });
    }
}
