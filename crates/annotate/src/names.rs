//! Names of the files that the page writes, and the order of those that it lists.

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use sdg_demonstration::IMAGE_EXTENSIONS;
use sdg_files::{absolute, absolute_folder, marks_of_photo};

/// Name of a project's file in its folder, and extension of the file of a photo's project.
pub const PROJECT_FILE: &str = "sdg-project.json";

/// The last part of a path, for display.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The name of a path in a project's file: relative to the folder if it is inside, otherwise absolute.
pub fn relative(folder: &Path, path: &Path) -> String {
    let (folder, path) = (absolute_folder(folder), absolute(path));
    path.strip_prefix(&folder).unwrap_or(&path).to_string_lossy().into_owned()
}

/// The natural order of two names, the same as on the page: numbers by value (2 before 10), letters without regard to
/// case.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    pieces(a).cmp(pieces(b)).then_with(|| a.cmp(b))
}

/// A piece of a name. The order of the variants is the order of sorting.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Piece<'a> {
    Sign(char),
    /// The number of digits without leading zeros, and these digits. There may be any number of them.
    Number(usize, &'a str),
    /// A letter, in lower case.
    Letter(char),
}

fn pieces(mut rest: &str) -> impl Iterator<Item = Piece<'_>> {
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let num_digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let (piece, after) = rest.split_at(num_digits.max(first.len_utf8()));
        rest = after;
        Some(if num_digits > 0 {
            let digits = piece.trim_start_matches('0');
            Piece::Number(digits.len(), digits)
        } else if first.is_alphabetic() {
            Piece::Letter(first.to_lowercase().next().unwrap_or(first))
        } else {
            Piece::Sign(first)
        })
    })
}

/// Combining accents, as in umlauts on macOS.
const COMBINING: std::ops::RangeInclusive<char> = '\u{300}'..='\u{36f}';

/// The first 60 characters of a name, with `_` in place of all except letters, digits, combining accents, `-` and `_`.
pub fn safe_stem(name: &str) -> String {
    let safe: String = name
        .chars()
        .map(|c| if c.is_alphanumeric() || COMBINING.contains(&c) || c == '-' || c == '_' { c } else { '_' })
        .take(60)
        .collect();
    if safe.chars().all(|c| c == '_') { "part".to_owned() } else { safe }
}

/// An unused path in the folder of `beside`, named after the [`safe_stem`] of `name`.
pub fn free_name(beside: &Path, name: &str, extension: &str) -> PathBuf {
    let stem = safe_stem(&Path::new(name).file_stem().unwrap_or_default().to_string_lossy());
    free_numbered(&beside.with_file_name(format!("{stem}.{extension}")))
}

/// Whether a file's name has the extension of a picture.
pub fn is_picture_name(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| IMAGE_EXTENSIONS.contains(&extension.as_str()))
}

/// The names, without extension, of the pictures in the folder of `beside`; empty if it cannot be listed.
fn picture_stems(beside: &Path) -> BTreeSet<OsString> {
    let folder = beside.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let paths = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    paths.filter(|path| is_picture_name(path)).filter_map(|path| path.file_stem().map(ToOwned::to_owned)).collect()
}

/// The path itself or, if a picture, marks or a project with that name exist, the path with a number. A picture with
/// another extension would have its marks in the same file.
pub fn free_numbered(path: &Path) -> PathBuf {
    free_numbered_except(path, &[])
}

/// Like [`free_numbered`], also different from these names.
pub fn free_numbered_except(path: &Path, names: &[String]) -> PathBuf {
    let (stem, extension) = (path.file_stem().unwrap_or_default(), path.extension().unwrap_or_default());
    let numbered = |n: usize| match n {
        1 => path.to_owned(),
        _ => path.with_file_name(format!("{}-{n}.{}", stem.to_string_lossy(), extension.to_string_lossy())),
    };
    let records = |path: &Path| marks_of_photo(path).into_iter().chain([path.with_extension(PROJECT_FILE)]);
    let has_records = |path: &Path| records(path).any(|record| record.exists());
    let pictures = picture_stems(path);
    let taken = |path: &Path| {
        path.exists()
            || has_records(path)
            || path.file_stem().is_some_and(|stem| pictures.contains(stem))
            || names.contains(&file_name(path))
    };
    (1..).map(numbered).find(|path| !taken(path)).expect("numbers do not run out")
}

/// Names that cameras and people give to any picture, also in ../page/start.js.
const ANY_PICTURE: [&str; 14] = [
    "photo",
    "image",
    "picture",
    "img",
    "pic",
    "dsc",
    "dscn",
    "dscf",
    "pxl",
    "p",
    "demo",
    "frame",
    "screenshot",
    "webcam",
];

