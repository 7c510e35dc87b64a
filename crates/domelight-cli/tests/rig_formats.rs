//! `domelight lights` into the formats of other programs: the pictures of the dome beside them.

use crate::common;

use common::{domelight, done, load, stderr};
use tempfile::TempDir;

const RIGS: [&str; 8] = [
    "rig.xml",
    "rig.rad",
    "rig.pbrt",
    "rig.js",
    "rig.glb",
    "rig.tscn",
    "rig.unreal.py",
    "rig.babylon.js",
];

#[test]
fn each_rig_names_the_picture_that_its_program_reads() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut arguments = vec!["lights", "sky", "--env-rows", "64", "--sun", "-q"];
    arguments.extend(RIGS.iter().flat_map(|rig| ["-o", rig]));
    done(&domelight(&folder, &arguments));
    for (rig, picture) in [
        ("rig.xml", "rig_dome.exr"),
        ("rig.rad", "rig_dome.hdr"),
        ("rig.pbrt", "rig_dome_octahedral.exr"),
        ("rig.tscn", "rig_dome.exr"),
        ("rig.unreal.py", "rig_dome.hdr"),
        ("rig.babylon.js", "rig_dome.hdr"),
    ] {
        let text = std::fs::read_to_string(folder.path().join(rig)).expect(rig);
        assert!(text.contains(&format!("\"{picture}\"")), "{rig}: {text}");
        assert!(folder.path().join(picture).is_file(), "{picture}");
    }
    let square = load(&folder, "rig_dome_octahedral.exr");
    assert_eq!(square.width, square.height);
}

#[test]
fn a_picture_on_standard_output_has_no_name_to_refer_to() {
    let folder = TempDir::new().expect("a temporary folder");
    let arguments = ["lights", "sky", "--sun", "--keep-residual", "-", "-o", "rig.xml"];
    let output = domelight(&folder, &arguments);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("mitsuba"), "{}", stderr(&output));
    assert!(!folder.path().join("rig.xml").exists());
}
