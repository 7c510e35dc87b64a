//! "Did you mean": suggests the known name closest to a misspelled one.

use std::error::Error;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use domelight::bsdf::{MaterialSpec, ParseMaterialError};
use domelight::environment::builtin::BuiltinProbe;
use domelight::scene::builtin::BuiltinScene;
use domelight::strategy::{StrategyError, StrategyKind, StrategyParameter};

/// The minimum similarity of names, in [0, 1], as in clap for options.
const ALIKE: f64 = 0.7;

/// The name most similar to `text`, if any is similar enough.
pub(crate) fn nearest<'a>(text: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let text = text.to_lowercase();
    let alike = names.into_iter().map(|name| (strsim::jaro(&text, name), name));
    let best = alike.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(likeness, _)| *likeness > ALIKE).map(|(_, name)| name)
}

/// The built-in scene that a file that is not there may have meant.
pub(crate) fn scene(path: &Path) -> Option<&'static str> {
    builtin(path, BuiltinScene::ALL.map(BuiltinScene::name))
}

/// The built-in probe that a file that is not there may have meant.
pub(crate) fn probe(path: &Path) -> Option<&'static str> {
    builtin(path, BuiltinProbe::ALL.map(BuiltinProbe::name))
}

/// A name with a folder or an extension is meant as a file.
fn builtin<const N: usize>(path: &Path, names: [&'static str; N]) -> Option<&'static str> {
    let is_file = path.extension().is_some() || path.components().count() != 1;
    path.to_str().filter(|_| !is_file).and_then(|text| nearest(text, names))
}

/// Adds what was meant to an error in the command line, where clap does not know it: the name of a strategy or material,
/// or the text of a strategy in place of an option.
pub(crate) fn add_to(error: &mut clap::Error) {
    if let Some(ContextValue::String(option)) = error.get(ContextKind::InvalidArg)
        && error.kind() == ErrorKind::UnknownArgument
        && let Some(name) = option.strip_prefix("--")
        && let Some(parameter) = parameters().find(|parameter| parameter.name == name)
    {
        let notation = parameter.notation();
        let text = format!("{name} belongs to the strategy's text: --strategy NAME:{notation}");
        error.remove(ContextKind::SuggestedArg);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![text.into()]));
        return;
    }
    let Some(source) = error.source() else { return };
    let meant = match (source.downcast_ref(), source.downcast_ref()) {
        (Some(StrategyError::UnknownName(name)), _) => {
            let names = StrategyKind::ALL.iter().flat_map(|kind| {
                std::iter::once(kind.name()).chain(kind.aliases().iter().copied())
            });
            nearest(name, names)
        }
        (_, Some(ParseMaterialError::Model { model })) => nearest(model, MaterialSpec::MODELS),
        _ => None,
    };
    if let Some(name) = meant {
        let value = ContextValue::Strings(vec![name.to_owned()]);
        error.insert(ContextKind::SuggestedValue, value);
    }
}

/// The parameters of all strategies.
fn parameters() -> impl Iterator<Item = &'static StrategyParameter> {
    StrategyKind::ALL.into_iter().flat_map(|kind| kind.declaration().parameters)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_alike_is_suggested_and_nothing_else() {
        assert_eq!(scene(Path::new("statu")), Some("statue"));
        assert_eq!(scene(Path::new("matrial-ball")), Some("material-ball"));
        assert_eq!(probe(Path::new("Cathedrel")), Some("cathedral"));
        for file in ["statu.ply", "models/statu", "vehicle", ""] {
            assert_eq!(scene(Path::new(file)), None, "{file}");
        }
        assert_eq!(nearest("enviroment", ["brdf", "environment"]), Some("environment"));
    }
}
