//! Networks side by side whose outputs meet in one sum: edge functions and their messages.

use std::mem;

use dfdx::prelude::*;

use super::{
    Matrix, Mlp,
    layer::Layer,
    matrix,
    mlp::{Pool, put_gradients, take_gradients},
    stack::{self, Backward, Forward, LayerGradients, Workspace},
};

/// A batch of data for one of several networks.
#[derive(Clone, Copy, Debug)]
pub struct Branch<'a> {
    /// The network, another one in each branch.
    pub network: &'a Mlp,
    /// Its inputs, row-major.
    pub inputs: &'a [f32],
    /// The row of the sum that each of its output rows is added to.
    pub targets: &'a [usize],
}

/// The sum of the outputs of all branches, `rows` × `columns`: row `targets[i]` has received
/// output row `i` of every branch, rows without an output are 0. One operation on the tape, so
/// the branches share all threads of the current rayon pool; gradients flow to the parameters of
/// the networks.
///
/// # Panics
/// If the sizes do not fit: inputs that are not one row a target, outputs that are not `columns`,
/// a target that is not below `rows`.
pub fn sum_of_branches(
    branches: &[Branch<'_>],
    rows: usize,
    columns: usize,
    device: &Cpu,
) -> Matrix<OwnedTape<f32, Cpu>> {
    let mut passes: Vec<Pass> = branches.iter().map(|branch| Pass::new(branch, rows, columns)).collect();
    stack::forward(&mut passes.iter_mut().map(Pass::forward).collect::<Vec<_>>());
    let mut sum = vec![0.0; rows * columns];
    for pass in &mut passes {
        pass.workspace.output(&pass.layers, &mut pass.outputs);
        for (row, &target) in pass.outputs.chunks_exact(columns).zip(&pass.targets) {
            sum[target * columns..][..columns].iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
    }
    let sum = matrix(device, sum, rows, columns);
    let (out, mut tape) = (sum.clone(), OwnedTape::default());
    tape.add_backward_op(move |grads| {
        let gradient = mem::take(&mut **grads.get_or_alloc_mut(&out)?);
        for pass in &mut passes {
            for (row, &target) in pass.outputs.chunks_exact_mut(columns).zip(&pass.targets) {
                row.copy_from_slice(&gradient[target * columns..][..columns]);
            }
            pass.gradients = take_gradients(&pass.layers, grads)?;
        }
        **grads.get_or_alloc_mut(&out)? = gradient;
        stack::backward(&mut passes.iter_mut().map(Pass::backward).collect::<Vec<_>>());
        for pass in passes {
            put_gradients(&pass.layers, pass.gradients, grads)?;
            pass.pool.give_back(pass.workspace);
        }
        Ok(())
    });
    sum.put_tape(tape)
}

/// A branch between its forward and its backward pass.
struct Pass {
    layers: Vec<Layer>,
    targets: Vec<usize>,
    /// Outputs, then their gradients.
    outputs: Vec<f32>,
    gradients: Vec<LayerGradients>,
    workspace: Workspace,
    pool: Pool<Workspace>,
}

impl Pass {
    fn new(branch: &Branch<'_>, rows: usize, columns: usize) -> Self {
        let Branch { network, inputs, targets } = *branch;
        assert_eq!(network.shape().outputs(), columns, "output columns of the network");
        assert_eq!(inputs.len(), targets.len() * network.shape().inputs(), "inputs of the network");
        assert!(targets.iter().all(|&target| target < rows), "targets below {rows}");
        let (layers, pool) = (network.layers().to_vec(), network.training_pool().clone());
        let mut workspace = pool.take();
        workspace.input(targets.len(), &layers).copy_from_slice(inputs);
        let outputs = vec![0.0; targets.len() * columns];
        Self { layers, targets: targets.to_vec(), outputs, gradients: Vec::new(), workspace, pool }
    }

    fn forward(&mut self) -> Forward<'_> {
        Forward { layers: &self.layers, workspace: &mut self.workspace }
    }

    fn backward(&mut self) -> Backward<'_> {
        Backward {
            layers: &self.layers,
            workspace: &mut self.workspace,
            dy: &self.outputs,
            gradients: Some(&mut self.gradients),
            input: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use dfdx::tensor_ops::Backward as _;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::nn::{Activation, InitScheme, MlpShape};

    #[test]
    fn branches_are_networks_one_after_the_other() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let device = Cpu::default();
        let mut network = |inputs| {
            Mlp::new(MlpShape::uniform(inputs, 24, 5, 3, Activation::Tanh), InitScheme::Xavier, &mut rng).unwrap()
        };
        let networks = [network(3), network(7), network(4)];
        let targets = [vec![0, 2, 2, 5, 1], vec![], vec![2, 0]];
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let inputs: Vec<Vec<f32>> = networks
            .iter()
            .zip(&targets)
            .map(|(n, t)| (0..t.len() * n.shape().inputs()).map(|_| rng.gen_range(-1.0..1.0)).collect())
            .collect();
        let branches: Vec<Branch> = networks
            .iter()
            .zip(inputs.iter().zip(&targets))
            .map(|(network, (inputs, targets))| Branch { network, inputs, targets })
            .collect();
        let sum = sum_of_branches(&branches, 6, 5, &device);
        let mut expected = matrix(&device, vec![0.0; 30], 6, 5).leaky_traced();
        for Branch { network, inputs, targets } in &branches {
            let x = matrix(&device, inputs.to_vec(), targets.len(), network.shape().inputs());
            // Row `t` of this matrix picks the rows whose target is `t`.
            let mut picks = vec![0.0; 6 * targets.len()];
            targets.iter().enumerate().for_each(|(row, target)| picks[target * targets.len() + row] = 1.0);
            let picks = matrix(&device, picks, 6, targets.len());
            expected = expected + picks.leaky_traced().matmul(network.forward_data(x.leaky_traced()));
        }
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close(&sum.as_vec(), &expected.as_vec()));
        assert!(sum.as_vec()[3 * 5..][..10].iter().all(|v| *v == 0.0), "rows 3 and 4 have no output");
        let (mut grads, mut wanted) = (sum.square().mean().backward(), expected.square().mean().backward());
        for network in &networks {
            let of = |grads| take_gradients(network.layers(), grads).unwrap();
            for ((w, b), (w2, b2)) in of(&mut grads).iter().zip(&of(&mut wanted)) {
                assert!(close(w, w2) && close(b, b2));
            }
        }
    }
}
