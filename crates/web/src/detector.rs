//! A model that detects in images; its inputs are bytes, its outputs JSON.

use image::RgbImage;
use sdg_grasp::{
    DetectionRecord, Device, GraspModel, ImageLimits, ModelSummary, Verification, decode_image, summarize,
};
use serde::Serialize;

use crate::error::WebError;

/// Maximum size of an image. WebAssembly's memory is limited to 4 GiB; searching a photo of 200 megapixels takes
/// 5.8 GB, one of 64 megapixels a third of that.
const LIMITS: ImageLimits = ImageLimits { max_pixels: 64_000_000 };

/// An opened grasp model.
#[derive(Debug)]
pub struct Detector {
    model: GraspModel,
    summary: ModelSummary,
}

/// The detections in one image, with the field names of `sdg detect --json`.
#[derive(Serialize)]
struct ImageRecord {
    width: u32,
    height: u32,
    /// Best score first, including refused detections (score below 0.5).
    detections: Vec<DetectionRecord>,
}

impl Detector {
    /// Opens a model from its file's bytes, on a device.
    ///
    /// # Errors
    /// A file that is not a grasp model, has another version, or is damaged.
    pub fn open(bytes: &[u8], device: &Device) -> Result<Self, WebError> {
        let summary = summarize(bytes)?;
        Ok(Self { model: GraspModel::from_bytes(bytes, device)?, summary })
    }

    /// The metadata of the file, as JSON: `model`, `preset`, `object`, `teaching`.
    pub fn summary(&self) -> String {
        to_json(&self.summary)
    }

    /// Detects in a PNG or JPEG file: `{"width", "height", "detections"}` as JSON, including refused detections.
    ///
    /// # Errors
    /// The file is not an image, is damaged, or has more than 64 megapixels; an error of the search.
    pub async fn detect_in_file(&self, bytes: &[u8], verification: Verification) -> Result<String, WebError> {
        self.detect_in(&decode_image(bytes, &LIMITS)?, verification).await
    }

    /// Detects in opaque pixels of a canvas: rows of red, green, blue and an ignored alpha.
    ///
    /// # Errors
    /// The number of bytes does not match the size, or the image has more than 64 megapixels; an error of the search.
    pub async fn detect_in_pixels(
        &self,
        rgba: &[u8],
        width: u32,
        height: u32,
        verification: Verification,
    ) -> Result<String, WebError> {
        let max_pixels = LIMITS.max_pixels;
        if u64::from(width) * u64::from(height) > max_pixels {
            return Err(sdg_demonstration::PictureError::EnormousImage { width, height, max_pixels }.into());
        }
        let pixels = || WebError::Pixels { width, height, found: rgba.len() };
        if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) {
            return Err(pixels());
        }
        let rgb = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        let image = RgbImage::from_raw(width, height, rgb).ok_or_else(pixels)?;
        self.detect_in(&image, verification).await
    }

    async fn detect_in(&self, image: &RgbImage, verification: Verification) -> Result<String, WebError> {
        let found = self.model.detect_async(image, verification).await?;
        let detections = found.iter().map(|one| DetectionRecord::new(one, self.model.kind())).collect();
        Ok(to_json(&ImageRecord { width: image.width(), height: image.height(), detections }))
    }
}

fn to_json<T: Serialize>(value: &T) -> String {
    // Plain data; serialisation to a string cannot fail.
    serde_json::to_string(value).unwrap_or_default()
}
