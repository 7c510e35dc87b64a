//! The list of calls, and the calls of messages.

use serde_json::Value;

use crate::error::refused;
use crate::session::MAX_SIZE;
use crate::{Engine, Error, MapView};

/// Passes the list of the calls that the page makes to a macro: the name in JavaScript, and the method of
/// [`Engine`](crate::Engine) with its arguments and its result.
#[macro_export]
macro_rules! for_each_call {
    ($macro:ident) => {
        $macro! {
            addFile = add_file(path: &str, bytes: Vec<u8>) -> ();
            clearFiles = clear_files() -> ();
            loadScene = load_scene(settings: &str) -> Result<String, Error>;
            loadEnvironment = load_environment(settings: &str) -> Result<String, Error>;
            smallerMaps = smaller_maps(probe: &str) -> String;
            turnEnvironment = turn_environment(degrees: f32) -> Result<(), Error>;
            automaticExposure = automatic_exposure(settings: &str) -> Result<f32, Error>;
            part = part() -> Result<Vec<u8>, Error>;
            addPart = add_part(part: &[u8]) -> Result<(), Error>;
            exr = exr(making: &str) -> Result<Vec<u8>, Error>;
            png = png(exposure: f32, curve: &str) -> Result<Vec<u8>, Error>;
            map = map(width: usize) -> Result<Vec<f32>, Error>;
            mapView = map_view(mapping: &str, rotate: f32, width: usize) -> Result<MapView, Error>;
            placesOf = places_of(mapping: &str, rotate: f32, places: &[f32]) -> Result<Vec<f32>, Error>;
            importance = importance(pixel: &str, mapping: &str, width: usize) -> Result<MapView, Error>;
            rayDensity = ray_density(pixel: &str, strategy: &str, mapping: &str, width: usize) -> Result<MapView, Error>;
            materialAt = material_at(pixel: &str) -> Result<Option<u32>, Error>;
            point = point(pixel: &str) -> Result<String, Error>;
            samples = samples(pixel: &str, strategy: &str, mapping: &str, n: usize, seed: u32) -> Result<Vec<f32>, Error>;
            directionAt = direction_at(pixel: &str, from: &str, a: f32, b: f32, mapping: &str) -> Result<Vec<f32>, Error>;
            rowProbabilities = row_probabilities(width: usize, row: usize, weighted: bool) -> Result<String, Error>;
            mapSamples = map_samples(n: usize, seed: u32) -> Result<String, Error>;
            inspect = inspect(settings: &str) -> Result<String, Error>;
            hemisphere = hemisphere(settings: &str, resolution: usize) -> Result<Vec<f32>, Error>;
            lobeSection = lobe_section(material: &str, theta_o: f32, n: usize) -> Result<Vec<f32>, Error>;
            lobeSamples = lobe_samples(material: &str, theta_o: f32, n: usize, seed: u32) -> Result<Vec<f32>, Error>;
            lights = lights(settings: &str) -> Result<String, Error>;
            regions = regions(settings: &str, width: usize) -> Result<Vec<u32>, Error>;
            rigFile = rig_file(settings: &str, format: &str, probe: &str) -> Result<Vec<u8>, Error>;
            domeFile = dome_file(settings: &str, name: &str) -> Result<Vec<u8>, Error>;
            spheres = spheres(settings: &str, size: usize, exponent: i32) -> Result<Vec<f32>, Error>;
            targets = targets() -> String;
            prefilter = prefilter(settings: &str) -> Result<String, Error>;
            iblFile = ibl_file(settings: &str, content: &str) -> Result<Vec<u8>, Error>;
            tablesFile = tables_file(settings: &str, format: &str) -> Result<Vec<u8>, Error>;
            snippet = snippet(language: &str) -> Result<Vec<u8>, Error>;
        }
    };
}

/// An argument of a call that came in a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Argument {
    /// A number, a text or a Boolean.
    Plain(Value),
    /// A file.
    Bytes(Vec<u8>),
    /// Numbers.
    Floats(Vec<f32>),
}

/// The result of a call.
#[derive(Clone, Debug)]
pub enum Answer {
    /// Done.
    Nothing,
    /// A number.
    Number(f32),
    /// An index, if there is one.
    Index(Option<u32>),
    /// A text, often JSON.
    Text(String),
    /// A file.
    Bytes(Vec<u8>),
    /// Whole numbers.
    Words(Vec<u32>),
    /// Numbers.
    Floats(Vec<f32>),
    /// A picture of directions.
    Map(MapView),
}

/// An argument as a method takes it; `None` for another kind.
trait FromArgument<'a>: Sized {
    fn from_argument(argument: &'a mut Argument) -> Option<Self>;
}

macro_rules! from_plain {
    ($($type:ty: $value:ident => $made:expr;)*) => {
        $(impl<'a> FromArgument<'a> for $type {
            fn from_argument(argument: &'a mut Argument) -> Option<Self> {
                let Argument::Plain($value) = argument else { return None };
                $made
            }
        })*
    };
}

