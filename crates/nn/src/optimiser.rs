//! Optimisers whose complete state can be saved: Adam, SGD and RMSprop, as in the paper's sweeps.

use dfdx::prelude::{Cpu, CpuError, Gradients};
use serde::{Deserialize, Serialize};

use super::{
    Mlp, NnError, TensorFile, TensorFileError,
    kernel::{Adam, Kernel, LINE, RmsProp, Rule, Sgd, SumOfSquares, Update},
};

/// The optimisers of the paper's hyperparameter sweeps (tables 1 and 2), with PyTorch's default
/// constants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OptimiserKind {
    /// Adam (Kingma and Ba, 2015): β₁ 0.9, β₂ 0.999, ε 1e-8.
    #[default]
    Adam,
    /// Plain stochastic gradient descent without momentum.
    Sgd,
    /// RMSprop (Tieleman and Hinton, 2012): α 0.99, ε 1e-8 added outside the root.
    RmsProp,
}

const BETA1: f32 = 0.9;
const BETA2: f32 = 0.999;
const ALPHA: f32 = 0.99;
const EPSILON: f32 = 1e-8;

/// Updates the parameters of one or several networks; holds moments and step count.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimiser {
    /// Which optimiser this is.
    pub kind: OptimiserKind,
    /// Updates done so far.
    pub steps: u64,
    /// Adam: mean of gradients, for all parameters in order. Empty for the others.
    mean: Vec<f32>,
    /// Adam, RMSprop: mean of squared gradients. Empty for SGD.
    square: Vec<f32>,
    parameters: usize,
}

impl Optimiser {
    /// An optimiser for `networks`, which must be passed in this order to every
    /// [`update`](Self::update).
    pub fn new(kind: OptimiserKind, networks: &[&Mlp]) -> Self {
        let n = networks.iter().map(|m| m.shape().parameters()).sum();
        let (mean, square) = match kind {
            OptimiserKind::Adam => (n, n),
            OptimiserKind::RmsProp => (0, n),
            OptimiserKind::Sgd => (0, 0),
        };
        Self { kind, steps: 0, mean: vec![0.0; mean], square: vec![0.0; square], parameters: n }
    }

    /// Takes one descent step with learning rate `rate`. A missing gradient counts as 0. Returns the
    /// Euclidean norm over all gradients.
    ///
    /// # Errors
    /// [`NnError::NotFinite`] when a gradient is infinite or NaN, [`NnError::Unusable`]
    /// when the number of parameters differs from that of the networks it was created for. In both
    /// cases nothing is changed.
    pub fn update(
        &mut self,
        networks: &mut [&mut Mlp],
        grads: &mut Gradients<f32, Cpu>,
        rate: f32,
    ) -> Result<f64, NnError> {
        let found: usize = networks.iter().map(|m| m.shape().parameters()).sum();
        if found != self.parameters {
            let expected = self.parameters;
            let what = format!("the optimiser holds state for {expected} parameters, the networks have {found}");
            return Err(NnError::Unusable(what));
        }
        let norm = norm(networks, grads)?;
        if !norm.is_finite() {
            return Err(NnError::NotFinite { norm });
        }
        self.steps += 1;
        let kind = self.kind;
        let correction = |beta: f32| 1.0 / (1.0 - f64::from(beta).powf(self.steps as f64));
        let (corrected, square_correction) = ((f64::from(rate) * correction(BETA1)) as f32, correction(BETA2) as f32);
        let adam = Adam { beta1: BETA1, beta2: BETA2, epsilon: EPSILON, rate: corrected, square_correction };
        let (mut mean, mut square) = (&mut self.mean[..], &mut self.square[..]);
        for network in networks {
            let gradient = grads.get_or_alloc_mut(network.parameters())?;
            let (mean, square) = (split_front(&mut mean, gradient.len()), split_front(&mut square, gradient.len()));
            network.edit(|parameters| match kind {
                OptimiserKind::Adam => apply(adam, [parameters, mean, square], gradient),
                OptimiserKind::RmsProp => {
                    apply(RmsProp { alpha: ALPHA, epsilon: EPSILON, rate }, [parameters, square], gradient);
                }
                OptimiserKind::Sgd => apply(Sgd { rate }, [parameters], gradient),
            });
        }
        Ok(norm)
    }

    /// Adds moments to `file` as `prefix.mean` and `prefix.square`, kind and step count to its
    /// metadata.
    pub fn save(&self, file: &mut TensorFile, prefix: &str) {
        let state = State { kind: self.kind, steps: self.steps, parameters: self.parameters };
        let text = serde_json::json!(state).to_string();
        file.metadata.insert(format!("{prefix}.state"), text);
        for (name, values) in [("mean", &self.mean), ("square", &self.square)] {
            if !values.is_empty() {
                file.insert(format!("{prefix}.{name}"), vec![values.len()], values.clone());
            }
        }
    }

