//! Male rod end: spherical bearing in a forged eye, threaded shank with a lock nut, grease nipple.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{hex_prism, lathe, lying_along_x, ring, thread};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{BRASS, Finish, Part, Piece, STEEL, centred_texture, moved};

/// The part.
pub fn rod_end() -> Part {
    let eye = -0.042;
    let (half_ball, ball_radius, bore): (f64, f64, f64) = (0.0135, 0.017, 0.009);
    let (half_eye, eye_radius): (f64, f64) = (0.0085, 0.024);
    let shank_radius = 0.009;

    // The eye: race inside, a slightly barrelled rim outside.
    let race = (ball_radius * ball_radius - half_eye * half_eye).sqrt() + 0.0002;
    let rim = |z: f64| eye_radius - 0.0022 * (z / half_eye).powi(2);
    let mut profile = vec![(race, -half_eye)];
    profile.push((rim(half_eye) - 0.001, -half_eye));
    profile.extend((-3..=3).map(|step| {
        let z = f64::from(step) / 3.0 * (half_eye - 0.0008);
        (rim(z), z)
    }));
    profile.push((rim(half_eye) - 0.001, half_eye));
    profile.push((race, half_eye));
    profile.push((ball_radius + 0.0001, 0.0));
    let housing = centred_texture(lathe(&profile, 64), 0.06).transformed(&Isometry3::translation(eye, 0.0, half_ball));

    let liner = moved(
        ring(race - 0.0006, race + 0.0016, 2.0 * half_eye + 0.0006, 0.0003, 56),
        eye,
        0.0,
        half_ball - half_eye - 0.0003,
    );

    let flat = (ball_radius * ball_radius - half_ball * half_ball).sqrt();
    let mut profile = vec![(bore, -half_ball + 0.0006), (bore + 0.0006, -half_ball), (flat, -half_ball)];
    profile.extend((-5..=5).map(|step| {
        let z = f64::from(step) / 6.0 * half_ball;
        ((ball_radius * ball_radius - z * z).sqrt(), z)
    }));
    profile.extend([(flat, half_ball), (bore + 0.0006, half_ball), (bore, half_ball - 0.0006)]);
    let ball = centred_texture(lathe(&profile, 48), 0.04).transformed(&Isometry3::translation(eye, 0.0, half_ball));

    // Neck and bare shank, a solid of revolution about x that starts inside the eye's wall.
    let lying = lying_along_x(half_ball);
    let along = |mesh: TriangleMesh, x: f64| mesh.transformed(&(Isometry3::translation(x, 0.0, 0.0) * lying));
    let neck_profile = [
        (0.0, 0.0),
        (0.0082, 0.0),
        (0.0118, 0.003),
        (0.0108, 0.007),
        (0.0096, 0.011),
        (0.0090, 0.015),
        (0.0090, 0.030),
        (0.0078, 0.0312),
        (0.0, 0.0312),
    ];
    let neck = along(lathe(&neck_profile, 36), eye + 0.0185);
    let neck_end = eye + 0.0185 + 0.030;
    let shank_end = 0.064;
    let screw = along(thread(shank_radius, 0.0025, shank_end - neck_end, 18), neck_end);

    let level = lying * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI / 2.0);
    let nut_x = 0.029;
    let nut = hex_prism(0.027, 0.010, 0.0).transformed(&(Isometry3::translation(nut_x, 0.0, 0.0) * level));

    let nipple_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 135f64.to_radians());
    let nipple_profile = [
        (0.0, 0.0),
        (0.0036, 0.0),
        (0.0036, 0.0035),
        (0.0022, 0.0038),
        (0.0022, 0.0058),
        (0.0029, 0.0068),
        (0.0020, 0.0086),
        (0.0, 0.0088),
    ];
    let nipple = lathe(&nipple_profile, 20).transformed(
        &(Isometry3::from_parts(Translation3::new(eye, 0.0, half_ball), nipple_turn)
            * Isometry3::translation(eye_radius - 0.0012, 0.0, 0.0)
            * lying_along_x(0.0)),
    );
    let mut plated = nut.textured_from_above(0.05);
    plated.append(&nipple.textured_from_above(0.05));

    Part {
        name: "rod_end",
        title: "Rod end",
        description: "Male rod end, M18 by 2.5: spherical plain bearing with an 18 mm bore in a forged eye of 48 mm, \
                      threaded shank with a lock nut, grease nipple",
        pieces: vec![
            Piece { name: "housing", mesh: housing, density: STEEL, material: "forged" },
            Piece { name: "liner", mesh: liner.textured_from_above(0.04), density: BRASS, material: "bronze" },
            Piece { name: "ball", mesh: ball, density: STEEL, material: "polished" },
            Piece { name: "neck", mesh: neck.textured_from_above(0.06), density: STEEL, material: "forged" },
            Piece { name: "screw", mesh: screw, density: STEEL, material: "rolled" },
            Piece { name: "plated", mesh: plated, density: STEEL * 0.8, material: "plated" },
        ],
        finishes: vec![
            Finish {
                name: "forged",
                texture: Texture::cast(128, [0.50, 0.51, 0.53], 0.07, 31),
                specular: 0.35,
                shininess: 0.3,
            },
            Finish {
                name: "bronze",
                texture: Texture::grained(64, [0.66, 0.47, 0.26], 0.06, 32),
                specular: 0.4,
                shininess: 0.4,
            },
            Finish {
                name: "polished",
                texture: Texture::turned(128, [0.74, 0.75, 0.77], 0.22, 33),
                specular: 0.9,
                shininess: 0.8,
            },
            Finish {
                name: "rolled",
                texture: Texture::round_bar(64, [0.48, 0.49, 0.50], 0.45, 34),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish {
                name: "plated",
                texture: Texture::brushed(128, [0.70, 0.70, 0.68], 0.10, 35),
                specular: 0.6,
                shininess: 0.5,
            },
        ],
        collisions: vec![
            format!("type=\"cylinder\" pos=\"{eye} 0 {half_ball}\" size=\"{eye_radius} {half_eye}\""),
            format!("type=\"cylinder\" pos=\"{eye} 0 {half_ball}\" size=\"{flat:.5} {half_ball}\""),
            format!(
                "type=\"cylinder\" size=\"{shank_radius}\" fromto=\"-0.020 0 {half_ball} {shank_end} 0 {half_ball}\""
            ),
            format!("type=\"box\" pos=\"{} 0 {half_ball}\" size=\"0.005 0.0117 {half_ball}\"", nut_x + 0.005),
        ],
        grasp_half_line: 0.020,
        jaw_width: 2.0 * shank_radius,
        grasp_height: 0.012,
        mark_height: half_ball,
        seen_height: half_ball + shank_radius,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}
