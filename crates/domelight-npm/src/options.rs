//! Options of calls, as JSON.

use std::fmt::Display;
use std::str::FromStr;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use wasm_bindgen::prelude::*;

/// Reads the options of the call `of`, each of which has a default.
pub(crate) fn parse<T: DeserializeOwned>(of: &str, json: &str) -> Result<T, JsError> {
    let failed = |text: String| JsError::new(&format!("{of}: {text}"));
    let options: Map<String, Value> =
        serde_json::from_str(json).map_err(|e| failed(e.to_string()))?;
    // One after the other, so that the message names it.
    for (name, value) in &options {
        let alone = Map::from_iter([(name.clone(), value.clone())]);
        serde_json::from_value::<T>(Value::Object(alone))
            .map_err(|e| failed(format!("option {name}: {e}")))?;
    }
    serde_json::from_value(Value::Object(options)).map_err(|e| failed(e.to_string()))
}

/// The value of a name that the option `option` of the call `of` has.
pub(crate) fn named<T: FromStr<Err: Display>>(
    of: &str,
    option: &str,
    name: &str,
) -> Result<T, JsError> {
    name.parse().map_err(|e| JsError::new(&format!("{of}: option {option}: {e}")))
}

/// Writes a result.
pub(crate) fn to_json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
