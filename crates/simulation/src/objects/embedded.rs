//! The parts of `datasets/objects`, compiled into this crate.

macro_rules! embedded {
    ($($name:literal: [$($file:literal),* $(,)?]),* $(,)?) => {
        &[$(($name, &[$((
            $file,
            include_bytes!(concat!("../../../../datasets/objects/", $name, "/", $file)),
        )),*])),*]
    };
}

/// Name and bytes of a compiled-in file.
pub(super) type EmbeddedFile = (&'static str, &'static [u8]);

/// Number of the paper's parts in [`EMBEDDED`]; they come first.
pub(super) const NUM_PAPER_PARTS: usize = 8;

/// Name and files of every compiled-in part: the paper's eight, then the held-out four.
pub(super) static EMBEDDED: &[(&str, &[EmbeddedFile])] = embedded! {
    "pendulum": [
        "object.json", "object.xml",
        "pendulum_body.obj", "pendulum_raised.obj", "pendulum_bushing.obj", "pendulum_slug.obj",
        "pendulum_printed.png", "pendulum_steel.png", "pendulum_brass.png",
    ],
    "fuel_line": [
        "object.json", "object.xml",
        "fuel_line_tube.obj", "fuel_line_nuts.obj", "fuel_line_ends.obj", "fuel_line_clip.obj",
        "fuel_line_tube.png", "fuel_line_zinc.png", "fuel_line_steel.png", "fuel_line_plastic.png",
    ],
    "rod_end": [
        "object.json", "object.xml",
        "rod_end_housing.obj", "rod_end_liner.obj", "rod_end_ball.obj",
        "rod_end_neck.obj", "rod_end_screw.obj", "rod_end_plated.obj",
        "rod_end_forged.png", "rod_end_bronze.png", "rod_end_polished.png",
        "rod_end_rolled.png", "rod_end_plated.png",
    ],
    "housing": [
        "object.json", "object.xml",
        "housing_cast.obj", "housing_feet.obj", "housing_joint.obj", "housing_bores.obj", "housing_floor.obj",
        "housing_plug.obj",
        "housing_cast.png", "housing_milled.png", "housing_bored.png", "housing_primer.png", "housing_brass.png",
    ],
    "pneumatic_cylinder": [
        "object.json", "object.xml",
        "pneumatic_cylinder_caps.obj", "pneumatic_cylinder_tube.obj", "pneumatic_cylinder_ties.obj",
        "pneumatic_cylinder_nuts.obj", "pneumatic_cylinder_wiper.obj", "pneumatic_cylinder_rod.obj",
        "pneumatic_cylinder_screw.obj", "pneumatic_cylinder_hexagons.obj", "pneumatic_cylinder_bodies.obj",
        "pneumatic_cylinder_mouths.obj",
        "pneumatic_cylinder_anodised.png", "pneumatic_cylinder_tube.png", "pneumatic_cylinder_bright.png",
        "pneumatic_cylinder_zinc.png", "pneumatic_cylinder_chrome.png", "pneumatic_cylinder_rolled.png",
        "pneumatic_cylinder_rubber.png", "pneumatic_cylinder_blue.png",
    ],
    "ball_bearing": [
        "object.json", "object.xml",
        "ball_bearing_rings.obj", "ball_bearing_balls.obj", "ball_bearing_cage.obj",
        "ball_bearing_ground.png", "ball_bearing_polished.png", "ball_bearing_brass.png",
    ],
    "common_line": [
        "object.json", "object.xml",
        "common_line_tube.obj", "common_line_lugs.obj", "common_line_faces.obj", "common_line_screws.obj",
        "common_line_mouths.obj", "common_line_plated.obj", "common_line_necks.obj", "common_line_plug.obj",
        "common_line_forged.png", "common_line_rough.png", "common_line_machined.png", "common_line_rolled.png",
        "common_line_zinc.png", "common_line_neck.png", "common_line_dark.png",
    ],
    "cranfield_face": [
        "object.json", "object.xml",
        "cranfield_face_plate.obj", "cranfield_face_collars.obj",
        "cranfield_face_printed.png",
    ],
    "key": [
        "object.json", "object.xml",
        "key_bow.obj", "key_ribs.obj", "key_emblem.obj", "key_blade.obj",
        "key_moulded.png", "key_emblem.png", "key_nickel.png",
    ],
    "pliers": [
        "object.json", "object.xml",
        "pliers_steel.obj", "pliers_lap.obj", "pliers_rivet.obj", "pliers_sleeves.obj", "pliers_inlays.obj",
        "pliers_ground.png", "pliers_oiled.png", "pliers_turned.png", "pliers_dipped.png", "pliers_inlay.png",
    ],
    "circuit_board": [
        "object.json", "object.xml",
        "circuit_board_board.obj", "circuit_board_plastics.obj", "circuit_board_tin.obj", "circuit_board_brass.obj",
        "circuit_board_lids.obj",
        "circuit_board_mask.png", "circuit_board_plastics.png", "circuit_board_tin.png", "circuit_board_gold.png",
        "circuit_board_lid.png",
    ],
    "spring_clip": [
        "object.json", "object.xml",
        "spring_clip_leaf.obj", "spring_clip_lower.obj", "spring_clip_bead.obj", "spring_clip_rivet.obj",
        "spring_clip_cover.obj",
        "spring_clip_leaf.png", "spring_clip_steel.png", "spring_clip_brass.png", "spring_clip_vinyl.png",
    ],
};
