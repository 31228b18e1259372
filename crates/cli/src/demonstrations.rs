//! `--demo IMAGE:ANNOTATION`: a photo and the marks on it.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sdg_demonstration::{Demonstration, ImageFacts};

use crate::annotation_files::AnnotationFile;
use crate::exit::Usage;
use crate::files;

/// Reads one demonstration from each argument.
pub fn read_all(arguments: &[String]) -> Result<Vec<Demonstration>> {
    arguments.iter().map(|argument| read(argument)).collect()
}

fn read(argument: &str) -> Result<Demonstration> {
    let (image_path, annotation_path) = split(argument)?;
    let image = files::read_image(&image_path)?;
    let file_name = image_path.file_name().and_then(|name| name.to_str());
    let facts = ImageFacts { width: image.width(), height: image.height(), file_name };
    let mut objects = AnnotationFile::read(&annotation_path)?.objects(&facts)?;
    if objects.len() != 1 {
        let labels: Vec<&str> = objects.iter().map(|object| object.label.as_str()).collect();
        bail!(
            "{}: expected one marked object, found {} ({}): a demonstration shows one part",
            annotation_path.display(),
            objects.len(),
            labels.join(", ")
        );
    }
    Ok(Demonstration { image, annotation: objects.remove(0) })
}

/// Splits at a colon. Paths may have colons of their own: of several, the one between two files that exist.
pub fn split(argument: &str) -> Result<(PathBuf, PathBuf)> {
    let splits: Vec<(PathBuf, PathBuf)> = argument
        .match_indices(':')
        .map(|(at, _)| (argument[..at].into(), argument[at + 1..].into()))
        .filter(|(image, annotation): &(PathBuf, PathBuf)| {
            !image.as_os_str().is_empty() && !annotation.as_os_str().is_empty()
        })
        .collect();
    let exist = |(image, annotation): &&(PathBuf, PathBuf)| Path::exists(image) && Path::exists(annotation);
    match splits.iter().find(exist).or(splits.last()) {
        Some(split) => Ok(split.clone()),
        None => Err(Usage(format!("--demo: expected IMAGE:ANNOTATION, found \"{argument}\"")).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_at_the_colon() {
        assert_eq!(split("a.png:b.json").unwrap(), ("a.png".into(), "b.json".into()));
        assert_eq!(split("C:/a.png:b.json").unwrap(), ("C:/a.png".into(), "b.json".into()));
    }

    #[test]
    fn half_an_argument_is_wrong_usage() {
        for argument in ["a.png", "a.png:", ":b.json"] {
            assert!(split(argument).unwrap_err().is::<Usage>(), "{argument}");
        }
    }
}
