//! Text and numbers in HTML.

/// Escapes text for element content and for quoted attribute values.
///
/// Control characters except newline and tab are replaced by U+FFFD, so that a damaged label cannot break the page.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len() + text.len() / 8);
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\n' | '\t' => escaped.push(character),
            c if c.is_control() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Formats a number with fixed decimals and a true minus sign; a dash if the number is not finite.
#[must_use]
pub fn format_number(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let formatted = format!("{value:.decimals$}");
    match formatted.strip_prefix('-') {
        // Rounding may give "-0.0", which is shown as "0.0".
        Some(digits) if digits.bytes().all(|b| matches!(b, b'0' | b'.')) => digits.to_owned(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => formatted,
    }
}

/// An identifier for anchors: lower-case ASCII letters, digits and hyphens.
pub(crate) fn slug(text: &str) -> String {
    let mut slug = String::new();
    for character in text.chars() {
        if character.is_ascii_alphanumeric() {
            slug.push(character.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    slug.trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_becomes_text() {
        assert_eq!(escape("<b a=\"x\">'&'</b>"), "&lt;b a=&quot;x&quot;&gt;&#39;&amp;&#39;&lt;/b&gt;");
        assert_eq!(escape("a\u{0}b\n"), "a\u{fffd}b\n");
        assert_eq!(escape("7 µm · 3°"), "7 µm · 3°");
    }

    #[test]
    fn numbers_have_fixed_decimals_and_a_true_minus() {
        assert_eq!(format_number(-1.25, 1), "\u{2212}1.2");
        assert_eq!(format_number(-0.04, 1), "0.0");
        assert_eq!(format_number(12.0, 0), "12");
        assert_eq!(format_number(f64::NAN, 2), "–");
        assert_eq!(format_number(f64::NEG_INFINITY, 2), "–");
    }

    #[test]
    fn anchors_are_plain() {
        assert_eq!(slug("What it saw: 10 mm & 10°"), "what-it-saw-10-mm-10");
        assert_eq!(slug("µ°"), "");
    }
}
