//! One description of a render, for every front end.
//!
//! Each option is one field of one of these structs: its name, type, range, default, unit and line of help stand there and
//! nowhere else. The command line, TOML, JSON and the JSON Schema are made from them.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "the comments on fields are the help of the command line, which has units in brackets"
)]

mod file;
mod light;
mod options;
mod output;
mod sampling;
mod subject;
pub mod value;
mod view;

use std::ffi::OsString;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use domelight::render::{Background, RenderSettings};
pub use file::FilePart;
pub(crate) use file::load_scene;
pub use light::{Light, probe_name};
pub use options::{JobOption, options};
pub use output::Tone;
pub use sampling::{Pixel, Sampling};
pub use subject::{NamedMaterial, PortalList, Subject};
use value::{Size, Text};
pub use view::View;

/// The attribute of OpenEXR files that holds the job of a picture, as TOML.
pub const ATTRIBUTE: &str = "domelight.job";

/// The attribute that holds the files that a picture was made of: one line each, with fingerprint and name.
pub const INPUTS_ATTRIBUTE: &str = "domelight.inputs";

/// The name of the scene that is rendered if none is named.
const DEFAULT_SCENE: &str = "statue";

/// A scene, its light and a camera, for everything that renders.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSettings {
    /// A built-in scene (statue, spheres, material-ball, room, …), a mesh (.ply, .obj, .stl, .off,
    /// .gltf, .glb) or a scene file (.toml)
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// The part of the file to show.
    #[command(flatten)]
    pub file: FilePart,
    /// The light.
    #[command(flatten)]
    pub light: Light,
    /// The view.
    #[command(flatten)]
    pub view: View,
    /// The changes to the scene.
    #[command(flatten)]
    pub subject: Subject,
}

impl Default for SceneSettings {
    fn default() -> Self {
        defaults()
    }
}

impl SceneSettings {
    /// An unchanged scene under its own light or the built-in sky.
    pub fn new(scene: impl Into<String>, [width, height]: [usize; 2]) -> Self {
        let view = View { size: Text(Size { width, height }), ..View::default() };
        Self { scene: scene.into(), view, ..Self::default() }
    }

    /// The size and the background of a picture of it.
    pub fn settings(&self, others: RenderSettings) -> RenderSettings {
        let Text(Size { width, height }) = self.view.size;
        let hidden = self.subject.hide_env;
        let background = if hidden { Background::Hidden } else { Background::Shown };
        RenderSettings { width, height, background, ..others }
    }
}

/// A picture: what is rendered, and how.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Job {
    /// A built-in scene (statue, spheres, material-ball, room, …), a mesh (.ply, .obj, .stl, .off,
    /// .gltf, .glb), a scene file or a job (.toml), or a picture that domelight rendered (.exr), to render it again
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// The part of the file to show.
    #[command(flatten)]
    pub file: FilePart,
    /// The light.
    #[command(flatten)]
    pub light: Light,
    /// The view.
    #[command(flatten)]
    pub view: View,
    /// The changes to the scene.
    #[command(flatten)]
    pub subject: Subject,
    /// Strategy and samples.
    #[command(flatten)]
    pub sampling: Sampling,
    /// Point sets and the pixel filter.
    #[command(flatten)]
    pub pixel: Pixel,
    /// How pictures for viewing are developed.
    #[command(flatten, next_help_heading = "Output")]
    pub output: Tone,
}

impl Default for Job {
    fn default() -> Self {
        defaults()
    }
}

/// A text that describes no job.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JobError {
    /// Not TOML, an unknown field, or a value out of its range, with its place.
    #[error("{0}")]
    Text(String),
    /// A key or table that jobs do not have.
    #[error("there is no '{key}' in a job; it has {known}")]
    Unknown {
        /// The key.
        key: String,
        /// All keys.
        known: String,
    },
}

impl Job {
    /// Reads TOML. What it does not say has its default.
    ///
    /// # Errors
    /// If it is not TOML, a field is unknown, or a value is out of its range.
    pub fn from_toml(text: &str) -> Result<Self, JobError> {
        let job = Self::parse(text)?;
        let known = sections();
        let table: toml::Table = text.parse().unwrap_or_default();
        match table.keys().find(|key| !known.contains(key)) {
            Some(key) => Err(JobError::Unknown { key: key.clone(), known: known.join(", ") }),
            None => Ok(job),
        }
    }

