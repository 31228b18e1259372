//! Distances between the arm's links, by their collision capsules.

use nalgebra::{Point3, Vector3};
use sdg_kinematics::collision::Capsule;

use crate::data::Data;
use crate::model::{Geom, Id, Kind, Model};

/// Bodies of the arm from the base on.
const CHAIN: [&str; 9] = ["link0", "link1", "link2", "link3", "link4", "link5", "link6", "link7", "hand"];
/// MuJoCo's group of collision shapes.
const COLLISION_GROUP: i32 = 3;
/// Two bodies are compared only if their places in the chain differ by at least this number. The capsules of closer
/// bodies may overlap in every posture, as at the elbow and the wrist.
const MIN_JOINTS_APART: usize = 4;

#[derive(Debug, Clone, Copy)]
struct LinkCapsule {
    place_in_chain: usize,
    geom: Id<Geom>,
    radius_m: f64,
    half_length_m: f64,
}

/// The capsules of the arm's links.
#[derive(Debug, Clone)]
pub(crate) struct LinkCapsules(Vec<LinkCapsule>);

impl LinkCapsules {
    /// Finds the capsules in a model with the arm.
    pub(crate) fn find(model: &Model) -> Self {
        let capsules = (0..Geom::count(model)).map(Id::<Geom>::new).filter_map(|geom| {
            let body = model.name(model.body_of(geom))?;
            let place_in_chain = CHAIN.iter().position(|&name| name == body)?;
            let (radius_m, half_length_m) = model.capsule_m(geom)?;
            let capsule = LinkCapsule { place_in_chain, geom, radius_m, half_length_m };
            model.is_in_group(geom, COLLISION_GROUP).then_some(capsule)
        });
        Self(capsules.collect())
    }

    /// The smallest distance between the capsules of two bodies that are at least [`MIN_JOINTS_APART`] places apart in
    /// the chain, in metres; negative if they overlap.
    pub(crate) fn distance_m(&self, data: &Data) -> f64 {
        let placed: Vec<Capsule> = self
            .0
            .iter()
            .map(|capsule| {
                let pose = data.world_from_geom(capsule.geom);
                let half = pose.rotation * Vector3::z() * capsule.half_length_m;
                let centre = Point3::from(pose.translation.vector);
                Capsule { from: centre - half, to: centre + half, radius_m: capsule.radius_m }
            })
            .collect();
        let mut smallest = f64::INFINITY;
        for (index, one) in self.0.iter().enumerate() {
            for (other_index, other) in self.0.iter().enumerate().skip(index + 1) {
                if one.place_in_chain.abs_diff(other.place_in_chain) >= MIN_JOINTS_APART {
                    smallest = smallest.min(placed[index].distance_m(&placed[other_index]));
                }
            }
        }
        smallest
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use sdg_kinematics::{JointVector, ready_pose};

    use super::*;
    use crate::panda::{PANDA_FILE, PandaIds, panda_asset};

    #[test]
    fn capsules_overlap_in_a_folded_arm_and_are_apart_in_the_ready_pose() {
        let xml = format!("<mujoco><compiler angle='radian'/><include file='{PANDA_FILE}'/></mujoco>");
        let model = Arc::new(Model::from_xml(&xml, &[panda_asset()]).unwrap());
        let ids = PandaIds::find(&model).unwrap();
        let capsules = LinkCapsules::find(&model);
        let mut data = Data::new(model).unwrap();
        let mut at = |q: JointVector| {
            ids.set_position(&mut data, &q);
            data.forward().unwrap();
            capsules.distance_m(&data)
        };
        assert!(at(ready_pose()) > 0.05);
        // The forearm is folded back, and the hand points towards the column.
        let folded = JointVector::from([0.0, 0.4, 0.0, -3.0, 0.0, 1.2, 0.785]);
        assert!(at(folded) < 0.0);
    }
}
