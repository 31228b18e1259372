//! Each field of a `--json` output has to be named in the documents.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use serde_json::Value;

/// Checks the output of `sdg ARGUMENTS --json`: one object, or one per line.
pub fn assert_fields_are_documented(arguments: &[impl AsRef<OsStr>], printed: &[u8]) {
    let words: Vec<&str> = arguments.iter().filter_map(|word| word.as_ref().to_str()).collect();
    let Some(verb) = words.first().copied().filter(|_| words.contains(&"--json")) else { return };
    let printed = String::from_utf8_lossy(printed);
    let objects = serde_json::Deserializer::from_str(&printed).into_iter::<Value>();
    let mut fields = BTreeSet::new();
    for object in objects.map_while(Result::ok) {
        insert_fields(&object, &mut fields);
    }
    let described = described_words(verb);
    fields.retain(|field| !described.contains(field));
    assert!(fields.is_empty(), "sdg {verb} --json prints fields that no document describes: {fields:?}");
}

fn insert_fields(value: &Value, fields: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (field, value) in object {
                fields.insert(field.clone());
                insert_fields(value, fields);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| insert_fields(value, fields)),
        _ => {}
    }
}

/// The words in code spans and code blocks of the documents on a command's JSON.
fn described_words(verb: &str) -> BTreeSet<String> {
    let read = |name: &str| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
        fs::read_to_string(file).unwrap()
    };
    let sections = |document: &str, is_about: &dyn Fn(&str) -> bool| -> String {
        document.split("\n## ").filter(|section| is_about(section.lines().next().unwrap_or_default())).collect()
    };
    let is_of_verb = |title: &str| title.contains("--json") && title.contains(&format!("`sdg {verb}"));
    let mut text = sections(&read("command-line.md"), &is_of_verb) + &sections(&read("json.md"), &is_of_verb);
    match verb {
        "camera" => text += &read("live-pictures.md"),
        "evaluate" => {
            text += &sections(&read("reference.md"), &|title| title == "`sdg evaluate`");
            // Each picture has detections as `sdg detect` prints them.
            text += &sections(&read("command-line.md"), &|title| title.starts_with("`sdg detect --json`"));
        }
        // The facts of teaching are printed as the model file has them.
        "teach" => text += &sections(&read("file-formats.md"), &|title| title == "Grasp model"),
        _ => {}
    }
    // Every second piece between backticks is code; a fence of three backticks counts as one backtick.
    let code = text.split('`').skip(1).step_by(2);
    code.flat_map(|code| code.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))).map(str::to_owned).collect()
}
