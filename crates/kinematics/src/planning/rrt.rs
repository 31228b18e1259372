//! RRT-Connect: a tree from the start and one from all goals grow towards random configurations and towards each other.
//!
//! # Source
//! J. Kuffner, S. LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000.
//! Differences: the goals' tree has several roots, the smaller tree grows, and motions are proven free as a whole
//! ([`Checker`]).

use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::collision::Checker;
use crate::joints::JointVector;
use crate::limits::JointLimits;

/// Step size and limit of a search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Growth {
    /// Maximum length of a motion that is added at once, rad.
    pub(super) step_rad: f64,
    /// Maximum number of checked configurations.
    pub(super) max_checks: usize,
}

/// The region of the random configurations.
///
/// # Source
/// J. Gammell, S. Srinivasa, T. Barfoot, "Informed RRT*: optimal sampling-based path planning focused via direct
/// sampling of an admissible ellipsoidal heuristic", IROS 2014. The cost is the time of the slowest joint, so that
/// boxes replace the ellipsoids.
#[derive(Debug, Clone)]
pub(super) struct Samples(Vec<[JointVector; 2]>);

impl Samples {
    /// The whole range of the joints.
    pub(super) fn everywhere(limits: &JointLimits) -> Self {
        Self(vec![[limits.position_min, limits.position_max]])
    }

    /// Only configurations that can be on a path to one of the goals that takes less than `max_secs` at full speed.
    ///
    /// On such a path, a joint leaves the range between its start and its goal by at most half of its spare travel (the
    /// angle that it can cover in `max_secs`, less the angle between start and goal). Without obstacles, every goal
    /// must be reachable on a straight line within that time.
    pub(super) fn on_quicker_ways(
        limits: &JointLimits,
        start: &JointVector,
        goals: &[JointVector],
        max_secs: f64,
    ) -> Self {
        let range = |goal: &JointVector| {
            let spare = (limits.velocity_max * max_secs - (goal - start).abs()) * 0.5;
            let lowest = (start.inf(goal) - spare).sup(&limits.position_min);
            let highest = (start.sup(goal) + spare).inf(&limits.position_max);
            [lowest, highest]
        };
        Self(goals.iter().map(range).collect())
    }

    fn draw(&self, rng: &mut Pcg64Mcg) -> JointVector {
        let [lowest, highest] = &self.0[rng.random_range(0..self.0.len())];
        JointVector::from_fn(|joint, _| rng.random_range(lowest[joint]..=highest[joint]))
    }
}

/// A path from the start to a goal.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) waypoints: Vec<JointVector>,
    pub(super) goal_idx: usize,
}

/// Configurations at which motions were blocked; some are kept for reporting the cause.
#[derive(Debug, Clone, Default)]
pub(super) struct Stops(Vec<JointVector>);

impl Stops {
    const MAX_KEPT: usize = 400;

    fn push(&mut self, q: JointVector) {
        if self.0.len() < Self::MAX_KEPT {
            self.0.push(q);
        }
    }

    pub(super) fn configurations(&self) -> &[JointVector] {
        &self.0
    }
}

#[derive(Debug)]
struct Tree {
    nodes: Vec<JointVector>,
    /// Parent of each node; a root is its own parent.
    parents: Vec<usize>,
}

impl Tree {
    fn new(roots: &[JointVector]) -> Self {
        Self { nodes: roots.to_vec(), parents: (0..roots.len()).collect() }
    }

    fn add(&mut self, q: JointVector, parent: usize) -> usize {
        self.nodes.push(q);
        self.parents.push(parent);
        self.nodes.len() - 1
    }

    fn nearest(&self, q: &JointVector) -> usize {
        let mut nearest = (0, f64::INFINITY);
        for (node, other) in self.nodes.iter().enumerate() {
            let squared = (other - q).norm_squared();
            if squared < nearest.1 {
                nearest = (node, squared);
            }
        }
        nearest.0
    }

    /// The path from a node to its root, and that root.
    fn way_to_root(&self, mut node: usize) -> (Vec<JointVector>, usize) {
        let mut way = vec![self.nodes[node]];
        while self.parents[node] != node {
            node = self.parents[node];
            way.push(self.nodes[node]);
        }
        (way, node)
    }
}

/// The result of one step towards a configuration.
enum Extension {
    Reached(usize),
    Advanced(usize),
    Stopped,
}

/// Searches for a path from the start to any of the goals, all of which are free; `None` when the checks are used up.
pub(super) fn rrt_connect(
    checker: &mut Checker<'_>,
    samples: &Samples,
    start: &JointVector,
    goals: &[JointVector],
    growth: Growth,
    rng: &mut Pcg64Mcg,
    stops: &mut Stops,
) -> Option<Found> {
    let mut from_start = Tree::new(&[*start]);
    let mut from_goals = Tree::new(goals);
    let last_check = checker.num_checked() + growth.max_checks;
    while checker.num_checked() < last_check {
        let is_start_growing = from_start.nodes.len() <= from_goals.nodes.len();
        let (growing, other) =
            if is_start_growing { (&mut from_start, &mut from_goals) } else { (&mut from_goals, &mut from_start) };
        let towards = samples.draw(rng);
        let nearest = growing.nearest(&towards);
        let (Extension::Reached(new) | Extension::Advanced(new)) =
            extend(checker, growing, nearest, &towards, growth.step_rad, stops)
        else {
            continue;
        };
        let meeting = growing.nodes[new];
        let mut at = other.nearest(&meeting);
        let met = loop {
            match extend(checker, other, at, &meeting, growth.step_rad, stops) {
                Extension::Reached(node) => break Some(node),
                Extension::Advanced(node) => at = node,
                Extension::Stopped => break None,
            }
        };
        if let Some(met) = met {
            let (in_start, in_goals) = if is_start_growing { (new, met) } else { (met, new) };
            let (mut waypoints, _) = from_start.way_to_root(in_start);
            let (rest, goal_idx) = from_goals.way_to_root(in_goals);
            waypoints.reverse();
            // Both paths contain the configuration at which they meet.
            waypoints.extend_from_slice(&rest[1..]);
            return Some(Found { waypoints, goal_idx });
        }
    }
    None
}

fn extend(
    checker: &mut Checker<'_>,
    tree: &mut Tree,
    from: usize,
    towards: &JointVector,
    step_rad: f64,
    stops: &mut Stops,
) -> Extension {
    let start = tree.nodes[from];
    let way = towards - start;
    let length_rad = way.norm();
    let is_last = length_rad <= step_rad;
    let end = if is_last { *towards } else { start + way * (step_rad / length_rad) };
    if let Some(share) = checker.blocked_share(&start, &end) {
        stops.push(start + (end - start) * share);
        return Extension::Stopped;
    }
    let node = tree.add(end, from);
    if is_last { Extension::Reached(node) } else { Extension::Advanced(node) }
}
