//! The grasp model as bytes: one self-describing safetensors file.
//!
//! ```text
//! metadata   format_version, model, preset, object, keypoint_count, input_size, angle_reference_deg, grasp_offset_px
//!            teaching       seed, samples, steps, seconds, validation results, base weights' hash   (JSON)
//!            network        the detector's configuration; none in model S                           (JSON)
//!            orientation    the orientation CNN's configuration; in model A alone                   (JSON)
//!            comparison     the comparison network's configuration, where there is one        (JSON)
//!            calibration    of the network's score; resemblance of other objects to the part         (JSON)
//!            demonstrations marks of each, in pixels of its cut-out                                 (JSON)
//! tensors    network.NAME              f16
//!            orientation.NAME          f16
//!            comparison.NAME           f16
//!            demonstrations.I.cutout   u8, a PNG file
//! ```

use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;

use burn::tensor::Device;
use image::ImageFormat;
use safetensors::{Dtype, SafeTensors};
use sdg_comparison::ComparisonConfig;
use sdg_demonstration::{ImageLimits, PictureError, decode_image};
use sdg_detection::RcnnConfig;
use sdg_geometry::RotationalSymmetry;
use sdg_layers::state_dict::{self, StateDict, WeightTensor};
use sdg_orientation::OrientationConfig;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::check_config::CheckConfig;
use crate::cutout_budget::{CutoutBudget, check_count};
use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts};
use crate::model::GraspModel;
use crate::models::mask::MaskMatcher;
use crate::models::{self, Network, Reading};
use crate::safetensors_file::{self, TensorBytes};
use crate::taught::TaughtDemonstration;
use crate::taught_marks::TaughtMarks;

/// The version that this code writes. It is increased by any change that an older reader would misread.
pub const FORMAT_VERSION: u32 = 3;

/// Maximum number of turns of a symmetry: one per degree.
const MAX_TURNS: u32 = 360;

/// The metadata of a file, without its weights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    /// The grasp model's kind.
    pub model: ModelKind,
    /// The preset's name.
    pub preset: String,
    /// The object's name.
    pub object: String,
    /// How the model was taught.
    pub teaching: TeachingFacts,
}

impl GraspModel {
    /// The model as a file's bytes; the same model gives the same bytes.
    ///
    /// # Errors
    /// A cut-out that cannot be coded as PNG.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut tensors = BTreeMap::new();
        let mut put_weights = |module: &str, weights: StateDict| {
            for (name, weight) in weights {
                tensors.insert(format!("{module}.{name}"), (weight.shape, TensorBytes::halves(&weight.values)));
            }
        };
        if let Some(Network { detector, reading, comparison }) = &self.network {
            put_weights("network", state_dict::export(detector));
            if let Reading::BoxAndCrop(orientation) = reading {
                put_weights("orientation", orientation.state_dict());
            }
            if let Some(comparison) = comparison {
                put_weights("comparison", state_dict::export(comparison));
            }
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
        put("model", self.kind().to_string());
        put("preset", self.preset.clone());
        put("object", self.object().to_owned());
        put("keypoint_count", if self.kind().has_keypoints() { crate::NUM_KEYPOINTS } else { 0 }.to_string());
        put("angle_reference_deg", first.grasp.angle().degrees().to_string());
        put("grasp_offset_px", to_json(&[offset.x, offset.y]));
        put("teaching", to_json(&self.facts));
        if let Some(Network { detector, reading, comparison }) = &self.network {
            put("input_size", to_json(&detector.config().input.resize));
            put("network", to_json(detector.config()));
            if let Reading::BoxAndCrop(orientation) = reading {
                put("orientation", to_json(orientation.config()));
            }
            if let Some(comparison) = comparison {
                put("comparison", to_json(comparison.config()));
            }
        }
        put("calibration", to_json(&self.score_calibration));
        put("demonstrations", to_json(&marks));
        Ok(safetensors_file::write(&metadata, &tensors))
    }

