//! The graph network on dfdx (paper, equation 1 and appendix A.1): edge functions, the
//! sum of messages, the node function, the decoder.

use dfdx::prelude::*;
use rand_chacha::ChaCha8Rng;

use super::config::ModelConfig;
use super::graph::{Graphs, Layout};
use mge_nn::{
    Activation, Branch, InitScheme, Matrix, Mlp, MlpShape, NnError, TensorFile, TensorFileError, concat_columns,
    matrix, sum_of_branches,
};

/// The learned functions of a dynamics model. Inputs and outputs are normalised.
#[derive(Debug, Clone)]
pub struct Network {
    /// Edge functions: receiver, sender and edge features to a message.
    edges: Vec<Mlp>,
    /// Node function: receiver features and the sum of messages to the node embedding.
    node: Mlp,
    /// Decoder: node embedding to prediction.
    decoder: Mlp,
}

/// Shapes of edge functions, node function and decoder.
fn shapes(config: &ModelConfig, layout: Layout, outputs: usize) -> [MlpShape; 3] {
    let ModelConfig { width, embedding, layers, .. } = *config;
    let tanh = Activation::Tanh;
    [
        MlpShape::uniform(layout.edge, width, embedding, layers, tanh),
        MlpShape::uniform(layout.node + embedding, width, embedding, layers, tanh),
        MlpShape::uniform(embedding, width, outputs, 2, tanh),
    ]
}

impl Network {
    /// Initial networks: orthogonal weights, which keep the scale of signals through
    /// seventeen layers of tanh.
    ///
    /// # Errors
    /// When the configured sizes are not usable.
    pub fn new(config: &ModelConfig, layout: Layout, outputs: usize, rng: &mut ChaCha8Rng) -> Result<Self, NnError> {
        let [edge, node, decoder] = shapes(config, layout, outputs);
        let init = InitScheme::Orthogonal;
        Ok(Self {
            edges: (0..layout.functions).map(|_| Mlp::new(edge.clone(), init, rng)).collect::<Result<_, _>>()?,
            node: Mlp::new(node, init, rng)?,
            decoder: Mlp::new(decoder, init, rng)?,
        })
    }

    /// All networks, in the order used by the optimiser.
    pub fn networks(&self) -> Vec<&Mlp> {
        self.edges.iter().chain([&self.node, &self.decoder]).collect()
    }

    /// All networks, mutable, in the order used by the optimiser.
    pub fn networks_mut(&mut self) -> Vec<&mut Mlp> {
        self.edges.iter_mut().chain([&mut self.node, &mut self.decoder]).collect()
    }

    /// Predictions for normalised graphs on a tape: scenes × outputs.
    pub fn forward(&self, graphs: &Graphs, device: &Cpu) -> Matrix<OwnedTape<f32, Cpu>> {
        let node_columns = graphs.nodes.len() / graphs.scenes;
        let embedding = self.node.shape().inputs() - node_columns;
        let branches: Vec<Branch> = self
            .edges
            .iter()
            .zip(&graphs.edges)
            .map(|(network, edges)| Branch { network, inputs: &edges.inputs, targets: &edges.receivers })
            .collect();
        let sum = sum_of_branches(&branches, graphs.scenes, embedding, device);
        let nodes = matrix(device, graphs.nodes.clone(), graphs.scenes, node_columns);
        self.decoder.forward(self.node.forward(concat_columns(nodes, sum)))
    }

    /// Predictions for normalised graphs without a tape, scenes × outputs. A scene's
    /// prediction depends on that scene only.
    pub fn predict(&self, graphs: &Graphs) -> Vec<f32> {
        let scenes = graphs.scenes;
        if scenes == 0 {
            return Vec::new();
        }
        let node_columns = graphs.nodes.len() / scenes;
        let columns = self.node.shape().inputs();
        let mut inputs = vec![0.0; scenes * columns];
        for (input, node) in inputs.chunks_exact_mut(columns).zip(graphs.nodes.chunks_exact(node_columns)) {
            input[..node_columns].copy_from_slice(node);
        }
        let mut buffer = Vec::new();
        for (function, edges) in self.edges.iter().zip(&graphs.edges).filter(|(_, edges)| !edges.receivers.is_empty()) {
            function.predict_into(&edges.inputs, edges.receivers.len(), &mut buffer);
            for (message, receiver) in buffer.chunks_exact(columns - node_columns).zip(&edges.receivers) {
                let sum = &mut inputs[receiver * columns + node_columns..][..message.len()];
                sum.iter_mut().zip(message).for_each(|(sum, value)| *sum += value);
            }
        }
        self.node.predict_into(&inputs, scenes, &mut buffer);
        let mut outputs = Vec::new();
        self.decoder.predict_into(&buffer, scenes, &mut outputs);
        outputs
    }

    /// Adds all weights to `file`.
    pub fn save(&self, file: &mut TensorFile) {
        for (index, edge) in self.edges.iter().enumerate() {
            edge.save(file, &format!("edge.{index}"));
        }
        self.node.save(file, "node");
        self.decoder.save(file, "decoder");
    }

    /// The networks that [`save`](Self::save) stored.
    ///
    /// # Errors
    /// When a tensor is missing, has another shape or a value that is not finite.
    pub fn load(
        config: &ModelConfig,
        layout: Layout,
        outputs: usize,
        file: &TensorFile,
    ) -> Result<Self, TensorFileError> {
        let [edge, node, decoder] = shapes(config, layout, outputs);
        Ok(Self {
            edges: (0..layout.functions)
                .map(|index| Mlp::load(edge.clone(), file, &format!("edge.{index}")))
                .collect::<Result<_, _>>()?,
            node: Mlp::load(node, file, "node")?,
            decoder: Mlp::load(decoder, file, "decoder")?,
        })
    }
}
