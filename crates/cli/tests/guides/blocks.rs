//! Code blocks and code spans of a Markdown document, and the calls of `sdg` in them.

/// A fenced block.
#[derive(Debug)]
pub struct Block {
    /// The line of the fence, from 1.
    pub line: usize,
    /// The language after the fence, such as `text` or `yaml`; empty, `sh` or `console` for commands.
    pub language: String,
    /// The comment above the block, which gives its requirements or its duration: `<!-- needs: a camera -->`.
    pub marker: Option<Marker>,
    pub text: String,
}

/// The reason why a block is not run with the other blocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Marker {
    /// Hardware, a network, root or a browser is needed: the block is never run.
    Needs(String),
    /// The block takes long: it is run only by `make test-guides`.
    Takes(String),
}

impl Block {
    /// Whether the block contains shell commands.
    pub fn is_shell(&self) -> bool {
        ["", "sh", "console"].contains(&self.language.as_str())
    }

    /// The commands without prompts.
    pub fn script(&self) -> String {
        self.text.lines().map(|line| line.strip_prefix("$ ").unwrap_or(line)).collect::<Vec<_>>().join("\n")
    }
}

pub fn blocks(document: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut is_open = false;
    let mut marker = None;
    for (idx, line) in document.lines().enumerate() {
        let trimmed = line.trim();
        if let Some(language) = trimmed.strip_prefix("```") {
            if !is_open {
                let language = language.to_owned();
                found.push(Block { line: idx + 1, language, marker: marker.take(), text: String::new() });
            }
            is_open = !is_open;
        } else if is_open {
            let block = found.last_mut().unwrap();
            block.text += line;
            block.text.push('\n');
        } else if !trimmed.is_empty() {
            let comment = trimmed.strip_prefix("<!--").and_then(|rest| rest.strip_suffix("-->"));
            marker = comment.and_then(|comment| {
                let (kind, what) = comment.trim().split_once(": ")?;
                match kind {
                    "needs" => Some(Marker::Needs(what.to_owned())),
                    "takes" => Some(Marker::Takes(what.to_owned())),
                    _ => None,
                }
            });
        }
    }
    found
}

/// The code spans outside blocks.
pub fn spans(document: &str) -> Vec<String> {
    let mut is_code = false;
    let mut text = String::new();
    for line in document.lines() {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        if !is_code && !is_fence {
            text += line;
            text.push('\n');
        }
    }
    // Spans in double backticks contain single ones.
    let text = text.replace("``", "");
    text.split('`').skip(1).step_by(2).map(|span| span.replace("\\|", "|").replace('\n', " ")).collect()
}

/// The words after the program's name for each call of `sdg` in a text of commands, without comments.
pub fn calls(commands: &str) -> Vec<Vec<String>> {
    let joined = commands.replace("\\\n", " ");
    let mut calls = Vec::new();
    for line in joined.lines() {
        let mut words: Vec<String> = Vec::new();
        let mut is_call = false;
        for word in line.split_whitespace() {
            if word.starts_with('#') {
                break;
            }
            let bare = word.trim_matches(['(', ')', '\'', '"', '`', '[', ']', ',', ';']);
            if ["|", "&&", "||", ";", "do", "then"].contains(&word) {
                calls.extend(is_call.then(|| std::mem::take(&mut words)));
                is_call = false;
            } else if ["sdg", "target/release/sdg", "sdg.exe", "bin/sdg", "$", "exec"].contains(&bare) && !is_call {
                is_call = bare != "$" && bare != "exec";
            } else if is_call {
                words.push(bare.to_owned());
                if word.ends_with(';') {
                    calls.push(std::mem::take(&mut words));
                    is_call = false;
                }
            }
        }
        calls.extend(is_call.then_some(words));
    }
    calls
}

#[test]
fn blocks_have_their_language_and_their_marker() {
    let document = "a\n<!-- needs: a camera -->\n```\nsdg x\n```\nb\n```text\ny\n```\n\n<!-- takes: a minute -->\n\n```sh\n$ z\n```";
    let found = blocks(document);
    assert_eq!(found.iter().map(|block| block.line).collect::<Vec<_>>(), [3, 7, 13]);
    assert_eq!(found[0].marker, Some(Marker::Needs("a camera".to_owned())));
    assert_eq!((&found[1].marker, found[1].is_shell()), (&None, false));
    assert_eq!((&found[2].marker, found[2].script().as_str()), (&Some(Marker::Takes("a minute".to_owned())), "z"));
}

#[test]
fn calls_are_what_stands_behind_the_program() {
    let text =
        "D=x; sdg teach --demo a \\\n  --out b; ls\nfor s in c; do target/release/sdg detect [--json] d # --no\nmake x";
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(calls(text), [words("teach --demo a --out b"), words("detect --json d")]);
}
