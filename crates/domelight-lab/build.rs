//! Tells the program what it was compiled with, for the results of `domelight bench`.

use std::env;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(rustc).arg("--version").output();
    let version = version.map(|out| String::from_utf8_lossy(&out.stdout).trim().to_owned());
    // Cargo separates flags by this character.
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default().replace('\x1f', " ");
    println!("cargo::rustc-env=DOMELIGHT_RUSTC={}", version.unwrap_or_default());
    println!("cargo::rustc-env=DOMELIGHT_RUSTFLAGS={flags}");
    for name in ["TARGET", "PROFILE"] {
        println!("cargo::rustc-env=DOMELIGHT_{name}={}", env::var(name).unwrap_or_default());
    }
}
