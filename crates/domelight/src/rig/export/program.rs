//! The target program of a rig's file, and how to open the file there.

use super::Format;
use crate::code;
use crate::quote::{Code, Rust, Shell, Xml, javascript, pbrt, rust, shell, xml};

impl Format {
    /// The names of the programs that read files of this format.
    pub fn program(self) -> &'static str {
        match self {
            Self::Json => "programs of your own",
            Self::Csv => "spreadsheets and programs of your own",
            Self::Gltf | Self::Glb => "programs that import glTF 2.0",
            Self::Usd => "OpenUSD",
            Self::Blender => "Blender 4.2 or later",
            Self::Mitsuba => "Mitsuba 3",
            Self::Pbrt => "pbrt-v4",
            Self::Three => "three.js",
            Self::Radiance => "Radiance",
            Self::Sibl => "programs that load sIBL sets",
            Self::Godot => "Godot 4",
            Self::Unreal => "Unreal Engine 5",
            Self::Unity => "Unity",
            Self::Bevy => "Bevy",
            Self::Babylon => "Babylon.js",
        }
    }

    /// How to open the file: a command for a POSIX shell, or the text to add to a scene or module of the program, or
    /// otherwise a menu entry.
    pub fn how_to_open(self, file: &str) -> String {
        let word = argument(file);
        let name = file.rsplit('/').next().unwrap_or(file);
        let beside = format!("./{name}");
        let is_here = file == name || file == beside;
        match self {
            Self::Json => format!("python3 -m json.tool {word}"),
            Self::Csv => format!("column -s, -t {word}"),
            Self::Gltf | Self::Glb => "in Blender File > Import > glTF 2.0".to_owned(),
            Self::Usd => format!("usdview {word}"),
            Self::Blender => format!("blender --python {word}"),
            Self::Mitsuba => {
                let include =
                    code!(Xml, "in a scene <include filename=\"{file}\"/>", file = xml::text(file));
                include.into_string()
            }
            Self::Pbrt => {
                // pbrt looks for the dome's picture from the folder of the scene.
                let folder = if is_here { "" } else { "in a scene in the rig's folder " };
                let quoted = pbrt::string(name);
                let name = quoted.map_or_else(|| format!("\"{name}\""), Code::into_string);
                format!("{folder}after WorldBegin Include {name}")
            }
            Self::Three | Self::Babylon => {
                let module = javascript::string(&beside).into_string();
                format!("import {{ addRig }} from {module}; await addRig(scene)")
            }
            Self::Radiance => {
                // Radiance looks for the dome's picture from the working folder.
                let folder = if is_here { "" } else { "in the rig's folder, as for the render, " };
                format!("{folder}oconv scene.rad {} > scene.oct", argument(name))
            }
            Self::Sibl => "as a set of the program's sIBL loader".to_owned(),
            Self::Godot => "in a project, with its picture, Scene > Instantiate Child Scene".to_owned(),
            Self::Unreal => "in the editor Tools > Execute Python Script".to_owned(),
            Self::Unity => {
                "into a folder Editor of a project, with its picture, then Tools > Add the rig of domelight"
                    .to_owned()
            }
            Self::Bevy => {
                let module = code!(
                    Rust,
                    "#[path = {file}] mod rig; rig::spawn_rig(&mut commands)",
                    file = rust::string(file)
                );
                module.into_string()
            }
        }
    }
}

/// A file as a word of a command: neither an option nor, for `oconv`, a command.
fn argument(file: &str) -> Code<Shell> {
    if file.starts_with(['-', '!']) { shell::word(&format!("./{file}")) } else { shell::word(file) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_quote_the_file() {
        let file = "a b/rig'.py";
        assert_eq!(Format::Blender.how_to_open(file), r"blender --python 'a b/rig'\''.py'");
        assert_eq!(
            Format::Three.how_to_open("rigs/rig.js"),
            r#"import { addRig } from "./rig.js"; await addRig(scene)"#
        );
        for (format, command) in [
            (Format::Json, "python3 -m json.tool ./-rig"),
            (Format::Csv, "column -s, -t ./-rig"),
            (Format::Usd, "usdview ./-rig"),
            (Format::Blender, "blender --python ./-rig"),
            (Format::Radiance, "oconv scene.rad ./-rig > scene.oct"),
        ] {
            assert_eq!(format.how_to_open("-rig"), command);
        }
        for format in Format::ALL {
            assert!(!format.program().is_empty() && !format.how_to_open("rig").is_empty());
        }
    }

    /// The picture of the dome is beside the rig, where these programs do not look by themselves.
    #[test]
    fn a_rig_in_another_folder_is_opened_there() {
        for here in ["rig.pbrt", "./rig.pbrt"] {
            assert_eq!(Format::Pbrt.how_to_open(here), r#"after WorldBegin Include "rig.pbrt""#);
        }
        assert_eq!(
            Format::Pbrt.how_to_open("out/rig.pbrt"),
            r#"in a scene in the rig's folder after WorldBegin Include "rig.pbrt""#
        );
        assert_eq!(
            Format::Radiance.how_to_open("out/rig.rad"),
            "in the rig's folder, as for the render, oconv scene.rad rig.rad > scene.oct"
        );
    }
}
