//! Inverse kinematics: the best configuration that reaches a tcp pose within the joint limits.
//!
//! A Franka has one joint more than a pose needs. For each angle of joint 7 on a grid, [`crate::analytic`] gives every
//! configuration; those inside the limits are compared by the cost of [`IkOptions`], and the best is refined over q7.
//! The search therefore covers all branches of solutions, needs no random restarts and is deterministic. If the grid
//! has no solution, the branches with the smallest limit violations are refined over q7, which finds poses that are
//! reached only in a narrow range of angles. If that also fails, damped least squares within the limits gives the
//! nearest pose, and the error names the reason.
//!
//! An arm without a closed form is solved by damped least squares from a fixed set of many starts. This is slower, and
//! compares only the angles of the redundant joint to which the starts lead.

use nalgebra::Isometry3;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::analytic::{AnalyticSolution, NUM_BRANCHES, analytic_solutions};
use crate::check::{check_joints, check_options, check_pose};
use crate::error::KinematicsError;
use crate::geometry::{ArmGeometry, pose_error};
use crate::ik::{IkOptions, IkSolution};
use crate::joints::JointVector;
use crate::limits::JointLimits;
use crate::nearest::descend;

impl ArmGeometry {
    /// Finds the configuration of lowest cost that reaches `base_from_tcp`; `options` define the cost.
    ///
    /// # Units and frames
    /// `base_from_tcp` in m in the base frame; `seed` in rad, usually the current configuration, which need not be
    /// inside the limits.
    ///
    /// # Errors
    /// [`KinematicsError::OutOfReach`] and [`KinematicsError::JointLimit`] contain the nearest pose;
    /// [`KinematicsError::NotFinite`], [`KinematicsError::NotARotation`] and [`KinematicsError::InvalidOption`] for
    /// invalid input.
    pub fn inverse(
        &self,
        base_from_tcp: &Isometry3<f64>,
        seed: &JointVector,
        options: &IkOptions,
    ) -> Result<IkSolution, KinematicsError> {
        let search = Search::new(self, base_from_tcp, seed, options)?;
        if self.closed_form.is_none() {
            return search.by_descent().map(|mut solutions| solutions.swap_remove(0));
        }
        let mut best: Option<Branch> = None;
        for branch in search.branches() {
            if best.as_ref().is_none_or(|b| branch.cost < b.cost) {
                best = Some(branch);
            }
        }
        best.map(|branch| search.refine(branch)).and_then(|q| search.accept(&q)).map_or_else(|| search.rescue(), Ok)
    }

    /// Finds the best configuration of each branch of the arm (elbow, shoulder, interval of joint 7), best first.
    ///
    /// For a caller with further conditions, such as a straight path that starts at the configuration.
    ///
    /// # Errors
    /// The errors of [`ArmGeometry::inverse`]; the list is never empty.
    pub fn inverse_all(
        &self,
        base_from_tcp: &Isometry3<f64>,
        seed: &JointVector,
        options: &IkOptions,
    ) -> Result<Vec<IkSolution>, KinematicsError> {
        let search = Search::new(self, base_from_tcp, seed, options)?;
        if self.closed_form.is_none() {
            return search.by_descent();
        }
        let mut solutions: Vec<IkSolution> =
            search.branches().into_iter().filter_map(|branch| search.accept(&search.refine(branch))).collect();
        if solutions.is_empty() {
            solutions.push(search.rescue()?);
        }
        solutions.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(solutions)
    }
}

/// The best grid point of one interval of q7 in which a branch stays inside the limits.
#[derive(Debug, Clone, Copy)]
struct Branch {
    branch_idx: usize,
    grid_idx: usize,
    q: JointVector,
    cost: f64,
}

struct Search<'a> {
    arm: &'a ArmGeometry,
    base_from_tcp: &'a Isometry3<f64>,
    base_from_flange: Isometry3<f64>,
    seed: JointVector,
    posture: JointVector,
    limits: JointLimits,
    options: &'a IkOptions,
    /// The angles of joint 7 that are tried, in ascending order.
    grid: Vec<f64>,
}