    /// The job in a scene file, and whether it names its scene; otherwise, that is the file itself. `None` if the file is
    /// only the description of a scene, or no TOML.
    pub fn in_scene_file(text: &str) -> Option<Result<(Self, bool), JobError>> {
        let table: toml::Table = text.parse().ok()?;
        if table.contains_key("scene") {
            return Some(Self::from_toml(text).map(|job| (job, true)));
        }
        let is_job = sections().iter().any(|section| table.contains_key(section));
        is_job.then(|| Self::parse(text).map(|job| (job, false)))
    }

    fn parse(text: &str) -> Result<Self, JobError> {
        toml::from_str(text).map_err(|error| JobError::Text(error.to_string().trim().to_owned()))
    }

    /// All fields as TOML, which [`Job::from_toml`] reads.
    ///
    /// # Panics
    /// Never: every field has a text.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("every field of a job has a text")
    }

    /// The scene, its light and the camera.
    pub fn scene_settings(&self) -> SceneSettings {
        let Self { scene, file, light, view, subject, .. } = self.clone();
        SceneSettings { scene, file, light, view, subject }
    }

    /// The settings of the renderer.
    pub fn settings(&self) -> RenderSettings {
        let settings = self.scene_settings().settings(RenderSettings::default());
        self.sampling.settings(self.pixel.settings(settings))
    }

    /// The words of the command line that say what differs from the defaults. Its options come first, in the order of
    /// the help.
    pub fn arguments(&self) -> Vec<String> {
        let (values, usual) = (fields(self), fields(&Self::default()));
        let mut words = Vec::new();
        let mut positional = Vec::new();
        for argument in Self::augment_args(Command::new("options")).get_arguments() {
            let id = argument.get_id().as_str();
            let Some(value) = values.get(id).filter(|value| usual.get(id) != Some(*value)) else {
                continue;
            };
            let text = text_of(value);
            match (argument.get_long(), argument.get_action()) {
                (Some(long), ArgAction::SetTrue | ArgAction::SetFalse) => {
                    words.push(format!("--{long}"));
                }
                (Some(long), _) => words.push(format!("--{long}={text}")),
                (None, _) if text.starts_with('-') => positional.extend(["--".to_owned(), text]),
                (None, _) => positional.push(text),
            }
        }
        words.append(&mut positional);
        words
    }

    /// The names and texts of the options that decide what each camera sample is, of those that are said.
    pub fn of_samples(&self) -> Vec<(String, String)> {
        let Self { sampling, pixel, .. } = self;
        let options = fields(sampling).into_iter().chain(fields(pixel));
        let decides = |(name, _): &(String, Value)| name != "spp";
        options.filter(decides).map(|(name, value)| (name, text_of(&value))).collect()
    }

    /// This job with the options that are `given` in `other` instead. An option that contradicts one of them goes.
    ///
    /// # Errors
    /// If the given options and the rest of the job contradict each other.
    pub fn with(&self, other: &Self, given: &Given) -> Result<Self, JobError> {
        let command = Self::augment_args(Command::new("job"));
        let (mut this, other) = (fields(self), fields(other));
        let is_given = |argument: &&Arg| given.has(argument.get_id().as_str());
        for argument in command.get_arguments().filter(is_given) {
            this.retain(|id, _| !exclude(&command, argument, id));
            let id = argument.get_id().as_str();
            // The scene is the file that holds this job.
            if id == "scene" {
                continue;
            }
            // Another map does not inherit the adjustments of the first one.
            if id == "light.map" {
                this.retain(|id, _| !id.starts_with("light."));
            }
            match other.get(id) {
                Some(value) => this.insert(id.to_owned(), value.clone()),
                None => this.remove(id),
            };
        }
        serde_json::from_value(nested(this)).map_err(|error| JobError::Text(error.to_string()))
    }
}

/// The JSON Schema of jobs, for editors and other programs.
pub fn schema() -> Value {
    schemars::schema_for!(Job).to_value()
}

/// The options that the command line gives, by the paths of their fields.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Given(Vec<String>);

impl Given {
    /// Whether the field was given.
    pub fn has(&self, field: &str) -> bool {
        self.0.iter().any(|given| given == field)
    }
}

