//! `sdg devices` and `--device`, called as a user would, on all devices of this build.

use std::path::Path;

use crate::support::sdg;
use sdg_grasp::ComputeBackend;
use serde_json::Value;

#[test]
fn what_there_is_is_listed() {
    let output = sdg(&["devices", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let line: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(line["default"], "flex");
    let listed = line["backends"].as_array().unwrap();
    assert_eq!(listed.len(), ComputeBackend::ALL.len());
    for (listed, backend) in listed.iter().zip(ComputeBackend::ALL) {
        assert_eq!((&listed["backend"], &listed["built"]), (&backend.name().into(), &backend.is_built().into()));
    }
    assert!(listed[0]["devices"][0].as_str().unwrap().contains("threads"), "{line}");
    let text = String::from_utf8(sdg(&["devices"]).stdout).unwrap();
    assert!(text.lines().count() >= ComputeBackend::ALL.len() && text.starts_with("flex     CPU"), "{text}");
}

#[test]
fn a_device_that_is_not_there_is_one_clear_line() {
    let image = shipped("image.png");
    let detect = |device: &str| sdg(&["detect", "--grasp-model", "/nowhere.sdg", "--device", device, &image]);
    for backend in ComputeBackend::ALL.into_iter().filter(|backend| !backend.is_built()) {
        let output = detect(backend.name());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(stderr.contains("--device") && stderr.contains(&format!("--features {backend}")), "{stderr}");
    }
    let unknown = detect("gpu");
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8(unknown.stderr).unwrap().contains("flex, ndarray, wgpu, cuda"));
}

fn shipped(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations/pendulum");
    folder.join(name).to_str().unwrap().to_owned()
}

/// The outputs of Detectron2 and torchvision, stage by stage, within the tolerances of flex.
#[test]
fn the_originals_outputs_are_met_on_every_device() {
    let golden = |name: &str| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
        folder.join(name).to_str().unwrap().to_owned()
    };
    // Flex is compared in the detection crate.
    let others = ComputeBackend::ALL.into_iter().filter(|b| b.is_built() && *b != ComputeBackend::Flex);
    for backend in others {
        for case in ["detectron2", "torchvision"]
            .into_iter()
            .flat_map(|numerics| ["faster", "keypoint", "mask"].map(|kind| format!("{numerics}/{kind}")))
        {
            let [weights, config, against] = ["weights.safetensors", "config.json", "expected.safetensors"]
                .map(|name| golden(&format!("{case}/{name}")));
            let image = golden("detectron2/input.png");
            let files = ["--config", &config, "--image", &image, "--against", &against];
            let arguments = [&["weights", "verify", &weights], &files[..], &["--device", backend.name()]].concat();
            let output = sdg(&arguments);
            let stdout = String::from_utf8(output.stdout).unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            println!("{case} on {backend}\n{stdout}");
            assert_eq!(output.status.code(), Some(0), "{case} on {backend}: {stderr}\n{stdout}");
        }
    }
}