/// Limit violations up to this size are rounding errors and are clamped, rad.
const LIMIT_ROUNDING_RAD: f64 = 1e-9;
/// Weight of geometric infeasibility relative to radians beyond limits in the search for the smallest violation.
const INFEASIBILITY_RAD: f64 = 10.0;
const NUM_REFINEMENTS: usize = 24;
const NUM_BISECTIONS: usize = 12;
/// Number of branches that are tried if no grid point is feasible.
const NUM_RESCUES: usize = 8;
/// Number of random starts for an arm without a closed form.
const NUM_STARTS: usize = 60;
/// Of configurations closer together than this, only the best is kept, rad.
const MIN_APART_RAD: f64 = 0.1;

impl<'a> Search<'a> {
    fn new(
        arm: &'a ArmGeometry,
        base_from_tcp: &'a Isometry3<f64>,
        seed: &JointVector,
        options: &'a IkOptions,
    ) -> Result<Self, KinematicsError> {
        check_pose("base_from_tcp", base_from_tcp)?;
        check_joints("seed", seed)?;
        check_options(options)?;
        let margin = JointVector::repeat(options.required_margin_rad);
        let mut limits = arm.limits.clone();
        limits.position_min += margin;
        limits.position_max -= margin;
        let posture = options.posture.unwrap_or(arm.ready);
        let (low, high) = (limits.position_min[6], limits.position_max[6]);
        let num = options.num_redundancy_samples;
        let mut grid: Vec<f64> = (0..num)
            .map(|i| low + (high - low) * i as f64 / (num - 1) as f64)
            .chain([seed[6].clamp(low, high), posture[6].clamp(low, high)])
            .collect();
        grid.sort_by(f64::total_cmp);
        Ok(Self {
            arm,
            base_from_tcp,
            base_from_flange: base_from_tcp * arm.flange_from_tcp().inverse(),
            seed: *seed,
            posture,
            limits,
            options,
            grid,
        })
    }

    fn analytic_solutions(&self, q7: f64) -> [Option<AnalyticSolution>; NUM_BRANCHES] {
        analytic_solutions(self.arm, &self.base_from_flange, q7, self.seed[0])
    }

    /// The best grid point of every feasible interval of every branch.
    fn branches(&self) -> Vec<Branch> {
        let mut open: [Option<Branch>; NUM_BRANCHES] = [None; NUM_BRANCHES];
        let mut closed = Vec::new();
        for (grid_idx, q7) in self.grid.iter().enumerate() {
            for (branch_idx, solution) in self.analytic_solutions(*q7).iter().enumerate() {
                match self.feasible_cost(solution) {
                    Some((q, cost)) => {
                        if open[branch_idx].is_none_or(|b| cost < b.cost) {
                            open[branch_idx] = Some(Branch { branch_idx, grid_idx, q, cost });
                        }
                    }
                    None => closed.extend(open[branch_idx].take()),
                }
            }
        }
        closed.extend(open.into_iter().flatten());
        closed
    }

    fn feasible_cost(&self, solution: &Option<AnalyticSolution>) -> Option<(JointVector, f64)> {
        let solution = solution.as_ref()?;
        if solution.infeasibility > 0.0 {
            return None;
        }
        let margins = self.limits.margins(&solution.q);
        (margins.min() >= -LIMIT_ROUNDING_RAD).then(|| (solution.q, self.cost(&solution.q)))
    }

    fn cost(&self, q: &JointVector) -> f64 {
        let options = self.options;
        let crowding: f64 = self
            .limits
            .margins(q)
            .iter()
            .map(|margin| (1.0 - margin / options.comfortable_margin_rad).max(0.0).powi(2))
            .sum();
        options.seed_weight * (q - self.seed).norm_squared()
            + options.posture_weight * (q - self.posture).norm_squared()
            + options.limit_weight * crowding
    }

