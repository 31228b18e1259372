//! Pictures with another object on the part that covers a given fraction of its visible area.

use std::f64::consts::PI;

use nalgebra::{Isometry2, Isometry3, Point2, Point3, Vector2, Vector3};
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use super::request::{AxisParameter, Drawn, Request};
use super::visible::{hide_distractor, instance_bodies, num_pixels, place_distractor};
use crate::error::{Result, SimulationError};
use crate::objects::HeightMap;
use crate::scene::{Distractor, DistractorKind, PlacedObject};
use crate::shapes::footprint;
use crate::views::base_from_look_camera;
use crate::workcell::{Workcell, WorkcellConfig};

/// Range of the covered fraction of the part's pixels.
const COVERED_SHARES: std::ops::Range<f64> = 0.10..0.40;
/// Tolerance of the measured fraction: half of a stratum, plus the steps of the raster.
const SHARE_TOLERANCE: f64 = 0.02;

/// Distractors that can lie on another part: mostly flat or long ones.
const KINDS: [DistractorKind; 10] = [
    DistractorKind::Plate,
    DistractorKind::Flange,
    DistractorKind::Lever,
    DistractorKind::Spanner,
    DistractorKind::Gear,
    DistractorKind::Bracket,
    DistractorKind::Block,
    DistractorKind::Shaft,
    DistractorKind::BentTube,
    DistractorKind::Bearing,
];

/// Maximum number of covers that are tried until one covers enough.
const MAX_COVERS: u32 = 60;
/// Largest step of the cover in the search for its position, in metres.
const FIRST_STEP_M: f64 = 0.003;
/// Maximum number of pictures for finding a cover's position.
const MAX_MEASUREMENTS: usize = 8;
/// Side of a cell of the views from above, in metres.
const CELL_M: f64 = 0.001;
/// Gap between the cover and the part under it, so that no surfaces coincide, in metres.
const AIR_M: f64 = 0.0003;
/// Minimum distance of the distractors from the cover as seen from above, in metres.
const CLEARANCE_M: f64 = 0.01;

/// A cover that moves over the part.
struct Slide {
    cover: Distractor,
    part: PlacedObject,
    part_map: HeightMap,
    cover_map: HeightMap,
    /// The position of the cover's centre at the end of its path, in the base frame.
    end: Point2<f64>,
    camera: Vector3<f64>,
    cover_middle_m: f64,
    direction: Vector2<f64>,
    yaw_rad: f64,
}

impl Slide {
    fn new(part: &PlacedObject, part_map: &HeightMap, scale: f64, rng: &mut Pcg64Mcg) -> Self {
        let kind = KINDS[rng.random_range(0..KINDS.len())];
        let cover = Distractor::scaled(kind, &Isometry2::identity(), rng.random(), scale);
        let triangles: Vec<([Point3<f64>; 3], u32)> = cover.triangles().map(|corners| (corners, 0)).collect();
        let (yaw_rad, from_rad): (f64, f64) = (rng.random_range(-PI..PI), rng.random_range(-PI..PI));
        // Any region of the part may be covered, at its ends or at its centre.
        let filled: Vec<Point2<f64>> = part_map.filled().map(|(at, ..)| at).collect();
        let end = part.table_from_object() * filled[rng.random_range(0..filled.len())];
        let heights = triangles.iter().flat_map(|(corners, _)| corners.map(|corner| corner.z));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        Self {
            camera: base_from_look_camera().translation.vector,
            cover_middle_m: 0.5 * (high - low),
            cover_map: HeightMap::new(&triangles, CELL_M),
            cover,
            part: part.clone(),
            part_map: part_map.clone(),
            end,
            direction: Vector2::new(from_rad.cos(), from_rad.sin()),
            yaw_rad,
        }
    }

    fn table_from_cover(&self, distance_m: f64) -> Isometry2<f64> {
        Isometry2::new(self.end.coords + self.direction * distance_m, self.yaw_rad)
    }

    /// Height of the part's top under the cover; `None` if the cover is beside the part.
    fn top_m(&self, table_from_cover: &Isometry2<f64>) -> Option<f64> {
        let cover_from_part = table_from_cover.inverse() * self.part.table_from_object();
        self.part_map
            .filled()
            .filter(|(at, ..)| self.cover_map.at(&(cover_from_part * at)).is_some())
            .map(|(_, z, _)| z + self.part.spec.rest_height_m)
            .reduce(f64::max)
    }

    /// Fraction of the part that the cover hides from the camera, with the cover approximated as flat at half of its
    /// height.
    fn estimated_share(&self, distance_m: f64) -> f64 {
        let table_from_cover = self.table_from_cover(distance_m);
        let bottom_m = self.top_m(&table_from_cover).unwrap_or(0.0) + AIR_M;
        let (cover_from_table, table_from_part) = (table_from_cover.inverse(), self.part.table_from_object());
        let (mut covered, mut total) = (0, 0);
        for (at, z, _) in self.part_map.filled() {
            total += 1;
            let at = (table_from_part * at).coords.push(z + self.part.spec.rest_height_m);
            // The point at which the ray from the part to the camera crosses the cover's height.
            let rise = (bottom_m + self.cover_middle_m - at.z).max(0.0) / (self.camera.z - at.z);
            let passed = at + (self.camera - at) * rise;
            covered += i32::from(self.cover_map.at(&(cover_from_table * Point2::from(passed.xy()))).is_some());
        }
        f64::from(covered) / f64::from(total.max(1))
    }

