//! Input from other languages: the entry points of WebAssembly, and the values from Python and C that `bindings`
//! checks.

use std::pin::pin;
use std::sync::LazyLock;
use std::task::{Context, Poll, Waker};

use sdg_bindings::{Camera, Model, PixelOrder, PixelShape, RegionChoice, Tracker, View};
use sdg_grasp::{Device, Verification};
use sdg_web::Detector;

use super::bytes::file;
use super::numbers::Numbers;
use crate::target::Target;

/// Maximum number of pixels of a picture that is searched: a million searches of larger pictures would take too
/// long.
const MAX_SEARCHED: usize = 64 * 64;

/// A search holds pyramids of the picture and of the demonstration.
const MAX_EXTRA_BYTES: usize = 256 << 20;

/// A picture that is large enough to be searched.
fn searched_picture() -> image::RgbImage {
    image::RgbImage::from_fn(64, 48, |x, y| image::Rgb([(x * 4) as u8, (y * 5) as u8, (x * y) as u8]))
}

/// The functions of WebAssembly, compiled for this computer: a model file, a picture file, a canvas's pixels.
pub(super) const WEB: Target = Target {
    name: "web",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 300,
    dictionary: &[b"\0", b"\x01", b"\x02", b"IHDR", b"\xff\xd8\xff"],
    seeds: || {
        let size: Vec<u8> = [64_u32, 48].iter().flat_map(|side| side.to_le_bytes()).collect();
        let canvas = [&[2], size.as_slice(), &[90; 4 * 64 * 48]].concat();
        let picture = searched_picture();
        let files = [image::ImageFormat::Png, image::ImageFormat::Jpeg].map(|format| {
            let mut file = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut file, format).expect("a picture is encoded");
            file.into_inner()
        });
        let mut seeds: Vec<_> = files.iter().map(|file| [&[1], file.as_slice()].concat()).collect();
        seeds.push(canvas);
        seeds
    },
    run: |bytes| {
        static DETECTOR: LazyLock<Detector> = LazyLock::new(|| {
            Detector::open(&file("fuzz/corpus/model_s.sdg"), &Device::flex()).expect("the corpus's own model")
        });
        let mut input = Numbers(bytes);
        match input.u8() % 3 {
            0 => Detector::open(input.0, &Device::flex()).is_ok_and(|detector| !detector.summary().is_empty()),
            1 => now(DETECTOR.detect_in_file(input.0, Verification::ByShape)).is_ok(),
            _ => {
                let (width, height) = (input.u32(), input.u32());
                let is_large = input.0.len() > 4 * MAX_SEARCHED;
                !is_large && now(DETECTOR.detect_in_pixels(input.0, width, height, Verification::ByShape)).is_ok()
            }
        }
    },
};

/// Polls a future in a loop; only for work that the processor does at once.
fn now<T>(work: impl Future<Output = T>) -> T {
    let mut work = pin!(work);
    loop {
        if let Poll::Ready(result) = work.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return result;
        }
    }
}

/// The values of Python's arguments: shapes, regions, threads, times of frames, the text of a camera file.
pub(super) const BINDINGS: Target = Target {
    name: "bindings",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 300,
    dictionary: &[b"\0\0\0\0\0\0\xf8\x7f", b"\0\0\0\0\0\0\xf0\x7f", b"\xff\xff\xff\xff\xff\xff\xff\x7f", b"\x03"],
    seeds: || {
        let shape = |sides: &[u64]| -> Vec<u8> { sides.iter().flat_map(|side| side.to_le_bytes()).collect() };
        vec![
            [&[0, 0, 3], shape(&[17, 31, 3]).as_slice()].concat(),
            [&[0, 1, 2], shape(&[17, 31]).as_slice()].concat(),
            [&[1], file("datasets/workcell/camera.yaml").as_slice()].concat(),
            [&[2, 1, 1], [0.5_f64, 0.6].map(f64::to_le_bytes).as_flattened()].concat(),
        ]
    },
    run: |bytes| {
        static MODEL: LazyLock<Model> = LazyLock::new(|| {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/model_s.sdg");
            Model::read(&path).expect("the corpus's own model")
        });
        let mut input = Numbers(bytes);
        match input.u8() % 3 {
            0 => {
                let order = if input.u8() % 2 == 0 { PixelOrder::Rgb } else { PixelOrder::Bgr };
                let shape: Vec<usize> = (0..input.u8() % 6).map(|_| input.u64() as usize).collect();
                let Ok(checked) = PixelShape::new(&shape) else { return false };
                let is_small = checked.height as usize * checked.width as usize <= MAX_SEARCHED;
                if is_small {
                    let picture = checked.copy(order, |row, column, channel| (row * 7 + column + channel) as u8);
                    assert_eq!(picture.dimensions(), (checked.width, checked.height));
                }
                true
            }
            1 => std::str::from_utf8(input.0).is_ok_and(|text| Camera::from_yaml(text).is_ok()),
            _ => {
                let region = match input.u8() % 3 {
                    0 => RegionChoice::OfModel,
                    1 => RegionChoice::All,
                    _ => RegionChoice::Part([input.u32(), input.u32(), input.u32(), input.u32()]),
                };
                let threads = Some(usize::from(input.u8() % 3));
                let view = View { camera: None, region, threads };
                let Ok(mut tracker) = Tracker::new(&MODEL, &view, Some(1)) else { return false };
                let times = [input.f64(), input.f64()];
                times.into_iter().all(|captured_secs| tracker.frame(searched_picture(), captured_secs).is_ok())
            }
        }
    },
};
