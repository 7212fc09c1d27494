//! Dense layers within the parameters of their network, and the parameter copy that kernels use.

use dfdx::prelude::*;

use super::{
    Activation, MlpShape,
    kernel::{Buffer, LINE, padded},
};

/// All parameters of a network, layer by layer: the weight (inputs × outputs, row-major), then the
/// bias.
pub(super) type Parameters = Tensor<(usize,), f32, Cpu>;

/// `y = f(x · weight + bias)`: sizes of a layer and its place in the parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub inputs: usize,
    pub outputs: usize,
    pub activation: Activation,
    /// Index of its first weight in the parameters.
    start: usize,
    /// The same in the padded copies of a [`LoadedParameters`].
    padded_start: usize,
}

impl Layer {
    /// The layers of a network, in order.
    pub fn all(shape: &MlpShape) -> Vec<Self> {
        let (mut start, mut padded_start) = (0, 0);
        let layer = |(i, sizes): (usize, &[usize])| {
            let (inputs, outputs) = (sizes[0], sizes[1]);
            let layer = Self { inputs, outputs, activation: shape.activation(i), start, padded_start };
            start += (inputs + 1) * outputs;
            if layer.is_padded() {
                padded_start += (inputs + 1) * padded(outputs);
            }
            layer
        };
        shape.sizes.windows(2).enumerate().map(layer).collect()
    }

    /// Number of weights and biases.
    pub fn parameters(&self) -> usize {
        (self.inputs + 1) * self.outputs
    }

    /// The layer's weight and bias within the parameters of the network.
    pub fn split<'a>(&self, parameters: &'a [f32]) -> (&'a [f32], &'a [f32]) {
        parameters[self.start..][..self.parameters()].split_at(self.inputs * self.outputs)
    }

    /// Multiplications per row.
    pub fn multiplications(&self) -> usize {
        self.inputs * self.outputs
    }

    /// Whether rows of outputs are divided by their root mean square.
    pub fn is_normalised(&self) -> bool {
        self.activation == Activation::RmsRelu
    }

    /// Whether rows of outputs are not whole lines, so that kernels need padded copies.
    pub fn is_padded(&self) -> bool {
        padded(self.outputs) != self.outputs
    }
}

/// The parameters of a network in the kernels' layout: rows of whole lines. dfdx gives no access to
/// the memory of a tensor, only copies. This copy is made when the parameters change, not in every
/// pass, which halves the time of a single action.
#[derive(Clone, Debug)]
pub(super) struct LoadedParameters {
    count: usize,
    /// All parameters, then room for reads past the last layer.
    dense: Buffer,
    /// The layers whose outputs are not whole lines, with padded rows.
    padded: Buffer,
}

impl LoadedParameters {
    /// Parameters with these values.
    pub fn new(layers: &[Layer], values: &[f32]) -> Self {
        let mut loaded = Self { count: values.len(), dense: Buffer::default(), padded: Buffer::default() };
        // Transposes read blocks of `LINE` rows, which may reach beyond the last layer.
        let beyond = LINE * layers.iter().map(|layer| padded(layer.outputs)).max().unwrap_or(0);
        let padded_layers = layers.iter().filter(|layer| layer.is_padded());
        let rows = padded_layers.map(|layer| (layer.inputs + 1) * padded(layer.outputs));
        loaded.dense.resize(values.len() + beyond);
        loaded.padded.resize(rows.sum::<usize>() + beyond);
        loaded.edit(layers, |parameters| parameters.copy_from_slice(values));
        loaded
    }

    /// Changes the parameters.
    pub fn edit(&mut self, layers: &[Layer], change: impl FnOnce(&mut [f32])) {
        change(&mut self.dense[..self.count]);
        for layer in layers.iter().filter(|layer| layer.is_padded()) {
            let dense = &self.dense[layer.start..][..layer.parameters()];
            pad_rows(dense, layer.outputs, &mut self.padded[layer.padded_start..]);
        }
    }

    /// All parameters, in the order of the tensor.
    pub fn values(&self) -> &[f32] {
        &self.dense[..self.count]
    }

    /// Weight of a layer, as rows of [`padded`] outputs, and everything after it in memory: at least
    /// [`LINE`] more rows of arbitrary values can be read.
    pub fn weight(&self, layer: &Layer) -> &[f32] {
        if layer.is_padded() { &self.padded[layer.padded_start..] } else { &self.dense[layer.start..] }
    }

    /// Bias of a layer, padded to whole lines.
    pub fn bias(&self, layer: &Layer) -> &[f32] {
        let row = padded(layer.outputs);
        &self.weight(layer)[layer.inputs * row..][..row]
    }
}

/// Copies dense rows of `columns` floats to padded rows; the padding becomes 0.
pub(super) fn pad_rows(dense: &[f32], columns: usize, rows: &mut [f32]) {
    let padded_rows = rows.chunks_exact_mut(padded(columns));
    for (from, to) in dense.chunks_exact(columns).zip(padded_rows) {
        to[..columns].copy_from_slice(from);
        to[columns..].fill(0.0);
    }
}

/// Copies padded rows to dense rows of `columns` floats.
pub(super) fn unpad_rows(rows: &[f32], columns: usize, dense: &mut [f32]) {
    let padded_rows = rows.chunks_exact(padded(columns));
    for (to, from) in dense.chunks_exact_mut(columns).zip(padded_rows) {
        to.copy_from_slice(&from[..columns]);
    }
}
