//! The network in burn, its training, and its weights as a file.

use std::collections::BTreeMap;

use burn::module::{Module, Param};
use burn::nn::{BatchNorm, BatchNormConfig};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData, activation};
use half::f16;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use safetensors::tensor::{Dtype, TensorView};
use sdg_kernels::{Conv2dParams, conv2d};
use sdg_layers::Linear;
use sdg_layers::initialization::{Distribution, Initializer};
use sdg_shape::{LAYERS, LikenessNetwork, NUM_CHANNELS, NUM_HIDDEN, Pair, SIDE};
use sdg_training::{AdamW, OneCycle};

use crate::drawn::Result;
use crate::pairs::{Pairs, Stream};
use crate::rendered::Rendered;

const BATCH: usize = 128;
/// Fraction of each batch that comes from rendered pairs. Chosen by hand.
const RENDERED_SHARE: f64 = 0.35;
const SCHEDULE: OneCycle = OneCycle { peak: 2e-3, warm_up: 0.1 };
const WEIGHT_DECAY: f64 = 0.02;
const MAX_GRADIENT_NORM: f64 = 1.0;

/// A convolution, a batch norm and a rectifier. In the file, the norm is folded into the convolution.
#[derive(Module, Debug)]
struct Convolution {
    weight: Param<Tensor<4>>,
    norm: BatchNorm,
    stride: usize,
}

#[derive(Module, Debug)]
struct Network {
    convolutions: Vec<Convolution>,
    hidden: Linear,
    answer: Linear,
}

impl Network {
    fn new(device: &Device, seed: u64) -> Self {
        let mut init = Initializer::new(device, seed);
        let convolutions = LAYERS
            .iter()
            .map(|layer| Convolution {
                weight: init.param([layer.outputs, layer.inputs, 3, 3], Distribution::he_normal(9 * layer.inputs)),
                norm: BatchNormConfig::new(layer.outputs).init(device),
                stride: layer.stride,
            })
            .collect();
        let pooled = 2 * LAYERS[LAYERS.len() - 1].outputs;
        let hidden = Linear::init(pooled, NUM_HIDDEN, Distribution::he_normal(pooled), &mut init);
        let answer = Linear::init(NUM_HIDDEN, 1, Distribution::Normal { std: 0.05 }, &mut init);
        Self { convolutions, hidden, answer }
    }

    /// `[N, 8, 64, 64]` to `[N]` log-odds.
    fn forward(&self, pairs: Tensor<4>) -> Tensor<1> {
        let mut map = pairs;
        for convolution in &self.convolutions {
            map = conv2d(map, convolution.weight.val(), None, Conv2dParams::square(convolution.stride, 1));
            map = activation::relu(convolution.norm.forward(map));
        }
        let flat: Tensor<3> = map.flatten(2, 3);
        let mean: Tensor<2> = flat.clone().mean_dim(2).squeeze_dim(2);
        let max: Tensor<2> = flat.max_dim(2).squeeze_dim(2);
        let hidden = activation::relu(self.hidden.forward(Tensor::cat(vec![mean, max], 1)));
        self.answer.forward(hidden).squeeze_dim(1)
    }

    fn loss(&self, batch: &[(Vec<f32>, bool)], device: &Device) -> Tensor<1> {
        let pairs = batch.iter().flat_map(|(values, _)| values.iter().copied()).collect::<Vec<_>>();
        let pairs = Tensor::<4>::from_data(TensorData::new(pairs, [batch.len(), SIDE, SIDE, NUM_CHANNELS]), device);
        // −1 for correct examples: −ln p is the softplus of the signed log-odds.
        let signs: Vec<f32> = batch.iter().map(|(_, is_right)| if *is_right { -1.0 } else { 1.0 }).collect();
        let signs = Tensor::<1>::from_data(TensorData::new(signs, [batch.len()]), device);
        activation::softplus(self.forward(pairs.permute([0, 3, 1, 2])) * signs, 1.0).mean()
    }

    fn file(&self) -> Result<Vec<u8>> {
        let mut tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)> = BTreeMap::new();
        let mut put = |name: String, shape: Vec<usize>, data: TensorData| {
            tensors.insert(name, (shape, data.try_to_vec().expect("parameters are single precision")));
        };
        for (idx, Convolution { weight, norm, .. }) in self.convolutions.iter().enumerate() {
            let scale = norm.gamma.val() / (norm.running_var.value_sync() + norm.epsilon).sqrt();
            let bias = norm.beta.val() - norm.running_mean.value_sync() * scale.clone();
            let [outputs, inputs, ..] = weight.dims();
            let weight = weight.val() * scale.reshape([outputs, 1, 1, 1]);
            put(format!("convolution.{idx}.weight"), vec![outputs, inputs, 3, 3], weight.into_data());
            put(format!("convolution.{idx}.bias"), vec![outputs], bias.into_data());
        }
        for (name, linear) in [("hidden", &self.hidden), ("answer", &self.answer)] {
            put(format!("{name}.weight"), linear.weight.dims().to_vec(), linear.weight.val().into_data());
            put(format!("{name}.bias"), linear.bias.dims().to_vec(), linear.bias.val().into_data());
        }
        let halves: Vec<(String, Vec<usize>, Vec<u8>)> = tensors
            .into_iter()
            .map(|(name, (shape, values))| {
                (name, shape, values.iter().flat_map(|&value| f16::from_f32(value).to_le_bytes()).collect())
            })
            .collect();
        let views = halves
            .iter()
            .map(|(name, shape, bytes)| Ok((name.as_str(), TensorView::new(Dtype::F16, shape.clone(), bytes)?)))
            .collect::<Result<Vec<_>>>()?;
        Ok(safetensors::serialize(views, None)?)
    }
}

