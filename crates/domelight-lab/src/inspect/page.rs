//! The pixel X-ray as one page of HTML.

use domelight::inspect::{Decomposition, DirectionHistogram, Hemisphere, Share};
use domelight::picture::compare::ColorScale;
use domelight::picture::png::{self, Depth};
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::quote::{Code, Html, html};
use domelight::{Rgb, RgbImage, code};

use super::{Inspection, InspectionReport, StrategyReport};
use crate::Error;
use crate::page::{STYLE as PAGE_STYLE, fill};
use crate::svg::{Color, Document, Pixels, Rect, Style, data_uri, font_face_css};

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");

/// Powers of ten that the scale of densities spans.
const DECADES: f32 = 6.0;
/// Causes that a list shows.
const SHOWN_CAUSES: usize = 5;
/// The edge of a drawing of a map, and the diameter of the disk in it \[pixels\].
const SIDE: f64 = 256.0;

/// The whole page.
pub(super) fn page(inspection: &Inspection) -> Result<Code<Html>, Error> {
    let report = inspection.report();
    let [x, y] = report.pixel.pixel;
    let title = format!("Pixel {x}, {y} of {}", report.scene.title());
    let lead = lead(&report);
    let (maps, densities) = match &inspection.hemisphere {
        None => {
            let nothing = Code::literal("<p>The pixel shows nothing of the scene.</p>");
            (nothing.clone(), nothing)
        }
        Some(hemisphere) => {
            let all = inspection.strategies.iter();
            let directions = all.filter_map(|s| Some((&s.decomposition, s.directions.as_ref()?)));
            pictures(hemisphere, &directions.collect::<Vec<_>>())?
        }
    };
    Ok(fill(
        TEMPLATE,
        &[
            ("title", html::text(&title)),
            ("style", Code::generated(format!("{}\n{PAGE_STYLE}\n{STYLE}", font_face_css()))),
            ("lead", html::text(&lead)),
            ("causes", causes(&report)),
            ("table", table(&report)),
            ("maps", maps),
            ("densities", densities),
            ("sources", sources(&report)),
            ("settings", settings(&report)),
            ("command", html::text(report.command)),
            ("version", html::text(report.version)),
        ],
    ))
}

/// What would help, and whether the pixel is in a room, as sentences.
fn lead(report: &InspectionReport) -> String {
    let mut text = report.advice_text.clone();
    if let Some(first) = text.get(..1).map(str::to_uppercase) {
        // A strategy keeps its name as it is typed.
        let is_name = report.strategies.iter().any(|s| text.starts_with(&s.decomposition.name));
        if !is_name {
            text.replace_range(..1, &first);
        }
    }
    match &report.enclosure {
        Some(enclosure) => format!("{text}. {enclosure}."),
        None => text + ".",
    }
}

fn causes(report: &InspectionReport) -> Code<Html> {
    let mut all = Code::default();
    for StrategyReport { decomposition, diagnosis, .. } in &report.strategies {
        let mut list = Code::default();
        let percent = |share: f64| number(format!("{:.1}", (1000.0 * share).round() / 10.0 + 0.0));
        for Share { cause, share } in decomposition.shares.iter().take(SHOWN_CAUSES) {
            list += code!(
                Html,
                "<li><span>{cause}</span><span class=\"bar\"><i{class} style=\"width:{width}%\"></i></span>\
                 <span class=\"share\">{share} %</span></li>",
                cause = html::text(&cause.to_string()),
                class = if cause.is_between_samples() { " class=\"between\"" } else { "" },
                width = (100.0 * share.clamp(0.0, 1.0)).round(),
                share = percent(*share),
            );
        }
        let others: f64 = decomposition.shares.iter().skip(SHOWN_CAUSES).map(|s| s.share).sum();
        if others.abs() >= 5e-4 {
            list += code!(
                Html,
                "<li><span>other causes</span><span class=\"bar\"><i style=\"width:{width}%\"></i></span>\
                 <span class=\"share\">{share} %</span></li>",
                width = (100.0 * others.clamp(0.0, 1.0)).round(),
                share = percent(others),
            );
        }
        all += code!(
            Html,
            "<article><h3>{name}</h3><p>{why}.</p><ol>{list}</ol></article>",
            name = html::text(&decomposition.name),
            why = html::text(diagnosis),
            list = list,
        );
    }
    all
}