    /// Minimises a branch's cost over q7 between the neighbouring grid points, where the branch is feasible.
    fn refine(&self, branch: Branch) -> JointVector {
        let cost_at = |q7: f64| {
            self.feasible_cost(&self.analytic_solutions(q7)[branch.branch_idx]).unwrap_or((branch.q, f64::INFINITY))
        };
        let q7 = branch.q[6];
        let (low, high) = self.neighbours(branch.grid_idx);
        let [low, high] = [low, high].map(|end| {
            let (mut feasible, mut end) = (q7, end);
            if cost_at(end).1.is_infinite() {
                for _ in 0..NUM_BISECTIONS {
                    let middle = 0.5 * (feasible + end);
                    if cost_at(middle).1.is_finite() {
                        feasible = middle;
                    } else {
                        end = middle;
                    }
                }
                end = feasible;
            }
            end
        });
        let (q, cost) = golden_section(low, high, cost_at);
        if cost < branch.cost { q } else { branch.q }
    }

    /// The neighbours of a grid point, or the point itself at the ends of the grid.
    fn neighbours(&self, grid_idx: usize) -> (f64, f64) {
        let last = self.grid.len() - 1;
        (self.grid[grid_idx.saturating_sub(1)], self.grid[(grid_idx + 1).min(last)])
    }

    fn solution(&self, q: &JointVector) -> IkSolution {
        let q = self.limits.clamp(q);
        let reached = self.arm.forward(&q);
        let error = pose_error(&reached, self.base_from_tcp);
        IkSolution {
            q,
            base_from_tcp: reached,
            position_residual_m: error.fixed_rows::<3>(0).norm(),
            angle_residual_rad: error.fixed_rows::<3>(3).norm(),
            limit_margin_rad: self.arm.limits.margins(&q).min(),
            cost: self.cost(&q),
        }
    }

    /// The solution at `q` if it is within the tolerances; if necessary, it is refined first, because the closed form
    /// may lose digits.
    fn accept(&self, q: &JointVector) -> Option<IkSolution> {
        let solution = self.solution(q);
        if self.meets(&solution) {
            return Some(solution);
        }
        let polished = self.solution(&self.descend(q));
        self.meets(&polished).then_some(polished)
    }

    fn meets(&self, solution: &IkSolution) -> bool {
        solution.position_residual_m <= self.options.position_tolerance_m
            && solution.angle_residual_rad <= self.options.angle_tolerance_rad
    }

    fn descend(&self, start: &JointVector) -> JointVector {
        let metres_per_rad = self.options.metres_per_rad;
        descend(self.arm, &self.limits, self.base_from_tcp, start, metres_per_rad)
    }

    /// Searches between the grid points, then for the nearest pose and the reason of the failure.
    fn rescue(&self) -> Result<IkSolution, KinematicsError> {
        let mut least_infeasible = self.least_infeasible_solutions();
        least_infeasible.truncate(NUM_RESCUES);
        for solution in &least_infeasible {
            if self.violation(solution) <= LIMIT_ROUNDING_RAD
                && let Some(solution) = self.accept(&solution.q)
            {
                return Ok(solution);
            }
        }

        let starts = least_infeasible.iter().map(|c| c.q).chain([self.seed, self.posture]);
        let nearest = self.nearest(starts.map(|start| self.solution(&self.descend(&start))));
        if let Some(solution) = self.accept(&nearest.q) {
            return Ok(solution);
        }
        let reaches_without_limits = least_infeasible.iter().find(|c| c.infeasibility <= 0.0);
        Err(match reaches_without_limits {
            Some(solution) => KinematicsError::JointLimit {
                violation: self.limits.violation_at(&solution.q, self.limits.margins(&solution.q).argmin().0),
                nearest: Box::new(nearest),
            },
            None => self.out_of_reach(nearest),
        })
    }

    /// The solution with the smallest error among those that miss the pose.
    fn nearest(&self, missed: impl Iterator<Item = IkSolution>) -> IkSolution {
        let miss = |s: &IkSolution| s.position_residual_m.hypot(self.options.metres_per_rad * s.angle_residual_rad);
        missed.min_by(|a, b| miss(a).total_cmp(&miss(b))).expect("the seed is always a start")
    }

    fn out_of_reach(&self, nearest: IkSolution) -> KinematicsError {
        KinematicsError::OutOfReach {
            target_m: self.base_from_tcp.translation.vector.into(),
            nearest_at_limit: joints_at_limit(&self.limits, &nearest.q),
            nearest: Box::new(nearest),
        }
    }

