//! A model on unseen pictures, with and without verification: `try_views MODEL OBJECT WITH WITHOUT SEED [DIR]`.
//! With DIR every picture is listed, and those that went wrong are written there.

use sdg_cli::trial::{Trial, try_views};
use sdg_geometry::median;
use sdg_grasp::{Device, GraspModel, Verification};
use sdg_simulation::objects::ObjectSpec;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, model, object, with, without, seed, rest @ ..] = &arguments[..] else {
        return Err("usage: try_views MODEL OBJECT WITH WITHOUT SEED [DIR]".into());
    };
    let model = GraspModel::from_bytes(&std::fs::read(model)?, &Device::flex())?;
    let object = ObjectSpec::by_name(object)?;
    for verification in [Verification::ByShape, Verification::Off] {
        let tried = |present, count: &String| -> Result<Vec<Trial>, Box<dyn std::error::Error>> {
            Ok(try_views(&model, &object, present, count.parse()?, seed.parse()?, verification)?)
        };
        let (present, absent) = (tried(true, with)?, tried(false, without)?);
        if let Some(folder) = rest.first() {
            for (i, trial) in present.iter().chain(&absent).enumerate() {
                if trial.present && !trial.is_right() || trial.is_false_alarm() {
                    trial.drawn.save(format!("{folder}/{verification:?}_{i:03}.png"))?;
                }
                println!(
                    "{i:3} {} score {:.2} network {:.2} agreement {:.2} {:?}",
                    if trial.present { "with   " } else { "without" },
                    trial.best_score,
                    trial.network_score,
                    trial.best_agreement.unwrap_or(f64::NAN),
                    trial.best_error.map(|e| (e.distance_mm, e.angle_deg)),
                );
            }
        }
        let errors = || present.iter().filter_map(|trial| trial.error);
        println!(
            "{verification:?}: right {} of {}, false alarms {} of {}, median {:.2} mm and {:.2}°, {:.0} ms an image",
            present.iter().filter(|trial| trial.is_right()).count(),
            present.len(),
            absent.iter().filter(|trial| trial.is_false_alarm()).count(),
            absent.len(),
            median(errors().map(|e| e.distance_mm)).unwrap_or(f64::NAN),
            median(errors().map(|e| e.angle_deg)).unwrap_or(f64::NAN),
            1e3 * median(present.iter().map(|trial| trial.seconds)).unwrap_or(f64::NAN),
        );
    }
    Ok(())
}
