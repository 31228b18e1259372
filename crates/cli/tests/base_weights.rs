//! `sdg teach --base-weights`, called as a user would.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Output};
use std::time::Instant;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_detection::config::{BlockKind, RcnnConfig};
use sdg_detection::presets::{RcnnKind, edge, edge_of, r50_detectron2, r50_torchvision};
use sdg_grasp::{BaseWeights, BaseWeightsFile, Device, NUM_KEYPOINTS, TeachOptions};
use sdg_inputs::base_weights;
use sdg_layers::state_dict;
use serde_json::{Map, Value, json};

use crate::support::sdg;

/// Runs `sdg` with its address space limited to `bytes`.
fn sdg_within(bytes: u64, arguments: &[&str]) -> Output {
    let limited = format!("ulimit -v {}; exec \"$0\" \"$@\"", bytes / 1024);
    let sdg = env!("CARGO_BIN_EXE_sdg");
    Command::new("sh").args(["-c", &limited, sdg]).args(arguments).output().unwrap()
}

fn fixture(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../weights-conversion/tests/fixtures");
    folder.join(name).to_str().unwrap().to_owned()
}

fn demonstration() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations/pendulum");
    format!("{}:{}", folder.join("image.png").display(), folder.join("annotation.json").display())
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

/// A checkpoint with names and shapes of torchvision's model and random values, which are small enough that features
/// stay finite.
fn write_torchvision_model(model: &str, path: &Path) {
    let models: BTreeMap<String, BTreeMap<String, Vec<usize>>> =
        serde_json::from_slice(&fs::read(fixture("torchvision_names.json")).unwrap()).unwrap();
    let names = &models[model];
    let mut entries = Map::new();
    let mut offset = 0;
    for (name, shape) in names {
        let end = offset + 4 * shape.iter().product::<usize>();
        entries.insert(name.clone(), json!({"dtype": "F32", "shape": shape, "data_offsets": [offset, end]}));
        offset = end;
    }
    let header = Value::Object(entries).to_string();
    let mut file = BufWriter::new(File::create(path).unwrap());
    file.write_all(&(header.len() as u64).to_le_bytes()).unwrap();
    file.write_all(header.as_bytes()).unwrap();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for (name, shape) in names {
        let count = shape.iter().product();
        let values: Vec<f32> = match shape.len() {
            // Variances and the scales of norms named `bn` are 1; all other values of vectors are 0.
            0 | 1 => {
                vec![
                    if name.ends_with("var") || name.contains("bn") && name.ends_with("weight") { 1.0 } else { 0.0 };
                    count
                ]
            }
            _ => {
                let fan_in: usize = shape[1..].iter().product();
                let most = (3.0 / fan_in as f32).sqrt();
                (0..count).map(|_| rng.random_range(-most..most)).collect()
            }
        };
        values.iter().for_each(|value| file.write_all(&value.to_le_bytes()).unwrap());
    }
    file.flush().unwrap();
}

#[test]
fn a_whole_r50_is_converted_and_taught_for_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (theirs, ours, out) = (at("torchvision.safetensors"), at("converted.safetensors"), at("part.sdg"));
    write_torchvision_model("keypointrcnn_resnet50_fpn", Path::new(&theirs));
    // The address space is limited to 1.5 times the file's size. Measured for this file of 237 MB: at most 13 MB of
    // memory, 0.8 s.
    let bytes = fs::metadata(&theirs).unwrap().len();
    let start = Instant::now();
    let converted = sdg_within(bytes * 3 / 2, &["weights", "convert", &theirs, &ours]);
    println!("{bytes} bytes converted in {:.1} s", start.elapsed().as_secs_f64());
    assert_eq!(converted.status.code(), Some(0), "{converted:?}");
    fs::remove_file(&theirs).unwrap();

    let demonstration = demonstration();
    let teach = ["teach", "--preset", "r50-torchvision", "--demo", &demonstration, "--out", &out, "--steps", "1"];
    let teach = [&teach[..], &["--base-weights", &ours]].concat();
    // A person has 17 keypoints, a grasp line has 12.
    let refused = sdg(&teach);
    let (stdout, stderr) = (text(refused.stdout), text(refused.stderr));
    assert_eq!(refused.status.code(), Some(1));
    let mismatch = "mismatched  roi_heads.keypoint_head.score_lowres.bias: expected [12], found [17] of F32";
    assert!(stdout.contains(mismatch) && stdout.contains("2 mismatched"), "{stdout}");
    assert!(stderr.lines().count() == 1 && stderr.contains("--reinit"), "{stderr}");

    let taught = sdg(&[&teach[..], &["--reinit", "roi_heads.keypoint_head.score_lowres"]].concat());
    let (stdout, stderr) = (text(taught.stdout), text(taught.stderr));
    assert!(stdout.contains("reinit      roi_heads.keypoint_head.score_lowres.weight"), "{stdout}");
    assert!(stdout.contains("0 missing, 0 mismatched, 0 unused, 2 re-initialised"), "{stdout}");
    // In one step, a random network learns too little: it fails validation and is not kept.
    assert!(stderr.contains("teaching: step 1 of 1"), "{stderr}");
    assert!(stderr.lines().last().unwrap().contains("held-back samples: too few for a usable model"), "{stderr}");
    assert_eq!(taught.status.code(), Some(1));
    assert!(!Path::new(&out).exists());
}

