//! Expands a sweep file to its runs: every combination is named and checked before any work.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use super::file::{Axis, Choice, Grid, grids, invalid};
use super::hits::{HitJob, Policy};
use super::models::ModelJob;
use super::training::{Agents, absolute_paths, check_aliases};
use crate::error::{ExperimentError, Result};
use mge_base::bounded;
use mge_base::json;
use mge_base::paths::fitting;
use mge_base::spelling::did_you_mean;
use mge_base::validation::ValidationError;
use mge_dynamics::model_name;
use mge_run::RunError;
use mge_trainer::{RunConfig, set_the_same, settings_of, warnings};

/// A sweep, ready to run: every combination has been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The jobs, in order.
    pub jobs: Vec<Job>,
}

/// One run or model of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Name of its folder.
    pub name: String,
    /// The sweep file of this job alone.
    pub alone: Value,
    /// Its work.
    pub work: Work,
    /// The settings that the file gives it, by path.
    pub set: BTreeSet<String>,
}

/// The work of a job.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    /// Trains an agent.
    Train(Box<RunConfig>),
    /// Trains and evaluates a dynamics model.
    Dynamics(Box<ModelJob>),
    /// Counts how often a policy reaches the stages of a task.
    Hits(Box<HitJob>),
}

impl Sweep {
    /// The [warnings] about its trainings.
    pub fn warnings(&self) -> Vec<String> {
        warnings(self.jobs.iter().filter_map(|job| match &job.work {
            Work::Train(config) => Some((&**config, &job.set)),
            Work::Dynamics(_) | Work::Hits(_) => None,
        }))
    }

    /// Reads a sweep file.
    ///
    /// # Errors
    /// As [`Sweep::parse`], and when the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        let text = bounded::read(path, bounded::TEXT).map_err(RunError::io("read", path))?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Parses the text of a sweep file; `origin` names it in errors.
    ///
    /// # Errors
    /// At the first mistake, with its line or JSON path, and a suggestion for an unknown name.
    pub fn parse(text: &[u8], origin: &str) -> Result<Self> {
        let mut jobs: Vec<Job> = Vec::new();
        for (path, grid) in &grids(text, origin)? {
            let wrong = |problem: ValidationError| invalid(text, origin, path, problem);
            for job in expand(grid).map_err(wrong)? {
                // Plain DDPG ignores thresholds, and grids may overlap: duplicates are dropped.
                if jobs.iter().any(|known| known.work == job.work) {
                    continue;
                }
                if jobs.iter().any(|known| known.name == job.name) {
                    let message = format!(
                        "two different runs would be called `{}`: write the settings in which they differ as lists",
                        job.name
                    );
                    return Err(wrong(ValidationError::new(".", message)));
                }
                jobs.push(job);
            }
        }
        if jobs.is_empty() {
            let problem = ValidationError::new(".", "makes no run: give a `task` and other settings");
            return Err(ExperimentError::Invalid { origin: origin.to_owned(), problem });
        }
        Ok(Self { jobs })
    }
}

fn expand(grid: &Grid) -> Result<Vec<Job>, ValidationError> {
    let kind = grid.kind.as_ref().map_or("train", |kind| kind.as_str().unwrap_or(""));
    let mut agents = Agents::default();
    match kind {
        "train" => {
            let grid = with_config(grid)?;
            check_aliases(&grid)?;
            absolute_paths(&grid).expand(|chosen| {
                let config = agents.config(chosen)?;
                let prefix = format!("{}-{}", config.task.name, config.method);
                Ok((prefix, config.seed, Work::Train(Box::new(config))))
            })
        }
        "dynamics" => grid.expand(|chosen| {
            let job = ModelJob::new(chosen)?;
            Ok((model_name(&job.model, &job.tools), job.training.seed, Work::Dynamics(Box::new(job))))
        }),
        "hits" => absolute_paths(grid).expand(|chosen| {
            let job = HitJob::new(chosen, &mut agents)?;
            Ok((format!("{}-{}", job.task.name, job.policy), job.seed, Work::Hits(Box::new(job))))
        }),
        _ => {
            let hint = did_you_mean(["train", "dynamics", "hits"], kind);
            Err(ValidationError::new("kind", format!("must be `train`, `dynamics` or `hits`{hint}")))
        }
    }
}

/// The grid with the settings of the file that its `config` names, except those that the grid sets itself.
fn with_config(grid: &Grid) -> Result<Grid, ValidationError> {
    let (configs, mut axes): (Vec<Axis>, Vec<Axis>) = grid.axes.iter().cloned().partition(|axis| axis.key == "config");
    let own: Vec<String> = axes.iter().map(|axis| super::training::setting(&axis.key).to_owned()).collect();
    for axis in configs {
        let [name] = axis.values.as_slice() else {
            return Err(ValidationError::new("config", "must be one file of settings: write one object for each"));
        };
        let settings = settings_of(Path::new(&json::text(name)));
        let settings = settings.map_err(|error| ValidationError::new("config", error))?;
        let is_own = |path: &String| own.iter().any(|own| set_the_same(own, path));
        axes.extend(settings.into_iter().filter(|(path, _)| !is_own(path)).map(|(key, value)| Axis {
            key,
            values: vec![value],
            is_list: false,
            is_sampled: false,
        }));
    }
    Ok(Grid { axes, ..grid.clone() })
}

impl Grid {
    /// A job for each combination; `make` returns the prefix of its name, its seed and its work.
    fn expand(
        &self,
        mut make: impl FnMut(&[Choice<'_>]) -> Result<(String, u64, Work), ValidationError>,
    ) -> Result<Vec<Job>, ValidationError> {
        let job = |chosen: &Vec<Choice<'_>>| {
            let (prefix, seed, work) = make(chosen)?;
            let is_named = |choice: &&Choice<'_>| choice.axis.is_list && !work.omits_from_name(choice.key());
            let listed = chosen.iter().filter(is_named).map(|choice| format!("-{}", name_part(choice, &work)));
            let name = fitting(&(prefix + &file_name(&listed.collect::<String>())), &format!("-seed{seed}"));
            let set = self.axes.iter().map(|axis| super::training::setting(&axis.key).to_owned()).collect();
            Ok(Job { name, alone: self.alone(chosen), work, set })
        };
        self.combinations().iter().map(job).collect()
    }
}

impl Work {
    /// Whether a setting is left out of the list in the job's name, because it is in the prefix or suffix or has no
    /// effect.
    fn omits_from_name(&self, key: &str) -> bool {
        match self {
            Self::Train(config) => {
                ["task", "method", "seed"].contains(&key) || !config.uses(super::training::setting(key))
            }
            Self::Dynamics(_) => ["tools", "seed"].contains(&key),
            Self::Hits(job) => {
                let is_unused = job.policy != Policy::Guided && ["build", "model", "prior"].contains(&key);
                is_unused || ["task", "policy", "seed"].contains(&key)
            }
        }
    }
}

fn name_part(choice: &Choice<'_>, work: &Work) -> String {
    // As JSON, so that the names of runs stay those of earlier versions.
    let mut text = choice.value().as_str().map_or_else(|| choice.value().to_string(), str::to_owned);
    if let Work::Train(config) = work
        && let Some(id) = super::training::file_behind(config, choice.key(), &text)
    {
        text = format!("{}-{}", id.name, id.digits());
    }
    match choice.key() {
        "epsilon" | "threshold" => text,
        key => format!("{key}_{text}"),
    }
}

/// Turns a text into part of a folder name that is valid on all systems.
fn file_name(text: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' };
    text.chars().map(allowed).collect()
}
