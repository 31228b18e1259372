//! A run that was stopped goes on as if nothing had happened.
#![allow(clippy::unwrap_used)]

use sdg_base_weights::checkpoint::Checkpoint;
use sdg_base_weights::network::pretrain_config;
use sdg_base_weights::pretrain::{Run, Settings};
use sdg_detection::RcnnConfig;
use sdg_detection::config::ResizeRule;
use sdg_grasp::Device;

const STEPS: usize = 50;

/// The pretraining's network, narrow and for small pictures, so that fifty steps take seconds.
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

fn advance(run: &mut Run, steps: usize) -> Vec<f64> {
    (0..steps).map(|_| run.advance().unwrap().total()).collect()
}

#[test]
fn fifty_steps_are_the_same_bits_whether_stopped_or_not() {
    let (settings, device) = (settings(), Device::flex());
    let config = narrow();
    let mut whole = Run::start(settings.clone(), &config, &device).unwrap();
    let losses = advance(&mut whole, STEPS);
    assert!(whole.is_over());

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.safetensors");
    let mut first = Run::start(settings, &config, &device).unwrap();
    let mut stopped = advance(&mut first, 17);
    first.checkpoint().write(&file).unwrap();
    drop(first);
    let mut second = Run::resume(&Checkpoint::<Settings>::read(&file).unwrap(), &config, &device).unwrap();
    assert_eq!(second.step(), 17);
    stopped.extend(advance(&mut second, STEPS - 17));

    assert_eq!(losses, stopped);
    assert_eq!(whole.checkpoint(), second.checkpoint());
    // Something was learnt meanwhile.
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(mean(&losses[STEPS - 10..]) < mean(&losses[..10]), "{losses:?}");
}

#[test]
fn a_checkpoint_of_another_network_is_refused() {
    let device = Device::flex();
    let run = Run::start(settings(), &narrow(), &device).unwrap();
    let mut other = narrow();
    other.fpn.channels = 16;
    let error = Run::resume(&run.checkpoint(), &other, &device).err().unwrap().to_string();
    assert!(error.contains("expected a checkpoint of this network"), "{error}");
}