    /// Reads a model from a file's bytes and puts it on `device`.
    ///
    /// # Errors
    /// Bytes of another format, of another version, truncated or altered.
    pub fn from_bytes(bytes: &[u8], device: &Device) -> Result<Self> {
        let metadata = read_metadata(bytes)?;
        let file = SafeTensors::deserialize(bytes).map_err(|error| GraspError::Damaged {
            expected: "all tensors that the header lists".to_owned(),
            found: error.to_string(),
        })?;

        let kind: ModelKind = metadata.text("model")?.parse()?;
        let marks: Vec<TaughtMarks> = metadata.json("demonstrations")?;
        check_count(marks.len())?;
        let mut facts: TeachingFacts = metadata.json("teaching")?;
        let region = facts.region.take();
        check_values(&facts, &marks)?;
        let mut budget = CutoutBudget::default();
        let demonstrations = marks
            .into_iter()
            .enumerate()
            .map(|(i, marks)| {
                let png = tensor(&file, &format!("demonstrations.{i}.cutout"), Dtype::U8)?;
                let limits = budget.limits(&marks);
                let cutout = decode_image(png.data(), &limits).map_err(|error| not_a_cutout(error, &limits))?;
                budget.take(&cutout, &marks)?;
                let mut check = CheckConfig::DEFAULT;
                if let Some([low, high]) = facts.size_tolerance {
                    check.search.scales = low..=high;
                }
                if let Some(negatives) = facts.negatives {
                    check.score.bias += negatives.log_odds;
                }
                TaughtDemonstration::with_config(cutout, marks, check)
            })
            .collect::<Result<Vec<_>>>()?;

        let model = Self {
            preset: metadata.text("preset")?.to_owned(),
            score_calibration: metadata.json("calibration")?,
            facts,
            network: read_network(kind, &metadata, &file, &demonstrations, device)?,
            demonstrations,
        };
        model.with_region(region)
    }
}

/// Refuses values that teaching cannot give: with them, a search would take all memory or hours.
fn check_values(facts: &TeachingFacts, marks: &[TaughtMarks]) -> Result<()> {
    let damaged = |expected: String, found: String| Err(GraspError::Damaged { expected, found });
    if let Some(lengths) = &facts.lengths {
        lengths.check()?;
    }
    if let RotationalSymmetry::Fold(turns) = facts.symmetry
        && !(1..=MAX_TURNS).contains(&turns)
    {
        return damaged(format!("a symmetry of 1 to {MAX_TURNS} turns"), turns.to_string());
    }
    for TaughtMarks { photo_size, photo_middle, .. } in marks {
        if let Some([width, height]) = photo_size
            && *width.min(height) == 0
        {
            return damaged("a photo with pixels".to_owned(), format!("{width} × {height}"));
        }
        // A photo may be one pixel high.
        let max_px = ImageLimits::default().max_pixels as f64;
        if let Some([x, y]) = photo_middle
            && x.abs().max(y.abs()) > max_px
        {
            let expected = format!("a photo whose centre is at most {max_px} pixels from the part");
            return damaged(expected, format!("({x}, {y})"));
        }
    }
    Ok(())
}

/// The networks of a model of this kind; none for model S.
fn read_network(
    kind: ModelKind,
    metadata: &Metadata,
    file: &SafeTensors<'_>,
    demonstrations: &[TaughtDemonstration],
    device: &Device,
) -> Result<Option<Network>> {
    let reading = match kind {
        ModelKind::S => return Ok(None),
        ModelKind::A => {
            let config: OrientationConfig = metadata.json("orientation")?;
            let (orientation, report) = state_dict::import(config.init_blank(device)?, &weights(file, "orientation")?);
            check_complete(&report, "orientation CNN")?;
            Reading::BoxAndCrop(Box::new(orientation))
        }
        ModelKind::B => Reading::BoxAndKeypoints,
        ModelKind::C => Reading::Keypoints,
        ModelKind::D => Reading::Mask(MaskMatcher::new(demonstrations)?),
    };
    let config: RcnnConfig = metadata.json("network")?;
    models::check_heads(kind, &config)?;
    let (detector, report) = state_dict::import(config.init_blank(device)?, &weights(file, "network")?);
    check_complete(&report, "network")?;
    let comparison = match metadata.0.contains_key("comparison") {
        true => {
            let config: ComparisonConfig = metadata.json("comparison")?;
            let (comparison, report) = state_dict::import(config.init_blank(device)?, &weights(file, "comparison")?);
            check_complete(&report, "comparison network")?;
            Some(comparison)
        }
        false => None,
    };
    Ok(Some(Network { detector, reading, comparison }))
}

/// The weights whose names start with a module's.
fn weights(file: &SafeTensors<'_>, module: &str) -> Result<StateDict> {
    let mut dict = StateDict::new();
    for name in file.names() {
        if let Some(parameter) = name.strip_prefix(module).and_then(|rest| rest.strip_prefix('.')) {
            let weight = tensor(file, name, Dtype::F16)?;
            let values = safetensors_file::values_from_halves(weight.data());
            dict.insert(parameter.to_owned(), WeightTensor { shape: weight.shape().to_vec(), values });
        }
    }
    Ok(dict)
}

