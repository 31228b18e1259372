//! The grasp model as bytes: one self-describing safetensors file.
//!
//! ```text
//! metadata   format_version, model, preset, object, keypoint_count, input_size, angle_reference_deg, grasp_offset_px
//!            teaching       seed, samples, steps, seconds, validation figures, base weights' hash   (JSON)
//!            network        the detector's configuration                                            (JSON)
//!            calibration    of the network's score and of the agreement                             (JSON)
//!            demonstrations marks of each, in pixels of its cut-out                                 (JSON)
//! tensors    network.NAME              f16
//!            demonstrations.I.cutout   u8, a PNG file
//! ```

use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;

use burn::tensor::Device;
use image::ImageFormat;
use safetensors::{Dtype, SafeTensors};
use sdg_demonstration::{ImageLimits, decode_image};
use sdg_detection::RcnnConfig;
use sdg_detection::state_dict::{self, StateDict, WeightTensor};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;
use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts};
use crate::model::GraspModel;
use crate::safetensors_file::{self, TensorBytes};
use crate::taught::{TaughtDemonstration, TaughtMarks};

/// The version written and read here. Any change that an older reader would misread raises it.
pub const FORMAT_VERSION: u32 = 1;

/// More demonstrations than anybody takes; bounds the work on a forged file.
const MOST_DEMONSTRATIONS: usize = 1000;

/// The two calibrations, as stored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Calibrations {
    pub(crate) network: Calibration,
    pub(crate) agreement: Calibration,
}

/// What a file says of itself, without its weights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    /// The letter.
    pub model: ModelKind,
    /// The preset's name.
    pub preset: String,
    /// The object's name.
    pub object: String,
    /// How it was taught.
    pub teaching: TeachingFacts,
}

impl GraspModel {
    /// The model as a file's bytes; the same model gives the same bytes.
    ///
    /// # Errors
    /// A cut-out that cannot be coded as PNG.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut tensors = BTreeMap::new();
        for (name, weight) in state_dict::export(&self.network) {
            tensors.insert(format!("network.{name}"), (weight.shape, TensorBytes::halves(&weight.values)));
        }
        for (i, demonstration) in self.demonstrations.iter().enumerate() {
            let mut png = Cursor::new(Vec::new());
            demonstration.cutout.write_to(&mut png, ImageFormat::Png).map_err(|error| GraspError::Damaged {
                expected: "a cut-out that can be stored as PNG".to_owned(),
                found: error.to_string(),
            })?;
            let png = png.into_inner();
            tensors.insert(format!("demonstrations.{i}.cutout"), (vec![png.len()], TensorBytes::U8(png)));
        }

        let marks: Vec<&TaughtMarks> = self.demonstrations.iter().map(|d| &d.marks).collect();
        let first = &self.demonstrations[0].marks;
        let offset = first.grasp.center() - first.bbox.center();
        let mut metadata = BTreeMap::new();
        let mut put = |key: &str, value: String| metadata.insert(key.to_owned(), value);
        put("format_version", FORMAT_VERSION.to_string());
        put("model", self.kind.to_string());
        put("preset", self.preset.clone());
        put("object", self.object().to_owned());
        put("keypoint_count", crate::NUM_KEYPOINTS.to_string());
        put("input_size", to_json(&self.network.config().input.resize));
        put("angle_reference_deg", first.grasp.angle().degrees().to_string());
        put("grasp_offset_px", to_json(&[offset.x, offset.y]));
        put("teaching", to_json(&self.facts));
        put("network", to_json(self.network.config()));
        put("calibration", to_json(&self.calibrations));
        put("demonstrations", to_json(&marks));
        Ok(safetensors_file::write(&metadata, &tensors))
    }

    /// Reads a model from a file's bytes and puts it on `device`.
    ///
    /// # Errors
    /// Bytes that are no grasp model, one of another version, or one that was cut short or altered.
    pub fn from_bytes(bytes: &[u8], device: &Device) -> Result<Self> {
        let metadata = read_metadata(bytes)?;
        let file = SafeTensors::deserialize(bytes).map_err(|error| GraspError::Damaged {
            expected: "all tensors that the header lists".to_owned(),
            found: error.to_string(),
        })?;

        let config: RcnnConfig = metadata.json("network")?;
        let marks: Vec<TaughtMarks> = metadata.json("demonstrations")?;
        if marks.is_empty() || marks.len() > MOST_DEMONSTRATIONS {
            return Err(GraspError::Damaged {
                expected: format!("1 to {MOST_DEMONSTRATIONS} demonstrations"),
                found: marks.len().to_string(),
            });
        }
        let demonstrations = marks
            .into_iter()
            .enumerate()
            .map(|(i, marks)| {
                let png = tensor(&file, &format!("demonstrations.{i}.cutout"), Dtype::U8)?;
                let cutout = decode_image(png.data(), &ImageLimits::default())?;
                TaughtDemonstration::from_parts(cutout, marks)
            })
            .collect::<Result<Vec<_>>>()?;

        let mut dict = StateDict::new();
        for name in file.names() {
            if let Some(parameter) = name.strip_prefix("network.") {
                let weight = tensor(&file, name, Dtype::F16)?;
                let values = safetensors_file::values_from_halves(weight.data());
                dict.insert(parameter.to_owned(), WeightTensor { shape: weight.shape().to_vec(), values });
            }
        }
        let (network, report) = state_dict::import(config.init(device, 0)?, &dict);
        if !report.is_complete() {
            return Err(GraspError::Damaged {
                expected: format!("the {} parameters of the network that the file describes", report.applied.len()),
                found: incomplete(&report),
            });
        }
        Ok(Self {
            kind: metadata.text("model")?.parse()?,
            preset: metadata.text("preset")?.to_owned(),
            calibrations: metadata.json("calibration")?,
            facts: metadata.json("teaching")?,
            network,
            demonstrations,
        })
    }
}