    /// The pose of the cover at a distance from the end of its path.
    fn pose(&self, distance_m: f64) -> Isometry3<f64> {
        let table_from_cover = self.table_from_cover(distance_m);
        let mut placed = self.cover.moved_to(&table_from_cover);
        if let Some(top_m) = self.top_m(&table_from_cover) {
            placed.base_from_distractor.translation.z += top_m + AIR_M;
        }
        placed.base_from_distractor
    }

    /// The distance at which the cover first hides the wanted fraction on its path; `None` if it never does.
    fn distance_for(&self, wanted: f64) -> Option<f64> {
        let on_the_way = |step: f64, from: f64, num_steps: u32| {
            (0..=num_steps)
                .map(move |number| from - step * f64::from(number))
                .find(|&distance| self.estimated_share(distance) >= wanted)
        };
        let coarse = on_the_way(0.008, 0.20, 25)?;
        on_the_way(0.001, coarse + 0.008, 8)
    }
}

/// An ordinary scene with an object on the part.
pub(super) fn draw_covered(request: &mut Request<'_>) -> Result<Drawn> {
    let wanted = request.between(COVERED_SHARES);
    let part_map = request.spec.height_map(CELL_M)?;
    let ordinary = request.ordinary_scene();
    let none = || SimulationError::Configuration {
        field: "covered",
        expected: format!("a cover over {:.0} % of the part", wanted * 100.0),
        found: format!("none of {MAX_COVERS} for {}", request.spec.name),
    };
    let part = ordinary.object.clone().ok_or_else(none)?;
    for number in 0..MAX_COVERS {
        // The covers become larger, because the usual distractors may be too small for the part.
        let scale = 1.0 + f64::from(number) / f64::from(MAX_COVERS);
        let slide = Slide::new(&part, &part_map, scale, &mut request.rng);
        let Some(estimate) = slide.distance_for(wanted) else { continue };
        let mut scene = ordinary.clone();
        let mut cover = slide.cover.moved_to(&slide.table_from_cover(estimate));
        scene.distractors.retain(|other| footprint::separation(&other.footprint, &cover.footprint) >= CLEARANCE_M);
        cover.base_from_distractor = slide.pose(estimate);
        scene.distractors.push(cover);
        let index = scene.distractors.len() - 1;
        let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
        // The arm moves first; the picture is rendered when the cover is in place.
        cell.reach_camera_pose(&base_from_look_camera())?;
        let Some((distance_m, share)) = lay_over(&mut cell, &slide, index, estimate, wanted)? else { continue };
        let mut cover = slide.cover.moved_to(&slide.table_from_cover(distance_m));
        cover.base_from_distractor = slide.pose(distance_m);
        let kind = cover.kind;
        scene.distractors[index] = cover;
        let view = cell.wrist_view()?;
        let description = format!("{:.0} % covered by a {kind:?}", share * 100.0).to_lowercase();
        let parameter = AxisParameter { value: share, unit: "of the part's pixels", description };
        return Ok(Drawn { cell, scene, view, parameter });
    }
    Err(none())
}

/// Moves the cover until it hides the wanted fraction in the camera's picture; returns the position and the fraction,
/// if found.
fn lay_over(
    cell: &mut Workcell,
    slide: &Slide,
    index: usize,
    estimate_m: f64,
    wanted: f64,
) -> Result<Option<(f64, f64)>> {
    let body = instance_bodies(cell, 1)?[0];
    hide_distractor(cell, index)?;
    let segmentation = cell.wrist_segmentation()?;
    let uncovered = num_pixels(cell, &segmentation, body).max(1) as f64;
    let (mut near_m, mut far_m) = (0.0, estimate_m + 0.08);
    let mut distance_m = estimate_m;
    for _ in 0..MAX_MEASUREMENTS {
        place_distractor(cell, index, &slide.pose(distance_m))?;
        let segmentation = cell.wrist_segmentation()?;
        let share = 1.0 - num_pixels(cell, &segmentation, body) as f64 / uncovered;
        if (share - wanted).abs() <= SHARE_TOLERANCE {
            return Ok(Some((distance_m, share)));
        }
        if share > wanted {
            near_m = distance_m;
            // The steps are small, because the estimate is usually close.
            distance_m = (distance_m + FIRST_STEP_M).min(0.5 * (distance_m + far_m));
        } else {
            far_m = distance_m;
            distance_m = (distance_m - FIRST_STEP_M).max(0.5 * (near_m + distance_m));
        }
    }
    Ok(None)
}
