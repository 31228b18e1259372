//! Robot poses that contradict the pictures: finds the mistake that explains the contradiction.
//!
//! ```text
//! robot errors small, board's size as given ─ accepted
//!   ├─ board's size estimated too: much smaller robot errors with another size ─ OtherBoardScale
//!   └─ robot errors too large ─ all poses read in another way    readings.rs, euler.rs ─ HandEyeDisagrees
//!                             ─ a few poses wrong or exchanged   mixed_up.rs           ─ WrongPoses
//! ```
//! Of several explanations, the one with the smallest residual is used; among equal ones, the simplest.

use nalgebra::Isometry3;

use super::closed_form::{self, BoardSize};
use super::mixed_up::{self, MixedUp};
use super::readings;
use super::solve::{Evidence, MAX_ROBOT_SCALE, SUSPECT_ROBOT_SCALE, Solved};
use crate::error::CalibrationError;

/// Largest fraction of the reprojection error that may remain with another reading of the poses.
const MAX_SHARE: f64 = 0.3;
/// Largest fraction of the error that may remain without a few wrong poses: these poses then cause three quarters of
/// the squared error.
const MAX_SHARE_OF_FEW: f64 = 0.5;
/// Largest residual of an explanation beyond the corners' own errors, in radians of the picture: 5 px at a focal length
/// of 700 px. A robot with errors of 0.5 mm and 0.25 degrees causes as much.
const MAX_RESIDUAL_RAD: f64 = 0.007;
/// Largest residual of the closed form for which the minimum is searched; the search takes long if there is no minimum.
/// The robot errors that cause [`MAX_RESIDUAL_RAD`] cause a fifth of this residual between two pictures.
const MAX_CLOSED_RAD: f64 = 0.1;
/// Ratio of two explanations' residuals up to which they count as equal.
const ALIKE: f64 = 1.2;
/// Difference of two residuals, in pixels, that is smaller than the error of corners.
const ALIKE_PX: f64 = 0.02;
/// Minimum relative error of the board's size; a smaller one is the reading error of a ruler on a line of 100 mm.
const MIN_SCALE_ERROR: f64 = 0.003;
/// Minimum error of the board's size, in standard errors.
const MIN_SCALE_SIGMAS: f64 = 5.0;
/// Value of [`Solved::freedom`] below which the standard error itself is uncertain, so that more standard errors are
/// required: with four pictures, whose `freedom` is 11, three times as many.
const FEW_EQUATIONS: f64 = 30.0;
/// Largest fraction of the robot's errors that may remain with another size of the board: the wrong size then causes a
/// quarter of the squared error.
const MAX_ROBOT_SHARE: f64 = 0.85;
/// Largest difference between the rotations of robot and board between two pictures, in radians: 3 degrees, twice the
/// rotation error at [`MAX_ROBOT_SCALE`].
const MAX_TURN_DIFFERENCE_RAD: f64 = 0.05;

/// An explanation and its residual.
struct Explanation {
    rms_px: f64,
    kind: Kind,
}

enum Kind {
    /// All poses are to be read differently.
    Reading {
        name: String,
        is_other_mount: bool,
    },
    MixedUp(MixedUp),
    /// The board's size as a multiple of the given one, and the standard error of this factor.
    BoardScale([f64; 2]),
}

/// The solution, unless poses and pictures contradict each other or another explanation fits much better.
///
/// # Errors
/// The errors of [`super::calibrate_hand_eye`].
pub(super) fn checked<'a>(evidence: &Evidence<'a>, robot: &[Isometry3<f64>]) -> Result<Solved<'a>, CalibrationError> {
    let boards = evidence.boards();
    let turns = closed_form::check_turns(evidence.mount, &evidence.motions(robot));
    // If the board also rotates about only one axis, the poses are correct but insufficient.
    if turns.is_err() && closed_form::check_turns(evidence.mount, &boards).is_err() {
        turns.clone()?;
    }
    let solved = turns.clone().and_then(|()| Solved::of(evidence, robot, BoardSize::Told));
    let noise = solved.as_ref().map_or(f64::INFINITY, Solved::robot_noise);
    if noise == 0.0 {
        return solved;
    }
    let rms_px = solved.as_ref().map_or(f64::INFINITY, |solved| solved.minimum.at.rms_px());
    let mut explanations = Vec::new();
    if noise >= SUSPECT_ROBOT_SCALE {
        explanations = suspected(evidence, robot, rms_px);
    }
    explanations.extend(other_scale(evidence, robot, solved.as_ref().ok()));
    let best = simplest(explanations);
    let board_rms_px = evidence_rms_px(evidence);
    let found = if rms_px.is_finite() {
        format!("a reprojection error of {rms_px:.1} px, compared with {board_rms_px:.2} px without the robot poses")
    } else {
        "no pose of the camera that explains both".to_owned()
    };
    match best {
        Some(Explanation { rms_px: left, kind }) => Err(refusal(kind, left, found, evidence)),
        None if noise > MAX_ROBOT_SCALE => {
            turns?;
            let hint = match turns_that_differ(evidence, robot) {
                Some(differ) => format!(": {differ}"),
                None => ": check that each picture is listed with its own pose, that the robot stood still, and that neither board nor \
                         camera was moved"
                    .to_owned(),
            };
            Err(CalibrationError::HandEyeDisagrees { found, hint, is_other_mount: false })
        }
        None => solved,
    }
}

