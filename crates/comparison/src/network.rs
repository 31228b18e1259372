//! The network: from views to log-odds.

use burn::module::Module;
use burn::tensor::{Device, Tensor, activation};
use sdg_kernels::cosines;
use sdg_layers::{ConvNormRelu, Distribution, Initializer, Linear, Stage};

use crate::alignment::{Alignment, CellCosines};
use crate::config::{ComparisonConfig, ComparisonError};
use crate::view::{Batch, DIFFERENCES, View};

/// Side of the first convolution's kernel.
const FIRST_KERNEL: usize = 5;
/// Added to the squared length of a cell's features, so that the cosines of a cell without features are 0.
const SQUARE_EPSILON: f32 = 1e-4;

/// The comparison network.
#[derive(Module, Debug)]
pub struct ComparisonNetwork {
    /// Computes the map of a square of the demonstration or of the picture; the same weights for both.
    pub trunk: Vec<Stage>,
    /// Computes the last map from the compared features: cosines, feature differences, the demonstration's features and
    /// the views' differences.
    pub stages: Vec<Stage>,
    /// Fully connected layer, from the flattened last map to the hidden units.
    pub hidden: Linear,
    /// Fully connected layer, from the hidden units to the log-odds.
    pub output: Linear,
    #[module(skip)]
    config: ComparisonConfig,
}

impl ComparisonConfig {
    /// Builds the network with random parameters from a seed. For training, the device must support autodiff.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub fn init(&self, device: &Device, seed: u64) -> Result<ComparisonNetwork, ComparisonError> {
        self.check()?;
        Ok(ComparisonNetwork::init(self, &mut Initializer::new(device, seed)))
    }

    /// Builds the network without initial values, for a caller that then sets all parameters.
    ///
    /// # Errors
    /// As for [`Self::init`].
    pub fn init_blank(&self, device: &Device) -> Result<ComparisonNetwork, ComparisonError> {
        self.check()?;
        Ok(ComparisonNetwork::init(self, &mut Initializer::blank(device)))
    }
}

impl ComparisonNetwork {
    fn init(config: &ComparisonConfig, init: &mut Initializer) -> Self {
        let groups = config.norm_groups;
        let trunk = stages(3, FIRST_KERNEL, &config.trunk_channels, &config.trunk_convs, groups, init);
        let of_trunk = config.trunk_channels.last().copied().unwrap_or(3);
        let compared = (2 * config.reach + 1).pow(2) + 2 * of_trunk + DIFFERENCES;
        let head = stages(compared, 3, &config.stage_channels, &config.stage_convs, groups, init);
        let flat = config.stage_channels.last().copied().unwrap_or(compared) * config.last_map_px().pow(2);
        let hidden = Linear::init(flat, config.hidden, Distribution::he_normal(flat), init);
        // Small initial weights, so that the first log-odds are near zero.
        let output = Linear::init(config.hidden, 1, Distribution::Normal { std: 0.01 }, init);
        Self { trunk, stages: head, hidden, output, config: config.clone() }
    }

    /// The configuration that the network was built from.
    pub fn config(&self) -> &ComparisonConfig {
        &self.config
    }

    /// The device that the parameters are on.
    pub fn device(&self) -> Device {
        self.output.weight.val().device()
    }

    /// The log-odds that each view shows the part in the view's pose, `[N, 1]`.
    ///
    /// # Panics
    /// Without a view, or with views of another size than this network's.
    pub fn forward(&self, views: &[View]) -> Tensor<2> {
        let maps = self.maps(views);
        self.log_odds(&maps)
    }

    /// The log-odds of each view and the correction of its pose; empty without a view.
    ///
    /// # Panics
    /// With views of another size than this network's.
    pub async fn compare(&self, views: &[View]) -> Vec<Comparison> {
        if views.is_empty() {
            return Vec::new();
        }
        let maps = self.maps(views);
        // One tensor, because each read waits for the device.
        let read = Tensor::cat(vec![self.log_odds(&maps), maps.cells()], 1);
        let map_px = maps.map_px();
        let of_view = |values: &[f32]| {
            let (log_odds, cells) = values.split_at(1);
            Comparison { log_odds: log_odds[0].into(), cells: self.cells(cells, map_px) }
        };
        rows(read, views.len()).await.iter().map(|values| of_view(values)).collect()
    }

