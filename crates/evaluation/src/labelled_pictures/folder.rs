//! A folder of labelled pictures: assigns label files to pictures, and reads their contents.
//!
//! LabelMe has a JSON file of the same name beside each picture, COCO one file for the folder; `sdg annotate` writes
//! COCO beside the picture; if a.json is another tool's file, it writes a.coco.json, which then replaces a.json.
//! Changes of a.png in a common file labels.json are in labels.a.png.coco.json, which replaces labels.json for a.png. A
//! file with the labels of one picture belongs to the picture with the file's name, even if another picture is named in
//! the file, because people rename files. Every other label file belongs to the pictures that it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use nalgebra::Point2;
use sdg_cell::Perception;
use sdg_demonstration::{
    AnnotationFormat, Error, IMAGE_EXTENSIONS, ImageFacts, LabelFile, LabelledInstance, PixelFrame,
};
use sdg_files::changes_of;
use sdg_grasp::GraspModel;
use sdg_inputs::marks_check::MarkedPhoto;
use sdg_inputs::why_unreadable;

use super::picture::{Instance, LabelledPicture, LeftOut, file_name};
use super::taught::taught_grasps;
use super::truth_file::{TRUTH_FILE, TruthEntry, read_truth};
use crate::error::EvaluationError;

/// Maximum distance between the middle of an instance's grasp line and the grasp point of a demonstration, in lengths
/// of the line. Within this distance, both are the same instance.
const MAX_TAUGHT_DISTANCE_LENGTHS: f64 = 0.1;

/// The pictures for testing a model.
#[derive(Debug, Clone)]
pub struct LabelledFolder {
    pub pictures: Vec<LabelledPicture>,
    /// Files of the folder that are left out.
    pub left_out: Vec<LeftOut>,
    /// Number of instances with labels of other objects.
    pub others: usize,
    /// The label of all instances, if it is not the model's object and none was given: they count as the part.
    pub foreign_label: Option<String>,
}

impl LabelledFolder {
    /// Checks every label of a folder against its picture, before a model is taught.
    ///
    /// # Errors
    /// As for [`Self::read`], except for errors that depend on a model.
    pub fn check_labels(folder: &Path) -> Result<()> {
        if folder.join(TRUTH_FILE).exists() {
            return TruthEntry::read_all(folder).map(drop);
        }
        read_labels(folder, None, &mut Vec::new()).map(drop)
    }

    /// Reads every label and checks it against its picture, before the detection, which takes long.
    ///
    /// With `label`, only instances with this label count. Otherwise, if there are several labels, only the model's
    /// object counts; a single label counts even if it is not the model's object. If there is a `truth.json`, no other
    /// label is read.
    ///
    /// # Errors
    /// The folder has no pictures or labels; a label file is damaged or names a missing picture; marks are outside the
    /// picture or for another picture size; two files label the same picture; an instance that is not optional has no
    /// grasp; with a calibrated camera, a picture is stored rotated; no instance has the given label, which is not the
    /// model's object either; without a given label, there are several labels, and none is the model's object; the model
    /// was taught from all pictures.
    pub fn read(folder: &Path, detector: &Perception, label: Option<&str>) -> Result<Self> {
        let mut left_out = Vec::new();
        let (mut others, mut foreign_label) = (0, None);
        let read = if folder.join(TRUTH_FILE).exists() {
            read_truth(folder, detector, &mut left_out)?
        } else {
            let read = read_labels(folder, Some(detector), &mut left_out)?;
            let label = chosen_label(folder, &read, detector.model(), label)?;
            let all = || read.iter().flat_map(|picture| &picture.instances);
            others = all().filter(|instance| !is_counted(instance, label.as_deref())).count();
            if label.is_none() {
                let mut labels = all().map(|instance| &instance.annotation.label);
                foreign_label = labels.find(|label| *label != detector.model().object()).cloned();
            }
            read.into_iter().map(|picture| picture.counted(label.as_deref())).collect::<Result<_>>()?
        };
        let mut pictures = Vec::new();
        for (mut picture, taught) in read {
            mark_taught(&mut picture.instances, &taught);
            if !taught.is_empty() && picture.instances.iter().all(|instance| instance.optional) {
                left_out.push(LeftOut { file: picture.name(), why: "the model was taught from it".to_owned() });
            } else {
                if detector.pixel_frame() == PixelFrame::Sensor {
                    sdg_inputs::check_is_not_turned(&picture.path)?;
                }
                pictures.push(picture);
            }
        }
        if pictures.is_empty() {
            bail!(
                "{}: expected labelled pictures that the model was not taught from, found only {}",
                folder.display(),
                left_out.iter().map(|left_out| left_out.file.as_str()).collect::<Vec<_>>().join(", ")
            );
        }
        left_out.sort_by(|a, b| a.file.cmp(&b.file));
        Ok(Self { pictures, left_out, others, foreign_label })
    }
}

