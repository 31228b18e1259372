//! Pictures given as arguments: files, folders, standard input.

use std::collections::BTreeSet;
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

    /// An unused file name for the drawing: pictures in different folders may have equal names.
    pub fn drawn_name(&self, taken: &mut BTreeSet<String>) -> String {
        let stem = match self {
            Self::File(path) => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            Self::StandardInput => "stdin".to_owned(),
        };
        let numbered = |number: u32| if number == 1 { format!("{stem}.png") } else { format!("{stem}-{number}.png") };
        let name = (1..).map(numbered).find(|name| !taken.contains(name)).unwrap_or_default();
        taken.insert(name.clone());
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
        let names: Vec<String> = inputs.pictures.iter().map(|input| input.drawn_name(&mut BTreeSet::new())).collect();
        assert_eq!(names, ["a.png", "b.png", "c.png", "phone.png"]);
        let skipped = inputs.skipped.unwrap();
        assert!(skipped.ends_with("skipped files that are not pictures: a.json, more"), "{skipped}");
        let empty = pictures_of_argument(&folder.path().join("more")).unwrap_err().to_string();
        assert!(empty.contains("expected pictures") && empty.contains("found 0 other"), "{empty}");
    }

    #[test]
    fn drawn_pictures_of_one_name_do_not_replace_each_other() {
        let mut taken = BTreeSet::new();
        let names: Vec<String> = ["a/1.png", "b/1.jpg", "1-2.png", "c/1.png"]
            .iter()
            .map(|path| PictureInput::File(path.into()).drawn_name(&mut taken))
            .collect();
        assert_eq!(names, ["1.png", "1-2.png", "1-2-2.png", "1-3.png"]);
    }
}
