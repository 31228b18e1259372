//! Writes this project's safetensors: streamed, under a temporary name, so that the file is complete or absent.
//!
//! ```text
//! metadata   weights_version, source_file, source_sha256, source_format, source_names, licence_note, …
//! tensors    matrices and kernels f32 or f16; vectors (biases, norms) always f32
//! ```
//!
//! Vectors stay in full precision because they are a thousandth of the file, and a stored variance may be outside
//! half precision's range.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use std::thread;

use half::f16;
use half::slice::HalfFloatSliceExt;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::checkpoint::Checkpoint;
use crate::conversion::{Conversion, Planned, source_of};
use crate::digest::sha256_of;
use crate::error::{Result, WeightsError, printable};
use crate::naming::Program;
use crate::source::Source;

/// The version of the written metadata.
pub const WEIGHTS_VERSION: &str = "1";

/// Element type of matrices and kernels in the written file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Precision {
    /// Single precision.
    F32,
    /// Half the size.
    F16,
}

/// A summary of the written file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Written {
    /// Size of the new file.
    pub bytes: u64,
    /// SHA-256 of its source checkpoint.
    pub source_sha256: String,
}

/// Known facts about the licence, by program; the file itself contains none.
fn licence_note(program: Option<Program>) -> &'static str {
    match program {
        Some(Program::Detectron2) => {
            "weights of Detectron2's model zoo are CC BY-SA 3.0; weights from elsewhere have their own licence"
        }
        Some(Program::Torchvision) => {
            "torchvision's code is BSD-3-Clause; its weights may carry the terms of their training data"
        }
        None => "as the file that this one was converted from",
    }
}

impl Conversion {
    /// Writes the parameters to the second of `paths`; `extra` is added to the metadata. The first path is the
    /// checkpoint's file, which is hashed at the same time.
    ///
    /// # Errors
    /// The errors of [`Self::complete`]; values that are not finite, or too large for the precision; a truncated
    /// checkpoint; a folder that cannot be written; an input or a file of another kind at the second path. An existing
    /// file at the second path is then unchanged.
    pub fn write(
        &self,
        checkpoint: &Checkpoint,
        source: &mut Source,
        paths: [&Path; 2],
        precision: Precision,
        extra: &BTreeMap<String, String>,
    ) -> Result<Written> {
        self.complete()?;
        let [from, out] = paths;
        // The header comes first in the file and contains the hash, which is known last: its space is reserved.
        let metadata = |sha256: &str| self.metadata(checkpoint, from, sha256, extra);
        let header = self.header(&metadata(&"0".repeat(64)), precision);
        let mut file = sdg_files::create(out, &header)?;
        thread::scope(|scope| {
            let hashing = scope.spawn(|| sha256_of(from));
            let body = BufWriter::with_capacity(1 << 20, file.as_file());
            self.write_body(source, body, &header, precision)?;
            let sha256 = match hashing.join() {
                Ok(sha256) => sha256?,
                Err(panic) => std::panic::resume_unwind(panic),
            };
            let header = self.header(&metadata(&sha256), precision);
            write_at_start(file.as_file(), &header)?;
            let metadata = file.as_file().metadata();
            let bytes = metadata.map_err(WeightsError::io("ask for the new file's size"))?.len();
            file.commit()?;
            Ok(Written { bytes, source_sha256: sha256 })
        })
    }

    fn metadata(
        &self,
        checkpoint: &Checkpoint,
        from: &Path,
        sha256: &str,
        extra: &BTreeMap<String, String>,
    ) -> BTreeMap<String, String> {
        let report = self.report();
        let (naming, author) = source_of(checkpoint, report.naming);
        let mut metadata = extra.clone();
        let mut put = |key: &str, value: String| metadata.insert(key.to_owned(), value);
        put("weights_version", WEIGHTS_VERSION.to_owned());
        put("source_file", printable(&from.file_name().unwrap_or_default().to_string_lossy()));
        put("source_sha256", sha256.to_owned());
        put("source_format", checkpoint.format.to_string());
        put("source_names", naming.to_string());
        put("licence_note", licence_note(naming.program(author)).to_owned());
        if let Some(author) = author {
            put("source_author", author.to_owned());
        }
        if !report.reinitialized.is_empty() {
            put("reinitialized", report.reinitialized.join(" "));
        }
        metadata
    }

