//! A checkpoint of any format: its metadata, and its tensors by name.

use std::collections::BTreeMap;
use std::fmt;

use serde_json::{Value, json};

use crate::element::ElementType;
use crate::error::{Result, WeightsError, printable};
use crate::pickle::{self, Object, Pickle};
use crate::safetensors_file;
use crate::source::{Source, Span};
use crate::tensor::StoredTensor;
use crate::torch::{self, Storages};

/// Keys of the state dict in checkpoints that also contain the optimiser's state and counters, by writer: Detectron2
/// and torchvision; other trainers; Caffe2.
const STATE_DICT_KEYS: [&str; 3] = ["model", "state_dict", "blobs"];

/// A file's format, recognised by its content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileFormat {
    /// A pickled dict of numpy arrays: the model zoo's `.pkl`.
    NumpyPickle,
    /// torch since 1.6: a zip archive.
    TorchZip,
    /// torch before 1.6: a sequence of pickles and storages.
    TorchLegacy,
    /// safetensors.
    Safetensors,
}

impl FileFormat {
    /// Recognises the format by the first bytes.
    ///
    /// # Errors
    /// Bytes of no supported format; the message gives their apparent format.
    pub fn detect(source: &mut Source) -> Result<Self> {
        let start = source.read_span(Span { offset: 0, len: source.len().min(512) })?;
        // First, because the length of its header can have the bytes with which a pickle begins, such as 640.
        if safetensors_file::is_safetensors(&start, source.len()) {
            return Ok(Self::Safetensors);
        }
        if torch::is_legacy(&start) {
            return Ok(Self::TorchLegacy);
        }
        match start.as_slice() {
            [b'P', b'K', 3, 4, ..] => Ok(Self::TorchZip),
            [0x80, 2..=5, ..] => Ok(Self::NumpyPickle),
            _ => Err(WeightsError::NotACheckpoint { found: describe(&start) }),
        }
    }
}

impl fmt::Display for FileFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NumpyPickle => "pickle of numpy arrays",
            Self::TorchZip => "torch zip",
            Self::TorchLegacy => "torch legacy",
            Self::Safetensors => "safetensors",
        })
    }
}

/// The kind of bytes that are not a checkpoint, for the error.
fn describe(start: &[u8]) -> String {
    let known: [(&[u8], &str); 8] = [
        (b"\x89PNG", "a PNG image"),
        (b"\xff\xd8\xff", "a JPEG image"),
        (b"\x1f\x8b", "a gzip archive: unpack it first"),
        (b"BZh", "a bzip2 archive: unpack it first"),
        (b"version https://git-lfs", "a Git LFS pointer: the file itself was not downloaded"),
        (b"\x89HDF", "an HDF5 file"),
        (b"<", "a web page or XML"),
        (b"{", "JSON"),
    ];
    if start.is_empty() {
        return "an empty file".to_owned();
    }
    if let Some((_, name)) = known.iter().find(|(magic, _)| start.starts_with(magic)) {
        return (*name).to_owned();
    }
    match start {
        [0x80, protocol, ..] => format!("a pickle of protocol {protocol}"),
        _ if start.get(257..262) == Some(b"ustar") => "a tar archive (torch before 0.1.10 wrote such)".to_owned(),
        _ => format!("bytes {:02x?}", &start[..start.len().min(8)]),
    }
}

/// A checkpoint: tensors by name, their values still in the file.
#[derive(Debug)]
pub struct Checkpoint {
    /// The file's format.
    pub format: FileFormat,
    /// The author, if the file gives one (`__author__`).
    pub author: Option<String>,
    /// Metadata of a safetensors file.
    pub metadata: BTreeMap<String, String>,
    /// Tensors of the state dict.
    pub tensors: BTreeMap<String, StoredTensor>,
    /// Entries of the state dict that are not tensors, such as counters.
    pub not_tensors: Vec<String>,
}

impl Checkpoint {
    /// Format, metadata and the names of all tensors as JSON, as printed by `sdg weights inspect`.
    pub fn to_json(&self) -> Value {
        let tensors: Vec<Value> = self
            .tensors
            .iter()
            .map(|(name, tensor)| json!({"name": name, "shape": tensor.shape(), "dtype": tensor.element().name()}))
            .collect();
        json!({
            "format": self.format.to_string(),
            "author": self.author,
            "parameters": self.num_parameters(),
            "metadata": self.metadata,
            "tensors": tensors,
            "not_tensors": self.not_tensors,
        })
    }

