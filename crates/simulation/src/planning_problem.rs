//! Random planning problems: a start and a goal among obstacles.

use nalgebra::Isometry3;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::collision::{Checker, CollisionModel, Obstacle, Shape};
use sdg_kinematics::planning::PlanOptions;
use sdg_kinematics::{ArmGeometry, HAND_OPENING_MAX_M, JointLimits, JointVector};

use crate::obstacles::random_obstacles;

/// A free start and a free goal among random obstacles.
#[derive(Debug, Clone)]
pub struct PlanningProblem {
    /// The obstacles: one to eight, and in an obstructed problem up to [`Self::MAX_ADDED`] more.
    pub obstacles: Vec<Obstacle>,
    /// The collision model of arm and obstacles, with the hand open.
    pub model: CollisionModel,
    /// The start configuration, rad.
    pub start: JointVector,
    /// The goal pose of the tcp, m.
    pub base_from_goal: Isometry3<f64>,
    /// A free configuration that reaches the goal, rad.
    pub goal: JointVector,
}

impl PlanningProblem {
    /// Minimum distance of start and goal from all obstacles, m: larger than the planners' margin.
    const FREE_M: f64 = 0.01;
    /// Maximum number of obstacles that are added to a problem.
    const MAX_ADDED: usize = 4;
    /// Radius of the added obstacles, m.
    const BALL_RADIUS_M: f64 = 0.08;
    /// Minimum distance of start and goal from the joints' limits, rad.
    const INSIDE_RAD: f64 = 0.05;

    /// The problem of a seed; the same seed gives the same problem. Start and goal are sampled from nearly the
    /// joints' full ranges.
    pub fn random(seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let obstacles = random_obstacles(rng.random_range(1..=8), rng.random());
        let model = CollisionModel::new(&ArmGeometry::panda(), obstacles.clone(), HAND_OPENING_MAX_M)
            .expect("random obstacles are valid");
        let limits = JointLimits::panda();
        let mut checker = Checker::new(&model, Self::FREE_M);
        let mut free = || loop {
            let q = JointVector::from_fn(|i, _| {
                rng.random_range(limits.position_min[i] + Self::INSIDE_RAD..limits.position_max[i] - Self::INSIDE_RAD)
            });
            if checker.is_free(&q) {
                return q;
            }
        };
        let (start, goal) = (free(), free());
        Self { obstacles, base_from_goal: ArmGeometry::panda().forward(&goal), start, goal, model }
    }

    /// The problem of a seed with up to [`Self::MAX_ADDED`] more obstacles. As long as a straight motion solves the
    /// problem, a ball is added at the midpoint of the tcp's path. Without these balls, a straight motion solves nearly
    /// all random problems.
    pub fn obstructed(seed: u64) -> Self {
        let panda = ArmGeometry::panda();
        let mut problem = Self::random(seed);
        for number in 0..Self::MAX_ADDED {
            let options = PlanOptions::default();
            let plan = panda.plan(&problem.model, &problem.start, &[problem.base_from_goal], None, &options);
            // A problem that needs a curved path, or for which no path is found, is hard enough.
            let Some([from, to]) = plan.ok().and_then(|plan| <[JointVector; 2]>::try_from(plan.waypoints).ok()) else {
                break;
            };
            let middle = panda.forward(&((from + to) * 0.5)).translation;
            let obstacle = Obstacle {
                name: format!("ball {number}"),
                shape: Shape::Capsule { radius_m: Self::BALL_RADIUS_M, half_length_m: 0.0 },
                base_from_obstacle: middle.into(),
            };
            let obstacles: Vec<Obstacle> = problem.obstacles.iter().cloned().chain([obstacle]).collect();
            let Ok(model) = CollisionModel::new(&ArmGeometry::panda(), obstacles.clone(), HAND_OPENING_MAX_M) else {
                break;
            };
            let mut checker = Checker::new(&model, Self::FREE_M);
            if !checker.is_free(&problem.start) || !checker.is_free(&problem.goal) {
                break;
            }
            problem = Self { obstacles, model, ..problem };
        }
        problem
    }
}
