//! Figure 7: variance minimization compared with median cut.

use crate::Error;
use domelight::RgbImage;
use domelight::quote::Code;
use domelight::rig::{
    LightPosition, MedianCut, Rig, RigError, Rule, ShadingReference, VarianceMinimization,
    median_cut, variance_minimization,
};
use domelight::strategy::StrategySpec;

use super::context::{FigureContext, FigureScene};
use super::figure::{Figure, Picture, Radiance, Row, Table, picture_panel, png_bytes};
use super::formulas;
use super::maps::{borders, mark};
use super::median_cut::{converged_panel, full_scene, lit_panel, regions_panel, sphere_scene};
use crate::svg::{Document, Pixels, Rect};

/// The poster's region counts.
const REGIONS: [usize; 4] = [4, 16, 64, 256];
/// The number of lights in the renders and the detail.
const LIGHTS: usize = 64;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let environment = &context.environment;
    let poster = |n| variance_minimization(environment, n, VarianceMinimization::poster());
    let refined = |n| variance_minimization(environment, n, VarianceMinimization::default());
    let cut = |n| median_cut(environment, n, MedianCut::default());
    let (mut by_poster, mut by_default) = (Vec::new(), Vec::new());
    for n in REGIONS {
        let title = format!("{n} regions");
        by_poster.push(regions_panel(context, &poster(n)?, &title)?);
        by_default.push(regions_panel(context, &refined(n)?, &title)?);
    }
    let detail = Detail::new(context);
    let details = vec![
        detail.panel("Part of the map", None)?,
        detail.panel("Median cut, 64", Some(&cut(LIGHTS)?))?,
        detail.panel("The poster's rule, 64", Some(&poster(LIGHTS)?))?,
        detail.panel("On the sphere, refined, 64", Some(&refined(LIGHTS)?))?,
    ];

    let mut pictures = Vec::new();
    let scene = lit_panels(&full_scene(context)?, "scene", &mut pictures)?;
    let sphere = lit_panels(&sphere_scene(context)?, "sphere", &mut pictures)?;
    Ok(Figure {
        number: 7,
        title: "Variance minimization",
        slides: "slides 42–45",
        caption: Code::literal(
            "<p>Equal energy is not optimal for shading: one light can represent concentrated energy, but not energy \
            that is spread out. The poster’s rule minimizes the larger of the two halves’ variances, the energy times \
            the squared distance to the centroid on the map (not the variance of the pixel values). The program’s \
            default minimizes the sum of both, with distances on the sphere, without poles or seams; the worst region \
            is cut first, then regions are joined and refined into cells around their lights. The detail shows the surroundings of the brightest light: lights (blue) sit on the bright \
            features.</p>\
            <p>The table lists the RMS error of unoccluded shading over all normals, in percent of the RMS shading: \
            matte, and for a lobe cos<sup>20</sup>.</p>",
        ),
        formulas: vec![formulas::region_variance()],
        rows: vec![
            Row::new("The poster's rule", by_poster),
            Row::new("On the sphere, worst region first, refined", by_default),
            Row::new("One region in detail", details),
            Row::new("The scene, lit by 64 lights", scene),
            Row::new("A matte sphere, lit by 64 lights", sphere),
        ],
        tables: vec![errors(context)?],
        pictures,
    })
}

/// A scene lit by the lights of every method, and its converged picture; adds the former to `pictures`.
fn lit_panels(
    scene: &FigureScene,
    name: &str,
    pictures: &mut Vec<Radiance>,
) -> Result<Vec<Document>, Error> {
    let mut panels = Vec::new();
    for (spec, title, file) in lit_by() {
        let measured = scene.measure(spec)?;
        panels.push(lit_panel(title, &measured, scene.tone()?)?);
        let image = measured.render.layers.color;
        pictures.push(Radiance { name: format!("{name}-{file}"), image, tone: scene.tone()? });
    }
    panels.push(converged_panel(scene)?);
    Ok(panels)
}

