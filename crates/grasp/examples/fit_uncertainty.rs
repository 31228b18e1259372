//! Fits, on generated parts, the constants that determine the standard errors of a grasp in the plan view, and prints
//! them beside the shipped constants. Changes no file.
//!
//! `cargo run --release -p sdg-grasp --example fit_uncertainty -- [PARTS [SEED]]`
//!
//! Generates PARTS parts (240), half of them for fitting and half held out, and teaches model S on each in the plan
//! view of its photo's camera. Searches for it in one picture with the part under each of the generator's conditions.
//! Half of the parts have pictures of 640x480 pixels, the others of 320x240. The constants minimise the pinball loss of
//! the logarithm of the errors at the 68 % quantile, with equal weight for each condition.

use std::ops::ControlFlow;

use nalgebra::{Point2, Point3};
use rayon::prelude::*;
use sdg_demonstration::Demonstration;
use sdg_geometry::{GraspLine, RotationalSymmetry};
use sdg_grasp::{
    CameraOverTable, Circumstances, ErrorLength, ModelKind, PlanViewDetector, TeachOptions, Verification,
    seen_from_above, teach,
};
use sdg_part_generator::{Condition, DemonstrationPhoto, Part, PhotoConfig, SceneConfig, Scenes};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Larger errors count as a wrong detection instead of inaccuracy; in metres and radians.
const MAX_ERROR: (f64, f64) = (0.01, 0.17);

/// A found part.
struct Row {
    condition: Condition,
    is_held_out: bool,
    position_m: f64,
    /// Error of the rotation about the vertical; `None` if the rotation is not visible.
    yaw_rad: Option<f64>,
    circumstances: Circumstances,
}

fn over_table(camera: sdg_geometry::PosedCamera) -> CameraOverTable {
    CameraOverTable { camera, table_height_m: 0.0, workspace: None }
}

/// The photo with its marks moved vertically onto the part's surface.
fn marked_on_surface(shown: &DemonstrationPhoto, marked_m: f64, surface_m: f64) -> Result<Demonstration> {
    let mut demonstration = shown.demonstration.clone();
    let raised = |mark: Point2<f64>| {
        let at = shown.camera.at_height(&mark, marked_m)?;
        shown.camera.project(&Point3::new(at.x, at.y, surface_m))
    };
    let line = demonstration.annotation.grasp.ok_or("expected marks")?;
    let ends = raised(line.start).zip(raised(line.end)).ok_or("expected marks that the camera shows")?;
    demonstration.annotation.grasp = Some(GraspLine::new(ends.0, ends.1));
    Ok(demonstration)
}

fn rows(part_seed: u64, is_held_out: bool, size: [u32; 2]) -> Result<Vec<Row>> {
    let part = Part::generate(part_seed);
    let [width, height] = size;
    let photo = PhotoConfig { width, height, ..PhotoConfig::default() };
    let mut rows = Vec::new();
    let mut detector: Option<PlanViewDetector> = None;
    for (idx, condition) in Condition::ALL.into_iter().enumerate() {
        let config = SceneConfig {
            width,
            height,
            photo,
            absent_share: 0.0,
            distance: [0.75, 1.3],
            ..SceneConfig::only(condition)
        };
        let scenes = Scenes::new(std::slice::from_ref(&part), config, part_seed.wrapping_mul(100) + idx as u64)?;
        if detector.is_none() {
            let shown = scenes.photo(0);
            // The generator puts the marks at half the part's height; a user measures the height of the surface under
            // the marks.
            let surface_m = 2e-3 * f64::from(part.grasp().height_mm);
            let demonstration = marked_on_surface(shown, 0.5 * surface_m, surface_m)?;
            let (seen, lengths) =
                seen_from_above(&[demonstration], &over_table(shown.camera), surface_m, 0.5 * surface_m)?;
            let mut options = TeachOptions::new(1);
            options.kind = ModelKind::S;
            options.symmetry = part.symmetry();
            options.lengths = Some(lengths);
            let model = teach(&seen, &options, &mut |_| ControlFlow::Continue(()))?.model;
            detector = Some(PlanViewDetector::new(model, &over_table(shown.camera))?);
        }
        let sample = scenes.sample(0);
        let Some(looking) = &mut detector else { continue };
        looking.move_to(&over_table(sample.camera))?;
        for found in looking.detect(&sample.image, Verification::ByShape)? {
            if !found.detection.is_accepted() {
                continue;
            }
            let errors = sample.instances.iter().map(|instance| {
                let [start, end] = instance.marks_m;
                let middle: Point3<f64> = nalgebra::center(&start, &end);
                let along = end - start;
                let yaw = along.y.atan2(along.x);
                let off = (found.pose.position_m.xy() - middle.xy()).norm();
                let turned = part.symmetry().distance(found.pose.yaw, sdg_geometry::Angle::from_radians(yaw));
                (off, turned)
            });
            let nearest = errors.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((position_m, yaw_rad)) = nearest.filter(|(off, turn)| *off < MAX_ERROR.0 && *turn < MAX_ERROR.1)
            else {
                continue;
            };
            rows.push(Row {
                condition,
                is_held_out,
                position_m,
                yaw_rad: (part.symmetry() != RotationalSymmetry::Full).then_some(yaw_rad),
                circumstances: found.pose.circumstances,
            });
        }
    }
    Ok(rows)
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| arguments.get(k).map_or(Ok(default), |text| text.parse());
    let (parts, seed) = (number(0, 240)?, number(1, 2)?);
    let drawn: Vec<Vec<Row>> = (0..parts)
        .into_par_iter()
        .map(|k| {
            let size = if k % 4 < 2 { [640, 480] } else { [320, 240] };
            rows(seed.wrapping_mul(1_000_000) + k, k % 2 == 1, size).unwrap_or_else(|error| {
                eprintln!("part {k} is left out: {error}");
                Vec::new()
            })
        })
        .collect();
    let rows: Vec<Row> = drawn.into_iter().flatten().collect();
    println!("{} parts found", rows.len());
    let places: Vec<Measured> = rows.iter().map(|row| Measured::new(row, row.position_m)).collect();
    report("position", &places, &ErrorLength::POSITION);
    let turns: Vec<Measured> =
        rows.iter().filter_map(|row| Some(Measured::new(row, row.yaw_rad? * row.circumstances.diagonal_m))).collect();
    report("turn", &turns, &ErrorLength::TURN);
    Ok(())
}