    /// The correction of the pose of each view. The views may be finer than those on which the log-odds are learnt
    /// ([`ComparisonConfig::finer`]), since the features are computed in the same way at every position. Empty without
    /// views.
    ///
    /// # Panics
    /// With views of several sizes.
    pub async fn align(&self, views: &[View]) -> Vec<Alignment> {
        if views.is_empty() {
            return Vec::new();
        }
        let maps = self.maps(views);
        let map_px = maps.map_px();
        rows(maps.cells(), views.len()).await.iter().map(|values| self.cells(values, map_px).alignment()).collect()
    }

    /// Splits the fractions inside the outline and the cosines of one view.
    fn cells(&self, values: &[f32], map_px: usize) -> CellCosines {
        let (inside, cosines) = values.split_at(map_px * map_px);
        CellCosines { cosines: cosines.to_vec(), inside: inside.to_vec(), reach: self.config.reach, map_px }
    }

    fn maps(&self, views: &[View]) -> Maps {
        let Batch { demonstrations, demonstration_of_view, pictures, differences } = Batch::new(views, &self.device());
        let demonstration = through(&self.trunk, demonstrations).select(0, demonstration_of_view);
        let picture = through(&self.trunk, pictures);
        let inside = differences.clone().narrow(1, DIFFERENCES - 1, 1);
        let cosines = cosines(demonstration.clone(), picture.clone(), self.config.reach, SQUARE_EPSILON);
        Maps { demonstration, picture, differences, inside, cosines }
    }

    fn log_odds(&self, maps: &Maps) -> Tensor<2> {
        let Maps { demonstration, picture, differences, inside, cosines } = maps.clone();
        let correlated = cosines * inside.clone();
        let differing = (demonstration.clone() - picture).abs() * inside;
        let compared = Tensor::cat(vec![correlated, differing, demonstration, differences], 1);
        let map = through(&self.stages, compared);
        self.output.forward(activation::relu(self.hidden.forward(map.flatten(1, 3))))
    }
}

/// The output of the network for a view.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The log-odds that the view shows the part in the view's pose.
    pub log_odds: f64,
    cells: CellCosines,
}

impl Comparison {
    /// Finds the correction of the pose.
    pub fn alignment(&self) -> Alignment {
        self.cells.alignment()
    }
}

/// The compared features of N views.
#[derive(Clone)]
struct Maps {
    /// `[N, C, M, M]`.
    demonstration: Tensor<4>,
    /// `[N, C, M, M]`.
    picture: Tensor<4>,
    /// `[N, DIFFERENCES, M, M]`; the last channel is the fraction of each cell inside the outline.
    differences: Tensor<4>,
    inside: Tensor<4>,
    /// `[N, (2 reach + 1)², M, M]`.
    cosines: Tensor<4>,
}

impl Maps {
    /// M.
    fn map_px(&self) -> usize {
        self.inside.dims()[3]
    }

    /// The fractions inside the outline and the cosines of each view, `[N, (1 + (2 reach + 1)²) M²]`.
    fn cells(&self) -> Tensor<2> {
        Tensor::cat(vec![self.inside.clone().flatten(1, 3), self.cosines.clone().flatten(1, 3)], 1)
    }
}

/// The rows of a tensor, `[N, …]`.
async fn rows(tensor: Tensor<2>, n: usize) -> Vec<Vec<f32>> {
    let values: Vec<f32> = tensor.into_data_async().await.expect("device results are readable").iter().collect();
    values.chunks_exact(values.len() / n).map(<[f32]>::to_vec).collect()
}

/// Stages that each halve their map; `first_kernel` is the side of the first convolution's kernel.
fn stages(
    mut in_channels: usize,
    first_kernel: usize,
    channels: &[usize],
    convs: &[usize],
    num_groups: usize,
    init: &mut Initializer,
) -> Vec<Stage> {
    let mut made = Vec::with_capacity(channels.len());
    for (stage, (&channels, &num_convs)) in channels.iter().zip(convs).enumerate() {
        let convs = (0..num_convs)
            .map(|conv| {
                let kernel = if stage == 0 && conv == 0 { first_kernel } else { 3 };
                let stride = if conv == 0 { 2 } else { 1 };
                let shape = [channels, in_channels, kernel, kernel];
                in_channels = channels;
                ConvNormRelu::init(shape, stride, num_groups, init)
            })
            .collect();
        made.push(Stage { convs });
    }
    made
}