    /// The optimiser that [`save`](Self::save) stored under `prefix`.
    ///
    /// # Errors
    /// When the metadata or a moment is missing or invalid.
    pub fn load(file: &TensorFile, prefix: &str) -> Result<Self, TensorFileError> {
        let State { kind, steps, parameters } = file.json(&format!("{prefix}.state"))?;
        let moment = |name: &str| Ok(file.get(&format!("{prefix}.{name}"), &[parameters])?.to_vec());
        let (mean, square) = match kind {
            OptimiserKind::Adam => (moment("mean")?, moment("square")?),
            OptimiserKind::RmsProp => (Vec::new(), moment("square")?),
            OptimiserKind::Sgd => (Vec::new(), Vec::new()),
        };
        Ok(Self { kind, steps, mean, square, parameters })
    }
}

/// The part of an optimiser's state that is not a tensor.
#[derive(Serialize, Deserialize)]
struct State {
    kind: OptimiserKind,
    steps: u64,
    parameters: usize,
}

/// Euclidean norm; infinite or NaN if any gradient is (or if the squares exceed the range of
/// `f32`, which is divergence as well). Summed layer by layer, in order.
fn norm(networks: &[&mut Mlp], grads: &mut Gradients<f32, Cpu>) -> Result<f64, CpuError> {
    let mut squares = 0.0;
    for network in networks {
        let gradient = grads.get_or_alloc_mut(network.parameters())?;
        for layer in network.layers() {
            let (weight, bias) = layer.split(gradient);
            squares += f64::from(SumOfSquares(weight).execute()) + f64::from(SumOfSquares(bias).execute());
        }
    }
    Ok(squares.sqrt())
}

/// Removes the first `n` elements from `rest` and returns them; empty if `rest` is empty.
fn split_front<'a>(rest: &mut &'a mut [f32], n: usize) -> &'a mut [f32] {
    let slice = std::mem::take(rest);
    let (front, back) = slice.split_at_mut(n.min(slice.len()));
    *rest = back;
    front
}

/// Parameters below which a second thread costs more than it saves.
const MIN_PER_THREAD: usize = 50_000;

/// Applies a rule to all parameters of a network; halves of large networks run in parallel.
fn apply<R, const N: usize>(rule: R, mut state: [&mut [f32]; N], input: &[f32])
where
    R: Rule<N> + Copy + Send + Sync,
{
    if input.len() <= MIN_PER_THREAD {
        return Update { rule, state, input }.execute();
    }
    let half = (input.len() / 2).next_multiple_of(LINE);
    let (front, back) = input.split_at(half);
    let state_of_front = state.each_mut().map(|rest| split_front(rest, half));
    rayon::join(|| apply(rule, state_of_front, front), || apply(rule, state, back));
}

#[cfg(test)]
mod tests {
    use dfdx::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{Activation, InitScheme, Matrix, MlpShape, matrix};

    const KINDS: [OptimiserKind; 3] = [OptimiserKind::Adam, OptimiserKind::Sgd, OptimiserKind::RmsProp];

