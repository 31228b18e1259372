//! The file with the marks of a picture: read in any format of `sdg_demonstration`, written as COCO.
//!
//! ```text
//! photo.png ─┬─ photo.coco.json   where marks are written if photo.json is another tool's file
//!            ├─ photo.json        where marks are written otherwise
//!            └─ photo.txt         YOLO-pose, also in the folder labels of a dataset: only read
//! photo.png:all.json ─┬─ all.photo.png.coco.json   where marks are written if all.json is another tool's file
//!                     └─ all.json                  where marks are written otherwise
//! ```
//!
//! A file with more information than the page would write back (LabelMe's flags, further objects, further pictures) is
//! read and never written.

use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use sdg_demonstration::{Annotation, AnnotationFormat, ImageFacts};
use sdg_files::{changes_of, data_yaml_of, marks_of_photo, other_npy_of, write_atomically};
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::names::file_name;

/// Maximum size of an annotation file.
const MAX_BYTES: u64 = 64 << 20;
/// Smaller differences of the times of two files are those of copying them.
const MIN_LATER: Duration = Duration::from_secs(10);

/// The contents of the annotation file when a picture is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct Opened {
    /// The object's name, if an object is marked.
    pub label: Option<String>,
    /// Its marks; empty if nothing is marked.
    pub marks: Marks,
    /// Path that marks will be written to.
    pub path: PathBuf,
    /// Path of the existing file; `None` if the picture has none.
    pub found: Option<PathBuf>,
    /// A note about the file for the user.
    pub note: Option<String>,
}

impl Opened {
    /// Whether the marks make a picture of a folder a photo of the part. In a text file a grasp is required: boxes may
    /// be labels of another dataset.
    pub fn is_of_photo(&self) -> bool {
        let is_text = self.found.as_ref().is_some_and(|path| path.extension().is_some_and(|kind| kind == "txt"));
        self.marks.has_object() && (self.marks.grasp.is_some() || !is_text)
    }
}

/// The files that may have the marks of a picture whose marks are in `annotation`, the preferred one first: the file
/// for changes if `annotation` is another tool's file, the one for changes by earlier programs, and `annotation`.
pub fn files_of(picture: &Path, annotation: &Path) -> [PathBuf; 3] {
    [changes_of(picture, annotation), annotation.with_extension("coco.json"), annotation.to_owned()]
}

/// Reads the marks of a picture from the first existing file of [`files_of`] or, without `annotation`, of
/// [`marks_of_photo`]. A text file that was not named may be about anything: if it cannot be read as marks, a note says
/// so.
///
/// # Errors
/// The file exists but cannot be read, is no annotation, or belongs to another picture.
pub fn open(picture: &Path, annotation: Option<&Path>, size: [u32; 2]) -> Result<Opened> {
    let beside = picture.with_extension("json");
    let files = files_of(picture, annotation.unwrap_or(&beside));
    let [spare, earlier, own] = &files;
    let facts = ImageFacts { width: size[0], height: size[1], file_name: picture.file_name().and_then(OsStr::to_str) };
    let searched = annotation.map_or_else(|| marks_of_photo(picture), |_| files.to_vec());
    let mut unread = None;
    for path in &searched {
        let is_named = files.contains(path);
        // Earlier programs wrote the changes of every picture of a file to this one.
        if path == earlier && earlier != spare && is_of_others(path, &file_name(picture)) {
            continue;
        }
        let (bytes, objects) = match read(path, is_named, &facts) {
            Ok(Some(read)) => read,
            Ok(None) => continue,
            Err(error) if is_named => return Err(error),
            Err(error) => {
                unread = Some(format!("{error}; this file is not read as marks."));
                continue;
            }
        };
        let writable = is_ours(&bytes);
        let other = if is_named { spare } else { own };
        let target = if writable { path } else { other };
        let note = match (objects.len(), writable) {
            (0 | 1, true) if path != own && is_newer(own, path) => Some(format!(
                "{0} was written after {1}, and its marks are not shown: the marks are those in {1}. Without {1}, {0} \
                 is read.",
                file_name(own),
                file_name(path)
            )),
            (0 | 1, true) => None,
            (0 | 1, false) => {
                Some(format!("{} is kept unchanged; changes go to {}.", file_name(path), file_name(target)))
            }
            (count, _) => Some(format!(
                "{} marks {count} objects; the first is shown. Changes go to {}.",
                file_name(path),
                file_name(other)
            )),
        };
        let target = if objects.len() > 1 { other } else { target };
        let first = objects.first();
        return Ok(Opened {
            label: first.map(|object| object.label.clone()),
            marks: first.map(Marks::of).unwrap_or_default(),
            path: target.clone(),
            found: Some(path.clone()),
            note,
        });
    }
    Ok(Opened { label: None, marks: Marks::default(), path: own.clone(), found: None, note: unread })
}

