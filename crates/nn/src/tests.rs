//! Compares the fused network with plain dfdx operations and with finite differences.

use dfdx::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::layer::Layer;
use super::{
    Activation, Branch, InitScheme, Matrix, Mlp, MlpShape, NnError, Optimiser, OptimiserKind, TensorFile, matrix,
    sum_of_branches,
};

const ACTIVATIONS: [Activation; 4] = [Activation::Identity, Activation::Relu, Activation::Tanh, Activation::RmsRelu];

fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Matrix {
    let values = (0..rows * columns).map(|_| rng.gen_range(-1.0..1.0)).collect();
    matrix(&Cpu::default(), values, rows, columns)
}

type Parameters = Vec<(Matrix, Tensor<(usize,), f32, Cpu>)>;

/// The parameters of a network as plain dfdx tensors: weight, bias, weight, ...
fn parameters(mlp: &Mlp) -> Parameters {
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

/// The same network, built from dfdx's own operations.
fn plain<T: Tape<f32, Cpu>>(shape: &MlpShape, parameters: &Parameters, mut x: Matrix<T>) -> Matrix<T> {
    for (i, (w, b)) in parameters.iter().enumerate() {
        let z = x.matmul(w.clone());
        let rows = z.shape().0;
        let b = b.retaped::<T>().broadcast_like::<_, Axis<0>>(&(rows, b.shape().0));
        let z = z + b;
        x = match shape.activation(i) {
            Activation::Identity => z,
            Activation::Relu => z.relu(),
            Activation::Tanh => z.tanh(),
            Activation::RmsRelu => {
                let (u, tape) = z.relu().split_tape();
                let rms = (u.retaped::<T>().square().mean::<_, Axis<1>>() + 1e-6).sqrt();
                let rms = rms.broadcast_like::<_, Axis<1>>(u.shape());
                u.put_tape(tape) / rms
            }
        };
    }
    x
}

/// The gradient of all parameters, 0 where there is none.
fn gradient(net: &Mlp, grads: &mut Gradients<f32, Cpu>) -> Vec<f32> {
    grads.get_or_alloc_mut(net.parameters()).unwrap().to_vec()
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
                let net = Mlp::new(shape.clone(), InitScheme::FanIn, &mut rng).unwrap();
                let plain_parameters = parameters(&net);
                // Padding: zero columns, which the fused network skips in large batches.
                let mut x = random(rows, shape.inputs(), &mut rng).as_vec();
                let width = shape.inputs();
                (0..x.len()).filter(|i| width > 10 && !(i % width).is_multiple_of(3)).for_each(|i| x[i] = 0.0);
                let x = matrix(&Cpu::default(), x, rows, width);
                let what = format!("{shape:?}");

                let y = net.forward(x.leaky_trace());
                let plain_y = plain(&shape, &plain_parameters, x.leaky_trace());
                close(&y.as_vec(), &plain_y.as_vec(), 1e-5, &what);
                let mut predicted = Vec::new();
                net.predict_into(&x.as_vec(), rows, &mut predicted);
                close(&predicted, &y.as_vec(), 0.0, &what);
                for (row, y) in x.as_vec().chunks_exact(width).zip(y.as_vec().chunks_exact(shape.outputs())) {
                    net.predict_into(row, 1, &mut predicted);
                    close(&predicted, y, 0.0, &what);
                }

                let mut grads = y.square().mean().backward();
                let plain_grads = plain_y.square().mean().backward();
                // Dividing outputs by their own size nearly cancels the gradient.
                let tolerance = if output == Activation::RmsRelu { 1e-4 } else { 1e-5 };
                close(&grads.get(&x).as_vec(), &plain_grads.get(&x).as_vec(), tolerance, &what);
                let mine = gradient(&net, &mut grads);
                let mut theirs = Vec::new();
                for (w, b) in &plain_parameters {
                    theirs.extend(plain_grads.get(w).as_vec());
                    theirs.extend(plain_grads.get(b).as_vec());
                }
                close(&mine, &theirs, tolerance, &what);
            }
        }
    }
}

