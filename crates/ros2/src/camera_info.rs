//! camera_info: a camera's intrinsics, sent with its pictures.

use sdg_geometry::{PinholeCamera, PlumbBob};

use crate::error::RosError;
use crate::messages::{CameraInfo, Header};

/// Centre of the first pixel in this project's convention; in ROS it is 0.
const FIRST_CENTER_PX: f64 = 0.5;
/// Largest difference of focal lengths and centres for the same camera, as a fraction of the picture's longer side.
const MAX_DIFFERENCE: f64 = 0.01;

fn refused(expected: impl Into<String>, found: impl ToString) -> RosError {
    RosError::CameraInfo { expected: expected.into(), found: found.to_string() }
}

/// Reads the camera of a message, for unrectified pictures.
///
/// # Errors
/// [`RosError::CameraInfo`] for an uncalibrated camera, an invalid camera matrix, a lens model other than plumb_bob
/// with 4 or 5 coefficients (unless all coefficients are 0), binning, and a region that is not the whole picture.
pub fn read_camera_info(message: &CameraInfo) -> Result<PinholeCamera, RosError> {
    let CameraInfo { width, height, distortion_model, d, k, roi, .. } = message;
    if k[0] == 0.0 {
        return Err(refused("a calibrated camera", "a camera matrix of zeros, which means an uncalibrated camera"));
    }
    if message.binning_x > 1 || message.binning_y > 1 {
        let found = format!("binning {} × {}", message.binning_x, message.binning_y);
        return Err(refused("pictures without binning", found));
    }
    let is_whole = (roi.width == 0 || roi.width == *width) && (roi.height == 0 || roi.height == *height);
    if !is_whole || roi.x_offset != 0 || roi.y_offset != 0 {
        let found = format!("a region of {} × {} at ({}, {})", roi.width, roi.height, roi.x_offset, roi.y_offset);
        return Err(refused("the whole picture", found));
    }
    let lens = match (distortion_model.as_str(), d.as_slice()) {
        (_, []) => PlumbBob::NONE,
        (_, zeros) if zeros.iter().all(|&value| value == 0.0) => PlumbBob::NONE,
        ("plumb_bob", [k1, k2, p1, p2]) => PlumbBob::from_array([*k1, *k2, *p1, *p2, 0.0]),
        ("plumb_bob", [k1, k2, p1, p2, k3]) => PlumbBob::from_array([*k1, *k2, *p1, *p2, *k3]),
        (model, values) => {
            let found = format!("\"{model}\" with {} coefficients", values.len());
            return Err(refused("the lens model plumb_bob with 4 or 5 coefficients", found));
        }
    };
    let [fx, skew, cx, zero, fy, cy, p, q, one] = *k;
    let camera = PinholeCamera {
        width: *width,
        height: *height,
        fx,
        fy,
        cx: cx + FIRST_CENTER_PX,
        cy: cy + FIRST_CENTER_PX,
        lens,
    };
    let is_matrix = [skew, zero, p, q] == [0.0; 4] && one == 1.0;
    camera
        .checked()
        .ok()
        .filter(|_| is_matrix)
        .ok_or_else(|| refused("a camera matrix fx 0 cx 0 fy cy 0 0 1", format!("{k:?} for {width} × {height} pixels")))
}

/// Checks that a camera is the one in a file: that its picture size is the same, and that its focal lengths and its
/// centre differ by at most a hundredth of the picture's longer side. Lenses are not compared.
///
/// # Errors
/// [`RosError::CameraInfo`] with the first difference.
pub fn check_same_camera(of_file: &PinholeCamera, sent: &PinholeCamera) -> Result<(), RosError> {
    let size = |camera: &PinholeCamera| format!("{} × {} pixels", camera.width, camera.height);
    if (of_file.width, of_file.height) != (sent.width, sent.height) {
        return Err(refused(format!("{}, as in the camera file", size(of_file)), size(sent)));
    }
    let allowed = MAX_DIFFERENCE * f64::from(of_file.width.max(of_file.height));
    for (name, expected, found) in [
        ("fx", of_file.fx, sent.fx),
        ("fy", of_file.fy, sent.fy),
        ("cx", of_file.cx, sent.cx),
        ("cy", of_file.cy, sent.cy),
    ] {
        if (expected - found).abs() > allowed {
            let expected = format!("{name} = {expected:.1} ± {allowed:.1} px, as in the camera file");
            return Err(refused(expected, format!("{found:.1}")));
        }
    }
    Ok(())
}

/// The message of a camera.
pub fn to_camera_info(camera: &PinholeCamera, header: Header) -> CameraInfo {
    let PinholeCamera { width, height, fx, fy, cx, cy, lens } = *camera;
    let (cx, cy) = (cx - FIRST_CENTER_PX, cy - FIRST_CENTER_PX);
    CameraInfo {
        header,
        height,
        width,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![lens.k1, lens.k2, lens.p1, lens.p2, lens.k3],
        k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_the_same_after_a_message() {
        let lens = PlumbBob { k1: -0.1, k2: 0.02, p1: 1e-3, p2: -2e-3, k3: 0.0 };
        let camera = PinholeCamera { lens, ..PinholeCamera::WRIST };
        let message = to_camera_info(&camera, Header::default());
        assert_eq!((message.k[2], message.k[5]), (319.5, 239.5));
        assert_eq!(read_camera_info(&message).unwrap(), camera);
        check_same_camera(&camera, &read_camera_info(&message).unwrap()).unwrap();
    }

    #[test]
    fn what_is_of_no_use_is_refused() {
        let good = to_camera_info(&PinholeCamera::WRIST, Header::default());
        let mut with_lens = good.clone();
        with_lens.distortion_model = "equidistant".into();
        with_lens.d = vec![0.1; 4];
        let mut skewed = good.clone();
        skewed.k[1] = 3.0;
        let mut cut = good.clone();
        cut.roi.width = 100;
        for (message, expected) in [
            (CameraInfo { k: [0.0; 9], ..good.clone() }, "uncalibrated"),
            (CameraInfo { binning_x: 2, ..good.clone() }, "binning 2 × 0"),
            (cut, "a region of 100 × 0"),
            (with_lens, "\"equidistant\" with 4 coefficients"),
            (skewed, "a camera matrix fx 0 cx"),
        ] {
            let error = read_camera_info(&message).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn another_camera_than_the_file_s_is_refused() {
        let file = PinholeCamera::WRIST;
        let larger = PinholeCamera { width: 1280, height: 720, ..file };
        let error = check_same_camera(&file, &larger).unwrap_err().to_string();
        assert_eq!(error, "camera_info: expected 640 × 480 pixels, as in the camera file, found 1280 × 720 pixels");
        check_same_camera(&file, &PinholeCamera { fx: 555.0, ..file }).unwrap();
        let error = check_same_camera(&file, &PinholeCamera { fy: 600.0, ..file }).unwrap_err().to_string();
        assert!(error.contains("fy = 550.0 ± 6.4 px") && error.contains("600.0"), "{error}");
    }
}
