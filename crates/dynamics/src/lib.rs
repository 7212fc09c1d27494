//! Task-agnostic dynamics models: launches, graphs, the network, training, prediction
//! (paper, sections 2.1, 4.1, 5.2 and appendix A.1).
//!
//! Data flow: [`collect`] launches balls at single tools → launches become samples, a graph
//! and a target for every prediction interval → [`Training`] fits the networks →
//! [`Model`] predicts thousands of scenes as one batch → [`rollouts`] for guidance,
//! [`evaluate()`].
//!
//! ```
//! use std::sync::Arc;
//!
//! use mge_base::stop::Stop;
//! use mge_env::Environment;
//!
//! let env = Environment::new(Arc::new(mge_task::load("task1")?));
//! let model = mge_dynamics::named("bucket-box", None)?;
//! let predicted = mge_dynamics::rollouts(&*model, &[env.snapshot()], &[vec![[0.2, -0.4]; 3]], &Stop::default())?;
//! println!("the ball moves along {:?}; the next stage is reached: {}", predicted[0].path, predicted[0].hit);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Choices
//! The following settings are left open by the paper or differ from its literal reading
//! ([`ModelConfig::literal`]):
//!
//! 1. **Prediction interval** ([`ModelConfig::interval`]): 5 physics steps, eight predictions
//!    per action. The paper seems to predict a whole action of 1.33 s at once.
//! 2. **Targets** ([`Targets`]): the displacement beyond that of the current velocity, and
//!    the change of velocity. The paper's decoder outputs the next position only; velocity
//!    would then have to be the mean over the interval.
//! 3. **Distance** ([`Geometry`]): from the ball's centre to the tool's surface, with the
//!    nearest surface point and the tool's half extents as additional edge features, because
//!    the end of a long floor is far from its centre. The paper says "distance between nodes".
//! 4. **Spin** ([`ModelConfig::spin`]): the ball's angular velocity is part of its state;
//!    through friction it determines where a spinning ball bounces.
//! 5. **Normalisation** (`normaliser`): inputs and targets have mean 0 and scale 1 over
//!    the training data; the statistics are part of the model.
//! 6. **Observations** (`samples`): one observation is one interaction of 1.33 s, recorded
//!    at every physics step, so that a prediction interval can start at any step. An
//!    epoch uses one row of each observation, so the number of updates is the paper's.
//!    Half of the rows are drawn from those close to a contact
//!    ([`TrainConfig::contact_share`]), and mirror images are used as well
//!    ([`TrainConfig::mirror`]) where a tool has one.
//! 7. **Learning rate** ([`RateSchedule`]): falls to 0 along half a cosine.
//! 8. **Initial weights**: orthogonal.
//! 9. **Launches**: tool sizes, speeds and angles, see [`collect`].
//! 10. **Loss** ([`Loss`]): Huber's, of width 0.1, because of buckets: a capture is a residual far larger than all others.
//! 11. **Bystanders** ([`TrainConfig::bystanders`]; shipped models, and those [trained for a task](TaskModelConfig)): a
//!     launch has one tool, a task several near the ball. A second tool that the ball does not touch changes nothing, so
//!     it can be added to a launch without another observation. Without bystanders, models that predict launches better
//!     predict tasks worse.
//! 12. **Size and number of launches** (the same models): five layers and a learning rate of 0.001 do better than
//!     seventeen layers and 0.0001, in less time. Shipped models have ten times as many launches of each tool, those
//!     trained for a task a fifth.
//! 13. **Properties** ([`ModelConfig::properties`], only for models of all of CREATE's tools, and for those trained for
//!     a task whose tools or ball do not have the default form): each tool type has
//!     its own edge function, whose inputs include the tool's size, angle, material, force, speed etc. as in
//!     [`tool_features`](mge_env::tool_features). Tools that turn are represented in their initial position.

#![deny(unsafe_code)]

mod baseline;
mod bystander;
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
mod rapier;
mod recipe;
mod rollout;
mod samples;
mod shipped;
mod tool_set;
mod train;
mod true_scenes;
mod variety;

pub use config::{
    Coordinates, EdgeActivation, EdgeFunctions, Geometry, Loss, MODEL_SETTINGS, ModelConfig, RateSchedule,
    TRAIN_SETTINGS, Targets, TrainConfig,
};
pub use error::{DynamicsError, Result};
pub use evaluate::{
    Compared, Evaluation, EvaluationConfig, HitPredictions, LaunchErrors, OneTool, SceneErrors, evaluate,
};
pub use graph::{Edges, Graphs, Layout};
pub use launch::{Launch, Split, collect};
pub use model::{Model, Provenance};
pub use network::Network;
pub use predictor::{Errors, Predictor};
pub use rapier::Rapier;
pub use recipe::{Recipe, TASK_MODEL_SETTINGS, TaskModelConfig};
pub use rollout::{Rollout, RolloutAction, rollouts};
pub use shipped::{file_of, named, shipped, shipped_evaluation, shipped_for, shipped_models};
pub use tool_set::{ToolSet, canonical_tool_set, model_name, tool_set_name};
pub use train::{Progress, Training, train_to_file};
pub use variety::Variety;
#[cfg(test)]
mod tests;
