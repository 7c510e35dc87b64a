//! The page: all figures of a run in the lecture's order, in one self-contained file.

use std::path::Path;

use crate::Error;
use crate::names::display_name;
use domelight::code;
use domelight::quote::{Code, Html, html};
use serde_json::Value;

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, count, number};
use crate::svg::{Document, data_uri, font_face_css};

/// A font for formulas, with the stretchy symbols that text fonts lack.
const MATH_FONT: &[u8] = include_bytes!("../../assets/math-subset.otf");

/// The file name of the page.
pub(crate) const NAME: &str = "index.html";

/// Writes the page.
pub(crate) fn write(
    context: &FigureContext,
    folder: &Path,
    figures: &[Figure],
) -> Result<(), Error> {
    context.host.write(&folder.join(NAME), page(context, figures).as_str().as_bytes())
}

fn page(context: &FigureContext, figures: &[Figure]) -> Code<Html> {
    let mut contents = Code::default();
    let mut sections = Code::default();
    for figure in figures {
        contents += code!(
            Html,
            "<li value=\"{n}\"><a href=\"#figure-{n}\">{title}</a></li>",
            n = figure.number,
            title = html::text(figure.title),
        );
        sections += section(context, figure);
    }
    let map = context.environment.map();
    let quick =
        context.choose("", " This is a quick run: pictures are small and references noisy.");
    code!(
        Html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>Sampling direct illumination</title>\n<style>{font}{math_font}{style}</style>\n</head>\n<body>\n\
         <header><h1>Sampling direct illumination</h1>\
         <p>The lecture’s figures for <b>{scene}</b> under <b>{probe}</b> ({width}×{height} texels), \
         computed by domelight {version}.{quick}</p>\
         <p class=\"command\"><code>domelight figures{arguments}</code></p></header>\n\
         <nav aria-label=\"Figures\"><h2>Figures</h2><ol>{contents}</ol></nav>\n<main>\n{sections}</main>\n</body>\n</html>\n",
        font = Code::<Html>::generated(font_face_css()),
        math_font = math_font_css(),
        style = STYLE,
        scene = html::text(&display_name(&context.scene)),
        probe = html::text(&display_name(&context.probe)),
        width = map.width,
        height = map.height,
        version = env!("CARGO_PKG_VERSION"),
        quick = quick,
        arguments = html::text(context.arguments.as_str()),
        contents = contents,
        sections = sections,
    )
}

fn math_font_css() -> Code<Html> {
    let source = data_uri("font/otf", MATH_FONT);
    let rule = format!("@font-face{{font-family:'Domelight Math';src:url({source})}}");
    Code::generated(rule)
}

fn section(context: &FigureContext, figure: &Figure) -> Code<Html> {
    let n = figure.number;
    let mut html = code!(
        Html,
        "<section id=\"figure-{n}\"><h2><span>Figure {n}</span> {title}</h2><p class=\"slides\">{slides}</p>{caption}",
        n = n,
        title = html::text(figure.title),
        slides = html::text(figure.slides),
        caption = figure.caption.clone(),
    );
    for formula in &figure.formulas {
        let formula = Code::<Html>::generated(formula.clone());
        html += code!(Html, "<div class=\"formula\">{formula}</div>", formula = formula);
    }
    figure.rows.iter().for_each(|row| html += panels(row));
    figure.tables.iter().for_each(|table| html += numbers(table));
    let link = |file: String| code!(Html, "<a href=\"{f}\">{f}</a>", f = html::text(&file));
    let files = Code::join(figure.files().into_iter().map(link), ", ");
    let more = if figure.pictures.is_empty() {
        Code::default()
    } else {
        code!(Html, "; radiance in <a href=\"figure-{n}/\">figure-{n}/</a> (OpenEXR, PNG)", n = n)
    };
    html += code!(
        Html,
        "<p class=\"command\"><code>domelight figures --only {n}{arguments}</code></p>\
         <p class=\"files\">{files}{more}</p></section>\n",
        n = n,
        arguments = html::text(context.arguments.as_str()),
        files = files,
        more = more,
    );
    html
}

