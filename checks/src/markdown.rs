//! Links, headings and paths in a Markdown document.

/// The targets of a document's links and pictures, without titles; code is skipped.
pub fn links(document: &str) -> Vec<String> {
    let mut targets = Vec::new();
    for line in lines_without_code(document) {
        let line = without_code_spans(line);
        let mut rest = line.as_str();
        while let Some(start) = rest.find("](") {
            rest = &rest[start + 2..];
            let Some(end) = rest.find(')') else { break };
            let target = rest[..end].split_whitespace().next().unwrap_or_default();
            targets.push(target.trim_matches(['<', '>']).to_owned());
        }
    }
    targets
}

/// The anchors of a document's headings in the form of GitHub and GitLab: lower case, spaces as hyphens, only letters,
/// digits, hyphens and underscores.
pub fn headings(document: &str) -> Vec<String> {
    let slug = |title: &str| {
        let kept = title.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>().to_lowercase()
    };
    lines_without_code(document)
        .filter(|line| line.starts_with('#'))
        .map(|line| slug(line.trim_start_matches('#')))
        .collect()
}

/// Words of a document that begin with one of `folders` and a slash: paths from the repository's root. Paths with a
/// placeholder (`*`, `…`, `<`, `$`, `{`) are left out.
pub fn named_files(document: &str, folders: &[&str]) -> Vec<String> {
    let is_end = |c: char| c.is_whitespace() || matches!(c, '`' | '(' | ')' | '[' | ']' | '|' | '"' | ',' | ';');
    let words = document.split(is_end).map(|word| word.trim_end_matches(['.', ':', '/']));
    let is_path =
        |word: &&str| folders.iter().any(|folder| word.strip_prefix(folder).is_some_and(|rest| rest.starts_with('/')));
    words.filter(is_path).filter(|word| !word.contains(['*', '…', '<', '$', '{'])).map(str::to_owned).collect()
}

/// The lines of a document; those of code blocks are empty.
pub(crate) fn lines_without_code(document: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    document.lines().map(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        if is_code || is_fence { "" } else { line }
    })
}

fn without_code_spans(line: &str) -> String {
    line.split('`').step_by(2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_in_code_are_none() {
        let document = "[a](b.md) ![c](d.png \"title\") `[e](f)`\n```\n[g](h)\n```\n[i](<j.md#k>)";
        assert_eq!(links(document), ["b.md", "d.png", "j.md#k"]);
    }

    #[test]
    fn headings_become_anchors() {
        assert_eq!(
            headings("# One `two`, three\n```\n# no\n```\n## On your own pictures"),
            ["one-two-three", "on-your-own-pictures"]
        );
    }

    #[test]
    fn paths_are_words() {
        let document = "see crates/a/src/b.rs, `docs/c.md` (tests/) and crates/*/src. notcrates/x";
        assert_eq!(named_files(document, &["crates", "docs", "tests"]), ["crates/a/src/b.rs", "docs/c.md"]);
    }
}
