//! Methods on generated puzzles: proposes subgoals for each puzzle, then writes a sweep over all of them.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::error::{PuzzleError, finished};
use super::index::Index;
use crate::batch::{Batch, BatchProgress, Job, JobHandle};
use crate::dynamics::DynamicsError;
use crate::guidance::{GuidanceConfig, InterruptibleModel, choose_subgoals};
use crate::task;
use crate::trainer::{Method, PriorSource, rollout_model};

/// Name of the bench's sweep in its folder.
const SWEEP: &str = "sweep.json";

/// The methods, puzzles and settings of a bench.
#[derive(Debug, Clone)]
pub struct BenchPlan {
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

/// Writes the puzzles with proposed subgoals to `out/tasks`, except existing ones, and the
/// [sweep](crate::sweep) over them to `out/sweep.json`, whose path is returned.
///
/// # Errors
/// When the model cannot predict a puzzle, or a file cannot be read or written;
/// [`PuzzleError::Interrupted`].
pub fn prepare(
    plan: &BenchPlan,
    index: &Index,
    out: &Path,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<PathBuf, PuzzleError> {
    let tasks = out.join("tasks");
    std::fs::create_dir_all(&tasks).map_err(PuzzleError::io(&tasks))?;
    let file = |folder: &Path, name: &str| folder.join(format!("{name}.json"));
    let job =
        |name: &String| Proposal { plan, name: name.clone(), from: file(&plan.puzzles, name), to: file(&tasks, name) };
    let names: Vec<String> = index.puzzles.iter().map(|puzzle| puzzle.name.clone()).collect();
    let missing = names.iter().map(job).filter(|proposal| !proposal.to.exists());
    let jobs: Vec<_> = missing.map(Proposal::job).collect();
    let (_, interrupted) = finished(batch.run(&jobs, on_progress)?)?;
    if interrupted > 0 {
        return Err(PuzzleError::Interrupted { done: jobs.len() - interrupted, jobs: jobs.len() });
    }
    let mut sweep = Map::new();
    sweep.insert("task".into(), names.iter().map(|name| file(&tasks, name).display().to_string()).collect());
    sweep.insert("method".into(), plan.methods.iter().map(|method| method.name()).collect());
    sweep.insert("seed".into(), (0..plan.seeds).collect());
    sweep.insert("episodes".into(), json!(plan.episodes));
    sweep.insert("model".into(), Value::String(plan.model.clone().into()));
    sweep.extend(plan.settings.iter().map(|(key, value)| (key.clone(), Value::String(value.clone()))));
    let path = out.join(SWEEP);
    let text = format!("{:#}\n", Value::Object(sweep));
    crate::atomic::write(&path, text.as_bytes()).map_err(PuzzleError::io(&path))?;
    Ok(path)
}

/// The job that proposes subgoals for one puzzle.
struct Proposal<'a> {
    plan: &'a BenchPlan,
    name: String,
    from: PathBuf,
    to: PathBuf,
}

impl<'a> Proposal<'a> {
    fn job(self) -> Job<'a, (), PuzzleError> {
        Job::new(self.name.clone(), 1, move |handle| self.propose(handle))
    }

    fn propose(&self, handle: &JobHandle) -> Result<Option<()>, PuzzleError> {
        handle.report(format!("subgoals of {}", self.name));
        let mut puzzle = task::load(&self.from.display().to_string())?;
        // The uniform source has no model to propose subgoals with.
        if let Some((model, _)) = rollout_model(&self.plan.model, &puzzle)? {
            let config = GuidanceConfig::default();
            let model = InterruptibleModel::new(&*model, handle.stop());
            puzzle.subgoals = match choose_subgoals(&puzzle, &model, self.plan.subgoals, &config, 0, |_| ()) {
                Err(DynamicsError::Stopped) => return Ok(None),
                found => found?.subgoals,
            };
        }
        task::save(&puzzle, &self.to)?;
        Ok(Some(()))
    }
}
