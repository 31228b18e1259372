//! A stroke font of our own: glyphs as lines and quadratic curves, drawn with the same pen as everything else.
//!
//! Units: capitals reach from y = 0 down to the baseline at y = 6; small letters start at y = 2; descenders end
//! at y = 8. `M x y` moves, `L x y` draws a line, `Q cx cy x y` a quadratic curve. A dot is a line of no length.

use nalgebra::Point2;

/// Height of capitals in the units of the glyphs.
pub(super) const CAP_HEIGHT: f64 = 6.0;
/// Lowest point of a descender below the baseline, in the units of the glyphs.
pub(super) const DESCENT: f64 = 2.0;
/// Space between two glyphs.
const LETTER_GAP: f64 = 1.75;
/// Lines that a quarter of a curve is cut into.
const LINES_PER_CURVE: u32 = 6;

/// The width of a line of text, in the units of the glyphs.
pub(super) fn text_width(text: &str) -> f64 {
    let advances: f64 = text.chars().map(|c| glyph(c).0 + LETTER_GAP).sum();
    (advances - LETTER_GAP).max(0.0)
}

/// The polylines of a line of text, its first capital's top left corner at the origin.
pub(super) fn text_polylines(text: &str) -> Vec<Vec<Point2<f64>>> {
    let mut polylines = Vec::new();
    let mut pen_x = 0.0;
    for character in text.chars() {
        let (width, path) = glyph(character);
        for mut polyline in glyph_polylines(path) {
            polyline.iter_mut().for_each(|point| point.x += pen_x);
            polylines.push(polyline);
        }
        pen_x += width + LETTER_GAP;
    }
    polylines
}

fn glyph_polylines(path: &str) -> Vec<Vec<Point2<f64>>> {
    let mut polylines: Vec<Vec<Point2<f64>>> = Vec::new();
    let commands = path.char_indices().filter(|(_, c)| c.is_ascii_uppercase()).map(|(at, _)| at);
    let ends = commands.clone().skip(1).chain([path.len()]);
    for (start, end) in commands.zip(ends) {
        let numbers: Vec<f64> = path[start + 1..end].split_whitespace().filter_map(|n| n.parse().ok()).collect();
        match (&path[start..=start], numbers.as_slice(), polylines.last_mut()) {
            ("M", &[x, y], _) => polylines.push(vec![Point2::new(x, y)]),
            ("L", &[x, y], Some(polyline)) => polyline.push(Point2::new(x, y)),
            ("Q", &[cx, cy, x, y], Some(polyline)) => {
                let from = polyline[polyline.len() - 1];
                let (control, to) = (Point2::new(cx, cy), Point2::new(x, y));
                polyline.extend((1..=LINES_PER_CURVE).map(|step| {
                    let t = f64::from(step) / f64::from(LINES_PER_CURVE);
                    from.lerp(&control, t).lerp(&control.lerp(&to, t), t)
                }));
            }
            (command, numbers, _) => unreachable!("glyph command {command} with {numbers:?}"),
        }
    }
    polylines
}

