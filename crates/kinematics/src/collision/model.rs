//! The arm and the obstacles around it: the pairs of bodies that may not touch, and their distances.

use nalgebra::{Isometry3, Point3};

use super::arm_shape::{ArmShape, Body, FIRST_MOVING, NUM_BODIES, base_from_body};
use super::error::CollisionError;
use super::lanes::ToLocal;
use super::shape::Shape;
use crate::capsule::Capsule;
use crate::check::check_pose;
use crate::geometry::{ArmGeometry, Frames};
use crate::joints::{JointVector, NUM_JOINTS};

/// A fixed solid in the base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Name in messages.
    pub name: String,
    /// Shape, in the obstacle's own frame.
    pub shape: Shape,
    /// Pose in the base frame.
    pub base_from_obstacle: Isometry3<f64>,
}

/// Two bodies that are close to each other, and their distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Proximity {
    /// The body of the arm.
    pub body: Body,
    /// Name of the obstacle or of the other body.
    pub other: String,
    /// Distance between the surfaces plus the allowed overlap, m; negative if they overlap more deeply.
    pub distance_m: f64,
    /// Derivative of the distance with respect to each joint, m/rad. The derivative is not unique if a capsule's axis
    /// is inside an obstacle or parallel to the nearest surface.
    pub gradient: JointVector,
}

impl std::fmt::Display for Proximity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mm = self.distance_m * 1e3;
        if mm < 0.0 {
            write!(f, "{} is {:.0} mm inside {}", self.body, -mm, self.other)
        } else {
            write!(f, "{} is {mm:.0} mm from {}", self.body, self.other)
        }
    }
}

/// The arm's shape, the obstacles around it, and the pairs that may not touch.
#[derive(Debug, Clone)]
pub struct CollisionModel {
    pub(super) geometry: ArmGeometry,
    pub(super) arm: ArmShape,
    pub(super) obstacles: Vec<Obstacle>,
    pub(super) obstacle_frames: Vec<ToLocal>,
    /// `allowed_overlap_m[body][obstacle]`: length that is added to the distance, m; infinite if contact is allowed.
    pub(super) allowed_overlap_m: [Vec<f64>; NUM_BODIES],
}

impl CollisionModel {
    /// The model of an arm among obstacles, with the fingers at an opening (m).
    ///
    /// The base is not compared with obstacles, because it is fixed to an obstacle, such as the table.
    ///
    /// # Errors
    /// [`CollisionError`] for impossible lengths and poses, for duplicate names, and for an opening outside the hand's
    /// range.
    pub fn new(arm: &ArmGeometry, obstacles: Vec<Obstacle>, opening_m: f64) -> Result<Self, CollisionError> {
        for (index, obstacle) in obstacles.iter().enumerate() {
            check_obstacle(obstacle)?;
            if obstacles[..index].iter().any(|other| other.name == obstacle.name) {
                return Err(CollisionError::NameTwice { name: obstacle.name.clone() });
            }
        }
        if !(0.0..=arm.hand.opening_max_m).contains(&opening_m) {
            return Err(CollisionError::Size {
                obstacle: "the hand".to_owned(),
                what: "opening",
                expected: "from 0 to the maximum opening of the hand",
                found: opening_m,
            });
        }
        let obstacle_frames = obstacles.iter().map(|obstacle| to_local(&obstacle.base_from_obstacle)).collect();
        let allowed_overlap_m = std::array::from_fn(|_| vec![0.0; obstacles.len()]);
        let (geometry, arm) = (arm.clone(), ArmShape::new(arm, opening_m));
        Ok(Self { geometry, arm, obstacles, obstacle_frames, allowed_overlap_m })
    }

    /// Sets the held part: capsules that contain it, in the tcp's frame. The part may touch the hand and links 6 and 7.
    ///
    /// # Errors
    /// [`CollisionError`] for coordinates that are not finite, and for radii that are not positive or exceed 100 m.
    pub fn hold(&mut self, part_in_tcp: &[Capsule]) -> Result<(), CollisionError> {
        let name = || "the held part".to_owned();
        for capsule in part_in_tcp {
            check_length(&name(), "radius_m", capsule.radius_m)?;
            if ![capsule.from, capsule.to].iter().all(|end| end.coords.iter().all(|x| x.is_finite())) {
                let reason = format!("ends must be finite numbers, found {} and {}", capsule.from, capsule.to);
                return Err(CollisionError::Pose { obstacle: name(), reason });
            }
        }
        self.arm.hold(part_in_tcp);
        Ok(())
    }

