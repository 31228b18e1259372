//! Annotation files on disk. Some formats keep a part of the data in a second file.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_demonstration::{Annotation, AnnotationFormat, ImageFacts, LabelledInstance, WrittenAnnotation};
use sdg_files::{DATA_YAML, data_yaml_of, marks_of_photo, other_npy_of};

use crate::marks_check::MarkedPhoto;

/// Maximum size of an annotation file with an embedded image.
pub const MAX_ANNOTATION_BYTES: u64 = 512 << 20;

/// An annotation file and the files that belong to it.
pub struct AnnotationFile {
    /// The format, recognised by the content.
    pub format: AnnotationFormat,
    path: PathBuf,
    bytes: Vec<u8>,
    beside: Option<(PathBuf, Vec<u8>)>,
}

impl AnnotationFile {
    /// Reads a file of any format.
    ///
    /// # Errors
    /// The file cannot be read, or its format is unknown.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = sdg_files::read(path, MAX_ANNOTATION_BYTES)?;
        let format = AnnotationFormat::of(&bytes).with_context(|| path.display().to_string())?;
        let beside = match beside(path, format) {
            Some(beside) => {
                let bytes = sdg_files::read(&beside, MAX_ANNOTATION_BYTES)?;
                Some((beside, bytes))
            }
            None => None,
        };
        Ok(Self { format, path: path.to_owned(), bytes, beside })
    }

    /// The marks on one image.
    ///
    /// # Errors
    /// The errors of [`Annotation::read_with`].
    pub fn objects(&self, image: &ImageFacts) -> Result<Vec<LabelledInstance>> {
        let beside = self.beside.as_ref().map(|(_, bytes)| bytes.as_slice());
        LabelledInstance::read_with(&self.bytes, beside, image).with_context(|| match &self.beside {
            Some((beside, _)) => format!("{} with {}", self.path.display(), beside.display()),
            None => self.path.display().to_string(),
        })
    }

    /// The marks on a photo, read upright and checked against its pixels. Entries that do not mark a part are printed.
    ///
    /// # Errors
    /// The errors of [`Self::objects`], [`MarkedPhoto::checked`] and [`Annotation::check`].
    pub fn objects_on(&self, photo: &Path, image: &RgbImage) -> Result<Vec<LabelledInstance>> {
        let path = std::path::absolute(photo).unwrap_or_else(|_| photo.to_owned());
        let marked = MarkedPhoto { photo, image, marks: &self.path, bytes: &self.bytes, file_name: path.to_str() };
        let objects =
            marked.checked(|facts| self.objects(facts), |instance: &LabelledInstance| &instance.annotation)?;
        objects
            .iter()
            .try_for_each(|instance| instance.annotation.check())
            .with_context(|| self.path.display().to_string())?;
        // After all fallible steps, so that an error is printed alone.
        let (width, height) = image.dimensions();
        self.report_skipped(&ImageFacts { width, height, file_name: path.to_str() });
        Ok(objects)
    }

    /// Prints the entries for an image that do not mark a part.
    pub fn report_skipped(&self, image: &ImageFacts) {
        for foreign in Annotation::passed_over(&self.bytes, image) {
            sdg_files::print_stderr(format_args!("{}: skipped {foreign}\n", self.path.display()));
        }
    }

    /// The contents of the annotation file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Finds the marks of a photo among [`marks_of_photo`].
///
/// # Errors
/// No such file exists. The message lists the searched names and how to create one.
pub fn beside_photo(photo: &Path) -> Result<PathBuf> {
    let looked_for = marks_of_photo(photo);
    match looked_for.iter().find(|path| path.is_file()) {
        Some(found) => Ok(found.clone()),
        None => {
            let listed: Vec<String> = looked_for.iter().map(|path| path.display().to_string()).collect();
            bail!(
                "{0}: expected its marks beside it (.json: COCO or LabelMe; .txt: YOLO-pose), found none of {1}; `sdg annotate \
                 {0}` makes them, IMAGE:ANNOTATION names another file",
                photo.display(),
                listed.join(", ")
            )
        }
    }
}

/// The second file that [`AnnotationFile::read`] reads for this annotation file; `None` if there is none, or if the
/// annotation file cannot be read.
pub fn file_beside(annotation: &Path) -> Option<PathBuf> {
    let bytes = sdg_files::read(annotation, MAX_ANNOTATION_BYTES).ok()?;
    beside(annotation, AnnotationFormat::of(&bytes).ok()?)
}

/// The file that belongs to `path`, if it exists.
fn beside(path: &Path, format: AnnotationFormat) -> Option<PathBuf> {
    match format {
        AnnotationFormat::OpenDr => other_npy_of(path),
        AnnotationFormat::YoloPose => data_yaml_of(path),
        _ => None,
    }
}