fn through(stages: &[Stage], x: Tensor<4>) -> Tensor<4> {
    stages.iter().flat_map(|stage| &stage.convs).fold(x, |x, conv| conv.forward(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Reference;
    use burn::tensor::read_sync;
    use image::{Rgb, RgbImage};
    use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon};
    use sdg_layers::state_dict;
    use sdg_picture::Pyramid;

    fn view(reference: &Reference, tx: f64) -> View {
        let image = RgbImage::from_fn(140, 90, |x, y| Rgb([(x % 50 * 5) as u8, (y % 40 * 6) as u8, 90]));
        reference.view(&Pyramid::new(&image), &PlanarSimilarity { tx, ..PlanarSimilarity::IDENTITY })
    }

    fn reference(network: &ComparisonNetwork) -> Reference {
        let image = RgbImage::from_fn(140, 90, |x, y| Rgb([(x % 50 * 5) as u8, (y % 40 * 6) as u8, 90]));
        let outline = Polygon::from_box(&BoundingBox { x1: 20.0, y1: 30.0, x2: 100.0, y2: 50.0 });
        Reference::new(&image, &outline, network.config())
    }

    #[test]
    fn a_batch_is_read_as_each_of_its_views_alone() {
        let network = ComparisonConfig::edge().init(&Device::flex(), 5).unwrap();
        let reference = reference(&network);
        let views = [view(&reference, 0.0), view(&reference, 25.0)];
        let together = read_sync(network.compare(&views));
        assert_ne!(together[0].log_odds, together[1].log_odds);
        let forward: Vec<f32> = network.forward(&views).into_data().iter().collect();
        for ((view, found), forward) in views.into_iter().zip(&together).zip(forward) {
            let alone = &read_sync(network.compare(&[view]))[0];
            assert!((alone.log_odds - found.log_odds).abs() < 1e-4, "{alone:?} {found:?}");
            assert_eq!(found.log_odds, f64::from(forward));
            assert!((alone.alignment().offset.tx - found.alignment().offset.tx).abs() < 1e-3);
        }
        assert!(read_sync(network.compare(&[])).is_empty());
    }

    #[test]
    fn correlation_is_one_where_the_maps_are_the_same_and_finds_a_shift() {
        let network = ComparisonConfig::edge().init(&Device::flex(), 5).unwrap();
        let map = Tensor::<4>::random([1, 48, 16, 16], burn::tensor::Distribution::Normal(0.0, 1.0), &Device::flex());
        // The picture's content shifted one cell to the right.
        let moved = Tensor::cat(vec![map.clone().narrow(3, 15, 1), map.clone().narrow(3, 0, 15)], 3);
        let strongest = |other: &Tensor<4>| {
            let values = cosines(map.clone(), other.clone(), network.config.reach, SQUARE_EPSILON)
                .into_data()
                .try_to_vec_as::<f32>()
                .unwrap();
            let at = |shift: usize| values[shift * 256 + 8 * 16 + 8];
            (0..25).max_by(|a, b| at(*a).total_cmp(&at(*b))).map(|shift| (shift, at(shift))).unwrap()
        };
        let (shift, value) = strongest(&map);
        assert!(shift == 12 && (value - 1.0).abs() < 1e-3, "{shift} {value}");
        let (shift, value) = strongest(&moved);
        assert!(shift == 13 && (value - 1.0).abs() < 1e-3, "{shift} {value}");
    }

    #[test]
    fn the_preset_has_about_six_hundred_thousand_parameters() {
        let network = ComparisonConfig::edge().init_blank(&Device::flex()).unwrap();
        let count: usize = state_dict::export(&network).values().map(|tensor| tensor.values.len()).sum();
        assert!((500_000..650_000).contains(&count), "{count}");
    }
}
