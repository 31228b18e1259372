//! Reads and changes the tags of an MJCF text and their attributes; keeps the rest of the text.

/// One tag: its name, and its attributes in their order.
pub(super) struct Tag {
    pub(super) name: String,
    attributes: Vec<(String, String)>,
}

impl Tag {
    /// Reads the inside of `<…>`; `None` for comments and closing tags.
    fn parse(inside: &str) -> Option<Self> {
        let inside = inside.trim_end_matches('/').trim();
        let name_end = inside.find(|c: char| c.is_ascii_whitespace()).unwrap_or(inside.len());
        let name = &inside[..name_end];
        if name.is_empty() || name.starts_with(['/', '!', '?']) {
            return None;
        }
        let mut attributes = Vec::new();
        let mut rest = inside[name_end..].trim_start();
        while let Some(equals) = rest.find('=') {
            let key = rest[..equals].trim();
            let value = rest[equals + 1..].trim_start();
            let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let end = value[1..].find(quote)? + 1;
            attributes.push((key.to_owned(), value[1..end].to_owned()));
            rest = value[end + 1..].trim_start();
        }
        Some(Self { name: name.to_owned(), attributes })
    }

    /// The value of an attribute.
    pub(super) fn get(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// The numbers of an attribute; `None` if it is absent or contains something else.
    pub(super) fn numbers(&self, key: &str) -> Option<Vec<f64>> {
        self.get(key)?.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
    }

    /// Sets an attribute, or adds it if it is missing.
    pub(super) fn set(&mut self, key: &str, value: String) {
        match self.attributes.iter_mut().find(|(known, _)| known == key) {
            Some((_, old)) => *old = value,
            None => self.attributes.push((key.to_owned(), value)),
        }
    }

    /// Replaces the numbers of an attribute, if the tag has it.
    pub(super) fn map_numbers(&mut self, key: &str, map: impl FnOnce(&mut Vec<f64>)) {
        if let Some(mut numbers) = self.numbers(key) {
            map(&mut numbers);
            let words: Vec<String> = numbers.iter().map(|value| format!("{}", value + 0.0)).collect();
            self.set(key, words.join(" "));
        }
    }
}

/// All tags of a text in order, without comments and closing tags.
pub(super) fn tags(mjcf: &str) -> Vec<Tag> {
    let mut found = Vec::new();
    map_tags(mjcf, |tag| {
        found.push(Tag { name: tag.name.clone(), attributes: tag.attributes.clone() });
        false
    });
    found
}

/// The text with its tags changed; a tag for which `change` returns false is not changed.
pub(super) fn map_tags(mjcf: &str, mut change: impl FnMut(&mut Tag) -> bool) -> String {
    let mut text = String::with_capacity(mjcf.len());
    let mut rest = mjcf;
    while let Some(open) = rest.find('<') {
        text.push_str(&rest[..open]);
        rest = &rest[open..];
        let close = if rest.starts_with("<!--") { rest.find("-->").map(|at| at + 2) } else { rest.find('>') };
        let Some(close) = close else { break };
        let whole = &rest[..=close];
        rest = &rest[close + 1..];
        let inside = &whole[1..whole.len() - 1];
        let changed = Tag::parse(inside).and_then(|mut tag| change(&mut tag).then_some(tag));
        match changed {
            Some(tag) => {
                text.push('<');
                text.push_str(&tag.name);
                for (key, value) in &tag.attributes {
                    text.push_str(&format!(" {key}=\"{value}\""));
                }
                text.push_str(if inside.trim_end().ends_with('/') { "/>" } else { ">" });
            }
            None => text.push_str(whole),
        }
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "<!-- <geom pos=\"9\"/> -->\n<body name=\"object\">\n  <geom type='box'  pos=\"1 2 3\"/></body>";

    #[test]
    fn only_what_is_changed_is_written_anew() {
        assert_eq!(map_tags(TEXT, |_| false), TEXT);
        let changed = map_tags(TEXT, |tag| {
            tag.map_numbers("pos", |p| p[1] = -p[1]);
            tag.name == "geom"
        });
        assert!(changed.ends_with("<geom type=\"box\" pos=\"1 -2 3\"/></body>"), "{changed}");
        assert!(changed.starts_with("<!-- <geom pos=\"9\"/> -->\n<body name=\"object\">"));
    }

    #[test]
    fn tags_are_listed_with_their_attributes() {
        let tags = tags(TEXT);
        assert_eq!(tags.iter().map(|tag| tag.name.as_str()).collect::<Vec<_>>(), ["body", "geom"]);
        assert_eq!(tags[1].get("type"), Some("box"));
        assert_eq!(tags[1].numbers("pos"), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(tags[1].numbers("quat"), None);
    }
}