    /// Allows a body to touch an obstacle, for example the fingers to touch the table during an approach.
    ///
    /// # Errors
    /// [`CollisionError::UnknownObstacle`].
    pub fn allow(&mut self, body: Body, obstacle: &str) -> Result<(), CollisionError> {
        match self.obstacles.iter().position(|candidate| candidate.name == obstacle) {
            Some(index) => {
                self.allowed_overlap_m[body.index()][index] = f64::INFINITY;
                Ok(())
            }
            None => {
                let existing = self.obstacles.iter().map(|obstacle| obstacle.name.as_str()).collect::<Vec<_>>();
                let existing = if existing.is_empty() { "none".to_owned() } else { existing.join(", ") };
                Err(CollisionError::UnknownObstacle { name: obstacle.to_owned(), existing })
            }
        }
    }

    /// Allows a body to overlap the obstacles that are nearer than `min_distance_m` at a configuration, each only so
    /// deeply that the distance there counts as `min_distance_m`.
    ///
    /// For a body whose capsules are larger than the body: an obstacle inside them does not touch it, and is kept about
    /// as far away as at this configuration.
    pub fn allow_overlaps_at(&mut self, body: Body, q: &JointVector, min_distance_m: f64) {
        let base_from_body = base_from_body(&self.geometry.frames(q), body.index());
        let placed: Vec<Capsule> = self.capsules(body).iter().map(|capsule| capsule.moved(&base_from_body)).collect();
        for (obstacle, allowed_m) in self.obstacles.iter().zip(&mut self.allowed_overlap_m[body.index()]) {
            let distances_m = placed.iter().map(|capsule| nearest_on_axis(obstacle, capsule).1);
            *allowed_m = allowed_m.max(min_distance_m - distances_m.fold(f64::INFINITY, f64::min));
        }
    }

    /// The geometry of the arm, which does not contain the opening of the fingers.
    pub fn arm(&self) -> &ArmGeometry {
        &self.geometry
    }

    /// The obstacles, in the given order.
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// The capsules of a body: in the base frame for the base, in the link's frame for a link, in link 7's frame for
    /// the hand and the held part.
    pub fn capsules(&self, body: Body) -> &[Capsule] {
        &self.arm.capsules[body.index()]
    }

    /// The two closest bodies, with the gradient of their distance.
    ///
    /// Computed pair by pair and without bounding spheres, which is slow; tests of [`super::Checker`] use it as the
    /// reference.
    pub fn nearest(&self, q: &JointVector) -> Proximity {
        let frames = self.geometry.frames(q);
        let placed: [Vec<Capsule>; NUM_BODIES] = std::array::from_fn(|body| {
            let base_from_body = base_from_body(&frames, body);
            self.arm.capsules[body].iter().map(|capsule| capsule.moved(&base_from_body)).collect()
        });
        let mut nearest = Proximity {
            body: Body::BASE,
            other: "anything".to_owned(),
            distance_m: f64::INFINITY,
            gradient: JointVector::zeros(),
        };
        for &(one, other) in &self.geometry.self_pairs {
            for a in &placed[one] {
                for b in &placed[other] {
                    let (p, q) = a.nearest_points(b);
                    let distance_m = (q - p).norm() - a.radius_m - b.radius_m;
                    if distance_m < nearest.distance_m {
                        let normal = (q - p).try_normalize(0.0).unwrap_or_else(nalgebra::Vector3::x);
                        // The distance of the surfaces changes like that of the axes, because the radii are constant.
                        let gradient =
                            moved_along(&frames, other, &q, &normal) - moved_along(&frames, one, &p, &normal);
                        let other_name = Body::of_index(one).to_string();
                        nearest = Proximity { body: Body::of_index(other), other: other_name, distance_m, gradient };
                    }
                }
            }
        }
        for (body, capsules) in placed.iter().enumerate().skip(FIRST_MOVING) {
            for (index, obstacle) in self.obstacles.iter().enumerate() {
                for capsule in capsules {
                    let (local, distance_m) = nearest_on_axis(obstacle, capsule);
                    let distance_m = distance_m + self.allowed_overlap_m[body][index];
                    if distance_m < nearest.distance_m {
                        let normal = obstacle.base_from_obstacle * obstacle.shape.outward_normal(&local);
                        let gradient = moved_along(&frames, body, &(obstacle.base_from_obstacle * local), &normal);
                        nearest = Proximity {
                            body: Body::of_index(body),
                            other: obstacle.name.clone(),
                            distance_m,
                            gradient,
                        };
                    }
                }
            }
        }
        nearest
    }

