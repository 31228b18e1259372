//! The configuration of a camera above the table, and its text form in an address.

use std::ops::{Range, RangeInclusive};
use std::str::FromStr;

use sdg_robot::LOOK_HEIGHT_M;

use crate::error::{Result, SimulationError};
use crate::objects::{LookAlikeKind, ObjectSpec};

/// The scene under the camera and its motion. The text form is `PART?name=value&…`, as in
/// `sim:pendulum?speed=50&fps=100&hide=2..3`.
#[derive(Debug, Clone, PartialEq)]
pub struct TableCameraConfig {
    /// Name of the part (text before `?`).
    pub part: String,
    /// Speed along the table in metres per second (`speed`, in mm/s).
    pub speed_m_s: f64,
    /// Angular speed in radians per second, in changing directions (`turn`, in degrees per second).
    pub turn_rad_s: f64,
    /// Frames per second (`fps`).
    pub fps: f64,
    /// Seed of positions, directions, light, table and noise (`seed`).
    pub seed: u64,
    /// Length of the sequence in seconds; `None` for no end (`seconds`).
    pub duration_secs: Option<f64>,
    /// Number of instances of the part, 1 to 4 (`count`), as far as they fit side by side.
    pub count: usize,
    /// Another part on the table (`beside`): the name of a part, or a look-alike of [`Self::part`]: `mirrored`,
    /// `feature-moved`, or a size such as `0.9`.
    pub beside: Option<String>,
    /// Number of distractors (`things`).
    pub num_things: usize,
    /// Interval in which the first instance is not on the table, in seconds; afterwards it is at another position
    /// (`hide`, as `2..3`).
    pub hidden_secs: Option<Range<f64>>,
    /// Interval in which a card covers the first instance, in seconds (`cover`, as `2..3`).
    pub covered_secs: Option<Range<f64>>,
    /// Standard deviation of the sensor's noise in grey values (`noise`).
    pub noise: f64,
    /// Height of the camera above the table in metres (`height`, in mm).
    pub height_m: f64,
    /// Tilt of the camera about the table's x in radians (`tilt`, in degrees).
    pub tilt_rad: f64,
}

impl TableCameraConfig {
    /// One part that moves at 50 mm/s and rotates at 30 degrees per second, seen from the wrist camera's height.
    pub fn new(part: &str) -> Self {
        Self {
            part: part.to_owned(),
            speed_m_s: 0.05,
            turn_rad_s: 30f64.to_radians(),
            fps: 100.0,
            seed: 1,
            duration_secs: None,
            count: 1,
            beside: None,
            num_things: 0,
            hidden_secs: None,
            covered_secs: None,
            noise: 2.0,
            height_m: LOOK_HEIGHT_M,
            tilt_rad: 0.0,
        }
    }

    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        match name {
            "speed" => self.speed_m_s = number("speed", "0 to 2000 mm/s", value, 0.0..=2000.0)? * 1e-3,
            "turn" => self.turn_rad_s = number("turn", "0 to 720 degrees a second", value, 0.0..=720.0)?.to_radians(),
            "fps" => self.fps = number("fps", "1 to 1000 frames a second", value, 1.0..=1000.0)?,
            "seed" => self.seed = whole("seed", value, 0..=u64::MAX)?,
            "seconds" => self.duration_secs = Some(number("seconds", "0 to 1000000", value, 0.0..=1e6)?),
            "count" => self.count = whole("count", value, 1..=4)? as usize,
            "beside" => self.beside = Some(value.to_owned()),
            "things" => self.num_things = whole("things", value, 0..=12)? as usize,
            "hide" => self.hidden_secs = Some(span("hide", value)?),
            "cover" => self.covered_secs = Some(span("cover", value)?),
            "noise" => self.noise = number("noise", "0 to 40 grey values", value, 0.0..=40.0)?,
            "height" => self.height_m = number("height", "300 to 1500 mm", value, 300.0..=1500.0)? * 1e-3,
            "tilt" => self.tilt_rad = number("tilt", "-40 to 40 degrees", value, -40.0..=40.0)?.to_radians(),
            _ => {
                return Err(SimulationError::UnknownName {
                    kind: "option of sim:",
                    name: name.to_owned(),
                    existing: OPTIONS.map(str::to_owned).to_vec(),
                });
            }
        }
        Ok(())
    }

    /// The other part beside `part`, if one is requested.
    pub(super) fn part_beside(&self, part: &ObjectSpec) -> Result<Option<ObjectSpec>> {
        let Some(beside) = &self.beside else { return Ok(None) };
        let kind = match beside.as_str() {
            "mirrored" => Some(LookAlikeKind::Mirrored),
            "feature-moved" => Some(LookAlikeKind::FeatureMoved),
            size => {
                let size = size.parse::<f64>().ok().filter(|size| (0.5..=2.0).contains(size));
                size.map(|size| LookAlikeKind::Scaled { percent: (100.0 * size).round() as u32 })
            }
        };
        Ok(Some(match kind {
            Some(kind) => part.look_alike(kind, self.seed)?.spec,
            None => ObjectSpec::by_name(beside)?,
        }))
    }
}

