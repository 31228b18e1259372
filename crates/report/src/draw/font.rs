//! Text as outlines: DejaVu Sans, reduced to the characters of labels.
//!
//! assets/DejaVuSans-subset.ttf was made from DejaVu Sans 2.37 by fontTools' `pyftsubset` with printable ASCII, U+00A0
//! to U+00FF (Latin-1), [`CHARACTERS`] and `--no-hinting --layout-features='' --notdef-outline`; its licence is in the
//! same folder. Other characters are drawn as a box.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, OutlineCurve, Point};
use tiny_skia::{Path, PathBuilder};

/// Characters of the font in addition to printable ASCII and Latin-1.
#[cfg(test)]
const CHARACTERS: &str = "μ–’…→−✓";

static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(include_bytes!("../../assets/DejaVuSans-subset.ttf")).expect("the font in assets/ is whole")
});

/// Depth of descenders below the baseline, relative to the height of capitals.
pub(super) const DESCENT: f64 = 0.32;

/// Pixels per font unit if capitals have the height `cap_height_px`.
fn scale(cap_height_px: f64) -> f64 {
    let capital = FONT.outline(FONT.glyph_id('H')).map_or(1.0, |outline| outline.bounds.height().abs());
    cap_height_px / f64::from(capital)
}

/// The width of a line of text, in pixels.
pub(super) fn text_width(text: &str, cap_height_px: f64) -> f64 {
    let advances: f32 = text.chars().map(|character| FONT.h_advance_unscaled(FONT.glyph_id(character))).sum();
    scale(cap_height_px) * f64::from(advances)
}

/// The outlines of a line of text that begins at `left` on a baseline, in pixels; `None` for an empty drawing.
pub(super) fn text_path(text: &str, left: f64, baseline: f64, cap_height_px: f64) -> Option<Path> {
    let scale = scale(cap_height_px) as f32;
    let (mut left, baseline) = (left as f32, baseline as f32);
    let mut path = PathBuilder::new();
    for character in text.chars() {
        let glyph = FONT.glyph_id(character);
        let curves = FONT.outline(glyph).map_or_else(Vec::new, |outline| outline.curves);
        // The font's y axis points up.
        let at = |point: Point| (left + scale * point.x, baseline - scale * point.y);
        let mut end = None;
        for curve in curves {
            let (OutlineCurve::Line(start, _) | OutlineCurve::Quad(start, ..) | OutlineCurve::Cubic(start, ..)) = curve;
            if end != Some(start) {
                let (x, y) = at(start);
                path.move_to(x, y);
            }
            let to = match curve {
                OutlineCurve::Line(_, to) => {
                    let (x, y) = at(to);
                    path.line_to(x, y);
                    to
                }
                OutlineCurve::Quad(_, control, to) => {
                    let ((cx, cy), (x, y)) = (at(control), at(to));
                    path.quad_to(cx, cy, x, y);
                    to
                }
                OutlineCurve::Cubic(_, first, second, to) => {
                    let ((ax, ay), (bx, by), (x, y)) = (at(first), at(second), at(to));
                    path.cubic_to(ax, ay, bx, by, x, y);
                    to
                }
            };
            end = Some(to);
        }
        left += scale * FONT.h_advance_unscaled(glyph);
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_of_labels_has_a_glyph() {
        for character in ('!'..='~').chain('\u{a0}'..='ÿ').chain(CHARACTERS.chars()) {
            assert_ne!(FONT.glyph_id(character).0, 0, "{character:?} has no glyph");
        }
        assert_eq!(FONT.glyph_id('\u{4e00}').0, 0);
        assert!(text_path("\u{4e00}", 0.0, 10.0, 10.0).is_some(), "a box for what is missing");
    }

    #[test]
    fn capitals_are_as_high_as_asked_and_stand_on_the_baseline() {
        let bounds = text_path("H", 5.0, 40.0, 20.0).unwrap().bounds();
        assert!((bounds.bottom() - 40.0).abs() < 0.01 && (bounds.top() - 20.0).abs() < 0.01, "{bounds:?}");
        assert!(text_path("gjpqy", 0.0, 40.0, 20.0).unwrap().bounds().bottom() < 40.0 + (20.0 * DESCENT) as f32);
    }

    #[test]
    fn width_is_the_sum_of_advances() {
        assert_eq!(text_width("", 10.0), 0.0);
        assert!((text_width("88", 10.0) - 2.0 * text_width("8", 10.0)).abs() < 1e-6);
        assert!(text_path("", 0.0, 0.0, 10.0).is_none() && text_path(" ", 0.0, 0.0, 10.0).is_none());
    }
}