/// Width and path of a character; an empty box for one that the font lacks.
#[rustfmt::skip]
fn glyph(character: char) -> (f64, &'static str) {
    match character {
        ' ' | '\u{a0}' | '\t' | '\n' => (1.4, ""),
        '!' => (0.0, "M0 0L0 4M0 6L0 6"),
        '"' => (1.4, "M0 0L0 1.6M1.4 0L1.4 1.6"),
        '#' => (4.0, "M1.2 .5L.6 5.5M3.4 .5L2.8 5.5M0 2.1L4 2.1M0 3.9L4 3.9"),
        '$' => (3.6, "M3.6 1.5Q3.3 .6 1.8 .6Q0 .6 0 1.8Q0 2.8 1.8 3Q3.6 3.2 3.6 4.3Q3.6 5.4 1.8 5.4Q.2 5.4 0 4.5M1.8 -.4L1.8 6.4"),
        '%' => (4.6, "M4.2 0L.4 6M1 0Q2 0 2 1.2Q2 2.4 1 2.4Q0 2.4 0 1.2Q0 0 1 0M3.6 3.6Q4.6 3.6 4.6 4.8Q4.6 6 3.6 6Q2.6 6 2.6 4.8Q2.6 3.6 3.6 3.6"),
        '&' => (4.2, "M4.2 6L1 2.2Q.4 1.5 .4 1.1Q.4 0 1.6 0Q2.7 0 2.7 1.1Q2.7 2 1.4 2.7Q0 3.4 0 4.5Q0 6 1.7 6Q3.4 6 4 3.2"),
        '\'' | '’' => (0.0, "M0 0L0 1.6"),
        '(' => (1.3, "M1.3 -.6Q0 1 0 3Q0 5 1.3 6.8"),
        ')' => (1.3, "M0 -.6Q1.3 1 1.3 3Q1.3 5 0 6.8"),
        '*' => (2.4, "M1.2 .4L1.2 3.2M0 1.1L2.4 2.5M2.4 1.1L0 2.5"),
        '+' => (3.2, "M1.6 1.9L1.6 5.1M0 3.5L3.2 3.5"),
        ',' => (0.6, "M.6 5.9L0 7.2"),
        '-' => (2.2, "M0 3.6L2.2 3.6"),
        '.' => (0.0, "M0 6L0 6"),
        '/' => (2.6, "M2.6 -.3L0 6.6"),
        '0' => (3.6, "M1.8 0Q3.6 0 3.6 3Q3.6 6 1.8 6Q0 6 0 3Q0 0 1.8 0"),
        '1' => (3.6, "M.7 1.2L2.1 0L2.1 6"),
        '2' => (3.6, "M.1 1.6Q.1 0 1.8 0Q3.5 0 3.5 1.6Q3.5 2.6 2.2 3.9L0 6L3.6 6"),
        '3' => (3.6, "M.2 1.2Q.5 0 1.8 0Q3.4 0 3.4 1.4Q3.4 2.8 1.6 2.8Q3.6 2.8 3.6 4.4Q3.6 6 1.8 6Q.2 6 0 4.6"),
        '4' => (3.6, "M2.7 6L2.7 0L0 4.2L3.6 4.2"),
        '5' => (3.6, "M3.3 0L.6 0L.3 2.8Q.8 2.2 1.8 2.2Q3.6 2.2 3.6 4.1Q3.6 6 1.8 6Q.3 6 0 4.8"),
        '6' => (3.6, "M3.2 .7Q2.8 0 1.9 0Q0 0 0 3.4Q0 6 1.8 6Q3.6 6 3.6 4.2Q3.6 2.5 1.9 2.5Q.3 2.5 0 4"),
        '7' => (3.6, "M0 0L3.6 0L1.3 6"),
        '8' => (3.6, "M1.8 2.8Q.2 2.8 .2 1.4Q.2 0 1.8 0Q3.4 0 3.4 1.4Q3.4 2.8 1.8 2.8Q3.6 2.8 3.6 4.4Q3.6 6 1.8 6Q0 6 0 4.4Q0 2.8 1.8 2.8"),
        '9' => (3.6, "M.4 5.3Q.8 6 1.7 6Q3.6 6 3.6 2.6Q3.6 0 1.8 0Q0 0 0 1.8Q0 3.5 1.7 3.5Q3.3 3.5 3.6 2"),
        ':' => (0.0, "M0 2.6L0 2.6M0 6L0 6"),
        ';' => (0.6, "M.5 2.6L.5 2.6M.6 5.9L0 7.2"),
        '<' => (3.0, "M3 1.6L0 3.5L3 5.4"),
        '=' => (3.2, "M0 2.6L3.2 2.6M0 4.4L3.2 4.4"),
        '>' => (3.0, "M0 1.6L3 3.5L0 5.4"),
        '?' => (3.0, "M0 1.4Q.1 0 1.5 0Q3 0 3 1.5Q3 2.5 2 3Q1.5 3.3 1.5 4.1M1.5 6L1.5 6"),
        '@' => (5.0, "M3.6 2Q3.3 1.6 2.7 1.6Q1.5 1.6 1.5 3Q1.5 4.2 2.5 4.2Q3.6 4.2 3.6 2.8L3.6 1.7M3.6 3.4Q3.7 4.3 4.3 4.2Q5 4 5 2.8Q5 0 2.6 0Q0 0 0 3Q0 6 2.7 6Q3.6 6 4.3 5.6"),
        'A' => (4.2, "M0 6L2.1 0L4.2 6M.75 4L3.45 4"),
        'B' => (3.6, "M0 0L0 6L2 6Q3.6 6 3.6 4.4Q3.6 2.8 2 2.8L0 2.8M2 2.8Q3.3 2.8 3.3 1.4Q3.3 0 1.9 0L0 0"),
        'C' => (4.0, "M4 1.4Q3.6 0 2.1 0Q0 0 0 3Q0 6 2.1 6Q3.6 6 4 4.6"),
        'D' => (4.0, "M0 0L0 6L1.6 6Q4 6 4 3Q4 0 1.6 0L0 0"),
        'E' => (3.2, "M3.2 0L0 0L0 6L3.2 6M0 2.9L2.8 2.9"),
        'F' => (3.1, "M3.1 0L0 0L0 6M0 2.9L2.7 2.9"),
        'G' => (4.2, "M4 1.4Q3.6 0 2.1 0Q0 0 0 3Q0 6 2.1 6Q4.2 6 4.2 3.9L4.2 3.3L2.4 3.3"),
        'H' => (3.8, "M0 0L0 6M3.8 0L3.8 6M0 2.9L3.8 2.9"),
        'I' => (0.0, "M0 0L0 6"),
        'J' => (2.6, "M2.6 0L2.6 4.4Q2.6 6 1.3 6Q.1 6 0 4.8"),
        'K' => (3.7, "M0 0L0 6M3.5 0L0 3.6M1.3 2.4L3.7 6"),
        'L' => (3.0, "M0 0L0 6L3 6"),
        'M' => (4.8, "M0 6L0 0L2.4 4.4L4.8 0L4.8 6"),
        'N' => (3.8, "M0 6L0 0L3.8 6L3.8 0"),
        'O' => (4.4, "M2.2 0Q4.4 0 4.4 3Q4.4 6 2.2 6Q0 6 0 3Q0 0 2.2 0"),
        'P' => (3.5, "M0 6L0 0L1.9 0Q3.5 0 3.5 1.7Q3.5 3.4 1.9 3.4L0 3.4"),
        'Q' => (4.4, "M2.2 0Q4.4 0 4.4 3Q4.4 6 2.2 6Q0 6 0 3Q0 0 2.2 0M2.8 4.6L4.4 6.6"),
        'R' => (3.7, "M0 6L0 0L1.9 0Q3.5 0 3.5 1.7Q3.5 3.4 1.9 3.4L0 3.4M2 3.4L3.7 6"),
        'S' => (3.6, "M3.5 1.3Q3.2 0 1.8 0Q.1 0 .1 1.5Q.1 2.6 1.8 2.9Q3.6 3.2 3.6 4.5Q3.6 6 1.8 6Q.2 6 0 4.6"),
        'T' => (4.0, "M0 0L4 0M2 0L2 6"),
        'U' => (3.8, "M0 0L0 4Q0 6 1.9 6Q3.8 6 3.8 4L3.8 0"),
        'V' => (4.2, "M0 0L2.1 6L4.2 0"),
        'W' => (5.8, "M0 0L1.5 6L2.9 .8L4.3 6L5.8 0"),
        'X' => (4.0, "M0 0L4 6M4 0L0 6"),
        'Y' => (4.0, "M0 0L2 3L4 0M2 3L2 6"),
        'Z' => (3.8, "M0 0L3.8 0L0 6L3.8 6"),
        '[' => (1.3, "M1.3 -.4L0 -.4L0 6.8L1.3 6.8"),
        '\\' => (2.6, "M0 -.3L2.6 6.6"),
        ']' => (1.3, "M0 -.4L1.3 -.4L1.3 6.8L0 6.8"),
        '^' => (2.6, "M0 2L1.3 0L2.6 2"),
        '_' => (3.4, "M0 7L3.4 7"),
        '`' => (1.0, "M0 0L1 1"),
        'a' => (3.0, "M3 2L3 6M3 3.4Q2.6 2 1.4 2Q0 2 0 4Q0 6 1.4 6Q2.6 6 3 4.6"),
        'b' => (3.0, "M0 0L0 6M0 3.4Q.4 2 1.6 2Q3 2 3 4Q3 6 1.6 6Q.4 6 0 4.6"),
        'c' => (2.8, "M2.8 2.9Q2.4 2 1.5 2Q0 2 0 4Q0 6 1.5 6Q2.4 6 2.8 5.1"),
        'd' => (3.0, "M3 0L3 6M3 3.4Q2.6 2 1.4 2Q0 2 0 4Q0 6 1.4 6Q2.6 6 3 4.6"),
        'e' => (3.0, "M.1 3.9L3 3.9Q3 2 1.5 2Q0 2 0 4Q0 6 1.6 6Q2.5 6 2.9 5.2"),
        'f' => (1.9, "M1.9 .1Q.7 -.2 .7 1.2L.7 6M0 2L1.8 2"),
        'g' => (3.0, "M3 2L3 6.4Q3 8 1.5 8Q.5 8 .2 7.4M3 3.4Q2.6 2 1.4 2Q0 2 0 4Q0 6 1.4 6Q2.6 6 3 4.6"),
        'h' => (2.8, "M0 0L0 6M0 3.5Q.3 2 1.6 2Q2.8 2 2.8 3.5L2.8 6"),
        'i' => (0.0, "M0 2L0 6M0 .3L0 .3"),
        'j' => (0.8, "M.8 2L.8 6.8Q.8 8 -.3 7.9M.8 .3L.8 .3"),
        'k' => (2.7, "M0 0L0 6M2.6 2L0 4.4M1 3.5L2.7 6"),
        'l' => (0.8, "M0 0L0 5.2Q0 6 .8 6"),
        'm' => (4.8, "M0 2L0 6M0 3.4Q.2 2 1.3 2Q2.4 2 2.4 3.4L2.4 6M2.4 3.4Q2.6 2 3.7 2Q4.8 2 4.8 3.4L4.8 6"),
        'n' => (2.8, "M0 2L0 6M0 3.5Q.3 2 1.6 2Q2.8 2 2.8 3.5L2.8 6"),
        'o' => (3.0, "M1.5 2Q3 2 3 4Q3 6 1.5 6Q0 6 0 4Q0 2 1.5 2"),
        'p' => (3.0, "M0 2L0 8M0 3.4Q.4 2 1.6 2Q3 2 3 4Q3 6 1.6 6Q.4 6 0 4.6"),
        'q' => (3.0, "M3 2L3 8M3 3.4Q2.6 2 1.4 2Q0 2 0 4Q0 6 1.4 6Q2.6 6 3 4.6"),
        'r' => (1.8, "M0 2L0 6M0 3.7Q.3 2 1.8 2.1"),
        's' => (2.6, "M2.5 2.8Q2.2 2 1.3 2Q.1 2 .1 3Q.1 3.8 1.3 4Q2.6 4.2 2.6 5Q2.6 6 1.3 6Q.2 6 0 5.1"),
        't' => (1.9, "M.7 .6L.7 4.9Q.7 6.1 1.9 5.9M0 2L1.9 2"),
        'u' => (2.8, "M0 2L0 4.5Q0 6 1.2 6Q2.5 6 2.8 4.5M2.8 2L2.8 6"),
        'v' => (2.9, "M0 2L1.45 6L2.9 2"),
        'w' => (4.4, "M0 2L1.1 6L2.2 2.4L3.3 6L4.4 2"),
        'x' => (2.8, "M0 2L2.8 6M2.8 2L0 6"),
        'y' => (2.9, "M0 2L1.45 6M2.9 2L1.2 6.9Q.8 8 0 7.8"),
        'z' => (2.7, "M0 2L2.7 2L0 6L2.7 6"),
        '{' => (1.6, "M1.6 -.4Q.7 -.4 .7 .8L.7 2.2Q.7 3.2 0 3.2Q.7 3.2 .7 4.2L.7 5.6Q.7 6.8 1.6 6.8"),
        '|' => (0.0, "M0 -.4L0 6.8"),
        '}' => (1.6, "M0 -.4Q.9 -.4 .9 .8L.9 2.2Q.9 3.2 1.6 3.2Q.9 3.2 .9 4.2L.9 5.6Q.9 6.8 0 6.8"),
        '~' => (3.2, "M0 3.9Q.8 2.6 1.6 3.4Q2.4 4.2 3.2 3"),
        '°' => (1.6, "M.8 0Q1.6 0 1.6 .8Q1.6 1.6 .8 1.6Q0 1.6 0 .8Q0 0 .8 0"),
        '·' => (0.0, "M0 3.6L0 3.6"),
        '×' => (2.6, "M0 2.2L2.6 4.8M2.6 2.2L0 4.8"),
        '±' => (3.2, "M1.6 1.3L1.6 4.3M0 2.8L3.2 2.8M0 5.6L3.2 5.6"),
        '−' | '–' => (3.2, "M0 3.5L3.2 3.5"),
        'µ' | 'μ' => (2.8, "M0 2L0 8M0 4.5Q0 6 1.2 6Q2.5 6 2.8 4.5M2.8 2L2.8 6"),
        '→' => (4.0, "M0 3.6L4 3.6M2.6 2.2L4 3.6L2.6 5"),
        '✓' => (3.8, "M0 3.6L1.3 5.4L3.8 .8"),
        _ => (3.0, "M0 0L3 0L3 6L0 6L0 0"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_ascii_character_has_a_glyph_inside_its_cell() {
        let missing = glyph('\u{4e00}');
        for character in (' '..='~').chain("°·×±−µ→✓".chars()) {
            let (width, path) = glyph(character);
            assert_ne!((width, path), missing, "{character:?} has no glyph");
            for point in glyph_polylines(path).into_iter().flatten() {
                assert!((-0.5..=width + 0.5).contains(&point.x), "{character:?} at {point}");
                assert!((-0.6..=CAP_HEIGHT + DESCENT).contains(&point.y), "{character:?} at {point}");
            }
        }
    }

    #[test]
    fn width_is_the_sum_of_advances() {
        assert_eq!(text_width(""), 0.0);
        assert!((text_width("8") - 3.6).abs() < 1e-9);
        assert!((text_width("88") - (3.6 + LETTER_GAP + 3.6)).abs() < 1e-9);
    }
}