    /// The configurations to which descents from the seed, the posture and random configurations lead, best first.
    fn by_descent(&self) -> Result<Vec<IkSolution>, KinematicsError> {
        let mut rng = Pcg64Mcg::seed_from_u64(0);
        let random = (0..NUM_STARTS).map(|_| {
            let JointLimits { position_min, position_max, .. } = &self.limits;
            JointVector::from_fn(|joint, _| rng.random_range(position_min[joint]..=position_max[joint]))
        });
        let reached: Vec<IkSolution> = [self.seed, self.posture]
            .into_iter()
            .chain(random)
            .map(|start| self.solution(&self.descend(&start)))
            .collect();
        let mut solutions: Vec<IkSolution> = reached.iter().filter(|solution| self.meets(solution)).cloned().collect();
        if solutions.is_empty() {
            return Err(self.out_of_reach(self.nearest(reached.into_iter())));
        }
        solutions.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut apart: Vec<IkSolution> = Vec::new();
        for solution in solutions {
            if apart.iter().all(|other| (other.q - solution.q).norm() > MIN_APART_RAD) {
                apart.push(solution);
            }
        }
        Ok(apart)
    }

    /// The violation of limits and geometry by a solution; 0 for a valid one.
    fn violation(&self, solution: &AnalyticSolution) -> f64 {
        let beyond: f64 = self.limits.margins(&solution.q).iter().map(|m| (-m).max(0.0)).sum();
        beyond + INFEASIBILITY_RAD * solution.infeasibility
    }

    /// The local minima over q7 of each branch's violation, refined, the smallest first.
    fn least_infeasible_solutions(&self) -> Vec<AnalyticSolution> {
        let on_grid: Vec<_> = self.grid.iter().map(|q7| self.analytic_solutions(*q7)).collect();
        let mut minima = Vec::new();
        for branch_idx in 0..NUM_BRANCHES {
            let violation_on_grid: Vec<f64> =
                on_grid.iter().map(|c| c[branch_idx].as_ref().map_or(f64::INFINITY, |c| self.violation(c))).collect();
            for i in 0..self.grid.len() {
                let here = violation_on_grid[i];
                let before = if i > 0 { violation_on_grid[i - 1] } else { f64::INFINITY };
                let after = violation_on_grid.get(i + 1).copied().unwrap_or(f64::INFINITY);
                if here.is_finite() && here <= before && here <= after {
                    minima.push((here, branch_idx, i));
                }
            }
        }
        minima.sort_by(|a, b| a.0.total_cmp(&b.0));
        minima.truncate(2 * NUM_RESCUES);

        let mut refined: Vec<AnalyticSolution> = minima
            .into_iter()
            .filter_map(|(_, branch_idx, grid_idx)| {
                let badness_at = |q7: f64| {
                    let solution = self.analytic_solutions(q7)[branch_idx];
                    (solution, solution.map_or(f64::INFINITY, |c| self.violation(&c)))
                };
                let (low, high) = self.neighbours(grid_idx);
                let (solution, _) = golden_section(low, high, badness_at);
                solution
            })
            .collect();
        refined.sort_by(|a, b| self.violation(a).total_cmp(&self.violation(b)));
        refined
    }
}

/// The lowest value found of `f` on [low, high], and the result for it, by golden-section search.
fn golden_section<T>(mut low: f64, mut high: f64, f: impl Fn(f64) -> (T, f64)) -> (T, f64) {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let mut left = high - SHARE * (high - low);
    let mut right = low + SHARE * (high - low);
    let mut at_left = f(left);
    let mut at_right = f(right);
    for _ in 0..NUM_REFINEMENTS {
        if at_left.1 <= at_right.1 {
            (high, right, at_right) = (right, left, at_left);
            left = high - SHARE * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + SHARE * (high - low);
            at_right = f(right);
        }
    }
    if at_left.1 <= at_right.1 { at_left } else { at_right }
}

fn joints_at_limit(limits: &JointLimits, q: &JointVector) -> Vec<usize> {
    const AT_LIMIT_RAD: f64 = 1e-6;
    let margins = limits.margins(q);
    (0..margins.len()).filter(|i| margins[*i] < AT_LIMIT_RAD).map(|i| i + 1).collect()
}

#[cfg(test)]
mod tests;
