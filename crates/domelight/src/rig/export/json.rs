//! domelight's own format: JSON that `docs/rig.schema.json` describes.

use serde::Serialize;

use super::RigExport;
use crate::rig::RigLight;

/// The version of the format; it grows when a reader of an older version would be wrong.
pub const VERSION: u32 = 1;

#[derive(Serialize)]
struct File<'a> {
    format: &'static str,
    version: u32,
    probe: &'a str,
    orientation: Orientation,
    lights: Vec<Light>,
    dome: Option<Dome<'a>>,
}

#[derive(Serialize)]
struct Orientation {
    up: &'static str,
    rotation: f32,
}

#[derive(Serialize)]
struct Light {
    name: String,
    kind: &'static str,
    direction: [f32; 3],
    irradiance: [f32; 3],
    angular_radius: f32,
    share: f32,
    solid_angle: f32,
}

#[derive(Serialize)]
struct Dome<'a> {
    file: Option<&'a str>,
    spherical_harmonics: [[f32; 3]; 9],
}

pub(super) fn encode(rig: &RigExport) -> String {
    let file = File {
        format: "domelight-rig",
        version: VERSION,
        probe: rig.probe,
        orientation: Orientation {
            up: rig.orientation.up.name(),
            rotation: rig.orientation.rotation,
        },
        lights: rig.lights.iter().zip(rig.names()).map(|(l, name)| Light::new(l, name)).collect(),
        dome: rig.dome.map(|dome| Dome {
            file: dome.file,
            spherical_harmonics: dome.harmonics.coefficients.map(crate::Rgb::to_array),
        }),
    };
    let mut text = serde_json::to_string_pretty(&file).expect("strings and numbers");
    text.push('\n');
    text
}

impl Light {
    fn new(light: &RigLight, name: String) -> Self {
        Self {
            name,
            kind: light.region.kind(),
            direction: light.direction.to_array(),
            irradiance: light.irradiance.to_array(),
            angular_radius: light.angular_radius,
            share: light.share,
            solid_angle: light.solid_angle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;
    use serde_json::Value;

    fn schema() -> Value {
        serde_json::from_str(include_str!("../../../../../docs/rig.schema.json")).unwrap()
    }

    /// The places of `value` that `rule`, a part of `schema`, refuses. Panics on a keyword that it does not know.
    fn errors(schema: &Value, rule: &Value, value: &Value, place: &str) -> Vec<String> {
        let mut found = Vec::new();
        for (keyword, operand) in rule.as_object().unwrap() {
            let inner = |rule: &Value, value: &Value, key: &str| {
                errors(schema, rule, value, &format!("{place}/{key}"))
            };
            let items = || value.as_array().into_iter().flatten().enumerate();
            let entries = || value.as_object().into_iter().flatten();
            let valid = match keyword.as_str() {
                "$schema" | "$defs" | "title" | "description" => true,
                "$ref" => {
                    let target = operand.as_str().unwrap().strip_prefix('#').unwrap();
                    found.extend(errors(schema, schema.pointer(target).unwrap(), value, place));
                    true
                }
                "type" => match operand {
                    Value::Array(types) => types.iter().any(|name| is_of_type(value, name)),
                    name => is_of_type(value, name),
                },
                "const" => value == operand,
                "enum" => operand.as_array().unwrap().contains(value),
                "minimum" => {
                    value.as_f64().is_none_or(|number| number >= operand.as_f64().unwrap())
                }
                "maximum" => {
                    value.as_f64().is_none_or(|number| number <= operand.as_f64().unwrap())
                }
                "minItems" => value
                    .as_array()
                    .is_none_or(|array| array.len() as u64 >= operand.as_u64().unwrap()),
                "maxItems" => value
                    .as_array()
                    .is_none_or(|array| array.len() as u64 <= operand.as_u64().unwrap()),
                "items" => {
                    found
                        .extend(items().flat_map(|(i, item)| inner(operand, item, &i.to_string())));
                    true
                }
                "required" => operand
                    .as_array()
                    .unwrap()
                    .iter()
                    .all(|key| value.get(key.as_str().unwrap()).is_some()),
                "properties" => {
                    let known = |(key, value)| Some((operand.get(key)?, value, key));
                    found.extend(
                        entries()
                            .filter_map(known)
                            .flat_map(|(rule, value, key)| inner(rule, value, key)),
                    );
                    true
                }
                "additionalProperties" => {
                    assert_eq!(operand, false);
                    entries().all(|(key, _)| rule["properties"].get(key).is_some())
                }
                "oneOf" => {
                    let fits = |rule: &&Value| errors(schema, rule, value, place).is_empty();
                    operand.as_array().unwrap().iter().filter(fits).count() == 1
                }
                _ => panic!("the schema has a keyword that this test does not know: {keyword}"),
            };
            if !valid {
                found.push(format!("{place}: {keyword}"));
            }
        }
        found
    }

    fn is_of_type(value: &Value, name: &Value) -> bool {
        match name.as_str().unwrap() {
            "null" => value.is_null(),
            "string" => value.is_string(),
            "number" => value.is_number(),
            "array" => value.is_array(),
            "object" => value.is_object(),
            name => panic!("the schema has a type that this test does not know: {name}"),
        }
    }

    #[test]
    fn a_rig_is_valid_by_the_schema() {
        with_example(|rig| {
            for rig in [*rig, RigExport { dome: None, ..*rig }] {
                let json: Value = serde_json::from_str(&encode(&rig)).unwrap();
                let errors = errors(&schema(), &schema(), &json, "");
                assert!(errors.is_empty(), "{errors:?}");
                assert_eq!(json["lights"].as_array().unwrap().len(), rig.lights.len());
                assert_eq!(json["lights"][0]["kind"], "sun");
                assert_eq!(json["dome"].is_null(), rig.dome.is_none());
            }
        });
    }

    #[test]
    fn the_schema_refuses_what_is_wrong() {
        with_example(|rig| {
            let valid: Value = serde_json::from_str(&encode(rig)).unwrap();
            let refused = |change: fn(&mut Value)| {
                let mut json = valid.clone();
                change(&mut json);
                !errors(&schema(), &schema(), &json, "").is_empty()
            };
            assert!(refused(|json| json["version"] = 2.into()));
            assert!(refused(|json| json["lights"][0]["share"] = 1.5.into()));
            assert!(refused(|json| json["lights"][0]["irradiance"][1] = (-1.0).into()));
            assert!(refused(|json| json["lights"][1]["color"] = "red".into()));
            assert!(refused(|json| json["orientation"]["up"] = "x".into()));
            assert!(refused(|json| drop(json.as_object_mut().unwrap().remove("dome"))));
        });
    }

    #[test]
    fn numbers_keep_their_single_precision() {
        with_example(|rig| {
            let json: Value = serde_json::from_str(&encode(rig)).unwrap();
            for (light, json) in rig.lights.iter().zip(json["lights"].as_array().unwrap()) {
                let read = |i: usize| json["direction"][i].as_f64().unwrap() as f32;
                assert_eq!([read(0), read(1), read(2)], light.direction.to_array());
            }
        });
    }
}