/// The strategies of the renders, with their titles and the names of their files.
fn lit_by() -> [(StrategySpec, &'static str, &'static str); 3] {
    let n_lights = LIGHTS as u32;
    let minimized = |rule| StrategySpec::VarianceMinimization { n_lights, rule };
    [
        (StrategySpec::MedianCut { n_lights }, "Median cut, 64", "median-cut"),
        (minimized(Rule::Poster), "The poster's rule, 64", "variance-minimization-2009"),
        (minimized(Rule::Spherical), "On the sphere, 64", "variance-minimization"),
    ]
}

/// Builds a rig with a number of lights.
type Method<'a> = Box<dyn Fn(usize) -> Result<Rig, RigError> + 'a>;

/// The RMS shading errors of every method.
fn errors(context: &FigureContext) -> Result<Table, Error> {
    let environment = &context.environment;
    let reference = ShadingReference::new(environment);
    let mut table = Table::new(&[
        "method",
        "16 matte",
        "16 glossy",
        "64 matte",
        "64 glossy",
        "256 matte",
        "256 glossy",
    ]);
    let center = MedianCut { position: LightPosition::GeometricCenter, ..MedianCut::default() };
    let flat = MedianCut { scale_width: false, ..MedianCut::default() };
    let sphere = VarianceMinimization { lloyd_steps: 0, ..VarianceMinimization::default() };
    let methods: [(&str, Method); 6] = [
        ("median cut, geometric center", Box::new(move |n| median_cut(environment, n, center))),
        ("median cut", Box::new(|n| median_cut(environment, n, MedianCut::default()))),
        ("median cut, widths not scaled", Box::new(move |n| median_cut(environment, n, flat))),
        (
            "variance, poster",
            Box::new(|n| variance_minimization(environment, n, VarianceMinimization::poster())),
        ),
        (
            "variance, on the sphere",
            Box::new(move |n| variance_minimization(environment, n, sphere)),
        ),
        (
            "variance, refined",
            Box::new(|n| variance_minimization(environment, n, VarianceMinimization::default())),
        ),
    ];
    for (name, method) in &methods {
        let mut row = vec![(*name).into()];
        for n in [16, 64, 256] {
            let error = reference.error(&method(n)?);
            row.extend([error.diffuse, error.glossy].map(|e| (100.0 * e).into()));
        }
        table.rows.push(row);
    }
    Ok(table)
}

/// The surroundings of the map's brightest texel.
struct Detail<'a> {
    context: &'a FigureContext<'a>,
    /// The displayed part of the map, in [0, 1]².
    part: Rect,
    image: RgbImage,
}

impl<'a> Detail<'a> {
    /// The width of the part, relative to the map's.
    const WIDTH: f64 = 0.14;

    fn new(context: &'a FigureContext) -> Self {
        let map = context.environment.map();
        let uv = context.environment.uv(context.brightest());
        // A square of whole texels.
        let side = ((Self::WIDTH * map.width as f64) as usize).clamp(1, map.height);
        let corner = |at: f32, n: usize| {
            ((f64::from(at) * n as f64 - 0.5 * side as f64).max(0.0) as usize).min(n - side)
        };
        let (x0, y0) = (corner(uv.x, map.width), corner(uv.y, map.height));
        let (w, h) = (map.width as f64, map.height as f64);
        let part = Rect::new(x0 as f64 / w, y0 as f64 / h, side as f64 / w, side as f64 / h);
        let image = RgbImage::from_fn(side, side, |x, y| map.get(x0 + x, y0 + y));
        Self { context, part, image }
    }

    fn panel(&self, title: &str, rig: Option<&Rig>) -> Result<Document, Error> {
        let mut tone = self.context.map_tone();
        tone.exposure -= 3.0;
        let picture = Picture {
            png: png_bytes(&self.image, tone)?,
            width: 340.0,
            height: 340.0,
            pixels: Pixels::Sharp,
            title,
            notes: &[],
        };
        Ok(picture_panel(&picture, |sheet, r| {
            let Some(rig) = rig else { return };
            borders(sheet, r, rig, self.part);
            for light in &rig.lights {
                let uv = self.context.environment.uv(light.direction);
                let x = r.x + (f64::from(uv.x) - self.part.x) / self.part.width * r.width;
                let y = r.y + (f64::from(uv.y) - self.part.y) / self.part.height * r.height;
                mark(sheet, (x, y));
            }
        }))
    }
}
