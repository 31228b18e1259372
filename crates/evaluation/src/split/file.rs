//! The split file, with a TOML table for each set.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use sdg_geometry::RotationalSymmetry;
use serde::{Deserialize, Serialize};

/// Maximum size of a split file.
const MAX_SPLIT_BYTES: u64 = 1 << 20;

/// The side of a set, which states how its results may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Constants may be fitted on the set.
    Tuned,
    /// The results were known when earlier constants were chosen; the set may no longer be used for fitting.
    Used,
    /// The set is reported, and no constant is fitted on it.
    Reported,
}

impl Side {
    /// Every side, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Tuned, Self::Used, Self::Reported];

    /// The name in the file and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tuned => "tuned",
            Self::Used => "used",
            Self::Reported => "reported",
        }
    }
}

/// A set of pictures of one part.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitSet {
    pub name: String,
    pub side: Side,
    /// The folder of the set, relative to that of `--sets`.
    pub folder: PathBuf,
    /// The name of the photo for teaching, which has marks beside it.
    pub demo: String,
    /// The equivalent rotations of the part.
    #[serde(default)]
    pub symmetry: RotationalSymmetry,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SplitFile {
    set: Vec<SplitSet>,
}

/// Reads the sets of a split file.
///
/// # Errors
/// The file cannot be read, has an unknown side or field, two sets of the same name, or a symmetry with a fold outside
/// 2 to 360.
pub fn read_split(path: &Path) -> Result<Vec<SplitSet>> {
    let bytes = sdg_files::read(path, MAX_SPLIT_BYTES)?;
    let text = String::from_utf8(bytes).map_err(|error| anyhow!("{}: expected UTF-8: {error}", path.display()))?;
    let SplitFile { set: sets } = toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        anyhow!("{}, line {line}: {}", path.display(), error.message())
    })?;
    for (idx, set) in sets.iter().enumerate() {
        if sets[..idx].iter().any(|other| other.name == set.name) {
            bail!("{}: expected one set of each name, found another \"{}\"", path.display(), set.name);
        }
        if let RotationalSymmetry::Fold(count @ (0 | 1 | 361..)) = set.symmetry {
            bail!("{}: set \"{}\": expected a fold of 2 to 360, found {count}", path.display(), set.name);
        }
    }
    Ok(sets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_split_is_read() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/split.toml");
        let sets = read_split(&path).unwrap();
        let count = |side: Side| sets.iter().filter(|set| set.side == side).count();
        assert_eq!(Side::ALL.map(count), [9, 2, 7]);
        let clip = sets.iter().find(|set| set.name == "clip").unwrap();
        assert_eq!((clip.side, clip.symmetry), (Side::Tuned, RotationalSymmetry::Fold(2)));
    }

    #[test]
    fn a_wrong_file_is_told_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("split.toml");
        let set = "[[set]]\nname = \"a\"\nside = \"tuned\"\nfolder = \"a\"\ndemo = \"demo.png\"\n";
        for (text, parts) in [
            (set.replace("tuned", "tune"), &["line 3", "unknown variant `tune`", "`tuned`, `used`, `reported`"][..]),
            (format!("{set}demos = 1\n"), &["line 6", "unknown field `demos`"]),
            (set.replace("demo = \"demo.png\"\n", ""), &["line 1", "missing field `demo`"]),
            (set.repeat(2), &["one set of each name", "\"a\""]),
            (format!("{set}symmetry = {{ fold = 1 }}\n"), &["fold of 2 to 360, found 1"]),
            (String::new(), &["missing field `set`"]),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = read_split(&path).unwrap_err().to_string();
            for part in parts {
                assert!(error.contains(part), "expected {part} in: {error}");
            }
        }
    }
}
