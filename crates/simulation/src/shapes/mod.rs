//! The geometry of bodies: meshes, solids, textures, and their outlines on the table.

pub mod footprint;
pub mod mesh;
pub mod solids;
pub mod texture;
