//! The program as it was at a commit, compared with the files on disk.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::{fs, thread};

use crate::statements::Statements;

/// A git repository.
#[derive(Debug, Clone)]
pub struct History {
    root: PathBuf,
}

impl History {
    /// The repository whose working tree is `root`.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// Whether older commits are missing, as in a clone with `--depth`.
    pub fn is_shallow(&self) -> bool {
        self.git(&["rev-parse", "--is-shallow-repository"]).is_none_or(|text| text.trim_ascii() == b"true")
    }

    /// Whether a commit is HEAD or one of its ancestors.
    pub fn is_ancestor(&self, commit: &str) -> bool {
        self.git(&["merge-base", "--is-ancestor", commit, "HEAD"]).is_some()
    }

    /// A file of `paths` that computes something else now than at `commit`; `None` if there is none. Rust sources are
    /// compared by their [`Statements`], all of them together; tests, examples and documents are left out, and any
    /// other file counts as changed if a byte of it differs.
    ///
    /// # Errors
    /// Git does not know the commit or fails.
    pub fn changed_since(&self, commit: &str, paths: &[String]) -> Result<Option<String>, String> {
        let mut arguments = vec!["diff", "--name-only", "--no-renames", "-z", commit, "--"];
        arguments.extend(paths.iter().map(String::as_str));
        let names = self.git(&arguments).ok_or_else(|| format!("git diff of {commit} failed"))?;
        let names: Vec<String> = String::from_utf8_lossy(&names)
            .split('\0')
            .filter(|name| !name.is_empty() && !is_left_out(name))
            .map(str::to_owned)
            .collect();
        if let Some(other) = names.iter().find(|name| !is_rust(name)) {
            return Ok(Some(other.clone()));
        }
        let olds = self.sources_at(commit, &names)?;
        let mut all = [Statements::default(), Statements::default()];
        let mut first = None;
        for (name, old) in names.iter().zip(&olds) {
            let new = fs::read_to_string(self.root.join(name)).unwrap_or_default();
            let mut own = [Statements::default(), Statements::default()];
            for (idx, source) in [old, &new].into_iter().enumerate() {
                all[idx].add(source);
                own[idx].add(source);
            }
            if own[0] != own[1] {
                first = first.or(Some(name));
            }
        }
        Ok(first.filter(|_| all[0] != all[1]).cloned())
    }

    /// The text of files at a commit, empty where there was none.
    fn sources_at(&self, commit: &str, names: &[String]) -> Result<Vec<String>, String> {
        let requests: String = names.iter().map(|name| format!("{commit}:{name}\n")).collect();
        let mut child = Command::new("git")
            .args(["cat-file", "--batch"])
            .current_dir(&self.root)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| error.to_string())?;
        // Both pipes have a limited size: requests are written while answers are read.
        let writer = child.stdin.take().map(|mut stdin| thread::spawn(move || stdin.write_all(requests.as_bytes())));
        let output = child.wait_with_output().map_err(|error| error.to_string())?;
        if let Some(writer) = writer {
            writer.join().map_err(|_| "git cat-file: the writer failed")?.map_err(|error| error.to_string())?;
        }
        let mut rest = output.stdout.as_slice();
        let mut texts = Vec::new();
        for name in names {
            let end =
                rest.iter().position(|&byte| byte == b'\n').ok_or_else(|| format!("git cat-file ended at {name}"))?;
            let head = String::from_utf8_lossy(&rest[..end]).into_owned();
            rest = &rest[end + 1..];
            if head.ends_with(" missing") {
                texts.push(String::new());
                continue;
            }
            let size: usize = head.rsplit(' ').next().and_then(|size| size.parse().ok()).unwrap_or_default();
            let text = rest.get(..size).ok_or_else(|| format!("git cat-file: {head} is cut off"))?;
            texts.push(String::from_utf8_lossy(text).into_owned());
            rest = rest.get(size + 1..).unwrap_or_default();
        }
        Ok(texts)
    }

    /// The output of a git command; `None` if it fails.
    fn git(&self, arguments: &[&str]) -> Option<Vec<u8>> {
        let output = Command::new("git").args(arguments).current_dir(&self.root).output().ok()?;
        output.status.success().then_some(output.stdout)
    }
}

fn is_rust(name: &str) -> bool {
    name.ends_with(".rs")
}

/// Tests, examples and documents.
fn is_left_out(name: &str) -> bool {
    let is_folder = |part: &str| matches!(part, "tests" | "test" | "examples" | "proptest-regressions");
    name.ends_with(".md") || name.ends_with("tests.rs") || name.split('/').any(is_folder)
}
