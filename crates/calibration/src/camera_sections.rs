//! Updates a camera file and keeps the rest of it: comments, and fields of other programs.
//!
//! A section is a line that starts with the section's name, and the indented lines after this line. ROS's tools write
//! `camera_info` in this form.

/// Replaces each of the `known` sections of `existing` by the section of the same name in `sections`, or removes it if
/// `sections` has none. Missing sections are added at the end.
pub(crate) fn merged(existing: &str, known: &[&str], sections: &[(&str, String)]) -> String {
    let mut text = String::new();
    let mut written: Vec<&str> = Vec::new();
    let mut is_dropping = false;
    for line in existing.lines() {
        let is_indented = line.starts_with([' ', '\t']);
        if is_indented && is_dropping {
            continue;
        }
        is_dropping = false;
        let name = line.split_once(':').map(|(name, _)| name).filter(|name| !is_indented && known.contains(name));
        let Some(name) = name else {
            text.push_str(line);
            text.push('\n');
            continue;
        };
        is_dropping = true;
        if let Some((name, section)) = sections.iter().find(|(of, _)| *of == name) {
            text.push_str(section);
            written.push(name);
        }
    }
    for (_, section) in sections.iter().filter(|(name, _)| !written.contains(name)) {
        text.push_str(section);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_stays() {
        let existing = "# mine\nwidth: 3\nexposure:\n  auto: no\n# between\ntable:\n  a: 1\n  b:\n    c: 2\nnote: x\n";
        let sections = [("width", "width: 4\n".to_owned()), ("table", "table:\n  d: 5\n".to_owned())];
        let merged_all = merged(existing, &["width", "table", "name"], &sections);
        assert_eq!(merged_all, "# mine\nwidth: 4\nexposure:\n  auto: no\n# between\ntable:\n  d: 5\nnote: x\n");
        let fewer = merged(existing, &["width", "table"], &[("name", "name: n\n".to_owned())]);
        assert_eq!(fewer, "# mine\nexposure:\n  auto: no\n# between\nnote: x\nname: n\n");
    }
}
