//! The multilayer perceptron: parameters as dfdx tensors, the whole stack as one operation.

use std::{
    mem,
    sync::{Arc, Mutex, PoisonError},
};

use dfdx::prelude::*;
use rand::Rng;

use super::{
    Init, Matrix, MlpShape, NnError, TensorFile, TensorFileError,
    kernel::Buffer,
    layer::{Layer, dense},
    predict::PredictWorkspace,
    stack::{self, Backward, Forward, LayerGradients, Workspace},
};

/// A stack of dense layers whose parameters are dfdx tensors.
///
/// A clone shares no parameters and no gradients with the original.
#[derive(Debug)]
pub struct Mlp {
    shape: MlpShape,
    /// The device of the parameters, our own: it keeps the memory of their gradients for the next
    /// step, which no other tensors may fill up.
    device: Cpu,
    layers: Vec<Layer>,
    blending: [Buffer; 2],
    training: Pool<Workspace>,
    prediction: Pool<PredictWorkspace>,
}

/// Memory of passes that are done, for the next ones.
#[derive(Debug, Default)]
pub(super) struct Pool<W>(Arc<Mutex<Vec<W>>>);

impl<W> Clone for Pool<W> {
    /// The same pool.
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<W: Default> Pool<W> {
    pub fn take(&self) -> W {
        // A poisoned lock is fine: a workspace has no state that a panic could leave half done.
        let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        free.pop().unwrap_or_default()
    }

    pub fn give_back(&self, workspace: W) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
    }
}

/// What a forward pass on a tape is differentiated with respect to.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Wanted {
    parameters: bool,
    input: bool,
}

impl Mlp {
    /// A network with initial weights drawn from `rng`, layer by layer, weight before bias.
    ///
    /// # Errors
    /// [`NnError::Shape`] when `shape` has no layer or a size 0.
    pub fn new<R: Rng + ?Sized>(shape: MlpShape, init: impl Into<Init>, rng: &mut R) -> Result<Self, NnError> {
        shape.check()?;
        let init = init.into();
        let last = shape.layers() - 1;
        let values: Vec<_> =
            shape.sizes.windows(2).enumerate().map(|(i, s)| init.layer(s[0], s[1], i == last, rng)).collect();
        Ok(Self::from_values(shape, values))
    }

