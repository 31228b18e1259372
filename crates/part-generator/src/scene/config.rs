//! The configuration of scenes.

use crate::{GeneratorError, PhotoConfig, Result};

/// A single condition of scenes that makes detection difficult.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Condition {
    /// One part, vertical view, any table, few other parts; none of the other conditions.
    Nominal,
    /// The camera nearer or farther: 0.75 to 1.3 of the demonstration's distance.
    Distance,
    /// The camera tilted by 5 to 20 degrees.
    Tilt,
    /// An object covers about 10 to 40 % of the part.
    Cover,
    /// Little light and much noise.
    Dark,
    /// Out of focus.
    Blur,
    /// The camera moved during the exposure.
    MotionBlur,
    /// Coloured light.
    Tint,
    /// Narrow lamps: hard shadows, highlights, shadows of objects outside the picture.
    Glare,
    /// Other parts all around, some touching the part.
    Clutter,
    /// Two to five instances of the part.
    Instances,
    /// Look-alikes beside the part, or in place of it.
    LookAlikes,
}

impl Condition {
    /// All conditions.
    pub const ALL: [Self; 12] = [
        Self::Nominal,
        Self::Distance,
        Self::Tilt,
        Self::Cover,
        Self::Dark,
        Self::Blur,
        Self::MotionBlur,
        Self::Tint,
        Self::Glare,
        Self::Clutter,
        Self::Instances,
        Self::LookAlikes,
    ];

    /// A short name for files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::Distance => "distance",
            Self::Tilt => "tilt",
            Self::Cover => "cover",
            Self::Dark => "dark",
            Self::Blur => "blur",
            Self::MotionBlur => "motion-blur",
            Self::Tint => "tint",
            Self::Glare => "glare",
            Self::Clutter => "clutter",
            Self::Instances => "instances",
            Self::LookAlikes => "look-alikes",
        }
    }
}

/// Properties of scenes. Probabilities and ranges are sampled independently for every picture.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneConfig {
    /// Width of the picture, in pixels.
    pub width: u32,
    /// Height of the picture, in pixels.
    pub height: u32,
    /// Settings of the demonstration's photo, to which the ground truth refers.
    pub photo: PhotoConfig,
    /// Seed of the demonstration's photo.
    pub photo_seed: u64,
    /// Fraction of pictures without the part.
    pub absent_share: f64,
    /// Minimum and maximum number of instances, if the part is present.
    pub instances: [usize; 2],
    /// Minimum and maximum number of other parts.
    pub others: [usize; 2],
    /// Fraction of the other parts that are look-alikes.
    pub look_alike_share: f64,
    /// Probability that another part touches an instance.
    pub touch_probability: f64,
    /// Range of the camera's distance divided by the demonstration's.
    pub distance: [f64; 2],
    /// Range of the camera's tilt in radians.
    pub tilt_rad: [f64; 2],
    /// Probability that the camera is tilted within that range; otherwise it looks straight down.
    pub tilt_probability: f64,
    /// Probability that a part is covered.
    pub cover_probability: f64,
    /// Range of the covered fraction of the part.
    pub cover_share: [f64; 2],
    /// Probability of little light and much noise.
    pub dark_probability: f64,
    /// Probability of a picture out of focus.
    pub blur_probability: f64,
    /// Probability of motion during the exposure.
    pub motion_probability: f64,
    /// Probability of coloured light.
    pub tint_probability: f64,
    /// Probability of narrow lamps with hard shadows and highlights.
    pub glare_probability: f64,
    /// Probability that the picture is compressed as JPEG.
    pub jpeg_probability: f64,
    /// Minimum fraction of an instance's outline inside the picture, if such a position is found.
    pub min_inside_share: f64,
    /// Number of other parts to choose from.
    pub num_other_parts: usize,
}

impl Default for SceneConfig {
    /// All conditions at once, each in some of the pictures.
    fn default() -> Self {
        Self {
            width: 320,
            height: 240,
            photo: PhotoConfig::default(),
            photo_seed: 0,
            absent_share: 0.25,
            instances: [1, 3],
            others: [0, 5],
            look_alike_share: 0.2,
            touch_probability: 0.25,
            distance: [0.75, 1.3],
            tilt_rad: [0.0, 20f64.to_radians()],
            tilt_probability: 0.35,
            cover_probability: 0.2,
            cover_share: [0.1, 0.4],
            dark_probability: 0.1,
            blur_probability: 0.12,
            motion_probability: 0.1,
            tint_probability: 0.15,
            glare_probability: 0.25,
            jpeg_probability: 0.2,
            min_inside_share: 0.9,
            num_other_parts: 24,
        }
    }
}

