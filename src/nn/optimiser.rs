//! Optimisers whose whole state can be saved: the paper's sweep set of Adam, SGD and RMSprop.

use dfdx::prelude::{Cpu, Gradients};
use serde::{Deserialize, Serialize};

use super::{Mlp, NnError, TensorFile, TensorFileError};

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
        let mut sum = 0.0;
        for network in networks.iter_mut() {
            network.change_parameters(grads, |_, g| {
                sum += g.iter().map(|g| f64::from(*g).powi(2)).sum::<f64>();
            })?;
        }
        let norm = sum.sqrt();
        if !norm.is_finite() {
            return Err(NnError::NotFinite { norm });
        }
        self.steps += 1;
        let steps = self.steps as f64;
        let correct1 = (1.0 / (1.0 - f64::from(BETA1).powf(steps))) as f32;
        let correct2 = (1.0 / (1.0 - f64::from(BETA2).powf(steps))) as f32;
        let (kind, mean, square) = (self.kind, &mut self.mean, &mut self.square);
        let mut at = 0;
        for network in networks.iter_mut() {
            network.change_parameters(grads, |p, g| {
                for (i, (p, &g)) in p.iter_mut().zip(g).enumerate() {
                    match kind {
                        OptimiserKind::Adam => {
                            let (m, v) = (&mut mean[at + i], &mut square[at + i]);
                            *m = BETA1 * *m + (1.0 - BETA1) * g;
                            *v = BETA2 * *v + (1.0 - BETA2) * g * g;
                            *p -= rate * (*m * correct1) / ((*v * correct2).sqrt() + EPSILON);
                        }
                        OptimiserKind::RmsProp => {
                            let v = &mut square[at + i];
                            *v = ALPHA * *v + (1.0 - ALPHA) * g * g;
                            *p -= rate * g / (v.sqrt() + EPSILON);
                        }
                        OptimiserKind::Sgd => *p -= rate * g,
                    }
                }
                at += p.len();
            })?;
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
