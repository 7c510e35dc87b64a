//! The options of a job as a list, for front ends without a command line.

use clap::{Arg, ArgAction, Args as _, Command};
use serde::Serialize;
use serde_json::Value;

use super::{Job, JobError, fields, nested, schema};

/// An option: a field of a job.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JobOption {
    /// The section and the field's name there, such as `light.rotate`.
    pub field: String,
    /// The name among the options of all sections: `env_rotate` for `--env-rotate`, `adaptive` for `--no-adaptive`.
    pub name: String,
    /// The default; null if there is none.
    pub default: Value,
    /// What it is, in one sentence without a period.
    pub help: String,
}

/// All options of a job, in the order of the help. The scene itself is none.
pub fn options() -> Vec<JobOption> {
    let (schema, defaults) = (schema(), fields(&Job::default()));
    let command = Job::augment_args(Command::new("job"));
    let option = |argument: &Arg| {
        let long = argument.get_long()?;
        let field = argument.get_id().to_string();
        let positive = match argument.get_action() {
            ArgAction::SetFalse => long.trim_start_matches("no-"),
            _ => long,
        };
        Some(JobOption {
            name: positive.replace('-', "_"),
            default: defaults.get(&field).cloned().unwrap_or_default(),
            help: description(&schema, &field).unwrap_or_default(),
            field,
        })
    };
    command.get_arguments().filter_map(option).collect()
}

/// What the schema says about a field, in one line.
fn description(schema: &Value, field: &str) -> Option<String> {
    let property = match field.split_once('.') {
        None => &schema["properties"][field],
        Some((section, name)) => {
            let reference = schema["properties"][section]["$ref"].as_str()?;
            &schema.pointer(reference.strip_prefix('#')?)?["properties"][name]
        }
    };
    let words: Vec<&str> = property["description"].as_str()?.split_whitespace().collect();
    Some(words.join(" "))
}

impl Job {
    /// Sets the option of a field, such as `light.rotate`.
    ///
    /// # Errors
    /// If the value is out of the option's range.
    pub fn set(&mut self, field: &str, value: Value) -> Result<(), JobError> {
        let mut fields = fields(self);
        fields.insert(field.to_owned(), value);
        let job = serde_json::from_value(nested(fields));
        *self = job.map_err(|error| JobError::Text(error.to_string()))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_has_a_name_and_a_sentence() {
        let options = options();
        let of = |name: &str| options.iter().find(|option| option.name == name).expect(name);
        assert_eq!(
            (&of("env_rotate").field[..], &of("env_rotate").default),
            ("light.rotate", &Value::Null)
        );
        assert_eq!((&of("spp").field[..], &of("spp").default), ("sampling.spp", &32.into()));
        assert_eq!(
            (&of("adaptive").field[..], &of("adaptive").default),
            ("sampling.adaptive", &true.into())
        );
        for JobOption { field, name, help, .. } in &options {
            assert!(
                help.starts_with(char::is_uppercase) && !help.ends_with('.'),
                "{field}: {help}"
            );
            assert_eq!(options.iter().filter(|other| other.name == *name).count(), 1, "{name}");
        }
    }

    #[test]
    fn fields_are_set_within_their_ranges() {
        let mut job = Job::default();
        job.set("sampling.spp", "5".into()).unwrap();
        job.set("view.size", "8,6".into()).unwrap();
        job.set("sampling.target_error", Value::Null).unwrap();
        assert_eq!((job.sampling.spp.get(), job.view.size.0.height), (5, 6));
        let error = job.set("sampling.spp", "2.5".into()).unwrap_err().to_string();
        assert_eq!(error, "'2.5' is not a whole number from 1 to 16777216");
        let error = job.set("pixel.seed", "-3".into()).unwrap_err().to_string();
        assert_eq!(error, "'-3' is not a whole number from 0 to 18446744073709551615");
    }
}
