//! Lines of messages: an error and its causes, and lists of names.

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

/// The first `max_named` names, and the number of the others.
pub fn first_names(names: &[String], max_named: usize) -> String {
    match names.split_at_checked(max_named) {
        Some((first, others @ [_, ..])) => format!("{}, {} more", first.join(", "), others.len()),
        _ => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;
    use std::io;

    #[test]
    fn long_lists_end_with_the_number_of_the_others() {
        let names: Vec<String> = (1..=5).map(|number| format!("{number}.png")).collect();
        assert_eq!(first_names(&names, 3), "1.png, 2.png, 3.png, 2 more");
        assert_eq!(first_names(&names[..3], 3), "1.png, 2.png, 3.png");
        assert_eq!(first_names(&[], 3), "");
    }

    #[test]
    fn causes_follow_each_other_once() {
        let cause: anyhow::Result<()> = Err(io::Error::other("disk\nfull")).context("model.sdg: cannot write");
        assert_eq!(one_line(&cause.unwrap_err()), "model.sdg: cannot write: disk full");
        let quoted: anyhow::Result<()> = Err(io::Error::other("full")).context("cannot write: full");
        assert_eq!(one_line(&quoted.unwrap_err()), "cannot write: full");
    }
}
