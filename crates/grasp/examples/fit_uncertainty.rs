//! Fits what a grasp in the plan view says of its own errors, on generated parts, and prints what would change. It changes
//! nothing.
//!
//! `cargo run --release -p sdg-grasp --example fit_uncertainty -- [PARTS [SEED [ROWS.tsv]]]`
//!
//! Draws PARTS parts (80), half of them to fit on and half held out, teaches model S on each in the plan view of its photo's
//! camera, and finds it in one picture of each of the generator's conditions with the part, at 640x480 and at 320x240. The
//! constants minimise the pinball loss at 68 % of the logarithm of the errors, with equal weight to each condition.

use std::io::Write;
use std::ops::ControlFlow;

use nalgebra::Point3;
use rayon::prelude::*;
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{
    CameraOverTable, Circumstances, ModelKind, PlanDetector, TeachOptions, UncertaintyConfig, Verification,
    seen_from_above, teach,
};
use sdg_part_generator::{Condition, Part, PhotoConfig, SceneConfig, Scenes};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// What is found farther off than this is wrong, not inexact, in metres and radians.
const MAX_ERROR: (f64, f64) = (0.01, 0.17);

/// A part found.
struct Row {
    condition: Condition,
    is_held_out: bool,
    position_m: f64,
    /// `None` where the turn cannot be seen.
    yaw_rad: Option<f64>,
    circumstances: Circumstances,
}

fn over_table(camera: sdg_geometry::PosedCamera) -> CameraOverTable {
    CameraOverTable { camera, table_height_m: 0.0, workspace: None }
}

fn rows(part_seed: u64, is_held_out: bool, size: [u32; 2]) -> Result<Vec<Row>> {
    let part = Part::generate(part_seed);
    let [width, height] = size;
    let photo = PhotoConfig { width, height, ..PhotoConfig::default() };
    let mut rows = Vec::new();
    let mut detector: Option<PlanDetector> = None;
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
            let height_m = f64::from(part.grasp().height_mm) * 1e-3;
            let (seen, lengths) =
                seen_from_above(&[shown.demonstration.clone()], &over_table(shown.camera), height_m, 0.5 * height_m)?;
            let options = TeachOptions {
                kind: ModelKind::S,
                symmetry: part.symmetry(),
                lengths: Some(lengths),
                ..TeachOptions::new(1)
            };
            let model = teach(&seen, &options, &mut |_| ControlFlow::Continue(()))?.model;
            detector = Some(PlanDetector::new(model, &over_table(shown.camera))?);
        }
        let sample = scenes.sample(0);
        let Some(looking) = detector.take() else { continue };
        let looking = looking.moved_to(&over_table(sample.camera))?;
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
        detector = Some(looking);
    }
    Ok(rows)
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| arguments.get(k).map_or(Ok(default), |text| text.parse());
    let (parts, seed) = (number(0, 80)?, number(1, 1)?);
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
    if let Some(path) = arguments.get(2) {
        let mut file = std::fs::File::create(path)?;
        for row in &rows {
            let c = &row.circumstances;
            writeln!(
                file,
                "{}\t{}\t{:.8}\t{:.8}\t{:.8}\t{:.5}\t{:.5}\t{:.5}\t{:.4}\t{:.4}",
                row.condition.name(),
                u8::from(row.is_held_out),
                row.position_m,
                row.yaw_rad.unwrap_or(-1.0),
                c.pixel_m,
                c.slant,
                c.mark_height_m,
                c.diagonal_m,
                c.agreement,
                c.visible
            )?;
        }
    }
    let config = UncertaintyConfig::default();
    for condition in Condition::ALL {
        let of = |is_held_out: bool| {
            let chosen: Vec<&Row> =
                rows.iter().filter(|row| row.condition == condition && row.is_held_out == is_held_out).collect();
            let place = chosen.iter().filter(|row| row.position_m <= row.circumstances.uncertainty(&config).position_m);
            let turned: Vec<(f64, f64)> = chosen
                .iter()
                .filter_map(|row| Some((row.yaw_rad?, row.circumstances.uncertainty(&config).yaw_rad)))
                .collect();
            let within = turned.iter().filter(|(error, expected)| error <= expected).count();
            let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
            format!(
                "{:3} found, {:3.0} % and {:3.0} % within",
                chosen.len(),
                percent(place.count(), chosen.len()),
                percent(within, turned.len())
            )
        };
        println!("{:12} fitted: {}; held out: {}", condition.name(), of(false), of(true));
    }
    Ok(())
}
