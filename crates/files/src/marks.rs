//! Where the marks of a photo are, and the second file of formats that have two.

use std::path::{Path, PathBuf};

/// Name of the file with the labels of a YOLO dataset.
pub const DATA_YAML: &str = "data.yaml";
/// Other common names, which are tried after [`DATA_YAML`] in each folder.
const OTHER_DATA_YAML: [&str; 3] = ["data.yml", "dataset.yaml", "dataset.yml"];
/// Number of folders in which data.yaml is searched, from the label file's folder upwards, as in labels/train/a.txt.
const MAX_PARENT_FOLDERS: usize = 3;

/// The possible files of a photo's marks, the preferred ones first: `photo.coco.json`, `photo.json` (COCO or LabelMe)
/// and `photo.txt` (YOLO-pose); for a YOLO dataset with pictures below `images`, a text file of the photo's name below
/// `labels`. `sdg annotate` writes `photo.coco.json` only if another tool's `photo.json` must be kept.
pub fn marks_of_photo(photo: &Path) -> Vec<PathBuf> {
    let in_labels = |photo: &Path| {
        let folder = photo.parent()?;
        let mut parts: Vec<_> = folder.components().map(|part| part.as_os_str()).collect();
        let images = parts.iter().rposition(|part| *part == "images")?;
        parts[images] = "labels".as_ref();
        let folder: PathBuf = parts.into_iter().collect();
        Some(folder.join(photo.with_extension("txt").file_name()?))
    };
    ["coco.json", "json", "txt"]
        .map(|extension| photo.with_extension(extension))
        .into_iter()
        // The current folder may be `images` or below it.
        .chain(in_labels(photo).or_else(|| in_labels(&from_root(photo))))
        .collect()
}

/// The file into which `sdg annotate` writes a picture's marks if `marks`, from which it read them, is another tool's
/// file and must be kept: `a.coco.json` for the marks of a.png in `a.json`, `labels.a.png.coco.json` for those in
/// `labels.json`. Several pictures may have their marks in one file, so each has its own file for changes.
pub fn changes_of(picture: &Path, marks: &Path) -> PathBuf {
    if marks.file_stem() == picture.file_stem() {
        return marks.with_extension("coco.json");
    }
    let name = picture.file_name().unwrap_or_default();
    marks.with_extension(format!("{}.coco.json", name.to_string_lossy()))
}

/// The data.yaml of a YOLO label file, if there is one.
pub fn data_yaml_of(labels: &Path) -> Option<PathBuf> {
    let names = || std::iter::once(DATA_YAML).chain(OTHER_DATA_YAML);
    let folders = folders_above(labels).into_iter().take(MAX_PARENT_FOLDERS);
    folders.flat_map(|folder| names().map(move |name| folder.join(name))).find(|file| file.exists())
}

/// The other one of OpenDR's two files, `boxes*` and `kps*`, if there is one.
pub fn other_npy_of(npy: &Path) -> Option<PathBuf> {
    let name = npy.file_name()?.to_str()?;
    let other = match (name.strip_prefix("boxes"), name.strip_prefix("kps")) {
        (Some(rest), _) => format!("kps{rest}"),
        (_, Some(rest)) => format!("boxes{rest}"),
        _ => return None,
    };
    Some(npy.with_file_name(other)).filter(|other| other.exists())
}

/// The path from the root. `.` and `..` at its beginning are replaced; the names after them, also those of links, are
/// kept.
fn from_root(path: &Path) -> PathBuf {
    let start = path.ancestors().find(|start| start.file_name().is_none()).unwrap_or(path);
    let folder = if start.as_os_str().is_empty() { Path::new(".") } else { start };
    match (folder.canonicalize(), path.strip_prefix(start)) {
        (Ok(folder), Ok(rest)) => folder.join(rest),
        _ => path.to_owned(),
    }
}

/// The folder of a file and the folders above it. The names in the path are kept; folders above them have their path
/// from the root.
fn folders_above(path: &Path) -> Vec<PathBuf> {
    let named = path.ancestors().skip(1).take_while(|folder| folder.file_name().is_some()).count() + 1;
    let above = from_root(path);
    let above = above.ancestors().skip(1 + named);
    path.ancestors().skip(1).take(named).chain(above).map(Path::to_owned).collect()
}