/// Whether a file is a COCO file of other pictures only.
fn is_of_others(path: &Path, picture: &str) -> bool {
    let bytes = read_if_there(path).ok().flatten();
    let file = bytes.and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    let is_other = |image: &Value| image["file_name"].as_str().is_some_and(|name| name != picture);
    file.is_some_and(|file| file["images"].as_array().is_some_and(|images| images.iter().all(is_other)))
}

/// Whether a file was written later than another one, and not only copied later.
fn is_newer(one: &Path, other: &Path) -> bool {
    let written = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified());
    let is_later = |one: SystemTime, other| one.duration_since(other).is_ok_and(|later| later > MIN_LATER);
    written(one).is_ok_and(|one| written(other).is_ok_and(|other| is_later(one, other)))
}

/// The bytes of a file and the objects in it; `None` without a file, and for another text that was not named.
fn read(path: &Path, is_named: bool, facts: &ImageFacts) -> Result<Option<(Vec<u8>, Vec<Annotation>)>> {
    let Some(bytes) = read_if_there(path)? else { return Ok(None) };
    let format = AnnotationFormat::of(&bytes);
    // The text of a picture without the part is empty.
    if !is_named && format != Ok(AnnotationFormat::YoloPose) {
        return Ok(None);
    }
    let second = match format {
        Ok(AnnotationFormat::YoloPose) => data_yaml_of(path),
        Ok(AnnotationFormat::OpenDr) => other_npy_of(path),
        _ => None,
    };
    let second = second.map(|path| read_if_there(&path)).transpose()?.flatten();
    match Annotation::read_with(&bytes, second.as_deref(), facts) {
        Ok(objects) => Ok(Some((bytes, objects))),
        Err(sdg_demonstration::Error::NoObject { .. }) => Ok(Some((bytes, Vec::new()))),
        Err(source) => Err(Error::Demonstration { name: path.display().to_string(), source }),
    }
}

fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>> {
    match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(Error::file(path, "cannot read")(source)),
        Ok(metadata) if metadata.len() > MAX_BYTES => {
            return Err(Error::TooLarge { path: path.to_owned(), most: MAX_BYTES, found: metadata.len() });
        }
        Ok(_) => {}
    }
    fs::read(path).map(Some).map_err(Error::file(path, "cannot read"))
}

/// Whether the file is a COCO file of one picture with at most one object and no information that [`Marks::to_coco`]
/// would drop. Such a file may be overwritten.
fn is_ours(bytes: &[u8]) -> bool {
    let Ok(Value::Object(file)) = serde_json::from_slice(bytes) else { return false };
    let count = |name: &str| file.get(name).and_then(Value::as_array).map_or(0, Vec::len);
    let only_known = |value: &Value, known: &[&str]| {
        value.as_object().is_some_and(|object| object.keys().all(|key| known.contains(&key.as_str())))
    };
    let items = |name: &str| file.get(name).and_then(Value::as_array).into_iter().flatten();
    const ANNOTATION: [&str; 10] = [
        "id",
        "image_id",
        "category_id",
        "bbox",
        "area",
        "iscrowd",
        "segmentation",
        "keypoints",
        "num_keypoints",
        "attributes",
    ];
    file.keys().all(|key| ["images", "annotations", "categories"].contains(&key.as_str()))
        && count("images") == 1
        && count("annotations") <= 1
        && count("categories") <= 1
        && items("images").all(|image| only_known(image, &["id", "file_name", "width", "height"]))
        && items("annotations").all(|object| {
            only_known(object, &ANNOTATION)
                && object.get("attributes").is_none_or(|a| only_known(a, &["jaw_width", "grasp_offset"]))
        })
        && items("categories").all(|category| {
            only_known(category, &["id", "name", "keypoints", "skeleton"])
                && category.get("keypoints").is_none_or(|names| *names == json!(["grasp_start", "grasp_end"]))
        })
}