/// Mean of the squared outputs in `f64`, for finite differences.
fn loss_in_f64(shape: &MlpShape, values: &[(Vec<f64>, Vec<f64>)], x: &[f64]) -> f64 {
    let mut x = x.to_vec();
    for (i, (w, b)) in values.iter().enumerate() {
        let (inputs, outputs) = (shape.sizes[i], shape.sizes[i + 1]);
        let mut y = Vec::new();
        for row in x.chunks_exact(inputs) {
            let start = y.len();
            for o in 0..outputs {
                let z = b[o] + (0..inputs).map(|k| row[k] * w[k * outputs + o]).sum::<f64>();
                y.push(match shape.activation(i) {
                    Activation::Identity => z,
                    Activation::Relu | Activation::RmsRelu => z.max(0.0),
                    Activation::Tanh => z.tanh(),
                });
            }
            if shape.activation(i) == Activation::RmsRelu {
                let y = &mut y[start..];
                let rms = (y.iter().map(|y| y * y).sum::<f64>() / outputs as f64 + 1e-6).sqrt();
                y.iter_mut().for_each(|y| *y /= rms);
            }
        }
        x = y;
    }
    x.iter().map(|y| y * y).sum::<f64>() / x.len() as f64
}

#[test]
fn gradients_agree_with_central_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let wide = |v: Vec<f32>| v.into_iter().map(f64::from).collect::<Vec<f64>>();
    for hidden in ACTIVATIONS {
        for output in ACTIVATIONS {
            let shape = MlpShape { sizes: vec![4, 18, 7, 3], hidden, output };
            let net = Mlp::new(shape.clone(), InitScheme::FanIn, &mut rng).unwrap();
            let x = random(5, 4, &mut rng);
            let mut grads = net.forward(x.leaky_trace()).square().mean().backward();
            let mut found = wide(grads.get(&x).as_vec());
            found.extend(wide(gradient(&net, &mut grads)));
            let parameters = net.values();
            let split = |layer: &Layer| layer.split(parameters);
            let mut values: Vec<_> =
                net.layers().iter().map(split).map(|(w, b)| (wide(w.to_vec()), wide(b.to_vec()))).collect();
            let mut x = wide(x.as_vec());
            let mut expected = Vec::new();
            let step = 1e-6;
            for i in 0..x.len() {
                let mut at = |d: f64| {
                    x[i] += d;
                    let loss = loss_in_f64(&shape, &values, &x);
                    x[i] -= d;
                    loss
                };
                expected.push((at(step) - at(-step)) / (2.0 * step));
            }
            for layer in 0..values.len() {
                for part in 0..2 {
                    let count = [values[layer].0.len(), values[layer].1.len()][part];
                    for i in 0..count {
                        let mut at = |d: f64| {
                            let (w, b) = &mut values[layer];
                            let value = if part == 0 { &mut w[i] } else { &mut b[i] };
                            *value += d;
                            let loss = loss_in_f64(&shape, &values, &x);
                            let (w, b) = &mut values[layer];
                            let value = if part == 0 { &mut w[i] } else { &mut b[i] };
                            *value -= d;
                            loss
                        };
                        expected.push((at(step) - at(-step)) / (2.0 * step));
                    }
                }
            }
            assert_eq!(found.len(), expected.len());
            for (i, (f, e)) in found.iter().zip(&expected).enumerate() {
                assert!((f - e).abs() < 2e-6 + 1e-5 * e.abs(), "{shape:?} [{i}]: {f} and {e}");
            }
        }
    }
}

/// The bits of all results of two training steps and a prediction.
fn train_and_predict() -> Vec<u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let shape = MlpShape::uniform(21, 64, 20, 9, Activation::Tanh);
    let mut net = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap();
    let mut optimiser = Optimiser::new(OptimiserKind::Adam, &[&net]);
    let x = random(331, 21, &mut rng);
    let mut bits = Vec::new();
    for _ in 0..2 {
        let mut grads = net.forward(x.leaky_trace()).square().mean().backward();
        optimiser.update(&mut [&mut net], &mut grads, 1e-2).unwrap();
        bits.extend(grads.get(&x).as_vec());
    }
    let mut y = Vec::new();
    net.predict_into(&x.as_vec(), 331, &mut y);
    bits.extend(y);
    // Branches of uneven sizes: a cut falls in the middle of one of them.
    let mut deep = || {
        let shape = MlpShape::uniform(21, 64, 20, 9, Activation::Tanh);
        Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap()
    };
    let mut networks = [deep(), deep(), deep()];
    let (inputs, targets) = (x.as_vec(), [(0..17).collect(), (10..211).collect::<Vec<_>>(), (190..230).collect()]);
    let mut optimiser = Optimiser::new(OptimiserKind::Adam, &networks.each_ref());
    for _ in 0..2 {
        let branch = |n: usize| {
            let targets: &Vec<usize> = &targets[n];
            Branch { network: &networks[n], inputs: &inputs[..targets.len() * 21], targets }
        };
        let sum = sum_of_branches(&[branch(0), branch(1), branch(2)], 230, 20, &Cpu::default());
        bits.extend(sum.as_vec());
        let norm = optimiser.update(&mut networks.each_mut(), &mut sum.square().mean().backward(), 1e-2).unwrap();
        bits.push(norm as f32);
    }
    bits.into_iter().map(f32::to_bits).collect()
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(train_and_predict)
    };
    let one = with(1);
    assert!(one == with(2), "two threads");
    assert!(one == with(3), "three threads");
}