/// Reads all labels. Without a detector, the pictures are not compared with a model's demonstrations.
fn read_labels(folder: &Path, detector: Option<&Perception>, left_out: &mut Vec<LeftOut>) -> Result<Vec<ReadPicture>> {
    let assigned = assign(folder, left_out)?;
    let read = assigned.pictures.iter().map(|(picture, labels)| {
        let (path, file) = &assigned.label_files[*labels];
        read_picture(picture, path, file, detector)
    });
    read.collect()
}

/// The index of the label file of each picture.
struct Assigned {
    pictures: BTreeMap<PathBuf, usize>,
    label_files: Vec<(PathBuf, LabelFile)>,
}

fn assign(folder: &Path, left_out: &mut Vec<LeftOut>) -> Result<Assigned> {
    let paths: Vec<PathBuf> = sdg_files::entries(folder)?.into_iter().filter(|path| path.is_file()).collect();
    let pictures: Vec<&PathBuf> =
        paths.iter().filter(|path| sdg_files::has_extension(path, &IMAGE_EXTENSIONS)).collect();
    if pictures.is_empty() {
        let known = IMAGE_EXTENSIONS.join(", ");
        bail!("{}: expected pictures ({known}), found none among {} files", folder.display(), paths.len());
    }
    // Photos in unsupported formats, such as those of phones, are listed, so that the user learns that they were not
    // tested.
    let unreadable = |path: &PathBuf| Some(LeftOut { file: file_name(path), why: why_unreadable(path)? });
    left_out.extend(paths.iter().filter_map(unreadable));
    let mut assigned = Assigned { pictures: BTreeMap::new(), label_files: Vec::new() };
    for path in paths.iter().filter(|path| sdg_files::has_extension(path, &["json"])) {
        let has_its_name = |picture: &&PathBuf| {
            picture.file_stem() == path.file_stem() || picture.with_extension("coco.json") == *path
        };
        let same_name: Vec<&PathBuf> = pictures.iter().copied().filter(has_its_name).collect();
        let bytes = sdg_files::read(path, sdg_inputs::MAX_ANNOTATION_BYTES)?;
        let file = match LabelFile::parse(&bytes) {
            // Other programs store JSON beside pictures as well.
            Err(Error::WrongFile { .. }) if same_name.is_empty() => {
                let why = "neither LabelMe nor COCO JSON, and no picture has its name".to_owned();
                left_out.push(LeftOut { file: file_name(path), why });
                continue;
            }
            file => file.with_context(|| path.display().to_string())?,
        };
        let labelled = labelled_by(path, &file, &same_name, folder)?;
        let label_file_idx = assigned.label_files.len();
        assigned.label_files.push((path.clone(), file));
        for picture in labelled {
            let Some(first) = assigned.pictures.insert(picture.clone(), label_file_idx) else { continue };
            let first_path = &assigned.label_files[first].0;
            let (used, used_path, other) = if *first_path == changes_of(&picture, path) {
                (first, first_path, path)
            } else if *path == changes_of(&picture, first_path) {
                (label_file_idx, path, first_path)
            } else {
                bail!(
                    "{}: expected one label file, found two: {} and {}",
                    picture.display(),
                    file_name(first_path),
                    file_name(path)
                );
            };
            let why = format!("{} is used for {}", file_name(used_path), file_name(&picture));
            left_out.push(LeftOut { file: file_name(other), why });
            assigned.pictures.insert(picture, used);
        }
    }
    if assigned.pictures.is_empty() {
        bail!(
            "{}: expected labels (LabelMe: a JSON file of the same name beside each picture; COCO: one JSON file with \
             `images` and `annotations`), found {} pictures and none",
            folder.display(),
            pictures.len()
        );
    }
    for picture in pictures.iter().filter(|picture| !assigned.pictures.contains_key(picture.as_path())) {
        left_out.push(LeftOut { file: file_name(picture), why: "no label file names it".to_owned() });
    }
    Ok(assigned)
}

