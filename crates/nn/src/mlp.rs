//! The multilayer perceptron: parameters as a dfdx tensor, the whole stack as one operation.

use std::{slice, sync::Arc};

use dfdx::prelude::*;
use rand::Rng;

use super::{
    Init, Matrix, MlpShape, NnError, TensorFile, TensorFileError,
    kernel::{Blend, Kernel, Update},
    layer::{Layer, LoadedParameters, Parameters},
    matrix,
    stack::{self, Pass, Pool},
    tensor_file::invalid_metadata,
};

/// A stack of dense layers whose parameters are one dfdx tensor.
///
/// A clone shares no parameters and no gradients with the original.
#[derive(Debug)]
pub struct Mlp {
    shape: MlpShape,
    layers: Arc<[Layer]>,
    parameters: Parameters,
    /// Always equal to `parameters`.
    loaded: Arc<LoadedParameters>,
    pool: Pool,
}

/// Rows of a prediction that pass through all layers together on a thread, so that their values stay in the second-level
/// cache.
const CHUNK: usize = 192;

impl Mlp {
    /// A network with initial weights drawn from `rng`, layer by layer, weight before bias.
    ///
    /// # Errors
    /// [`NnError::Unusable`] when `shape` has no layer or a size 0.
    pub fn new<R: Rng + ?Sized>(shape: MlpShape, init: impl Into<Init>, rng: &mut R) -> Result<Self, NnError> {
        shape.check()?;
        let init = init.into();
        let last = shape.layers() - 1;
        let layer = |(i, sizes): (usize, &[usize])| init.layer(sizes[0], sizes[1], i == last, rng);
        let values = shape.sizes.windows(2).enumerate().flat_map(layer).collect();
        Ok(Self::from_values(shape, values))
    }

    fn from_values(shape: MlpShape, values: Vec<f32>) -> Self {
        let layers: Arc<[Layer]> = Layer::all(&shape).into();
        Self {
            loaded: LoadedParameters::new(&layers, &values).into(),
            parameters: Cpu::default().tensor_from_vec(values, (shape.parameters(),)),
            layers,
            shape,
            pool: Pool::default(),
        }
    }

    /// Sizes and activations.
    pub fn shape(&self) -> &MlpShape {
        &self.shape
    }

    /// Outputs for a batch; gradients flow to the parameters and to `x`.
    ///
    /// # Panics
    /// If `x` has another number of columns than the network has inputs.
    pub fn forward(&self, x: Matrix<OwnedTape<f32, Cpu>>) -> Matrix<OwnedTape<f32, Cpu>> {
        self.run(x, true, true)
    }

    /// Like [`forward`](Self::forward), but no gradient is computed for `x`.
    pub fn forward_data(&self, x: Matrix<OwnedTape<f32, Cpu>>) -> Matrix<OwnedTape<f32, Cpu>> {
        self.run(x, true, false)
    }

    /// Like [`forward`](Self::forward) with constant parameters: gradients flow to `x` only.
    pub fn forward_frozen(&self, x: Matrix<OwnedTape<f32, Cpu>>) -> Matrix<OwnedTape<f32, Cpu>> {
        self.run(x, false, true)
    }

    /// Gradients flow to the parameters and to the input, if so told.
    fn run(&self, x: Matrix<OwnedTape<f32, Cpu>>, to_parameters: bool, to_input: bool) -> Matrix<OwnedTape<f32, Cpu>> {
        let (rows, columns) = *x.shape();
        assert_eq!(columns, self.shape.inputs(), "input columns of the network");
        let (x, mut tape) = x.contiguous().split_tape();
        let mut pass = self.pass(rows);
        x.copy_into(pass.input());
        stack::forward(slice::from_mut(&mut pass));
        let outputs = self.shape.outputs();
        let mut values = vec![0.0; rows * outputs];
        pass.output(&mut values);
        let y = matrix(x.device(), values, rows, outputs);
        let (x, out, parameters) = (x.ghost(), y.ghost(), self.parameters.ghost());
        tape.add_backward_op(move |grads| {
            let dy = grads.get_or_alloc_mut(&out)?;
            pass.set_output_gradient(|row| &dy[row * outputs..][..outputs]);
            stack::backward(slice::from_mut(&mut pass), to_input);
            if to_parameters {
                pass.add_parameter_gradients(grads.get_or_alloc_mut(&parameters)?);
            }
            if to_input {
                pass.add_input_gradient(grads.get_or_alloc_mut(&x)?);
            }
            Ok(())
        });
        y.put_tape(tape)
    }

