//! What pages of HTML share.

use domelight::quote::{Code, Html};

/// Colors, text, tables.
pub(crate) const STYLE: &str = include_str!("page.css");

/// The template with each `{{name}}` replaced; what is filled in is not looked at again.
pub(crate) fn fill(template: &'static str, values: &[(&str, Code<Html>)]) -> Code<Html> {
    let mut parts = template.split("{{");
    let mut page = Code::literal(parts.next().unwrap_or_default());
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or((part, ""));
        if let Some((_, value)) = values.iter().find(|(n, _)| *n == name) {
            page += value;
        }
        page += rest;
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;
    use domelight::quote::html;

    #[test]
    fn templates_are_filled_once() {
        let values = [("x", html::text("{{y}}")), ("y", html::text("2"))];
        assert_eq!(fill("a {{x}} b {{y}}{{x}}", &values).as_str(), "a {{y}} b 2{{y}}");
    }
}
