//! The file checks/tables.toml: measurements that tables show, and the parts of the program that they depend on.

use std::collections::BTreeMap;

use serde::Deserialize;

/// All measurements.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurements {
    /// Files and folders of each part of the program, from the repository's root.
    pub parts: BTreeMap<String, Vec<String>>,
    /// Later programs with the same figures, by the names that measurements use.
    #[serde(default)]
    pub same_at: BTreeMap<String, SameAt>,
    /// Measurements by the names that marks use.
    pub measured: BTreeMap<String, Measurement>,
}

/// Figures that one program produced.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// The program's commit.
    pub commit: String,
    /// The command that produces the figures, or a description of what was done.
    pub command: String,
    /// The names of the program's parts on which the figures depend. An empty list is for figures that no later
    /// program can have: of another program, or of a decision whose alternatives are gone.
    pub parts: Vec<String>,
    /// The name of a later program that has the same figures.
    pub same_at: Option<String>,
}

/// A later program that is known to compute the same.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SameAt {
    /// Its commit.
    pub commit: String,
    /// How this is known.
    pub why: String,
}

impl Measurements {
    /// Reads the text of the file.
    ///
    /// # Errors
    /// The text is not such a file, or a measurement names an unknown part or an unknown later program.
    pub fn read(text: &str) -> Result<Self, String> {
        let all: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        for (name, measurement) in &all.measured {
            if let Some(unknown) = measurement.parts.iter().find(|part| !all.parts.contains_key(*part)) {
                let known: Vec<&str> = all.parts.keys().map(String::as_str).collect();
                return Err(format!(
                    "{name}: expected parts among {}, found {unknown}; add it to [parts]",
                    known.join(", ")
                ));
            }
            if let Some(unknown) = measurement.same_at.as_ref().filter(|same| !all.same_at.contains_key(*same)) {
                return Err(format!("{name}: expected a name in [same_at], found {unknown}"));
            }
        }
        Ok(all)
    }

    /// The last commit that is known to have a measurement's figures.
    pub fn last_commit<'a>(&'a self, measurement: &'a Measurement) -> &'a str {
        measurement.same_at.as_ref().map_or(&measurement.commit, |same| &self.same_at[same].commit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measurement_names_known_parts() {
        let text = "[parts]\nsearch = [\"crates/shape/src\"]\n[measured.a]\ncommit = \"abc\"\ncommand = \"x\"\nparts = [\"search\"]\n\
            same_at = \"names\"\n[same_at.names]\ncommit = \"def\"\nwhy = \"renames\"";
        let all = Measurements::read(text).unwrap();
        assert_eq!(all.parts["search"], ["crates/shape/src"]);
        assert_eq!(all.last_commit(&all.measured["a"]), "def");
        let error = Measurements::read(&text.replace("parts = [\"search\"]", "parts = [\"serch\"]")).unwrap_err();
        assert!(error.contains("expected parts among search, found serch"), "{error}");
        let error = Measurements::read(&text.replace("same_at.names", "same_at.others")).unwrap_err();
        assert!(error.contains("expected a name in [same_at], found names"), "{error}");
    }
}
