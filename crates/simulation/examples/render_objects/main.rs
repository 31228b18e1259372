//! Builds the parts under `datasets/objects`: meshes, textures, MJCF and metadata.
//!
//! `cargo run --release -p sdg-simulation --example render_objects [FOLDER]`
//!
//! Every part was designed for this project and has its own file. The object frame has z up, its origin on the table
//! below the centre of the grasp marks, and x along the marks from `grasp_start` to `grasp_end`. All lengths are in
//! metres.

mod ball_bearing;
mod board_layout;
mod board_print;
mod circuit_board;
mod common_line;
mod cranfield_face;
mod fuel_line;
mod housing;
mod key;
mod part;
mod pendulum;
mod pliers;
mod pneumatic_cylinder;
mod print;
mod rod_end;
mod shapes;
mod spring_clip;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../datasets/objects");
    let folder = std::env::args().nth(1).map_or(default, PathBuf::from);
    for part in [
        pendulum::pendulum(),
        fuel_line::fuel_line(),
        rod_end::rod_end(),
        housing::housing(),
        pneumatic_cylinder::pneumatic_cylinder(),
        ball_bearing::ball_bearing(),
        common_line::common_line(),
        cranfield_face::cranfield_face(),
        key::key(),
        pliers::pliers(),
        circuit_board::circuit_board(),
        spring_clip::spring_clip(),
    ] {
        part::write_part(&folder.join(part.name), &part)?;
    }
    Ok(())
}