/// The pictures that a label file labels.
fn labelled_by(path: &Path, file: &LabelFile, same_name: &[&PathBuf], folder: &Path) -> Result<Vec<PathBuf>> {
    let names = file.picture_names().with_context(|| path.display().to_string())?;
    let is_of_one_picture = file.format() == AnnotationFormat::LabelMe || names.len() == 1;
    if let (true, [only]) = (is_of_one_picture, same_name) {
        return Ok(vec![(*only).clone()]);
    }
    if names.is_empty() && file.format() == AnnotationFormat::LabelMe {
        bail!(
            "{}: expected a picture of the same name beside it, or its name as `imagePath`, found neither",
            path.display()
        );
    }
    let picture = |name: &String| {
        let picture = folder.join(name);
        if !picture.is_file() {
            bail!("{}: expected the picture {name} that it labels beside it, found no such file", path.display());
        }
        if !sdg_files::has_extension(&picture, &IMAGE_EXTENSIONS) {
            let known = IMAGE_EXTENSIONS.join(", ");
            bail!("{}: expected the name of a picture ({known}), found {name}", path.display());
        }
        Ok(picture)
    };
    names.iter().map(picture).collect()
}

/// A picture with all labelled instances, whatever their labels.
struct ReadPicture {
    path: PathBuf,
    labels: PathBuf,
    size: [u32; 2],
    instances: Vec<LabelledInstance>,
    /// Grasp points of the model's own demonstrations that were cut out of this picture.
    taught: Vec<Point2<f64>>,
}

fn read_picture(path: &Path, labels: &Path, file: &LabelFile, detector: Option<&Perception>) -> Result<ReadPicture> {
    let image = sdg_inputs::read_image(path)?;
    let (width, height) = image.dimensions();
    let name = file_name(path);
    let marked = MarkedPhoto { photo: path, image: &image, marks: labels, bytes: &[], file_name: Some(&name) };
    let read =
        |facts: &ImageFacts| file.instances(facts).with_context(|| format!("{}, labels of {name}", labels.display()));
    let instances = marked.upright(read, |instance: &LabelledInstance| &instance.annotation)?;
    let taught = match detector {
        Some(detector) => detector.taught_grasps(&image, taught_grasps).with_context(|| path.display().to_string())?,
        None => Vec::new(),
    };
    Ok(ReadPicture { path: path.to_owned(), labels: labels.to_owned(), size: [width, height], instances, taught })
}

impl ReadPicture {
    /// The picture with the instances that count, and the grasp points of demonstrations in it.
    fn counted(self, label: Option<&str>) -> Result<(LabelledPicture, Vec<Point2<f64>>)> {
        let counted = self.instances.iter().filter(|instance| is_counted(instance, label));
        let instances = counted.map(|instance| {
            let annotation = &instance.annotation;
            if !instance.optional {
                annotation.require_grasp().with_context(|| format!("{}, {}", self.labels.display(), instance.place))?;
            }
            let (bbox, grasp) = (annotation.bbox, annotation.grasp);
            Ok(Instance { bbox, grasp, optional: instance.optional, extent: None })
        });
        let instances = instances.collect::<Result<Vec<_>>>()?;
        Ok((
            LabelledPicture { path: self.path, labels: self.labels, size: self.size, instances, kind: None },
            self.taught,
        ))
    }
}

/// Makes an instance optional if the model was taught from it, because finding it again tests nothing. If no label marks
/// the taught grasp, it is the instance around it, whose label marks another grasp.
fn mark_taught(instances: &mut [Instance], taught: &[Point2<f64>]) {
    for taught in taught {
        let is_taught = |instance: &Instance| {
            instance
                .grasp
                .is_some_and(|grasp| (taught - grasp.center()).norm() <= MAX_TAUGHT_DISTANCE_LENGTHS * grasp.length())
        };
        if instances.iter().any(is_taught) {
            instances.iter_mut().for_each(|instance| instance.optional |= is_taught(instance));
            continue;
        }
        let distance = |instance: &&mut Instance| (taught - instance.bbox.center()).norm();
        let around = instances.iter_mut().filter(|instance| instance.bbox.contains(taught));
        if let Some(instance) = around.min_by(|one, other| distance(one).total_cmp(&distance(other))) {
            instance.optional = true;
        }
    }
}

