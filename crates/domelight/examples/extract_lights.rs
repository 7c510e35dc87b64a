//! Turns a probe into a few lights: `cargo run --release --example extract_lights`.
//!
//! The probe is the built-in afternoon sky; a map of your own becomes an `Environment` the same way.

use std::error::Error;

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::rig::{
    ExtractionSettings, RigLight, ShadingReference, SphericalHarmonics, VarianceMinimization,
    extract, variance_minimization,
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let map = BuiltinProbe::Sky.image(256);
    let environment = Environment::new(map, Orientation::default(), 1.0)?;
    let reference = ShadingReference::new(&environment);

    println!("The whole probe as eight lights:");
    let rig = variance_minimization(&environment, 8, VarianceMinimization::default())?;
    rig.lights.iter().for_each(print);
    let error = reference.error(&rig);
    println!("They shade a matte surface with an error of {:.2} % (RMS).\n", 100.0 * error.diffuse);

    println!("The sun, taken out of the probe:");
    let settings = ExtractionSettings { sun: true, ..ExtractionSettings::default() };
    let found = extract(&environment, settings)?;
    found.rig.lights.iter().for_each(print);
    if let Some(dome) = &found.residual {
        let error = reference.error_beside(&found.rig, &ShadingReference::new(dome));
        println!("Beside the rest of the probe its error is {:.2} %.", 100.0 * error.diffuse);
        let [r, g, b] = SphericalHarmonics::project(dome).coefficients[0].to_array();
        println!("The rest as spherical harmonics begins with {r:.4} {g:.4} {b:.4}.");
    }
    Ok(())
}

/// Toward the light, irradiance, radius and share of the energy.
fn print(light: &RigLight) {
    let [x, y, z] = light.direction.to_array();
    let [r, g, b] = light.irradiance.to_array();
    let (degrees, percent) = (light.angular_radius.to_degrees(), 100.0 * light.share);
    println!("{x:8.4} {y:8.4} {z:8.4}   {r:9.4} {g:9.4} {b:9.4}   {degrees:5.1}°  {percent:5.2} %");
}
