//! The paper's study: three sweeps in one folder, with a report.
//!
//! [`reproduce()`] trains the study's own dynamics models, counts how often guided and random play reach the stages of
//! the tasks, and trains the methods, the paper's from a fixed start and others from noisy starts too. Each of these is a
//! [`sweep`](mod@crate::sweep) of a file in `assets/sweeps/study`, so that an interrupted study continues, several machines
//! can share it, and for a finished one only the report is written again.

mod figures;
mod report;
#[cfg(test)]
mod tests;

use std::path::Path;

use serde_json::Value;

use crate::error::{ExperimentError, Result};
use crate::sweep::{self, Sweep};
use figures::write_figures;
use mge_base::atomic::Target;
use mge_base::json;
use mge_results::ReportFolder;
use mge_run::RunError;
use mge_stats::Bootstrap;
use mge_trainer::batch::{Batch, BatchProgress};
pub use report::Report;
use report::Results;

/// The files of a study's three sweeps.
#[derive(Debug, Clone)]
pub struct Study {
    /// Dynamics models.
    pub models: String,
    /// Counts of hits, with these models.
    pub hits: String,
    /// Trainings, with these models or the shipped ones.
    pub trainings: String,
}

/// The folder in which the files of a study expect its models, and the end of the name of each.
const FOLDER: &str = "study/";
const FIRST_SEED: &str = "-seed0/";

impl Study {
    /// The full study: ten seeds each of counts and trainings.
    pub fn full() -> Self {
        Self {
            models: include_str!("../../sweeps/study/models.json").to_owned(),
            hits: include_str!("../../sweeps/study/hits.json").to_owned(),
            trainings: include_str!("../../sweeps/study/trainings.json").to_owned(),
        }
    }

    /// The small study: the same pieces with few seeds, short trainings, and models trained for three fifths of the
    /// paper's epochs.
    pub fn quick() -> Self {
        Self {
            models: include_str!("../../sweeps/study-quick/models.json").to_owned(),
            hits: include_str!("../../sweeps/study-quick/hits.json").to_owned(),
            trainings: include_str!("../../sweeps/study-quick/trainings.json").to_owned(),
        }
    }
}

/// The sweep of a study's file, with its models in `folder`, and with seeds from `first` instead of 0 on.
fn moved(file: &str, folder: &Path, first: u64) -> Result<Sweep> {
    fn walk(key: &str, value: &mut Value, folder: &Path, first: u64) {
        match value {
            Value::Object(entries) => entries.iter_mut().for_each(|(key, value)| walk(key, value, folder, first)),
            Value::Array(values) => values.iter_mut().for_each(|value| walk(key, value, folder, first)),
            Value::Number(seed) if ["seed", "build"].contains(&key) => {
                *value = seed.as_u64().map(|seed| seed.saturating_add(first)).into();
            }
            Value::String(path) if key == "model" => {
                if let Some(inner) = path.strip_prefix(FOLDER) {
                    let inner = inner.replace(FIRST_SEED, &format!("-seed{first}/"));
                    *path = folder.join(inner).display().to_string();
                }
            }
            _ => {}
        }
    }
    let mut file: Value = json::parse(file.as_bytes(), "study")?;
    walk("", &mut file, folder, first);
    Sweep::parse(file.to_string().as_bytes(), "study")
}

/// Runs a study in `folder` with seeds from `seed` on, or the missing parts of it. `command` reproduces it; figures have
/// `dpi` dots per inch.
///
/// # Errors
/// The first failure; what is finished is kept, and the next call continues.
pub fn reproduce(
    study: &Study,
    seed: u64,
    folder: impl Into<Target>,
    command: &str,
    dpi: u32,
    batch: &mut Batch<'_>,
) -> Result<Report> {
    let folder = folder.into();
    let to = ReportFolder::new(folder.clone())?;
    let place = std::path::absolute(&folder.path).map_err(RunError::io("find", &folder.path))?;
    let Batch { threads, interrupt, on_progress: all } = batch;
    let mut part = |number: u32, name: &str, file: &str, folder: Target| {
        let sweep = moved(file, &place, seed)?;
        sweep::check_results(&folder)?;
        let on_progress = &mut |now: &BatchProgress<'_>| {
            let message = match now.message {
                "" => format!("part {number} of 3, {name}: {} of {} done", now.ended - now.failed, now.jobs),
                message => format!("part {number} of 3, {name}: {message}"),
            };
            all(&BatchProgress { message: &message, ..*now });
        };
        let failures = sweep::run(&sweep, &folder.path, &mut Batch { threads: *threads, interrupt, on_progress })?;
        sweep::no_failure(&sweep, &failures)?;
        sweep::write_results(&folder)?;
        Ok::<_, ExperimentError>(sweep)
    };
    let models = part(1, "models", &study.models, folder.join("models"))?;
    let hits = part(2, "hits", &study.hits, folder.join("hits"))?;
    let trainings = part(3, "trainings", &study.trainings, folder.clone())?;
    let results = Results::read(&folder.path, &models, &hits, &trainings)?;
    let bootstrap = Bootstrap::default();
    let (report, means) = (results.report(), Results::means(&folder.path, &models, &hits, &bootstrap)?);
    let (_alone, figures) = (to.hold()?, to.figures()?);
    write_figures(&results, &report, &means.hits, &figures, command, dpi, batch.interrupt)?;
    to.write(&report, &report.to_markdown(&means, &bootstrap, command)?)?;
    Ok(report)
}
