//! A strict HTML parser for tests of the other modules.

/// Elements without an end tag.
const VOID: [&str; 5] = ["meta", "link", "img", "br", "source"];

/// Panics unless all tags are closed in order, attributes are quoted and unique, each `&` starts an entity, and each
/// `id` is unique.
pub(crate) fn assert_well_formed(html: &str) {
    let mut open: Vec<String> = Vec::new();
    let mut ids = std::collections::HashSet::new();
    let mut rest = html.strip_prefix("<!doctype html>").unwrap_or(html);
    while let Some(start) = rest.find('<') {
        check_text(&rest[..start], open.last().map(String::as_str));
        let (tag, after) = split_tag(&rest[start + 1..]);
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            let expected = open.pop();
            assert_eq!(expected.as_deref(), Some(name), "</{name}> closes <{expected:?}>");
            continue;
        }
        let (name, attributes, closed) = parse_tag(tag);
        for (key, value) in attributes {
            check_text(&value, None);
            if key == "id" {
                assert!(ids.insert(value.clone()), "id {value} twice");
            }
        }
        if !closed && !VOID.contains(&name.as_str()) {
            open.push(name);
        }
    }
    check_text(rest, None);
    assert!(open.is_empty(), "left open: {open:?}");
}

/// Splits a tag at its closing `>`, which is the first one outside quotes.
fn split_tag(text: &str) -> (&str, &str) {
    let mut quoted = false;
    for (at, character) in text.char_indices() {
        match character {
            '"' => quoted = !quoted,
            '>' if !quoted => return (&text[..at], &text[at + 1..]),
            '<' if !quoted => panic!("< inside the tag {}", &text[..at]),
            _ => {}
        }
    }
    panic!("no end of the tag {}", text.chars().take(60).collect::<String>());
}

fn parse_tag(tag: &str) -> (String, Vec<(String, String)>, bool) {
    let closed = tag.ends_with('/');
    let tag = tag.trim_end_matches('/').trim();
    let (name, mut rest) = tag.split_once(char::is_whitespace).unwrap_or((tag, ""));
    assert!(name.bytes().all(|b| b.is_ascii_alphanumeric()) && !name.is_empty(), "element name {name:?}");
    let mut attributes: Vec<(String, String)> = Vec::new();
    while !rest.trim_start().is_empty() {
        let (key, after) = rest.trim_start().split_once("=\"").unwrap_or_else(|| panic!("attribute in <{tag}>"));
        let (value, after) = after.split_once('"').unwrap_or_else(|| panic!("quote in <{tag}>"));
        assert!(attributes.iter().all(|(known, _)| known != key), "{key} twice in <{tag}>");
        attributes.push((key.to_owned(), value.to_owned()));
        rest = after;
    }
    (name.to_owned(), attributes, closed)
}

fn check_text(text: &str, parent: Option<&str>) {
    if parent == Some("style") {
        return;
    }
    assert!(!text.contains('>'), "bare > in {text:?}");
    for (at, _) in text.match_indices('&') {
        let entity = text[at + 1..].split(';').next().unwrap_or_default();
        assert!(["amp", "lt", "gt", "quot", "#39"].contains(&entity), "entity &{entity} in {text:?}");
    }
}

#[test]
fn what_is_wrong_is_seen() {
    assert_well_formed("<p class=\"a\">1 &lt; 2<br></p><path d=\"M0 0\"/>");
    for wrong in [
        "<p>",
        "</p>",
        "<p><b></p></b>",
        "<p a=\"1\" a=\"2\"></p>",
        "a & b",
        "<i id=\"x\"></i><i id=\"x\"></i>",
        "<p a=1></p>",
    ] {
        assert!(std::panic::catch_unwind(|| assert_well_formed(wrong)).is_err(), "{wrong}");
    }
}
