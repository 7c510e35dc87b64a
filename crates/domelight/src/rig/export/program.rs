//! The target program of a rig's file, and how to open the file there.

use super::Format;
use crate::code;
use crate::quote::{Code, Xml, javascript, pbrt, shell, xml};

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
        }
    }

    /// How to open the file: a command for a POSIX shell, or the text to add to a scene or module of the program, or
    /// otherwise a menu entry.
    pub fn how_to_open(self, file: &str) -> String {
        let word = shell::word(file);
        let beside = format!("./{}", file.rsplit('/').next().unwrap_or(file));
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
                let name = pbrt::string(file);
                let name = name.map_or_else(|| format!("\"{file}\""), Code::into_string);
                format!("after WorldBegin Include {name}")
            }
            Self::Three => {
                let module = javascript::string(&beside).into_string();
                format!("import {{ addRig }} from {module}; await addRig(scene)")
            }
            Self::Radiance => format!("oconv scene.rad {word} > scene.oct"),
            Self::Sibl => "as a set of the program's sIBL loader".to_owned(),
        }
    }
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
        for format in Format::ALL {
            assert!(!format.program().is_empty() && !format.how_to_open("rig").is_empty());
        }
    }
}
