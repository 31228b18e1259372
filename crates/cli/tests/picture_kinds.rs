//! Pictures in the formats of cameras and programs: the result depends neither on the storage format nor on whether a
//! picture is read as a file or as a frame.

use std::fs;
use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, RgbImage, Rgba, RgbaImage};
use serde_json::Value;

use crate::support::{Folder, sdg, shipped, taught_pendulum};

/// Maximum difference between two lossless storage formats.
const SAME_PX: f64 = 0.5;
/// Maximum difference if the pixels change: after JPEG, or after conversion to grey with 10 or 12 bits.
const JPEG_PX: f64 = 1.0;

fn photo() -> RgbImage {
    image::open(shipped("pendulum", "image.png")).unwrap().into_rgb8()
}

fn taught(folder: &Folder) -> String {
    let model = folder.path("part.sdg");
    taught_pendulum(&model, None);
    model
}

pub(crate) fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A JPEG with an Exif orientation.
pub(crate) fn with_orientation(picture: &DynamicImage, orientation: u8) -> Vec<u8> {
    let mut jpeg = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95);
    picture.to_rgb8().write_with_encoder(encoder).unwrap();
    // Big endian, one entry: tag 0x0112, a short.
    let exif =
        [b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(), &[orientation], &[0; 6]].concat();
    let segment = [[0xff, 0xe1].as_slice(), &((2 + exif.len()) as u16).to_be_bytes(), &exif].concat();
    jpeg.splice(2..2, segment);
    jpeg
}

/// The stored pixels that this orientation shows as the picture: the inverse of the orientation.
pub(crate) fn stored_for(picture: &RgbImage, orientation: u8) -> DynamicImage {
    let picture = DynamicImage::from(picture.clone());
    match orientation {
        2 => picture.fliph(),
        3 => picture.rotate180(),
        4 => picture.flipv(),
        5 => picture.fliph().rotate270(),
        6 => picture.rotate270(),
        7 => picture.fliph().rotate90(),
        8 => picture.rotate90(),
        _ => picture,
    }
}

/// The accepted grasps of each line.
fn grasps(arguments: &[&str]) -> Vec<Vec<[f64; 3]>> {
    let output = sdg(&[&["detect", "--json"], arguments].concat());
    let of = |detection: &Value| ["x", "y", "angle_deg"].map(|key| detection["grasp"][key].as_f64().unwrap());
    let text = String::from_utf8(output.stdout).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    lines
        .map(|line| line["detections"].as_array().unwrap_or_else(|| panic!("{line}")).iter().map(of).collect())
        .collect()
}

#[test]
fn one_picture_gives_one_result_from_files_and_folders() {
    let folder = Folder::new();
    let model = taught(&folder);
    let photo = photo();
    let (width, height) = photo.dimensions();
    let frames = folder.path("frames");
    fs::create_dir(&frames).unwrap();
    let gray = DynamicImage::from(photo.clone()).to_luma8();
    let bits = |largest: u32| {
        ImageBuffer::<Luma<u16>, _>::from_fn(width, height, |x, y| {
            Luma([(u32::from(gray.get_pixel(x, y)[0]) * largest / 255) as u16])
        })
    };
    let clear = RgbaImage::from_fn(width, height, |x, y| {
        let [r, g, b] = photo.get_pixel(x, y).0;
        Rgba([r, g, b, 0])
    });
    let mut pictures = vec![
        ("alpha.png".to_owned(), encoded(&clear.clone().into(), ImageFormat::Png), SAME_PX),
        ("alpha.bmp".to_owned(), encoded(&clear.into(), ImageFormat::Bmp), SAME_PX),
        ("photo.tif".to_owned(), encoded(&photo.clone().into(), ImageFormat::Tiff), SAME_PX),
        ("photo.webp".to_owned(), encoded(&photo.clone().into(), ImageFormat::WebP), SAME_PX),
    ];
    for depth in [10, 12] {
        pictures.push((format!("bits{depth}.png"), encoded(&bits((1 << depth) - 1).into(), ImageFormat::Png), JPEG_PX));
    }
    for orientation in 1..=8 {
        let bytes = with_orientation(&stored_for(&photo, orientation), orientation);
        pictures.push((format!("exif{orientation}.jpg"), bytes, JPEG_PX));
    }
    let mut endless = with_orientation(&photo.clone().into(), 1);
    endless.truncate(endless.len() - 2);
    pictures.push(("no-end.jpg".to_owned(), endless, JPEG_PX));
    pictures.sort_by(|a, b| a.0.cmp(&b.0));
    for (name, bytes, _) in &pictures {
        fs::write(format!("{frames}/{name}"), bytes).unwrap();
    }
    let [expected] = grasps(&["--grasp-model", &model, shipped("pendulum", "image.png").to_str().unwrap()])[0][..]
    else {
        panic!("the photo has one part");
    };
    let of_files = grasps(&["--grasp-model", &model, &frames]);
    assert_eq!(of_files.len(), pictures.len());
    for ((name, _, most), found) in pictures.iter().zip(&of_files) {
        let [[x, y, angle_deg]] = found[..] else { panic!("{name}: {found:?}") };
        let turn = (angle_deg - expected[2] + 180.0).rem_euclid(360.0) - 180.0;
        assert!(
            (x - expected[0]).hypot(y - expected[1]) < *most && turn.abs() < 1.0,
            "{name}: {found:?}, {expected:?}"
        );
    }
    assert_eq!(grasps(&["--grasp-model", &model, "--every-frame", "--from", &format!("dir:{frames}")]), of_files);
}

