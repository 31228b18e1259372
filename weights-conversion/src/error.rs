//! Errors of a checkpoint.

use std::io;

/// The reason why a checkpoint could not be read or converted. Most messages give the expected and the found value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum WeightsError {
    /// The file system refused an operation.
    #[error("cannot {action}: {source}")]
    Io { action: &'static str, source: io::Error },
    /// The new file could not be written.
    #[error(transparent)]
    File(#[from] sdg_files::FileError),
    /// Bytes of no supported format.
    #[error("expected a pickled checkpoint (protocol 2 to 5), a torch checkpoint or a safetensors file, found {found}")]
    NotACheckpoint {
        /// The kind of the bytes, as far as it can be determined.
        found: String,
    },
    /// A pickle that requires a function or class which weights do not need.
    #[error(
        "refused: the pickle asks for {name} (byte {offset}); weights need only numpy arrays, torch tensors and dicts: \
         write them alone, in Python: torch.save(torch.load(\"FILE\", weights_only=False).state_dict(), \"NEW.pth\") for \
         a whole model, and with [\"model\"] or [\"state_dict\"] instead of .state_dict() for a training checkpoint"
    )]
    ForbiddenGlobal {
        /// Module and name, as the file spells them.
        name: String,
        offset: u64,
    },
    /// A file that was truncated, altered, or written by an unknown program.
    #[error("{part}: expected {expected}, found {found}")]
    Damaged {
        /// The part of the file.
        part: String,
        /// The expected content.
        expected: String,
        found: String,
    },
    /// A file that requires more than any checkpoint needs.
    #[error("{what}: expected at most {most}, found {found}")]
    TooLarge {
        /// The exceeded quantity.
        what: String,
        most: u64,
        found: u64,
    },
    /// Names of an unknown naming scheme.
    #[error(
        "expected names as Detectron2, torchvision or Caffe2 write them, found {count} tensors such as {}",
        .examples.join(", ")
    )]
    UnknownNames { count: usize, examples: Vec<String> },
    /// An architecture that the names do not determine.
    #[error("{part}: expected {expected}, found {found}")]
    Architecture {
        /// The part of the network.
        part: &'static str,
        expected: String,
        found: String,
    },
    /// The checkpoint does not fill the network.
    #[error(
        "{missing} parameters missing, {mismatched} of another shape (first: {first}); \
         to leave a part as initialised, name it: --reinit roi_heads.box_predictor"
    )]
    Incomplete {
        missing: usize,
        /// Parameters whose tensor has another shape.
        mismatched: usize,
        first: String,
    },
    /// A part to re-initialise that the network lacks.
    #[error("expected a part of the network to re-initialise, such as {}, found \"{found}\"", .known.join(", "))]
    UnknownPart { known: Vec<String>, found: String },
    /// A value that weights cannot have.
    #[error("{name}: expected finite values{limit}, found {found}")]
    Value {
        name: String,
        /// " up to 65504" if half precision is requested.
        limit: &'static str,
        found: f32,
    },
}

impl WeightsError {
    pub(crate) fn io(action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, source }
    }

    pub(crate) fn damaged(part: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Damaged { part: part.into(), expected: expected.into(), found: found.into() }
    }
}

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, WeightsError>;

/// A name from a file, suitable for one line: control characters escaped, truncated to 120 characters.
pub(crate) fn printable(name: &str) -> String {
    let mut line: String = name.chars().take(120).flat_map(char::escape_debug).collect();
    if name.chars().nth(120).is_some() {
        line.push('…');
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_on_one_line() {
        assert_eq!(printable("a\nb\u{1b}[2J"), "a\\nb\\u{1b}[2J");
        assert_eq!(printable(&"x".repeat(500)).chars().count(), 121);
    }
}
