//! The pictures of `sdg detect`, checked before the search begins.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sdg_inputs::{PictureInput, STANDARD_INPUT};

use crate::exit::Usage;

/// Checks that drawings do not replace pictures. A drawing has the name of its picture with the extension `.png`. In
/// the pictures' folder it would overwrite a PNG picture, and a second run would search it as a picture.
///
/// # Errors
/// A picture is in this folder.
pub fn check_drawn_elsewhere<'a>(folder: &Path, pictures: impl Iterator<Item = &'a PictureInput>) -> Result<()> {
    let Ok(folder_of_drawings) = folder.canonicalize() else {
        return Ok(());
    };
    for picture in pictures {
        let PictureInput::File(path) = picture else { continue };
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

/// Checks that standard input is named at most once, because it can be read only once.
///
/// # Errors
/// [`Usage`] if it is named more than once.
pub fn check_standard_input(arguments: &[PathBuf]) -> Result<()> {
    match arguments.iter().filter(|argument| argument.as_os_str() == STANDARD_INPUT).count() {
        0 | 1 => Ok(()),
        count => Err(Usage(format!("-: expected standard input once, found {count} times")).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn drawings_go_to_another_folder_than_the_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("x.bmp");
        fs::write(&picture, "").unwrap();
        let pictures = [PictureInput::StandardInput, PictureInput::File(picture)];
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
        assert_eq!(sdg_inputs::pictures_of_argument(Path::new("-")).unwrap().pictures, [PictureInput::StandardInput]);
    }
}
