//! The likelihood of a colour on one side of an outline: a mixture of Gaussians.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::lab::Lab;

/// Number of Gaussians of a mixture.
const NUM_COMPONENTS: usize = 5;
/// Added to every variance, in squared units of L*a*b*: no camera distinguishes colours better.
const MIN_VARIANCE: f64 = 1.0;
/// Minimum number of samples of a Gaussian.
const MIN_SAMPLES: usize = 4;
/// Squared Mahalanobis distance within which 99 % of a Gaussian's samples lie, in three dimensions.
const EXPLAINED: f32 = 11.3;
/// Minimum weight (fraction of the samples) of a Gaussian whose colour is recognised in shadow.
const MIN_SHADED_WEIGHT: f32 = 0.05;
/// Minimum fraction of the lightness that remains in a shadow.
const DARKEST_SHADE: f32 = 0.5;
/// Variance of a* and b* in a shadow, in addition to that in the light: other lamps light the shadow, too.
const SHADE_VARIANCE: f32 = 0.3;
/// As [`DARKEST_SHADE`], for a shadow that a person marked.
const DARKEST_SHADE_SAID: f32 = 0.3;
/// Maximum fraction of the lightness that remains in a marked shadow: colours that are hardly darker are not in shadow.
const BRIGHTEST_SAID: f32 = 0.92;
/// Largest change of a* and b* by other light in a marked shadow.
const MAX_TINT: f32 = 14.0;
/// Variance in a marked shadow, in addition to that in the light, because the shadow's depth and tint vary.
const SAID_VARIANCE: f32 = 0.8;
/// Added to L*: a shadow scales L* + 16, a* and b* by the same factor.
const BLACK: f32 = 16.0;

struct Component {
    mean: Vector3<f32>,
    covariance: Matrix3<f32>,
    precision: Matrix3<f32>,
    weight: f32,
    /// Logarithm of the density at the mean.
    log_peak: f32,
}

impl Component {
    fn fit(samples: &[Vector3<f64>], of: usize) -> Option<Self> {
        if samples.len() < MIN_SAMPLES {
            return None;
        }
        let (mean, scatter) = moments(samples);
        let covariance = scatter + Matrix3::identity() * MIN_VARIANCE;
        let precision = covariance.try_inverse()?;
        let weight = samples.len() as f64 / of as f64;
        Some(Self {
            mean: mean.cast(),
            covariance: covariance.cast(),
            precision: precision.cast(),
            weight: weight as f32,
            log_peak: (weight.ln() - 0.5 * covariance.determinant().ln()) as f32,
        })
    }

    /// Squared Mahalanobis distance.
    fn distance_squared(&self, color: &Vector3<f32>) -> f32 {
        let off = color - self.mean;
        off.dot(&(self.precision * off))
    }

    fn log_density(&self, color: &Vector3<f32>) -> f32 {
        self.log_peak - 0.5 * self.distance_squared(color)
    }

    /// Whether the colour is this Gaussian's with less light: L* + [`BLACK`], a* and b* are then all smaller by one
    /// factor, because all are proportional to the cube root of the light.
    fn explains_shaded(&self, color: &Vector3<f32>) -> bool {
        let shade = (color.x + BLACK) / (self.mean.x + BLACK);
        let brightest = 1.0 + 3.0 * self.covariance.m11.sqrt() / (self.mean.x + BLACK);
        if self.weight < MIN_SHADED_WEIGHT || !(DARKEST_SHADE..brightest).contains(&shade) {
            return false;
        }
        let off = |axis: usize| {
            let off = color[axis] - shade * self.mean[axis];
            off * off / (self.covariance[(axis, axis)] + SHADE_VARIANCE)
        };
        off(1) + off(2) < EXPLAINED
    }

    /// Whether the colour lies between this Gaussian's colour in the light and the same colour in the shadow.
    fn explains_under(&self, color: &Vector3<f32>, shade: &Shade) -> bool {
        if self.weight < MIN_SHADED_WEIGHT {
            return false;
        }
        let black = Vector3::new(-BLACK, 0.0, 0.0);
        let lit = self.mean;
        let dark = (lit - black) * shade.factor + black + Vector3::new(0.0, shade.tint[0], shade.tint[1]);
        let way = dark - lit;
        // A shadow may also be slightly darker than at the marked place.
        let along = ((color - lit).dot(&way) / way.norm_squared().max(1.0)).clamp(0.0, 1.15);
        let off = color - (lit + way * along);
        let scale = 1.0 - along * (1.0 - shade.factor.min(1.0));
        let covariance = self.covariance * (scale * scale) + Matrix3::identity() * SAID_VARIANCE;
        covariance.try_inverse().is_some_and(|precision| off.dot(&(precision * off)) < EXPLAINED)
    }
}