fn table(report: &InspectionReport) -> Code<Html> {
    let unbiased = report.strategies.iter().filter(|s| s.decomposition.unbiased);
    let least = unbiased.map(|s| s.variance_per_ray).fold(f64::INFINITY, f64::min);
    let mut rows = Code::default();
    for StrategyReport { decomposition: d, variance_per_ray, .. } in &report.strategies {
        let ratio = if least > 0.0 && d.unbiased { variance_per_ray / least } else { f64::NAN };
        rows += code!(
            Html,
            "<tr><th scope=\"row\">{name}{biased}</th><td>{mean}</td><td>{variance}</td><td>{rays}</td>\
             <td{best}>{per_ray}</td><td>{ratio}</td></tr>",
            name = html::text(&d.name),
            biased = if d.unbiased { "" } else { ", biased" },
            mean = number(format!("{:.4}", d.mean)),
            variance = number(format!("{:.2e}", d.variance)),
            rays = number(format!("{:.2}", d.rays_per_sample)),
            best = if d.unbiased && *variance_per_ray <= least { " class=\"best\"" } else { "" },
            per_ray = number(format!("{variance_per_ray:.2e}")),
            ratio = number(match ratio {
                _ if !ratio.is_finite() => "–".to_owned(),
                ..1000.0 => format!("{ratio:.1}"),
                _ => format!("{ratio:.1e}"),
            }),
        );
    }
    code!(
        Html,
        "<table><thead><tr><th scope=\"col\">Strategy</th><th scope=\"col\">Luminance</th>\
         <th scope=\"col\">Variance per<br>camera sample</th><th scope=\"col\">Rays per<br>camera sample</th>\
         <th scope=\"col\">Variance<br>per ray</th><th scope=\"col\">÷ the best</th></tr></thead>\
         <tbody>{rows}</tbody></table>",
        rows = rows,
    )
}

fn sources(report: &InspectionReport) -> Code<Html> {
    let mut rows = Code::default();
    for StrategyReport { decomposition, .. } in &report.strategies {
        for s in &decomposition.sources {
            let percent = |share: f64| number(format!("{:.1} %", 100.0 * share));
            rows += code!(
                Html,
                "<tr><th scope=\"row\">{name}</th><td class=\"words\">{source}</td><td>{light}</td><td>{rays}</td>\
                 <td>{free}</td><td>{seen}</td></tr>",
                name = html::text(&decomposition.name),
                source = html::text(&s.source.kind.to_string()),
                light = percent(s.light),
                rays = percent(s.rays),
                free = s.free.map_or_else(|| number("–".to_owned()), percent),
                seen = percent(s.seen),
            );
        }
    }
    code!(
        Html,
        "<table><thead><tr><th scope=\"col\">Strategy</th><th scope=\"col\" class=\"words\">Source</th>\
         <th scope=\"col\">Share of<br>the light</th><th scope=\"col\">Share of<br>the rays</th>\
         <th scope=\"col\">Rays<br>unoccluded</th><th scope=\"col\">Hits that<br>it reaches</th></tr></thead>\
         <tbody>{rows}</tbody></table>",
        rows = rows,
    )
}

fn settings(report: &InspectionReport) -> Code<Html> {
    let mut entries = Code::default();
    for StrategyReport { settings, decomposition, .. } in &report.strategies {
        entries += code!(
            Html,
            "<dt>{name}</dt><dd>{settings}</dd>",
            name = html::text(&decomposition.name),
            settings = html::text(settings),
        );
    }
    let point = |v: Option<[f32; 3]>| {
        v.map_or("–".to_owned(), |[x, y, z]| format!("{x:.3}, {y:.3}, {z:.3}"))
    };
    code!(
        Html,
        "<dl>{entries}<dt>Scene fills</dt><dd>{coverage} % of the pixel</dd><dt>Position</dt><dd>{position}</dd>\
         <dt>Normal</dt><dd>{normal}</dd><dt>Reflectance</dt><dd>{albedo}</dd></dl>",
        entries = entries,
        coverage = (100.0 * report.pixel.coverage).round(),
        position = html::text(&point(report.pixel.position)),
        normal = html::text(&point(report.pixel.normal)),
        albedo = html::text(&point(report.pixel.albedo)),
    )
}

