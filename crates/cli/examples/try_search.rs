//! The search without a network on unseen pictures: `try_search OBJECT WITH WITHOUT SEED [MIN_SCALE LARGEST_SCALE]`.
//!
//! Reports how many of WITH pictures of the part are right, at the default least agreement and where the threshold is
//! the best agreement in any of WITHOUT pictures without it.

use std::time::Instant;

use sdg_cli::against_truth::{grasp_error, grasp_pose};
use sdg_cli::shipped;
use sdg_cli::trial::{RIGHT_DEGREES, RIGHT_MM};
use sdg_geometry::median;
use sdg_grasp::TaughtDemonstration;
use sdg_shape::{Match, SearchConfig, ShapeSearch};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{TestView, test_views};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// The best match in one picture.
struct Seen {
    agreement: f64,
    /// Millimetres and degrees from the truth, where the part is there.
    error: Option<(f64, f64)>,
    ms: f64,
}

impl Seen {
    fn is_right(&self) -> bool {
        self.error.is_some_and(|(mm, degrees)| mm <= RIGHT_MM && degrees <= RIGHT_DEGREES)
    }
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, name, with, without, seed, scales @ ..] = &arguments[..] else {
        return Err("usage: try_search OBJECT WITH WITHOUT SEED [MIN_SCALE LARGEST_SCALE]".into());
    };
    let object = ObjectSpec::by_name(name)?;
    let demonstration = TaughtDemonstration::new(&shipped::demonstration(name)?)?;
    let outline = demonstration.marks.outline.clone().ok_or("the demonstration has no outline")?;
    let default = SearchConfig::default();
    let scales = match scales {
        [least, largest] => least.parse()?..=largest.parse()?,
        _ => default.scales.clone(),
    };
    let threshold = default.min_agreement;
    let start = Instant::now();
    // All are wanted, to see how far right and wrong are apart.
    let mut config = default;
    (config.scales, config.min_agreement) = (scales, 0.0);
    let search = ShapeSearch::new(&demonstration.cutout, &outline, &config)?;
    println!("taught in {:.1} ms", 1e3 * start.elapsed().as_secs_f64());

    let seed: u64 = seed.parse()?;
    let look = |present: bool, count: &str| -> Result<Vec<Seen>> {
        test_views(&object, present, count.parse()?, seed)
            .map(|view| {
                let view = view?;
                let start = Instant::now();
                let best = search.search(&view.view.image).into_iter().next();
                let ms = 1e3 * start.elapsed().as_secs_f64();
                let error = best.and_then(|best| error(&demonstration, &object, &view, &best));
                Ok(Seen { agreement: best.map_or(0.0, |best| best.agreement), error, ms })
            })
            .collect()
    };
    let (present, absent) = (look(true, with)?, look(false, without)?);
    let highest_wrong = absent.iter().map(|seen| seen.agreement).fold(0.0, f64::max);
    let lowest_right = present.iter().filter(|s| s.is_right()).map(|s| s.agreement).fold(1.0, f64::min);
    let right_over = |threshold: f64| present.iter().filter(|s| s.is_right() && s.agreement > threshold).count();
    println!(
        "{name}: right {} of {}; over {threshold}: right {}, false alarms {} of {}; without false alarms: right {}",
        right_over(-1.0),
        present.len(),
        right_over(threshold),
        absent.iter().filter(|seen| seen.agreement > threshold).count(),
        absent.len(),
        right_over(highest_wrong),
    );
    let errors = || present.iter().filter(|seen| seen.is_right()).filter_map(|seen| seen.error);
    println!(
        "agreement: lowest right {lowest_right:.2}, highest without {highest_wrong:.2}; median {:.2} mm and {:.2}°, {:.0} ms",
        median(errors().map(|(mm, _)| mm)).unwrap_or(f64::NAN),
        median(errors().map(|(_, degrees)| degrees)).unwrap_or(f64::NAN),
        median(present.iter().chain(&absent).map(|seen| seen.ms)).unwrap_or(f64::NAN),
    );
    Ok(())
}

fn error(
    demonstration: &TaughtDemonstration,
    object: &ObjectSpec,
    seen: &TestView,
    found: &Match,
) -> Option<(f64, f64)> {
    let truth = seen.truth.as_ref()?;
    let grasp = demonstration.grasp(&found.image_from_demonstration);
    let pose = grasp_pose(object, &seen.view.camera, &grasp).ok()?;
    let error = grasp_error(object, &truth.base_from_object, &pose.base_from_tcp);
    Some((error.distance_mm, error.angle_deg))
}
