//! What is checked of the sources and documents themselves, by `tests/`: no two files of a crate import from each other, no
//! link of a document leads nowhere, and the table of crates in ARCHITECTURE.md says what `cargo metadata` says.
//!
//! ```
//! use sdg_checks::ModuleGraph;
//!
//! let sources = [("lib.rs", "mod a; mod b;"), ("a.rs", "use crate::b::B; pub struct A;"), ("b.rs", "use crate::a::A; pub struct B;")];
//! let graph = ModuleGraph::new(sources);
//! assert_eq!(graph.cycles(), [["a.rs", "b.rs"]]);
//! ```
//!
//! It reads sources as text, without a parser of Rust: paths that macros make are not seen.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod crate_table;
mod markdown;
mod module_graph;
mod paths;
mod source_text;

pub use crate_table::{CrateRow, crate_rows, names_in_code};
pub use markdown::{headings, links, named_files};
pub use module_graph::ModuleGraph;
