//! Task-agnostic dynamics models: launches, graphs, the network, training, prediction.

mod ablate;
mod baseline;
mod codec;
mod config;
mod error;
mod evaluate;
mod graph;
mod launch;
mod model;
mod network;
mod normaliser;
mod predictor;
mod rollout;
mod samples;
mod shipped;
mod train;

pub use ablate::{Ablated, Variant, ablate};
pub use baseline::{ConstantVelocity, NearestSample};
pub use codec::Codec;
pub use config::{
    Coordinates, EdgeActivation, EdgeFunctions, Geometry, Loss, ModelConfig, RateSchedule, Targets, TrainConfig,
};
pub use error::{DynamicsError, canonical_tool_set, tool_set_name};
pub use evaluate::{
    Compared, Errors, Evaluation, EvaluationConfig, Hits, LaunchErrors, OneTool, SceneErrors, evaluate,
};
pub use graph::{EdgeType, Edges, GraphBuilder, Graphs, Layout, NODE_FEATURES, ObjectType};
pub use launch::{Launch, Split, collect, data_hash};
pub use model::{Model, Provenance, VERSION};
pub use network::Network;
pub use normaliser::{Columns, Normaliser};
pub use predictor::Predictor;
pub use rollout::{Predicted, rollouts};
pub use samples::Samples;
pub use shipped::{shipped, shipped_for, shipped_names};
pub use train::{Ended, Progress, Training};
#[cfg(test)]
mod tests;
