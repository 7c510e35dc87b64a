//! The examples run.
#![allow(missing_docs, unreachable_pub)]

#[path = "../examples/extract_lights.rs"]
mod extract_lights;
#[path = "../examples/one_pixel.rs"]
mod one_pixel;
#[path = "../examples/render_sphere.rs"]
mod render_sphere;

#[test]
fn one_pixel_runs() {
    one_pixel::main().unwrap();
}

#[test]
fn render_sphere_runs() {
    render_sphere::main().unwrap();
}

#[test]
fn extract_lights_runs() {
    extract_lights::main().unwrap();
}
