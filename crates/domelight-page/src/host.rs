//! What an engine has beside what the page gives it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::SystemTime;

use domelight::environment::UpAxis;

use crate::Error;
use crate::setup::{Light, LoadedLight, LoadedScene, Setup};

/// A clock, limits, files of the disk, and what several engines share.
#[derive(Clone)]
pub struct Host {
    /// Milliseconds since any moment.
    pub(crate) now: fn() -> f64,
    /// The most that reading a scene or a map takes, each \[bytes\].
    pub(crate) max_memory: Option<u64>,
    /// Files that may be opened by their names.
    named: Arc<[PathBuf]>,
    pub(crate) shared: Arc<Shared>,
}

/// What tells one state of a file from another: when it was written, and its size. `None` if there is no file.
pub type Stamp = Option<(SystemTime, u64)>;

/// What engines have in common if they load it from the disk.
#[derive(Default)]
pub(crate) struct Shared {
    pub(crate) scenes: Shelf<Setup, LoadedScene>,
    pub(crate) lights: Shelf<(Light, UpAxis), LoadedLight>,
    /// The files of the disk that were read, as they were.
    read: Mutex<BTreeMap<PathBuf, Stamp>>,
    /// The maps that scenes of the disk name.
    maps: Mutex<BTreeSet<PathBuf>>,
}

impl Host {
    /// A host whose engines may open the files `named`; `now` is a clock \[ms\], `max_memory` the most that reading a scene or
    /// a map takes, each \[bytes\].
    pub fn new(now: fn() -> f64, max_memory: Option<u64>, named: Vec<PathBuf>) -> Self {
        Self { now, max_memory, named: named.into(), shared: Arc::default() }
    }

    /// The files of the disk that have changed since engines read them, as they are now.
    pub fn changes(&self) -> Vec<(PathBuf, Stamp)> {
        let read = locked(&self.shared.read);
        let now = read.iter().map(|(path, before)| (path, before, stamp(path)));
        now.filter(|(_, before, now)| *before != now)
            .map(|(path, _, now)| (path.clone(), now))
            .collect()
    }

    /// Takes files as they are now, and loads scenes and maps anew from now on.
    pub fn forget(&self) {
        for (path, before) in locked(&self.shared.read).iter_mut() {
            *before = stamp(path);
        }
        self.shared.scenes.clear();
        self.shared.lights.clear();
    }

    /// Whether a file was named, or is the map of a scene that was.
    pub(crate) fn may_open(&self, path: &Path) -> bool {
        self.named.iter().any(|named| named == path) || locked(&self.shared.maps).contains(path)
    }

    /// Notes that files of the disk are read.
    pub(crate) fn reads<'a>(&self, files: impl IntoIterator<Item = &'a Path>) {
        let files = files.into_iter().map(|path| (path.to_owned(), stamp(path)));
        locked(&self.shared.read).extend(files);
    }

    /// Allows the map that a scene of the disk names.
    pub(crate) fn allow_map(&self, path: &Path) {
        locked(&self.shared.maps).insert(path.to_owned());
    }
}

fn stamp(path: &Path) -> Stamp {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Things by what they are made of, as long as an engine has them.
pub(crate) struct Shelf<K, V>(Mutex<Vec<(K, Weak<V>)>>);

impl<K, V> Default for Shelf<K, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq, V> Shelf<K, V> {
    /// The thing of a key, made unless there is one. Whoever asks meanwhile waits.
    pub(crate) fn get_or_make(
        &self,
        key: K,
        make: impl FnOnce() -> Result<V, Error>,
    ) -> Result<Arc<V>, Error> {
        let mut things = locked(&self.0);
        things.retain(|(_, thing)| thing.strong_count() > 0);
        let found = things.iter().find(|(other, _)| *other == key);
        if let Some(thing) = found.and_then(|(_, thing)| thing.upgrade()) {
            return Ok(thing);
        }
        let thing = Arc::new(make()?);
        things.push((key, Arc::downgrade(&thing)));
        Ok(thing)
    }

    fn clear(&self) {
        locked(&self.0).clear();
    }
}

/// What a lock holds, even if a thread has ended with it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_made_once_and_kept_as_long_as_they_are_used() {
        let shelf = Shelf::<i32, i32>::default();
        let one = shelf.get_or_make(1, || Ok(10)).unwrap();
        assert_eq!(*shelf.get_or_make(1, || Ok(11)).unwrap(), 10);
        shelf.clear();
        assert_eq!(*shelf.get_or_make(1, || Ok(12)).unwrap(), 12);
        assert_eq!(*shelf.get_or_make(1, || Ok(13)).unwrap(), 13);
        assert_eq!(*one, 10);
        assert!(shelf.get_or_make(2, || Err(Error::NoScene)).is_err());
    }
}
