//! The training loop on its own thread: control in, events out.
//!
//! [`Training`] is the loop without threads or files. [`conduct()`] runs it into a run
//! directory, which every reader of the run reads; [`Trainer`] does so on a thread.
//! What crosses the threads: [`Control`] values in, the run's event log out, and a
//! latest-wins [`Watch`] for whoever looks on.

mod conduct;
mod config;
mod imagination;
mod method;
mod prior;
mod setting;
mod streams;
#[cfg(test)]
mod tests;
mod thread;
mod trace;
mod training;
mod watch;

pub use conduct::{ConductError, Control, Ending, conduct};
pub use config::{Evaluation, Granularity, ModelReplay, NoiseDecay, Refinement, RunConfig, RunConfigError};
pub use method::{Method, PriorSource};
pub use prior::{NamedModel, PriorError, build_prior, check_model, rollout_model};
pub use setting::{SettingError, config_keys};
pub use thread::Trainer;
pub use trace::{Source, Trace, TracedStep};
pub use training::{NETWORKS_SECTION, Training, TrainingError, greedy_episode};
pub use watch::{LiveView, Phase, Watch};
