//! `sdg-web-bindgen MODULE.wasm FOLDER`: writes FOLDER/sdg_web.js and FOLDER/sdg_web_bg.wasm, which a page imports.
//!
//! The command-line tool of wasm-bindgen makes the same call, but has a hundred more dependencies for a test server.
#![forbid(unsafe_code)]

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<()> {
    let mut args = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(module), Some(folder), None) = (args.next(), args.next(), args.next()) else {
        bail!("expected MODULE.wasm and a folder to write into");
    };
    let mut bindgen = Bindgen::new();
    bindgen.input_path(&module).web(true)?.typescript(false).remove_name_section(true).remove_producers_section(true);
    bindgen.generate(&folder).with_context(|| format!("{}: cannot write JavaScript for it", module.display()))
}
