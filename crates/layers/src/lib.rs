//! The building blocks of the networks: layers, the initial values of their parameters, and parameters by name.
//!
//! ```text
//! seed ─ Initializer ─ layers of a network ─ state_dict::export ─ names and values ─ file
//!                                          ◄ state_dict::import ◄
//! ```
//!
//! Parameters are named as in PyTorch: a parameter's name is the path of its fields, and weights files use these
//! names.
//!
//! In other crates: networks (`detection`, `orientation`, `comparison`), optimisers (`training`), files.
//!
//! # Example
//! ```
//! use burn::tensor::{Device, Tensor};
//! use sdg_layers::{Distribution, Initializer, Linear, state_dict};
//!
//! let mut init = Initializer::new(&Device::flex(), 7);
//! let layer = Linear::init(3, 2, Distribution::he_normal(3), &mut init);
//! let output = layer.forward(Tensor::<2>::zeros([4, 3], &Device::flex()));
//! assert_eq!(output.dims(), [4, 2]);
//! assert_eq!(state_dict::export(&layer)["weight"].shape, [2, 3]);
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod conv;
mod conv_norm_relu;
pub mod initialization;
mod linear;
pub mod state_dict;

pub use conv::{Conv2d, Conv2dShape, ConvTranspose2x, Norm, NormKind, upsample_bilinear_2x};
pub use conv_norm_relu::{ConvNormRelu, GroupNorm, Stage};
pub use initialization::{Distribution, Initializer};
pub use linear::Linear;