fn is_counted(instance: &LabelledInstance, label: Option<&str>) -> bool {
    label.is_none_or(|label| instance.annotation.label == label)
}

/// The label that counts. `None` if no label is given and all instances have the same label, even if it is not the
/// model's object. Pictures without instances of the model's object are pictures without the part.
fn chosen_label(
    folder: &Path,
    pictures: &[ReadPicture],
    model: &GraspModel,
    label: Option<&str>,
) -> Result<Option<String>> {
    let instances = pictures.iter().flat_map(|picture| &picture.instances);
    let labels: BTreeSet<&str> = instances.map(|instance| instance.annotation.label.as_str()).collect();
    let listed = || labels.iter().copied().collect::<Vec<_>>().join(", ");
    match label {
        Some(label) if labels.contains(label) || labels.is_empty() || label == model.object() => {
            Ok(Some(label.to_owned()))
        }
        Some(label) => bail!("{}: expected instances labelled {label}, found {}", folder.display(), listed()),
        None if labels.len() <= 1 => Ok(None),
        None if labels.contains(model.object()) => Ok(Some(model.object().to_owned())),
        None => Err(EvaluationError::SeveralLabels {
            folder: folder.to_owned(),
            object: model.object().to_owned(),
            found: listed(),
        }
        .into()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use sdg_geometry::{BoundingBox, GraspLine};
    use serde_json::json;

    use super::*;

    #[test]
    fn changes_of_one_picture_replace_a_common_file_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let write = |file: &str, pictures: &[&str]| {
            let images: Vec<_> = pictures.iter().map(|name| json!({"id": name.len(), "file_name": name})).collect();
            fs::write(at(file), json!({"images": images, "annotations": []}).to_string()).unwrap();
        };
        // One file for changes is before the common file in order, the other one after it.
        let pictures = ["a.png", "photo.png", "z.jpeg"];
        pictures.iter().for_each(|name| fs::write(at(name), "").unwrap());
        write("labels.json", &pictures);
        for changed in ["a.png", "z.jpeg"] {
            write(&format!("labels.{changed}.coco.json"), &[changed]);
        }
        let mut left_out = Vec::new();
        let assigned = assign(folder.path(), &mut left_out).unwrap();
        let used = |name: &str| file_name(&assigned.label_files[assigned.pictures[&at(name)]].0);
        assert_eq!(pictures.map(used), ["labels.a.png.coco.json", "labels.json", "labels.z.jpeg.coco.json"]);
        let told: Vec<_> = left_out.iter().map(|left_out| (left_out.file.as_str(), left_out.why.as_str())).collect();
        let expected = |name: &str| format!("labels.{name}.coco.json is used for {name}");
        assert_eq!(told, [("labels.json", &*expected("a.png")), ("labels.json", &*expected("z.jpeg"))]);
        // Another second file is an error.
        write("more.json", &["photo.png"]);
        let refused = assign(folder.path(), &mut left_out).err().unwrap().to_string();
        assert!(refused.contains("expected one label file, found two: labels.json and more.json"), "{refused}");
    }

    #[test]
    fn the_taught_instance_is_optional_even_if_its_label_marks_another_grasp() {
        let instance = |x1: f64, grasp_x: f64| Instance {
            bbox: BoundingBox { x1, y1: 0.0, x2: x1 + 100.0, y2: 40.0 },
            grasp: Some(GraspLine::new(Point2::new(grasp_x - 20.0, 20.0), Point2::new(grasp_x + 20.0, 20.0))),
            optional: false,
            extent: None,
        };
        let optional = |taught_x: f64| {
            // The second one lies partly over the first one.
            let mut instances = [instance(0.0, 30.0), instance(60.0, 110.0)];
            mark_taught(&mut instances, &[Point2::new(taught_x, 20.0)]);
            instances.map(|instance| instance.optional)
        };
        assert_eq!(optional(33.0), [true, false]);
        assert_eq!(optional(108.0), [false, true]);
        // Another grasp of the first one; the boxes of both contain it.
        assert_eq!(optional(70.0), [true, false]);
        assert_eq!(optional(200.0), [false, false]);
    }
}
