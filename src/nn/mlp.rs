//! The multilayer perceptron: parameters as dfdx tensors, the whole stack as one operation.

use dfdx::prelude::*;
use rand::Rng;

use super::{Activation, Init, Matrix, MlpShape, NnError, TensorFile, TensorFileError, dense};

/// One dense layer `y = f(x · weight + bias)`.
#[derive(Clone, Debug)]
struct Layer {
    /// inputs × outputs
    weight: Matrix,
    /// outputs
    bias: Tensor<(usize,), f32, Cpu>,
    activation: Activation,
}

impl Layer {
    fn sizes(&self) -> (usize, usize) {
        *self.weight.shape()
    }

    /// Copies of weight and bias.
    fn values(&self) -> (Vec<f32>, Vec<f32>) {
        let (inputs, outputs) = self.sizes();
        let (mut w, mut b) = (vec![0.0; inputs * outputs], vec![0.0; outputs]);
        self.weight.copy_into(&mut w);
        self.bias.copy_into(&mut b);
        (w, b)
    }
}

/// A stack of dense layers whose parameters are dfdx tensors.
///
/// A clone shares no parameters and no gradients with the original.
#[derive(Debug)]
pub struct Mlp {
    shape: MlpShape,
    layers: Vec<Layer>,
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
        let layers = values
            .into_iter()
            .enumerate()
            .map(|(i, (w, b))| {
                let (inputs, outputs) = (shape.sizes[i], shape.sizes[i + 1]);
                Layer {
                    weight: device.tensor_from_vec(w, (inputs, outputs)),
                    bias: device.tensor_from_vec(b, (outputs,)),
                    activation: shape.activation(i),
                }
            })
            .collect();
        Self { shape, layers }
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
    /// only, as from a critic to an actor.
    pub fn forward_frozen<T: Tape<f32, Cpu>>(&self, x: Matrix<T>) -> Matrix<T> {
        self.run(x, Wanted { parameters: false, input: true })
    }

    fn run<T: Tape<f32, Cpu>>(&self, x: Matrix<T>, wanted: Wanted) -> Matrix<T> {
        let (x, mut tape) = x.split_tape();
        let (rows, columns) = *x.shape();
        assert_eq!(columns, self.shape.inputs(), "input columns of the network");
        let mut values = vec![x.as_vec()];
        for layer in &self.layers {
            let (inputs, outputs) = layer.sizes();
            let (w, b) = layer.values();
            let mut y = vec![0.0; rows * outputs];
            let x = &values[values.len() - 1];
            dense::forward((rows, inputs, outputs), x, &w, &b, layer.activation, &mut y);
            values.push(y);
        }
        let y = x.device().tensor_from_vec(values[self.layers.len()].clone(), (rows, self.shape.outputs()));
        let (layers, out) = (self.layers.clone(), y.clone());
        tape.add_backward_op(move |grads| {
            let mut dy = grads.get_or_alloc_mut(&out)?.to_vec();
            for (i, layer) in layers.iter().enumerate().rev() {
                let (inputs, outputs) = layer.sizes();
                let sizes = (rows, inputs, outputs);
                dense::activation_backward(layer.activation, &values[i + 1], &mut dy);
                if wanted.parameters {
                    let dw = grads.get_or_alloc_mut(&layer.weight)?;
                    dense::weight_gradient(sizes, &values[i], &dy, dw);
                    dense::bias_gradient(outputs, &dy, grads.get_or_alloc_mut(&layer.bias)?);
                }
                if i > 0 || wanted.input {
                    let mut dx = vec![0.0; rows * inputs];
                    dense::input_gradient(sizes, &dy, &layer.values().0, &mut dx);
                    dy = dx;
                }
            }
            if wanted.input {
                let dx = grads.get_or_alloc_mut(&x)?;
                dx.iter_mut().zip(&dy).for_each(|(d, g)| *d += g);
            }
            Ok(())
        });
        y.put_tape(tape)
    }

    /// Outputs for `rows` samples without a tape: `x` holds `rows` × inputs values, `out` is
    /// overwritten with `rows` × outputs. Row `i` of the result depends on row `i` of `x` only.
    ///
    /// # Panics
    /// If `x.len()` is not `rows` × inputs.
    pub fn predict_into(&self, x: &[f32], rows: usize, out: &mut Vec<f32>) {
        assert_eq!(x.len(), rows * self.shape.inputs(), "input of the network");
        out.clear();
        out.extend_from_slice(x);
        for layer in &self.layers {
            let (inputs, outputs) = layer.sizes();
            let (w, b) = layer.values();
            let mut y = vec![0.0; rows * outputs];
            dense::forward((rows, inputs, outputs), out, &w, &b, layer.activation, &mut y);
            *out = y;
        }
    }

    /// Moves the parameters towards those of `online`:
    /// `self = (1 - tau) * self + tau * online` (the target update of DDPG).
    ///
    /// # Panics
    /// If the networks have different shapes.
    pub fn soft_update(&mut self, online: &Mlp, tau: f32) {
        assert_eq!(self.shape, online.shape, "target and online network");
        for (target, online) in self.layers.iter_mut().zip(&online.layers) {
            let ((mut w, mut b), (ow, ob)) = (target.values(), online.values());
            for (t, o) in w.iter_mut().zip(&ow).chain(b.iter_mut().zip(&ob)) {
                *t = (1.0 - tau) * *t + tau * o;
            }
            target.weight.copy_from(&w);
            target.bias.copy_from(&b);
        }
    }

    /// Calls `change` with the values and gradients of every parameter tensor, in order.
    pub(super) fn change_parameters(
        &mut self,
        grads: &mut Gradients<f32, Cpu>,
        mut change: impl FnMut(&mut [f32], &[f32]),
    ) -> Result<(), CpuError> {
        for layer in &mut self.layers {
            let (mut w, mut b) = layer.values();
            change(&mut w, grads.get_or_alloc_mut(&layer.weight)?);
            change(&mut b, grads.get_or_alloc_mut(&layer.bias)?);
            layer.weight.copy_from(&w);
            layer.bias.copy_from(&b);
        }
        Ok(())
    }

    /// Adds weights and biases to `file` as `prefix.0.weight` (inputs × outputs), `prefix.0.bias`
    /// and so on.
    pub fn save(&self, file: &mut TensorFile, prefix: &str) {
        for (i, layer) in self.layers.iter().enumerate() {
            let (inputs, outputs) = layer.sizes();
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