/// The effect of a shadow on a colour: L* + [`BLACK`], a* and b* are scaled, and a* and b* are shifted by the other
/// light in the shadow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shade {
    factor: f32,
    tint: [f32; 2],
}

/// Mean and covariance.
fn moments(samples: &[Vector3<f64>]) -> (Vector3<f64>, Matrix3<f64>) {
    let count = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<Vector3<f64>>() / count;
    let scatter = samples.iter().map(|sample| (sample - mean) * (sample - mean).transpose()).sum::<Matrix3<f64>>();
    (mean, scatter / count)
}

/// A density over colours.
pub(crate) struct ColorMixture {
    components: Vec<Component>,
}

impl ColorMixture {
    /// Learns without previous Gaussians: groups of colours are split in two across their largest extent until there
    /// are as many groups as Gaussians. `None` for too few colours.
    ///
    /// # Source
    /// Orchard and Bouman, "Color quantization of images", 1991, which GrabCut starts from as well. It needs no random
    /// start.
    pub fn learn(colors: &[Lab]) -> Option<Self> {
        let mut groups = vec![colors.iter().map(vector64).collect::<Vec<_>>()];
        while groups.len() < NUM_COMPONENTS {
            let spread = |group: &Vec<Vector3<f64>>| {
                let (mean, scatter) = moments(group);
                let eigen = SymmetricEigen::new(scatter);
                let longest = eigen.eigenvalues.imax();
                (eigen.eigenvalues[longest] * group.len() as f64, mean, eigen.eigenvectors.column(longest).into_owned())
            };
            let widest = groups.iter().map(spread).enumerate().max_by(|a, b| a.1.0.total_cmp(&b.1.0));
            let Some((at, (extent, mean, axis))) = widest.filter(|(_, (extent, ..))| *extent > 0.0) else { break };
            debug_assert!(extent.is_finite());
            let group = groups.swap_remove(at);
            let (above, below) = group.into_iter().partition(|color| (color - mean).dot(&axis) > 0.0);
            groups.extend([above, below]);
        }
        // Splits are planes; colours near them often belong to the other side.
        Self::fit(&groups, colors.len())?.relearn(colors)
    }

    /// Learns again from mostly known colours: each is assigned to its most likely Gaussian.
    pub fn relearn(&self, colors: &[Lab]) -> Option<Self> {
        let mut groups = vec![Vec::new(); self.components.len()];
        for color in colors {
            let here = vector(color);
            let likeliest = self
                .components
                .iter()
                .map(|component| component.log_density(&here))
                .enumerate()
                .max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((at, _)) = likeliest {
                groups[at].push(vector64(color));
            }
        }
        Self::fit(&groups, colors.len())
    }

    fn fit(groups: &[Vec<Vector3<f64>>], of: usize) -> Option<Self> {
        let components: Vec<_> = groups.iter().filter_map(|group| Component::fit(group, of)).collect();
        (!components.is_empty()).then_some(Self { components })
    }

    /// Logarithm of the density, without a constant that is equal in all mixtures.
    pub fn log_density(&self, color: &Lab) -> f32 {
        let color = vector(color);
        let densities = || self.components.iter().map(|component| component.log_density(&color));
        // The largest is factored out, because otherwise all densities could underflow.
        let largest = densities().fold(f32::NEG_INFINITY, f32::max);
        largest + densities().map(|density| (density - largest).exp()).sum::<f32>().ln()
    }

    /// Whether the colour is among the learnt ones.
    pub fn explains(&self, color: &Lab) -> bool {
        let color = vector(color);
        self.components.iter().any(|component| component.distance_squared(&color) < EXPLAINED)
    }

