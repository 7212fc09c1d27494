//! The fused network against plain dfdx operations and against finite differences.

use dfdx::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Activation, InitScheme, Matrix, Mlp, MlpShape, TensorFile, matrix};

const ACTIVATIONS: [Activation; 3] = [Activation::Identity, Activation::Relu, Activation::Tanh];

fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Matrix {
    let values = (0..rows * columns).map(|_| rng.gen_range(-1.0..1.0)).collect();
    matrix(&Cpu::default(), values, rows, columns)
}

/// The parameters of a network as plain dfdx tensors: weight, bias, weight, ...
fn parameters(mlp: &Mlp) -> Vec<(Matrix, Tensor<(usize,), f32, Cpu>)> {
    let mut file = TensorFile::default();
    mlp.save(&mut file, "net");
    let device = Cpu::default();
    mlp.shape()
        .sizes
        .windows(2)
        .enumerate()
        .map(|(i, s)| {
            let w = file.get(&format!("net.{i}.weight"), &[s[0], s[1]]).unwrap();
            let b = file.get(&format!("net.{i}.bias"), &[s[1]]).unwrap();
            (matrix(&device, w.to_vec(), s[0], s[1]), device.tensor_from_vec(b.to_vec(), (s[1],)))
        })
        .collect()
}

/// The same network out of dfdx's own operations.
fn plain<T: Tape<f32, Cpu>>(
    shape: &MlpShape,
    parameters: &[(Matrix, Tensor<(usize,), f32, Cpu>)],
    mut x: Matrix<T>,
) -> Matrix<T> {
    for (i, (w, b)) in parameters.iter().enumerate() {
        let z = x.matmul(w.clone());
        let rows = z.shape().0;
        let b = b.retaped::<T>().broadcast_like::<_, Axis<0>>(&(rows, b.shape().0));
        let z = z + b;
        x = match shape.activation(i) {
            Activation::Identity => z,
            Activation::Relu => z.relu(),
            Activation::Tanh => z.tanh(),
        };
    }
    x
}

fn close(a: &[f32], b: &[f32], tolerance: f32, what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let scale = 1.0f32.max(b.abs());
        assert!((a - b).abs() <= tolerance * scale, "{what}[{i}]: {a} and {b}");
    }
}

#[test]
fn fused_network_agrees_with_plain_dfdx() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for hidden in ACTIVATIONS {
        for output in ACTIVATIONS {
            for (sizes, rows) in [
                (vec![3, 2], 1),
                (vec![21, 64, 64, 64, 20], 67),
                (vec![162, 64, 64, 1], 128),
                (vec![5, 100, 33, 17], 13),
            ] {
                let shape = MlpShape { sizes, hidden, output };
                let mut net = Mlp::new(shape.clone(), InitScheme::FanIn, &mut rng).unwrap();
                let plain_parameters = parameters(&net);
                let x = random(rows, shape.inputs(), &mut rng);
                let what = format!("{shape:?}");

                let y = net.forward(x.leaky_trace());
                let plain_y = plain(&shape, &plain_parameters, x.leaky_trace());
                close(&y.as_vec(), &plain_y.as_vec(), 1e-5, &what);
                close(&net.forward(x.clone()).as_vec(), &y.as_vec(), 0.0, &what);
                let mut predicted = Vec::new();
                net.predict_into(&x.as_vec(), rows, &mut predicted);
                close(&predicted, &y.as_vec(), 0.0, &what);

                let mut grads = y.square().mean().backward();
                let plain_grads = plain_y.square().mean().backward();
                close(&grads.get(&x).as_vec(), &plain_grads.get(&x).as_vec(), 1e-5, &what);
                let mut mine = Vec::new();
                net.change_parameters(&mut grads, |_, g| mine.extend_from_slice(g)).unwrap();
                let mut theirs = Vec::new();
                for (w, b) in &plain_parameters {
                    theirs.extend(plain_grads.get(w).as_vec());
                    theirs.extend(plain_grads.get(b).as_vec());
                }
                close(&mine, &theirs, 1e-5, &what);
            }
        }
    }
}