    /// Parameters in the order of the file: wider elements first, as in safetensors' reference implementation, so that
    /// all are aligned.
    fn in_file_order(&self, precision: Precision) -> impl Iterator<Item = (&String, &Planned, Precision)> {
        let all = move |wanted| {
            self.parameters.iter().filter_map(move |(name, planned)| {
                let stored = if planned.shape.len() < 2 { Precision::F32 } else { precision };
                (stored == wanted).then_some((name, planned, stored))
            })
        };
        all(Precision::F32).chain(all(Precision::F16))
    }

    /// Length, JSON, and spaces up to a multiple of eight.
    fn header(&self, metadata: &BTreeMap<String, String>, precision: Precision) -> Vec<u8> {
        let mut entries = Map::new();
        entries.insert("__metadata__".to_owned(), json!(metadata));
        let mut offset = 0;
        for (name, planned, stored) in self.in_file_order(precision) {
            let (dtype, size) = match stored {
                Precision::F32 => ("F32", 4),
                Precision::F16 => ("F16", 2),
            };
            let end = offset + planned.shape.iter().product::<usize>() * size;
            let entry = json!({"dtype": dtype, "shape": planned.shape, "data_offsets": [offset, end]});
            entries.insert(name.clone(), entry);
            offset = end;
        }
        let mut json = Value::Object(entries).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(8), b' ');
        [(json.len() as u64).to_le_bytes().as_slice(), &json].concat()
    }

    fn write_body(
        &self,
        source: &mut Source,
        mut file: BufWriter<&mut File>,
        header: &[u8],
        precision: Precision,
    ) -> Result<()> {
        file.write_all(header).map_err(WeightsError::io("write the new file"))?;
        let mut bytes = Vec::new();
        let mut halves: Vec<f16> = Vec::new();
        for (name, planned, stored) in self.in_file_order(precision) {
            planned.stream(source, |values| {
                check_values(name, values, stored)?;
                bytes.clear();
                match stored {
                    Precision::F32 => bytes.extend(values.iter().flat_map(|value| value.to_le_bytes())),
                    Precision::F16 => {
                        halves.resize(values.len(), f16::ZERO);
                        halves.convert_from_f32_slice(values);
                        bytes.extend(halves.iter().flat_map(|value| value.to_le_bytes()));
                    }
                }
                file.write_all(&bytes).map_err(WeightsError::io("write the new file"))
            })?;
        }
        file.flush().map_err(WeightsError::io("write the new file"))
    }
}

fn check_values(name: &str, values: &[f32], stored: Precision) -> Result<()> {
    // 65504 is half precision's largest number; from 65520 on, numbers round to infinity.
    let (most, limit) = match stored {
        Precision::F32 => (f32::MAX, ""),
        Precision::F16 => (65519.0, " up to 65504, for half precision"),
    };
    // False for NaN too. No early exit inside a piece, so that the loop is vectorised.
    let all_fit = values.iter().fold(true, |fit, value| fit & (value.abs() <= most));
    if all_fit {
        return Ok(());
    }
    let found = values.iter().copied().find(|value| value.is_nan() || value.abs() > most).unwrap_or(f32::NAN);
    Err(WeightsError::Value { name: printable(name), limit, found })
}

fn write_at_start(file: &mut File, header: &[u8]) -> Result<()> {
    let written = file.seek(SeekFrom::Start(0)).and_then(|_| file.write_all(header));
    written.map_err(WeightsError::io("write the new file's header"))
}
