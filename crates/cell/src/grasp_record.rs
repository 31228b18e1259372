//! The JSON record of a grasp, as printed by `sdg grasp` (docs/command-line.md).

use nalgebra::Vector3;
use sdg_robot::height::HeightReport;
use sdg_robot::{GraspStep, GraspTarget, PlaceGoal};
use serde_json::{Value, json};

use crate::grasp_task::GraspTask;
use crate::sequence_run::Ended;

impl GraspTask {
    /// The record of the task's result. `robot` names the arm, `secs` is the arm's time and `total_secs` the time since
    /// the program's start.
    pub fn record(&self, ended: &Ended, robot: &str, secs: f64, total_secs: f64) -> Value {
        let report = &ended.grasp;
        let last_step = if self.place.is_some() { GraspStep::Check } else { GraspStep::Hold };
        let (step, why) = match &ended.failed {
            None => (last_step, None),
            Some((step, why)) => (*step, Some(why)),
        };
        let mut object = json!({
            "robot": robot,
            "model": self.model.kind().letter(),
            "object": self.model.object(),
            "held": report.outcome.is_held(),
            "step": step.name(),
            "why": why,
            "looks": report.looks,
            "target": report.targets.iter().rev().flatten().next().map(target_json),
            "closed_width_m": report.closed.map(|hand| hand.opening_m),
            "seconds": secs,
            "total_seconds": total_secs,
        });
        if let Some(height) = &report.height {
            object["height"] = height_json(height, self.workcell.table_height_m);
        }
        if let Some((goal, _)) = &self.place {
            object["place"] = place_json(goal, ended);
        }
        object
    }

    /// The record of a task whose motion was not permitted.
    pub fn refused_record(&self, robot: &str, total_secs: f64) -> Value {
        json!({
            "robot": robot,
            "model": self.model.kind().letter(),
            "object": self.model.object(),
            "moved": false,
            "held": false,
            "total_seconds": total_secs,
        })
    }
}

fn target_json(target: &GraspTarget) -> Value {
    let p = target.base_from_tcp.translation.vector;
    let along = target.base_from_tcp.rotation * Vector3::x();
    json!({
        "frame": "base",
        "p_m": [p.x, p.y, p.z],
        "yaw_deg": along.y.atan2(along.x).to_degrees(),
        "opening_m": target.jaw_width_m,
        "score": target.score,
    })
}

fn place_json(goal: &PlaceGoal, ended: &Ended) -> Value {
    json!({
        "name": goal.name,
        "placed": ended.failed.is_none(),
        "beside_mm": ended.beside.map(|error| error.distance_m() * 1e3),
        "turned_deg": ended.beside.map(|error| error.angle_rad.abs().to_degrees()),
        "pressed_n": ended.touched.iter().map(|touched| touched.force_n).collect::<Vec<_>>(),
    })
}

/// The height of the marks above the table, and its source.
fn height_json(height: &HeightReport, table_height_m: f64) -> Value {
    let over_table_mm = |height_m: f64| 1e3 * (height_m - table_height_m);
    json!({
        "source": height.settled.map(|settled| settled.source.name()),
        "mark_height_mm": height.settled.map(|settled| over_table_mm(settled.height_m)),
        "sigma_mm": height.settled.map(|settled| 1e3 * settled.sigma_m),
        "measured_mm": height.measured.map(|measured| over_table_mm(measured.height_m)),
        "measured_sigma_mm": height.measured.map(|measured| 1e3 * measured.sigma_m),
        "not_measured": height.why_not,
    })
}
