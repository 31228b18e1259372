//! The entries of a YOLO dataset's `data.yaml` that its labels need: `names`, `kpt_shape` and `kpt_names`.
//!
//! This module reads the usual forms: a list in brackets, a list with dashes, and a map from numbers. It ignores other
//! entries.

use crate::{Error, Result};

/// More classes than any dataset has; limits the cost of a hostile file.
const MAX_NAMES: usize = 100_000;

/// The entries needed for reading labels.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct DataYaml {
    /// The label of each class.
    pub names: Vec<String>,
    /// Number of keypoints per object, and numbers per keypoint: 2 or 3.
    pub keypoint_shape: Option<[usize; 2]>,
    /// The keypoints' names, by class; a list for all classes has `None` as its class.
    pub keypoint_names: Vec<(Option<usize>, Vec<String>)>,
}

impl DataYaml {
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let malformed = |place: &str, expected: &str, found: &str| Error::Malformed {
            place: format!("data.yaml, {place}"),
            expected: expected.to_owned(),
            found: crate::json::shorten(found),
        };
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|_| malformed("the file", "text", "other bytes"))?;
        let mut data = Self::default();
        if let Some(items) = entry(text, "kpt_shape") {
            let numbers: Vec<usize> = items.iter().filter_map(|(_, item)| item.parse().ok()).collect();
            let shape = <[usize; 2]>::try_from(numbers)
                .ok()
                .filter(|[count, stride]| items.len() == 2 && (1..=10_000).contains(count) && [2, 3].contains(stride));
            let found = items.iter().map(|(_, item)| item.as_str()).collect::<Vec<_>>().join(", ");
            let expected = "keypoints and numbers per keypoint, such as [2, 3]";
            data.keypoint_shape = Some(shape.ok_or_else(|| malformed("kpt_shape", expected, &found))?);
        }
        for (place, (key, name)) in entry(text, "names").unwrap_or_default().into_iter().enumerate() {
            let class = match key {
                None => place,
                Some(key) => key.parse().map_err(|_| malformed("names", "classes counted from 0", &key))?,
            };
            if class >= MAX_NAMES {
                return Err(malformed("names", "fewer classes", &class.to_string()));
            }
            if data.names.len() <= class {
                data.names.resize(class + 1, String::new());
            }
            data.names[class] = name;
        }
        data.keypoint_names = keypoint_names(text);
        if data.keypoint_names.len() > MAX_NAMES {
            return Err(malformed("kpt_names", "fewer classes", &data.keypoint_names.len().to_string()));
        }
        Ok(data)
    }

    /// The indices of the grasp's start and end among the keypoints of a class; `None` if no names give them.
    pub fn grasp_among_keypoints(&self, class: usize, num_keypoints: usize) -> Option<[usize; 2]> {
        let of_class = self.keypoint_names.iter().find(|(of, _)| of.is_none_or(|of| of == class));
        let names = of_class.map(|(_, names)| names).filter(|names| names.len() == num_keypoints)?;
        let place = |wanted: &str| names.iter().position(|name| name == wanted);
        Some([place("grasp_start")?, place("grasp_end")?])
    }

    /// The file's text, as Ultralytics reads it; users fill in the paths.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        if let Some([count, stride]) = self.keypoint_shape {
            text += &format!("kpt_shape: [{count}, {stride}]\n");
        }
        text += "names:\n";
        for (class, name) in self.names.iter().enumerate() {
            // In single quotes only a single quote is special; line ends would be folded.
            let name = name.replace('\'', "''").replace(['\n', '\r'], " ");
            text += &format!("  {class}: '{name}'\n");
        }
        text
    }
}

