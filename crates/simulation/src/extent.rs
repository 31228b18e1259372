//! The lowest point of a body.

use nalgebra::Vector3;
use sdg_mujoco_sys as mj;

use crate::data::Data;
use crate::model::{Body, Geom, Id};

/// Height of the lowest point of a body's solid shapes in the world, in metres.
///
/// Solid shapes are those that can have contacts; shapes that are only visible do not count. For a body without solid
/// shapes, this is the height of its origin.
pub fn lowest_point_m(data: &Data, body: Id<Body>) -> f64 {
    let model = data.model();
    let raw = model.raw();
    model
        .ids::<Geom>()
        .filter(|&geom| model.body_of(geom) == body)
        .filter(|geom| {
            // SAFETY: both arrays have `ngeom` entries.
            unsafe { *raw.geom_contype.add(geom.index()) != 0 || *raw.geom_conaffinity.add(geom.index()) != 0 }
        })
        .map(|geom| {
            let pose = data.world_from_geom(geom);
            // The downward direction in the geom's frame.
            let down = pose.rotation.inverse() * -Vector3::z();
            pose.translation.z - reach(raw, geom.index(), &down)
        })
        .reduce(f64::min)
        .unwrap_or_else(|| data.world_from_body(body).translation.z)
}

/// The extent of a geom from its centre in a direction of its own frame (its support function).
fn reach(raw: &mj::mjModel, geom: usize, direction: &Vector3<f64>) -> f64 {
    // SAFETY: `geom_type` and `geom_dataid` have `ngeom` entries, `geom_size` three times as many.
    let (kind, size, mesh) = unsafe {
        (*raw.geom_type.add(geom) as u32, *raw.geom_size.add(3 * geom).cast::<[f64; 3]>(), *raw.geom_dataid.add(geom))
    };
    let across = direction.x.hypot(direction.y);
    match kind {
        mj::mjGEOM_SPHERE => size[0],
        mj::mjGEOM_CAPSULE => size[0] + size[1] * direction.z.abs(),
        mj::mjGEOM_CYLINDER => size[0] * across + size[1] * direction.z.abs(),
        mj::mjGEOM_BOX => direction.abs().dot(&Vector3::from(size)),
        mj::mjGEOM_ELLIPSOID => direction.component_mul(&Vector3::from(size)).norm(),
        mj::mjGEOM_MESH if mesh >= 0 => {
            // SAFETY: the mesh's vertices are `mesh_vertnum` triples from `mesh_vertadr` on.
            let vertices = unsafe {
                let first = *raw.mesh_vertadr.add(mesh as usize) as usize;
                let count = *raw.mesh_vertnum.add(mesh as usize) as usize;
                std::slice::from_raw_parts(raw.mesh_vert.add(3 * first), 3 * count)
            };
            vertices
                .chunks_exact(3)
                .map(|v| direction.x * f64::from(v[0]) + direction.y * f64::from(v[1]) + direction.z * f64::from(v[2]))
                .fold(0.0, f64::max)
        }
        // No part contains a plane or a height field.
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::model::Model;

    fn lowest(geom: &str) -> f64 {
        let xml = format!(
            "<mujoco><compiler angle='degree'/><worldbody><body name='b' pos='0 0 1'>{geom}</body></worldbody></mujoco>"
        );
        let data = Data::new(Arc::new(Model::from_xml(&xml, &[]).unwrap())).unwrap();
        lowest_point_m(&data, data.model().id("b").unwrap())
    }

    #[test]
    fn solids_reach_as_low_as_geometry_says() {
        let half = 0.5_f64.sqrt();
        for (geom, expected) in [
            ("<geom type='sphere' size='.1' pos='0 0 .2'/>", 1.1),
            ("<geom type='box' size='.1 .2 .3' euler='45 0 0'/>", 1.0 - 0.5 * half),
            ("<geom type='cylinder' size='.1 .2' euler='90 0 0'/>", 0.9),
            ("<geom type='capsule' size='.1 .2' euler='45 0 0'/>", 1.0 - 0.1 - 0.2 * half),
            ("<geom type='ellipsoid' size='.1 .2 .3' euler='90 0 0'/>", 0.8),
            ("<geom type='sphere' size='.3' contype='0' conaffinity='0'/><geom type='sphere' size='.1'/>", 0.9),
            ("", 1.0),
        ] {
            assert!((lowest(geom) - expected).abs() < 1e-9, "{geom}: {} is not {expected}", lowest(geom));
        }
    }

    /// Tests that every visible shape of the arm is inside one wide capsule of its link. Links whose capsules do not
    /// touch therefore do not touch either.
    #[test]
    fn the_capsules_of_the_robot_hold_the_simulated_arm() {
        use crate::panda::{FINGER_TRAVEL_M, PandaIds, panda_asset};
        use sdg_kinematics::ArmGeometry;
        use sdg_kinematics::collision::Capsule;

        // Directions on a spiral over the sphere, about three degrees apart.
        let directions: Vec<Vector3<f64>> = (0..4000)
            .map(|i| {
                let z = 1.0 - (2 * i + 1) as f64 / 4000.0;
                let around = f64::from(i) * 2.399_963_229_728_653;
                Vector3::new((1.0 - z * z).sqrt() * around.cos(), (1.0 - z * z).sqrt() * around.sin(), z)
            })
            .collect();
        let xml = "<mujoco><compiler angle='radian'/><include file='panda.xml'/></mujoco>";
        let model = Arc::new(Model::from_xml(xml, &[panda_asset()]).unwrap());
        let ids = PandaIds::find(&model).unwrap();
        let mut data = Data::new(model.clone()).unwrap();
        let arm = ArmGeometry::panda();
        let mut num_held = 0;
        for finger_m in [0.0, FINGER_TRAVEL_M] {
            ids.set_finger_position_m(&mut data, finger_m);
            data.forward().unwrap();
            for geom in model.ids::<Geom>() {
                // SAFETY: the array has `ngeom` entries.
                let is_seen = unsafe { *model.raw().geom_contype.add(geom.index()) == 0 };
                let name = model.name(model.body_of(geom)).unwrap();
                if !is_seen {
                    continue;
                }
                let body = match name.strip_prefix("link") {
                    Some(number) => number.parse().unwrap(),
                    None => 8,
                };
                let frame: Id<Body> = model.id(if body == 8 { "hand" } else { &name }).unwrap();
                let link_from_geom = data.world_from_body(frame).inverse() * data.world_from_geom(geom);
                let is_held = |capsule: &Capsule| {
                    directions.iter().all(|direction| {
                        let along = |point: &nalgebra::Point3<f64>| point.coords.dot(direction);
                        let own = link_from_geom.translation.vector.dot(direction)
                            + reach(model.raw(), geom.index(), &(link_from_geom.rotation.inverse() * direction));
                        own <= along(&capsule.from).max(along(&capsule.to)) + capsule.radius_m
                    })
                };
                let capsules = if body == 8 { &arm.hand.wide_capsules } else { &arm.wide_capsules[body] };
                assert!(capsules.iter().any(is_held), "geom {} of {name} sticks out", geom.index());
                num_held += 1;
            }
        }
        assert!(num_held > 100, "{num_held} shapes were examined");
    }

    /// Tests the fit of the planner's capsules: they contain the visible shapes of a link (except the foot's
    /// underside), and extend beyond the link's visible and collision shapes by at most a given distance.
    #[test]
    fn the_capsules_of_the_planner_fit_the_simulated_arm() {
        use crate::panda::{PandaIds, panda_asset};
        use nalgebra::Point3;
        use sdg_kinematics::collision::{Body as ArmBody, Capsule, CollisionModel};

        /// Largest distance by which capsules extend beyond shapes: the ends of joints are flat, those of capsules
        /// round.
        const MAX_EXCESS_M: f64 = 0.045;
        /// Error of the surface points: they are computed from directions two degrees apart, which moves points on
        /// large flat faces outwards.
        const ROUNDING_M: f64 = 0.0015;
        const OPENING_M: f64 = 0.05;
        let directions = |count: usize| -> Vec<Vector3<f64>> {
            (0..count)
                .map(|i| {
                    let z = 1.0 - (2 * i + 1) as f64 / count as f64;
                    let around = i as f64 * 2.399_963_229_728_653;
                    Vector3::new((1.0 - z * z).sqrt() * around.cos(), (1.0 - z * z).sqrt() * around.sin(), z)
                })
                .collect()
        };
        let (mut normals, rays) = (directions(8000), directions(500));
        normals.extend([Vector3::x(), Vector3::y(), Vector3::z()].iter().flat_map(|axis| [*axis, -axis]));
        let xml = "<mujoco><compiler angle='radian'/><include file='panda.xml'/></mujoco>";
        let model = Arc::new(Model::from_xml(xml, &[panda_asset()]).unwrap());
        let ids = PandaIds::find(&model).unwrap();
        let mut data = Data::new(model.clone()).unwrap();
        ids.set_finger_position_m(&mut data, 0.5 * OPENING_M);
        data.forward().unwrap();
        let planner = CollisionModel::new(&sdg_kinematics::ArmGeometry::panda(), Vec::new(), OPENING_M).unwrap();
        /// A geom: a point inside it, its extent from this point along each normal, and whether it is visible.
        type Solid = (Point3<f64>, Vec<f64>, bool);
        // The solids of each body.
        let mut solids: Vec<Vec<Solid>> = vec![Vec::new(); 9];
        for geom in model.ids::<Geom>() {
            // SAFETY: the array has `ngeom` entries.
            let is_seen = unsafe { *model.raw().geom_contype.add(geom.index()) == 0 };
            let name = model.name(model.body_of(geom)).unwrap();
            let (body, frame) = match name.strip_prefix("link") {
                Some(number) => (number.parse().unwrap(), name.as_str()),
                None => (8, "link7"),
            };
            let body_from_geom = data.world_from_body(model.id(frame).unwrap()).inverse() * data.world_from_geom(geom);
            let support = normals
                .iter()
                .map(|n| reach(model.raw(), geom.index(), &(body_from_geom.rotation.inverse() * n)))
                .collect();
            solids[body].push((Point3::from(body_from_geom.translation.vector), support, is_seen));
        }
        let mut is_fit = true;
        for (body, geoms) in solids.iter().enumerate() {
            let arm_body = match body {
                0 => ArmBody::BASE,
                8 => ArmBody::HAND,
                link => ArmBody::link(link),
            };
            let capsules = planner.capsules(arm_body);
            let to_capsules = |p: &Point3<f64>| {
                let ball = Capsule { from: *p, to: *p, radius_m: 0.0 };
                capsules.iter().map(|capsule| capsule.distance_m(&ball)).fold(f64::INFINITY, f64::min)
            };
            let mut uncovered_m = f64::NEG_INFINITY;
            for (centre, support, _) in geoms.iter().filter(|(_, _, is_seen)| *is_seen) {
                for ray in &rays {
                    let to_surface = normals
                        .iter()
                        .zip(support)
                        .filter(|(n, _)| n.dot(ray) > 1e-3)
                        .map(|(n, h)| h / n.dot(ray))
                        .fold(f64::INFINITY, f64::min);
                    let p = centre + ray * to_surface;
                    // The underside of the foot, which is on the table, need not be covered.
                    if body > 0 || p.z > 0.02 {
                        uncovered_m = uncovered_m.max(to_capsules(&p));
                    }
                }
            }
            let to_geoms = |p: &Point3<f64>| {
                let to_geom = |(centre, support, _): &(Point3<f64>, Vec<f64>, bool)| {
                    let from_centre = p - centre;
                    normals.iter().zip(support).map(|(n, h)| n.dot(&from_centre) - h).fold(f64::NEG_INFINITY, f64::max)
                };
                geoms.iter().map(to_geom).fold(f64::INFINITY, f64::min)
            };
            let mut excess_m: f64 = 0.0;
            for capsule in capsules {
                for end in [capsule.from, capsule.to, capsule.middle()] {
                    for ray in rays.iter().step_by(3) {
                        let p = end + ray * capsule.radius_m;
                        if to_capsules(&p) > -1e-9 {
                            excess_m = excess_m.max(to_geoms(&p));
                        }
                    }
                }
            }
            let (uncovered_mm, excess_mm) = (uncovered_m * 1e3, excess_m * 1e3);
            println!("{arm_body}: shapes stand out by {uncovered_mm:.1} mm, capsules by {excess_mm:.1} mm");
            is_fit &= uncovered_m <= ROUNDING_M && excess_m <= MAX_EXCESS_M;
        }
        assert!(is_fit, "at most {ROUNDING_M} m uncovered and {MAX_EXCESS_M} m of excess are expected");
    }
}
