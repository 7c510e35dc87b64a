//! Scene files refer to others, so that their readers take a path: the input lies in a folder of its own, below
//! `FUZZ_FOLDER` if that is set.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use domelight::scene::{AnimationTime, LoadOptions, load_with};

fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let parent = std::env::var_os("FUZZ_FOLDER").map_or_else(std::env::temp_dir, PathBuf::from);
        parent.join(format!("domelight-fuzz-{}", std::process::id()))
    })
}

/// Puts a file into the folder.
pub fn write(name: &str, bytes: &[u8]) {
    fs::create_dir_all(folder()).expect("a folder");
    fs::write(folder().join(name), bytes).expect("room for a file");
}

/// What a scene of an input may take.
const MAX_MEMORY: u64 = 1 << 30;

/// Reads the input as a scene file; that of glTF at a moment of its first animation, too.
pub fn load(name: &str, bytes: &[u8]) {
    write(name, bytes);
    let options = LoadOptions { max_memory: Some(MAX_MEMORY), ..LoadOptions::default() };
    let at_rest = load_with(folder().join(name), &options);
    if name.ends_with(".glb") && at_rest.is_ok() {
        let animation = Some(AnimationTime { name: "0".into(), seconds: 0.5 });
        drop(load_with(folder().join(name), &LoadOptions { animation, ..options }));
    }
}
