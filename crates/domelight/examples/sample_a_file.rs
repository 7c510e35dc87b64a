//! Reads a map and estimates the irradiance of the ground by its samples: `sample_a_file [MAP]`, Radiance or OpenEXR.
//!
//! The feature `picture` is enough: `cargo add domelight --no-default-features --features picture`.

use domelight::Error;
use domelight::environment::{Environment, builtin::BuiltinProbe};
use domelight::math::{Vec3, vec2};
use domelight::picture::exr::ExrLayers;
use domelight::sampling::Pcg32;

fn main() -> Result<(), Error> {
    run(std::env::args().nth(1))
}

pub(crate) fn run(map: Option<String>) -> Result<(), Error> {
    let environment = match map {
        Some(path) => Environment::load(path)?,
        None => Environment::from_bytes(&built_in_file()?)?,
    };

    let n = 4096;
    let mut numbers = Pcg32::new(0, 0);
    // Radiance times cosine over density, 0 below the horizon.
    let mut estimate = || {
        let light = environment.sample(vec2(numbers.next_f32(), numbers.next_f32()));
        light.map_or(0.0, |s| s.le.luminance() * s.wi.dot(Vec3::Y).max(0.0) / s.pdf)
    };
    let mean = (0..n).map(|_| estimate()).sum::<f32>() / n as f32;

    let exact = environment.irradiance(Vec3::Y).luminance();
    println!("{n} samples: {mean:.3} W/m²; the sum over all texels: {exact:.3} W/m²");
    Ok(())
}

/// An OpenEXR file of the built-in sky.
fn built_in_file() -> Result<Vec<u8>, Error> {
    let layers = ExrLayers::from_image(&BuiltinProbe::Sky.image(128), None);
    Ok(layers.encode().map_err(|kind| kind.in_file("the built-in sky"))?)
}
