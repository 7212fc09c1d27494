//! The paper's graph network (appendix A.1) with the shapes of its training.

use std::ops::Range;

use dfdx::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use mge_dynamics::{Edges, Graphs, Layout, ModelConfig, Network};
use mge_nn::{Optimiser, OptimiserKind, matrix};

const NODE: usize = 10;
const EDGE: usize = 21;
const OUTPUTS: usize = 2;
const BATCH: usize = 128;
const ROLLOUTS: usize = 4096;

pub fn train_step() -> Box<dyn FnMut()> {
    let (mut network, device) = (network(), Cpu::default());
    let mut optimiser = Optimiser::new(OptimiserKind::Adam, &network.networks());
    let graphs = graphs(BATCH, [0..BATCH / 2, BATCH / 2..BATCH]);
    let targets = matrix(&device, random(BATCH * OUTPUTS), BATCH, OUTPUTS);
    Box::new(move || {
        let predicted = network.forward(&graphs, &device);
        let mut gradients = (predicted - targets.clone()).square().mean().backward();
        // With a tiny learning rate and bounded data, a few thousand steps stay finite.
        optimiser.update(&mut network.networks_mut(), &mut gradients, 1e-4).expect("the loss is finite");
    })
}

pub fn forward() -> Box<dyn FnMut()> {
    let (network, graphs) = (network(), graphs(ROLLOUTS, [0..ROLLOUTS, 0..0]));
    Box::new(move || {
        std::hint::black_box(network.predict(&graphs));
    })
}

/// Two edge functions, node function and decoder.
fn network() -> Network {
    let layout = Layout { node: NODE, edge: EDGE, functions: 2 };
    // No constant shape is zero.
    Network::new(&ModelConfig::default(), layout, OUTPUTS, &mut ChaCha8Rng::seed_from_u64(0))
        .expect("no layer is empty")
}

/// Random graphs of `scenes` nodes; `receivers` are the receiving nodes of each edge function.
fn graphs(scenes: usize, receivers: [Range<usize>; 2]) -> Graphs {
    let edges = receivers.map(|scenes| Edges { inputs: random(scenes.len() * EDGE), receivers: scenes.collect() });
    Graphs { scenes, nodes: random(scenes * NODE), edges: edges.into() }
}

fn random(count: usize) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(count as u64);
    (0..count).map(|_| rng.gen_range(-1.0..1.0)).collect()
}
