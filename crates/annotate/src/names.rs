//! Names of files that are written for the person at the page.

use std::path::{Path, PathBuf};

use crate::picture::Picture;

/// The last part of a path, for people.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// What of a name any file system takes.
pub fn safe_stem(name: &str) -> String {
    let safe: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' })
        .take(60)
        .collect();
    if safe.chars().all(|c| c == '_') { "part".to_owned() } else { safe }
}

/// A name beside `beside` that is not taken, like the picture's own.
pub fn free_name(beside: &Path, picture: &Picture) -> PathBuf {
    let stem = safe_stem(&Path::new(&picture.name).file_stem().unwrap_or_default().to_string_lossy());
    let extension = picture.path.extension().unwrap_or_default().to_string_lossy();
    let numbered = |n: usize| if n == 1 { stem.clone() } else { format!("{stem}-{n}") };
    let taken = |path: &Path| path.exists() || path.with_extension("json").exists();
    (1..)
        .map(|n| beside.with_file_name(format!("{}.{extension}", numbered(n))))
        .find(|path| !taken(path))
        .expect("numbers do not run out")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_elsewhere_name_nothing_else() {
        assert_eq!(safe_stem("../../etc/passwd"), "______etc_passwd");
        assert_eq!(safe_stem("Pleuel 3"), "Pleuel_3");
        assert_eq!(safe_stem("…"), "part");
        assert_eq!(safe_stem(&"a".repeat(300)).len(), 60);
    }

    #[test]
    fn a_taken_name_is_numbered() {
        let folder = tempfile::tempdir().unwrap();
        let picture = |name: &str| Picture { path: "/tmp/upload.png".into(), name: name.into(), size: [1, 1] };
        let beside = folder.path().join("photo.png");
        assert_eq!(free_name(&beside, &picture("table.jpg")), folder.path().join("table.png"));
        std::fs::write(folder.path().join("table.png"), "").unwrap();
        std::fs::write(folder.path().join("table-2.json"), "").unwrap();
        assert_eq!(free_name(&beside, &picture("table.jpg")), folder.path().join("table-3.png"));
    }
}