fn check_complete(report: &state_dict::ImportReport, module: &str) -> Result<()> {
    if report.is_complete() {
        return Ok(());
    }
    let count = report.applied.len() + report.missing.len() + report.mismatched.len();
    Err(GraspError::Damaged {
        expected: format!("the {count} parameters of the {module} that the file describes"),
        found: incomplete(report),
    })
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

fn not_a_cutout(error: PictureError, limits: &ImageLimits) -> GraspError {
    let (expected, found) = match error {
        PictureError::EnormousImage { width, height, .. } => (
            format!("a photo of the part of at most {} pixels, according to its marks", limits.max_pixels),
            format!("{width} × {height}"),
        ),
        other => ("a photo of the part that can be decoded".to_owned(), other.to_string()),
    };
    GraspError::Damaged { expected, found }
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

/// Reads the header and checks that the file is a grasp model of this version.
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

/// Describes bytes that are not a safetensors file, for the error.
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
    kind.unwrap_or_else(|| format!("{} bytes that are not a safetensors file, or only its beginning", bytes.len()))
}

fn to_json<T: Serialize>(value: &T) -> String {
    // Serialisation of plain data to a string cannot fail.
    serde_json::to_string(value).unwrap_or_default()
}

/// The metadata of a file, without reading its tensors.
///
/// # Errors
/// Bytes of another format, of another version, or of another length than the header states.
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
    use crate::cutout_budget::MAX_DEMONSTRATIONS;
    use crate::lengths::Lengths;
    use crate::network_calibration::NetworkCalibration;
    use crate::region::SearchRegion;
    use crate::score_calibration::ScoreCalibration;
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_detection::presets::edge_of;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    /// A model of an untaught network, with everything that a file contains.
    fn untaught(kind: ModelKind) -> GraspModel {
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
            photo_size: None,
            photo_middle: None,
        };
        let demonstrations = vec![TaughtDemonstration::from_parts(cutout, marks).unwrap()];
        let network = models::rcnn_kind(kind).map(|rcnn| Network {
            detector: edge_of(rcnn).init(&Device::flex(), 3).unwrap(),
            reading: match kind {
                ModelKind::A => {
                    Reading::BoxAndCrop(Box::new(OrientationConfig::edge().init(&Device::flex(), 3).unwrap()))
                }
                ModelKind::B => Reading::BoxAndKeypoints,
                ModelKind::D => Reading::Mask(MaskMatcher::new(&demonstrations).unwrap()),
                _ => Reading::Keypoints,
            },
            comparison: Some(ComparisonConfig::edge().init(&Device::flex(), 3).unwrap()),
        });
        GraspModel {
            preset: "edge".to_owned(),
            network,
            demonstrations,
            score_calibration: ScoreCalibration {
                network: NetworkCalibration::NEUTRAL,
                evidence: None,
                resemblance: 0.3,
            },
            facts: TeachingFacts {
                seed: 3,
                symmetry: RotationalSymmetry::None,
                size_tolerance: Some([0.75, 1.35]),
                lengths: None,
                region: None,
                samples: 0,
                steps: 0,
                seconds: 0.5,
                validation: None,
                orientation: None,
                negatives: None,
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
        for kind in ModelKind::ALL {
            let bytes = untaught(kind).to_bytes().unwrap();
            assert!(bytes.len() < 12_000_000, "{kind}: {} bytes", bytes.len());
            let read = GraspModel::from_bytes(&bytes, &Device::flex()).unwrap();
            assert_eq!(read.kind(), kind);
            // Half precision was rounded once; rounding again changes nothing.
            assert_eq!(read.to_bytes().unwrap(), bytes, "{kind}");
            let summary = summarize(&bytes).unwrap();
            assert_eq!((summary.model, summary.object.as_str()), (kind, "bar"));
        }
    }

    #[test]
    fn a_file_keeps_the_region_and_one_without_has_none() {
        let whole = untaught(ModelKind::S);
        assert!(!String::from_utf8_lossy(&whole.to_bytes().unwrap()).contains("region"));
        let region = SearchRegion::new([10, 20, 200, 110]).of_picture([640, 480]);
        let bytes = whole.with_region(Some(region)).unwrap().to_bytes().unwrap();
        assert_eq!(GraspModel::from_bytes(&bytes, &Device::flex()).unwrap().region(), Some(&region));
        assert_eq!(summarize(&bytes).unwrap().teaching.region, Some(region));
        let forged = with_metadata(&bytes, r#"\"height\":110"#, r#"\"height\":999"#);
        let refused = GraspModel::from_bytes(&forged, &Device::flex()).unwrap_err().to_string();
        assert!(refused.contains("within the picture of 640 × 480"), "{refused}");
    }

    fn refused(model: &GraspModel) -> String {
        GraspModel::from_bytes(&model.to_bytes().unwrap(), &Device::flex()).unwrap_err().to_string()
    }

    #[test]
    fn a_cut_out_larger_than_its_marks_is_refused() {
        let mut forged = untaught(ModelKind::S);
        forged.demonstrations[0].cutout = RgbImage::new(400, 400);
        let refused = refused(&forged);
        assert!(refused.contains("of at most 38976 pixels, according to its marks, found 400 × 400"), "{refused}");
    }

    #[test]
    fn values_that_teaching_cannot_give_are_refused() {
        let message = |change: fn(&mut GraspModel)| {
            let mut forged = untaught(ModelKind::S);
            change(&mut forged);
            refused(&forged)
        };
        // The search would resize the cut-out to an infinite size.
        let photo = message(|model| model.demonstrations[0].marks.photo_size = Some([640, 0]));
        assert!(photo.contains("a photo with pixels, found 640 × 0"), "{photo}");
        let middle = message(|model| model.demonstrations[0].marks.photo_middle = Some([20.0, -1e9]));
        assert!(middle.contains("at most 210000000 pixels from the part, found (20, -1000000000)"), "{middle}");
        let mut long = untaught(ModelKind::S);
        long.demonstrations[0].marks.photo_middle = Some([20.0, 150_000.0]);
        assert!(GraspModel::from_bytes(&long.to_bytes().unwrap(), &Device::flex()).is_ok());
        let none = message(|model| model.facts.symmetry = RotationalSymmetry::Fold(0));
        assert!(none.contains("a symmetry of 1 to 360 turns, found 0"), "{none}");
        let many = message(|model| model.facts.symmetry = RotationalSymmetry::Fold(361));
        assert!(many.contains("a symmetry of 1 to 360 turns, found 361"), "{many}");
        let tiny = message(|model| model.facts.lengths = Some(Lengths::of_level_photos(0.0, 0.02, 0.01)));
        assert!(tiny.contains("1 to 1000000 pixels per metre"), "{tiny}");
    }

    #[test]
    fn more_demonstrations_than_a_model_holds_are_refused() {
        let mut forged = untaught(ModelKind::S);
        forged.demonstrations = vec![forged.demonstrations[0].clone(); MAX_DEMONSTRATIONS + 1];
        assert!(refused(&forged).contains("at most 100 demonstrations, found 101"), "{}", refused(&forged));
        forged.demonstrations.pop();
        assert!(GraspModel::from_bytes(&forged.to_bytes().unwrap(), &Device::flex()).is_ok());
    }

    #[test]
    fn an_outline_of_a_file_is_thinned() {
        let mut forged = untaught(ModelKind::S);
        let corners = forged.demonstrations[0].marks.outline.clone().unwrap().vertices;
        let along = |i: usize, k: usize| corners[i] + (corners[(i + 1) % 4] - corners[i]) * (k as f64 / 5000.0);
        let vertices = (0..20_000).map(|n| along(n / 5000, n % 5000)).collect();
        forged.demonstrations[0].marks.outline = Some(Polygon { vertices });
        let read = GraspModel::from_bytes(&forged.to_bytes().unwrap(), &Device::flex()).unwrap();
        let outline = read.demonstrations[0].marks.outline.as_ref().unwrap();
        assert_eq!((outline.vertices.len(), outline.bounds()), (256, forged.demonstrations[0].marks.bbox));
    }

    #[test]
    fn another_letter_on_a_file_is_an_error_that_says_what_is_lacking() {
        let bytes = untaught(ModelKind::C).to_bytes().unwrap();
        let read = |letter: &str| {
            let altered = with_metadata(&bytes, r#""model":"C""#, &format!(r#""model":"{letter}""#));
            GraspModel::from_bytes(&altered, &Device::flex()).unwrap_err().to_string()
        };
        assert!(read("A").contains("metadata \"orientation\""), "{}", read("A"));
        assert!(read("D").contains("0 keypoints and masks, found"), "{}", read("D"));
        assert!(read("X").contains("expected a grasp model out of A, B, C, D, S, found \"X\""), "{}", read("X"));
    }

    #[test]
    fn other_versions_are_told_apart_from_damage() {
        let bytes = untaught(ModelKind::C).to_bytes().unwrap();
        for other in ["2", "7"] {
            let file = with_metadata(&bytes, r#""format_version":"3""#, &format!(r#""format_version":"{other}""#));
            let refused = GraspModel::from_bytes(&file, &Device::flex()).unwrap_err();
            assert!(
                matches!(&refused, GraspError::OtherVersion { expected: FORMAT_VERSION, found } if found == other),
                "{refused}"
            );
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let bytes = untaught(ModelKind::C).to_bytes().unwrap();
        for length in [0, 1, 7, 8, 100, 5_000, bytes.len() / 2, bytes.len() - 1] {
            assert!(GraspModel::from_bytes(&bytes[..length], &Device::flex()).is_err(), "{length} bytes");
        }
        let mut longer = bytes;
        longer.push(0);
        assert!(GraspModel::from_bytes(&longer, &Device::flex()).is_err());
    }

    #[test]
    fn a_parameter_of_another_name_is_an_error_that_names_it() {
        let bytes = untaught(ModelKind::C).to_bytes().unwrap();
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
