//! One dense layer: its parameters as dfdx tensors, and their way to and from the kernels.

use dfdx::prelude::*;

use super::{
    Activation, Matrix,
    kernel::{Blend, Buffer, Kernel, LINE, Update, padded},
};

/// `y = f(x · weight + bias)`.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// inputs × outputs
    pub weight: Matrix,
    /// outputs
    pub bias: Tensor<(usize,), f32, Cpu>,
    pub activation: Activation,
}

impl Layer {
    pub fn new(device: &Cpu, sizes: (usize, usize), activation: Activation) -> Self {
        Self { weight: device.zeros_like(&sizes), bias: device.zeros_like(&(sizes.1,)), activation }
    }

    pub fn inputs(&self) -> usize {
        self.weight.shape().0
    }

    pub fn outputs(&self) -> usize {
        self.weight.shape().1
    }

    /// Writes row-major weight and bias, of the layer's sizes.
    pub fn set(&mut self, weight: &[f32], bias: &[f32]) {
        self.weight.copy_from(weight);
        self.bias.copy_from(bias);
    }

    /// Copies of weight and bias, row-major.
    pub fn values(&self) -> (Vec<f32>, Vec<f32>) {
        (self.weight.as_vec(), self.bias.as_vec())
    }
}

impl Layer {
    /// `self = (1 - tau) * self + tau * online`
    pub fn blend(&mut self, online: &Layer, tau: f32, scratch: &mut [Buffer; 2]) {
        blend(&mut self.weight, &online.weight, tau, scratch);
        blend(&mut self.bias, &online.bias, tau, scratch);
    }
}

fn blend<S: Shape>(
    target: &mut Tensor<S, f32, Cpu>,
    online: &Tensor<S, f32, Cpu>,
    tau: f32,
    [values, input]: &mut [Buffer; 2],
) {
    input.resize(online.shape().num_elements());
    online.copy_into(input);
    edit(target, values, |target| {
        Update { rule: Blend { tau }, state: [target], input }.go();
    });
}

/// Changes the values of a tensor, by way of a copy.
pub(super) fn edit<S: Shape>(tensor: &mut Tensor<S, f32, Cpu>, copy: &mut Buffer, change: impl FnOnce(&mut [f32])) {
    copy.resize(tensor.shape().num_elements());
    tensor.copy_into(copy);
    change(copy);
    tensor.copy_from(copy);
}

/// A layer's parameters as the kernels want them. dfdx gives no access to the memory of a tensor,
/// only copies; a layer's copy fits the innermost cache, where it is needed next anyway.
#[derive(Debug, Default)]
pub(super) struct LoadedLayer {
    /// Rows padded to whole lines; followed by rows of any values, so that whole lines of rows
    /// can be read from every row on.
    pub weight: Buffer,
    /// Padded to whole lines.
    pub bias: Buffer,
    dense: Buffer,
}

impl LoadedLayer {
    pub fn load(&mut self, layer: &Layer) {
        let (inputs, outputs) = (layer.inputs(), layer.outputs());
        let row = padded(outputs);
        self.weight.resize((inputs + LINE) * row);
        self.bias.resize(row);
        layer.bias.copy_into(&mut self.bias[..outputs]);
        if row == outputs {
            layer.weight.copy_into(&mut self.weight[..inputs * outputs]);
        } else {
            self.dense.resize(inputs * outputs);
            layer.weight.copy_into(&mut self.dense);
            pad_rows(&self.dense, outputs, &mut self.weight);
            self.bias[outputs..].fill(0.0);
        }
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

/// `x` with its rows one after the other in memory, as copies out of dfdx need it.
pub(super) fn dense<T: Tape<f32, Cpu>>(x: Matrix<T>) -> Matrix<T> {
    let (rows, columns) = *x.shape();
    // dfdx does not tell strides; addresses do.
    let at = |i: usize, j: usize| &raw const x[[i, j]] as usize;
    let is_dense = rows == 0
        || columns == 0
        || ((columns == 1 || at(0, 1) - at(0, 0) == size_of::<f32>())
            && (rows == 1 || at(1, 0) - at(0, 0) == columns * size_of::<f32>()));
    if is_dense { x } else { x.reshape_like(&(rows, columns)) }
}

/// The values of `x`, row-major. dfdx's own `as_vec` goes element by element.
pub(super) fn values(x: &Matrix) -> Vec<f32> {
    let x = dense(x.clone());
    let mut values = vec![0.0; x.shape().num_elements()];
    x.copy_into(&mut values);
    values
}