    fn network(seed: u64) -> Mlp {
        let shape = MlpShape::uniform(2, 9, 1, 3, Activation::Tanh);
        Mlp::new(shape, InitScheme::FanIn, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap()
    }

    fn samples() -> (Matrix, Matrix) {
        let x: Vec<f32> = (0..40).map(|i| (i as f32 * 0.7).sin()).collect();
        let y = x.chunks(2).map(|p| p[0] * p[1]).collect();
        let device = Cpu::default();
        (matrix(&device, x, 20, 2), matrix(&device, y, 20, 1))
    }

    fn train(net: &mut Mlp, optimiser: &mut Optimiser, rate: f32, steps: usize) -> f32 {
        let (x, y) = samples();
        let mut last = f32::NAN;
        for _ in 0..steps {
            let loss = (net.forward_data(x.leaky_trace()) - y.clone()).square().mean();
            last = loss.array();
            optimiser.update(&mut [net], &mut loss.backward(), rate).unwrap();
        }
        last
    }

    #[test]
    fn every_kind_learns() {
        for (kind, rate) in KINDS.into_iter().zip([1e-2, 0.1, 1e-3]) {
            let mut net = network(1);
            let mut optimiser = Optimiser::new(kind, &[&net]);
            let first = train(&mut net, &mut optimiser, rate, 1);
            let last = train(&mut net, &mut optimiser, rate, 2000);
            assert!(last < 0.2 * first, "{kind:?}: {first} to {last}");
            assert_eq!(optimiser.steps, 2001);
        }
    }

    #[test]
    fn adam_agrees_with_dfdx() {
        // One unit with weight w and bias b on one sample: dfdx's Adam on the same two numbers.
        let shape = MlpShape::uniform(1, 1, 1, 1, Activation::Identity);
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut net = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap();
        let mut optimiser = Optimiser::new(OptimiserKind::Adam, &[&net]);
        let device = Cpu::default();
        let mut theirs = (device.tensor([net.values()[0]]), device.tensor([net.values()[1]]));
        let mut adam = dfdx::optim::Adam::new(&theirs, dfdx::optim::AdamConfig { lr: 0.05, ..Default::default() });
        let x = matrix(&device, vec![0.7], 1, 1);
        for _ in 0..50 {
            let loss = (net.forward_data(x.leaky_trace()) - 1.0).square().mean();
            optimiser.update(&mut [&mut net], &mut loss.backward(), 0.05).unwrap();
            let (w, b) = &theirs;
            let grads = (w.leaky_trace() * 0.7 + b.clone() - 1.0).square().mean().backward();
            dfdx::optim::Optimizer::update(&mut adam, &mut theirs, &grads).unwrap();
            for (ours, theirs) in net.values().iter().zip([theirs.0.array()[0], theirs.1.array()[0]]) {
                assert!((ours - theirs).abs() < 1e-5, "{ours} {theirs}");
            }
        }
    }

    #[test]
    fn a_saved_optimiser_continues_bit_for_bit() {
        for kind in KINDS {
            let mut net = network(3);
            let mut optimiser = Optimiser::new(kind, &[&net]);
            train(&mut net, &mut optimiser, 1e-2, 5);
            let mut file = TensorFile::default();
            net.save(&mut file, "net");
            optimiser.save(&mut file, "optimiser");
            let file = TensorFile::from_bytes(&file.to_bytes()).unwrap();
            let mut loaded_net = Mlp::load(net.shape().clone(), &file, "net").unwrap();
            let mut loaded = Optimiser::load(&file, "optimiser").unwrap();
            assert_eq!(loaded, optimiser);
            train(&mut net, &mut optimiser, 1e-2, 5);
            train(&mut loaded_net, &mut loaded, 1e-2, 5);
            assert_eq!(loaded_net.values(), net.values());
            assert_eq!(loaded, optimiser);
        }
    }

    #[test]
    fn non_finite_gradients_change_nothing() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut net = network(4);
            let mut optimiser = Optimiser::new(OptimiserKind::Adam, &[&net]);
            train(&mut net, &mut optimiser, 1e-2, 3);
            let (before, state) = (net.values().to_vec(), optimiser.clone());
            let x = matrix(&Cpu::default(), vec![bad, 1.0], 1, 2);
            let loss = net.forward_data(x.leaky_trace()).square().mean() * bad;
            let mut grads = loss.backward();
            let error = optimiser.update(&mut [&mut net], &mut grads, 1e-2).unwrap_err();
            assert!(matches!(error, NnError::NotFinite { norm } if !norm.is_finite()));
            assert_eq!((net.values(), optimiser), (&before[..], state));
        }
    }

    #[test]
    fn the_norm_covers_all_gradients() {
        let shape = MlpShape::uniform(1, 1, 1, 1, Activation::Identity);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut net = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap();
        let mut optimiser = Optimiser::new(OptimiserKind::Sgd, &[&net]);
        let x = matrix(&Cpu::default(), vec![0.75], 1, 1);
        // d/dw = 0.75 * 4, d/db = 4
        let mut grads = (net.forward_data(x.leaky_trace()) * 4.0).sum().backward();
        let norm = optimiser.update(&mut [&mut net], &mut grads, 1e-3).unwrap();
        assert!((norm - 5.0).abs() < 1e-6, "{norm}");
    }

    #[test]
    fn other_networks_and_files_are_refused() {
        let (mut net, other) = (network(6), network(7));
        let mut optimiser = Optimiser::new(OptimiserKind::Adam, &[&net, &other]);
        let mut grads = Gradients::leaky();
        let error = optimiser.update(&mut [&mut net], &mut grads, 1e-3).unwrap_err();
        assert!(matches!(error, NnError::Unusable(_)));
        let mut file = TensorFile::default();
        optimiser.save(&mut file, "a");
        assert!(Optimiser::load(&file, "b").is_err());
        file.metadata.insert("a.state".into(), "{}".into());
        assert!(Optimiser::load(&file, "a").is_err());
    }
}
