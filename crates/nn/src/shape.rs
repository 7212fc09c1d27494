//! The shape of a multilayer perceptron: layer sizes and activations.

use serde::{Deserialize, Serialize};

use super::NnError;

/// A function applied to the outputs of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// `y = z`
    Identity,
    /// `y = max(z, 0)`
    Relu,
    /// `y = tanh(z)`
    Tanh,
    /// `y = u / rms(u)` with `u = max(z, 0)`: the output vector always has the same length
    /// (RMSNorm without a gain; Zhang and Sennrich, 2019), which keeps critics from overestimating.
    #[serde(rename = "rms_relu")]
    RmsRelu,
}

mge_base::names!(Activation { Identity = "identity", Relu = "relu", Tanh = "tanh", RmsRelu = "rms_relu" });

/// Sizes and activations of a stack of dense layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MlpShape {
    /// Inputs, hidden sizes in order, outputs; the stack has `sizes.len() - 1` layers.
    pub sizes: Vec<usize>,
    /// Activation of every layer but the last.
    pub hidden: Activation,
    /// Activation of the last layer.
    pub output: Activation,
}

impl MlpShape {
    /// A stack of `layers` dense layers with equal hidden sizes, `hidden` between them and a
    /// linear output. The paper's "17-layer neural network with hidden size 64" (A.1) from 21
    /// inputs to 20 outputs is `MlpShape::uniform(21, 64, 20, 17, Activation::Tanh)`.
    pub fn uniform(inputs: usize, width: usize, outputs: usize, layers: usize, hidden: Activation) -> Self {
        let mut sizes = vec![inputs];
        sizes.extend(std::iter::repeat_n(width, layers.saturating_sub(1)));
        sizes.push(outputs);
        Self { sizes, hidden, output: Activation::Identity }
    }

    /// The same stack with a different activation of the last layer.
    pub fn with_output(mut self, output: Activation) -> Self {
        self.output = output;
        self
    }

    /// Number of input columns.
    pub fn inputs(&self) -> usize {
        self.sizes.first().copied().unwrap_or(0)
    }

    /// Number of output columns.
    pub fn outputs(&self) -> usize {
        self.sizes.last().copied().unwrap_or(0)
    }

    /// Number of dense layers.
    pub fn layers(&self) -> usize {
        self.sizes.len().saturating_sub(1)
    }

    /// Number of weights and biases.
    pub fn parameters(&self) -> usize {
        self.sizes.windows(2).map(|s| s[0] * s[1] + s[1]).sum()
    }

    /// Activation of layer `layer`, counted from 0.
    pub fn activation(&self, layer: usize) -> Activation {
        if layer + 1 == self.layers() { self.output } else { self.hidden }
    }

    /// # Errors
    /// [`NnError::Unusable`] when there is no layer or a size is 0.
    pub fn check(&self) -> Result<(), NnError> {
        if self.layers() == 0 || self.sizes.contains(&0) {
            let rule = "give inputs, hidden sizes and outputs, all at least 1";
            return Err(NnError::Unusable(format!("network sizes {:?} are not usable: {rule}", self.sizes)));
        }
        Ok(())
    }
}
