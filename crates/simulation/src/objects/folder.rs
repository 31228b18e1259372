//! Writes a part to a folder.

use std::fs;
use std::path::Path;

use serde_json::json;

use super::{OBJECT_FORMAT, ObjectSpec};
use crate::error::{Result, SimulationError};

impl ObjectSpec {
    /// Writes `object.json`, `object.xml` and the meshes and textures into a folder, which is
    /// created; [`ObjectSpec::from_folder`] reads it.
    ///
    /// # Errors
    /// [`SimulationError::File`] for a file that cannot be written.
    pub fn write_folder(&self, folder: &Path) -> Result<()> {
        let footprint: Vec<[f64; 2]> = self.footprint.iter().map(|corner| [corner.x, corner.y]).collect();
        let metadata = json!({
            "format": OBJECT_FORMAT,
            "name": self.name,
            "title": self.title,
            "description": self.description,
            "mass_kg": self.mass_kg,
            "friction": self.friction,
            "grasp_start": self.grasp_start.coords.as_slice(),
            "grasp_end": self.grasp_end.coords.as_slice(),
            "jaw_width_m": self.jaw_width_m,
            "grasp_height_m": self.grasp_height_m,
            "mark_height_m": self.mark_height_m,
            "seen_height_m": self.seen_height_m,
            "rest_height_m": self.rest_height_m,
            "symmetry": self.symmetry,
            "footprint": footprint,
            "mjcf": "object.xml",
        });
        let mjcf = format!("<mujoco model=\"{}\">{}</mujoco>\n", self.name, self.mjcf);
        let texts = [("object.json", format!("{metadata:#}\n").into_bytes()), ("object.xml", mjcf.into_bytes())];
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            fs::write(&path, bytes).map_err(|error| SimulationError::File { path, reason: error.to_string() })
        };
        fs::create_dir_all(folder)
            .map_err(|error| SimulationError::File { path: folder.to_owned(), reason: error.to_string() })?;
        for (name, bytes) in &texts {
            write(name, bytes)?;
        }
        for asset in &self.files {
            write(&asset.name, &asset.bytes)?;
        }
        Ok(())
    }
}
