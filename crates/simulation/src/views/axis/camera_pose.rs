//! Pictures from a higher, lower or tilted camera, with the part always completely in the picture.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Isometry3, Vector3};
use rand::Rng;
use sdg_geometry::PosedCamera;
use sdg_robot::{LOOK_AT_M, LOOK_HEIGHT_M, camera_looking_down};

use super::request::{AxisParameter, Drawn, Request};
use crate::error::{Result, SimulationError};
use crate::scene::PlacedObject;
use crate::views::shows_whole;
use crate::views::tilted::tilted_camera;
use crate::workcell::{Workcell, WorkcellConfig};

/// Heights of the camera relative to the usual one.
const HEIGHT_FACTORS: Range<f64> = 0.75..1.3;

/// Tilts of the camera on the axis `Axis::Tilt`, in degrees; with a smaller tilt, the picture counts as an ordinary
/// one.
pub(super) const TILTS_DEG: Range<f64> = 5.0..20.0;
/// Tilts of the camera on the axis `Axis::Slant`, in degrees.
pub(super) const SLANTS_DEG: Range<f64> = 0.0..35.0;

/// Largest distance in x and in y between the part and the point at which a tilted camera is aimed, in metres.
const MAX_LOOK_OFFSET_M: f64 = 0.06;

/// Maximum number of directions of tilt that are tried until the arm reaches the camera's pose and the part is in the
/// picture.
const MAX_TRIES: usize = 40;

/// The picture of a camera at another height that points vertically down. The camera is above the usual point, or moved
/// towards the part until the whole part is in the picture.
pub(super) fn draw_from_another_height(request: &mut Request<'_>) -> Result<Drawn> {
    let scene = request.ordinary_scene();
    let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
    let factor = request.between(HEIGHT_FACTORS);
    let [x, y] = LOOK_AT_M;
    let height_m = LOOK_HEIGHT_M * factor;
    let part = part_in(&cell)?;
    let above = part.base_from_object.translation.vector;
    // Poses from above the usual point to above the part.
    let places = (0..=10).map(|step| {
        let share = f64::from(step) / 10.0;
        camera_looking_down(x + share * (above.x - x), y + share * (above.y - y), height_m, 0.0)
    });
    let view = first_view(&mut cell, &part, places)?;
    let description = format!("camera {:.0} mm above the table, {factor:.2} of the usual height", height_m * 1e3);
    Ok(Drawn {
        cell,
        scene,
        view,
        parameter: AxisParameter { value: factor, unit: "of the usual height", description },
    })
}

/// The picture of a tilted camera at the usual distance, aimed at the part or slightly beside it.
pub(super) fn draw_tilted(request: &mut Request<'_>, tilts_deg: Range<f64>) -> Result<Drawn> {
    let scene = request.ordinary_scene();
    let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
    let tilt_deg = request.between(tilts_deg);
    let distance_m = LOOK_HEIGHT_M;
    let part = part_in(&cell)?;
    let at = part.base_from_object.translation.vector;
    let rng = &mut request.rng;
    let places: Vec<Isometry3<f64>> = (0..MAX_TRIES)
        .map(|_| {
            let axis_rad: f64 = rng.random_range(-PI..PI);
            let offset = [0; 2].map(|_: i32| rng.random_range(-MAX_LOOK_OFFSET_M..MAX_LOOK_OFFSET_M));
            let aim = Vector3::new(at.x + offset[0], at.y + offset[1], 0.0);
            tilted_camera(&aim, distance_m, 0.0, axis_rad, tilt_deg)
        })
        .collect();
    let view = first_view(&mut cell, &part, places)?;
    let description = format!("camera tilted by {tilt_deg:.1} degrees");
    Ok(Drawn { cell, scene, view, parameter: AxisParameter { value: tilt_deg, unit: "degrees", description } })
}

fn part_in(cell: &Workcell) -> Result<PlacedObject> {
    cell.config().scene.object.clone().ok_or_else(|| SimulationError::Configuration {
        field: "scene.object",
        expected: "a part".into(),
        found: "none".into(),
    })
}

/// The picture from the first pose that the arm reaches and that shows the whole part.
fn first_view(
    cell: &mut Workcell,
    part: &PlacedObject,
    places: impl IntoIterator<Item = Isometry3<f64>>,
) -> Result<crate::camera::CameraView> {
    let intrinsics = cell.wrist_view()?.camera.intrinsics;
    let mut unreached = None;
    for base_from_camera in places {
        let camera = PosedCamera { intrinsics, world_from_camera: base_from_camera };
        if !shows_whole(&camera, part) {
            continue;
        }
        match cell.view_from(&base_from_camera) {
            Err(error @ SimulationError::Configuration { .. }) => unreached = Some(error),
            other => return other,
        }
    }
    Err(unreached.unwrap_or_else(|| SimulationError::Configuration {
        field: "camera",
        expected: "a place that shows the whole part".into(),
        found: format!("none for {} at {}", part.spec.name, part.base_from_object.translation.vector),
    }))
}
