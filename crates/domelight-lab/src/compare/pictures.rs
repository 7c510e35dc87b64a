//! Pictures by other renderers with their cost: a folder of OpenEXR files.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use domelight::RgbImage;
use domelight::picture::exr::plain_attributes;
use domelight::picture::{ReadOptions, read_bytes};

use super::budget::seconds;
use crate::{At as _, Error, Host};

/// The file that may state the times of a folder's pictures.
const TIMES: &str = "times.csv";

/// A picture by another renderer, and its cost.
#[derive(Clone, Debug)]
pub struct OtherPicture {
    /// The name in tables and plots.
    pub name: String,
    /// Radiance, with the size of the comparison.
    pub image: RgbImage,
    /// The stated CPU seconds of rendering, > 0.
    pub seconds: f64,
}

/// Reads all OpenEXR pictures of a folder, sorted by name. The time of each comes from a line `NAME,SECONDS` of
/// `times.csv` in the folder, or else from the end of its name as in `NAME.12.5s.exr`, or else from an attribute
/// `domelight.seconds` or `renderTime` (also Blender's), in seconds or as `MM:SS`.
///
/// # Errors
/// If the folder has no picture, one cannot be read, or one has no time.
pub fn read_pictures(folder: &Path, host: &dyn Host) -> Result<Vec<OtherPicture>, Error> {
    let paths = exr_files(folder)?;
    if paths.is_empty() {
        let why = "there are no OpenEXR pictures of other renderers in the folder";
        return Err(Error::Usage(format!("{}: {why}", folder.display())));
    }
    let times = Times::read(folder, &paths, host)?;
    let mut pictures = Vec::new();
    for path in &paths {
        pictures.push(read_picture(path, &times, host).at(path.display())?);
    }
    // Pictures of one renderer after several times keep these in their names.
    let names: Vec<String> = pictures.iter().map(|picture| picture.name.clone()).collect();
    for (picture, path) in pictures.iter_mut().zip(&paths) {
        if names.iter().filter(|name| **name == picture.name).count() > 1 {
            picture.name = stem(path);
        }
    }
    Ok(pictures)
}

