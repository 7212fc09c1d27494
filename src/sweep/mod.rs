//! Sweeps: a file of lists, expanded to many runs or models, worked on in parallel.
//!
//! A sweep file is JSON. Every entry is a setting with the list of its values, or with one
//! value; all combinations are made, of agents or of dynamics models (`kind`):
//!
//! ```json
//! {"task": ["task1", "task3"], "method": ["ddpg", "ddpg-mge"], "epsilon": [0.1, "linear:0.5:0:500"],
//!  "ddpg.gamma": [0.95, 0.99], "seed": [0, 1, 2], "episodes": 1000}
//! ```
//!
//! trains agents (`"kind": "train"`, the default): `task`, `method`, `epsilon` (also called
//! `threshold`), `model`, and any other setting of a run by its JSON path;
//!
//! ```json
//! {"kind": "dynamics", "tools": "box,bucket", "layers": [5, 17], "learning_rate": [1e-3, 1e-4]}
//! ```
//!
//! trains dynamics models: `tools`, `literal`, any setting of
//! [`ModelConfig`](crate::dynamics::ModelConfig) and [`TrainConfig`](crate::dynamics::TrainConfig)
//! by its name, and of their evaluation as `evaluation.launches` and so on. A list of such
//! objects is all of their combinations, each once. Settings written as lists are part of the
//! names of the runs, so that a list can grow without the runs that are there being lost.
//!
//! A sweep's folder holds `runs/NAME/` for each combination (see [`crate::run`] for agents; a
//! model's has `config.json`, `model.safetensors` and `result.json`), and `results.csv` and
//! `results.json` with a row each. Nothing else is kept: what is done, is seen from the runs.

mod collect;
mod error;
mod expand;
mod file;
mod models;
mod plan;
mod results;
#[cfg(test)]
mod tests;
mod training;
mod work;

pub use collect::collect;
pub use error::SweepError;
pub use expand::Sweep;
pub use plan::{plan, slurm};
pub use results::read_results;
pub use work::run;
