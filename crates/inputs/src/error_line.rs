//! An error and its causes as one line.

/// Joins the error and its causes to one line. A cause is left out if the text so far contains it already.
pub fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let text = cause.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        if line.is_empty() {
            line = text;
        } else if !line.contains(&text) {
            line = format!("{line}: {text}");
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;
    use std::io;

    #[test]
    fn causes_follow_each_other_once() {
        let cause: anyhow::Result<()> = Err(io::Error::other("disk\nfull")).context("model.sdg: cannot write");
        assert_eq!(one_line(&cause.unwrap_err()), "model.sdg: cannot write: disk full");
        let quoted: anyhow::Result<()> = Err(io::Error::other("full")).context("cannot write: full");
        assert_eq!(one_line(&quoted.unwrap_err()), "cannot write: full");
    }
}