#[test]
fn marks_made_on_unturned_pixels_are_told() {
    let folder = Folder::new();
    let marks = fs::read_to_string(shipped("pendulum", "annotation.json")).unwrap();
    fs::write(folder.path("photo.json"), marks.replace("image.png", "photo.jpg")).unwrap();
    let teach = |bytes: Vec<u8>| {
        fs::write(folder.path("photo.jpg"), bytes).unwrap();
        let demonstration = format!("{}:{}", folder.path("photo.jpg"), folder.path("photo.json"));
        sdg(&["teach", "--model", "S", "--demo", &demonstration, "--out", &folder.path("o.sdg")])
    };
    for orientation in [2, 3, 4, 6, 8] {
        let ignored = teach(with_orientation(&photo().into(), orientation));
        let told = String::from_utf8_lossy(&ignored.stderr).into_owned();
        assert_eq!(ignored.status.code(), Some(1), "{orientation}: {told}");
        assert!(told.contains("photo.json") && told.contains("Exif"), "{orientation}: {told}");
    }
    for orientation in [3, 6] {
        let heeded = teach(with_orientation(&stored_for(&photo(), orientation), orientation));
        let told = String::from_utf8_lossy(&heeded.stderr).into_owned();
        assert!(
            heeded.status.success() && told.contains("rotated as its Exif orientation says"),
            "{orientation}: {told}"
        );
    }
}

#[test]
fn a_calibrated_camera_shows_the_sensors_pixels() {
    let folder = Folder::new();
    let camera = shipped("../workcell", "camera.yaml");
    let camera = camera.to_str().unwrap();
    let teach = |photo: &str, out: &str| {
        let demonstration = format!("{photo}:{}", shipped("pendulum", "annotation.json").display());
        sdg(&[
            "teach",
            "--model",
            "S",
            "--camera",
            camera,
            "--mark-height-mm",
            "16",
            "--demo",
            &demonstration,
            "--out",
            out,
        ])
    };
    let model = folder.path("part.sdg");
    let done = teach(shipped("pendulum", "image.png").to_str().unwrap(), &model);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let frames = folder.path("frames");
    fs::create_dir(&frames).unwrap();
    for orientation in [1, 3, 6] {
        let bytes = with_orientation(&photo().into(), orientation);
        fs::write(format!("{frames}/{orientation}.jpg"), bytes).unwrap();
    }
    let calibrated = ["--grasp-model", &model, "--camera", camera];
    let found = grasps(&[calibrated.as_slice(), &[&frames]].concat());
    assert!(found.len() == 3 && found[0].len() == 1 && found.iter().all(|one| *one == found[0]), "{found:?}");
    let live = format!("dir:{frames}");
    assert_eq!(grasps(&[calibrated.as_slice(), &["--every-frame", "--from", &live]].concat()), found);
    // It is unknown whether the marks of such a photo refer to the stored or to the upright pixels.
    let turned = teach(&format!("{frames}/3.jpg"), &folder.path("o.sdg"));
    let told = String::from_utf8_lossy(&turned.stderr).into_owned();
    assert!(turned.status.code() == Some(1) && told.contains("3.jpg") && told.contains("Exif"), "{told}");
}

#[test]
fn photos_of_phones_are_not_too_large() {
    let folder = Folder::new();
    let model = taught(&folder);
    // 50.3 megapixels, as from a phone.
    let large = GrayImage::from_pixel(8192, 6144, Luma([90]));
    fs::write(folder.path("phone.jpg"), encoded(&large.into(), ImageFormat::Jpeg)).unwrap();
    let output = sdg(&["detect", "--grasp-model", &model, &folder.path("phone.jpg")]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
}
