//! Conversion of C structures to the library's objects, and of the library's records to C structures.

use std::path::PathBuf;
use std::slice;

use sdg_bindings::{
    CameraTeaching, Contributions, DEFAULT_MIN_SCORE, Fault, FaultKind, PixelOrder, PixelShape, Record, RegionChoice,
    Result, RgbImage, RotationalSymmetry, TeachOptions, Teaching, TurnSource, View,
};

use crate::border::{check_abi, copy_text, null, path};
use crate::handles;
use crate::types::*;

/// Checks a picture and copies its pixels.
///
/// # Safety
/// `pixels` is readable for `num_bytes`, which are not changed during the call.
pub unsafe fn picture(picture: &sdg_picture) -> Result<RgbImage> {
    check_abi("sdg_picture", picture.abi_version)?;
    let fault = |text: String| Err(Fault::new(FaultKind::Picture, text));
    if picture.bits_per_channel != 8 {
        return fault(format!("expected bits_per_channel of 8, found {}", picture.bits_per_channel));
    }
    let order = match picture.order {
        SDG_RGB => PixelOrder::Rgb,
        SDG_BGR => PixelOrder::Bgr,
        found => {
            return Err(Fault::new(
                FaultKind::Argument,
                format!("expected order of SDG_RGB or SDG_BGR, found {found}"),
            ));
        }
    };
    let [height, width, channels] = [picture.height, picture.width, picture.channels].map(|number| number as usize);
    let shape = PixelShape::new(&[height, width, channels])?;
    let (row_bytes, num_bytes, row) = (picture.row_bytes, picture.num_bytes, width * channels);
    if row_bytes < row {
        return fault(format!(
            "expected row_bytes of at least {row} for {width} pixels of {channels}, found {row_bytes}"
        ));
    }
    // The last row may have no padding.
    let needed = row_bytes.checked_mul(height - 1).and_then(|above| above.checked_add(row));
    if needed.is_none_or(|needed| needed > num_bytes) || num_bytes > isize::MAX as usize {
        return fault(format!("expected the bytes of {height} rows of {row_bytes}, found num_bytes of {num_bytes}"));
    }
    if picture.pixels.is_null() {
        return Err(null("pixels"));
    }
    // SAFETY: not null, the length fits isize, bytes need no alignment, and the caller promises the rest.
    let pixels = unsafe { slice::from_raw_parts(picture.pixels, num_bytes) };
    Ok(shape.copy(order, |row, column, channel| pixels[row * row_bytes + column * channels + channel]))
}

/// The search options for a picture.
pub fn view(options: Option<&sdg_options>) -> Result<View> {
    let Some(options) = options else { return Ok(View::default()) };
    check_abi("sdg_options", options.abi_version)?;
    let region = match options.region_kind {
        SDG_REGION_OF_MODEL => RegionChoice::OfModel,
        SDG_REGION_ALL => RegionChoice::All,
        SDG_REGION_PART => RegionChoice::Part(options.region),
        found => {
            let text = format!("expected region_kind of SDG_REGION_OF_MODEL, _ALL or _PART, found {found}");
            return Err(Fault::new(FaultKind::Argument, text));
        }
    };
    let camera = if options.camera == 0 { None } else { Some(handles::camera(options.camera)?) };
    Ok(View { camera, region, threads: (options.threads > 0).then_some(options.threads as usize) })
}

/// The default seed of `sdg teach`.
const DEFAULT_SEED: u64 = 1;
/// Maximum number of training steps.
const MAX_STEPS: u64 = 1_000_000;

/// The inputs and options of a teaching run.
///
/// # Safety
/// The pointers are null or zero-terminated strings.
pub unsafe fn teaching(from: &sdg_teaching) -> Result<(Teaching, TeachOptions)> {
    check_abi("sdg_teaching", from.abi_version)?;
    let mut options = TeachOptions::new(if from.seed == 0 { DEFAULT_SEED } else { from.seed });
    if !from.model.is_null() {
        // SAFETY: not null, and the caller promises the rest.
        let letter = unsafe { path(from.model, "model")? }.to_string_lossy();
        options.kind = letter.parse().map_err(|error| Fault::new(FaultKind::Argument, format!("{error}")))?;
    }
    options.steps = match from.steps {
        0 => None,
        steps @ ..=MAX_STEPS => Some(steps as usize),
        found => {
            return Err(Fault::new(FaultKind::Argument, format!("expected steps up to {MAX_STEPS}, found {found}")));
        }
    };
    options.symmetry = match from.symmetry {
        0 | 1 => RotationalSymmetry::None,
        SDG_SYMMETRY_FULL => RotationalSymmetry::Full,
        count @ ..=360 => RotationalSymmetry::Fold(count),
        found => {
            let text = format!("expected symmetry of 1 to 360 equal turns, or SDG_SYMMETRY_FULL, found {found}");
            return Err(Fault::new(FaultKind::Argument, text));
        }
    };
    // SAFETY: the caller meets the conditions of `# Safety`.
    let file = |pointer, name: &str| unsafe { path(pointer, name) }.map(PathBuf::from);
    let camera = if from.camera.is_null() {
        if from.mark_height_m != 0.0 || from.grasp_height_m != 0.0 {
            let text = "expected camera with mark_height_m and grasp_height_m, found heights without a camera";
            return Err(Fault::new(FaultKind::Argument, text));
        }
        None
    } else {
        let mark_height_m = height("mark_height_m", from.mark_height_m)?;
        let grasp_height_m = match from.grasp_height_m {
            0.0 => 0.5 * mark_height_m,
            told => height("grasp_height_m", told)?,
        };
        Some(CameraTeaching { file: file(from.camera, "camera")?, mark_height_m, grasp_height_m })
    };
    let demonstrations = vec![(file(from.photo, "photo")?, file(from.marks, "marks")?)];
    Ok((Teaching { demonstrations, negatives: Vec::new(), camera }, options))
}

