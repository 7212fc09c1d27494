//! Tests of the whole module with small networks.

mod evaluation;
mod graph;
mod model;
mod properties;
mod rollout;
mod training;

use dfdx::losses::mse_loss;
use dfdx::prelude::{AsArray, Backward, Cpu};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::baseline::ConstantVelocity;
use super::codec::Codec;
use super::graph::{GraphBuilder, Graphs, OBJECT_TYPES};
use super::launch::data_hash;
use super::network::Network;
use super::normaliser::ColumnStatistics;
use super::*;
use mge_base::stop::Stop;
use mge_env::{Action, Environment};
use mge_nn::{Optimiser, OptimiserKind, TensorFile, matrix};
use mge_physics::{BallState, STEPS_PER_ACTION, Tool, ToolKind, to_normalised};
use mge_task as task;

const TOOLS: [ToolKind; 2] = [ToolKind::Box, ToolKind::Floor];

fn small() -> ModelConfig {
    ModelConfig { layers: 3, width: 16, embedding: 6, ..ModelConfig::default() }
}

fn quick() -> TrainConfig {
    TrainConfig {
        observations: 24,
        validation: 4,
        epochs: 6,
        batch: 16,
        learning_rate: 3e-3,
        seed: 5,
        ..TrainConfig::default()
    }
}

fn recipe(config: ModelConfig, training: TrainConfig, tools: &[ToolKind]) -> Recipe {
    Recipe { tools: tools.to_vec(), config, training }
}

fn training(config: ModelConfig, train: TrainConfig) -> Training {
    Training::new(&recipe(config, train, &TOOLS), "test", &Stop::default()).unwrap()
}

fn ball() -> BallState {
    BallState { velocity: [1.5, -6.0], angular_velocity: 0.4, ..BallState::at_rest([40.0, 48.5]) }
}

fn tools() -> Vec<Tool> {
    vec![
        Tool::new(ToolKind::Box, [42.0, 40.0]),
        Tool::new(ToolKind::Floor, [38.0, 44.0]),
        Tool::new(ToolKind::Box, [34.0, 45.0]),
    ]
}

fn predict(model: &Model, ball: BallState, tools: &[Tool]) -> BallState {
    model.advance(&[ball], &[tools]).unwrap()[0]
}

fn assert_close(a: &BallState, b: &BallState, tolerance: f32) {
    for axis in 0..2 {
        assert!((a.position[axis] - b.position[axis]).abs() <= tolerance, "{a:?} {b:?}");
        assert!((a.velocity[axis] - b.velocity[axis]).abs() <= tolerance, "{a:?} {b:?}");
    }
    assert!((a.angular_velocity - b.angular_velocity).abs() <= tolerance, "{a:?} {b:?}");
}
