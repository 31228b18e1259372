//! Pictures of parts on tables, with ground truth.

mod blur;
mod color_grid;
mod composition;
mod config;
mod contents;
mod edges;
mod ground;
mod layout;
mod light;
mod mixed;
mod photo;
mod placement;
mod render;
mod sample;
mod scenes;
mod sensor;
mod shading;
mod table;
mod view;

pub use config::{Condition, SceneConfig};
pub use mixed::{MixedInstance, MixedSample};
pub use photo::{DemonstrationPhoto, PhotoConfig, demonstration};
pub use sample::{Conditions, Instance, OtherKind, OtherObject, Sample};
pub use scenes::Scenes;