/// Checks a height above the table, in metres; a height given in millimetres would exceed the maximum.
fn height(name: &str, height_m: f64) -> Result<f64> {
    const MAX_HEIGHT_M: f64 = 0.5;
    if (0.0..=MAX_HEIGHT_M).contains(&height_m) {
        return Ok(height_m);
    }
    let text = format!("expected {name} of 0 to {MAX_HEIGHT_M} metres, found {height_m}: millimetres given as metres?");
    Err(Fault::new(FaultKind::Argument, text))
}

/// Converts a record; missing numbers are NaN.
pub fn detection(record: &Record) -> sdg_detection {
    let found = &record.found.detection;
    let mut refused = [0; SDG_REFUSED_BYTES as usize];
    // SAFETY: the buffer has the length passed with it.
    unsafe { copy_text(found.refused.unwrap_or_default(), refused.as_mut_ptr(), refused.len()) };
    let absent = f64::NAN;
    let pose = record.found.pose.as_ref();
    let of_pose = |number: fn(&sdg_bindings::PoseRecord) -> f64| pose.map_or(0.0, number);
    sdg_detection {
        score: found.score,
        network_score: found.network_score.unwrap_or(absent),
        agreement: found.agreement.unwrap_or(absent),
        size: record.size.unwrap_or(absent),
        bounds: found.bounds,
        grasp_x: found.grasp.x,
        grasp_y: found.grasp.y,
        grasp_angle_deg: found.grasp.angle_deg,
        grasp_width_px: found.grasp.width_px,
        p_m: pose.map_or([0.0; 3], |pose| pose.p_m),
        yaw_deg: of_pose(|pose| pose.yaw_deg),
        opening_m: of_pose(|pose| pose.opening_m),
        sigma_mm: of_pose(|pose| pose.sigma_mm),
        sigma_deg: of_pose(|pose| pose.sigma_deg),
        evidence: evidence(found.evidence.as_ref()),
        frame: pose.map_or(SDG_FRAME_NONE, |pose| match pose.frame {
            sdg_bindings::Frame::Table => SDG_FRAME_TABLE,
            sdg_bindings::Frame::Base => SDG_FRAME_BASE,
        }),
        is_accepted: u32::from(found.score >= DEFAULT_MIN_SCORE),
        turn_source: match found.turn_source {
            TurnSource::Crop => SDG_TURN_CROP,
            TurnSource::Keypoints => SDG_TURN_KEYPOINTS,
            TurnSource::Texture => SDG_TURN_TEXTURE,
            TurnSource::Outline => SDG_TURN_OUTLINE,
            TurnSource::Search => SDG_TURN_SEARCH,
            _ => SDG_TURN_OTHER,
        },
        num_polygon: found.polygon.as_ref().map_or(0, |polygon| polygon.len() as u32),
        num_keypoints: found.keypoints.len() as u32,
        refused,
    }
}

fn evidence(found: Option<&Contributions>) -> sdg_evidence {
    let of = |number: fn(&Contributions) -> f64| found.map_or(f64::NAN, number);
    sdg_evidence {
        network: found.and_then(|found| found.network).unwrap_or(f64::NAN),
        edges: of(|found| found.edges),
        surface: of(|found| found.surface),
        hue: of(|found| found.hue),
        visible: of(|found| found.visible),
        size: of(|found| found.size),
        outside: of(|found| found.outside),
        resemblance: of(|found| found.resemblance),
        likeness: of(|found| found.likeness),
        details: of(|found| found.details),
        table: of(|found| found.table),
        rim: of(|found| found.rim),
        added: of(|found| found.added),
        mirror: of(|found| found.mirror),
    }
}

/// Copies as many rows of numbers as fit. Null is an error only if there is something to copy: a caller may have no
/// array for no rows.
///
/// # Safety
/// `out` is null or writable for `max_rows` rows of `N` numbers.
pub unsafe fn copy_rows<const N: usize>(rows: &[[f64; N]], out: *mut f64, max_rows: usize) -> Result<()> {
    let copied = rows[..rows.len().min(max_rows)].as_flattened();
    if copied.is_empty() {
        return Ok(());
    }
    if out.is_null() {
        return Err(null("numbers"));
    }
    // SAFETY: not null, the caller promises the room, and `rows` is Rust's own memory.
    unsafe { std::ptr::copy_nonoverlapping(copied.as_ptr(), out, copied.len()) };
    Ok(())
}

/// Writes a result.
///
/// # Safety
/// `out` is null or writable for one value.
pub unsafe fn write<T>(out: *mut T, name: &str, value: T) -> Result<()> {
    if out.is_null() {
        return Err(null(name));
    }
    // SAFETY: not null, and the caller promises the rest.
    unsafe { out.write(value) };
    Ok(())
}