/// The names of `kpt_names`: a list, or a list for each class.
fn keypoint_names(text: &str) -> Vec<(Option<usize>, Vec<String>)> {
    let mut lines = text.lines().map(without_comment);
    let Some(first) = lines.find_map(|line| line.strip_prefix("kpt_names")?.trim_start().strip_prefix(':')) else {
        return Vec::new();
    };
    let goes_on = |line: &&str| line.trim().is_empty() || line.starts_with([' ', '-', '\t', ']', '}']);
    let block: Vec<&str> = std::iter::once(first).chain(lines.take_while(goes_on)).collect();
    let mut all: Vec<(Option<usize>, Vec<String>)> = Vec::new();
    let words = block.join(" ").replace(['[', ']', '{', '}', ','], " ").replace(':', ": ");
    for word in words.split_whitespace().filter(|word| *word != "-") {
        let word = word.trim_matches(['\'', '"']);
        match word.strip_suffix(':').map(|key| key.trim_matches(['\'', '"']).parse().ok()) {
            Some(class) => all.push((class, Vec::new())),
            None => match all.last_mut() {
                Some((_, names)) => names.push(word.to_owned()),
                None => all.push((None, vec![word.to_owned()])),
            },
        }
    }
    all
}

/// The items of a top-level entry, each with its key if it has one.
fn entry(text: &str, name: &str) -> Option<Vec<(Option<String>, String)>> {
    let mut lines = text.lines();
    let rest = loop {
        let line = lines.next()?;
        if let Some(rest) = line.strip_prefix(name).and_then(|rest| rest.trim_start().strip_prefix(':')) {
            break without_comment(rest);
        }
    };
    if !rest.trim().is_empty() {
        // A list or a map in brackets, which may continue over lines.
        let mut whole = rest.trim().to_owned();
        let mut is_closed = whole.contains([']', '}']);
        while !is_closed {
            let line = without_comment(lines.next()?);
            // Only the new line is searched, because searching `whole` after each line would take quadratic time.
            is_closed = line.contains([']', '}']);
            whole += " ";
            whole += line;
        }
        let inside = whole.trim_matches(|c: char| "[]{} ".contains(c));
        return Some(split_items(inside).iter().map(|item| keyed(item, whole.starts_with('{'))).collect());
    }
    let items = lines
        .map(without_comment)
        .filter(|line| !line.trim().is_empty())
        .take_while(|line| line.starts_with([' ', '-', '\t']))
        .map(|line| match line.trim().strip_prefix('-') {
            Some(item) => keyed(item, false),
            None => keyed(line, true),
        });
    Some(items.collect())
}

/// The line up to a comment: a `#` after a blank, outside quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, character) in line.char_indices() {
        match (quote, character) {
            (None, '#') if before.is_whitespace() => return line[..at].trim_end(),
            (None, '\'' | '"') if !before.is_alphanumeric() => quote = Some(character),
            (Some(open), _) if open == character => quote = None,
            _ => {}
        }
        before = character;
    }
    line.trim_end()
}

/// Splits at commas outside quotes.
fn split_items(list: &str) -> Vec<String> {
    let (mut items, mut item, mut quote, mut before) = (Vec::new(), String::new(), None, ' ');
    for character in list.chars() {
        match quote {
            None if character == ',' => {
                items.push(std::mem::take(&mut item));
                before = ' ';
                continue;
            }
            None if matches!(character, '\'' | '"') && !before.is_alphanumeric() => quote = Some(character),
            Some(open) if open == character => quote = None,
            _ => {}
        }
        item.push(character);
        before = character;
    }
    if !item.trim().is_empty() {
        items.push(item);
    }
    items
}

