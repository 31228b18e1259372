//! Weights from other projects: converts Detectron2's and torchvision's checkpoints to this project's files.
//!
//! ```text
//! file ─ format by content ─┬─ pickle of numpy arrays ─┐
//!                           ├─ torch zip, legacy ──────┼─ Checkpoint: name → shape, position in the file
//!                           └─ safetensors ────────────┘
//! Checkpoint + Architecture ─ naming scheme ─ Conversion: a tensor for each parameter, and a Report ─ write ─ safetensors
//! ```
//!
//! Values stay in the file until they are written, so that a conversion needs the memory of one layer. A pickled
//! checkpoint is a program for Python's pickle machine and may be hostile: this crate emulates the few functions that
//! weights need, refuses every other by name, and checks every size before it allocates memory.
//!
//! Not included: running the network (`sdg weights verify` does this), downloads, torch's pre-2017 tar files,
//! compressed zips.
//!
//! # Example
//! ```
//! use sdg_weights_conversion::{Checkpoint, FileFormat, Source};
//!
//! # fn main() -> Result<(), sdg_weights_conversion::WeightsError> {
//! // A safetensors file by hand: one weight.
//! let header = br#"{"w":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}"#;
//! let bytes = [&(header.len() as u64).to_le_bytes(), header.as_slice(), &0.5f32.to_le_bytes()].concat();
//! let mut source = Source::from_bytes(bytes);
//! let checkpoint = Checkpoint::read(&mut source)?;
//! assert_eq!(checkpoint.format, FileFormat::Safetensors);
//! assert_eq!(checkpoint.tensors["w"].values(&mut source)?, [0.5]);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod architecture;
mod checkpoint;
mod conversion;
mod digest;
mod element;
mod error;
mod naming;
mod pickle;
mod report;
mod safetensors_file;
mod self_description;
mod source;
mod tensor;
mod torch;
mod writing;
mod zip_archive;

pub use architecture::Architecture;
pub use checkpoint::{Checkpoint, FileFormat};
pub use conversion::{Conversion, ParameterValues, is_backbone_alone, is_part_of, naming_of, source_of};
pub use digest::sha256_of;
pub use element::ElementType;
pub use error::{Result, WeightsError};
pub use naming::{Naming, Program};
pub use report::{Applied, Mismatch, Report};
pub use self_description::SecondStage;
pub use source::Source;
pub use tensor::StoredTensor;
pub use writing::{Precision, WEIGHTS_VERSION, Written};
