//! Converts an annotation file to another format.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sdg_demonstration::{AnnotationFormat, DeclaredImage, ImageFacts, LabelledInstance};

use crate::annotation_files::{AnnotationFile, write_marks};
use crate::error::ImageError;
use crate::pictures::read_image;

/// A written annotation file.
#[derive(Debug, Clone)]
pub struct ConvertedAnnotation {
    /// The format of the input.
    pub input_format: AnnotationFormat,
    /// Name and size of the image.
    pub image: DeclaredImage,
    /// The label of each object.
    pub labels: Vec<String>,
    /// Information that the output's format cannot contain.
    pub left_out: Vec<String>,
    /// The file with the labels, for formats that keep them in a second file.
    pub data_yaml: Option<PathBuf>,
}

/// Writes the marks of `input` to `output`. The image is needed if `input` has several images or does not state the
/// size of its image.
///
/// # Errors
/// Files cannot be read or written, the marks do not fit the image, or the format cannot contain them;
/// [`ImageError`] if the image is needed.
pub fn convert_annotation(
    input: &Path,
    image: Option<&Path>,
    output: &Path,
    format: AnnotationFormat,
) -> Result<ConvertedAnnotation> {
    let file = AnnotationFile::read(input)?;
    let (declared, instances) = match image {
        Some(path) => marks_on(&file, path)?,
        None => declared_marks(&file, input)?,
    };
    let DeclaredImage { file_name, width, height } = &declared;
    let facts = ImageFacts { width: *width, height: *height, file_name: file_name.as_deref() };
    let written = format.write_labelled(&facts, &instances)?;
    let data_yaml = write_marks(output, &written, &facts, &instances)?;
    let labels = instances.into_iter().map(|instance| instance.annotation.label).collect();
    Ok(ConvertedAnnotation {
        input_format: file.format,
        image: declared,
        labels,
        left_out: written.left_out,
        data_yaml,
    })
}

fn marks_on(file: &AnnotationFile, path: &Path) -> Result<(DeclaredImage, Vec<LabelledInstance>)> {
    let image = read_image(path)?;
    let file_name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let declared = DeclaredImage { file_name, width: image.width(), height: image.height() };
    Ok((declared, file.objects_on(path, &image)?))
}

/// The marks on the only image that the file declares.
fn declared_marks(file: &AnnotationFile, path: &Path) -> Result<(DeclaredImage, Vec<LabelledInstance>)> {
    let mut all = AnnotationFormat::declared_images(file.bytes()).with_context(|| path.display().to_string())?;
    let declared = match all.len() {
        1 => all.remove(0),
        0 => return Err(ImageError::NoSize { path: path.to_owned() }.into()),
        count => return Err(ImageError::Several { count, path: path.to_owned() }.into()),
    };
    let DeclaredImage { file_name, width, height } = &declared;
    let facts = ImageFacts { width: *width, height: *height, file_name: file_name.as_deref() };
    let objects = file.objects(&facts)?;
    file.report_skipped(&facts);
    Ok((declared, objects))
}
