//! `[[obstacle]]` of a workcell file.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use sdg_kinematics::collision::{Obstacle, Shape};
use serde::Deserialize;
use toml::Spanned;

use super::error::WorkcellError;
use super::source::{MAX_REACH_MM, METRES, Numbers, Source};
use crate::surroundings::TABLE;

/// Smallest and largest length of an obstacle, mm.
const SIZES_MM: [f64; 2] = [1.0, 5000.0];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObstacleSection {
    name: Spanned<String>,
    at_mm: Spanned<Numbers<3>>,
    box_mm: Option<Spanned<Numbers<3>>>,
    cylinder_mm: Option<Spanned<Numbers<2>>>,
    capsule_mm: Option<Spanned<Numbers<2>>>,
    plane_normal: Option<Spanned<Numbers<3>>>,
    rpy_deg: Option<Spanned<Numbers<3>>>,
}

pub(super) fn obstacles(
    source: &Source<'_>,
    sections: &[Spanned<ObstacleSection>],
) -> Result<Vec<Obstacle>, WorkcellError> {
    let mut obstacles: Vec<Obstacle> = Vec::with_capacity(sections.len());
    for section in sections {
        let obstacle = obstacle(source, section)?;
        if obstacle.name == TABLE || obstacles.iter().any(|other| other.name == obstacle.name) {
            let name = &section.get_ref().name;
            return Err(source.expected(name, "name", "a unique name", format!("a second \"{}\"", obstacle.name)));
        }
        obstacles.push(obstacle);
    }
    Ok(obstacles)
}

fn obstacle(source: &Source<'_>, section: &Spanned<ObstacleSection>) -> Result<Obstacle, WorkcellError> {
    let ObstacleSection { name, at_mm, box_mm, cylinder_mm, capsule_mm, plane_normal, rpy_deg } = section.get_ref();
    let Numbers(at) = *at_mm.get_ref();
    if !at.iter().all(|value| value.abs() <= 2.0 * MAX_REACH_MM) {
        let expected = format!("numbers within {} mm of the base", 2.0 * MAX_REACH_MM);
        return Err(source.expected(at_mm, "at_mm", &expected, format!("{at:?}")));
    }
    // Within reach as metres; as millimetres, the obstacle would stand in the robot's base.
    if at[..2] != [0.0; 2] && at.iter().all(|value| value.abs() <= 2e-3 * MAX_REACH_MM) {
        return Err(source.expected(at_mm, "at_mm", "numbers in mm", format!("{at:?}{METRES}")));
    }
    let turn = match rpy_deg {
        None => UnitQuaternion::identity(),
        Some(rpy) => {
            let Numbers([roll, pitch, yaw]) = *rpy.get_ref();
            if ![roll, pitch, yaw].iter().all(|angle| angle.abs() <= 360.0) {
                let found = format!("{:?}", rpy.get_ref().0);
                return Err(source.expected(rpy, "rpy_deg", "angles from -360 to 360", found));
            }
            UnitQuaternion::from_euler_angles(roll.to_radians(), pitch.to_radians(), yaw.to_radians())
        }
    };
    let (shape, turn) = match (box_mm, cylinder_mm, capsule_mm, plane_normal) {
        (Some(sides), None, None, None) => {
            sizes(source, sides, "box_mm")?;
            (Shape::Box { half_m: sides.get_ref().0.map(|side| side * 0.5e-3) }, turn)
        }
        (None, Some(size), None, None) => {
            sizes(source, size, "cylinder_mm")?;
            let Numbers([diameter, length]) = *size.get_ref();
            (Shape::Cylinder { radius_m: diameter * 0.5e-3, half_length_m: length * 0.5e-3 }, turn)
        }
        (None, None, Some(size), None) => {
            sizes(source, size, "capsule_mm")?;
            let Numbers([diameter, length]) = *size.get_ref();
            if length < diameter {
                let expected = "[diameter, length over all], the length at least the diameter";
                return Err(source.expected(size, "capsule_mm", expected, format!("[{diameter}, {length}]")));
            }
            (Shape::Capsule { radius_m: diameter * 0.5e-3, half_length_m: (length - diameter) * 0.5e-3 }, turn)
        }
        (None, None, None, Some(normal)) => {
            let direction = Unit::try_new(Vector3::from(normal.get_ref().0), 1e-9)
                // A length that is not finite makes a direction of zeros or NaN.
                .filter(|direction| (direction.norm() - 1.0).abs() < 1e-6);
            let Some(direction) = direction else {
                let found = format!("{:?}", normal.get_ref().0);
                return Err(source.expected(normal, "plane_normal", "a direction that points out of the solid", found));
            };
            if let Some(rpy) = rpy_deg {
                return Err(source.error(rpy.span().start, "rpy_deg: expected with box, cylinder and capsule only"));
            }
            let onto = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &direction);
            // For a normal along -z the rotation is ambiguous, and any such rotation is valid.
            let half_turn = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            (Shape::Plane, onto.unwrap_or_else(half_turn))
        }
        _ => {
            let expected =
                "obstacle: expected one of box_mm, cylinder_mm, capsule_mm and plane_normal, found none or several";
            return Err(source.error(section.span().start, expected));
        }
    };
    let base_from_obstacle = Isometry3::from_parts(Translation3::from(Vector3::from(at) * 1e-3), turn);
    Ok(Obstacle { name: name.get_ref().clone(), shape, base_from_obstacle })
}

fn sizes<const N: usize>(source: &Source<'_>, found: &Spanned<Numbers<N>>, name: &str) -> Result<(), WorkcellError> {
    let [min, max] = SIZES_MM;
    if found.get_ref().0.iter().all(|size| (min..=max).contains(size)) {
        return Ok(());
    }
    let expected = format!("lengths from {min} to {max} mm");
    Err(source.expected(found, name, &expected, format!("{:?}", found.get_ref().0)))
}
