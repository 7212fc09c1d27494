//! Optimisers whose whole state can be saved: the paper's sweep set of Adam, SGD and RMSprop.

use dfdx::prelude::{Cpu, Gradients};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    Mlp, NnError, TensorFile, TensorFileError,
    kernel::{Adam, Buffer, Kernel, RmsProp, Sgd, SumOfSquares, Update},
    layer::{Layer, edit},
    mlp::{put_gradients, take_gradients},
    stack::LayerGradients,
};

/// The optimisers of the paper's hyperparameter sweeps (tables 1 and 2), with the constants that
/// PyTorch uses by default.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OptimiserKind {
    /// Adam (Kingma and Ba, 2015): β₁ 0.9, β₂ 0.999, ε 1e-8.
    Adam,
    /// Plain stochastic gradient descent, no momentum.
    Sgd,
    /// RMSprop (Tieleman and Hinton, 2012): α 0.99, ε 1e-8 outside the root.
    RmsProp,
}

const BETA1: f32 = 0.9;
const BETA2: f32 = 0.999;
const ALPHA: f32 = 0.99;
const EPSILON: f32 = 1e-8;

/// Updates the parameters of one or several networks; holds moments and step count.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimiser {
    kind: OptimiserKind,
    steps: u64,
    /// Adam: mean of gradients, over all parameters in order. Empty for the others.
    mean: Vec<f32>,
    /// Adam, RMSprop: mean of squared gradients. Empty for SGD.
    square: Vec<f32>,
    parameters: usize,
}

impl Optimiser {
    /// An optimiser for `networks`, to be given in this order to every [`update`](Self::update).
    pub fn new(kind: OptimiserKind, networks: &[&Mlp]) -> Self {
        let n = networks.iter().map(|m| m.shape().parameters()).sum();
        let (mean, square) = match kind {
            OptimiserKind::Adam => (n, n),
            OptimiserKind::RmsProp => (0, n),
            OptimiserKind::Sgd => (0, 0),
        };
        Self { kind, steps: 0, mean: vec![0.0; mean], square: vec![0.0; square], parameters: n }
    }

    /// Which optimiser this is.
    pub fn kind(&self) -> OptimiserKind {
        self.kind
    }

    /// Updates done so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// One step against the gradients with learning rate `rate`. A parameter without a gradient
    /// counts as having gradient 0. Returns the Euclidean norm over all gradients.
    ///
    /// # Errors
    /// [`NnError::NotFinite`] when a gradient is infinite or NaN, [`NnError::OptimiserMismatch`]
    /// when the networks are not those it was made for. Nothing is changed then.
    pub fn update(
        &mut self,
        networks: &mut [&mut Mlp],
        grads: &mut Gradients<f32, Cpu>,
        rate: f32,
    ) -> Result<f64, NnError> {
        let found = networks.iter().map(|m| m.shape().parameters()).sum();
        if found != self.parameters {
            return Err(NnError::OptimiserMismatch { expected: self.parameters, found });
        }
        let mut gradients = Vec::with_capacity(networks.len());
        for network in networks.iter() {
            gradients.push(take_gradients(network.layers(), grads)?);
        }
        let norm = norm(&gradients);
        if norm.is_finite() {
            self.steps += 1;
            self.step(networks, &gradients, rate);
        }
        for (network, gradients) in networks.iter().zip(gradients) {
            put_gradients(network.layers(), gradients, grads)?;
        }
        if norm.is_finite() { Ok(norm) } else { Err(NnError::NotFinite { norm }) }
    }