/// Writes the marks atomically. If nothing is marked, no file exists and the picture had no marks when it was opened
/// (`was_marked`), creates no file and returns `false`. Marks in a file that is only read return unless an empty file
/// precedes it.
///
/// # Errors
/// The marks are unsuitable for teaching, or the file cannot be written.
pub fn save(path: &Path, marks: &Marks, label: &str, picture: &str, size: [u32; 2], was_marked: bool) -> Result<bool> {
    if !marks.has_object() && !was_marked && !path.exists() {
        return Ok(false);
    }
    let facts = ImageFacts { width: size[0], height: size[1], file_name: Some(picture) };
    let text = marks.to_coco(label, &facts).map_err(|source| Error::Demonstration { name: picture.into(), source })?;
    write_atomically(path, text.as_bytes())?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marks::GraspMarks;
    use sdg_demonstration::CocoFile;

    const SIZE: [u32; 2] = [200, 100];

    fn marks() -> Marks {
        Marks {
            bbox: Some([10.0, 20.0, 110.0, 60.0]),
            grasp: Some(GraspMarks { start: [40.0, 40.0], end: [80.0, 40.0], jaw_width: 44.0 }),
            outline: None,
        }
    }

    #[test]
    fn saved_marks_are_opened_again_and_written_to_the_same_file() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("photo.png");
        let before = open(&picture, None, SIZE).unwrap();
        assert_eq!((before.marks, &before.path), (Marks::default(), &folder.path().join("photo.json")));
        assert!(!save(&before.path, &Marks::default(), "bar", "photo.png", SIZE, false).unwrap());
        assert!(!before.path.exists(), "nothing marked leaves no file behind");
        assert!(save(&before.path, &marks(), "bar", "photo.png", SIZE, false).unwrap());
        let after = open(&picture, None, SIZE).unwrap();
        assert_eq!((after.label.as_deref(), &after.marks), (Some("bar"), &marks()));
        assert_eq!((after.path, after.note), (before.path.clone(), None));
        // Clearing the marks also clears the file.
        assert!(save(&before.path, &Marks::default(), "bar", "photo.png", SIZE, false).unwrap());
        assert_eq!(open(&picture, None, SIZE).unwrap().marks, Marks::default());
    }

    #[test]
    fn another_tool_s_file_is_read_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("photo.png");
        let labelme = r#"{"flags": {"checked": true}, "imageWidth": 200, "imageHeight": 100, "shapes": [
            {"label": "bar", "shape_type": "rectangle", "points": [[10, 20], [110, 60]]}]}"#;
        fs::write(folder.path().join("photo.json"), labelme).unwrap();
        let opened = open(&picture, None, SIZE).unwrap();
        assert_eq!(opened.marks.bbox, Some([10.0, 20.0, 110.0, 60.0]));
        assert_eq!(opened.path, folder.path().join("photo.coco.json"));
        assert!(opened.note.as_ref().unwrap().contains("photo.json is kept unchanged"), "{opened:?}");
        save(&opened.path, &marks(), "bar", "photo.png", SIZE, true).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("photo.json")).unwrap(), labelme);
        let again = open(&picture, None, SIZE).unwrap();
        assert_eq!((again.marks, again.note), (marks(), None), "the newer file is the one that counts");
        // The tool's later changes are not read, and a note says so.
        let file = fs::File::options().write(true).open(folder.path().join("photo.json")).unwrap();
        let set = |secs| file.set_modified(SystemTime::now() + Duration::from_secs(secs)).unwrap();
        // A copy of both files may have been written in any order.
        set(3);
        assert_eq!(open(&picture, None, SIZE).unwrap().note, None);
        set(60);
        let later = open(&picture, None, SIZE).unwrap();
        assert_eq!(later.marks, marks());
        assert!(later.note.unwrap().starts_with("photo.json was written after photo.coco.json"));
    }

    #[test]
    fn pictures_with_marks_in_one_file_have_a_file_for_changes_each() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let mut all = CocoFile::new();
        for name in ["a.png", "b.png"] {
            all.push_image(name, SIZE[0], SIZE[1], &[]);
        }
        fs::write(at("all.json"), all.to_json()).unwrap();
        let read = |name: &str| open(&at(name), Some(&at("all.json")), SIZE).unwrap();
        let path = read("a.png").path;
        assert!(save(&path, &marks(), "bar", "a.png", SIZE, false).unwrap());
        let is_read = |name: &str| (read(name).marks.has_object(), read(name).path);
        assert_eq!(is_read("a.png"), (true, path.clone()));
        assert_eq!(is_read("b.png"), (false, at("all.b.png.coco.json")));
        // The file of earlier programs is read for its own picture.
        fs::rename(&path, at("all.coco.json")).unwrap();
        assert_eq!(is_read("a.png"), (true, at("all.coco.json")));
        assert_eq!(is_read("b.png"), (false, at("all.b.png.coco.json")));
    }

    #[test]
    fn yolo_marks_beside_the_photo_or_in_the_dataset_are_read_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for inner in ["images", "labels"] {
            fs::create_dir_all(at(inner)).unwrap();
        }
        fs::write(at("data.yaml"), "kpt_shape: [2, 3]\nnames: [rod, bar]\n").unwrap();
        let picture = at("images/photo.png");
        for (labels, row) in [("labels/photo.txt", "1 0.3 0.4 0.5 0.4\n"), ("images/photo.txt", "1 0.3 0.4 0.4 0.4\n")]
        {
            fs::write(at(labels), row).unwrap();
            let opened = open(&picture, None, SIZE).unwrap();
            assert_eq!((opened.label.as_deref(), opened.found), (Some("bar"), Some(at(labels))));
            assert_eq!(opened.path, at("images/photo.json"));
            assert!(opened.note.unwrap().contains("photo.txt is kept unchanged; changes go to photo.json"));
        }
        save(&at("images/photo.json"), &marks(), "bar", "photo.png", SIZE, true).unwrap();
        assert_eq!(open(&picture, None, SIZE).unwrap().marks, marks());
        // If all marks are removed, those of the text do not return.
        fs::remove_file(at("images/photo.json")).unwrap();
        assert!(save(&at("images/photo.json"), &Marks::default(), "bar", "photo.png", SIZE, true).unwrap());
        assert_eq!(open(&picture, None, SIZE).unwrap().marks, Marks::default());
        // The labels of a picture without the part, another text, and numbers that are no marks: a time with a figure,
        // and an oriented box.
        for (text, is_told) in [
            ("", false),
            ("photo of the first part\n", false),
            ("1699999999 3.2\n", true),
            ("0 0.1 0.1 0.4 0.1 0.4 0.4 0.1 0.4\n", true),
        ] {
            fs::write(at("labels/other.txt"), text).unwrap();
            let opened = open(&at("images/other.png"), None, SIZE).unwrap();
            assert_eq!((opened.found, opened.marks), (None, Marks::default()), "{text}");
            assert_eq!(opened.note.is_some_and(|note| note.contains("other.txt")), is_told, "{text}");
        }
        // Of unnamed texts, only those with a grasp make a picture of a folder a photo.
        for (row, is_of_photo) in [("1 0.3 0.4 0.4 0.4", false), ("1 0.3 0.4 0.4 0.4 0.2 0.4 2 0.4 0.4 2", true)] {
            fs::write(at("labels/other.txt"), row).unwrap();
            assert_eq!(open(&at("images/other.png"), None, SIZE).unwrap().is_of_photo(), is_of_photo, "{row}");
        }
    }

    #[test]
    fn a_coco_file_with_more_than_we_write_is_left_alone() {
        let text = marks().to_coco("bar", &ImageFacts { width: 200, height: 100, file_name: Some("p.png") }).unwrap();
        assert!(is_ours(text.as_bytes()));
        for (field, more) in [
            ("\"iscrowd\"", "\"track_id\": 3, \"iscrowd\""),
            ("\"images\"", "\"info\": {}, \"images\""),
            ("\"grasp_start\"", "\"tip\", \"grasp_start\""),
        ] {
            assert!(!is_ours(text.replacen(field, more, 1).as_bytes()), "{field}");
        }
    }

    #[test]
    fn a_broken_file_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("photo.json"), "{").unwrap();
        let error = open(&folder.path().join("photo.png"), None, SIZE).unwrap_err().to_string();
        assert!(error.contains("photo.json") && error.contains("not JSON"), "{error}");
    }
}