impl SceneConfig {
    /// A single condition, in every picture.
    pub fn only(condition: Condition) -> Self {
        let nominal = Self {
            absent_share: 0.0,
            instances: [1, 1],
            others: [0, 2],
            look_alike_share: 0.0,
            touch_probability: 0.0,
            distance: [0.95, 1.05],
            tilt_rad: [0.0, 0.0],
            tilt_probability: 0.0,
            cover_probability: 0.0,
            dark_probability: 0.0,
            blur_probability: 0.0,
            motion_probability: 0.0,
            tint_probability: 0.0,
            glare_probability: 0.0,
            jpeg_probability: 0.0,
            min_inside_share: 1.0,
            ..Self::default()
        };
        match condition {
            Condition::Nominal => nominal,
            Condition::Distance => Self { distance: [0.75, 1.3], ..nominal },
            Condition::Tilt => {
                Self { tilt_rad: [5f64.to_radians(), 20f64.to_radians()], tilt_probability: 1.0, ..nominal }
            }
            Condition::Cover => Self { cover_probability: 1.0, ..nominal },
            Condition::Dark => Self { dark_probability: 1.0, ..nominal },
            Condition::Blur => Self { blur_probability: 1.0, ..nominal },
            Condition::MotionBlur => Self { motion_probability: 1.0, ..nominal },
            Condition::Tint => Self { tint_probability: 1.0, ..nominal },
            Condition::Glare => Self { glare_probability: 1.0, ..nominal },
            Condition::Clutter => Self { others: [4, 8], touch_probability: 0.5, ..nominal },
            Condition::Instances => Self { instances: [2, 5], ..nominal },
            Condition::LookAlikes => Self { absent_share: 0.5, others: [1, 4], look_alike_share: 1.0, ..nominal },
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// A value is outside its range; the error names it.
    pub fn check(&self) -> Result<()> {
        for (width, height) in [(self.width, self.height), (self.photo.width, self.photo.height)] {
            if !(32..=4096).contains(&width) || !(32..=4096).contains(&height) {
                return Err(GeneratorError::PictureSize { width, height });
            }
        }
        let probabilities = [
            ("absent_share", self.absent_share),
            ("look_alike_share", self.look_alike_share),
            ("touch_probability", self.touch_probability),
            ("tilt_probability", self.tilt_probability),
            ("cover_probability", self.cover_probability),
            ("dark_probability", self.dark_probability),
            ("blur_probability", self.blur_probability),
            ("motion_probability", self.motion_probability),
            ("tint_probability", self.tint_probability),
            ("glare_probability", self.glare_probability),
            ("jpeg_probability", self.jpeg_probability),
            ("min_inside_share", self.min_inside_share),
        ];
        for (name, found) in probabilities {
            within(name, "from 0 to 1", found, 0.0, 1.0)?;
        }
        for (name, expected, range, low, high) in [
            ("distance", "a range within 0.2 to 5", self.distance, 0.2, 5.0),
            ("tilt_rad", "a range within 0 to 0.8 rad", self.tilt_rad, 0.0, 0.8),
            ("cover_share", "a range within 0 to 0.9", self.cover_share, 0.0, 0.9),
            ("photo.fill", "a range within 0.05 to 0.95", self.photo.fill, 0.05, 0.95),
        ] {
            range.into_iter().try_for_each(|found| within(name, expected, found, low, high))?;
            within(name, expected, range[1], range[0], high)?;
        }
        for (name, [low, high]) in [("instances", self.instances), ("others", self.others)] {
            within(name, "a range within 0 to 40", high as f64, low as f64, 40.0)?;
        }
        within("instances", "at least one", self.instances[0] as f64, 1.0, 40.0)
    }
}

fn within(name: &'static str, expected: &'static str, found: f64, low: f64, high: f64) -> Result<()> {
    if (low..=high).contains(&found) { Ok(()) } else { Err(GeneratorError::InvalidConfig { name, expected, found }) }
}