    fn step(&mut self, networks: &mut [&mut Mlp], gradients: &[Vec<LayerGradients>], rate: f32) {
        let rule = AnyRule::new(self.kind, self.steps, rate);
        let (mut mean, mut square) = (&mut self.mean[..], &mut self.square[..]);
        let mut work = Vec::new();
        for (network, gradients) in networks.iter_mut().zip(gradients) {
            for (layer, (weight, bias)) in network.layers_mut().iter_mut().zip(gradients) {
                let n = weight.len() + bias.len();
                let (mean, square) = (split_front(&mut mean, n), split_front(&mut square, n));
                work.push(LayerStep { layer, weight, bias, mean, square });
            }
        }
        if self.parameters < WORTH_A_THREAD || rayon::current_num_threads() == 1 {
            let mut copy = Buffer::default();
            work.into_iter().for_each(|layer| layer.run(rule, &mut copy));
        } else {
            work.into_par_iter().for_each_init(Buffer::default, |copy, layer| layer.run(rule, copy));
        }
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
    /// When the metadata or a moment is missing or does not fit.
    pub fn load(file: &TensorFile, prefix: &str) -> Result<Self, TensorFileError> {
        let key = format!("{prefix}.state");
        let invalid = |reason: String| TensorFileError::Metadata { key: key.clone(), reason };
        let text = file.metadata.get(&key).ok_or_else(|| invalid("not there".into()))?;
        let State { kind, steps, parameters } = serde_json::from_str(text).map_err(|e| invalid(e.to_string()))?;
        let moment = |name: &str| Ok(file.get(&format!("{prefix}.{name}"), &[parameters])?.to_vec());
        let (mean, square) = match kind {
            OptimiserKind::Adam => (moment("mean")?, moment("square")?),
            OptimiserKind::RmsProp => (Vec::new(), moment("square")?),
            OptimiserKind::Sgd => (Vec::new(), Vec::new()),
        };
        Ok(Self { kind, steps, mean, square, parameters })
    }
}

/// The part of an optimiser that is no tensor.
#[derive(Serialize, Deserialize)]
struct State {
    kind: OptimiserKind,
    steps: u64,
    parameters: usize,
}

/// Parameters below which a second thread costs more than it brings.
const WORTH_A_THREAD: usize = 50_000;

/// Euclidean norm; infinite or NaN if any gradient is (or if the squares exceed the range of
/// `f32`, which is divergence as well).
fn norm(gradients: &[Vec<LayerGradients>]) -> f64 {
    let square = |g: &[f32]| f64::from(SumOfSquares(g).go());
    let layers = gradients.iter().flatten();
    layers.map(|(weight, bias)| square(weight) + square(bias)).sum::<f64>().sqrt()
}

/// The first `n` elements of `rest`, which loses them; nothing if it is empty.
fn split_front<'a>(rest: &mut &'a mut [f32], n: usize) -> &'a mut [f32] {
    let slice = std::mem::take(rest);
    let (front, back) = slice.split_at_mut(n.min(slice.len()));
    *rest = back;
    front
}

#[derive(Clone, Copy)]
enum AnyRule {
    Adam(Adam),
    Sgd(Sgd),
    RmsProp(RmsProp),
}

impl AnyRule {
    fn new(kind: OptimiserKind, steps: u64, rate: f32) -> Self {
        let correction = |beta: f32| 1.0 / (1.0 - f64::from(beta).powf(steps as f64));
        match kind {
            OptimiserKind::Adam => Self::Adam(Adam {
                beta1: BETA1,
                beta2: BETA2,
                epsilon: EPSILON,
                rate: (f64::from(rate) * correction(BETA1)) as f32,
                square_correction: correction(BETA2) as f32,
            }),
            OptimiserKind::RmsProp => Self::RmsProp(RmsProp { alpha: ALPHA, epsilon: EPSILON, rate }),
            OptimiserKind::Sgd => Self::Sgd(Sgd { rate }),
        }
    }

    fn apply(self, parameters: &mut [f32], g: &[f32], mean: &mut [f32], square: &mut [f32]) {
        match self {
            Self::Adam(rule) => Update { rule, state: [parameters, mean, square], input: g }.go(),
            Self::RmsProp(rule) => Update { rule, state: [parameters, square], input: g }.go(),
            Self::Sgd(rule) => Update { rule, state: [parameters], input: g }.go(),
        }
    }
}

/// One layer's part of a step.
struct LayerStep<'a> {
    layer: &'a mut Layer,
    weight: &'a [f32],
    bias: &'a [f32],
    mean: &'a mut [f32],
    square: &'a mut [f32],
}

impl LayerStep<'_> {
    fn run(mut self, rule: AnyRule, copy: &mut Buffer) {
        let n = self.weight.len();
        let (mean, square) = (split_front(&mut self.mean, n), split_front(&mut self.square, n));
        edit(&mut self.layer.weight, copy, |p| rule.apply(p, self.weight, mean, square));
        edit(&mut self.layer.bias, copy, |p| rule.apply(p, self.bias, self.mean, self.square));
    }
}
