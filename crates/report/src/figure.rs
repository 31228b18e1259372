//! Pictures on the page: photos as JPEG, animations as GIF, both embedded.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{self, FilterType};

use crate::animation::Animation;
use crate::error::ReportError;
use crate::html::escape;

/// Maximum width of a photo on the page, in pixels.
pub(crate) const MAX_PHOTO_WIDTH: u32 = 1280;

/// A picture with its caption.
#[derive(Debug, Clone)]
pub struct Figure {
    picture: Picture,
    alt: Option<String>,
    caption: Option<String>,
}

#[derive(Debug, Clone)]
enum Picture {
    Photo(RgbImage),
    Animation(Animation),
}

/// Encoding of photos on the page.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhotoQuality {
    /// JPEG quality, 1 to 100.
    pub(crate) jpeg: u8,
    /// Maximum width, in pixels.
    pub(crate) max_width: u32,
}

impl Figure {
    /// A still picture. A wide one is reduced at once, because the figures of a page are in memory together.
    #[must_use]
    pub fn photo(image: RgbImage) -> Self {
        let is_wide = image.width() > MAX_PHOTO_WIDTH && image.height() > 0;
        let image = if is_wide { reduced(&image, MAX_PHOTO_WIDTH) } else { image };
        Self { picture: Picture::Photo(image), alt: None, caption: None }
    }

    /// An animated picture. Readers who prefer no motion see its last frame.
    #[must_use]
    pub fn animation(animation: Animation) -> Self {
        Self { picture: Picture::Animation(animation), alt: None, caption: None }
    }

    /// Sets the text below the picture.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = Some(caption.into());
        self
    }

    /// Sets a description for readers who cannot see the picture; default: the caption.
    #[must_use]
    pub fn alt(mut self, alt: impl Into<String>) -> Self {
        self.alt = Some(alt.into());
        self
    }

    pub(crate) fn is_photo(&self) -> bool {
        matches!(self.picture, Picture::Photo(_))
    }

    /// The figure as HTML, with photos reduced to the maximum width.
    pub(crate) fn to_html(&self, quality: PhotoQuality) -> Result<String, ReportError> {
        let alt = escape(self.alt.as_ref().or(self.caption.as_ref()).map_or("", String::as_str));
        let mut html = String::from("<figure class=\"picture\">");
        match &self.picture {
            Picture::Photo(photo) => {
                let (jpeg, width, height) = encode_jpeg(photo, quality)?;
                html += &image_element("jpeg", &jpeg, width, height, &alt);
            }
            Picture::Animation(animation) => {
                let (still, width, height) = encode_jpeg(&animation.still, quality)?;
                html += &format!(
                    "<picture><source media=\"(prefers-reduced-motion: reduce)\" srcset=\"{}\">{}</picture>",
                    data_address("jpeg", &still),
                    image_element("gif", &animation.gif, width, height, &alt)
                );
            }
        }
        if let Some(caption) = &self.caption {
            html += &format!("<figcaption>{}</figcaption>", escape(caption));
        }
        Ok(html + "</figure>")
    }
}

fn data_address(format: &str, bytes: &[u8]) -> String {
    format!("data:image/{format};base64,{}", STANDARD.encode(bytes))
}

/// The image element. It states width and height, so that the page's layout does not shift while loading.
fn image_element(format: &str, bytes: &[u8], width: u32, height: u32, alt: &str) -> String {
    format!("<img src=\"{}\" width=\"{width}\" height=\"{height}\" alt=\"{alt}\">", data_address(format, bytes))
}

fn encode_jpeg(photo: &RgbImage, quality: PhotoQuality) -> Result<(Vec<u8>, u32, u32), ReportError> {
    let (width, height) = photo.dimensions();
    if width == 0 || height == 0 || width > 65_535 || height > 65_535 {
        return Err(ReportError::PictureSize { what: "a picture of the report", width, height, limit: 65_535 });
    }
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, quality.jpeg);
    let (result, size) = if width > quality.max_width {
        let small = reduced(photo, quality.max_width);
        (encoder.encode_image(&small), small.dimensions())
    } else {
        (encoder.encode_image(photo), (width, height))
    };
    result.map_err(|source| ReportError::Jpeg { width, height, source })?;
    Ok((bytes, size.0, size.1))
}

/// The photo, reduced to this width.
fn reduced(photo: &RgbImage, width: u32) -> RgbImage {
    let scale = f64::from(width) / f64::from(photo.width());
    let height = ((f64::from(photo.height()) * scale).round() as u32).max(1);
    imageops::resize(photo, width, height, FilterType::CatmullRom)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::animation::AnimationOptions;
    use crate::html_checker::assert_well_formed;

    const FINE: PhotoQuality = PhotoQuality { jpeg: 85, max_width: 1280 };

    fn embedded(html: &str, format: &str) -> Vec<u8> {
        let start = format!("data:image/{format};base64,");
        let (_, after) = html.split_once(&start).unwrap();
        STANDARD.decode(after.split('"').next().unwrap()).unwrap()
    }

    #[test]
    fn a_photo_comes_back_from_the_page() {
        let photo = RgbImage::from_fn(64, 48, |x, y| image::Rgb([(x * 4) as u8, (y * 5) as u8, 80]));
        let html = Figure::photo(photo.clone()).caption("a \"slope\"").to_html(FINE).unwrap();
        assert_well_formed(&html);
        assert!(html.contains("alt=\"a &quot;slope&quot;\"") && html.contains("width=\"64\" height=\"48\""));
        let decoded = image::load_from_memory(&embedded(&html, "jpeg")).unwrap().to_rgb8();
        let worst = photo.as_raw().iter().zip(decoded.as_raw()).map(|(&a, &b)| a.abs_diff(b)).max();
        assert!(worst < Some(24), "{worst:?}");
    }

    #[test]
    fn a_figure_holds_no_photo_wider_than_the_page() {
        let figure = Figure::photo(RgbImage::new(4000, 3000));
        assert!(matches!(&figure.picture, Picture::Photo(photo) if photo.dimensions() == (1280, 960)));
    }

    #[test]
    fn a_wide_photo_is_scaled_down() {
        let html = Figure::photo(RgbImage::new(2560, 1000)).to_html(FINE).unwrap();
        assert!(html.contains("width=\"1280\" height=\"500\""));
    }

    #[test]
    fn an_animation_has_a_still_for_readers_without_motion() {
        let frames = [RgbImage::new(8, 6), RgbImage::from_pixel(8, 6, image::Rgb([255, 0, 0]))];
        let animation = Animation::encode(&frames, &AnimationOptions::default()).unwrap();
        let html = Figure::animation(animation.clone()).alt("a flash").to_html(FINE).unwrap();
        assert_well_formed(&html);
        assert_eq!(embedded(&html, "gif"), animation.gif());
        assert!(html.contains("prefers-reduced-motion") && html.contains("alt=\"a flash\""));
    }

    #[test]
    fn a_picture_without_pixels_is_an_error() {
        assert!(matches!(Figure::photo(RgbImage::new(0, 3)).to_html(FINE), Err(ReportError::PictureSize { .. })));
    }
}