fn incomplete(report: &state_dict::ImportReport) -> String {
    let mut parts = Vec::new();
    if let Some(name) = report.missing.first() {
        parts.push(format!("{} missing (first: {name})", report.missing.len()));
    }
    if let Some(name) = report.unused.first() {
        parts.push(format!("{} too many (first: {name})", report.unused.len()));
    }
    if let Some((name, expected, found)) = report.mismatched.first() {
        parts.push(format!("{} of another shape (first: {name}, {found:?} for {expected:?})", report.mismatched.len()));
    }
    parts.join(", ")
}

fn tensor<'a>(file: &SafeTensors<'a>, name: &str, dtype: Dtype) -> Result<safetensors::tensor::TensorView<'a>> {
    let damaged = |found: String| GraspError::Damaged { expected: format!("a tensor {name} of {dtype:?}"), found };
    let view = file.tensor(name).map_err(|error| damaged(error.to_string()))?;
    if view.dtype() != dtype {
        return Err(damaged(format!("{:?}", view.dtype())));
    }
    Ok(view)
}

struct Metadata(HashMap<String, String>);

impl Metadata {
    fn text(&self, key: &str) -> Result<&str> {
        self.0
            .get(key)
            .map(String::as_str)
            .ok_or_else(|| GraspError::Damaged { expected: format!("metadata \"{key}\""), found: "none".to_owned() })
    }

    fn json<T: DeserializeOwned>(&self, key: &str) -> Result<T> {
        serde_json::from_str(self.text(key)?).map_err(|error| GraspError::Damaged {
            expected: format!("metadata \"{key}\" as this version writes it"),
            found: error.to_string(),
        })
    }
}

/// Reads the header and makes sure that it is a grasp model of this version.
fn read_metadata(bytes: &[u8]) -> Result<Metadata> {
    let (header_length, header) =
        SafeTensors::read_metadata(bytes).map_err(|_| GraspError::NotAModel { found: describe(bytes) })?;
    let metadata = header.metadata().clone().unwrap_or_default();
    let Some(version) = metadata.get("format_version").filter(|_| metadata.contains_key("model")) else {
        return Err(GraspError::NotAModel { found: "a safetensors file without a grasp model's metadata".to_owned() });
    };
    if *version != FORMAT_VERSION.to_string() {
        return Err(GraspError::OtherVersion { expected: FORMAT_VERSION, found: version.clone() });
    }
    let expected = 8 + header_length + header.data_len();
    if bytes.len() != expected {
        return Err(GraspError::Damaged {
            expected: format!("{expected} bytes"),
            found: format!("{} bytes", bytes.len()),
        });
    }
    Ok(Metadata(metadata))
}

/// What bytes are that are no safetensors file, for the error's sake.
fn describe(bytes: &[u8]) -> String {
    let known: [(&[u8], &str); 5] = [
        (b"\x89PNG", "a PNG image"),
        (b"\xff\xd8\xff", "a JPEG image"),
        (b"PK\x03\x04", "a zip archive (a torch checkpoint?)"),
        (b"\x80\x02", "a Python pickle"),
        (b"{", "a text file"),
    ];
    if bytes.is_empty() {
        return "an empty file".to_owned();
    }
    let kind = known.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|(_, name)| (*name).to_owned());
    kind.unwrap_or_else(|| format!("{} bytes that are no safetensors file, or only the start of one", bytes.len()))
}

