//! Draws marks on pictures: boxes, outlines, keypoints, grasps, labels, contact sheets.
//!
//! Coordinates are in pixels, x right, y down, the centre of the first pixel at (0.5, 0.5). Lines are antialiased and
//! by default have a dark halo, so that they are visible on bright and dark backgrounds. Parts outside the picture and
//! coordinates that are not finite are left out.

mod contact_sheet;
mod font;
mod label;
mod marks;
mod paint;
mod shapes;

pub use contact_sheet::contact_sheet;
pub use label::{draw_label, label_bounds};
pub use marks::{DetectionMark, Verdict, draw_demonstration, draw_detections, line_width};
pub use shapes::{draw_box, draw_grasp_jaws, draw_keypoints, draw_line, draw_polygon, shade_polygon};

/// An sRGB colour, red first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(pub [u8; 3]);

impl Color {
    /// Colour of grasps.
    pub const GRASP: Self = Self([255, 122, 41]);
    /// Colour of boxes.
    pub const BOX: Self = Self([124, 196, 255]);
    /// Colour of the part's outlines.
    pub const OUTLINE: Self = Self([255, 224, 102]);
    /// Colour of detections that passed verification.
    pub const VERIFIED: Self = Self([64, 214, 170]);
    /// Colour of refused detections. It differs from [`Color::VERIFIED`] in lightness as well as in hue.
    pub const REFUSED: Self = Self([255, 92, 104]);
    /// Colour of unchecked detections, grasp lines and keypoints.
    pub const NEUTRAL: Self = Self([235, 235, 230]);

    /// Approximate luminance, 0 (black) to 1 (white): sRGB weights applied to the encoded values.
    fn lightness(self) -> f64 {
        let [r, g, b] = self.0.map(f64::from);
        (0.2126 * r + 0.7152 * g + 0.0722 * b) / 255.0
    }
}

/// Style of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    /// Colour of the line.
    pub color: Color,
    /// Width in pixels.
    pub width: f64,
    /// Whether the line has a dark rim.
    pub halo: bool,
    /// Lengths of dash and gap in pixels; `None` for a continuous line.
    pub dash: Option<(f64, f64)>,
}

impl Pen {
    /// A continuous line, two pixels wide, with a halo.
    #[must_use]
    pub fn new(color: Color) -> Self {
        Self { color, width: 2.0, halo: true, dash: None }
    }

    /// Sets the width in pixels.
    #[must_use]
    pub fn width(mut self, width: f64) -> Self {
        self.width = width;
        self
    }

    /// Makes the line dashed; lengths of dash and gap in pixels.
    #[must_use]
    pub fn dashed(mut self, dash: f64, gap: f64) -> Self {
        self.dash = Some((dash, gap));
        self
    }

    /// Removes the dark rim.
    #[must_use]
    pub fn without_halo(mut self) -> Self {
        self.halo = false;
        self
    }
}
