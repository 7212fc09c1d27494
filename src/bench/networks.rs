//! The paper's graph network (appendix A.1) on the shapes of its training.

use dfdx::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::nn::{
    Activation, Branch, InitScheme, Matrix, Mlp, MlpShape, Optimiser, OptimiserKind, concat_columns, matrix,
    sum_of_branches,
};

const NODE: usize = 10;
const EDGE: usize = 21;
const HIDDEN: usize = 64;
const EMBEDDING: usize = 20;
const LAYERS: usize = 17;
const BATCH: usize = 128;
const ROLLOUTS: usize = 4096;

pub(super) fn train_step() -> Box<dyn FnMut()> {
    let mut network = GraphNetwork::new();
    let edges = [random(BATCH / 2, EDGE).as_vec(), random(BATCH / 2, EDGE).as_vec()];
    let receivers: [Vec<usize>; 2] = [(0..BATCH / 2).collect(), (BATCH / 2..BATCH).collect()];
    let (nodes, targets) = (random(BATCH, NODE), random(BATCH, 2));
    Box::new(move || network.train_step(&edges, &receivers, &nodes, &targets))
}

pub(super) fn forward() -> Box<dyn FnMut()> {
    let network = GraphNetwork::new();
    let (edges, nodes) = (random(ROLLOUTS, EDGE).as_vec(), random(ROLLOUTS, NODE).as_vec());
    let mut buffers: [Vec<f32>; 4] = Default::default();
    Box::new(move || network.predict(&edges, &nodes, &mut buffers))
}

/// Two edge functions, node function and decoder.
struct GraphNetwork {
    edges: [Mlp; 2],
    node: Mlp,
    decoder: Mlp,
    optimiser: Optimiser,
}

impl GraphNetwork {
    fn new() -> Self {
        let network = |shape| {
            // The shapes are constants without a zero.
            Mlp::new(shape, InitScheme::FanIn, &mut ChaCha8Rng::seed_from_u64(0)).expect("no layer is empty")
        };
        let deep = |inputs| network(MlpShape::uniform(inputs, HIDDEN, EMBEDDING, LAYERS, Activation::Tanh));
        let (edges, node) = ([deep(EDGE), deep(EDGE)], deep(EMBEDDING + NODE));
        let decoder = network(MlpShape::uniform(EMBEDDING, HIDDEN, 2, 2, Activation::Tanh));
        let networks = [&edges[0], &edges[1], &node, &decoder];
        Self { optimiser: Optimiser::new(OptimiserKind::Adam, &networks), edges, node, decoder }
    }

    fn train_step(&mut self, edges: &[Vec<f32>; 2], receivers: &[Vec<usize>; 2], nodes: &Matrix, targets: &Matrix) {
        let branch =
            |edge: usize| Branch { network: &self.edges[edge], inputs: &edges[edge], targets: &receivers[edge] };
        let sum = sum_of_branches(&[branch(0), branch(1)], BATCH, EMBEDDING, &Cpu::default());
        let embedding = self.node.forward(concat_columns(sum, nodes.clone()));
        let predicted = self.decoder.forward(embedding);
        let mut gradients = (predicted - targets.clone()).square().mean().backward();
        let [first, second] = &mut self.edges;
        let networks = &mut [first, second, &mut self.node, &mut self.decoder];
        // The rate is tiny and the data bounded: a few thousand steps stay finite.
        self.optimiser.update(networks, &mut gradients, 1e-4).expect("the loss is finite");
    }

    fn predict(&self, edges: &[f32], nodes: &[f32], [messages, joined, embedding, out]: &mut [Vec<f32>; 4]) {
        let count = nodes.len() / NODE;
        self.edges[0].predict_into(edges, count, messages);
        joined.clear();
        for (message, node) in messages.chunks_exact(EMBEDDING).zip(nodes.chunks_exact(NODE)) {
            joined.extend_from_slice(message);
            joined.extend_from_slice(node);
        }
        self.node.predict_into(joined, count, embedding);
        self.decoder.predict_into(embedding, count, out);
    }
}

fn random(rows: usize, columns: usize) -> Matrix {
    let mut rng = ChaCha8Rng::seed_from_u64((rows * columns) as u64);
    let values = (0..rows * columns).map(|_| rng.gen_range(-1.0..1.0)).collect();
    matrix(&Cpu::default(), values, rows, columns)
}