fn to_json<T: Serialize>(value: &T) -> String {
    // Plain data of our own; serialisation to a string cannot fail.
    serde_json::to_string(value).unwrap_or_default()
}

/// What a file says of itself; reads the header alone.
///
/// # Errors
/// As [`GraspModel::from_bytes`].
pub fn summarize(bytes: &[u8]) -> Result<ModelSummary> {
    let metadata = read_metadata(bytes)?;
    Ok(ModelSummary {
        model: metadata.text("model")?.parse()?,
        preset: metadata.text("preset")?.to_owned(),
        object: metadata.text("object")?.to_owned(),
        teaching: metadata.json("teaching")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_detection::presets;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    /// A model of an untaught network: everything that a file holds, in no time.
    fn untaught() -> GraspModel {
        let outline = Polygon::from_box(&BoundingBox { x1: 20.0, y1: 20.0, x2: 100.0, y2: 50.0 });
        let cutout = RgbImage::from_fn(120, 70, |x, y| {
            let inside = outline.contains(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            Rgb(if inside { [40, 60, 90] } else { [200, 190, 180] })
        });
        let marks = TaughtMarks {
            label: "bar".to_owned(),
            bbox: outline.bounds(),
            grasp: GraspLine::new(Point2::new(40.0, 35.0), Point2::new(80.0, 35.0)),
            outline: Some(outline),
            width_px: 30.0,
        };
        GraspModel {
            kind: ModelKind::C,
            preset: "edge".to_owned(),
            network: presets::edge(crate::NUM_KEYPOINTS).init(&Device::flex(), 3).unwrap(),
            demonstrations: vec![TaughtDemonstration::from_parts(cutout, marks).unwrap()],
            calibrations: Calibrations { network: Calibration::NEUTRAL, agreement: Calibration::NEUTRAL },
            facts: TeachingFacts {
                seed: 3,
                samples: 0,
                steps: 0,
                seconds: 0.5,
                validation_hit_rate: 0.0,
                validation_error_px: 1.0,
                validation_error_degrees: 1.0,
                base_weights_sha256: None,
            },
        }
    }

    fn with_metadata(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
        assert_eq!(from.len(), to.len(), "the header's length must not change");
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        let mut altered = bytes.to_vec();
        altered[at..at + to.len()].copy_from_slice(to.as_bytes());
        altered
    }

    #[test]
    fn a_file_gives_the_model_back() {
        let bytes = untaught().to_bytes().unwrap();
        assert!(bytes.len() < 12_000_000);
        let read = GraspModel::from_bytes(&bytes, &Device::flex()).unwrap();
        // Half precision was rounded once: a second round changes nothing.
        assert_eq!(read.to_bytes().unwrap(), bytes);
        assert_eq!(summarize(&bytes).unwrap().object, "bar");
    }

    #[test]
    fn other_versions_are_told_apart_from_damage() {
        let bytes = untaught().to_bytes().unwrap();
        let newer = with_metadata(&bytes, r#""format_version":"1""#, r#""format_version":"7""#);
        let refused = GraspModel::from_bytes(&newer, &Device::flex()).unwrap_err();
        assert!(matches!(&refused, GraspError::OtherVersion { expected: 1, found } if found == "7"), "{refused}");
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let bytes = untaught().to_bytes().unwrap();
        for length in [0, 1, 7, 8, 100, 5_000, bytes.len() / 2, bytes.len() - 1] {
            assert!(GraspModel::from_bytes(&bytes[..length], &Device::flex()).is_err(), "{length} bytes");
        }
        let mut longer = bytes;
        longer.push(0);
        assert!(GraspModel::from_bytes(&longer, &Device::flex()).is_err());
    }

    #[test]
    fn a_parameter_of_another_name_is_an_error_that_names_it() {
        let bytes = untaught().to_bytes().unwrap();
        let renamed =
            with_metadata(&bytes, "network.roi_heads.box_head.fc1.weight", "network.roi_heads.box_head.fc9.weight");
        let refused = GraspModel::from_bytes(&renamed, &Device::flex()).unwrap_err().to_string();
        assert!(refused.contains("roi_heads.box_head.fc1.weight"), "{refused}");
    }

    #[test]
    fn what_is_no_model_is_named() {
        for (bytes, name) in
            [(&b""[..], "an empty file"), (b"\x89PNG\r\n", "a PNG image"), (b"{\"a\": 1}", "a text file")]
        {
            let refused = summarize(bytes).unwrap_err().to_string();
            assert!(refused.contains(name), "{refused}");
        }
    }
}
