//! The orientation CNN taught from shipped demonstrations and tried on unseen pictures of the simulator:
//! `try_orientation OBJECTS VIEWS SEED [SETTINGS …]`.
//!
//! OBJECTS are names with commas between, or `all`. Every SETTINGS teaches a network of its own and gives a line an
//! object; it is a preset, `edge` or `paper`, and changes to it: `edge,input=96,labels=hard,steps=200,peak=2e-3` with keys
//! input, channels, convs, hidden, window, turns, labels, sigma, steps, batch, peak, decay, crops, scenes, seed. Boxes are
//! the true ones, from the simulator's segmentation, and off by as much as those in training.
//!
//! ```sh
//! cargo run --release -p sdg-cli --example try_orientation -- all 60 9000 edge edge,labels=hard,window=0
//! ```

use std::ops::ControlFlow;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sdg_cli::shipped;
use sdg_geometry::{Angle, BoundingBox};
use sdg_grasp::Device;
use sdg_orientation::{Labels, OrientationConfig, crop_for};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{GraspTruth, SceneVariation, VariationConfig, base_from_look_camera};
use sdg_simulation::{Body, CameraView, Workcell, WorkcellConfig};
use sdg_training::orientation::{AngleErrors, BoxJitter, LabelledCrop, OrientationTraining, teach};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Boxes drawn around the part of each picture.
const BOXES_A_VIEW: usize = 3;

/// A picture, the part's true box and the true direction of its grasp line.
struct View {
    image: image::RgbImage,
    bbox: BoundingBox,
    angle: Angle,
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, objects, views, seed, settings @ ..] = &arguments[..] else {
        return Err("usage: try_orientation OBJECTS VIEWS SEED [SETTINGS ...]".into());
    };
    let names: Vec<&str> = if objects == "all" { ObjectSpec::names().collect() } else { objects.split(',').collect() };
    let (count, seed): (usize, u64) = (views.parse()?, seed.parse()?);
    let default = ["edge".to_owned()];
    let settings = if settings.is_empty() { &default[..] } else { settings };
    for name in names {
        let spec = ObjectSpec::by_name(name)?;
        let views: Vec<View> = (0..count as u64).map(|i| view(&spec, seed + i)).collect::<Result<_>>()?;
        for settings in settings {
            try_settings(name, &views, settings)?;
        }
    }
    Ok(())
}

fn try_settings(name: &str, views: &[View], settings: &str) -> Result<()> {
    let (network, training) = parse(settings)?;
    let demonstration = shipped::demonstration(name)?;
    let before_teaching = processor_seconds();
    let taught =
        teach(&[demonstration], &network, None, &training, &Device::flex(), &mut |_| ControlFlow::Continue(()))?;
    let taught_secs = processor_seconds() - before_teaching;

    // The jitter that the network was taught with by default, whatever this one was taught with.
    let jitter: BoxJitter = OrientationTraining::edge(0).crops.jitter;
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let mut crops = Vec::with_capacity(views.len() * BOXES_A_VIEW);
    for view in views {
        for _ in 0..BOXES_A_VIEW {
            let crop = crop_for(&view.image, &jitter.apply(&view.bbox, &mut rng), network.input_px)?;
            crops.push(LabelledCrop { crop, angle: view.angle });
        }
    }
    let start = processor_seconds();
    let errors = AngleErrors::measure(&taught.network, &crops)?;
    let ms_a_reading = 1e3 * (processor_seconds() - start) / crops.len() as f64;
    let bytes: usize = taught.network.state_dict().values().map(|tensor| 2 * tensor.values.len()).sum();
    println!(
        "{name:10} {settings:40} {:4} steps {:5.1} s ({taught_secs:.1} s of processor) | held back {} \
         | rendered {} | {ms_a_reading:4.1} ms of processor, {:.1} MB",
        taught.steps,
        taught.elapsed_secs,
        figures(&taught.errors),
        figures(&errors),
        bytes as f64 / 1e6,
    );
    Ok(())
}

