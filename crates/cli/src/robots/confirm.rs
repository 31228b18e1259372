//! Asks for permission to move the arm.

use std::io::{BufRead, IsTerminal, Write};

use anyhow::{Context, Result};

use crate::interrupt::while_asking;

/// The person's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Consent {
    /// The arm may move.
    Given,
    Refused,
}

/// Asks on the terminal; `is_yes` skips the question. If stdin is not a terminal, the permission is refused.
///
/// # Errors
/// The terminal cannot be read.
pub(crate) fn confirm(question: &str, is_yes: bool) -> Result<Consent> {
    if is_yes {
        return Ok(Consent::Given);
    }
    let stdin = std::io::stdin();
    if !stdin.is_terminal() {
        eprintln!("{question} stdin is not a terminal, so nothing moves; pass --yes to confirm.");
        return Ok(Consent::Refused);
    }
    eprint!("{question} [y/N] ");
    std::io::stderr().flush().context("standard error")?;
    while_asking(|| answer(&mut stdin.lock()))
}

fn answer(input: &mut dyn BufRead) -> Result<Consent> {
    let mut line = String::new();
    input.read_line(&mut line).context("standard input")?;
    let is_yes = matches!(line.trim().to_ascii_lowercase().as_str(), "y" | "yes");
    Ok(if is_yes { Consent::Given } else { Consent::Refused })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_yes_is_yes() {
        for (text, expected) in [
            ("y\n", Consent::Given),
            ("YES\n", Consent::Given),
            ("\n", Consent::Refused),
            ("", Consent::Refused),
            ("n\n", Consent::Refused),
            ("yesterday\n", Consent::Refused),
        ] {
            assert_eq!(answer(&mut text.as_bytes()).unwrap(), expected, "{text:?}");
        }
    }
}