impl Args for Given {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

/// Must come before the options themselves, which remove their values from the matches.
impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let command = clap::parser::ValueSource::CommandLine;
        let given = |id: &&clap::Id| matches.value_source(id.as_str()) == Some(command);
        Ok(Self(matches.ids().filter(given).map(ToString::to_string).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The values of an empty command line.
fn defaults<T: Args>() -> T {
    let command = T::augment_args(Command::new("defaults").no_binary_name(true));
    let mut matches = command.get_matches_from(std::iter::empty::<OsString>());
    T::from_arg_matches_mut(&mut matches).expect("the defaults are valid")
}

/// Whether an option and that of the field `id` exclude each other.
fn exclude(command: &Command, option: &Arg, id: &str) -> bool {
    let excludes = |a: &Arg, b: &str| {
        command.get_arg_conflicts_with(a).iter().any(|other| other.get_id() == b)
    };
    let other = command.get_arguments().find(|other| other.get_id() == id);
    other.is_some_and(|other| excludes(option, id) || excludes(other, option.get_id().as_str()))
}

/// The keys and tables of a job.
fn sections() -> Vec<String> {
    let Ok(Value::Object(sections)) = serde_json::to_value(Job::default()) else {
        return Vec::new();
    };
    sections.into_iter().map(|(name, _)| name).collect()
}

/// The text of an option's value.
fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        value => value.to_string(),
    }
}

/// The fields that are said, by `section.name`.
fn fields(options: &impl Serialize) -> serde_json::Map<String, Value> {
    let Ok(Value::Object(sections)) = serde_json::to_value(options) else {
        return serde_json::Map::new();
    };
    let mut fields = serde_json::Map::new();
    for (section, value) in sections {
        match value {
            Value::Object(inside) => fields.extend(
                inside.into_iter().map(|(name, value)| (format!("{section}.{name}"), value)),
            ),
            value => _ = fields.insert(section, value),
        }
    }
    fields.retain(|_, value| !value.is_null());
    fields
}

/// The inverse of [`fields`].
fn nested(fields: serde_json::Map<String, Value>) -> Value {
    let mut sections = Value::Object(serde_json::Map::new());
    for (id, value) in fields {
        match id.split_once('.') {
            Some((section, name)) => sections[section][name] = value,
            None => sections[id] = value,
        }
    }
    sections
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use testkit::Pcg;

    /// The command line of a job alone.
    #[derive(Parser)]
    #[command(no_binary_name = true)]
    struct CommandLine {
        #[command(flatten)]
        given: Given,
        #[command(flatten)]
        job: Job,
    }

    fn parse(words: &[&str]) -> (Job, Given) {
        let CommandLine { given, job } = CommandLine::try_parse_from(words).expect("valid words");
        (job, given)
    }

    /// Values of every option that is neither a flag nor one of a closed set, by the path of its field.
    const VALUES: [(&str, &[&str]); 27] = [
        ("scene", &["robot.glb", "a b.ply", "-x.obj", "statue"]),
        ("file.scene", &["Scene", "0"]),
        ("file.animation", &["walk", "1"]),
        ("file.at", &["0.1", "-3", "1e-3"]),
        ("light.map", &["sky", "it's.hdr", "-"]),
        ("light.rotate", &["auto", "30", "-0.1", "360.5"]),
        ("light.scale", &["0", "0.25"]),
        ("light.exposure", &["-1.5", "2"]),
        ("light.faces", &["F,R,B180,L,U,D"]),
        ("light.layer", &["left.R"]),
        ("light.rows", &["1", "64", "16384"]),
        ("view.size", &["1x1", "640x480"]),
        ("view.camera", &["main", "2"]),
        ("view.from", &["front", "30,-15.5"]),
        ("view.origin", &["0,1.5,-4", "-1,0,0.1"]),
        ("view.target", &["-1,2,3"]),
        ("view.up", &["0,0,1"]),
        ("view.fov", &["0.1", "35"]),
        ("view.ortho", &["3.3"]),
        ("view.dof", &["2.8,auto", "1.4,3.5,6"]),
        ("subject.material", &["ggx:0.2", "diffuse:0.8,0.5,0.2"]),
        ("subject.portal", &["0,1,0:1,0,0:0,0,1", "-1,2.5,0:1,0,0:0,2,0;0,1e6,0:1,0,0:0,0,1"]),
        ("sampling.strategy", &["mis:3:1", "sir:15/800", "product"]),
        ("sampling.spp", &["1", "16777216"]),
        ("sampling.target_error", &["0.001"]),
        ("pixel.seed", &["7", "18446744073709551615"]),
        ("output.exposure", &["auto", "-0.7"]),
    ];

    fn values(argument: &Arg) -> Vec<String> {
        let listed = VALUES.iter().find(|(id, _)| argument.get_id() == id);
        let values: Vec<_> = match listed {
            Some((_, values)) => values.iter().map(ToString::to_string).collect(),
            None if !argument.get_action().takes_values() => vec![String::new()],
            None => {
                argument.get_possible_values().iter().map(|v| v.get_name().to_owned()).collect()
            }
        };
        assert!(!values.is_empty(), "{}: add it to VALUES", argument.get_id());
        values
    }

    /// A random command line without contradictions.
    fn words(pcg: &mut Pcg) -> Vec<String> {
        let command = Job::augment_args(Command::new("job"));
        let mut chosen: Vec<&str> = Vec::new();
        let (mut words, mut positional) = (Vec::new(), Vec::new());
        for argument in command.get_arguments() {
            let id = argument.get_id().as_str();
            let values = values(argument);
            let is_excluded = chosen.iter().any(|chosen| exclude(&command, argument, chosen));
            let needs_animation = id == "file.at" && !chosen.contains(&"file.animation");
            if pcg.next_f64() < 0.6 || is_excluded || needs_animation {
                continue;
            }
            chosen.push(id);
            let value = &values[(pcg.next_f64() * values.len() as f64) as usize];
            match (argument.get_long(), argument.get_action()) {
                (Some(long), ArgAction::SetTrue | ArgAction::SetFalse) => {
                    words.push(format!("--{long}"));
                }
                (Some(long), _) => words.push(format!("--{long}={value}")),
                (None, _) => positional = vec!["--".to_owned(), value.clone()],
            }
        }
        words.extend(positional);
        words
    }

    #[test]
    fn a_job_survives_toml_json_and_the_command_line() {
        let mut pcg = Pcg::new(39);
        for _ in 0..300 {
            let words = words(&mut pcg);
            let (job, _) = parse(&words.iter().map(String::as_str).collect::<Vec<_>>());
            let text = job.to_toml();
            let read = Job::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert_eq!(read, job, "{text}");
            assert_eq!(read.to_toml(), text);
            let json = serde_json::to_string(&job).unwrap();
            assert_eq!(serde_json::from_str::<Job>(&json).unwrap(), job, "{json}");
            let told = job.arguments();
            let told: Vec<_> = told.iter().map(String::as_str).collect();
            assert_eq!(parse(&told).0, job, "{told:?}");
        }
    }

    /// Every option of the command line is a field, and every field an option.
    #[test]
    fn fields_and_options_are_the_same() {
        let command = Job::augment_args(Command::new("job"));
        let options: Vec<_> = command.get_arguments().map(|a| a.get_id().to_string()).collect();
        let schema = schema();
        for id in &options {
            let pointer = match id.split_once('.') {
                Some((section, name)) => {
                    let of = schema.pointer(&format!("/properties/{section}/$ref"));
                    let of = of.and_then(Value::as_str).expect(section).trim_start_matches('#');
                    format!("{of}/properties/{name}")
                }
                None => format!("/properties/{id}"),
            };
            let field = schema.pointer(&pointer).unwrap_or_else(|| panic!("{pointer}"));
            assert!(field["description"].is_string(), "{id}: {field}");
        }
        let values = serde_json::to_value(Job::default()).unwrap();
        let values = values.as_object().unwrap();
        let n_fields: usize =
            values.values().map(|v| v.as_object().map_or(1, serde_json::Map::len)).sum();
        assert_eq!(options.len(), n_fields);
    }

    #[test]
    fn given_options_replace_those_of_another_job() {
        let (made, _) =
            parse(&["robot.glb", "--env=a.hdr", "--env-rotate=30", "--view=front", "--spp=8"]);
        let with = |words: &[&str]| {
            let (other, given) = parse(words);
            made.with(&other, &given).unwrap()
        };
        assert_eq!(with(&[]), made);
        assert_eq!(with(&["--spp=1024"]).sampling.spp.get(), 1024);
        assert_eq!(with(&["--env-scale=2"]).light.rotate, made.light.rotate);
        // Another map, and what excludes the view.
        assert_eq!(with(&["--env=b.hdr"]).light.rotate, None);
        assert_eq!(with(&["--origin=1,2,3"]).view.from, None);
        // The scene is what the job says.
        assert_eq!(with(&["picture.exr", "--seed=3"]).scene, "robot.glb");
    }

    #[test]
    fn errors_name_the_place() {
        for (text, says) in [
            ("scene = \"x.ply\"\n[light]\nrotate = \"x\"", "line 3"),
            ("scene = \"x.ply\"\n[sampling]\nspp = 0", "1 to 16777216"),
            ("scene = \"x.ply\"\n[sampling]\nsamples = 3", "spp"),
            ("scene = \"x.ply\"\nsamples = 3", "'samples'"),
            ("scene = ", "line 1"),
        ] {
            let error = Job::from_toml(text).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
        assert_eq!(Job::in_scene_file("[camera]\norigin = [0, 0, 1]"), None);
        let (job, named) =
            Job::in_scene_file("[view]\nsize = [64, 48]\n[camera]").unwrap().unwrap();
        assert_eq!((job.view.size.0.height, named), (48, false));
    }
}