/// The maps of light, reflectance, visibility and their product; those of the strategies' densities.
fn pictures(
    hemisphere: &Hemisphere,
    directions: &[(&Decomposition, &DirectionHistogram)],
) -> Result<(Code<Html>, Code<Html>), Error> {
    let n = hemisphere.resolution;
    let solid_angle = 8.0 / (n * n) as f32;
    let product: Vec<f32> = hemisphere.product.iter().map(|c| c.luminance()).collect();
    let total: f32 = product.iter().sum::<f32>() * solid_angle;
    let ideal: Vec<f32> =
        product.iter().map(|p| if total > 0.0 { p / total } else { 0.0 }).collect();
    let densities = directions.iter().flat_map(|(_, d)| &d.density);
    let most = densities.chain(&ideal).copied().fold(0.0, f32::max);
    let most = if most > 0.0 { most } else { 1.0 };

    let light = tone_mapped(n, &hemisphere.radiance)?;
    let lobe: Vec<f32> = hemisphere.bsdf_cos.iter().map(|c| c.luminance()).collect();
    let lobe_most = lobe.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let free: Vec<Rgb> = hemisphere.visibility.iter().map(|&v| Rgb::splat(v * v)).collect();
    let mut maps = Code::default();
    let nothing = |_: &mut Document| {};
    maps += figure("Light L", "tone mapped", &light, nothing);
    maps += figure(
        "Reflectance f·cos θ",
        "relative to its peak",
        &scaled(n, &lobe, lobe_most)?,
        nothing,
    );
    maps += figure("Visibility V", "black is hidden", &plain(n, &free)?, nothing);
    let text = "the density of a perfect strategy, up to a factor";
    maps += figure("Product f·cos θ·L·V", text, &scaled(n, &ideal, most)?, nothing);
    let maps = code!(
        Html,
        "<div class=\"maps\">{maps}</div><p class=\"hint\">Seen from above: the shading normal in the middle, the \
         horizon on the circle; every pixel has the same solid angle.</p>",
        maps = maps,
    );

    let mut figures = Code::default();
    for (decomposition, directions) in directions {
        let n_rays = directions.n_rays;
        let text = format!("density of {n_rays} rays; dots are some of them");
        let picture = scaled(directions.resolution, &directions.density, most)?;
        figures += figure(&decomposition.name, &text, &picture, |sheet| {
            for sample in &directions.samples {
                let [x, y] = sample.place.map(f64::from);
                let at = (SIDE * (0.5 + 0.5 * x), SIDE * (0.5 - 0.5 * y));
                let is_free = sample.visibility > 0.0;
                let inside = if is_free { Color(255, 255, 255) } else { Color(230, 85, 13) };
                let style = Style::fill(inside).outlined(Color(0, 0, 0), 0.5);
                sheet.circle(at, 1.6, style);
            }
        });
    }
    let strip: Vec<Rgb> = (0..256).map(|i| ColorScale::Viridis.color(i as f32 / 255.0)).collect();
    let scale = code!(
        Html,
        "<div class=\"scale\"><img alt=\"\" src=\"{strip}\"><div><span>{low} sr⁻¹</span><span>{high} sr⁻¹</span></div></div>",
        strip = Code::<Html>::generated(data_uri("image/png", &encode(256, 1, &strip)?)),
        low = number(short(most * 10f32.powf(-DECADES))),
        high = number(short(most)),
    );
    let densities = code!(
        Html,
        "<div class=\"maps\">{figures}</div>{scale}<p class=\"hint\">White dots reach the light, orange ones are \
         hidden. The closer a density is to the product above, the less its rays differ. Scales are logarithmic.</p>",
        figures = figures,
        scale = scale,
    );
    Ok((maps, densities))
}