    /// A pass of `rows` rows with the current parameters.
    pub(super) fn pass(&self, rows: usize) -> Pass {
        Pass::new(self.layers.clone(), self.loaded.clone(), &self.pool, rows)
    }

    /// Outputs for `rows` samples without a tape: `x` holds `rows` × inputs values, `out` becomes
    /// `rows` × outputs. Row `i` of the result depends on row `i` of `x` only. Large batches use
    /// all threads of the current rayon pool; nothing is allocated once `out` and the network's
    /// own workspace have grown to the batch.
    ///
    /// # Panics
    /// If `x.len()` is not `rows` × inputs.
    pub fn predict_into(&self, x: &[f32], rows: usize, out: &mut Vec<f32>) {
        assert_eq!(x.len(), rows * self.shape.inputs(), "input of the network");
        out.resize(rows * self.shape.outputs(), 0.0);
        let (inputs, outputs) = (self.shape.inputs(), self.shape.outputs());
        let chunk = CHUNK * stack::threads_for(rows * stack::multiplications(&self.layers));
        for (x, y) in x.chunks(chunk * inputs).zip(out.chunks_mut(chunk * outputs)) {
            let mut pass = self.pass(x.len() / inputs);
            pass.input().copy_from_slice(x);
            stack::forward(slice::from_mut(&mut pass));
            pass.output(y);
        }
    }

    /// Moves the parameters towards those of `online`:
    /// `self = (1 - tau) * self + tau * online` (the target update of DDPG).
    ///
    /// # Panics
    /// If the networks have different shapes.
    pub fn soft_update(&mut self, online: &Mlp, tau: f32) {
        assert_eq!(self.shape, online.shape, "target and online network");
        let input = online.values();
        self.edit(|target| Update { rule: Blend { tau }, state: [target], input }.execute());
    }

    /// Changes the parameters.
    pub(super) fn edit(&mut self, change: impl FnOnce(&mut [f32])) {
        // Copies only while a pass on a tape still holds the old values.
        let loaded = Arc::make_mut(&mut self.loaded);
        loaded.edit(&self.layers, change);
        self.parameters.copy_from(loaded.values());
    }

    /// The layers, in the order of their parameters.
    pub(super) fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The tensor of all parameters: the key of their gradient.
    pub(super) fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// All parameters.
    pub(super) fn values(&self) -> &[f32] {
        self.loaded.values()
    }

    /// Adds weights and biases to `file` as `prefix.0.weight` (inputs × outputs), `prefix.0.bias`
    /// etc.
    pub fn save(&self, file: &mut TensorFile, prefix: &str) {
        let values = self.values();
        for (i, layer) in self.layers.iter().enumerate() {
            let (weight, bias) = layer.split(values);
            file.insert(format!("{prefix}.{i}.weight"), vec![layer.inputs, layer.outputs], weight.to_vec());
            file.insert(format!("{prefix}.{i}.bias"), vec![layer.outputs], bias.to_vec());
        }
    }

    /// The network of this `shape` that [`save`](Self::save) stored under `prefix`.
    ///
    /// # Errors
    /// When a tensor is missing, has another shape or a value that is not finite.
    pub fn load(shape: MlpShape, file: &TensorFile, prefix: &str) -> Result<Self, TensorFileError> {
        shape.check().map_err(|error| invalid_metadata(prefix, &error))?;
        let mut values = Vec::with_capacity(shape.parameters());
        for (i, sizes) in shape.sizes.windows(2).enumerate() {
            values.extend_from_slice(file.get(&format!("{prefix}.{i}.weight"), sizes)?);
            values.extend_from_slice(file.get(&format!("{prefix}.{i}.bias"), &sizes[1..])?);
        }
        Ok(Self::from_values(shape, values))
    }
}

impl Clone for Mlp {
    /// A network with its own copy of the parameters. The tensor gets a new identity, so one tape
    /// keeps the gradients of the two networks apart.
    fn clone(&self) -> Self {
        Self::from_values(self.shape.clone(), self.values().to_vec())
    }
}