/// Other readings of all poses, and exclusions or exchanges of a few poses. Each explanation has a residual that errors
/// of the corners and a robot can explain.
fn suspected(evidence: &Evidence, robot: &[Isometry3<f64>], rms_px: f64) -> Vec<Explanation> {
    let readings = readings::plausible(evidence.mount, robot, &evidence.boards());
    let readings = readings.into_iter().filter_map(|reading| {
        let rms_px = left_px(evidence, &reading.robot)?;
        Some(Explanation { rms_px, kind: Kind::Reading { name: reading.name, is_other_mount: reading.is_other_mount } })
    });
    let mixed_up = mixed_up::plausible(evidence, robot).into_iter().filter_map(|mixed_up| {
        let rms_px = match &mixed_up {
            MixedUp::Wrong(out) => {
                let kept: Vec<usize> = (0..robot.len()).filter(|k| !out.contains(k)).collect();
                let of_kept: Vec<_> = kept.iter().map(|k| robot[*k]).collect();
                left_px(&evidence.of(&kept), &of_kept)
            }
            MixedUp::Exchanged([a, b]) => {
                let mut exchanged = robot.to_vec();
                exchanged.swap(*a, *b);
                left_px(evidence, &exchanged)
            }
        };
        Some(Explanation { rms_px: rms_px?, kind: Kind::MixedUp(mixed_up) })
    });
    let explains = |explanation: &Explanation| {
        let share = if matches!(explanation.kind, Kind::MixedUp(_)) { MAX_SHARE_OF_FEW } else { MAX_SHARE };
        explanation.rms_px < share * rms_px
    };
    readings.chain(mixed_up).filter(explains).collect()
}

/// Reprojection error with other robot poses; `None` if it is larger than errors of corners and a robot can explain.
fn left_px(evidence: &Evidence, robot: &[Isometry3<f64>]) -> Option<f64> {
    let motions = evidence.motions(robot);
    closed_form::check_turns(evidence.mount, &motions).ok()?;
    let closed = closed_form::solve(&motions, &evidence.boards(), BoardSize::Told)?;
    if closed.left_rad > MAX_CLOSED_RAD {
        return None;
    }
    let solved = Solved::of(evidence, robot, BoardSize::Told).ok()?;
    let rms_px = solved.minimum.at.rms_px();
    is_little(evidence, rms_px).then_some(rms_px)
}

fn is_little(evidence: &Evidence, rms_px: f64) -> bool {
    let most = evidence_rms_px(evidence) + MAX_RESIDUAL_RAD * 0.5 * (evidence.camera.fx + evidence.camera.fy);
    rms_px <= most
}

/// Another size of the board, if it differs from the given one and explains the robot's errors.
fn other_scale(evidence: &Evidence, robot: &[Isometry3<f64>], solved: Option<&Solved>) -> Option<Explanation> {
    // The squared error decreases by the fraction of the robot's errors that the size explains: a fast check before the
    // full minimisation.
    let promises =
        |solved: &Solved| solved.gain_of_free_scale() > 0.5 * (1.0 - MAX_ROBOT_SHARE.powi(2)) * solved.freedom;
    if !solved.is_none_or(promises) {
        return None;
    }
    let free = Solved::of(evidence, robot, BoardSize::Free).ok()?;
    let [scale, sigma] = free.board_scale()?;
    let off = (scale - 1.0).abs();
    let noise = solved.map_or(f64::INFINITY, Solved::robot_noise);
    let rms_px = free.minimum.at.rms_px();
    // With another size of the board, the same robot errors are accepted as with the given size, even if they exceed
    // the limit for other readings.
    let is_accepted = noise <= MAX_ROBOT_SCALE || is_little(evidence, rms_px);
    let explains = free.robot_noise() < (MAX_ROBOT_SHARE * noise).min(MAX_ROBOT_SCALE) && is_accepted;
    let min_sigmas = MIN_SCALE_SIGMAS * (1.0 + (FEW_EQUATIONS / free.freedom).powi(2)).sqrt();
    (explains && scale > 0.0 && off > MIN_SCALE_ERROR && off > min_sigmas * sigma)
        .then_some(Explanation { rms_px, kind: Kind::BoardScale([scale, sigma]) })
}