/// A map in its circle, and what `over` draws on it.
fn figure(name: &str, text: &str, png: &[u8], over: impl FnOnce(&mut Document)) -> Code<Html> {
    let mut sheet = Document::new(SIDE, SIDE);
    sheet.image(Rect::new(0.0, 0.0, SIDE, SIDE), png, Pixels::Smooth);
    over(&mut sheet);
    let rim = Style::stroke(Color(0x80, 0x80, 0x80), 1.0);
    sheet.circle((0.5 * SIDE, 0.5 * SIDE), 0.5 * SIDE - 0.5, rim);
    code!(
        Html,
        "<figure>{drawing}<figcaption><b>{name}</b><span>{text}</span></figcaption></figure>",
        drawing = Code::<Html>::generated(sheet.to_svg()),
        name = html::text(name),
        text = html::text(text),
    )
}

/// Values on a logarithmic scale that ends at `most`.
fn scaled(n: usize, values: &[f32], most: f32) -> Result<Vec<u8>, Error> {
    let place = |value: f32| 1.0 + (value / most).log10() / DECADES;
    let color = |&value: &f32| ColorScale::Viridis.color(place(value.max(1e-30)));
    plain(n, &values.iter().map(color).collect::<Vec<_>>())
}

/// Radiance, its geometric mean below middle gray.
fn tone_mapped(n: usize, radiance: &[Rgb]) -> Result<Vec<u8>, Error> {
    let lit = radiance.iter().map(|c| c.luminance()).filter(|&y| y > 0.0);
    let (sum, count) = lit.fold((0.0, 0.0f32), |(sum, n), y| (sum + y.ln(), n + 1.0));
    let exposure = (0.12f32 / (sum / count.max(1.0)).exp()).log2().clamp(-30.0, 30.0);
    let tone = ToneMapping { exposure, curve: ToneCurve::Agx };
    disk_png(n, radiance, &tone)
}

/// Colors as they are.
fn plain(n: usize, colors: &[Rgb]) -> Result<Vec<u8>, Error> {
    disk_png(n, colors, &ToneMapping { exposure: 0.0, curve: ToneCurve::Standard })
}

/// A square picture of which the disk is shown.
fn disk_png(n: usize, colors: &[Rgb], tone: &ToneMapping) -> Result<Vec<u8>, Error> {
    let inside = |i: usize| {
        let [x, y] = [i % n, i / n].map(|c| (2 * c + 1) as f32 / n as f32 - 1.0);
        if x * x + y * y < 1.0 { 1.0 } else { 0.0 }
    };
    let alpha: Vec<f32> = (0..n * n).map(inside).collect();
    let image = RgbImage::new(n, n, colors.to_vec());
    let mut bytes = Vec::new();
    png::encode(&image, Some(&alpha), tone, Depth::Eight, &mut bytes)?;
    Ok(bytes)
}

fn encode(width: usize, height: usize, colors: &[Rgb]) -> Result<Vec<u8>, Error> {
    let tone = ToneMapping { exposure: 0.0, curve: ToneCurve::Standard };
    let image = RgbImage::new(width, height, colors.to_vec());
    let mut bytes = Vec::new();
    png::encode(&image, None, &tone, Depth::Eight, &mut bytes)?;
    Ok(bytes)
}

fn short(value: f32) -> String {
    if (0.01..1000.0).contains(&value) { format!("{value:.2}") } else { format!("{value:.1e}") }
}

fn number(text: String) -> Code<Html> {
    Code::generated(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_has_no_unknown_places() {
        let names = [
            "title",
            "style",
            "lead",
            "causes",
            "table",
            "maps",
            "densities",
            "sources",
            "settings",
            "command",
            "version",
        ];
        for place in TEMPLATE.split("{{").skip(1).filter_map(|p| p.split_once("}}")) {
            assert!(names.contains(&place.0), "{}", place.0);
        }
    }
}
