//! A program and its arguments on one line, split as by a shell, but without a shell.

use std::fmt;
use std::str::FromStr;

use crate::error::CameraError;

/// A program and its arguments.
///
/// Words are separated by blanks. Quotes (`'…'` and `"…"`) preserve blanks, and a backslash preserves the next
/// character (within `'…'` it is an ordinary character). Variables, wildcards, pipes and redirections are not
/// supported; use `sh -c '…'` for them.
///
/// ```
/// let line: sdg_camera::CommandLine = r#"ffmpeg -i 'my film.mp4' -f mjpeg -"#.parse()?;
/// assert_eq!(line.words(), ["ffmpeg", "-i", "my film.mp4", "-f", "mjpeg", "-"]);
/// # Ok::<(), sdg_camera::CameraError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandLine {
    text: String,
    words: Vec<String>,
}

impl CommandLine {
    /// The program and its arguments; never empty.
    pub fn words(&self) -> &[String] {
        &self.words
    }
}

impl fmt::Display for CommandLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for CommandLine {
    type Err = CameraError;

    fn from_str(text: &str) -> Result<Self, CameraError> {
        let refused = |expected: &str| CameraError::Address { expected: expected.into(), found: text.into() };
        let mut words = Vec::new();
        let mut word: Option<String> = None;
        let mut quote = None;
        let mut characters = text.chars();
        while let Some(character) = characters.next() {
            match (quote, character) {
                (None, blank) if blank.is_whitespace() => words.extend(word.take()),
                (None, '\'' | '"') => {
                    quote = Some(character);
                    word.get_or_insert_default();
                }
                (Some(open), close) if open == close => quote = None,
                (None | Some('"'), '\\') => {
                    let next = characters.next().ok_or_else(|| refused("a character after the last backslash"))?;
                    word.get_or_insert_default().push(next);
                }
                _ => word.get_or_insert_default().push(character),
            }
        }
        if let Some(open) = quote {
            return Err(refused(&format!("a closing {open}")));
        }
        words.extend(word);
        if words.first().is_none_or(String::is_empty) {
            return Err(refused("a program and its arguments"));
        }
        Ok(Self { text: text.trim().to_owned(), words })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.parse::<CommandLine>().unwrap().words
    }

    #[test]
    fn quotes_and_backslashes_keep_blanks() {
        assert_eq!(words("  a  b\tc "), ["a", "b", "c"]);
        assert_eq!(
            words(r#"a 'b  c' "d \" e" f\ g '' h'i'"j" '\n'"#),
            ["a", "b  c", "d \" e", "f g", "", "hij", "\\n"]
        );
        assert_eq!(words("sh -c 'echo $HOME | cat'"), ["sh", "-c", "echo $HOME | cat"]);
    }

    #[test]
    fn what_does_not_close_is_refused() {
        for (text, expected) in [
            ("", "a program"),
            ("''", "a program"),
            ("a 'b", "closing '"),
            ("a \"b", "closing \""),
            ("a\\", "backslash"),
        ] {
            let error = text.parse::<CommandLine>().unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
