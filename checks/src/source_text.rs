//! Removes comments, contents of strings, and items under `#[cfg(test)]` from Rust source.

use std::collections::BTreeSet;

/// `source` without comments, contents of strings and characters, and items compiled only for tests.
pub fn code_of(source: &str) -> String {
    without_test_items(&without_comments_and_strings(source))
}

/// The modules with their own files that `source` declares only for tests.
pub fn modules_for_tests(source: &str) -> BTreeSet<String> {
    let code = without_comments_and_strings(source);
    let declared = code.split(TEST_MARK).skip(1).filter_map(|item| {
        let (declaration, _) = item.split_once(';').filter(|(declaration, _)| !declaration.contains('{'))?;
        let (_, name) = declaration.rsplit_once("mod ")?;
        Some(name.trim().to_owned())
    });
    declared.collect()
}

/// The attribute of items that are compiled only for tests.
const TEST_MARK: &str = "#[cfg(test)]";

fn without_comments_and_strings(source: &str) -> String {
    let text: Vec<char> = source.chars().collect();
    let at = |i: usize| text.get(i).copied().unwrap_or('\0');
    let mut code = String::with_capacity(source.len());
    let mut i = 0;
    while i < text.len() {
        let is_inside_word = i > 0 && (at(i - 1).is_alphanumeric() || at(i - 1) == '_');
        match (at(i), at(i + 1)) {
            ('/', '/') => i += text[i..].iter().take_while(|&&c| c != '\n').count(),
            ('/', '*') => i = end_of_block_comment(&text, i),
            ('r', '"' | '#') if !is_inside_word && raw_string_hashes(&text, i).is_some() => {
                let hashes = raw_string_hashes(&text, i).unwrap_or_default();
                let close: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
                let start = i + 2 + hashes;
                let length = text[start..].windows(close.len()).position(|window| window == close);
                i = length.map_or(text.len(), |length| start + length + close.len());
                code.push_str("\"\"");
            }
            ('"', _) => {
                i += 1;
                while i < text.len() && at(i) != '"' {
                    i += if at(i) == '\\' { 2 } else { 1 };
                }
                i += 1;
                code.push_str("\"\"");
            }
            // A character literal; otherwise it is a lifetime.
            ('\'', '\\') => {
                i += 3;
                i += text[i.min(text.len())..].iter().take_while(|&&c| c != '\'').count() + 1;
            }
            ('\'', _) if at(i + 2) == '\'' => i += 3,
            (character, _) => {
                code.push(character);
                i += 1;
            }
        }
    }
    code
}

/// Position after the end of a block comment, which may contain others.
fn end_of_block_comment(text: &[char], start: usize) -> usize {
    let (mut i, mut depth) = (start, 0_usize);
    while i < text.len() {
        match (text[i], text.get(i + 1)) {
            ('/', Some('*')) => (depth, i) = (depth + 1, i + 2),
            ('*', Some('/')) => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            break;
        }
    }
    i
}

/// The number of `#` if a raw string begins at `start`, the position of an `r`.
fn raw_string_hashes(text: &[char], start: usize) -> Option<usize> {
    let hashes = text[start + 1..].iter().take_while(|&&c| c == '#').count();
    (text.get(start + 1 + hashes) == Some(&'"')).then_some(hashes)
}

fn without_test_items(code: &str) -> String {
    let mut kept = String::with_capacity(code.len());
    let mut rest = code;
    while let Some(start) = rest.find(TEST_MARK) {
        kept.push_str(&rest[..start]);
        rest = &rest[start + TEST_MARK.len()..];
        rest = &rest[item_length(rest)..];
    }
    kept.push_str(rest);
    kept
}

/// The length of the first item in `code`: up to a `;` outside braces, or to the brace that closes the first one.
fn item_length(code: &str) -> usize {
    let mut depth = 0_usize;
    for (i, character) in code.char_indices() {
        match character {
            ';' if depth == 0 => return i + 1,
            '{' => depth += 1,
            '}' if depth <= 1 => return i + 1,
            '}' => depth -= 1,
            _ => {}
        }
    }
    code.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_strings_are_left_out() {
        let source = "let a = 'x'; // use crate::b;\n/* one /* two */ */ let b: &'static str = \"use crate::c;\\\"\";\nlet c = '\\''; r#\"use d\"#";
        assert_eq!(code_of(source), "let a = ; \n let b: &'static str = \"\";\nlet c = ; \"\"");
    }

    #[test]
    fn items_for_tests_are_left_out() {
        let source = "use crate::a;\n#[cfg(test)]\nmod tests {\n use super::*;\n fn f() {}\n}\n#[cfg(test)]\nmod more;\nfn g() {}";
        assert_eq!(code_of(source), "use crate::a;\n\n\nfn g() {}");
        assert_eq!(modules_for_tests(source), BTreeSet::from(["more".to_owned()]));
    }
}
