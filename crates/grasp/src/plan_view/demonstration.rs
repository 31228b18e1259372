//! A demonstration in the plan view.

use image::RgbImage;
use nalgebra::Point2;
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{BoundingBox, GraspLine, PlanView, PlanarGrasp, Polygon, PosedCamera};
use sdg_shape::PlanViewMap;

use super::region::RegionInPlanView;
use super::{CameraOverTable, Lengths, plan_view, slant};
use crate::check_config::CheckConfig;
use crate::error::{GraspError, Result};
use crate::region::SearchRegion;
use crate::taught::TaughtDemonstration;

/// Photos and marks in the plan view of the marks' plane, and the lengths of the view. Its resolution is that of the
/// part in the first photo.
///
/// Heights are in metres above the table.
///
/// # Errors
/// No demonstration, a camera whose pictures do not show the plane, marks outside the visible part of the plane, and
/// marks that [`Demonstration::check`] refuses in the plan view.
pub fn seen_from_above(
    demonstrations: &[Demonstration],
    over_table: &CameraOverTable,
    mark_height_m: f64,
    grasp_height_m: f64,
) -> Result<(Vec<Demonstration>, Lengths)> {
    let first = demonstrations.first().ok_or(GraspError::NoDemonstration)?;
    let camera = &over_table.camera;
    let height_m = over_table.table_height_m + mark_height_m;
    let off_plane = |at: Point2<f64>| GraspError::OffPlane { x: at.x, y: at.y, height_m };
    let center = first.annotation.bbox.center();
    let length = camera.metres_per_pixel(&center, height_m).ok_or_else(|| off_plane(center))?;
    let slant_of = |demonstration: &Demonstration| {
        let Annotation { bbox, grasp, .. } = &demonstration.annotation;
        // Edge heights displace the grasp by the slant there. With one photo, the slant is used for stated errors only.
        let several = grasp.as_ref().filter(|_| demonstrations.len() > 1);
        let center = several.map_or(bbox.center(), GraspLine::center);
        let on_plane = camera.at_height(&center, height_m).ok_or_else(|| off_plane(center))?;
        Ok(slant(camera, &on_plane))
    };
    let mut slants = demonstrations.iter().map(slant_of).collect::<Result<Vec<_>>>()?.into_iter();
    let lengths = Lengths {
        pixels_per_m: 1.0 / length,
        mark_height_m,
        grasp_height_m,
        slant: slants.next().ok_or(GraspError::NoDemonstration)?,
        further_slants: slants.collect(),
        edges: None,
    };
    let view = plan_view(over_table, &lengths)?;
    let map = PlanViewMap::new(&over_table.camera, &view);
    let made = demonstrations
        .iter()
        .map(|demonstration| {
            let annotation = annotation(&demonstration.annotation, &over_table.camera, &view)?;
            let made = Demonstration { image: map.resample(&demonstration.image), annotation };
            made.check()?;
            Ok(made)
        })
        .collect::<Result<_>>()?;
    Ok((made, lengths))
}

/// Pictures without the part, in the plan view with these lengths.
///
/// # Errors
/// A camera whose pictures do not show the plane.
pub fn pictures_from_above(
    pictures: &[RgbImage],
    over_table: &CameraOverTable,
    lengths: &Lengths,
) -> Result<Vec<RgbImage>> {
    let map = PlanViewMap::new(&over_table.camera, &plan_view(over_table, lengths)?);
    Ok(pictures.iter().map(|picture| map.resample(picture)).collect())
}