/// Splits `key: value` where a key is expected, and removes quotes.
fn keyed(item: &str, has_key: bool) -> (Option<String>, String) {
    let unquoted = |text: &str| {
        let text = text.trim();
        let inside = |quote: char| text.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote));
        match (inside('\''), inside('"')) {
            (Some(inside), _) => inside.replace("''", "'"),
            (_, Some(inside)) => inside.replace("\\\"", "\"").replace("\\\\", "\\"),
            _ => text.to_owned(),
        }
    };
    match item.split_once(':').filter(|_| has_key) {
        Some((key, value)) => (Some(unquoted(key)), unquoted(value)),
        None => (None, unquoted(item)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_ways_in_which_names_are_written() {
        let expected = ["rod end", "it's, a part"];
        for text in [
            "path: ../x  # where\nkpt_shape: [2, 3]\nnames: ['rod end', \"it's, a part\"]\nnc: 2\n",
            "names:\n  - rod end\n  - 'it''s, a part'   # second\nkpt_shape: [2, 3]\n",
            "kpt_shape:\n- 2\n- 3\n\n# classes\nnames:\n  0: rod end\n  1: \"it's, a part\"\n",
            "names: {0: rod end,\n  1: 'it''s, a part'}\nkpt_shape: [2,3] # x y v\n",
        ] {
            let data = DataYaml::parse(text.as_bytes()).unwrap();
            assert_eq!(
                data,
                DataYaml {
                    names: expected.map(str::to_owned).to_vec(),
                    keypoint_shape: Some([2, 3]),
                    ..DataYaml::default()
                },
                "{text}"
            );
        }
        assert_eq!(DataYaml::parse(b"train: images\n"), Ok(DataYaml::default()));
    }

    #[test]
    fn the_number_of_a_class_is_bounded() {
        let last = |class: usize| DataYaml::parse(format!("names:\n  {class}: rod\n").as_bytes());
        assert_eq!(last(MAX_NAMES - 1).unwrap().names.len(), MAX_NAMES);
        let refused = last(MAX_NAMES).unwrap_err().to_string();
        assert!(refused.contains("fewer classes") && refused.contains("100000"), "{refused}");
        let many = format!("kpt_names: {{{}}}\n", "0: ".repeat(MAX_NAMES + 1));
        let refused = DataYaml::parse(many.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains("kpt_names") && refused.contains("100001"), "{refused}");
    }

    #[test]
    fn a_list_over_many_lines_takes_linear_time() {
        // Quadratic time would be a quarter of an hour.
        let started = std::time::Instant::now();
        let text = format!("names: [rod,{}\nbolt]\n", "\n".repeat(1_500_000));
        assert_eq!(DataYaml::parse(text.as_bytes()).unwrap().names, ["rod", "bolt"]);
        assert!(started.elapsed().as_secs() < 60);
    }

    #[test]
    fn keypoints_are_named_by_class_or_for_all() {
        let grasp = |text: &str, class| DataYaml::parse(text.as_bytes()).unwrap().grasp_among_keypoints(class, 2);
        let swapped = Some([1, 0]);
        assert_eq!(grasp("names: [rod]\nkpt_names:\n  0:\n    - grasp_end\n    - grasp_start\nnc: 1\n", 0), swapped);
        assert_eq!(grasp("kpt_names: {0: [a, b], 1: ['grasp_end', \"grasp_start\"]}  # order\n", 1), swapped);
        assert_eq!(grasp("kpt_names:\n- grasp_end\n- grasp_start\n", 3), swapped);
        assert_eq!(grasp("kpt_names:\n  0: [grasp_start, grasp_end]\n", 0), Some([0, 1]));
        for none in
            ["kpt_names: [tail, head]\n", "kpt_names: {1: [grasp_end, grasp_start]}\n", "names: [grasp_start]\n"]
        {
            assert_eq!(grasp(none, 0), None, "{none}");
        }
    }

    #[test]
    fn faults_are_named() {
        for (text, expected) in [
            ("kpt_shape: [17]\n", "kpt_shape: expected keypoints and numbers"),
            ("kpt_shape: [2, 4]\n", "found 2, 4"),
            ("names:\n  part: 1\n", "classes counted from 0, found part"),
            ("names:\n  4000000000: a\n", "fewer classes"),
        ] {
            let message = DataYaml::parse(text.as_bytes()).unwrap_err().to_string();
            assert!(message.contains(expected), "expected `{expected}` in `{message}`");
        }
    }

    proptest! {
        #[test]
        fn any_name_comes_back(name in "[^\\n\\r\\x00]{0,12}[a-z]") {
            let name = name.trim().to_owned();
            let data = DataYaml { names: vec![name.clone(), "b".into()], keypoint_shape: Some([2, 3]), ..DataYaml::default() };
            prop_assert_eq!(DataYaml::parse(data.to_text().as_bytes()).unwrap().names[0].clone(), name);
        }

        #[test]
        fn arbitrary_text_never_panics(text in "(names|kpt_shape|:|\\[|\\]|\\{|'|\"|,|-|#| |\\n|[0-9]|é){0,40}") {
            let _ = DataYaml::parse(text.as_bytes());
        }
    }
}
