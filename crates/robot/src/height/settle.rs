//! Combines the given and the measured height: the more certain of both, unless they contradict each other.

use super::triangulation::MeasuredHeight;

/// Largest difference between given and measured height, in standard deviations of that difference.
const MAX_SIGMAS: f64 = 3.0;

/// A given height of the marks, z of the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GivenHeight {
    /// Height, m.
    pub height_m: f64,
    /// Standard deviation of the height, m.
    pub sigma_m: f64,
}

/// Source of a height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeightSource {
    /// From two pictures.
    Measured,
    /// Given by the user.
    Told,
}

impl HeightSource {
    /// The name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Told => "told",
        }
    }
}

/// The height of the marks that a grasp uses, z of the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettledHeight {
    /// Height, m.
    pub height_m: f64,
    /// Standard deviation of the height, m.
    pub sigma_m: f64,
    /// Source of the height.
    pub source: HeightSource,
}

/// The more certain of both heights; the measured one if both are equally certain. Error texts have heights above the
/// table, whose z is `table_height_m`.
///
/// # Errors
/// The reason, in one sentence: both heights are missing (`why_not` says why none was measured), or they differ by more
/// than three standard deviations.
pub fn settle(
    told: Option<GivenHeight>,
    measured: Option<MeasuredHeight>,
    why_not: Option<&str>,
    table_height_m: f64,
) -> Result<SettledHeight, String> {
    let by_told = |GivenHeight { height_m, sigma_m }| SettledHeight { height_m, sigma_m, source: HeightSource::Told };
    let by_measurement =
        |MeasuredHeight { height_m, sigma_m }| SettledHeight { height_m, sigma_m, source: HeightSource::Measured };
    let (told, measured) = match (told, measured) {
        (Some(told), Some(measured)) => (told, measured),
        (Some(told), None) => return Ok(by_told(told)),
        (None, Some(measured)) => return Ok(by_measurement(measured)),
        (None, None) => {
            let why = why_not.unwrap_or("no picture was taken for it");
            return Err(format!("the height of the part was not measured, and none was given: {why}"));
        }
    };
    let [given_mm, measured_mm] = [told.height_m, measured.height_m].map(|height_m| (height_m - table_height_m) * 1e3);
    let apart_mm = (told.height_m - measured.height_m).abs() * 1e3;
    let max_mm = MAX_SIGMAS * told.sigma_m.hypot(measured.sigma_m) * 1e3;
    if apart_mm > max_mm {
        let [told_sigma_mm, measured_sigma_mm] = [told.sigma_m, measured.sigma_m].map(|sigma| sigma * 1e3);
        return Err(format!(
            "expected marks at the given height of {given_mm:.1} ± {told_sigma_mm:.1} mm, measured {measured_mm:.1} ± \
             {measured_sigma_mm:.1} mm: at most {max_mm:.1} mm apart are allowed, found {apart_mm:.1} mm"
        ));
    }
    Ok(if told.sigma_m < measured.sigma_m { by_told(told) } else { by_measurement(measured) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(height_mm: f64, sigma_mm: f64) -> Option<GivenHeight> {
        Some(GivenHeight { height_m: 1e-3 * height_mm, sigma_m: 1e-3 * sigma_mm })
    }

    fn measured(height_mm: f64, sigma_mm: f64) -> Option<MeasuredHeight> {
        Some(MeasuredHeight { height_m: 1e-3 * height_mm, sigma_m: 1e-3 * sigma_mm })
    }

    #[test]
    fn the_more_certain_of_both_is_used() {
        let source = |told, measured| settle(told, measured, None, 0.0).unwrap().source;
        assert_eq!(source(told(16.0, 0.3), measured(17.0, 0.8)), HeightSource::Told);
        assert_eq!(source(told(16.0, 2.0), measured(17.0, 0.8)), HeightSource::Measured);
        assert_eq!(source(told(16.0, 0.3), None), HeightSource::Told);
        assert_eq!(source(None, measured(17.0, 0.8)), HeightSource::Measured);
    }

    #[test]
    fn heights_that_contradict_each_other_are_refused() {
        // 3 √(0.6² + 0.8²) = 3 mm.
        assert!(settle(told(16.0, 0.6), measured(18.99, 0.8), None, 0.0).is_ok());
        // The second table is 12.5 mm below the base.
        for (table_mm, told_mm, measured_mm) in [(0.0, 16.0, 19.01), (-12.5, 3.5, 6.51)] {
            let why = settle(told(told_mm, 0.6), measured(measured_mm, 0.8), None, 1e-3 * table_mm).unwrap_err();
            let expected = "given height of 16.0 ± 0.6 mm, measured 19.0 ± 0.8 mm: at most 3.0 mm apart";
            assert!(why.contains(expected), "{why}");
        }
    }

    #[test]
    fn without_any_height_the_reason_is_told() {
        let why = settle(None, None, Some("the second picture does not show the part"), 0.0).unwrap_err();
        assert!(why.ends_with("none was given: the second picture does not show the part"), "{why}");
    }
}