#[test]
fn the_prediction_for_a_row_does_not_depend_on_the_batch() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let net = Mlp::new(MlpShape::uniform(7, 40, 3, 4, Activation::Relu), InitScheme::FanIn, &mut rng).unwrap();
    let x = random(500, 7, &mut rng).as_vec();
    let (mut all, mut one) = (Vec::new(), Vec::new());
    net.predict_into(&x, 500, &mut all);
    for row in [0, 5, 191, 192, 499] {
        net.predict_into(&x[row * 7..][..7], 1, &mut one);
        assert_eq!(one, all[row * 3..][..3], "row {row}");
    }
    net.predict_into(&[], 0, &mut one);
    assert!(one.is_empty());
}

#[test]
fn frozen_and_data_passes_leave_out_gradients() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let shape = MlpShape::uniform(6, 20, 2, 3, Activation::Tanh);
    let net = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap();
    let x = random(9, 6, &mut rng);
    let mut both = net.forward(x.leaky_trace()).square().mean().backward();
    let mut data = net.forward_data(x.leaky_trace()).square().mean().backward();
    let mut frozen = net.forward_frozen(x.leaky_trace()).square().mean().backward();
    assert_eq!(frozen.get(&x).as_vec(), both.get(&x).as_vec());
    let expected = gradient(&net, &mut both);
    assert_eq!(gradient(&net, &mut data), expected);
    assert!(net.layers().iter().all(|layer| layer.split(&expected).0.iter().any(|g| *g != 0.0)));
    assert!(gradient(&net, &mut frozen).iter().all(|g| *g == 0.0));
    assert!(data.get_or_alloc_mut(&x).unwrap().iter().all(|g| *g == 0.0));
}

#[test]
fn a_network_used_twice_sums_its_gradients() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let net = Mlp::new(MlpShape::uniform(3, 8, 2, 2, Activation::Tanh), InitScheme::FanIn, &mut rng).unwrap();
    let (a, b) = (random(4, 3, &mut rng), random(5, 3, &mut rng));
    let ya = net.forward(a.leaky_trace()).square().sum();
    let mut together = (ya + net.forward(b.leaky_trace()).square().sum()).backward();
    let mut first = net.forward(a.leaky_trace()).square().sum().backward();
    let mut second = net.forward(b.leaky_trace()).square().sum().backward();
    let (first, second) = (gradient(&net, &mut first), gradient(&net, &mut second));
    let sum: Vec<f32> = first.iter().zip(&second).map(|(a, b)| a + b).collect();
    close(&gradient(&net, &mut together), &sum, 1e-6, "gradients");
}

#[test]
fn a_view_with_other_strides_is_read_in_its_own_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let net = Mlp::new(MlpShape::uniform(4, 8, 2, 2, Activation::Tanh), InitScheme::FanIn, &mut rng).unwrap();
    let turned = random(4, 6, &mut rng).permute::<_, Axes2<1, 0>>();
    let dense = matrix(&Cpu::default(), turned.as_vec(), 6, 4);
    let y = net.forward(dense.leaky_trace());
    assert_eq!(net.forward(turned.leaky_trace()).as_vec(), y.as_vec());
    let grads = y.square().mean().backward();
    let turned_grads = net.forward(turned.leaky_trace()).square().mean().backward();
    assert_eq!(turned_grads.get(&turned).as_vec(), grads.get(&dense).as_vec());
}

#[test]
fn soft_update_keeps_one_minus_tau_of_the_target() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let shape = MlpShape::uniform(5, 6, 3, 2, Activation::Relu);
    let online = Mlp::new(shape.clone(), InitScheme::FanIn, &mut rng).unwrap();
    let mut target = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap();
    let before = target.clone();
    target.soft_update(&online, 0.1);
    let mix = |(before, online): (&f32, &f32)| 0.9 * before + 0.1 * online;
    let expected: Vec<f32> = before.values().iter().zip(online.values()).map(mix).collect();
    close(target.values(), &expected, 1e-6, "parameters");
    target.soft_update(&online, 1.0);
    assert_eq!(target.values(), online.values());
}

#[test]
fn sizes_that_are_no_network_are_refused() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    for sizes in [vec![], vec![3], vec![3, 0, 2]] {
        let shape = MlpShape { sizes, hidden: Activation::Relu, output: Activation::Identity };
        let error = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap_err();
        assert!(matches!(error, NnError::Unusable(_)));
    }
}