/// Checks that a region of a camera's pictures can be searched for the taught part. The demonstrations are those made
/// by [`super::seen_from_above`].
///
/// # Errors
/// A region that extends beyond the pictures or belongs to pictures of another size, that does not show the plane, or
/// that is too small for the part; a camera whose pictures do not show the plane; demonstrations without a grasp or a
/// shape to compare.
pub fn check_region_from_above(
    region: &SearchRegion,
    demonstrations: &[Demonstration],
    over_table: &CameraOverTable,
    lengths: &Lengths,
) -> Result<()> {
    let view = plan_view(over_table, lengths)?;
    let in_plan = |demonstration: &Demonstration| {
        let mut taught = TaughtDemonstration::new(demonstration)?;
        taught.marks.photo_size = None;
        let mut check = taught.check().clone();
        check.search.scales = CheckConfig::KNOWN_SIZE_TOLERANCE;
        taught.with_check(check)
    };
    let taught = demonstrations.iter().map(in_plan).collect::<Result<Vec<_>>>()?;
    RegionInPlanView::new(region, &over_table.camera, &view)?.window([view.width, view.height], &taught).map(|_| ())
}

fn annotation(marked: &Annotation, camera: &PosedCamera, view: &PlanView) -> Result<Annotation> {
    let shown = |point: &Point2<f64>| {
        let off_plane = || GraspError::OffPlane { x: point.x, y: point.y, height_m: view.height_m };
        view.from_picture(camera, point).ok_or_else(off_plane)
    };
    let outline = match &marked.outline {
        Some(outline) => Some(Polygon { vertices: outline.vertices.iter().map(shown).collect::<Result<_>>()? }),
        None => None,
    };
    let corners = marked.bbox.corners().iter().map(shown).collect::<Result<Vec<_>>>()?;
    let bbox = match &outline {
        Some(outline) => outline.bounds(),
        None => BoundingBox::around(corners).unwrap_or(marked.bbox),
    };
    let grasp = match &marked.grasp {
        Some(line) => Some(GraspLine::new(shown(&line.start)?, shown(&line.end)?)),
        None => None,
    };
    // The jaws lie beside the line, where a tilted camera has another scale than along it.
    let jaw_width = match (marked.jaw_width, &marked.grasp) {
        (Some(width), Some(line)) => {
            let jaws = PlanarGrasp::from_line(line, width).jaws().map(|jaw| view.from_picture(camera, &jaw));
            Some(match (jaws, &grasp) {
                ([Some(one), Some(other)], _) => (one - other).norm(),
                // A jaw beyond the picture may have no position; the scale along the line is then used.
                (_, Some(shown)) => width * shown.length() / line.length(),
                (_, None) => width,
            })
        }
        (width, _) => width,
    };
    Ok(Annotation {
        label: marked.label.clone(),
        bbox: bbox.clip(f64::from(view.width), f64::from(view.height)),
        grasp,
        jaw_width,
        outline,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
    use sdg_geometry::PinholeCamera;
    use std::f64::consts::PI;

    #[test]
    fn a_jaw_width_marked_in_a_tilted_picture_is_a_length_on_the_plane() {
        let tilt = 20f64.to_radians();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI + tilt);
        let camera = PosedCamera {
            intrinsics: PinholeCamera::WRIST,
            world_from_camera: Isometry3::from_parts(Translation3::new(0.0, -0.6 * tilt.sin(), 0.6 * tilt.cos()), turn),
        };
        let view = PlanView::of(&camera, 0.0, 1000.0, None, 6_000_000).unwrap();
        // The line along the slant and across it, with jaws 60 mm apart.
        for along in [[1.0, 0.0], [0.0, 1.0]] {
            let [x, y] = along;
            let seen = |u: f64, v: f64| camera.project(&Point3::new(u * x - v * y, u * y + v * x, 0.0)).unwrap();
            let grasp = GraspLine::new(seen(-0.02, 0.0), seen(0.02, 0.0));
            let marked = Annotation {
                label: "part".to_owned(),
                bbox: BoundingBox::around([seen(-0.03, -0.03), seen(0.03, 0.03)]).unwrap(),
                grasp: Some(grasp),
                jaw_width: Some((seen(0.0, 0.03) - seen(0.0, -0.03)).norm()),
                outline: None,
            };
            let width = annotation(&marked, &camera, &view).unwrap().jaw_width.unwrap();
            assert!((width - 60.0).abs() < 0.6, "{along:?}: {width}");
        }
    }
}
