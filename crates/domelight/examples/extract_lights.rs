//! Turns a probe into a few lights: `cargo run --release --example extract_lights`.
//!
//! The probe is the built-in afternoon sky; a map of your own becomes an `Environment` the same way.

use std::error::Error;

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::rig::{ShadingReference, VarianceMinimization, variance_minimization};

pub fn main() -> Result<(), Box<dyn Error>> {
    let n_lights = 8;
    let map = BuiltinProbe::Sky.image(256);
    let environment = Environment::new(map, Orientation::default(), 1.0)?;
    let rig = variance_minimization(&environment, n_lights, VarianceMinimization::default())?;

    println!("toward the light (x y z)      irradiance (r g b)            radius   share");
    for light in &rig.lights {
        let [x, y, z] = light.direction.to_array();
        let [r, g, b] = light.irradiance.to_array();
        let (degrees, percent) = (light.angular_radius.to_degrees(), 100.0 * light.share);
        println!(
            "{x:8.4} {y:8.4} {z:8.4}   {r:9.4} {g:9.4} {b:9.4}   {degrees:5.1}°  {percent:5.2} %"
        );
    }
    let error = ShadingReference::new(&environment).error(&rig);
    println!(
        "without shadows, these lights shade a matt surface with an error of {:.2} % (RMS)",
        100.0 * error.diffuse
    );
    Ok(())
}