    /// Reads names, shapes and positions of all tensors.
    ///
    /// # Errors
    /// A file of another format, a truncated or altered one, one that requests the execution of code, or one that
    /// requests much more memory than it has bytes.
    pub fn read(source: &mut Source) -> Result<Self> {
        let format = FileFormat::detect(source)?;
        let checkpoint = match format {
            FileFormat::NumpyPickle => {
                let pickle = pickle::load(source, source.whole())?;
                if pickle.end != source.len() {
                    let found = format!("{} more", source.len() - pickle.end);
                    return Err(WeightsError::damaged("pickle", "no bytes after its end", found));
                }
                Self::from_pickle(format, &pickle, None)?
            }
            FileFormat::TorchZip => {
                let (pickle, storages) = torch::read_zip(source)?;
                Self::from_pickle(format, &pickle, Some(&storages))?
            }
            FileFormat::TorchLegacy => {
                let (pickle, storages) = torch::read_legacy(source)?;
                Self::from_pickle(format, &pickle, Some(&storages))?
            }
            FileFormat::Safetensors => {
                let (tensors, metadata) = safetensors_file::read(source)?;
                Self { format, author: None, metadata, tensors, not_tensors: Vec::new() }
            }
        };
        if checkpoint.tensors.is_empty() {
            return Err(WeightsError::damaged("checkpoint", "tensors by name", checkpoint.found_instead()));
        }
        checkpoint.check_total(source.len())?;
        Ok(checkpoint)
    }

    /// The content of a checkpoint without tensors, and the way to get them.
    fn found_instead(&self) -> String {
        const SHOWN: usize = 6;
        if self.not_tensors.is_empty() {
            return "none".to_owned();
        }
        let named: Vec<String> =
            self.not_tensors.iter().take(SHOWN).map(|name| format!("`{}`", printable(name))).collect();
        let more = if self.not_tensors.len() > SHOWN { ", …" } else { "" };
        let what = format!("none, but {}{more}", named.join(", "));
        // Names with a dot are parameters. Their values are in torch's zip beside this pickle; Python's own pickle does
        // not write them. Names without a dot are the parts of a training checkpoint, one of which contains the
        // weights, or their mean over the last steps (`model_ema`).
        match self.not_tensors.iter().find(|name| name.contains("ema")).or(self.not_tensors.first()) {
            Some(name) if !name.contains('.') => format!(
                "{what}: write the weights alone, in Python: torch.save(torch.load(\"FILE\", weights_only=False)[\"{}\"], \"NEW.pth\")",
                printable(name)
            ),
            _ => format!(
                "{what}: a pickle without the numbers of its tensors: give the whole file that torch.save wrote (a zip, of which this \
                 is data.pkl), or write the weights anew: torch.save(model.state_dict(), \"NEW.pth\")"
            ),
        }
    }

    fn from_pickle(format: FileFormat, pickle: &Pickle, storages: Option<&Storages>) -> Result<Self> {
        let arena = &pickle.arena;
        if arena.dict(pickle.root).is_none() {
            return Err(WeightsError::damaged("checkpoint", "a dict of names", arena.describe(pickle.root)));
        }
        let inner = STATE_DICT_KEYS.iter().find_map(|key| {
            let value = arena.entry(pickle.root, key)?;
            arena.dict(value).map(|_| value)
        });
        let state_dict = inner.unwrap_or(pickle.root);
        let author = arena.entry(pickle.root, "__author__").and_then(|author| arena.text(author));
        let mut checkpoint = Self {
            format,
            author: author.map(printable),
            metadata: BTreeMap::new(),
            tensors: BTreeMap::new(),
            not_tensors: Vec::new(),
        };
        for &(key, value) in arena.dict(state_dict).unwrap_or_default() {
            let Some(name) = arena.text(key) else {
                let found = arena.describe(key);
                return Err(WeightsError::damaged("state dict", "names of at most 1024 bytes", found));
            };
            let tensor = match (arena.object(value), storages) {
                (Some(Object::Array(Some(tensor))), _) => Some((**tensor).clone()),
                (Some(Object::Tensor(_)), Some(storages)) => storages.tensor(pickle, value, name)?,
                _ => None,
            };
            match tensor {
                Some(tensor) => drop(checkpoint.tensors.insert(name.to_owned(), tensor)),
                None if name == "__author__" => {}
                None => checkpoint.not_tensors.push(name.to_owned()),
            }
        }
        Ok(checkpoint)
    }

    /// Rejects tensors that together are more than twice as large as the file. A few layers may use the same bytes, but
    /// many names for the same bytes would give a large result from a small file.
    fn check_total(&self, file_len: u64) -> Result<()> {
        let bytes = |tensor: &StoredTensor| (tensor.len() as u64).saturating_mul(tensor.element().size() as u64);
        let total = self.tensors.values().map(bytes).fold(0, u64::saturating_add);
        let most = file_len.saturating_mul(2);
        if total > most {
            return Err(WeightsError::TooLarge { what: "bytes of all tensors".to_owned(), most, found: total });
        }
        Ok(())
    }

    /// Number of values that can be weights.
    pub fn num_parameters(&self) -> usize {
        self.tensors.values().filter(|tensor| tensor.element().is_float()).map(StoredTensor::len).sum()
    }

    /// Number of tensors of each element type.
    pub fn element_types(&self) -> Vec<(ElementType, usize)> {
        let mut counts: Vec<(ElementType, usize)> = Vec::new();
        for tensor in self.tensors.values() {
            match counts.iter_mut().find(|(element, _)| *element == tensor.element()) {
                Some((_, count)) => *count += 1,
                None => counts.push((tensor.element(), 1)),
            }
        }
        counts
    }
}