/// The first explanation whose residual counts as the smallest. The explanations are sorted, the simplest first.
fn simplest(mut explanations: Vec<Explanation>) -> Option<Explanation> {
    // The other poses also agree if both exchanged ones are left out, so this second explanation is dropped.
    let exchanged = explanations.iter().find_map(|explanation| match explanation.kind {
        Kind::MixedUp(MixedUp::Exchanged(two)) => Some(MixedUp::Wrong(two.to_vec())),
        _ => None,
    });
    if let Some(without_both) = exchanged {
        explanations
            .retain(|explanation| !matches!(&explanation.kind, Kind::MixedUp(mixed_up) if *mixed_up == without_both));
    }
    let least = explanations.iter().map(|explanation| explanation.rms_px).fold(f64::INFINITY, f64::min);
    explanations.into_iter().find(|explanation| explanation.rms_px <= ALIKE * least + ALIKE_PX)
}

fn refusal(kind: Kind, left_px: f64, found: String, evidence: &Evidence) -> CalibrationError {
    match kind {
        Kind::Reading { name, is_other_mount } => {
            let hint = format!(": {name}; with this reading, the reprojection error is {left_px:.2} px");
            CalibrationError::HandEyeDisagrees { found, hint, is_other_mount }
        }
        Kind::MixedUp(MixedUp::Wrong(pictures)) => {
            CalibrationError::WrongPoses { found, are_exchanged: false, left_px, names: numbered(&pictures), pictures }
        }
        Kind::MixedUp(MixedUp::Exchanged(two)) => {
            let pictures = two.to_vec();
            CalibrationError::WrongPoses { found, are_exchanged: true, left_px, names: numbered(&pictures), pictures }
        }
        Kind::BoardScale([scale, sigma]) => {
            CalibrationError::OtherBoardScale { told_m: evidence.board.square_m(), scale, sigma, left_px }
        }
    }
}

fn numbered(pictures: &[usize]) -> Vec<String> {
    pictures.iter().map(|k| format!("picture {}", k + 1)).collect()
}

/// Root of the mean squared distance of corners if each picture has its own pose.
fn evidence_rms_px(evidence: &Evidence) -> f64 {
    let pictures = || evidence.poses.iter().zip(&evidence.views).map(|(pose, view)| (pose.rms_px, view.corners.len()));
    let squares: f64 = pictures().map(|(rms, num)| rms * rms * num as f64).sum();
    let num: usize = pictures().map(|(_, num)| num).sum();
    (squares / num as f64).sqrt()
}

/// The hint for a robot that rotates by other angles than the board: no error in translations explains this.
fn turns_that_differ(evidence: &Evidence, robot: &[Isometry3<f64>]) -> Option<String> {
    let boards = evidence.boards();
    let turn = |poses: &[Isometry3<f64>], k: usize| poses[k].rotation.angle_to(&poses[k - 1].rotation);
    let mut turns: Vec<[f64; 2]> = (1..robot.len()).map(|k| [turn(robot, k), turn(&boards, k)]).collect();
    turns.sort_by(|a, b| (a[0] - a[1]).abs().total_cmp(&(b[0] - b[1]).abs()));
    let [robot_turn, board_turn] = *turns.get(turns.len() / 2)?;
    ((robot_turn - board_turn).abs() > MAX_TURN_DIFFERENCE_RAD).then(|| {
        format!(
            "between pictures the flange rotates by other angles than the board (typically by {:.0} degrees instead \
             of {:.0}): check that each picture is listed with its own pose, and how the rotations were \
             made (order of Euler angles, degrees or radians)",
            robot_turn.to_degrees(),
            board_turn.to_degrees()
        )
    })
}
