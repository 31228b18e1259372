//! Obstacles of `sdg-kinematics` in MuJoCo, and random ones for testing motions.

use std::fmt::Write;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::collision::{Obstacle, Shape};

use crate::scene::pose_attributes;

/// Prefix of the names of obstacles' geoms: an obstacle may have the name of another geom of the scene.
const GEOM_PREFIX: &str = "obstacle ";

/// Name of the obstacle of a geom. A geom of the scene itself, such as the table, keeps its name.
pub(crate) fn obstacle_of_geom(geom: &str) -> &str {
    geom.strip_prefix(GEOM_PREFIX).unwrap_or(geom)
}

/// Geoms of the world body for obstacles, each named `obstacle NAME`; `attributes` is added to each geom.
pub fn obstacles_mjcf(obstacles: &[Obstacle], attributes: &str) -> String {
    let mut geoms = String::new();
    for obstacle in obstacles {
        let shape = match obstacle.shape {
            Shape::Plane => "type=\"plane\" size=\"2 2 0.1\"".to_owned(),
            Shape::Box { half_m: [x, y, z] } => format!("type=\"box\" size=\"{x} {y} {z}\""),
            Shape::Cylinder { radius_m, half_length_m } => {
                format!("type=\"cylinder\" size=\"{radius_m} {half_length_m}\"")
            }
            Shape::Capsule { radius_m, half_length_m: 0.0 } => format!("type=\"sphere\" size=\"{radius_m}\""),
            Shape::Capsule { radius_m, half_length_m } => {
                format!("type=\"capsule\" size=\"{radius_m} {half_length_m}\"")
            }
        };
        let pose = pose_attributes(&obstacle.base_from_obstacle);
        let name = escaped(&format!("{GEOM_PREFIX}{}", obstacle.name));
        writeln!(geoms, "<geom name=\"{name}\" {shape} {pose} {attributes}/>").expect("a string takes any text");
    }
    geoms
}

/// A name, escaped for an XML attribute.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Minimum distance of an obstacle from the z axis of the base, m, to leave room for the base.
const KEPT_FREE_M: f64 = 0.2;

/// Boxes, cylinders, capsules and spheres at random poses around the base, with widths of 2 to 40 cm and lengths of up
/// to 60 cm; deterministic for a seed.
pub fn random_obstacles(count: usize, seed: u64) -> Vec<Obstacle> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut obstacles = Vec::with_capacity(count);
    while obstacles.len() < count {
        let mut half = || rng.random_range(0.02..0.2);
        let (a, b, c) = (half(), half(), half());
        let (kind, shape, radius_m) = match rng.random_range(0..4) {
            0 => ("box", Shape::Box { half_m: [a, b, c] }, Vector3::new(a, b, c).norm()),
            1 => ("cylinder", Shape::Cylinder { radius_m: 0.5 * a, half_length_m: c }, (0.5 * a).hypot(c)),
            2 => ("capsule", Shape::Capsule { radius_m: 0.5 * a, half_length_m: c }, 0.5 * a + c),
            _ => ("sphere", Shape::Capsule { radius_m: 0.6 * a, half_length_m: 0.0 }, 0.6 * a),
        };
        let at: Vector3<f64> =
            Vector3::new(rng.random_range(-0.8..0.8), rng.random_range(-0.8..0.8), rng.random_range(0.0..1.1));
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| rng.random_range(-2.0..2.0)));
        if at.x.hypot(at.y) < KEPT_FREE_M + radius_m {
            continue;
        }
        let name = format!("{kind} {}", obstacles.len() + 1);
        obstacles.push(Obstacle { name, shape, base_from_obstacle: Isometry3::from_parts(at.into(), turn) });
    }
    obstacles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Geom, Model};

    #[test]
    fn mujoco_reads_every_shape_under_its_name() {
        let mut obstacles = random_obstacles(40, 1);
        obstacles[0].name = "a \"b\" <c> & d".to_owned();
        obstacles[1].shape = Shape::Plane;
        let xml = format!("<mujoco><worldbody>{}</worldbody></mujoco>", obstacles_mjcf(&obstacles, "rgba='1 0 0 1'"));
        let model = Model::from_xml(&xml, &[]).unwrap();
        for obstacle in &obstacles {
            model.id::<Geom>(&format!("{GEOM_PREFIX}{}", obstacle.name)).unwrap();
        }
        assert_eq!(random_obstacles(40, 1)[5], obstacles[5]);
        assert_ne!(random_obstacles(40, 2)[5], obstacles[5]);
    }
}
