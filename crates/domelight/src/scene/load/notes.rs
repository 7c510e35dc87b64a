//! The features that a loader ignores, reported once for each kind.

use std::collections::HashMap;

/// The most names reported of a kind; beyond them only their number is.
const MAX_NAMES: usize = 3;

/// Kinds of what is passed over, in the order of their first appearance, each with what it befell.
#[derive(Default)]
pub(super) struct Notes {
    kinds: Vec<Kind>,
    index: HashMap<String, usize>,
}

struct Kind {
    before: String,
    after: String,
    names: Vec<String>,
    count: usize,
}

impl Notes {
    /// Notes that the sentence `before` … `after` is true of `name`.
    pub(super) fn add(&mut self, before: &str, name: &str, after: &str) {
        let key = format!("{before}\0{after}");
        let at = *self.index.entry(key).or_insert_with(|| {
            let (before, after) = (before.to_owned(), after.to_owned());
            self.kinds.push(Kind { before, after, names: Vec::new(), count: 0 });
            self.kinds.len() - 1
        });
        let kind = &mut self.kinds[at];
        kind.count += 1;
        if kind.names.len() < MAX_NAMES {
            kind.names.push(format!("'{name}'"));
        }
    }

    /// One sentence a kind: `before 'a', 'b', 'c' and 7 more after`.
    pub(super) fn sentences(self) -> impl Iterator<Item = String> {
        self.kinds.into_iter().map(|kind| {
            let names = kind.names.join(", ");
            let more = match kind.count - kind.names.len() {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            format!("{}{names}{more}{}", kind.before, kind.after)
        })
    }
}
