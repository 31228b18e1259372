//! Arguments that several commands share, and their value types.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sdg_grasp::{ComputeBackend, GraspModel, SearchRegion, Verification};
use sdg_kinematics::HAND_OPENING_MAX_M;
use sdg_robot::height::GivenHeight;

/// Device for the network.
#[derive(Debug, ClapArgs)]
pub struct ComputeArgs {
    /// Device for the network: flex, or one that this build adds; see sdg devices
    #[arg(long, default_value = "flex", value_name = "NAME", value_parser = backend)]
    pub device: ComputeBackend,
}

impl ComputeArgs {
    /// The option as the end of a command; empty for the default device.
    pub fn in_command(&self) -> String {
        if self.device == ComputeBackend::default() { String::new() } else { format!(" --device {}", self.device) }
    }
}

/// The camera that took the photos to teach from.
#[derive(Debug, ClapArgs)]
pub struct TaughtCameraArgs {
    /// The calibrated camera that took the photos, as ROS camera_info YAML with the camera's pose above the table. The
    /// model then knows the part's size and works with every calibrated camera
    #[arg(id = "camera", long = "camera", value_name = "FILE", requires = "mark_height_mm")]
    pub file: Option<PathBuf>,
    /// Height of the surface with the marks above the table
    #[arg(long, value_name = "MM", value_parser = height_mm, requires = "camera")]
    pub mark_height_mm: Option<f64>,
    /// Height above the table at which the gripper closes; default: half of the marks' height
    #[arg(long, value_name = "MM", value_parser = height_mm, requires = "camera")]
    pub grasp_height_mm: Option<f64>,
}

impl TaughtCameraArgs {
    /// Heights of the marks and of the grasp above the table, in metres.
    pub fn heights_m(&self) -> [f64; 2] {
        let mark = self.mark_height_mm.unwrap_or_default();
        [mark, self.grasp_height_mm.unwrap_or(0.5 * mark)].map(|height| 1e-3 * height)
    }
}

/// The part's height, if known.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub struct ToldHeightArgs {
    /// Height of the marks above the workcell's table. With a camera on the hand it may be omitted: it is then measured
    /// from two pictures on the way down. If both are known, the more certain one is used, and a grasp is refused if
    /// they contradict each other
    #[arg(long, value_name = "MM", value_parser = height_mm)]
    pub mark_height_mm: Option<f64>,
    /// Standard deviation of --mark-height-mm
    #[arg(long, value_name = "MM", value_parser = sigma_mm, default_value_t = 1.0, requires = "mark_height_mm")]
    pub mark_height_sigma_mm: f64,
}

impl ToldHeightArgs {
    /// The given height of the marks; `table_height_m` is the table's z. Both are in the base frame, in metres.
    pub fn told(&self, table_height_m: f64) -> Option<GivenHeight> {
        let height_m = table_height_m + 1e-3 * self.mark_height_mm?;
        Some(GivenHeight { height_m, sigma_m: 1e-3 * self.mark_height_sigma_mm })
    }
}

/// Properties of the user's own part that the photo does not show.
#[derive(Debug, Clone, ClapArgs)]
pub struct OwnPartArgs {
    /// Height of the taught part above the table: rehearses this part, with its outline and photo, instead of --object;
    /// not needed for a model taught with --camera
    #[arg(long, value_name = "MM", value_parser = size_mm, conflicts_with = "object", help_heading = OWN_PART)]
    pub height_mm: Option<f64>,
    /// Length of the longer side of the part's box; not needed for a model taught with --camera
    #[arg(long, value_name = "MM", value_parser = size_mm, conflicts_with = "object", help_heading = OWN_PART)]
    pub length_mm: Option<f64>,
    /// Mass of the part; default: computed from its volume at 1.5 g/cm3
    #[arg(long, value_name = "G", value_parser = positive, conflicts_with = "object", help_heading = OWN_PART)]
    pub mass_g: Option<f64>,
    /// Coefficient of friction of the part with everything that it touches; default: 0.6, and 1.0 with the rubber of
    /// the finger pads
    #[arg(long, value_name = "MU", value_parser = positive, conflicts_with = "object", help_heading = OWN_PART)]
    pub friction: Option<f64>,
}