/// The proposed name of the part on a photo: the photo's name; if it is generic, the folder's name; if both are,
/// `part`.
pub fn proposed_label(photo: Option<&Path>, folder: &Path) -> String {
    let says_something = |name: &String| {
        let letters: String = name.chars().filter(|c| c.is_alphabetic()).flat_map(char::to_lowercase).collect();
        !letters.is_empty() && !ANY_PICTURE.contains(&letters.as_str()) && !name.starts_with('.')
    };
    let of_photo = photo.and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
    let folder = absolute(folder);
    let of_folder = || folder.file_name().map(|name| name.to_string_lossy().into_owned());
    let proposed = of_photo.filter(says_something).or_else(|| of_folder().filter(says_something));
    proposed.map_or_else(|| "part".to_owned(), |name| name.chars().take(60).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_elsewhere_name_nothing_else() {
        assert_eq!(safe_stem("../../etc/passwd"), "______etc_passwd");
        assert_eq!(safe_stem("Pleuel 3"), "Pleuel_3");
        assert_eq!(safe_stem("Bügel größer"), "Bügel_größer");
        assert_eq!(safe_stem("Bu\u{308}gel"), "Bu\u{308}gel");
        assert_eq!(safe_stem("…"), "part");
        assert_eq!(safe_stem(&"a".repeat(300)).len(), 60);
    }

    #[test]
    fn a_file_has_one_name_in_a_project_however_its_path_is_spelled() {
        let here = std::env::current_dir().unwrap();
        let name = |folder: &str, path: &str| relative(Path::new(folder), Path::new(path));
        for folder in ["", ".", here.to_str().unwrap()] {
            for path in ["a.png", "./a.png", "src/../a.png", here.join("a.png").to_str().unwrap()] {
                assert_eq!(name(folder, path), "a.png", "{path} in {folder}");
            }
        }
        for folder in ["rod", "./rod/"] {
            assert_eq!(name(folder, "./rod/tried/a.png"), "tried/a.png");
            assert_eq!(name(folder, "a.png"), here.join("a.png").display().to_string());
        }
    }

    #[test]
    fn the_page_knows_the_names_of_any_picture() {
        assert!(include_str!("../page/start.js").contains(&format!("({})?", ANY_PICTURE.join("|"))));
    }

    #[test]
    fn numbers_in_names_are_ordered_by_value() {
        let expected =
            ["_.png", "2.png", "10.png", "b.png", "p1.png", "P2.png", "p002.png", "p3a.png", "p3b.png", "p10.png"];
        let mut names = expected;
        names.sort_unstable();
        assert_ne!(names, expected);
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, expected);
        // More digits than any integer type has.
        let long = "9".repeat(60);
        assert_eq!(natural_order(&long, &format!("1{long}")), Ordering::Less);
        assert_eq!(natural_order(&long, &long), Ordering::Equal);
    }

    #[test]
    fn a_taken_name_is_numbered() {
        let folder = tempfile::tempdir().unwrap();
        let beside = folder.path().join("photo.png");
        assert_eq!(free_name(&beside, "table.jpg", "png"), folder.path().join("table.png"));
        std::fs::write(folder.path().join("table.png"), "").unwrap();
        std::fs::write(folder.path().join("table-2.json"), "").unwrap();
        assert_eq!(free_name(&beside, "table.jpg", "png"), folder.path().join("table-3.png"));
        let spaced = folder.path().join("my part.png");
        assert_eq!(free_numbered(&spaced), spaced);
        std::fs::write(&spaced, "").unwrap();
        assert_eq!(free_numbered(&spaced), folder.path().join("my part-2.png"));
        std::fs::write(folder.path().join("photo.JPG"), "").unwrap();
        assert_eq!(free_numbered(&beside), folder.path().join("photo-2.png"));
    }

    #[test]
    fn a_part_is_called_as_its_photo_or_its_folder() {
        let propose = |photo: &str, folder: &str| proposed_label(Some(Path::new(photo)), Path::new(folder));
        assert_eq!(propose("/parts/wing bolt.jpg", "/parts"), "wing bolt");
        for photo in ["IMG_2034.JPG", "photo-2.png", "20261127_101500.jpg", "DSC00012.JPG"] {
            assert_eq!(propose(photo, "/parts/wingbolt"), "wingbolt", "{photo}");
        }
        assert_eq!(propose("photo.png", "/tmp/.tmpA1"), "part");
        assert_eq!(proposed_label(None, Path::new("/parts/lid")), "lid");
    }
}
