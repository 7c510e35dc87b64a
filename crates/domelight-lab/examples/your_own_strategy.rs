//! A strategy of one's own in a report beside the library's: directions by the cosine alone, the first that everyone
//! writes.

use domelight::environment::Environment;
use domelight::math::{PI, Vec3};
use domelight::prelude::*;
use domelight::sampling::Dimension;
use domelight::sampling::warp::cosine_hemisphere;
use domelight::strategy::{PointStrategy, SampleIndex, ShadingPoint};
use domelight_lab::Silent;
use domelight_lab::compare::{Budget, Comparison, ComparisonSettings};
use domelight_lab::inspect::Inspection;
use domelight_lab::job::SceneSettings;

/// p = cos θ / π.
struct Cosine<'e> {
    environment: &'e Environment,
}

impl PointStrategy for Cosine<'_> {
    type Scratch = ();
    const UNBIASED: bool = true;

    fn n_rays(&self) -> u32 {
        1
    }

    /// Weights are in proportion to `le`, which is in multiples of this.
    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn sample(
        &self,
        at: &ShadingPoint,
        numbers: SampleIndex,
        (): &mut (),
        mut push: impl FnMut(Vec3, Rgb),
    ) {
        let local = cosine_hemisphere(numbers.get(Dimension::Brdf, 0, 1).u());
        let wi = at.frame.to_world(local);
        // f_r cos θ L / p; where p is 0 there is nothing to add.
        if local.z > 0.0 {
            push(wi, at.eval(wi) * self.environment.le(wi) * (PI / local.z));
        }
    }
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = SceneSettings::new("material-ball", [64, 64]).load(&Silent)?.build(&Silent)?;
    let render = RenderSettings { width: 64, height: 64, ..Default::default() };
    let budget = Budget::Rays(8.0);
    let settings = ComparisonSettings { render, budget, n_seeds: 2, ..Default::default() };
    let own = Cosine { environment: &scene.environment };

    let mut comparison = Comparison::new(scene.view(), settings);
    comparison.add("cosine", &own)?;
    for named in ["brdf", "mis", "product"] {
        comparison.add_named(named.parse()?)?;
    }
    let calibrated = comparison.calibrate(&Silent)?;
    let reference = calibrated.reference(None)?;
    let result = calibrated.run(&reference)?;
    result.report.summary().iter().for_each(|line| println!("{line}"));
    std::fs::write(std::env::temp_dir().join("cosine.html"), result.page()?.as_str())?;

    // Why it is noisy in the middle of the picture.
    let mut inspection = Inspection::new(scene.view(), render, [32, 32], "")?;
    inspection.add("cosine", &own);
    inspection.add_named(&"product".parse()?, &Silent)?;
    inspection.summary().iter().for_each(|line| println!("{line}"));
    Ok(())
}
