//! The kind of a file without marks, or with marks of another program, so that the error can name it.

use serde_json::Value;

use crate::json::shorten;

/// The kind of a file, by its content; `None` if it may be JSON or a row of labels, or for unknown bytes.
pub(crate) fn other_kind(bytes: &[u8]) -> Option<String> {
    let said = |words: &str| Some(words.to_owned());
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    match bytes {
        [] => return said("nothing: the file is empty"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => return said("text in UTF-16: save it as UTF-8"),
        [b'<', ..] => return said("XML: export the marks as COCO or YOLO-pose"),
        [0x89, b'P', b'N', b'G', ..] | [0xff, 0xd8, 0xff, ..] => return said("a picture: give the file of its marks"),
        _ => {}
    }
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        // Text contains neither zeros nor control characters.
        Err(_) if bytes.iter().any(|byte| *byte < b' ' && !byte.is_ascii_whitespace()) => return None,
        Err(error) => {
            let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
            return Some(format!("text in another encoding than UTF-8 (line {line}): save it as UTF-8"));
        }
    };
    if text.starts_with(['{', '[', '"']) {
        return None;
    }
    let is_number = |field: &str| field.trim().parse::<f64>().is_ok();
    let is_decimal_comma = |field: &str| is_number(&field.replace(',', ".")) && !field.ends_with(',');
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    let Some(first) = first else { return said("comments alone") };
    if first.contains(char::is_control) {
        return None;
    }
    let words = || first.split_whitespace();
    let key = first.split_once(':').filter(|(_, value)| value.is_empty() || value.starts_with(char::is_whitespace));
    let is_row = |separator: char| first.contains(separator) && first.split(separator).all(is_number);
    if is_row(',') {
        said("a row of numbers with commas: YOLO-pose has blanks between them")
    } else if is_row(';') {
        said("a row of numbers with semicolons: YOLO-pose has blanks between them")
    } else if words().count() > 1 && words().all(is_decimal_comma) {
        said("numbers with decimal commas: YOLO-pose has points")
    } else if first == "---" || key.is_some_and(|(key, _)| !key.contains([',', ';', '{'])) {
        said(
            "YAML, as a dataset's data.yaml: give the labels of the photo (.txt), and leave data.yaml beside or above them",
        )
    } else if words().next().is_some_and(is_number) {
        // A row of labels with another content, or a single number.
        None
    } else {
        Some(format!("words, as in a list of classes (classes.txt): `{}`", shorten(first)))
    }
}

/// The program of a JSON file, if the keys show it.
pub(crate) fn other_json(value: &Value) -> Option<&'static str> {
    let has = |value: &Value, key: &str| value.get(key).is_some();
    let first = value.as_array().and_then(|items| items.first());
    if first.is_some_and(|task| has(task, "annotations") || has(task, "completions") || has(task, "predictions")) {
        Some("Label Studio's own JSON: export the marks as COCO, or as YOLO-pose with its data.yaml")
    } else if has(value, "_via_settings") || has(value, "_via_img_metadata") {
        Some("a project of VIA: export the marks as COCO")
    } else if has(value, "annotations") && has(value, "categories") && !has(value, "images") {
        Some("COCO JSON without its list `images`")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use crate::{Annotation, ImageFacts};

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    #[test]
    fn each_kind_is_told_in_its_own_words() {
        for (bytes, part) in [
            (&b"pendulum\nrod end\n"[..], "a list of classes (classes.txt): `pendulum`"),
            (b"pendulum", "a list of classes"),
            (b"# classes\npendulum\n", "a list of classes"),
            (b"# nothing else\n", "comments alone"),
            (b"# data\nnames: [a]\n", "YAML"),
            (b"kpt_shape: [2, 3]\nnames:\n  0: part\n", "YAML, as a dataset's data.yaml"),
            (b"---\nnames: [a]\n", "YAML"),
            (b"0;0.5;0.5;0.25;0.25\n", "semicolons: YOLO-pose has blanks"),
            (b"0 0,5 0,5 0,25 0,25\n", "decimal commas"),
            (b"{\"shapes\": [{\"label\": \"Schl\xfcssel\"}]}", "another encoding than UTF-8 (line 1)"),
            (b"0 0.5 0.5 0.1 0.1\n# Schl\xfcssel\n", "another encoding than UTF-8 (line 2)"),
            (b"\xff\xd8\xff\xe0\0", "a picture"),
            (b"[{\"id\": 1, \"annotations\": [], \"data\": {}}]", "Label Studio"),
            (b"{\"_via_settings\": {}, \"_via_img_metadata\": {}}", "VIA"),
            (b"{\"annotations\": [], \"categories\": []}", "without its list `images`"),
        ] {
            let told = Annotation::read(bytes, &IMAGE).unwrap_err().to_string();
            assert!(told.contains(part), "expected `{part}` in `{told}`");
        }
    }
}
