//! Prints detections as JSON with all digits, one line per picture: the reference for tests of the Python package and
//! the C library. It does not use `sdg-bindings`.
//!
//! Usage: `reference MODEL CAMERA|- PICTURE…`

use std::path::Path;

use anyhow::{Context, Result};
use sdg_cell::FoundRecord;
use sdg_grasp::{Device, Verification};
use sdg_inputs::{camera_files, read_image_in, read_model};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let usage = "expected MODEL CAMERA|- PICTURE…";
    let (model, camera) = arguments.next().zip(arguments.next()).context(usage)?;
    let camera = Some(Path::new(&camera)).filter(|camera| *camera != Path::new("-"));
    let perception =
        camera_files::perception(read_model(Path::new(&model), &Device::flex())?, Path::new(&model), camera)?;
    for picture in arguments {
        let picture = read_image_in(Path::new(&picture), perception.pixel_frame())?;
        let found = perception.detect(&picture, Verification::ByShape)?;
        let records: Vec<FoundRecord> = found.iter().map(|found| FoundRecord::new(found, &perception)).collect();
        println!("{}", serde_json::to_string(&records)?);
    }
    Ok(())
}