/// Asserts that a backbone fills the whole backbone of a network and no other part.
fn assert_fills_backbone(path: &Path, network: &RcnnConfig, unused: &[&str]) -> BaseWeights {
    let mut told = Vec::new();
    let base = base_weights::read(path, network, &[], &mut |report| {
        told = report.unused.clone();
        Ok(())
    })
    .unwrap();
    assert_eq!(told, unused);
    let (_, report) = state_dict::import(network.init(&Device::flex(), 1).unwrap(), &base.parameters);
    assert_eq!((report.applied.len(), report.unused.len(), report.mismatched.len()), (base.parameters.len(), 0, 0));
    assert!(report.applied.iter().all(|name| name.starts_with("backbone.bottom_up.")));
    assert!(
        report.missing.iter().all(|name| !name.starts_with("backbone.bottom_up.") && base.reinitialized.contains(name))
    );
    base
}

/// A narrow pyramid and narrow heads, which these tests do not use.
fn with_narrow_heads(mut network: RcnnConfig) -> RcnnConfig {
    network.fpn.channels = 8;
    network.roi_heads.box_head.fc_channels = 8;
    network
}

#[test]
fn resnets_of_three_depths_fill_a_backbone_straight_and_converted() {
    let folder = tempfile::tempdir().unwrap();
    let [theirs, ours] = ["theirs.safetensors", "ours.safetensors"].map(|name| folder.path().join(name));
    for (model, num_blocks, bottleneck) in
        [("resnet18", [2, 2, 2, 2], false), ("resnet34", [3, 4, 6, 3], false), ("resnet50", [3, 4, 6, 3], true)]
    {
        let mut network = with_narrow_heads(r50_torchvision(RcnnKind::Faster { num_classes: 1 }));
        network.backbone.num_blocks = num_blocks;
        if !bottleneck {
            network.backbone.block = BlockKind::Basic;
            network.backbone.res2_channels = 64;
        }
        write_torchvision_model(model, &theirs);
        let straight = assert_fills_backbone(&theirs, &network, &["fc.bias", "fc.weight"]);
        // A classifier's norms add 1e-5 to the variance, which is 1 here; those of torchvision's detectors add nothing.
        let variances = &straight.parameters["backbone.bottom_up.res3.0.conv2.norm.running_var"].values;
        assert!(variances.iter().all(|variance| *variance == 1.0 + 1e-5), "{model}: {variances:?}");
        let output = sdg(&["weights", "convert", theirs.to_str().unwrap(), ours.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let stdout = text(output.stdout);
        assert!(
            stdout.contains("unused      fc.weight") && stdout.contains("0 missing, 0 mismatched, 2 unused"),
            "{stdout}"
        );
        let converted = assert_fills_backbone(&ours, &network, &[]);
        assert_eq!(converted.parameters, straight.parameters, "{model}");
        // Our names hide the program, but not the input that the weights are for.
        let other = r50_detectron2(RcnnKind::Faster { num_classes: 1 });
        let refused = format!("{:#}", base_weights::read(&ours, &other, &[], &mut |_| Ok(())).unwrap_err());
        assert!(refused.contains("torchvision's for r50-torchvision"), "{model}: {refused}");
    }
}

/// The network with the widths of `msra_r50.pkl`.
fn narrow_r50() -> RcnnConfig {
    let mut network = with_narrow_heads(r50_detectron2(RcnnKind::Faster { num_classes: 1 }));
    (network.backbone.stem_channels, network.backbone.res2_channels) = (2, 4);
    if let BlockKind::Bottleneck { inner_channels, .. } = &mut network.backbone.block {
        *inner_channels = 1;
    }
    network
}

#[test]
fn msra_s_resnet_50_of_caffe2_fills_a_backbone() {
    let path = fixture("msra_r50.pkl");
    // The bias of the stem belongs to a norm that is already folded; Detectron2 omits it as well.
    let base = assert_fills_backbone(Path::new(&path), &narrow_r50(), &["conv1_b"]);
    let values = |name: &str| &base.parameters[&format!("backbone.bottom_up.{name}")].values;
    assert_eq!(
        (&values("stem.conv1.norm.running_mean")[..], &values("stem.conv1.norm.running_var")[..]),
        (&[0.0; 2][..], &[1.0; 2][..])
    );
    // The fixture's scales begin at a quarter.
    assert_eq!(values("stem.conv1.norm.weight"), &[0.25, 0.5]);
}

/// Base weights of this project for every head, except the scores of classes.
fn write_own_weights(path: &Path) {
    let mut network = edge(NUM_KEYPOINTS);
    network.roi_heads.mask_head = edge_of(RcnnKind::Mask { num_classes: 1 }).roi_heads.mask_head;
    let mut parameters = state_dict::export(&network.init(&Device::flex(), 3).unwrap());
    parameters.retain(|name, _| !name.contains("cls_score"));
    let names = ["bias", "weight"].map(|name| format!("roi_heads.box_predictor.cls_score.{name}"));
    let origin = BTreeMap::from([("seed".to_owned(), "3".to_owned())]);
    let file = BaseWeightsFile { preset: "edge".into(), reinitialized: names.into(), parameters, origin };
    fs::write(path, file.to_bytes()).unwrap();
}

#[test]
fn a_part_to_initialise_is_a_whole_name_in_our_weights_and_in_imported_ones() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own.safetensors");
    write_own_weights(&own);
    let imported = fixture("msra_r50.pkl");
    let read = |part: &str| {
        let parts = [part.to_owned()];
        let own = base_weights::read_own(&own, &TeachOptions::new(1), &parts).map(|read| read.unwrap().0);
        [own, base_weights::read(Path::new(&imported), &narrow_r50(), &parts, &mut |_| Ok(()))]
    };
    for refused in read("roi_heads.box") {
        let refused = format!("{:#}", refused.unwrap_err());
        assert!(refused.contains("found \"roi_heads.box\""), "{refused}");
    }
    // Our weights leave the scores out, and the imported ones have no heads.
    let [own, imported] = read("roi_heads.box_predictor").map(Result::unwrap);
    let scores = "roi_heads.box_predictor.cls_score.weight";
    assert!(own.reinitialized.contains(scores) && imported.reinitialized.contains(scores));
    // Otherwise our weights would compute the scores from views of the part.
    assert!(own.not_imprinted.contains(scores));
}

#[test]
fn weights_of_our_own_are_a_start_for_every_network_and_none_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (own, out, demonstration) = (at("own.safetensors"), at("part.sdg"), demonstration());
    write_own_weights(Path::new(&own));
    let teach = |arguments: &[&str]| {
        let output = sdg(&[&["teach", "--demo", &demonstration, "--out", &out, "--steps", "2"], arguments].concat());
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    // In two steps the network learns too little; an error in the weights would have been reported earlier.
    for model in ["A", "D"] {
        let (code, stdout, stderr) = teach(&["--model", model, "--base-weights", &own]);
        assert!(stdout.contains("own.safetensors: seed 3"), "{stdout}");
        assert!(stderr.contains("held-back samples: too few for a usable model"), "{model}: {stderr}");
        assert_eq!(code, Some(1));
    }
    let (_, stdout, stderr) = teach(&["--base-weights", "none"]);
    assert!(!stdout.contains("base weights") && stderr.contains("too few for a usable model"), "{stdout} {stderr}");
    let (_, _, stderr) = teach(&["--base-weights", &own, "--preset", "paper"]);
    assert!(stderr.contains("weights for preset edge instead of paper"), "{stderr}");
    let (_, _, stderr) = teach(&["--base-weights", &own, "--reinit", "roi_heads.nose"]);
    assert!(stderr.contains("found \"roi_heads.nose\""), "{stderr}");
}

#[test]
fn weights_that_cannot_be_a_start_are_refused_before_teaching() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.sdg");
    let (demonstration, out) = (demonstration(), out.to_str().unwrap());
    let narrow = fixture("detectron2_keypoint.pkl");
    for (arguments, exit, part) in [
        (
            &["--preset", "r50-torchvision"][..],
            2,
            "--base-weights: expected base weights for the preset r50-torchvision, found none in this build",
        ),
        (&["--reinit", "roi_heads"], 2, "--base-weights"),
        (&["--base-weights", "/nowhere.pth"], 1, "/nowhere.pth"),
        (&["--preset", "r50-detectron2", "--base-weights", &narrow], 1, "of another shape"),
        (&["--preset", "r50-torchvision", "--base-weights", &narrow], 1, "Detectron2's weights are for r50-detectron2"),
        (
            &["--preset", "r50-detectron2", "--base-weights", &narrow, "--reinit", "roi_heads.box"],
            1,
            "roi_heads.box_head, roi_heads.box_predictor, roi_heads.keypoint_head, found \"roi_heads.box\"",
        ),
    ] {
        let output = sdg(&[&["teach", "--demo", &demonstration, "--out", out], arguments].concat());
        let stderr = text(output.stderr);
        assert!(stderr.contains(part), "{arguments:?}: {stderr}");
        assert_eq!(output.status.code(), Some(exit), "{arguments:?}: {stderr}");
    }
    assert!(!Path::new(out).exists());
}
