//! How near the arm's links are to each other: the capsules that they touch the world with.

use nalgebra::{Point3, Vector3};

use crate::data::Data;
use crate::model::{Geom, Id, Kind, Model};

/// Bodies of the arm from the base on.
const CHAIN: [&str; 9] = ["link0", "link1", "link2", "link3", "link4", "link5", "link6", "link7", "hand"];
/// MuJoCo's group of the shapes that touch.
const COLLISION_GROUP: i32 = 3;
/// Bodies fewer joints apart share an elbow or the wrist, where their capsules overlap in every posture.
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
    /// Finds them in a model that includes the arm.
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

    /// The smallest distance between two of them that no joint holds together, in metres; negative where they overlap.
    pub(crate) fn distance_m(&self, data: &Data) -> f64 {
        let ends: Vec<[Point3<f64>; 2]> = self
            .0
            .iter()
            .map(|capsule| {
                let pose = data.world_from_geom(capsule.geom);
                let half = pose.rotation * Vector3::z() * capsule.half_length_m;
                let centre = Point3::from(pose.translation.vector);
                [centre - half, centre + half]
            })
            .collect();
        let mut smallest = f64::INFINITY;
        for (index, one) in self.0.iter().enumerate() {
            for (other_index, other) in self.0.iter().enumerate().skip(index + 1) {
                if one.place_in_chain.abs_diff(other.place_in_chain) >= MIN_JOINTS_APART {
                    let between = segment_distance(&ends[index], &ends[other_index]);
                    smallest = smallest.min(between - one.radius_m - other.radius_m);
                }
            }
        }
        smallest
    }
}

/// The distance between two segments.
///
/// Each point is found from the other; where the nearest one lies beyond an end, the end takes its place and the other
/// follows once more.
fn segment_distance(one: &[Point3<f64>; 2], other: &[Point3<f64>; 2]) -> f64 {
    let (along_one, along_other) = (one[1] - one[0], other[1] - other[0]);
    let between = one[0] - other[0];
    let (a, b, c) = (along_one.norm_squared(), along_one.dot(&along_other), along_other.norm_squared());
    let (d, e) = (along_one.dot(&between), along_other.dot(&between));
    let denominator = a * c - b * b;
    // Parallel segments: any point of the first will do.
    let mut share_of_one =
        if denominator > 1e-12 * a * c { ((b * e - c * d) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut share_of_other = 0.0;
    for _ in 0..2 {
        share_of_other = if c > 0.0 { ((b * share_of_one + e) / c).clamp(0.0, 1.0) } else { 0.0 };
        share_of_one = if a > 0.0 { ((b * share_of_other - d) / a).clamp(0.0, 1.0) } else { 0.0 };
    }
    (one[0] + along_one * share_of_one - (other[0] + along_other * share_of_other)).norm()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use sdg_kinematics::{JointVector, ready_pose};

    use super::*;
    use crate::panda::{PANDA_FILE, PandaIds, panda_asset};

    #[test]
    fn segments_are_apart_by_their_nearest_points() {
        let segment = |from: [f64; 3], to: [f64; 3]| [Point3::from(from), Point3::from(to)];
        let x = segment([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        // Crossing each other, parallel, beyond the end, and a point.
        assert!((segment_distance(&x, &segment([0.5, -1.0, 0.2], [0.5, 1.0, 0.2])) - 0.2).abs() < 1e-12);
        assert!((segment_distance(&x, &segment([0.2, 0.3, 0.0], [0.8, 0.3, 0.0])) - 0.3).abs() < 1e-12);
        assert!((segment_distance(&x, &segment([4.0, 4.0, 0.0], [4.0, 8.0, 0.0])) - 5.0).abs() < 1e-12);
        assert!((segment_distance(&x, &segment([1.0, 0.0, 2.0], [1.0, 0.0, 2.0])) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_hand_is_near_the_base_where_the_arm_folds_and_nowhere_in_the_ready_pose() {
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
        // The forearm folded back, the hand turned in to the column.
        let folded = JointVector::from([0.0, 0.4, 0.0, -3.0, 0.0, 1.2, 0.785]);
        assert!(at(folded) < 0.0);
    }
}