    /// The obstacle with the deepest overlap with the arm's column, if any, and the depth (m). The column is the part
    /// of link 1 around joint 1's axis, which no motion moves.
    pub fn overlap_with_column(&self) -> Option<(String, f64)> {
        let column = self.arm.capsules[1][0].moved(&Isometry3::translation(0.0, 0.0, self.geometry.joints[0].d_m));
        let mut deepest: Option<(String, f64)> = None;
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let depth_m = -(nearest_on_axis(obstacle, &column).1 + self.allowed_overlap_m[1][index]);
            if depth_m > deepest.as_ref().map_or(0.0, |deepest| deepest.1) {
                deepest = Some((obstacle.name.clone(), depth_m));
            }
        }
        deepest
    }
}

/// The point on the axis of a capsule (base frame) that is nearest to an obstacle, in the obstacle's frame, and the
/// distance of the surfaces, m.
fn nearest_on_axis(obstacle: &Obstacle, capsule: &Capsule) -> (Point3<f64>, f64) {
    let obstacle_from_base = obstacle.base_from_obstacle.inverse();
    let [from, to] = [capsule.from, capsule.to].map(|end| obstacle_from_base * end);
    let (share, distance_m) = obstacle.shape.nearest_on_segment(&from, &to);
    (from + (to - from) * share, distance_m - capsule.radius_m)
}

/// Derivative of a body point's position along a direction with respect to each joint, m/rad.
fn moved_along(frames: &Frames, body: usize, point: &Point3<f64>, direction: &nalgebra::Vector3<f64>) -> JointVector {
    JointVector::from_fn(|joint_idx, _| {
        if joint_idx >= body.min(NUM_JOINTS) {
            return 0.0;
        }
        let base_from_link = &frames.base_from_link[joint_idx];
        let axis = base_from_link.rotation * nalgebra::Vector3::z();
        axis.cross(&(point.coords - base_from_link.translation.vector)).dot(direction)
    })
}

fn to_local(base_from_obstacle: &Isometry3<f64>) -> ToLocal {
    let rotation = base_from_obstacle.rotation.inverse().to_rotation_matrix();
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)]));
    ToLocal { rows, origin: base_from_obstacle.translation.vector.into() }
}

fn check_obstacle(obstacle: &Obstacle) -> Result<(), CollisionError> {
    let name = &obstacle.name;
    check_pose("the pose", &obstacle.base_from_obstacle)
        .map_err(|error| CollisionError::Pose { obstacle: name.clone(), reason: error.to_string() })?;
    match obstacle.shape {
        Shape::Plane => Ok(()),
        Shape::Box { half_m } => half_m.iter().try_for_each(|&half| check_length(name, "half_m", half)),
        Shape::Cylinder { radius_m, half_length_m } => {
            check_length(name, "radius_m", radius_m)?;
            check_length(name, "half_length_m", half_length_m)
        }
        Shape::Capsule { radius_m, half_length_m } => {
            check_length(name, "radius_m", radius_m)?;
            // A sphere has no length.
            if half_length_m == 0.0 { Ok(()) } else { check_length(name, "half_length_m", half_length_m) }
        }
    }
}

fn check_length(obstacle: &str, what: &'static str, found: f64) -> Result<(), CollisionError> {
    const MAX_M: f64 = 100.0;
    if found > 0.0 && found <= MAX_M {
        return Ok(());
    }
    let expected = "a positive number of metres, at most 100";
    Err(CollisionError::Size { obstacle: obstacle.to_owned(), what, expected, found })
}
