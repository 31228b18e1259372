//! Arguments that several verbs take, and the values that they may have.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sdg_grasp::{ComputeBackend, SearchRegion};
use sdg_robot::height::ToldHeight;

/// Where a network computes.
#[derive(Debug, ClapArgs)]
pub struct ComputeArgs {
    /// Where the network computes: flex, or what this build adds; see sdg devices
    #[arg(long, default_value = "flex", value_name = "NAME", value_parser = backend)]
    pub device: ComputeBackend,
}

/// The camera that took the photos to teach from.
#[derive(Debug, ClapArgs)]
pub struct TaughtCameraArgs {
    /// The calibrated camera that took the photos, as ROS's camera_info YAML with the camera's pose over the table: the model
    /// then knows the part's size and works with every calibrated camera
    #[arg(id = "camera", long = "camera", value_name = "FILE", requires = "mark_height_mm")]
    pub file: Option<PathBuf>,
    /// Height of the marks over the table: of the surface that they lie on, not of the table
    #[arg(long, value_name = "MM", value_parser = height_mm, requires = "camera")]
    pub mark_height_mm: Option<f64>,
    /// Height over the table at which the gripper closes; without it, half of the marks' height
    #[arg(long, value_name = "MM", value_parser = height_mm, requires = "camera")]
    pub grasp_height_mm: Option<f64>,
}

impl TaughtCameraArgs {
    /// Heights over the table of the marks and of the grasp, in metres.
    pub fn heights_m(&self) -> [f64; 2] {
        let mark = self.mark_height_mm.unwrap_or_default();
        [mark, self.grasp_height_mm.unwrap_or(0.5 * mark)].map(|height| 1e-3 * height)
    }
}

/// How high the part lies, where that is known.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub struct ToldHeightArgs {
    /// Height of the marks over the workcell's table. With a camera on the hand it may be left out: it is measured from two pictures on the
    /// way down; where it is given, the more certain of both is used, and a grasp is refused where they contradict each other
    #[arg(long, value_name = "MM", value_parser = height_mm)]
    pub mark_height_mm: Option<f64>,
    /// How far that height may be off: one standard deviation
    #[arg(long, value_name = "MM", value_parser = sigma_mm, default_value_t = 1.0, requires = "mark_height_mm")]
    pub mark_height_sigma_mm: f64,
}

impl ToldHeightArgs {
    /// The height that was told, over a table at this z of the base, m.
    pub fn told(&self, table_height_m: f64) -> Option<ToldHeight> {
        let height_m = table_height_m + 1e-3 * self.mark_height_mm?;
        Some(ToldHeight { height_m, sigma_m: 1e-3 * self.mark_height_sigma_mm })
    }
}

/// What the photo does not show of the user's own part.
#[derive(Debug, Clone, ClapArgs)]
pub struct OwnPartArgs {
    /// Instead of --object the part that the model was taught from, with its outline and photo: its height over the table; not
    /// needed for a model taught with --camera
    #[arg(long, value_name = "MM", value_parser = size_mm, conflicts_with = "object", help_heading = OWN_PART)]
    pub height_mm: Option<f64>,
    /// The longer side of its box; not needed for a model taught with --camera
    #[arg(long, value_name = "MM", value_parser = size_mm, conflicts_with = "object", help_heading = OWN_PART)]
    pub length_mm: Option<f64>,
    /// What it weighs; without it, what its volume would at 1.5 g/cm3
    #[arg(long, value_name = "G", value_parser = positive, conflicts_with = "object", help_heading = OWN_PART)]
    pub mass_g: Option<f64>,
    /// Coefficient of friction of its surface; without it, 0.6
    #[arg(long, value_name = "MU", value_parser = positive, conflicts_with = "object", help_heading = OWN_PART)]
    pub friction: Option<f64>,
}

/// The heading of these options in the help.
const OWN_PART: &str = "Your own part";

/// Smallest and largest size of a part over the nominal one.
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

