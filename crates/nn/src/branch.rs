//! Several networks whose outputs are summed: edge functions and their messages.

use dfdx::prelude::*;

use super::{
    Matrix, Mlp, matrix,
    stack::{self, Pass},
};

/// A batch of data for one of several networks.
#[derive(Clone, Copy, Debug)]
pub struct Branch<'a> {
    /// The network; each branch has a different one.
    pub network: &'a Mlp,
    /// Its inputs, row-major.
    pub inputs: &'a [f32],
    /// The row of the sum that each of its output rows is added to.
    pub targets: &'a [usize],
}

/// The sum of the outputs of all branches, `rows` × `columns`: output row `i` of a branch is added
/// to row `targets[i]`; rows that receive no output are 0. This is one operation on the tape, so
/// the branches share all threads of the current rayon pool. Gradients flow to the parameters of
/// the networks.
///
/// # Panics
/// If the sizes do not match: a branch needs one input row per target, a network with `columns`
/// outputs, and targets below `rows`.
pub fn sum_of_branches(
    branches: &[Branch<'_>],
    rows: usize,
    columns: usize,
    device: &Cpu,
) -> Matrix<OwnedTape<f32, Cpu>> {
    let mut passes: Vec<Pass> = branches.iter().map(|branch| branch.pass(rows, columns)).collect();
    stack::forward(&mut passes);
    let (mut sum, mut outputs) = (vec![0.0; rows * columns], Vec::new());
    for (pass, branch) in passes.iter().zip(branches) {
        outputs.resize(branch.targets.len() * columns, 0.0);
        pass.output(&mut outputs);
        for (row, &target) in outputs.chunks_exact(columns).zip(branch.targets) {
            sum[target * columns..][..columns].iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
    }
    let sum = matrix(device, sum, rows, columns);
    let (out, mut tape) = (sum.ghost(), OwnedTape::default());
    let targets: Vec<Vec<usize>> = branches.iter().map(|branch| branch.targets.to_vec()).collect();
    let parameters: Vec<_> = branches.iter().map(|branch| branch.network.parameters().ghost()).collect();
    tape.add_backward_op(move |grads| {
        let gradient = grads.get_or_alloc_mut(&out)?;
        for (pass, targets) in passes.iter_mut().zip(&targets) {
            pass.set_output_gradient(|row| &gradient[targets[row] * columns..][..columns]);
        }
        stack::backward(&mut passes, false);
        for (pass, parameters) in passes.iter_mut().zip(&parameters) {
            pass.add_parameter_gradients(grads.get_or_alloc_mut(parameters)?);
        }
        Ok(())
    });
    sum.put_tape(tape)
}

impl Branch<'_> {
    fn pass(&self, rows: usize, columns: usize) -> Pass {
        let Self { network, inputs, targets } = *self;
        assert_eq!(network.shape().outputs(), columns, "output columns of the network");
        assert_eq!(inputs.len(), targets.len() * network.shape().inputs(), "inputs of the network");
        assert!(targets.iter().all(|&target| target < rows), "targets below {rows}");
        let mut pass = network.pass(targets.len());
        pass.input().copy_from_slice(inputs);
        pass
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{Activation, InitScheme, MlpShape};

    #[test]
    fn branches_equal_networks_run_one_by_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let device = Cpu::default();
        let mut network = |inputs| {
            Mlp::new(MlpShape::uniform(inputs, 24, 5, 3, Activation::Tanh), InitScheme::FanIn, &mut rng).unwrap()
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
        let (grads, wanted) = (sum.square().mean().backward(), expected.square().mean().backward());
        for network in &networks {
            let of = |grads: &Gradients<f32, Cpu>| grads.get(network.parameters()).as_vec();
            assert!(close(&of(&grads), &of(&wanted)));
        }
    }
}
