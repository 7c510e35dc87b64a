//! The report as one page of HTML that needs nothing else.

use anyhow::Result;
use domelight::RgbImage;
use domelight::picture::compare::ColorScale;
use serde_json::json;

use super::Picture;
use super::pixels;
use super::plots::{Cost, convergence};
use super::report::CompareReport;
use crate::svg::{PALETTE, escape, font_face_css};

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The whole page.
pub(super) fn html(
    report: &CompareReport,
    pictures: &[Option<Picture>],
    reference: &RgbImage,
) -> Result<String> {
    let width = reference.width;
    let entries = pictures.iter().map(|picture| {
        let Some(Picture { image, relative_error, flip }) = picture else { return Ok(None) };
        Ok(Some(json!({
            "radiance": pixels::radiance(image)?,
            "relative": pixels::relative_errors(relative_error, width)?,
            "flip": pixels::unit(flip, width)?,
        })))
    });
    let (low, high) = pixels::RELATIVE_ERRORS;
    let data = json!({
        "report": report,
        "pictures": entries.collect::<Result<Vec<_>>>()?,
        "reference": pixels::radiance(reference)?,
        "relativeErrors": [low, high],
        "viridis": pixels::colors(ColorScale::Viridis),
        "magma": pixels::colors(ColorScale::Magma),
        "palette": PALETTE.map(|color| color.to_string()),
    });
    let title = format!("{} under {}", report.scene.scene, report.scene.environment.probe());
    Ok(fill(
        TEMPLATE,
        &[
            ("title", &escape(&title)),
            ("style", &format!("{}\n{STYLE}", font_face_css())),
            ("over-rays", &convergence(report, Cost::Rays)),
            ("over-time", &convergence(report, Cost::Seconds)),
            ("command", &escape(&report.command)),
            ("version", report.version),
            ("data", &in_script(&serde_json::to_string(&data)?)),
            ("script", SCRIPT),
        ],
    ))
}

/// JSON that cannot end the script element that it stands in, nor begin a comment there.
fn in_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// The template with each `{{name}}` replaced; what is filled in is not looked at again.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut parts = template.split("{{");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or((part, ""));
        let value = values.iter().find(|(n, _)| *n == name).map_or("", |(_, value)| value);
        page.push_str(value);
        page.push_str(rest);
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_cannot_leave_its_script() {
        let hostile = json!({ "scene": "</script><script>alert(1)</script><!--" }).to_string();
        let safe = in_script(&hostile);
        assert!(!safe.contains('<'));
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&safe).ok(),
            serde_json::from_str(&hostile).ok()
        );
    }

    #[test]
    fn templates_are_filled_once() {
        let filled = fill("a {{x}} b {{y}}{{x}}", &[("x", "{{y}}"), ("y", "2")]);
        assert_eq!(filled, "a {{y}} b 2{{y}}");
    }

    #[test]
    fn the_template_has_no_unknown_places() {
        let names =
            ["title", "style", "over-rays", "over-time", "command", "version", "data", "script"];
        for place in TEMPLATE.split("{{").skip(1).filter_map(|p| p.split_once("}}")) {
            assert!(names.contains(&place.0), "{}", place.0);
        }
    }
}
