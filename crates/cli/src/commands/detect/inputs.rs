//! The pictures of `sdg detect`: files, those of folders, one from standard input.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use image::RgbImage;
use sdg_demonstration::{IMAGE_EXTENSIONS, PixelFrame};
use sdg_inputs::UNREADABLE_EXTENSIONS;

use crate::exit::Usage;

/// The name of standard input among files.
const STANDARD_INPUT: &str = "-";
/// How many names of skipped files are printed.
const MAX_NAMED: usize = 20;

/// A picture before it is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Input {
    File(PathBuf),
    StandardInput,
}

impl Input {
    /// As results call it: the path as given, `-` for standard input.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::StandardInput => STANDARD_INPUT.to_owned(),
        }
    }

    /// Reads and decodes it.
    pub fn read(&self, frame: PixelFrame) -> Result<RgbImage> {
        match self {
            Self::File(path) => sdg_inputs::read_image_in(path, frame),
            Self::StandardInput => sdg_inputs::read_standard_input_image(frame),
        }
    }

    /// A name for its drawn picture that none before it has: pictures of several folders may be called alike.
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

/// Drawings are called like their pictures and end in `.png`: in the folder of these they would replace them or their neighbours, and a
/// second run would take them for pictures.
///
/// # Errors
/// A folder that a picture lies in.
pub fn check_drawn_elsewhere<'a>(folder: &Path, pictures: impl Iterator<Item = &'a Input>) -> Result<()> {
    let Ok(folder_of_drawings) = folder.canonicalize() else {
        return Ok(());
    };
    for picture in pictures {
        let Input::File(path) = picture else { continue };
        if path.canonicalize().is_ok_and(|path| path.parent() == Some(&folder_of_drawings)) {
            bail!(
                "--draw: expected another folder than that of the pictures, found {}, where {} lies: drawings end in .png \
                 and would replace pictures",
                folder.display(),
                path.display()
            );
        }
    }
    Ok(())
}

/// An argument's pictures, and what else stands in the folder that it names.
#[derive(Debug)]
pub struct Inputs {
    pub pictures: Vec<Input>,
    /// Names of what is no picture, in words; `None` where there is nothing.
    pub skipped: Option<String>,
}

/// The pictures of an argument: of a folder all that end like pictures, those that are not read (HEIC) with the others, so that
/// their error is printed; folders in it are left out.
///
/// # Errors
/// A folder that cannot be listed or has no pictures.
pub fn of_argument(argument: &Path) -> Result<Inputs> {
    if argument.as_os_str() == STANDARD_INPUT {
        return Ok(Inputs { pictures: vec![Input::StandardInput], skipped: None });
    }
    if !argument.is_dir() {
        return Ok(Inputs { pictures: vec![Input::File(argument.to_owned())], skipped: None });
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
        let mut names: Vec<String> = others.iter().take(MAX_NAMED).map(name).collect();
        if others.len() > MAX_NAMED {
            names.push(format!("{} more", others.len() - MAX_NAMED));
        }
        format!("{}: skipped what is no picture: {}", argument.display(), names.join(", "))
    });
    Ok(Inputs { pictures: pictures.into_iter().map(Input::File).collect(), skipped })
}

/// Standard input can be read once.
///
/// # Errors
/// [`Usage`] where it is named twice.
pub fn check_standard_input(arguments: &[PathBuf]) -> Result<()> {
    match arguments.iter().filter(|argument| argument.as_os_str() == STANDARD_INPUT).count() {
        0 | 1 => Ok(()),
        count => Err(Usage(format!("-: expected standard input once, found it {count} times")).into()),
    }
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
        let inputs = of_argument(folder.path()).unwrap();
        let names: Vec<String> = inputs.pictures.iter().map(|input| input.drawn_name(&mut BTreeSet::new())).collect();
        assert_eq!(names, ["a.png", "b.png", "c.png", "phone.png"]);
        let skipped = inputs.skipped.unwrap();
        assert!(skipped.ends_with("skipped what is no picture: a.json, more"), "{skipped}");
        let empty = of_argument(&folder.path().join("more")).unwrap_err().to_string();
        assert!(empty.contains("expected pictures") && empty.contains("found 0 other"), "{empty}");
    }

    #[test]
    fn drawn_pictures_of_one_name_do_not_replace_each_other() {
        let mut taken = BTreeSet::new();
        let names: Vec<String> = ["a/1.png", "b/1.jpg", "1-2.png", "c/1.png"]
            .iter()
            .map(|path| Input::File(path.into()).drawn_name(&mut taken))
            .collect();
        assert_eq!(names, ["1.png", "1-2.png", "1-2-2.png", "1-3.png"]);
    }

    #[test]
    fn drawings_go_to_another_folder_than_the_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("x.bmp");
        fs::write(&picture, "").unwrap();
        let pictures = [Input::StandardInput, Input::File(picture)];
        let error = check_drawn_elsewhere(&folder.path().join("."), pictures.iter()).unwrap_err().to_string();
        assert!(error.contains("--draw") && error.contains("x.bmp"), "{error}");
        assert!(check_drawn_elsewhere(&folder.path().join("drawn"), pictures.iter()).is_ok());
        let below = folder.path().join("below");
        fs::create_dir(&below).unwrap();
        assert!(check_drawn_elsewhere(&below, pictures.iter()).is_ok());
    }

    #[test]
    fn standard_input_is_read_once() {
        let arguments = |texts: &[&str]| texts.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert!(check_standard_input(&arguments(&["a.png", "-"])).is_ok());
        assert!(check_standard_input(&arguments(&["-", "a.png", "-"])).unwrap_err().is::<Usage>());
        assert_eq!(of_argument(Path::new("-")).unwrap().pictures, [Input::StandardInput]);
    }
}