fn panels(row: &Row) -> Code<Html> {
    let mut html = Code::default();
    if !row.heading.is_empty() {
        html += code!(Html, "<h3>{heading}</h3>", heading = html::text(&row.heading));
    }
    let widths = || row.panels.iter().map(Document::width);
    let columns: Vec<String> = widths().map(|w| format!("{w:.0}fr")).collect();
    // On a phone, two small panels fit side by side.
    let least = widths().fold(0.0, f64::max).min(480.0) * 0.68;
    html += code!(
        Html,
        "<div class=\"row\" style=\"--columns:{columns};--width:{width:.0}px;--least:{least:.0}px\">",
        columns = Code::<Html>::generated(columns.join(" ")),
        width = 1.25 * widths().sum::<f64>(),
        least = least,
    );
    for panel in &row.panels {
        let drawing = Code::<Html>::generated(panel.to_svg());
        html += code!(Html, "<figure>{drawing}</figure>", drawing = drawing);
    }
    html + "</div>"
}

fn cell(value: &Value) -> Code<Html> {
    match value {
        Value::Number(n) => {
            let text = n.as_u64().map_or_else(|| number(n.as_f64().unwrap_or(f64::NAN)), count);
            code!(Html, "<td class=\"n\">{number}</td>", number = html::text(&text))
        }
        Value::String(text) => code!(Html, "<td>{text}</td>", text = html::text(text)),
        _ => Code::literal("<td>–</td>"),
    }
}

fn numbers(table: &Table) -> Code<Html> {
    let mut body = Code::literal("<table><thead><tr>");
    for column in &table.columns {
        body += code!(Html, "<th>{column}</th>", column = html::text(column));
    }
    body += "</tr></thead><tbody>";
    for row in &table.rows {
        body += "<tr>";
        for value in row {
            body += cell(value);
        }
        body += "</tr>";
    }
    body += "</tbody></table>";
    // A long table would hide the next figure.
    if table.rows.len() > 14 {
        code!(
            Html,
            "<details><summary>All {n} measurements</summary><div class=\"table\">{body}</div></details>",
            n = table.rows.len(),
            body = body,
        )
    } else {
        code!(Html, "<div class=\"table\">{body}</div>", body = body)
    }
}

const STYLE: &str = "
:root{--paper:#fff;--ink:#1c1f24;--soft:#5b636e;--line:#dfe3e8;--card:#f5f6f8;--link:#0061a8}
@media(prefers-color-scheme:dark){:root{--paper:#15171b;--ink:#e8eaed;--soft:#a3abb6;--line:#333941;--card:#1f2329;--link:#7cc0f5}}
*{box-sizing:border-box}
html{scroll-behavior:smooth;-webkit-text-size-adjust:100%}
body{margin:0 auto;max-width:1560px;padding:1.5rem clamp(.8rem,3vw,3rem) 4rem;background:var(--paper);color:var(--ink);font:1.06rem/1.6 Inter,system-ui,sans-serif}
h1{font-size:clamp(1.7rem,4vw,2.6rem);line-height:1.15;margin:.5rem 0}
h2{font-size:clamp(1.35rem,3vw,1.9rem);line-height:1.25;margin:0 0 .2rem}
h2 span{color:var(--soft);font-weight:400}
h3{font-size:1.12rem;margin:1.6rem 0 .5rem}
a{color:var(--link)}
header p,section>p{max-width:75ch}
nav{background:var(--card);border-radius:.6rem;padding:1rem 1.4rem;margin:1.5rem 0}
nav h2{font-size:1.1rem}
nav ol{columns:2 22rem;margin:.4rem 0 0;padding-left:1.5rem}
section{border-top:1px solid var(--line);margin-top:3rem;padding-top:2rem}
.slides,.files{color:var(--soft);font-size:.95rem;margin:.1rem 0 .8rem}
.formula{overflow-x:auto;overflow-y:hidden;padding:.5rem .2rem;font-size:1.15rem}
math{font-family:'Domelight Math',math,serif}
.row{display:grid;grid-template-columns:var(--columns);max-width:var(--width);gap:.9rem;align-items:start}
figure{margin:0;min-width:0;background:#fff;border-radius:.5rem;padding:.7rem;box-shadow:0 0 0 1px var(--line)}
figure svg{display:block;width:100%;height:auto}
.table{overflow-x:auto;margin:1.2rem 0}
table{border-collapse:collapse;font-size:.97rem}
th,td{padding:.35rem .9rem .35rem 0;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
th{color:var(--soft);font-weight:400}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
summary{cursor:pointer;color:var(--link);margin:1rem 0}
.command code{display:inline-block;max-width:100%;overflow-x:auto;background:var(--card);border-radius:.4rem;padding:.45rem .8rem;font:.95rem/1.4 ui-monospace,Menlo,Consolas,monospace;white-space:nowrap}
@media(max-width:800px){.row{grid-template-columns:repeat(auto-fill,minmax(min(100%,var(--least)),1fr));max-width:none}figure{padding:.45rem}}
@media print{figure{break-inside:avoid}}
";