/// Trains on the training examples, and reports the classification of the held-out examples after every epoch. Returns
/// the bytes of the weights' file.
pub fn train(
    pairs: &Pairs,
    rendered: &Rendered,
    epochs: usize,
    seed: u64,
    say: &mut dyn FnMut(String),
) -> Result<Vec<u8>> {
    let device = Device::flex().autodiff();
    let mut network = Network::new(&device, seed);
    let mut optimizer = AdamW::new(WEIGHT_DECAY, MAX_GRADIENT_NORM);
    let mut order = pairs.of(Stream::Training);
    let num_rendered = if rendered.is_empty() { 0 } else { (RENDERED_SHARE * BATCH as f64) as usize };
    let num_drawn = BATCH - num_rendered;
    let steps = epochs * (order.len() / num_drawn);
    let (mut step, mut rng) = (0, Pcg64Mcg::seed_from_u64(seed));
    for epoch in 0..epochs {
        order.shuffle(&mut rng);
        let mut sum = 0.0;
        for idxs in order.chunks_exact(num_drawn) {
            let batch = batch(pairs, idxs, rendered, num_rendered, rng.random());
            let loss = network.loss(&batch, &device);
            sum += f64::from(loss.clone().into_scalar::<f32>());
            let gradients = GradientsParams::from_grads(loss.backward(), &network);
            network = optimizer.step(SCHEDULE.learning_rate(step as f64 / steps as f64), network, gradients);
            step += 1;
        }
        let mean = sum / (order.len() / num_drawn) as f64;
        let told = held_out(pairs, rendered, &LikenessNetwork::read(&network.valid().file()?)?);
        say(format!("epoch {epoch}: loss {mean:.4}; {told}"));
    }
    network.valid().file()
}

/// The examples of the indices and `num_rendered` rendered ones, each randomly changed with its own random stream; two
/// threads make them.
fn batch(pairs: &Pairs, idxs: &[usize], rendered: &Rendered, num_rendered: usize, seed: u64) -> Vec<(Vec<f32>, bool)> {
    let make = |k: usize| {
        let rng = &mut Pcg64Mcg::seed_from_u64(seed.wrapping_add(k as u64));
        let (pair, is_right) = match idxs.get(k) {
            Some(&idx) => (pairs.changed_pair(idx, rng), pairs.is_right(idx)),
            None => rendered.sample(rng),
        };
        (pair.values(), is_right)
    };
    let count = idxs.len() + num_rendered;
    std::thread::scope(|scope| {
        let first = scope.spawn(|| (0..count / 2).map(make).collect::<Vec<_>>());
        let second: Vec<_> = (count / 2..count).map(make).collect();
        let mut all = first.join().expect("a thread of the batch panicked");
        all.extend(second);
        all
    })
}

/// Loss and classification of the held-out examples by the network in its shipped form, as text.
fn held_out(pairs: &Pairs, rendered: &Rendered, network: &LikenessNetwork) -> String {
    let drawn = pairs.of(Stream::HeldOut).into_iter().map(|idx| (pairs.pair(idx), pairs.is_right(idx)));
    let drawn = Told::of(network, drawn);
    let rendered = Told::of(network, rendered.held_out().map(|(pair, is_right)| (pair.clone(), is_right)));
    format!("held out: {drawn}; rendered: {rendered}")
}

/// The classification of held-out examples.
struct Told {
    loss: f64,
    hits: usize,
    count: usize,
    /// The probability that a correct example scores higher than a wrong one.
    area: f64,
}

impl Told {
    fn of(network: &LikenessNetwork, examples: impl Iterator<Item = (Pair, bool)>) -> Self {
        let mut told: Vec<(f64, bool)> =
            examples.map(|(pair, is_right)| (f64::from(network.log_odds(&pair.values())), is_right)).collect();
        let signed = told.iter().map(|(log_odds, is_right)| if *is_right { *log_odds } else { -log_odds });
        let loss = signed.clone().map(|signed| (-signed).exp().ln_1p()).sum::<f64>() / told.len() as f64;
        let hits = signed.filter(|signed| *signed > 0.0).count();
        told.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut wrong, mut below) = (0usize, 0usize);
        for (_, is_right) in &told {
            if *is_right { below += wrong } else { wrong += 1 }
        }
        let area = below as f64 / (wrong * (told.len() - wrong)) as f64;
        Self { loss, hits, count: told.len(), area }
    }
}

impl std::fmt::Display for Told {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "loss {:.4}, {} of {} classified correctly, area {:.3}", self.loss, self.hits, self.count, self.area)
    }
}
