//! Formats figures and updates the file that keeps them.

use std::path::Path;

use anyhow::{Context, Result};
use sdg_files::write_atomically;

/// Replaces the text between the marks `<!-- NAME: begin -->` and `<!-- NAME: end -->` of
/// a file by `new`.
pub fn rewrite(results: &Path, name: &str, new: &str) -> Result<()> {
    let text = std::fs::read_to_string(results).with_context(|| results.display().to_string())?;
    let text = between_marks(&text, name, new)
        .with_context(|| format!("{}: expected the marks \"{name}: begin\" and \"{name}: end\"", results.display()))?;
    Ok(write_atomically(results, text.as_bytes())?)
}

/// `text` with the text between the marks replaced.
fn between_marks(text: &str, name: &str, new: &str) -> Option<String> {
    let [begin, end] = ["begin", "end"].map(|which| format!("<!-- {name}: {which} -->"));
    let (before, rest) = text.split_once(&begin)?;
    let (_, after) = rest.split_once(&end)?;
    Some(format!("{before}{begin}\n{}\n{end}{after}", new.trim_end()))
}

/// Formats a duration with three significant digits, in milliseconds below one second.
pub fn duration(secs: f64) -> String {
    match secs {
        s if s >= 100.0 => format!("{s:.0} s"),
        s if s >= 10.0 => format!("{s:.1} s"),
        s if s >= 1.0 => format!("{s:.2} s"),
        s if s >= 0.1 => format!("{:.0} ms", 1e3 * s),
        s if s >= 0.01 => format!("{:.1} ms", 1e3 * s),
        s => format!("{:.2} ms", 1e3 * s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_keeps_what_stands_around_the_marks() {
        let text = "# Title\n\n<!-- a: begin -->\nold\n<!-- a: end -->\n\nafter\n";
        let new = between_marks(text, "a", "new\n").unwrap();
        assert_eq!(new, "# Title\n\n<!-- a: begin -->\nnew\n<!-- a: end -->\n\nafter\n");
        assert_eq!(between_marks(text, "b", "new"), None);
    }
}
