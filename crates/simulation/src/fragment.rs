//! A fragment of an MJCF model with its files.

use std::fmt::Write as _;

use nalgebra::Isometry3;

use crate::model::Asset;
use crate::shapes::mesh::TriangleMesh;
use crate::shapes::texture::Texture;

/// Complete top-level sections (`<visual>`, `<asset>`, `<worldbody>`) for insertion into a `<mujoco>` element.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MjcfFragment {
    /// The MJCF text.
    pub sections: String,
    /// The files named by the text: meshes and textures.
    pub files: Vec<Asset>,
}

impl MjcfFragment {
    /// Appends another fragment.
    pub fn append(&mut self, other: MjcfFragment) {
        self.sections.push_str(&other.sections);
        self.files.extend(other.files);
    }

    /// A complete model of this fragment alone, for a viewer or a test.
    pub fn to_standalone_mjcf(&self) -> String {
        format!("<mujoco>\n{}</mujoco>\n", self.sections)
    }

    pub(crate) fn write(&mut self, text: std::fmt::Arguments<'_>) {
        let _ = self.sections.write_fmt(text);
        self.sections.push('\n');
    }

    pub(crate) fn add_mesh(&mut self, name: &str, mesh: &TriangleMesh) {
        self.write(format_args!("<asset><mesh name=\"{name}\" file=\"{name}.obj\"/></asset>"));
        self.files.push(Asset { name: format!("{name}.obj"), bytes: mesh.to_obj().into_bytes() });
    }

    pub(crate) fn add_texture(&mut self, name: &str, texture: &Texture) {
        self.write(format_args!("<asset><texture name=\"{name}\" type=\"2d\" file=\"{name}.png\"/></asset>"));
        self.files.push(Asset { name: format!("{name}.png"), bytes: texture.to_png() });
    }
}

/// The attributes `pos` and `quat` of a pose.
pub fn pose_attributes(parent_from_body: &Isometry3<f64>) -> String {
    let (p, q) = (parent_from_body.translation.vector, parent_from_body.rotation);
    format!("pos=\"{:.6} {:.6} {:.6}\" quat=\"{:.9} {:.9} {:.9} {:.9}\"", p.x, p.y, p.z, q.w, q.i, q.j, q.k)
}
