//! The examples run.
#![cfg(feature = "io")]

#[path = "../examples/extract_lights.rs"]
mod extract_lights;
#[path = "../examples/one_pixel.rs"]
mod one_pixel;
#[path = "../examples/product_on_your_own_geometry.rs"]
mod product_on_your_own_geometry;
#[path = "../examples/render_file.rs"]
mod render_file;
#[allow(dead_code, reason = "main reads the command line")]
#[path = "../examples/sample_a_file.rs"]
mod sample_a_file;
#[path = "../examples/your_own_bsdf.rs"]
mod your_own_bsdf;

#[test]
fn render_file() {
    render_file::main().unwrap();
}

#[test]
fn sample_a_file() {
    sample_a_file::run(None).unwrap();
}

#[test]
fn your_own_bsdf() {
    your_own_bsdf::main().unwrap();
}

#[test]
fn product_on_your_own_geometry() {
    product_on_your_own_geometry::main();
}

#[test]
fn extract_lights() {
    extract_lights::main().unwrap();
}

#[test]
fn one_pixel() {
    one_pixel::main().unwrap();
}
