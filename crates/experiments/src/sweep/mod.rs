//! Sweeps: a file of settings with lists of values is expanded to many runs or models, which are
//! trained in parallel.
//!
//! A sweep file is JSON. Every entry is a setting with one value or a list of values. All
//! combinations are worked on, as agents, dynamics models or counts of hits (`kind`):
//!
//! ```json
//! {"task": ["task1", "task3"], "method": ["ddpg", "ddpg-mge"], "epsilon": [0.1, "linear:0.5:0:500"],
//!  "ddpg.gamma": [0.95, 0.99], "seed": [0, 1, 2], "episodes": 1000}
//! ```
//!
//! `"0..9"` stands for the whole numbers from 0 to 9, `{"uniform": [0.9, 0.99]}` and `{"log_uniform": [1e-4, 1e-2]}` for
//! as many samples as `"samples": {"count": 20, "seed": 0}` asks for, each of which has a value for every such setting.
//! `"exclude"` leaves out the combinations that have the values of an object, or of one in a list. The file
//! above
//!
//! trains agents (`"kind": "train"`, the default): `task`, `method` (by default that of `mge train`), `epsilon` (also called
//! `threshold`), `model`, and any other setting of a run by its JSON path. `config` names a file of
//! settings, of which those in the sweep take precedence. In the path of a `model`, `{tools}` stands for the name of the
//! task's tool set, as in `models/runs/{tools}-seed0/model.safetensors`;
//!
//! ```json
//! {"kind": "dynamics", "tools": "box,bucket", "layers": [5, 17], "learning_rate": [1e-3, 1e-4]}
//! ```
//!
//! trains dynamics models: `tools`, `literal`, any setting of
//! [`ModelConfig`](mge_dynamics::ModelConfig) and [`TrainConfig`](mge_dynamics::TrainConfig)
//! by its name, and those of their evaluation as `evaluation.launches` and so on;
//!
//! ```json
//! {"kind": "hits", "task": ["task1", "task3"], "policy": ["guided", "random"], "seed": [0, 1], "episodes": 1000}
//! ```
//!
//! counts how often a policy that does not learn reaches each subgoal and the goal: `guided` by clusters from the
//! `model` with the seed `build`, `random` (an untrained actor with noise) or `uniform`. A list of such
//! objects stands for all of their combinations, without duplicates. Settings written as lists are
//! part of the names of the runs, so that a list can be extended without losing existing runs.
//!
//! A sweep's folder holds `runs/NAME/` for each combination (see [`mge_run`] for agents; that of
//! a model has `config.json`, `model.safetensors` and `result.json`, that of a count the first and the last), and `results.csv` and
//! `results.json` with one row per run. There is no other state: progress is derived from the runs.

mod expand;
mod file;
mod hits;
mod models;
mod plan;
mod results;
mod summary;
#[cfg(test)]
mod tests;
mod training;
mod values;
mod work;

pub use expand::{Job, Sweep, Work};
pub use hits::{HitCounts, HitJob, Policy};
pub use models::{ModelJob, ModelResult};
pub use plan::{plan, slurm};
pub(crate) use results::results_of;
pub use results::{check_results, write_results};
pub use summary::{Summary, report_measured};
pub use work::{check, no_failure, result_in, run};
