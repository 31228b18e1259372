//! The statements of Rust sources: whether two versions of a program compute the same, as far as their text shows.

use std::collections::BTreeMap;

use crate::source_text::code_of;

/// The statements of some sources with the number of times that each occurs. Two versions of a program have the same
/// statements if they differ only in comments, texts, line breaks, imports, visibility, attributes, tests, the order of
/// items, or their distribution over files.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Statements(BTreeMap<String, usize>);

impl Statements {
    /// Adds the statements of a source.
    pub fn add(&mut self, source: &str) {
        let code = code_of(source);
        let mut kept = String::with_capacity(code.len());
        let mut is_import = false;
        for line in code.lines() {
            let line = without_visibility(line.trim());
            let is_attribute = (line.starts_with("#[") || line.starts_with("#![")) && line.ends_with(']');
            is_import |= line.starts_with("use ") || line.starts_with("mod ") && line.ends_with(';');
            if !is_import && !is_attribute {
                kept.extend(line.split_whitespace());
            }
            is_import &= !line.ends_with(';');
        }
        // The comma that line breaks add.
        let kept = kept.replace(",)", ")").replace(",]", "]");
        for statement in kept.split(['{', '}', ';', ',']).filter(|statement| !statement.is_empty()) {
            *self.0.entry(statement.to_owned()).or_default() += 1;
        }
    }
}

fn without_visibility(line: &str) -> String {
    ["pub(crate) ", "pub(super) ", "pub "].iter().fold(line.to_owned(), |line, word| line.replace(word, ""))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(sources: &[&str]) -> Statements {
        let mut all = Statements::default();
        sources.iter().for_each(|source| all.add(source));
        all
    }

    #[test]
    fn comments_texts_imports_tests_and_places_do_not_count() {
        let before = statements(&[
            "use a::{\n b, c,\n};\n/// Doc.\npub fn f(x: f64) -> f64 { assert!(x > 0.0, \"not\"); x + 1.0 }\nfn g() {}",
        ]);
        let after = statements(&[
            "mod other;\npub use other::g;\n#[must_use]\nfn f(\n    x: f64,\n) -> f64 {\n    // Why.\n    assert!(x > 0.0, \"expected\");\n    x + 1.0\n}\n#[cfg(test)]\nmod tests { fn t() { f(2.0) } }",
            "pub(crate) fn g() {}",
        ]);
        assert_eq!(before, after);
    }

    #[test]
    fn numbers_names_and_calls_count() {
        let before = statements(&["const A: f64 = 0.5; fn f(x: f64) -> f64 { x.min(A) }"]);
        for source in [
            "const A: f64 = 0.6; fn f(x: f64) -> f64 { x.min(A) }",
            "const A: f64 = 0.5; fn f(x: f64) -> f64 { x.max(A) }",
        ] {
            assert_ne!(before, statements(&[source]), "{source}");
        }
    }
}