    fn from_values(shape: MlpShape, values: Vec<(Vec<f32>, Vec<f32>)>) -> Self {
        let device = Cpu::default();
        device.enable_cache();
        let layers = values
            .into_iter()
            .enumerate()
            .map(|(i, (weight, bias))| {
                let sizes = (shape.sizes[i], shape.sizes[i + 1]);
                let mut layer = Layer::new(&device, sizes, shape.activation(i));
                layer.set(&weight, &bias);
                layer
            })
            .collect();
        Self {
            shape,
            device,
            layers,
            blending: Default::default(),
            training: Pool::default(),
            prediction: Pool::default(),
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
    pub fn forward<T: Tape<f32, Cpu>>(&self, x: Matrix<T>) -> Matrix<T> {
        self.run(x, Wanted { parameters: true, input: true })
    }

    /// As [`forward`](Self::forward) for an `x` that is data: no gradient is computed for it.
    pub fn forward_data<T: Tape<f32, Cpu>>(&self, x: Matrix<T>) -> Matrix<T> {
        self.run(x, Wanted { parameters: true, input: false })
    }

    /// As [`forward`](Self::forward) with the parameters held constant: gradients flow to `x`
    /// only.
    pub fn forward_frozen<T: Tape<f32, Cpu>>(&self, x: Matrix<T>) -> Matrix<T> {
        self.run(x, Wanted { parameters: false, input: true })
    }

    fn run<T: Tape<f32, Cpu>>(&self, x: Matrix<T>, wanted: Wanted) -> Matrix<T> {
        let (rows, columns) = *x.shape();
        assert_eq!(columns, self.shape.inputs(), "input columns of the network");
        let (x, mut tape) = dense(x).split_tape();
        let mut y: Matrix = x.device().zeros_like(&(rows, self.shape.outputs()));
        let mut values = vec![0.0; rows * self.shape.outputs()];
        if !T::OWNS_TAPE {
            let mut workspace = self.prediction.take();
            workspace.predict_tensor(&self.layers, &x, &mut values);
            self.prediction.give_back(workspace);
            y.copy_from(&values);
            return y.put_tape(tape);
        }
        let mut workspace = self.training.take();
        x.copy_into(workspace.input(rows, &self.layers));
        stack::forward(&mut [Forward { layers: &self.layers, workspace: &mut workspace }]);
        workspace.output(&self.layers, &mut values);
        y.copy_from(&values);

        let (layers, pool, out) = (self.layers.clone(), self.training.clone(), y.clone());
        tape.add_backward_op(move |grads| {
            let dy = mem::take(&mut **grads.get_or_alloc_mut(&out)?);
            let mut parameters = wanted.parameters.then(|| take_gradients(&layers, grads)).transpose()?;
            stack::backward(&mut [Backward {
                layers: &layers,
                workspace: &mut workspace,
                dy: &dy,
                gradients: parameters.as_deref_mut(),
                input: wanted.input,
            }]);
            if let Some(parameters) = parameters {
                put_gradients(&layers, parameters, grads)?;
            }
            **grads.get_or_alloc_mut(&out)? = dy;
            if wanted.input {
                workspace.add_input_gradient(columns, grads.get_or_alloc_mut(&x)?);
            }
            pool.give_back(workspace);
            Ok(())
        });
        y.put_tape(tape)
    }

    /// Outputs for `rows` samples without a tape: `x` holds `rows` × inputs values, `out` becomes
    /// `rows` × outputs. Row `i` of the result depends on row `i` of `x` only. Large batches use
    /// all threads of the current rayon pool; nothing is allocated once `out` and the network's
    /// own workspace have grown to the batch.
    ///
    /// # Panics
    /// If `x.len()` is not `rows` × inputs.
    pub fn predict_into(&self, x: &[f32], rows: usize, out: &mut Vec<f32>) {
        out.resize(rows * self.shape.outputs(), 0.0);
        self.predict(x, rows, out);
    }

    fn predict(&self, x: &[f32], rows: usize, out: &mut [f32]) {
        assert_eq!(x.len(), rows * self.shape.inputs(), "input of the network");
        let mut workspace = self.prediction.take();
        workspace.predict(&self.layers, x, rows, out);
        self.prediction.give_back(workspace);
    }

    /// Moves the parameters towards those of `online`:
    /// `self = (1 - tau) * self + tau * online` (the target update of DDPG).
    ///
    /// # Panics
    /// If the networks have different shapes.
    pub fn soft_update(&mut self, online: &Mlp, tau: f32) {
        assert_eq!(self.shape, online.shape, "target and online network");
        for (target, online) in self.layers.iter_mut().zip(&online.layers) {
            target.blend(online, tau, &mut self.blending);
        }
    }

    /// The layers, for the optimiser.
    pub(super) fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Memory of training passes.
    pub(super) fn training_pool(&self) -> &Pool<Workspace> {
        &self.training
    }

    /// The layers, for the optimiser.
    pub(super) fn layers_mut(&mut self) -> &mut [Layer] {
        &mut self.layers
    }

    /// Adds weights and biases to `file` as `prefix.0.weight` (inputs × outputs), `prefix.0.bias`
    /// and so on.
    pub fn save(&self, file: &mut TensorFile, prefix: &str) {
        for (i, layer) in self.layers.iter().enumerate() {
            let (inputs, outputs) = (layer.inputs(), layer.outputs());
            let (w, b) = layer.values();
            file.insert(format!("{prefix}.{i}.weight"), vec![inputs, outputs], w);
            file.insert(format!("{prefix}.{i}.bias"), vec![outputs], b);
        }
    }

    /// The network of this `shape` that [`save`](Self::save) stored under `prefix`.
    ///
    /// # Errors
    /// When a tensor is missing, has another shape or a value that is not finite.
    pub fn load(shape: MlpShape, file: &TensorFile, prefix: &str) -> Result<Self, TensorFileError> {
        shape.check().map_err(|e| TensorFileError::Metadata { key: prefix.to_owned(), reason: e.to_string() })?;
        let values = shape
            .sizes
            .windows(2)
            .enumerate()
            .map(|(i, s)| {
                Ok((
                    file.get(&format!("{prefix}.{i}.weight"), &[s[0], s[1]])?.to_vec(),
                    file.get(&format!("{prefix}.{i}.bias"), &[s[1]])?.to_vec(),
                ))
            })
            .collect::<Result<_, _>>()?;
        Ok(Self::from_values(shape, values))
    }
}

impl Clone for Mlp {
    /// A network with equal parameters of its own: tensors get new identities, so the gradients
    /// of the two are kept apart on one tape.
    fn clone(&self) -> Self {
        let values = self.layers.iter().map(Layer::values).collect();
        Self::from_values(self.shape.clone(), values)
    }
}

impl Drop for Mlp {
    fn drop(&mut self) {
        // dfdx does not free the memory a device has kept.
        self.device.disable_cache();
    }
}

/// Takes the gradients of all parameters out of `grads`; 0 where there are none.
pub(super) fn take_gradients(
    layers: &[Layer],
    grads: &mut Gradients<f32, Cpu>,
) -> Result<Vec<LayerGradients>, CpuError> {
    let take = |layer: &Layer| {
        let weight = mem::take(&mut **grads.get_or_alloc_mut(&layer.weight)?);
        Ok((weight, mem::take(&mut **grads.get_or_alloc_mut(&layer.bias)?)))
    };
    layers.iter().map(take).collect()
}

/// Puts back what [`take_gradients`] took.
pub(super) fn put_gradients(
    layers: &[Layer],
    taken: Vec<LayerGradients>,
    grads: &mut Gradients<f32, Cpu>,
) -> Result<(), CpuError> {
    for (layer, (weight, bias)) in layers.iter().zip(taken) {
        **grads.get_or_alloc_mut(&layer.weight)? = weight;
        **grads.get_or_alloc_mut(&layer.bias)? = bias;
    }
    Ok(())
}
