//! Methods on generated puzzles: proposes subgoals for each puzzle, then writes a sweep over all of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::index::{Index, Puzzle};
use crate::error::{ExperimentError, Result, finished};
use mge_base::atomic::{Format, Target};
use mge_guidance::{GuidanceConfig, choose_subgoals};
use mge_run::RunError;
use mge_task as task;
use mge_trainer::batch::{Batch, Job, JobHandle};
use mge_trainer::{Method, PriorSource, RunConfig, rollout_model};

/// Name of the bench's sweep in its folder.
const SWEEP: &str = "sweep.json";

/// The format of such sweeps: their tasks are in the folder `tasks` of a bench.
const FORMAT: Format<'static> = Format { name: "the sweep of a bench", is: &is_of_a_bench };

fn is_of_a_bench(found: &[u8]) -> bool {
    let sweep: Option<Map<String, Value>> = serde_json::from_slice(found).ok();
    let tasks = sweep.as_ref().and_then(|sweep| sweep.get("task")?.as_array());
    let is_in_tasks = |task: &Value| {
        let folder = task.as_str().and_then(|path| Path::new(path).parent()?.file_name());
        folder.is_some_and(|folder| folder == "tasks")
    };
    tasks.is_some_and(|tasks| tasks.iter().all(is_in_tasks))
        && sweep.is_some_and(|sweep| ["method", "seed", "episodes", "model"].iter().all(|key| sweep.contains_key(*key)))
}

/// The search for subgoals of puzzles, and the trainings on them.
#[derive(Debug, Clone)]
pub struct Bench {
    /// The folder of the puzzles.
    pub puzzles: PathBuf,
    /// The model that predicts the rollouts for subgoals and clusters.
    pub model: PriorSource,
    /// Maximum number of subgoals proposed for a puzzle.
    pub subgoals: usize,
    /// The methods.
    pub methods: Vec<Method>,
    /// Number of episodes of a training.
    pub episodes: u32,
    /// Number of trainings of a method on a puzzle, with seeds 0 to `seeds - 1`.
    pub seeds: u64,
    /// Other settings of all trainings, by JSON path.
    pub settings: Vec<(String, String)>,
}

impl Bench {
    /// The [sweep](crate::sweep) over the tasks in these files.
    ///
    /// # Errors
    /// When a setting is also an option.
    pub fn sweep(&self, tasks: &[PathBuf]) -> Result<String> {
        let of_option = |key: &str| ["task", "method", "seed", "episodes", "model", "prior"].contains(&key);
        if let Some((key, _)) = self.settings.iter().find(|(key, _)| of_option(key)) {
            return Err(ExperimentError::Refused(format!(
                "--set {key}=...: tasks, methods, seeds, episodes and model of a bench have options of their own"
            )));
        }
        let mut sweep = Map::new();
        sweep.insert("task".into(), tasks.iter().map(|task| task.display().to_string()).collect());
        sweep.insert("method".into(), self.methods.iter().map(|method| method.name()).collect());
        sweep.insert("seed".into(), (0..self.seeds).collect());
        sweep.insert("episodes".into(), json!(self.episodes));
        sweep.insert("model".into(), Value::String(self.model.clone().into()));
        sweep.extend(self.settings.iter().map(|(key, value)| (key.clone(), Value::String(value.clone()))));
        Ok(format!("{:#}\n", Value::Object(sweep)))
    }

    /// Writes the puzzles with proposed subgoals to `out/tasks`, except existing ones, and the
    /// [sweep](crate::sweep) over them to `out/sweep.json`, whose path and text are returned.
    ///
    /// # Errors
    /// When the model cannot predict a puzzle, or a file cannot be read or written;
    /// [`ExperimentError::Interrupted`].
    pub fn prepare(&self, index: &Index, out: &Target, batch: &mut Batch<'_>) -> Result<(PathBuf, String)> {
        let sweep = out.join(SWEEP);
        sweep.check(&FORMAT).map_err(RunError::io("write", &sweep.path))?;
        let tasks = out.path.join("tasks");
        std::fs::create_dir_all(&tasks).map_err(RunError::io("create", &tasks))?;
        let missing = index.puzzles.iter().filter(|puzzle| !puzzle.path(&tasks).exists());
        let jobs = missing.map(|puzzle| self.proposal(puzzle, &tasks));
        let jobs: Vec<Job<'_, (), ExperimentError>> = jobs.collect();
        finished(batch.run(&jobs)?)?.1?;
        let text = self.sweep(&index.puzzles.iter().map(|puzzle| puzzle.path(&tasks)).collect::<Vec<_>>())?;
        sweep.write(text.as_bytes(), &FORMAT).map_err(RunError::io("write", &sweep.path))?;
        Ok((sweep.path, text))
    }

    /// The job that writes a puzzle with proposed subgoals into the folder of tasks.
    fn proposal<'a>(&'a self, puzzle: &'a Puzzle, tasks: &'a Path) -> Job<'a, (), ExperimentError> {
        Job::new(&puzzle.name, 1, move |handle| self.propose(puzzle, tasks, handle).map(Some))
    }

    fn propose(&self, puzzle: &Puzzle, tasks: &Path, handle: &JobHandle) -> Result<()> {
        handle.report(format!("subgoals of {}", puzzle.name));
        let mut task = task::load(&puzzle.path(&self.puzzles).display().to_string())?;
        let run = RunConfig { prior: self.model.clone(), ..RunConfig::new(Arc::new(task.clone())) };
        // The uniform source has no model to propose subgoals with.
        if let Some(model) = rollout_model(&run.prior, &run, |_| (), handle.stop())? {
            let config = GuidanceConfig::default();
            let chosen = choose_subgoals(&task, &*model, self.subgoals, &config, 0, handle.stop(), |_| ())?;
            // A run trains another model, with its own seed.
            let launches = if run.prior == PriorSource::default() { run.launches() } else { 0 };
            task = task.with_subgoals(chosen.subgoals);
            task.search_actions = chosen.actions as u64 + launches;
        }
        Ok(task::save(&task, &puzzle.path(tasks))?)
    }
}
