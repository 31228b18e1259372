//! The outcome for every name, one line each.

use std::fmt;

use serde::Serialize;

use crate::checkpoint::FileFormat;
use crate::naming::Naming;

/// A parameter that was filled.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Applied {
    /// Our name.
    pub name: String,
    /// Sizes of its axes.
    pub shape: Vec<usize>,
    /// The checkpoint's name.
    pub from: String,
    /// Whether rows were moved because the background has another position.
    pub rows_moved: bool,
}

/// A parameter whose tensor has another shape or type.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Mismatch {
    /// Our name.
    pub name: String,
    /// The network's sizes.
    pub expected: Vec<usize>,
    /// The tensor's sizes.
    pub found: Vec<usize>,
    /// The tensor's element type, because integers do not fit either.
    pub element: &'static str,
}

/// The outcome for every name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The file's format.
    pub format: String,
    /// The naming scheme of the tensors.
    pub naming: Naming,
    /// Parameters that were filled.
    pub applied: Vec<Applied>,
    /// Parameters that the file implies without storing them, and their value.
    pub filled: Vec<(String, f32)>,
    /// Parameters that keep their initial values, because they were named.
    pub reinitialized: Vec<String>,
    /// Parameters without a tensor.
    pub missing: Vec<String>,
    /// Parameters whose tensor has another shape or type.
    pub mismatched: Vec<Mismatch>,
    /// Tensors that no parameter uses.
    pub unused: Vec<String>,
    /// Entries that the network does not need, such as anchors, counters and values that are not tensors.
    pub not_needed: Vec<String>,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {:?}, found {:?} of {}", self.name, self.expected, self.found, self.element)
    }
}

impl Report {
    pub(crate) fn new(format: FileFormat, naming: Naming) -> Self {
        Self {
            format: format.to_string(),
            naming,
            applied: Vec::new(),
            filled: Vec::new(),
            reinitialized: Vec::new(),
            missing: Vec::new(),
            mismatched: Vec::new(),
            unused: Vec::new(),
            not_needed: Vec::new(),
        }
    }

    /// The lines of all names except the parameters that a tensor filled.
    pub fn exceptions(&self) -> impl fmt::Display {
        Exceptions(self)
    }

    /// Counts, in one line.
    pub fn summary(&self) -> String {
        let counts = [
            (self.applied.len() + self.filled.len(), "applied"),
            (self.missing.len(), "missing"),
            (self.mismatched.len(), "mismatched"),
            (self.unused.len(), "unused"),
            (self.reinitialized.len(), "re-initialised"),
        ];
        counts.map(|(count, what)| format!("{count} {what}")).join(", ")
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Applied { name, shape, from, rows_moved } in &self.applied {
            let moved = if *rows_moved { ", background moved" } else { "" };
            writeln!(f, "applied     {name} {shape:?} from {from}{moved}")?;
        }
        Exceptions(self).fmt(f)
    }
}

/// The report without the parameters that a tensor filled.
struct Exceptions<'a>(&'a Report);

impl fmt::Display for Exceptions<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(report) = self;
        for (name, value) in &report.filled {
            writeln!(f, "applied     {name}: {value}, which the file implies")?;
        }
        for name in &report.reinitialized {
            writeln!(f, "reinit      {name}")?;
        }
        for name in &report.missing {
            writeln!(f, "missing     {name}")?;
        }
        for mismatch in &report.mismatched {
            writeln!(f, "mismatched  {mismatch}")?;
        }
        for name in &report.unused {
            writeln!(f, "unused      {name}")?;
        }
        for name in &report.not_needed {
            writeln!(f, "not needed  {name}")?;
        }
        Ok(())
    }
}