/// The heading of these options in the help.
const OWN_PART: &str = "Your own part";

/// Smallest and largest size of a part relative to its nominal size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeTolerance {
    /// From 0.5 to 1.
    pub low: f64,
    /// From 1 to 2.
    pub high: f64,
}

impl SizeTolerance {
    pub fn range(self) -> std::ops::RangeInclusive<f64> {
        self.low..=self.high
    }
}

/// The region to search in pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegionArg {
    /// The whole picture.
    All,
    Part(SearchRegion),
}

/// Expected form of a region.
const REGION: &str =
    "expected X,Y,W,H in whole pixels of the picture (left edge, upper edge, width, height), such as 100,50,200,200";

/// Parses four numbers: a region of at least one pixel.
pub fn region(text: &str) -> Result<SearchRegion, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[_, _, width, height]) if width == 0 || height == 0 => {
            Err(format!("expected a width and a height of at least 1 pixel, found {width} and {height}"))
        }
        Some(&[x, y, width, height]) => Ok(SearchRegion::new([x, y, width, height])),
        _ => Err(REGION.to_owned()),
    }
}

/// Parses a region, or `all`.
pub fn region_or_all(text: &str) -> Result<RegionArg, String> {
    if text.eq_ignore_ascii_case("all") {
        return Ok(RegionArg::All);
    }
    region(text).map(RegionArg::Part).map_err(|error| format!("{error}; or `all` for the whole picture"))
}

/// Parses the name of a device.
pub fn backend(text: &str) -> Result<ComputeBackend, String> {
    text.parse().map_err(|error: sdg_grasp::GraspError| error.to_string())
}

/// Parses two numbers separated by a hyphen.
pub fn size_tolerance(text: &str) -> Result<SizeTolerance, String> {
    let bounds = text.split_once('-').map(|(low, high)| (low.trim().parse(), high.trim().parse()));
    match bounds {
        Some((Ok(low), Ok(high))) if (0.5..=1.0).contains(&low) && (1.0..=2.0).contains(&high) => {
            Ok(SizeTolerance { low, high })
        }
        _ => Err("expected LOW-HIGH with LOW from 0.5 to 1 and HIGH from 1 to 2, such as 0.75-1.35".to_owned()),
    }
}

/// Parses a number from 0 to 1.
pub fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("expected a number from 0 to 1".to_owned()),
    }
}

/// The verification of a command with `--no-verify`, which has no effect on a model without a network.
pub fn verification(no_verify: bool, model: &GraspModel) -> Verification {
    if !no_verify {
        return Verification::ByShape;
    }
    if !model.kind().has_network() {
        eprintln!("--no-verify: expected a model with a network, found model {}: its parts are checked", model.kind());
        return Verification::ByShape;
    }
    Verification::Off
}

/// Parses a positive, finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}

/// Parses a positive number of seconds, at most 30 years: a `Duration` has a limit, too.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs > 0.0 && secs <= 1e9 => Ok(secs),
        _ => Err("expected a positive number of seconds, at most 1e9".to_owned()),
    }
}

/// Parses a height above the table, at most half a metre: a larger number suggests another unit.
pub fn height_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a height", [0.0, 500.0])
}

/// Parses the standard deviation of a height.
fn sigma_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a standard deviation", [0.1, 100.0])
}

/// Parses the size of a part, at least 1 mm. A part too large for the hand is rejected later, by its grasp width.
fn size_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a size", [1.0, 5000.0])
}

/// Parses the distance between the fingers.
pub fn opening_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "an opening", [0.0, HAND_OPENING_MAX_M * 1e3])
}

