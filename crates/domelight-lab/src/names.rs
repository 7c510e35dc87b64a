//! File names on pages, in pictures and in other exported files, which must not reveal folders of this machine.

use std::path::{Component, Path};

/// The name of a file without its folders. Names that are not paths are unchanged.
pub fn file_name(path: &str) -> String {
    let normal = |component| match component {
        Component::Normal(name) => Some(name),
        _ => None,
    };
    let name = Path::new(path).components().filter_map(normal).next_back();
    let nothing = || if path.is_empty() { "" } else { "." }.to_owned();
    name.map_or_else(nothing, |name| name.to_string_lossy().into_owned())
}

/// The name of a scene or a probe in titles: that of its file, without folders and extension.
pub fn display_name(path: &str) -> String {
    let name = file_name(path);
    Path::new(&name).file_stem().map_or(name.clone(), |stem| stem.to_string_lossy().into_owned())
}

/// A word of a command line for other readers. Paths that are absolute or lead out of the working folder are reduced to the
/// file name.
pub fn shared_word(word: &str) -> String {
    if let Some((flag, value)) = word.split_once('=')
        && flag.starts_with('-')
    {
        return format!("{flag}={}", shared_word(value));
    }
    // A short flag and its value in one word.
    if let Some((flag, value)) = word.split_at_checked(2)
        && flag.starts_with('-')
        && flag != "--"
        && leads_away(value)
    {
        return format!("{flag}{}", shared_word(value));
    }
    // Some flags take a list.
    if !word.split(',').any(leads_away) {
        return word.to_owned();
    }
    let part = |part: &str| if has_folder(part) { file_name(part) } else { part.to_owned() };
    word.split(',').map(part).collect::<Vec<_>>().join(",")
}

/// Text without the folders of these files.
pub(crate) fn without_folders<'a>(text: &str, files: impl Iterator<Item = &'a Path>) -> String {
    let folder = |file: &Path| file.parent().map(|folder| folder.display().to_string());
    let mut folders: Vec<String> = files.filter_map(folder).filter(|f| !f.is_empty()).collect();
    // Folders within folders first.
    folders.sort_by_key(|folder| std::cmp::Reverse(folder.len()));
    folders.dedup();
    folders.iter().fold(text.to_owned(), |text, folder| {
        let separators = if cfg!(windows) { &['/', '\\'][..] } else { &['/'] };
        let end = if folder.ends_with(separators) { "" } else { std::path::MAIN_SEPARATOR_STR };
        text.replace(&format!("{folder}{end}"), "")
    })
}

fn leads_away(word: &str) -> bool {
    let path = Path::new(word);
    path.has_root()
        || path.components().any(|c| matches!(c, Component::ParentDir | Component::Prefix(_)))
}

fn has_folder(word: &str) -> bool {
    Path::new(word).components().count() > 1 || leads_away(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_no_folders() {
        for (path, file, display) in [
            ("statue", "statue", "statue"),
            ("/home/me/robot.v2.glb", "robot.v2.glb", "robot.v2"),
            ("maps/studio.hdr", "studio.hdr", "studio"),
            ("/home/me/..", "me", "me"),
            ("/", ".", "."),
            ("", "", ""),
            ("-", "-", "-"),
            (".hidden", ".hidden", ".hidden"),
        ] {
            assert_eq!((file_name(path), display_name(path)), (file.into(), display.into()));
        }
    }

    #[test]
    fn words_of_commands_name_no_folder_of_the_machine() {
        for (word, shared) in [
            ("compare", "compare"),
            ("scenes/bunny.ply", "scenes/bunny.ply"),
            ("/home/me/bunny.ply", "bunny.ply"),
            ("../secret/bunny.ply", "bunny.ply"),
            ("--json=/tmp/x/numbers.json", "--json=numbers.json"),
            ("-o/tmp/x/page.html", "-opage.html"),
            ("mis:3/1,sir:15/800", "mis:3/1,sir:15/800"),
            ("/a/x.hdr,sky,/b/c/y.hdr", "x.hdr,sky,y.hdr"),
            ("/a/with,comma/x.hdr", "with,x.hdr"),
            ("--env-rotate", "--env-rotate"),
            ("-3", "-3"),
            ("time:2s", "time:2s"),
        ] {
            assert_eq!(shared_word(word), shared);
        }
    }

    #[test]
    fn texts_lose_the_folders_of_files() {
        let files = ["/home/me/a/b.obj", "/home/me/a/textures/c.png", "d.obj"].map(Path::new);
        let text =
            "/home/me/a/b.obj: cannot read /home/me/a/textures/x.png or /home/me/a/z.mtl, d.obj";
        let without = without_folders(text, files.into_iter());
        assert_eq!(without, "b.obj: cannot read x.png or z.mtl, d.obj");
    }
}