fn exr_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).at(folder.display())? {
        let path = entry.at(folder.display())?.path();
        let is_hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if !is_hidden && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn read_picture(path: &Path, times: &Times, host: &dyn Host) -> Result<OtherPicture, Error> {
    host.reads(path)?;
    let bytes = fs::read(path)?;
    let options = ReadOptions { max_memory: host.memory_left(), ..Default::default() };
    let picture = read_bytes(&bytes, &path.to_string_lossy(), &options)?;
    if let Some(guessed) = &picture.guessed_layer {
        host.warn(&format!("{}: {guessed}", path.display()));
    }
    let image = picture.image;
    host.keeps_memory(12 * image.pixels.len() as u64);
    let stem = stem(path);
    let (name, of_name) = name_and_seconds(&stem);
    let of_attributes = || {
        let attributes = plain_attributes(&bytes).ok()?;
        let mut stated = attributes.iter().filter(|(key, _)| is_time(key));
        stated.find_map(|(_, value)| clock_seconds(value))
    };
    let seconds = times.0.get(&stem).copied().or(of_name).or_else(of_attributes);
    let seconds = seconds.ok_or_else(|| {
        let why = format!(
            "its render time is unknown: name it {stem}.12.5s.exr, add a line {stem},12.5 to \
             {TIMES} in its folder, or write an attribute domelight.seconds into it"
        );
        Error::Usage(why)
    })?;
    Ok(OtherPicture { name: name.to_owned(), image, seconds })
}

/// The times of `times.csv`, by the names of pictures without `.exr`.
struct Times(HashMap<String, f64>);

impl Times {
    /// None where there is no such file.
    fn read(folder: &Path, pictures: &[PathBuf], host: &dyn Host) -> Result<Self, Error> {
        let path = folder.join(TIMES);
        if !path.exists() {
            return Ok(Self(HashMap::new()));
        }
        host.reads(&path)?;
        let text = fs::read_to_string(&path).at(path.display())?;
        let stems: Vec<String> = pictures.iter().map(|path| stem(path)).collect();
        Self::parse(&text, &stems).at(path.display())
    }

    fn parse(text: &str, pictures: &[String]) -> Result<Self, Error> {
        let mut times = HashMap::new();
        for (i, line) in text.lines().enumerate() {
            let usage = |why: String| Error::Usage(format!("line {}: {why}", i + 1));
            if line.trim().is_empty() {
                continue;
            }
            let Some((name, time)) = line.rsplit_once(',') else {
                return Err(usage(format!("'{line}' is not NAME,SECONDS")));
            };
            let unquoted = |cell: &str| cell.trim().trim_matches('"').to_owned();
            let (name, time) = (unquoted(name), unquoted(time));
            let Some(seconds) = clock_seconds(&time) else {
                // Perhaps a head.
                if i == 0 {
                    continue;
                }
                return Err(usage(format!("'{time}' is not a number of seconds above 0")));
            };
            let stem = name.strip_suffix(".exr").unwrap_or(&name).to_owned();
            // A name may be without the time at its end.
            let shown = |picture: &&String| name_and_seconds(picture).0 == stem;
            let exact = pictures.iter().find(|picture| **picture == stem);
            let Some(picture) = exact.or_else(|| pictures.iter().find(shown)) else {
                return Err(usage(format!("there is no picture {stem}.exr in the folder")));
            };
            times.insert(picture.clone(), seconds);
        }
        Ok(Self(times))
    }
}

/// The name, and the time at its end, if there is one: `cycles.12.5s` is `cycles` and 12.5.
fn name_and_seconds(stem: &str) -> (&str, Option<f64>) {
    let split = stem.match_indices('.').find_map(|(i, _)| {
        let (name, time) = (&stem[..i], &stem[i + 1..]);
        // A number without unit may be that of a frame.
        let has_unit = time.ends_with(|c: char| c.is_ascii_alphabetic());
        let seconds = seconds(time).filter(|_| has_unit && !name.is_empty())?;
        Some((name, Some(seconds)))
    });
    split.unwrap_or((stem, None))
}

/// Whether an attribute states the time, whoever wrote it.
fn is_time(key: &str) -> bool {
    let letters: String = key.chars().filter(char::is_ascii_alphanumeric).collect();
    let letters = letters.to_ascii_lowercase();
    letters == "domelightseconds" || letters.ends_with("rendertime")
}

/// Seconds, with a unit or as `MM:SS` or `HH:MM:SS`; above 0.
fn clock_seconds(text: &str) -> Option<f64> {
    if !text.contains(':') {
        return seconds(text.trim());
    }
    let parts = text.trim().split(':').map(|part| part.parse::<f64>().ok().filter(|x| *x >= 0.0));
    let parts = parts.collect::<Option<Vec<f64>>>()?;
    let total = parts.iter().fold(0.0, |sum, part| 60.0 * sum + part);
    (parts.len() <= 3 && total > 0.0 && total.is_finite()).then_some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_end_with_a_time() {
        for (stem, name, seconds) in [
            ("cycles.12.5s", "cycles", Some(12.5)),
            ("pbrt.v4.3s", "pbrt.v4", Some(3.0)),
            ("mitsuba.800ms", "mitsuba", Some(0.8)),
            ("frame.0001", "frame.0001", None),
            ("cycles", "cycles", None),
            ("12.5s", "12", Some(5.0)),
        ] {
            assert_eq!(name_and_seconds(stem), (name, seconds), "{stem}");
        }
    }

    #[test]
    fn times_have_units_or_are_of_a_clock() {
        for (text, seconds) in [
            ("12.5", Some(12.5)),
            ("500ms", Some(0.5)),
            ("01:02.50", Some(62.5)),
            ("1:00:00", Some(3600.0)),
            ("00:00", None),
            ("soon", None),
            ("-1", None),
            ("1:2:3:4", None),
        ] {
            assert_eq!(clock_seconds(text), seconds, "{text}");
        }
        assert!(is_time("cycles.ViewLayer.render_time") && is_time("renderTime"));
        assert!(is_time("domelight.seconds") && !is_time("domelight.samples"));
    }

    #[test]
    fn tables_of_times_name_their_pictures() {
        let pictures = ["a", "b,c", "e.12.5s"].map(str::to_owned);
        assert_eq!(Times::parse("e,99\n", &pictures).unwrap().0["e.12.5s"], 99.0);
        let times = Times::parse("picture,seconds\na.exr,2\n\n\"b,c\",1:30\n", &pictures).unwrap();
        assert_eq!((times.0["a"], times.0["b,c"]), (2.0, 90.0));
        for (text, why) in [
            ("a 2", "line 1: 'a 2' is not NAME,SECONDS"),
            ("a,2\nb,c,soon", "line 2: 'soon' is not a number"),
            ("d,2", "line 1: there is no picture d.exr"),
        ] {
            let error = Times::parse(text, &pictures).err().unwrap().to_string();
            assert!(error.contains(why), "{error}");
        }
    }
}