/// Parses the z of a table in the robot's base, which may be negative. The camera's height above it is checked later.
pub fn table_height_mm(text: &str) -> Result<f64, String> {
    let hint = match text.parse::<f64>() {
        Ok(height) if height == 0.0 || (height.is_finite() && height.abs() >= MIN_MM) => return Ok(height),
        Ok(height) if height.is_finite() => METRES,
        _ => "",
    };
    Err(format!("expected the table's z in millimetres, found {text}{hint}"))
}

/// Minimum absolute value of a length other than 0: a smaller one was probably given in metres.
const MIN_MM: f64 = 0.1;
/// Ends the errors of such lengths.
pub const METRES: &str = ": metres given as millimetres?";

/// Parses a length from `min` to `max`. The length must also be zero or at least [`MIN_MM`].
pub fn millimetres(text: &str, name: &str, [min, max]: [f64; 2]) -> Result<f64, String> {
    let number = text.parse().unwrap_or(f64::NAN);
    let is_tiny = 0.0 < number && number < MIN_MM.max(min);
    if (min..=max).contains(&number) && !is_tiny {
        return Ok(number);
    }
    let hint = if is_tiny { METRES } else { "" };
    Err(format!("expected {name} of {min} to {max} millimetres, found {text}{hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metres_are_no_millimetres() {
        assert_eq!((height_mm("0"), height_mm("0.4"), height_mm("16")), (Ok(0.0), Ok(0.4), Ok(16.0)));
        assert_eq!(["0", "-0.4", "-12.5"].map(table_height_mm), [Ok(0.0), Ok(-0.4), Ok(-12.5)]);
        let found = [height_mm("0.016"), size_mm("0.12"), opening_mm("0.04"), table_height_mm("-0.0125")];
        let found = found.map(Result::unwrap_err);
        assert!(found.iter().all(|error| error.ends_with("metres given as millimetres?")), "{found:?}");
        for text in ["-1", "501", "nan", "4 cm"] {
            assert!(height_mm(text).unwrap_err().ends_with(&format!("millimetres, found {text}")), "{text}");
        }
    }

    #[test]
    fn seconds_are_positive_and_limited() {
        assert_eq!(["0.5", "1e9"].map(seconds), [Ok(0.5), Ok(1e9)]);
        for text in ["0", "-1", "nan", "inf", "1e20", "2 s"] {
            assert!(seconds(text).unwrap_err().ends_with("seconds, at most 1e9"), "{text}");
        }
    }

    #[test]
    fn a_region_is_four_whole_numbers_or_all() {
        let expected = SearchRegion::new([100, 50, 200, 180]);
        assert_eq!(region("100,50,200,180"), Ok(expected));
        assert_eq!(region_or_all("100, 50, 200, 180"), Ok(RegionArg::Part(expected)));
        for all in ["all", "ALL", "All"] {
            assert_eq!(region_or_all(all), Ok(RegionArg::All));
        }
        for text in ["", "all", "100,50,200", "1,2,3,4,5", "1.5,2,30,40", "-1,2,30,40", "1;2;3;4", "4294967296,0,1,1"] {
            assert_eq!(region(text).unwrap_err(), REGION, "{text}");
        }
        assert_eq!(
            region("10,10,0,5").unwrap_err(),
            "expected a width and a height of at least 1 pixel, found 0 and 5"
        );
        assert!(region_or_all("everything").unwrap_err().ends_with("or `all` for the whole picture"));
    }

    #[test]
    fn a_size_tolerance_holds_the_nominal_size() {
        assert_eq!(size_tolerance("0.75-1.35"), Ok(SizeTolerance { low: 0.75, high: 1.35 }));
        for text in ["", "0.75", "1.1-1.3", "0.9-0.95", "0.1-1.2", "0.9-3", "0.9..1.1"] {
            assert!(size_tolerance(text).unwrap_err().contains("such as 0.75-1.35"), "{text}");
        }
    }
}
