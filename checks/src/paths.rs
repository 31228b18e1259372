//! The paths in a Rust source: those of its `use` declarations, and those in its code.

/// A path in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedPath {
    /// The segments as written: the first may be `crate`, `super`, `self`, a module or a crate.
    pub segments: Vec<String>,
    /// The name under which a `pub use` exports it; `None` for other uses.
    pub exported_as: Option<String>,
}

/// All paths in `code`, from which comments and strings were removed.
pub fn named_paths(code: &str) -> Vec<NamedPath> {
    let tokens = tokens(code);
    let mut paths = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        // `use<'a>` lists captured lifetimes.
        if tokens[i] == "use" && tokens.get(i + 1) != Some(&"<") {
            let is_public = is_public(&tokens[..i]);
            i = read_use_tree(&tokens, i + 1, &[], is_public, &mut paths);
        } else if is_word(tokens[i]) {
            let start = i;
            while tokens.get(i + 1) == Some(&"::") && tokens.get(i + 2).is_some_and(|token| is_word(token)) {
                i += 2;
            }
            if i > start && (start == 0 || tokens[start - 1] != "::") {
                let segments = tokens[start..=i].iter().step_by(2).map(|&word| word.to_owned()).collect();
                paths.push(NamedPath { segments, exported_as: None });
            }
            i += 1;
        } else {
            i += 1;
        }
    }
    paths
}

/// Whether `word` occurs in `code` outside declarations of uses and modules.
pub fn mentions(code: &str, word: &str) -> bool {
    let mut is_declaration = false;
    tokens(code).into_iter().any(|token| {
        match token {
            "use" | "mod" => is_declaration = true,
            ";" => is_declaration = false,
            _ => {}
        }
        !is_declaration && token == word
    })
}

/// Whether the tokens before a `use` end with `pub` or `pub(…)`.
fn is_public(before: &[&str]) -> bool {
    match before {
        [.., "pub"] => true,
        [.., ")"] => {
            before.iter().rposition(|&token| token == "(").is_some_and(|open| open > 0 && before[open - 1] == "pub")
        }
        _ => false,
    }
}

/// Reads one tree of a `use` from `start`; returns its end.
fn read_use_tree(
    tokens: &[&str],
    start: usize,
    prefix: &[String],
    is_public: bool,
    paths: &mut Vec<NamedPath>,
) -> usize {
    let mut segments = prefix.to_vec();
    let mut i = start;
    let mut alias = None;
    while let Some(&token) = tokens.get(i) {
        match token {
            "{" => {
                i += 1;
                while tokens.get(i).is_some_and(|&token| token != "}" && token != ";") {
                    i = read_use_tree(tokens, i, &segments, is_public, paths);
                    if tokens.get(i) == Some(&",") {
                        i += 1;
                    }
                }
                return i + 1;
            }
            "," | ";" | "}" => break,
            "as" => {
                alias = tokens.get(i + 1).map(|&name| name.to_owned());
                i += 1;
            }
            "::" => {}
            word => segments.push(word.to_owned()),
        }
        i += 1;
    }
    if segments.len() > prefix.len() {
        let last = segments.last().cloned();
        paths.push(NamedPath { segments, exported_as: alias.or(last).filter(|_| is_public) });
    }
    i
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

fn tokens(code: &str) -> Vec<&str> {
    let is_word_character = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = if is_word_character(first) {
            rest.find(|c| !is_word_character(c)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        let (token, after) = rest.split_at(length);
        tokens.push(token);
        rest = after.trim_start();
    }
    tokens
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(code: &str) -> Vec<(String, Option<String>)> {
        named_paths(code).into_iter().map(|path| (path.segments.join("::"), path.exported_as)).collect()
    }

    #[test]
    fn trees_of_uses_are_spread() {
        let found = read("use crate::{a::{A, B as C}, b::*};");
        let expected = ["crate::a::A", "crate::a::B", "crate::b::*"];
        assert_eq!(found, expected.map(|path| (path.to_owned(), None)));
    }

    #[test]
    fn exports_have_their_name() {
        let found = read("pub(crate) use a::A as B; pub use c::D;");
        assert_eq!(found, [("a::A".into(), Some("B".into())), ("c::D".into(), Some("D".into()))]);
    }

    #[test]
    fn paths_in_code_are_read() {
        assert_eq!(
            read("fn f() -> impl crate::error::Trait + use<'_> { g(super::h()) }"),
            [("crate::error::Trait".to_owned(), None), ("super::h".to_owned(), None)]
        );
    }

    #[test]
    fn a_name_in_a_use_is_no_mention() {
        assert!(!mentions("mod A; pub use a::{A, B};", "A"));
        assert!(mentions("pub use a::A; fn f() -> A {}", "A"));
    }
}
