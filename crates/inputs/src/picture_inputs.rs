//! Pictures given as arguments: files, folders, standard input.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use image::RgbImage;
use sdg_demonstration::{IMAGE_EXTENSIONS, PixelFrame};

use crate::error_line::first_names;
use crate::pictures::{UNREADABLE_EXTENSIONS, read_image_in, read_standard_input_image};

/// The name that stands for standard input.
pub const STANDARD_INPUT: &str = "-";
/// Maximum number of skipped files named in a message.
const MAX_NAMED: usize = 20;

/// A picture before it is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PictureInput {
    File(PathBuf),
    StandardInput,
}

impl PictureInput {
    /// The name in results: the path as given, or `-` for standard input.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::StandardInput => STANDARD_INPUT.to_owned(),
        }
    }

    /// Reads and decodes the picture.
    pub fn read(&self, frame: PixelFrame) -> Result<RgbImage> {
        match self {
            Self::File(path) => read_image_in(path, frame),
            Self::StandardInput => read_standard_input_image(frame),
        }
    }

    /// The file's name, without and with its extension.
    fn file_names(&self) -> [String; 2] {
        match self {
            Self::File(path) => {
                [path.file_stem(), path.file_name()].map(|name| name.unwrap_or_default().to_string_lossy().into_owned())
            }
            Self::StandardInput => ["stdin".to_owned(), "stdin".to_owned()],
        }
    }
}

/// File names for the drawings of pictures.
#[derive(Debug)]
pub struct DrawnNames {
    /// Names that several pictures have apart from their extensions.
    shared: BTreeSet<String>,
    taken: BTreeSet<String>,
}

impl DrawnNames {
    /// For the drawings of these pictures.
    pub fn of<'a>(pictures: impl IntoIterator<Item = &'a PictureInput>) -> Self {
        let mut names: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for [stem, name] in pictures.into_iter().map(PictureInput::file_names) {
            names.entry(stem).or_default().insert(name);
        }
        let shared = names.into_iter().filter(|(_, names)| names.len() > 1).map(|(stem, _)| stem).collect();
        Self { shared, taken: BTreeSet::new() }
    }

    /// The picture's name with the extension `.png`. Pictures that differ only in their extensions keep these before it;
    /// pictures of one name, in different folders, are numbered.
    pub fn name_of(&mut self, picture: &PictureInput) -> String {
        let [stem, name] = picture.file_names();
        let own = if self.shared.contains(&stem) { name } else { stem };
        let numbered = |number: u32| if number == 1 { format!("{own}.png") } else { format!("{own}-{number}.png") };
        let name = (1..).map(numbered).find(|name| !self.taken.contains(name)).unwrap_or_default();
        self.taken.insert(name.clone());
        name
    }
}

/// The pictures of an argument, and the other files in its folder.
#[derive(Debug)]
pub struct PictureInputs {
    pub pictures: Vec<PictureInput>,
    /// A text that names the skipped files; `None` if there are none.
    pub skipped: Option<String>,
}

/// The pictures of an argument. For a folder: all files with a picture's extension, and also unsupported formats
/// (such as HEIC), so that their error is printed. Subfolders are left out.
///
/// # Errors
/// The folder cannot be listed or has no pictures.
pub fn pictures_of_argument(argument: &Path) -> Result<PictureInputs> {
    if argument.as_os_str() == STANDARD_INPUT {
        return Ok(PictureInputs { pictures: vec![PictureInput::StandardInput], skipped: None });
    }
    if !argument.is_dir() {
        return Ok(PictureInputs { pictures: vec![PictureInput::File(argument.to_owned())], skipped: None });
    }
    let is_picture = |path: &PathBuf| {
        !path.is_dir()
            && (sdg_files::has_extension(path, &IMAGE_EXTENSIONS)
                || sdg_files::has_extension(path, &UNREADABLE_EXTENSIONS))
    };
    let (pictures, others): (Vec<_>, Vec<_>) = sdg_files::entries(argument)?.into_iter().partition(is_picture);
    if pictures.is_empty() {
        bail!(
            "{}: expected pictures ({}) in this folder, found {} other files and folders",
            argument.display(),
            IMAGE_EXTENSIONS.join(", "),
            others.len()
        );
    }
    let skipped = (!others.is_empty()).then(|| {
        let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let names: Vec<String> = others.iter().map(name).collect();
        let names = first_names(&names, MAX_NAMED);
        format!("{}: skipped files that are not pictures: {names}", argument.display())
    });
    Ok(PictureInputs { pictures: pictures.into_iter().map(PictureInput::File).collect(), skipped })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_folder_has_its_pictures_and_names_what_is_skipped() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("more")).unwrap();
        for name in ["b.JPG", "a.png", "c.webp", "phone.heic", "a.json", ".hidden.png"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let inputs = pictures_of_argument(folder.path()).unwrap();
        let names = drawn_names(&inputs.pictures);
        assert_eq!(names, ["a.png", "b.png", "c.png", "phone.png"]);
        let skipped = inputs.skipped.unwrap();
        assert!(skipped.ends_with("skipped files that are not pictures: a.json, more"), "{skipped}");
        let empty = pictures_of_argument(&folder.path().join("more")).unwrap_err().to_string();
        assert!(empty.contains("expected pictures") && empty.contains("found 0 other"), "{empty}");
    }

    fn drawn_names(pictures: &[PictureInput]) -> Vec<String> {
        let mut names = DrawnNames::of(pictures);
        pictures.iter().map(|picture| names.name_of(picture)).collect()
    }

    #[test]
    fn drawings_have_the_names_of_their_pictures_in_any_order() {
        let named = |paths: &[&str]| {
            let pictures: Vec<_> = paths.iter().map(|path| PictureInput::File(path.into())).collect();
            drawn_names(&pictures)
        };
        assert_eq!(named(&["part.jpg", "a.png", "part.png"]), ["part.jpg.png", "a.png", "part.png.png"]);
        assert_eq!(named(&["part.png", "part.jpg"]), ["part.png.png", "part.jpg.png"]);
        // No drawing replaces another one.
        assert_eq!(named(&["a/1.png", "1-2.png", "c/1.png"]), ["1.png", "1-2.png", "1-3.png"]);
    }
}
