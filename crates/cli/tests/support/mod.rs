//! Code that the tests of the command line have in common: running `sdg`, the shipped demonstrations, a temporary
//! folder.
#![allow(missing_docs)]

mod documented;

pub use documented::assert_fields_are_documented;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use image::{GrayImage, Luma, RgbImage};
use sdg_demonstration::{Annotation, ImageFacts};

/// Runs `sdg` and waits until it exits. Fields of the printed JSON that no document describes fail the test.
pub fn sdg(arguments: &[impl AsRef<OsStr>]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_sdg")).args(arguments).output().unwrap();
    assert_fields_are_documented(arguments, &output.stdout);
    output
}

/// Standard output of a call that must succeed.
pub fn stdout(arguments: &[&str]) -> String {
    let output = sdg(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// A file of a part's shipped demonstration.
pub fn shipped(part: &str, name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations").join(part).join(name)
}

/// Writes model S of the shipped pendulum, taught with seed 1. If a camera is given, the marks are 16 mm and the grasp
/// is 9 mm above the table.
///
/// Many tests need one of these models (one per camera file), each in its own process, and teaching takes seconds. The
/// first test that needs a model therefore teaches it, for this program and these inputs, and other tests copy it.
pub fn taught_pendulum(out: impl AsRef<Path>, camera: Option<&Path>) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("taught");
    fs::create_dir_all(&folder).unwrap();
    let [photo, marks] = ["image.png", "annotation.json"].map(|name| shipped("pendulum", name));
    let mut made_of = String::new();
    for file in [Path::new(env!("CARGO_BIN_EXE_sdg")), &photo, &marks] {
        let found = fs::metadata(file).unwrap();
        made_of += &format!("{} {} {:?}\n", file.display(), found.len(), found.modified().unwrap());
    }
    let camera_file = camera.map(|camera| fs::read_to_string(camera).unwrap()).unwrap_or_default();
    made_of += &camera_file;
    let mut hasher = DefaultHasher::new();
    camera_file.hash(&mut hasher);
    let model = folder.join(format!("pendulum-{:016x}.sdg", hasher.finish()));

    // The inputs of the model are written into the locked file after the model is complete.
    let mut lock =
        File::options().read(true).write(true).create(true).truncate(false).open(model.with_extension("lock")).unwrap();
    lock.lock().unwrap();
    let mut found = String::new();
    lock.read_to_string(&mut found).unwrap();
    if found != made_of {
        lock.set_len(0).unwrap();
        let (demonstration, model) = (format!("{}:{}", photo.display(), marks.display()), model.to_str().unwrap());
        let mut arguments = vec!["teach", "--model", "S", "--demo", &demonstration, "--out", model];
        if let Some(camera) = camera {
            let camera = camera.to_str().unwrap();
            arguments.extend(["--camera", camera, "--mark-height-mm", "16", "--grasp-height-mm", "9"]);
        }
        stdout(&arguments);
        lock.rewind().unwrap();
        lock.write_all(made_of.as_bytes()).unwrap();
    }
    fs::copy(&model, out).unwrap();
}

/// Writes a photo and its marks, from which a model is taught that fails its own samples: a patch of a checkerboard,
/// which occurs everywhere in the picture.
pub fn write_unusable_demonstration(photo: &Path) {
    let is_light = |x: u32, y: u32| (x / 40 + y / 40).is_multiple_of(2);
    let checks = GrayImage::from_fn(640, 480, |x, y| Luma([if is_light(x, y) { 200 } else { 60 }]));
    checks.save(photo).unwrap();
    let marks = serde_json::json!({
        "images": [{"id": 1, "file_name": "checks.png"}],
        "annotations": [{"id": 1, "image_id": 1, "category_id": 1, "bbox": [240, 160, 160, 160],
                         "keypoints": [300, 240, 2, 340, 240, 2]}],
        "categories": [{"id": 1, "name": "patch", "keypoints": ["grasp_start", "grasp_end"]}]});
    fs::write(photo.with_extension("json"), marks.to_string()).unwrap();
}

/// The pendulum's photo with a second copy of the part, cut out along its marked outline and shifted by `[dx, dy]`
/// pixels.
pub fn pendulum_twice([dx, dy]: [i64; 2]) -> RgbImage {
    let mut picture = image::open(shipped("pendulum", "image.png")).unwrap().into_rgb8();
    let (width, height) = picture.dimensions();
    let facts = ImageFacts { width, height, file_name: Some("image.png") };
    let marks = fs::read(shipped("pendulum", "annotation.json")).unwrap();
    let outline = Annotation::read(&marks, &facts).unwrap().remove(0).outline.unwrap();
    let (photo, mask) = (picture.clone(), outline.rasterize(width, height));
    for (x, y, pixel) in photo.enumerate_pixels().filter(|(x, y, _)| mask.get(*x, *y)) {
        picture.put_pixel((i64::from(x) + dx) as u32, (i64::from(y) + dy) as u32, *pixel);
    }
    picture
}

/// A folder that is deleted when dropped.
pub struct Folder {
    folder: tempfile::TempDir,
}

impl Folder {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// Writes a file and returns its path.
    pub fn text(&self, name: &str, text: &str) -> String {
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }
}
