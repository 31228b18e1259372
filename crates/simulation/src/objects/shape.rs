//! The shape of a part from its MJCF and meshes.

use nalgebra::Point3;

use super::ObjectSpec;
use super::height_map::HeightMap;
use super::mjcf_tags::tags;
use super::obj_mesh::ObjMesh;
use crate::error::{Result, SimulationError};

/// The attributes that move or rotate a geom.
const POSES: [&str; 7] = ["pos", "quat", "axisangle", "euler", "xyaxes", "zaxis", "fromto"];

/// A visible mesh of a part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct VisualMesh {
    /// Name of the mesh's file.
    pub(super) file: String,
    pub(super) mesh: ObjMesh,
}

impl ObjectSpec {
    /// The visible meshes, in the object frame and in the order of the MJCF's geoms.
    ///
    /// # Errors
    /// [`SimulationError::File`] for a part without meshes, for meshes that are not OBJ triangles, and for geoms that
    /// move, rotate or scale their mesh.
    pub(super) fn visual_meshes(&self) -> Result<Vec<VisualMesh>> {
        let fail = |reason: String| SimulationError::File { path: format!("{}/object.xml", self.name).into(), reason };
        let tags = tags(&self.mjcf);
        let mut meshes = Vec::new();
        for geom in tags.iter().filter(|tag| tag.name == "geom" && tag.get("group") != Some("3")) {
            let Some(name) = geom.get("mesh") else { continue };
            let asset = tags.iter().find(|tag| tag.name == "mesh" && tag.get("name") == Some(name));
            let file = asset
                .filter(|asset| asset.get("scale").is_none() && POSES.iter().all(|pose| geom.get(pose).is_none()))
                .and_then(|asset| asset.get("file"))
                .ok_or_else(|| {
                    fail(format!("mesh {name:?}: expected a file, placed as it is, without scale or pose"))
                })?;
            let bytes = self.files.iter().find(|asset| asset.name == file).map(|asset| asset.bytes.as_slice());
            let text =
                std::str::from_utf8(bytes.unwrap_or_default()).map_err(|error| fail(format!("{file}: {error}")))?;
            let mesh = ObjMesh::parse(text).map_err(|reason| fail(format!("{file}: {reason}")))?;
            meshes.push(VisualMesh { file: file.to_owned(), mesh });
        }
        if meshes.is_empty() {
            return Err(fail("expected geoms with OBJ meshes, found none".to_owned()));
        }
        Ok(meshes)
    }

    /// The height map of the part from above, in the object frame.
    ///
    /// # Errors
    /// As for `visual_meshes`.
    pub(crate) fn height_map(&self, cell_m: f64) -> Result<HeightMap> {
        Ok(HeightMap::new(&triangles(&self.visual_meshes()?), cell_m))
    }
}

/// All triangles, each with the index of its mesh.
pub(super) fn triangles(meshes: &[VisualMesh]) -> Vec<([Point3<f64>; 3], u32)> {
    meshes
        .iter()
        .enumerate()
        .flat_map(|(idx, VisualMesh { mesh, .. })| mesh.faces.iter().map(move |face| (mesh.corners(face), idx as u32)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_with_a_pose_is_refused() {
        let spec = ObjectSpec::by_name("pendulum").unwrap();
        assert!(!spec.visual_meshes().unwrap().is_empty());
        for pose in POSES {
            let mjcf = spec.mjcf.replace(" mesh=\"", &format!(" {pose}=\"0 0 0\" mesh=\""));
            let error = ObjectSpec { mjcf, ..spec.clone() }.visual_meshes().unwrap_err().to_string();
            assert!(error.contains("without scale or pose"), "{pose}: {error}");
        }
    }
}