fn figures(errors: &AngleErrors) -> String {
    let (hits, median) = (100.0 * errors.hit_rate(), errors.median_degrees());
    let [p90, worst] = [0.9, 1.0].map(|share| errors.quantile_degrees(share));
    format!("{hits:5.1} % median {median:4.2}° p90 {p90:5.2}° worst {worst:5.1}° of {}", errors.count())
}

/// Processor time of this process, all threads, in seconds: on a busy machine the clock on the wall says nothing. Zero
/// where there is no `/proc`.
fn processor_seconds() -> f64 {
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // User and system time are fields 14 and 15; the name before them, in brackets, may hold spaces.
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    after_name.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>()
        / TICKS_A_SECOND
}

/// An unseen picture with the part, as the other trials take it, and the part's box.
fn view(spec: &ObjectSpec, seed: u64) -> Result<View> {
    let scene = SceneVariation::sample(Some(spec), &VariationConfig::default(), seed);
    let mut workcell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
    let CameraView { image, camera, .. } = workcell.view_from(&base_from_look_camera())?;
    let truth = scene.object.as_ref().and_then(|object| GraspTruth::new(object, &camera));
    let truth = truth.ok_or("the camera does not see the marks")?;
    let segmentation = workcell.wrist_segmentation()?;
    let model = workcell.data().model();
    let body = model.id::<Body>("object")?;
    let corners = segmentation.pixels_where(|geom| model.body_of(geom) == body).flat_map(|(x, y)| {
        let (x, y) = (f64::from(x), f64::from(y));
        [nalgebra::Point2::new(x, y), nalgebra::Point2::new(x + 1.0, y + 1.0)]
    });
    let bbox = BoundingBox::around(corners).ok_or("the camera does not see the part")?;
    let along = truth.line.end - truth.line.start;
    Ok(View { image, bbox, angle: Angle::from_direction(along.x, along.y) })
}

fn parse(settings: &str) -> Result<(OrientationConfig, OrientationTraining)> {
    let mut parts = settings.split(',');
    let (mut network, mut training) = match parts.next() {
        Some("edge") => (OrientationConfig::edge(), OrientationTraining::edge(1)),
        Some("paper") => (OrientationConfig::paper(), OrientationTraining::paper(1)),
        other => return Err(format!("expected a preset, edge or paper, found {other:?}").into()),
    };
    for part in parts {
        let (key, value) = part.split_once('=').ok_or(format!("expected KEY=VALUE, found {part:?}"))?;
        match key {
            "input" => network.input_px = value.parse()?,
            "channels" => {
                network.stage_channels = value.split('-').map(str::parse).collect::<std::result::Result<_, _>>()?
            }
            "convs" => network.stage_convs = value.split('-').map(str::parse).collect::<std::result::Result<_, _>>()?,
            "hidden" => network.hidden = value.parse()?,
            "window" => network.readout.window_classes = value.parse()?,
            "turns" => network.readout.quarter_turns = value == "yes",
            "labels" => training.labels = if value == "hard" { Labels::Hard } else { return Err("labels=hard".into()) },
            "sigma" => training.labels = Labels::VonMises { sigma_classes: value.parse()? },
            "steps" => training.steps = value.parse()?,
            "batch" => training.batch_size = value.parse()?,
            "peak" => training.schedule.peak = value.parse()?,
            "decay" => training.weight_decay = value.parse()?,
            "crops" => training.crops.crops_per_scene = value.parse()?,
            "scenes" => {
                let (width, height) = value.split_once('x').ok_or("expected scenes=WIDTHxHEIGHT")?;
                training.crops.augmentation.output_size = Some([width.parse()?, height.parse()?]);
            }
            "seed" => training.seed = value.parse()?,
            _ => return Err(format!("unknown setting {key:?}").into()),
        }
    }
    Ok((network, training))
}