/// The part of pictures that is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegionArg {
    /// All of them.
    All,
    Part(SearchRegion),
}

/// What a region looks like.
const REGION: &str =
    "expected X,Y,W,H in whole pixels of the picture (left edge, upper edge, width, height), such as 100,50,200,200";

/// Four numbers: a region of at least a pixel.
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

/// The same, or `all`.
pub fn region_or_all(text: &str) -> Result<RegionArg, String> {
    if text.eq_ignore_ascii_case("all") {
        return Ok(RegionArg::All);
    }
    region(text).map(RegionArg::Part).map_err(|error| format!("{error}; or all, for all of the picture"))
}

/// A device's name.
pub fn backend(text: &str) -> Result<ComputeBackend, String> {
    text.parse().map_err(|error: sdg_grasp::GraspError| error.to_string())
}

/// Two numbers with a hyphen between them: [`SizeTolerance`].
pub fn size_tolerance(text: &str) -> Result<SizeTolerance, String> {
    let bounds = text.split_once('-').map(|(low, high)| (low.trim().parse(), high.trim().parse()));
    match bounds {
        Some((Ok(low), Ok(high))) if (0.5..=1.0).contains(&low) && (1.0..=2.0).contains(&high) => {
            Ok(SizeTolerance { low, high })
        }
        _ => Err("expected LOW-HIGH with LOW from 0.5 to 1 and HIGH from 1 to 2, such as 0.75-1.35".to_owned()),
    }
}

/// A number from 0 to 1.
pub fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("expected a number from 0 to 1".to_owned()),
    }
}

/// A positive, finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}

/// A positive, finite number of seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs.is_finite() && secs > 0.0 => Ok(secs),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

/// A height over the table. A part higher than half a metre was given in another unit.
pub fn height_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a height", [0.0, 500.0])
}

/// How far a height may be off.
fn sigma_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a standard deviation", [0.1, 100.0])
}

/// The size of a part. No part is smaller than a millimetre; one that no hand takes is refused by its jaws.
fn size_mm(text: &str) -> Result<f64, String> {
    millimetres(text, "a size", [1.0, 5000.0])
}

/// A length from `min` to `max`. A tenth of a millimetre is less than anything here is known to: such a number is in metres.
pub fn millimetres(text: &str, name: &str, [min, max]: [f64; 2]) -> Result<f64, String> {
    const MIN_MM: f64 = 0.1;
    let number = text.parse().unwrap_or(f64::NAN);
    let is_tiny = 0.0 < number && number < MIN_MM.max(min);
    if (min..=max).contains(&number) && !is_tiny {
        return Ok(number);
    }
    let hint = if is_tiny { ": metres given as millimetres?" } else { "" };
    Err(format!("expected {name} of {min} to {max} millimetres, found {text}{hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metres_are_no_millimetres() {
        assert_eq!((height_mm("0"), height_mm("0.4"), height_mm("16")), (Ok(0.0), Ok(0.4), Ok(16.0)));
        let found = [height_mm("0.016"), size_mm("0.12")].map(Result::unwrap_err);
        assert!(found.iter().all(|error| error.ends_with("metres given as millimetres?")), "{found:?}");
        for text in ["-1", "501", "nan", "4 cm"] {
            assert!(height_mm(text).unwrap_err().ends_with(&format!("millimetres, found {text}")), "{text}");
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
        assert!(region_or_all("everything").unwrap_err().ends_with("or all, for all of the picture"));
    }

    #[test]
    fn a_size_tolerance_holds_the_nominal_size() {
        assert_eq!(size_tolerance("0.75-1.35"), Ok(SizeTolerance { low: 0.75, high: 1.35 }));
        for text in ["", "0.75", "1.1-1.3", "0.9-0.95", "0.1-1.2", "0.9-3", "0.9..1.1"] {
            assert!(size_tolerance(text).unwrap_err().contains("such as 0.75-1.35"), "{text}");
        }
    }
}