    /// The shadow in which a learnt colour looks like this one: of all possible shadows, that with the smallest tint.
    pub fn shade_of(&self, color: &Lab) -> Option<Shade> {
        let color = vector(color);
        let shades =
            self.components.iter().filter(|component| component.weight >= MIN_SHADED_WEIGHT).map(|component| {
                let factor = (color.x + BLACK) / (component.mean.x + BLACK);
                Shade { factor, tint: [1, 2].map(|axis| color[axis] - factor * component.mean[axis]) }
            });
        let possible = shades.filter(|shade| (DARKEST_SHADE_SAID..BRIGHTEST_SAID).contains(&shade.factor));
        let tint = |shade: &Shade| shade.tint[0].hypot(shade.tint[1]);
        possible.filter(|shade| tint(shade) <= MAX_TINT).min_by(|a, b| tint(a).total_cmp(&tint(b)))
    }

    /// Whether the colour is a learnt one in this shadow, or in a weaker one.
    pub fn explains_under(&self, color: &Lab, shade: &Shade) -> bool {
        let color = vector(color);
        self.components.iter().any(|component| component.explains_under(&color, shade))
    }

    /// Whether the colour is a learnt one in a shadow.
    pub fn explains_shaded(&self, color: &Lab) -> bool {
        let color = vector(color);
        self.components.iter().any(|component| component.explains_shaded(&color))
    }
}

fn vector(color: &Lab) -> Vector3<f32> {
    Vector3::from(color.0)
}

fn vector64(color: &Lab) -> Vector3<f64> {
    vector(color).cast()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tight groups of colours, a tenth of them dark.
    fn colors() -> Vec<Lab> {
        (0..1000)
            .map(|i| {
                let jitter = (i * 37 % 11) as f32 / 11.0 - 0.5;
                if i % 10 == 0 { Lab([20.0 + jitter, 30.0, jitter]) } else { Lab([71.0 + jitter, -1.0, 3.0 - jitter]) }
            })
            .collect()
    }

    #[test]
    fn colours_learnt_from_are_explained_and_others_not() {
        let mixture = ColorMixture::learn(&colors()).unwrap();
        assert!(mixture.explains(&Lab([71.0, -1.0, 3.0])) && mixture.explains(&Lab([20.0, 30.0, 0.0])));
        assert!(!mixture.explains(&Lab([45.0, 15.0, 1.0])), "between the groups");
        // Nine times as many light colours as dark ones: a difference of ln 9 = 2.2.
        let apart = mixture.log_density(&Lab([71.0, -1.0, 3.0])) - mixture.log_density(&Lab([20.0, 30.0, 0.0]));
        assert!((apart - 2.2).abs() < 0.5, "{apart}");
    }

    #[test]
    fn a_shadow_is_the_same_colour_with_less_light() {
        let mixture = ColorMixture::learn(&colors()).unwrap();
        // sRGB (178, 174, 169) and the same surface under 0.4 of the light: every linear channel times 0.4.
        let lit = Lab::from_srgb([178, 174, 169]);
        let shaded = Lab::from_srgb([117, 114, 111]);
        let table = ColorMixture::learn(&[lit; 100]).unwrap();
        assert!(!table.explains(&shaded) && table.explains_shaded(&shaded));
        assert!(!table.explains_shaded(&Lab::from_srgb([110, 112, 122])), "bluer");
        assert!(!table.explains_shaded(&Lab::from_srgb([20, 20, 19])), "darker than shadows are");
        assert!(!mixture.explains_shaded(&Lab([90.0, -1.0, 3.0])), "lighter");
    }

    #[test]
    fn learning_again_follows_the_colours() {
        let mixture = ColorMixture::learn(&colors()).unwrap();
        let light: Vec<Lab> = colors().into_iter().filter(|color| color.0[0] > 50.0).collect();
        let again = mixture.relearn(&light).unwrap();
        assert!(again.log_density(&Lab([20.0, 30.0, 0.0])) < mixture.log_density(&Lab([20.0, 30.0, 0.0])) - 10.0);
    }

    #[test]
    fn too_few_colours_make_no_mixture() {
        assert!(ColorMixture::learn(&[]).is_none() && ColorMixture::learn(&[Lab([1.0; 3]); 3]).is_none());
        assert!(ColorMixture::learn(&[Lab([1.0; 3]); 4]).is_some(), "all alike");
    }
}