/// Writes the marks, and their labels beside them if the format has them in a second file and readers of the output
/// would find none. Returns the path of the file with the labels.
///
/// # Errors
/// An existing file contradicts the labels (then nothing is written), or files cannot be read or written.
pub fn write_marks(
    output: &Path,
    written: &WrittenAnnotation,
    image: &ImageFacts,
    instances: &[LabelledInstance],
) -> Result<Option<PathBuf>> {
    let existing = written.data_yaml.as_ref().and_then(|_| beside(output, AnnotationFormat::YoloPose));
    if let Some(path) = &existing {
        check_labels(path, written, image, instances)?;
    }
    sdg_files::write(output, written.text.as_bytes())?;
    match &written.data_yaml {
        Some(text) if existing.is_none() => {
            let path = output.with_file_name(DATA_YAML);
            sdg_files::write(&path, text.as_bytes())?;
            Ok(Some(path))
        }
        _ => Ok(existing),
    }
}

/// Checks that an existing file gives these objects their labels and the direction of their grasps.
fn check_labels(
    path: &Path,
    written: &WrittenAnnotation,
    image: &ImageFacts,
    instances: &[LabelledInstance],
) -> Result<()> {
    let there = sdg_files::read(path, MAX_ANNOTATION_BYTES)?;
    let read = Annotation::read_with(written.text.as_bytes(), Some(&there), image)
        .with_context(|| path.display().to_string())?;
    for (found, expected) in read.iter().zip(instances.iter().map(|instance| &instance.annotation)) {
        if found.label != expected.label {
            bail!(
                "{}: expected its first classes to be named as in this annotation (`{}`), found `{}`: \
                 write into another folder",
                path.display(),
                expected.label,
                found.label
            );
        }
        let is_reversed = found.grasp.zip(expected.grasp).is_some_and(|(found, expected)| {
            (found.start - expected.end).norm() < (found.start - expected.start).norm()
        });
        if is_reversed {
            bail!(
                "{}: expected no `kpt_names`, or `grasp_start` before `grasp_end` as in the written lines, found the \
                 other order: write into another folder",
                path.display()
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn marks_stand_beside_their_photo() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("images/train")).unwrap();
        fs::create_dir_all(at("labels/train")).unwrap();
        let none = beside_photo(&at("images/train/a.jpg")).unwrap_err().to_string();
        for looked_for in ["images/train/a.json", "images/train/a.txt", "labels/train/a.txt", "sdg annotate"] {
            assert!(none.contains(looked_for), "{none}");
        }
        // In ascending order of preference: each file is found although the previous ones exist.
        for name in ["labels/train/a.txt", "images/train/a.txt", "images/train/a.json", "images/train/a.coco.json"] {
            fs::write(at(name), "").unwrap();
            assert_eq!(beside_photo(&at("images/train/a.jpg")).unwrap(), at(name));
        }
    }

    #[test]
    fn a_dataset_that_would_reverse_the_grasp_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (labels, output) = (folder.path().join(DATA_YAML), folder.path().join("a.txt"));
        let image = ImageFacts { width: 640, height: 480, file_name: None };
        let data_yaml = "kpt_shape: [2, 3]\nnames: [rod]\n";
        let marks = b"0 0.5 0.5 0.25 0.5 0.4 0.5 2 0.6 0.5 2\n";
        let objects = Annotation::read_with(marks, Some(data_yaml.as_bytes()), &image).unwrap();
        let written = AnnotationFormat::YoloPose.write(&image, &objects).unwrap();
        let instances: Vec<_> = objects.into_iter().map(|object| LabelledInstance::new(object, false)).collect();
        let write_beside = |names: &str| {
            fs::write(&labels, format!("{data_yaml}kpt_names:\n  0: [{names}]\n")).unwrap();
            write_marks(&output, &written, &image, &instances)
        };
        let refused = write_beside("grasp_end, grasp_start").unwrap_err().to_string();
        assert!(refused.contains("kpt_names") && !output.exists(), "{refused}");
        assert_eq!(write_beside("grasp_start, grasp_end").unwrap(), Some(labels.clone()));
        assert!(output.exists());
    }

    #[test]
    fn what_stands_beside_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("labels/train")).unwrap();
        for name in ["boxes_train.npy", "kps_train.npy", "boxes_val.npy", DATA_YAML, "labels/train/a.txt"] {
            fs::write(at(name), "").unwrap();
        }
        let found = |name: &str, format| beside(&at(name), format);
        assert_eq!(found("boxes_train.npy", AnnotationFormat::OpenDr), Some(at("kps_train.npy")));
        assert_eq!(found("kps_train.npy", AnnotationFormat::OpenDr), Some(at("boxes_train.npy")));
        assert_eq!(found("boxes_val.npy", AnnotationFormat::OpenDr), None);
        assert_eq!(found("labels/train/a.txt", AnnotationFormat::YoloPose), Some(at(DATA_YAML)));
        // `..` leads upwards, although its parent in the path is below.
        let above = folder.path().canonicalize().unwrap().join(DATA_YAML);
        assert_eq!(found("labels/train/../train/a.txt", AnnotationFormat::YoloPose), Some(above));
        assert_eq!(found("labels/train/a.json", AnnotationFormat::Coco), None);
    }
}
