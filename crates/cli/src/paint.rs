//! Terminal colours: none for files, pipes and dumb terminals, nor with `NO_COLOR` (https://no-color.org).

use std::io::IsTerminal;

/// The meaning of a colour, which the text also states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Found.
    Good,
    /// Needs attention: refused, or a warning.
    Doubtful,
    /// An error.
    Bad,
}

/// Whether the output to a stream is coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paint(bool);

impl Paint {
    /// No colours.
    #[cfg(test)]
    pub const PLAIN: Self = Self(false);

    /// For standard output.
    pub fn stdout() -> Self {
        Self(std::io::stdout().is_terminal() && is_wanted(|name| std::env::var_os(name)))
    }

    /// For standard error.
    pub fn stderr() -> Self {
        Self(std::io::stderr().is_terminal() && is_wanted(|name| std::env::var_os(name)))
    }

    /// The text in the tone's colour from the terminal's palette.
    pub fn text(self, tone: Tone, text: &str) -> String {
        let code = match tone {
            Tone::Good => 32,
            Tone::Doubtful => 33,
            Tone::Bad => 31,
        };
        if self.0 { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }
}

fn is_wanted(variable: impl Fn(&str) -> Option<std::ffi::OsString>) -> bool {
    let is_off = variable("NO_COLOR").is_some_and(|value| !value.is_empty());
    !is_off && variable("TERM").is_none_or(|terminal| terminal != "dumb")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_color_and_a_dumb_terminal_are_honoured() {
        let with =
            |name: &'static str, value: &'static str| is_wanted(move |asked| (asked == name).then(|| value.into()));
        assert!(with("TERM", "xterm-256color") && with("NO_COLOR", ""));
        assert!(!with("NO_COLOR", "1") && !with("TERM", "dumb"));
    }

    #[test]
    fn text_is_coloured_and_its_colour_ended() {
        assert_eq!(Paint(true).text(Tone::Bad, "sdg:"), "\x1b[31msdg:\x1b[0m");
        assert_eq!(Paint::PLAIN.text(Tone::Bad, "sdg:"), "sdg:");
    }
}
