//! A run that was stopped and resumed gives the same bits as one that was not.

use sdg_base_weights::comparison::ComparisonTask;
use sdg_base_weights::detector::DetectorTask;
use sdg_base_weights::network::pretrain_config;
use sdg_base_weights::orientation::OrientationTask;
use sdg_base_weights::run::{Run, Settings, Task};
use sdg_comparison::ComparisonConfig;
use sdg_detection::RcnnConfig;
use sdg_detection::config::ResizeRule;
use sdg_grasp::Device;
use sdg_orientation::OrientationConfig;

const STEPS: usize = 50;

/// The network of the pretraining, narrow and for small pictures, so that fifty steps take
/// seconds.
fn narrow() -> RcnnConfig {
    let mut config = pretrain_config();
    config.input.resize = ResizeRule::FitWithin { width_px: 96, height_px: 72 };
    (config.backbone.stem_channels, config.backbone.res2_channels) = (8, 8);
    config.backbone.num_blocks = [1, 1, 1, 1];
    config.fpn.channels = 8;
    config.roi_heads.box_head.fc_channels = 16;
    config.roi_heads.keypoint_head.as_mut().unwrap().conv_channels = vec![8];
    let mask_head = config.roi_heads.mask_head.as_mut().unwrap();
    (mask_head.conv_channels, mask_head.deconv_channels) = (vec![8], 8);
    config
}

fn settings() -> Settings {
    Settings { batch_size: 2, ..Settings::new(7, 5, STEPS) }
}

fn task(config: RcnnConfig) -> DetectorTask {
    DetectorTask::new(&settings(), config).unwrap()
}

fn advance<T: Task>(run: &mut Run<T>, steps: usize) -> Vec<f64> {
    (0..steps).map(|_| run.advance().unwrap().iter().map(|(_, loss)| loss).sum()).collect()
}

/// Does fifty steps at once, and in two runs with a checkpoint between; returns the losses.
fn stopped_and_not<T: Task>(task: impl Fn() -> T, settings: &Settings) -> Vec<f64> {
    let device = Device::flex();
    let mut whole = Run::start(task(), settings.clone(), &device).unwrap();
    let losses = advance(&mut whole, STEPS);
    assert!(whole.is_over());

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.safetensors");
    let mut first = Run::start(task(), settings.clone(), &device).unwrap();
    let mut stopped = advance(&mut first, 17);
    first.checkpoint().write(&file).unwrap();
    drop(first);
    let mut second = Run::start_or_resume(task(), &file, settings.clone(), &device).unwrap();
    assert_eq!(second.step(), 17);
    stopped.extend(advance(&mut second, STEPS - 17));

    assert_eq!(losses, stopped);
    assert_eq!(whole.checkpoint(), second.checkpoint());
    losses
}

fn mean(losses: &[f64]) -> f64 {
    losses.iter().sum::<f64>() / losses.len() as f64
}

#[test]
fn fifty_steps_of_the_detector_are_the_same_bits_whether_stopped_or_not() {
    let losses = stopped_and_not(|| task(narrow()), &settings());
    // The losses must have fallen.
    assert!(mean(&losses[STEPS - 10..]) < mean(&losses[..10]), "{losses:?}");
}

#[test]
fn fifty_steps_of_the_orientation_cnn_are_the_same_bits_whether_stopped_or_not() {
    let config = OrientationConfig {
        input_px: 32,
        stage_channels: vec![8, 16],
        stage_convs: vec![1, 1],
        hidden: 32,
        ..OrientationConfig::edge()
    };
    let task = || OrientationTask::new(&settings(), config.clone()).unwrap();
    let losses = stopped_and_not(task, &settings());
    assert!(mean(&losses[STEPS - 10..]) < mean(&losses[..10]), "{losses:?}");
}

#[test]
fn fifty_steps_of_the_comparison_network_are_the_same_bits_whether_stopped_or_not() {
    let orientation =
        OrientationConfig { stage_channels: vec![8, 16], stage_convs: vec![1, 1], ..OrientationConfig::edge() };
    let orientation = orientation.init(&Device::flex(), 4).unwrap().state_dict();
    let config = ComparisonConfig {
        trunk_channels: vec![8, 16],
        trunk_convs: vec![1, 1],
        stage_channels: vec![16],
        stage_convs: vec![1],
        hidden: 16,
        ..ComparisonConfig::edge()
    };
    let settings = Settings { batch_size: 1, ..settings() };
    let task = || ComparisonTask::new(&settings, config.clone(), orientation.clone()).unwrap();
    let losses = stopped_and_not(task, &settings);
    assert!(mean(&losses[STEPS - 10..]) < mean(&losses[..10]), "{losses:?}");

    // The trunk starts as the orientation CNN's first stages and is trained.
    let mut run = Run::start(task(), settings.clone(), &Device::flex()).unwrap();
    let is_first = |run: &Run<ComparisonTask>| {
        run.checkpoint().parameters["trunk.1.convs.0.weight"] == orientation["stages.1.convs.0.weight"]
    };
    assert!(is_first(&run));
    advance(&mut run, 2);
    assert!(!is_first(&run));
}

#[test]
fn a_checkpoint_of_another_network_or_run_is_refused() {
    let device = Device::flex();
    let run = Run::start(task(narrow()), settings(), &device).unwrap();
    let mut other = narrow();
    other.fpn.channels = 16;
    let error = Run::resume(task(other), &run.checkpoint(), &device).err().unwrap().to_string();
    assert!(error.contains("expected a checkpoint of this network"), "{error}");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.safetensors");
    run.checkpoint().write(&file).unwrap();
    let longer = Settings { steps: STEPS + 1, ..settings() };
    let error = Run::start_or_resume(task(narrow()), &file, longer, &device).err().unwrap().to_string();
    assert!(error.contains("expected a run of") && error.contains("steps: 51"), "{error}");
}