const OPTIONS: [&str; 13] = [
    "speed", "turn", "fps", "seed", "seconds", "count", "beside", "things", "hide", "cover", "noise", "height", "tilt",
];

impl FromStr for TableCameraConfig {
    type Err = SimulationError;

    /// Reads `PART?name=value&…`.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] for an option that does not exist, [`SimulationError::Configuration`] for a
    /// value out of range.
    fn from_str(text: &str) -> Result<Self> {
        let (part, options) = text.split_once('?').unwrap_or((text, ""));
        let mut config = Self::new(part);
        for option in options.split('&').filter(|option| !option.is_empty()) {
            let (name, value) = option.split_once('=').unwrap_or((option, ""));
            config.set(name, value)?;
        }
        Ok(config)
    }
}

fn wrong(field: &'static str, expected: &str, found: &str) -> SimulationError {
    SimulationError::Configuration { field, expected: expected.to_owned(), found: format!("\"{found}\"") }
}

fn number(field: &'static str, expected: &str, text: &str, range: RangeInclusive<f64>) -> Result<f64> {
    text.parse().ok().filter(|value| range.contains(value)).ok_or_else(|| wrong(field, expected, text))
}

fn whole(field: &'static str, text: &str, range: RangeInclusive<u64>) -> Result<u64> {
    let value = text.parse::<u64>().ok().filter(|value| range.contains(value));
    value.ok_or_else(|| wrong(field, &format!("a whole number from {} to {}", range.start(), range.end()), text))
}

fn span(field: &'static str, text: &str) -> Result<Range<f64>> {
    const EXPECTED: &str = "seconds from..to, the first less than the second, as 2..3";
    let (from, to) = text.split_once("..").ok_or_else(|| wrong(field, EXPECTED, text))?;
    let [from, to] = [from, to].map(|end| number(field, EXPECTED, end, 0.0..=1e6));
    let span = from?..to?;
    if span.is_empty() { Err(wrong(field, EXPECTED, text)) } else { Ok(span) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_says_all() {
        let config: TableCameraConfig =
            "key?speed=80&turn=0&fps=30&seed=7&seconds=4&count=3&beside=0.9&things=2&hide=1..1.5&noise=0&tilt=10&height=600"
                .parse()
                .unwrap();
        assert_eq!((config.part.as_str(), config.speed_m_s, config.fps, config.count), ("key", 0.08, 30.0, 3));
        assert_eq!((config.hidden_secs, config.duration_secs), (Some(1.0..1.5), Some(4.0)));
        assert_eq!("key".parse::<TableCameraConfig>().unwrap(), TableCameraConfig::new("key"));
    }

    #[test]
    fn what_it_does_not_know_is_named_with_what_it_knows() {
        let message = |text: &str| text.parse::<TableCameraConfig>().unwrap_err().to_string();
        assert!(message("key?sped=3").contains("sped") && message("key?sped=3").contains("speed"));
        assert!(message("key?fps=0").contains("1 to 1000"), "{}", message("key?fps=0"));
        assert!(message("key?hide=3").contains("2..3"), "{}", message("key?hide=3"));
        for count in ["count=0", "count=5"] {
            let message = message(&format!("key?{count}"));
            assert!(message.contains("from 1 to 4"), "{message}");
        }
        for interval in ["hide=3..2", "cover=2..2"] {
            let message = message(&format!("key?{interval}"));
            assert!(message.contains("the first less than the second"), "{message}");
        }
    }
}
