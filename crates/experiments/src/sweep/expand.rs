//! Expands a sweep file to its runs: every combination is named and checked before any work.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use super::error::SweepError;
use super::file::{Axis, Combination, Grid, SweepFile};
use super::models::ModelJob;
use super::training::{Agents, absolute_paths, check_aliases};
use mge_base::bounded;
use mge_base::json;
use mge_base::paths::fitting;
use mge_base::spelling::did_you_mean;
use mge_base::validation::ValidationError;
use mge_run::RunError;
use mge_trainer::{RunConfig, warnings};

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
}

impl Sweep {
    /// The [warnings] about its trainings.
    pub fn warnings(&self) -> Vec<String> {
        warnings(self.jobs.iter().filter_map(|job| match &job.work {
            Work::Train(config) => Some((&**config, &job.set)),
            Work::Dynamics(_) => None,
        }))
    }

    /// Reads a sweep file.
    ///
    /// # Errors
    /// As [`Sweep::parse`], and when the file cannot be read.
    pub fn load(path: &Path) -> Result<Self, SweepError> {
        let text = bounded::read(path, bounded::TEXT).map_err(RunError::io("read", path))?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Parses the text of a sweep file; `origin` names it in errors.
    ///
    /// # Errors
    /// At the first mistake, with its line or JSON path, and a suggestion for an unknown name.
    pub fn parse(text: &[u8], origin: &str) -> Result<Self, SweepError> {
        let file: SweepFile = json::parse(text, origin)?;
        let invalid = |problem: ValidationError| {
            let line = json::line_of(text, &problem.path).unwrap_or(1);
            SweepError::Invalid { origin: format!("{origin}:{line}"), problem }
        };
        file.check_size().map_err(invalid)?;
        let mut jobs: Vec<Job> = Vec::new();
        for (path, grid) in &file.grids {
            let wrong = |problem: ValidationError| invalid(if path == "." { problem } else { problem.within(path) });
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
            let problem = ValidationError::new(".", "is empty: give a `task` and other settings");
            return Err(SweepError::Invalid { origin: origin.to_owned(), problem });
        }
        Ok(Self { jobs })
    }
}

fn expand(grid: &Grid) -> Result<Vec<Job>, ValidationError> {
    let combinations = grid.combinations();
    let kind = grid.kind.as_ref().map_or("train", |kind| kind.as_str().unwrap_or(""));
    match kind {
        "train" => {
            check_aliases(grid)?;
            let mut agents = Agents::default();
            absolute_paths(grid).expand(&combinations, |grid, combination| {
                let config = agents.config(grid, combination)?;
                let prefix = format!("{}-{}", config.task.name, config.method);
                Ok((prefix, config.seed, Work::Train(Box::new(config))))
            })
        }
        "dynamics" => grid.expand(&combinations, |grid, combination| {
            let job = ModelJob::new(grid, combination)?;
            Ok((job.base_name(), job.training.seed, Work::Dynamics(Box::new(job))))
        }),
        _ => {
            let message = format!("must be `train` or `dynamics`{}", did_you_mean(["train", "dynamics"], kind));
            Err(ValidationError::new("kind", message))
        }
    }
}

impl Grid {
    /// A job for each combination; `make` returns the prefix of its name, its seed and its work.
    fn expand(
        &self,
        combinations: &[Combination],
        mut make: impl FnMut(&Self, &Combination) -> Result<(String, u64, Work), ValidationError>,
    ) -> Result<Vec<Job>, ValidationError> {
        let job = |combination: &Combination| {
            let (prefix, seed, work) = make(self, combination)?;
            let mut listed = String::new();
            for (axis, &value) in self.axes.iter().zip(combination) {
                if axis.is_list && !work.omits_from_name(&axis.key) {
                    listed += &format!("-{}", name_part(axis, value, &work));
                }
            }
            let name = fitting(&(prefix + &file_name(&listed)), &format!("-seed{seed}"));
            let set = self.axes.iter().map(|axis| super::training::setting(&axis.key).to_owned()).collect();
            Ok(Job { name, alone: self.alone(combination), work, set })
        };
        combinations.iter().map(job).collect()
    }
}

impl Work {
    /// Whether a setting is left out of the list in the job's name, because it is in the prefix or suffix or has no
    /// effect.
    fn omits_from_name(&self, key: &str) -> bool {
        match self {
            Self::Train(config) => super::training::is_omitted_from_name(config, key),
            Self::Dynamics(_) => ["tools", "seed"].contains(&key),
        }
    }
}

fn name_part(axis: &Axis, value: usize, work: &Work) -> String {
    let mut text = json::text(&axis.values[value]);
    if let Work::Train(config) = work
        && let Some(id) = super::training::file_behind(config, &axis.key, &text)
    {
        text = format!("{}-{}", id.name, id.digits());
    }
    match axis.key.as_str() {
        "epsilon" | "threshold" => text,
        key => format!("{key}_{text}"),
    }
}

/// Turns a text into part of a folder name that is valid on all systems.
fn file_name(text: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' };
    text.chars().map(allowed).collect()
}