from_plain! {
    &'a str: value => value.as_str();
    bool: value => value.as_bool();
    i32: value => value.as_i64()?.try_into().ok();
    u32: value => value.as_u64()?.try_into().ok();
    // Not larger, so that no picture takes more memory than there is.
    usize: value => value.as_u64()?.try_into().ok().filter(|&size| size <= MAX_SIZE);
    // JSON has null for NaN.
    f32: value => if value.is_null() { Some(f32::NAN) } else { Some(value.as_f64()? as f32) };
}

impl<'a> FromArgument<'a> for Vec<u8> {
    fn from_argument(argument: &'a mut Argument) -> Option<Self> {
        let Argument::Bytes(bytes) = argument else { return None };
        Some(std::mem::take(bytes))
    }
}

impl<'a> FromArgument<'a> for &'a [u8] {
    fn from_argument(argument: &'a mut Argument) -> Option<Self> {
        let Argument::Bytes(bytes) = argument else { return None };
        Some(bytes)
    }
}

impl<'a> FromArgument<'a> for &'a [f32] {
    fn from_argument(argument: &'a mut Argument) -> Option<Self> {
        let Argument::Floats(floats) = argument else { return None };
        Some(floats)
    }
}

/// What a method returns: a result, or a value if it cannot fail.
trait IntoAnswer {
    fn into_answer(self) -> Result<Answer, Error>;
}

impl<T: IntoAnswer> IntoAnswer for Result<T, Error> {
    fn into_answer(self) -> Result<Answer, Error> {
        self?.into_answer()
    }
}

impl IntoAnswer for () {
    fn into_answer(self) -> Result<Answer, Error> {
        Ok(Answer::Nothing)
    }
}

macro_rules! into_answer {
    ($($type:ty => $variant:ident;)*) => {
        $(impl IntoAnswer for $type {
            fn into_answer(self) -> Result<Answer, Error> {
                Ok(Answer::$variant(self))
            }
        })*
    };
}

into_answer! {
    f32 => Number;
    Option<u32> => Index;
    String => Text;
    Vec<u8> => Bytes;
    Vec<u32> => Words;
    Vec<f32> => Floats;
    MapView => Map;
}

macro_rules! dispatch {
    ($($name:ident = $method:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        impl Engine {
            /// Makes a call that came in a message, by its name in JavaScript.
            ///
            /// # Errors
            /// If there is no such call, its arguments are others, or it fails.
            pub fn call(&mut self, call: &str, mut arguments: Vec<Argument>) -> Result<Answer, Error> {
                match call {
                    $(stringify!($name) => {
                        let [$($argument),*] = &mut arguments[..] else {
                            return Err(refused(format!("{call}: the number of arguments is wrong")));
                        };
                        $(
                            let wrong = || refused(format!("{call}: there is no such {}", stringify!($argument)));
                            let $argument = <$type>::from_argument($argument).ok_or_else(wrong)?;
                        )*
                        let result: $result = self.$method($($argument),*);
                        result.into_answer()
                    })*
                    _ => Err(refused(format!("there is no call {call:?}"))),
                }
            }
        }
    };
}

for_each_call!(dispatch);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Host;

    fn call(call: &str, arguments: &[Argument]) -> Result<Answer, String> {
        let mut engine = Engine::new(Host::new(|| 0.0, None, Vec::new()));
        engine.call(call, arguments.to_vec()).map_err(|error| error.to_string())
    }

    fn plain(value: impl Into<Value>) -> Argument {
        Argument::Plain(value.into())
    }

    #[test]
    fn calls_of_messages_reach_their_methods() {
        let section = [plain("diffuse:1"), plain(30), plain(8)];
        let Ok(Answer::Floats(section)) = call("lobeSection", &section) else { panic!() };
        assert_eq!(section.len(), 16);
        let file = [plain("a.obj"), Argument::Bytes(vec![1])];
        assert!(matches!(call("addFile", &file), Ok(Answer::Nothing)));
    }

    #[test]
    fn calls_that_are_none_are_refused() {
        let refused = |name: &str, arguments: &[Argument]| call(name, arguments).unwrap_err();
        assert_eq!(refused("fetch", &[]), "there is no call \"fetch\"");
        assert_eq!(refused("map", &[]), "map: the number of arguments is wrong");
        assert_eq!(refused("map", &[plain("wide")]), "map: there is no such width");
        assert_eq!(refused("map", &[plain(1_u64 << 40)]), "map: there is no such width");
        assert_eq!(refused("map", &[plain(8)]), "there is no environment yet; load one first");
        let missing = r#"{"scene":"/etc/passwd","material":"","ground":false}"#;
        assert!(refused("loadScene", &[plain(missing)]).contains("it was not dropped on the page"));
        assert!(refused("loadScene", &[plain("{}")]).starts_with("settings: missing field"));
    }
}