/// An error as a length, and the quantities that it depends on.
struct Measured {
    condition: Condition,
    is_held_out: bool,
    error_m: f64,
    circumstances: Circumstances,
}

impl Measured {
    fn new(row: &Row, error_m: f64) -> Self {
        Self {
            condition: row.condition,
            is_held_out: row.is_held_out,
            // Errors below a micrometre count as a micrometre.
            error_m: error_m.max(1e-6),
            circumstances: row.circumstances,
        }
    }
}

fn report(name: &str, measured: &[Measured], shipped: &ErrorLength) {
    let fitted = fit(measured, shipped);
    println!("{name}: shipped {shipped:?}, loss {:.4}", loss(measured, shipped));
    println!("{name}: fitted  {fitted:?}, loss {:.4}", loss(measured, &fitted));
    for condition in Condition::ALL {
        let within = |is_held_out: bool| {
            let of = || measured.iter().filter(|one| one.condition == condition && one.is_held_out == is_held_out);
            let count = of().filter(|one| one.error_m <= fitted.metres(&one.circumstances)).count();
            format!("{:3.0} % of {}", 100.0 * count as f64 / of().count().max(1) as f64, of().count())
        };
        println!("  {:12} within: {} fitted on, {} held out", condition.name(), within(false), within(true));
    }
}

/// The fitted quantile: one standard deviation of a normal distribution.
const QUANTILE: f64 = 0.68;

/// The pinball loss over the fitting half, with equal weight for each condition.
fn loss(measured: &[Measured], length: &ErrorLength) -> f64 {
    let of_condition = |condition: Condition| {
        let of = || measured.iter().filter(|one| one.condition == condition && !one.is_held_out);
        let sum: f64 = of()
            .map(|one| {
                let beyond = (one.error_m / length.metres(&one.circumstances)).ln();
                if beyond > 0.0 { QUANTILE * beyond } else { (QUANTILE - 1.0) * beyond }
            })
            .sum();
        sum / of().count().max(1) as f64
    };
    Condition::ALL.into_iter().map(of_condition).sum()
}

/// Repeats the best change of one or two constants, by decreasing factors, until nothing improves.
fn fit(measured: &[Measured], start: &ErrorLength) -> ErrorLength {
    let moved = |length: &ErrorLength, which: usize, factor: f64| {
        let mut moved = *length;
        *[&mut moved.pixels, &mut moved.by_disagreement, &mut moved.by_slant, &mut moved.by_height][which] *= factor;
        moved
    };
    let mut best = (loss(measured, start), *start);
    for step in [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005] {
        loop {
            let tried =
                (0..4).flat_map(|which| [1.0 + step, 1.0 / (1.0 + step)].map(|factor| moved(&best.1, which, factor)));
            // Also changes pairs of constants in opposite directions, because an increase of one constant of such a
            // pair can compensate a decrease of the other.
            let traded = [(0, 1), (0, 3), (2, 3)].into_iter().flat_map(|(one, other)| {
                [1.0 + step, 1.0 / (1.0 + step)].map(|factor| moved(&moved(&best.1, one, factor), other, 1.0 / factor))
            });
            let next =
                tried.chain(traded).map(|length| (loss(measured, &length), length)).min_by(|a, b| a.0.total_cmp(&b.0));
            match next {
                Some(next) if next.0 < best.0 - 1e-9 => best = next,
                _ => break,
            }
        }
    }
    best.1
}
