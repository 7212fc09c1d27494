//! The whole study of the paper, into one folder.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::batch::train_to_end;
use super::figures::{
    hits as hits_figure, launches, learning_curves, method_scores, performance_profile, relative_frames,
};
use super::folder::Folder;
use super::hits::{ActorNoise, Guided, Hits, count_hits};
use super::learning::{FINAL, Learning, LearningRow, TrainedRun};
use super::plan::{PlannedRun, StudyPlan};
use super::report::{HitsRow, ModelRow, Report, mean_errors};
use crate::agent::{ConfigError, DdpgConfig};
use crate::dynamics::{DynamicsError, Ended, Evaluation, Model, Training, Variant, evaluate, tool_set_name};
use crate::figures::{ActionSamples, Figure, FigureError, Provenance, TaskActions, TaskGrid};
use crate::guidance::{ActionPrior, GuidanceError, propose_subgoals};
use crate::physics::ToolKind;
use crate::run::{RunDirectory, RunError, RunHistory, config_hash};
use crate::stats::{Bootstrap, StatsError};
use crate::task::Task;
use crate::trainer::{
    PriorError, PriorSource, RunConfig, SettingError, TrainerError, Watch, build_prior, rollout_model,
};

/// Why a study could not be finished. What it has done so far stays.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The folder holds another study.
    #[error("{}: this folder holds a study with other numbers: choose another with --out", path.display())]
    OtherStudy { path: PathBuf },
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// A file is not what it should be.
    #[error("{}: {message}: remove it, and the study makes it again", path.display())]
    Content { path: PathBuf, message: String },
    /// A dynamics model.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// A model's training diverged.
    #[error("the training of the {tools} model diverged in epoch {epoch}: {reason}")]
    Diverged { tools: String, epoch: u32, reason: String },
    /// An action prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A saved action prior.
    #[error(transparent)]
    Guidance(#[from] GuidanceError),
    /// The untrained agent.
    #[error(transparent)]
    Agent(#[from] ConfigError),
    /// A run's files.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A setting of a method.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A run of the study has other settings.
    #[error("{}: this run has other settings than the study: remove it, or choose another folder with --out", path.display())]
    OtherRun { path: PathBuf },
    /// A training.
    #[error("{run}: {source}")]
    Training { run: String, source: Box<TrainerError> },
    /// There is nothing to report yet.
    #[error("none of the {runs} runs is finished: go on with them, such as with `mge resume`")]
    NothingFinished { runs: usize },
    /// A statistic.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// Threads.
    #[error("cannot start a thread: {0}")]
    Threads(rayon::ThreadPoolBuildError),
}

/// How far a study is.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyProgress {
    /// Pieces of work done.
    pub done: u64,
    /// Pieces in all, weighted by how long they take.
    pub total: u64,
    /// What is being done.
    pub message: String,
}

/// Seconds one core takes for the pieces of a study, roughly: weights of progress.
const SECONDS_PER_EPOCH: f64 = 0.03;
const SECONDS_PER_PRIOR: f64 = 2.0;
const SECONDS_PER_EPISODE: f64 = 0.008;

/// Does the study of `plan` in `folder`, or what is missing of it, on all threads of
/// the current rayon pool. `command` is what makes it again; figures have `dpi` dots per
/// inch; `tell` hears of progress, from any thread.
///
/// # Errors
/// At the first piece that fails; what is done stays, and the next call goes on.
pub fn reproduce(
    plan: &StudyPlan,
    folder: &Path,
    command: &str,
    dpi: u32,
    tell: &(dyn Fn(&StudyProgress) + Sync),
) -> Result<Report, StudyError> {
    let folder = Folder(folder);
    folder.claim(&plan.foundation(), &["models", "priors", "hits", "subgoals", "runs", "figures"])?;
    let runs = plan.runs()?;
    let total = total_work(plan, &runs);
    let study = Study { plan, folder, command, dpi, tell, done: AtomicU64::new(0), total };
    let models = study.models()?;
    let priors = study.priors()?;
    let hits = study.hits(&priors)?;
    let runs = study.learning(runs)?;
    let learning = runs.iter().map(|run| run.row.clone()).collect();
    let report = Report { version: Report::VERSION, hits, learning, models };
    study.figures(&report, &priors, &runs)?;
    folder.write_json("report.json", &report)?;
    let text = report.to_markdown(plan, command)?;
    folder.write("report.md", text.as_bytes())?;
    Ok(report)
}

fn total_work(plan: &StudyPlan, runs: &[PlannedRun]) -> u64 {
    let models = plan.tool_sets().iter().map(|tools| model_work(plan, tools)).sum::<u64>();
    let priors = plan.tasks.len() as u64 * plan.builds * work(SECONDS_PER_PRIOR);
    let ablated = plan.ablations().len() as u64 * models;
    models + ablated + priors + runs.iter().map(|run| run_work(&run.config)).sum::<u64>()
}

fn model_work(plan: &StudyPlan, tools: &[ToolKind]) -> u64 {
    work(SECONDS_PER_EPOCH * f64::from(plan.model_training.epochs) * tools.len() as f64 / 2.0)
}

fn run_work(config: &RunConfig) -> u64 {
    work(SECONDS_PER_EPISODE * f64::from(config.episodes))
}

/// Milliseconds of work.
fn work(seconds: f64) -> u64 {
    (1000.0 * seconds) as u64
}

struct Study<'a> {
    plan: &'a StudyPlan,
    folder: Folder<'a>,
    command: &'a str,
    dpi: u32,
    tell: &'a (dyn Fn(&StudyProgress) + Sync),
    done: AtomicU64,
    total: u64,
}

/// A prior for hit counts.
type TaskPrior = (Arc<Task>, Arc<ActionPrior>);

impl Study<'_> {
    fn advance(&self, work: u64, message: String) {
        let done = self.done.fetch_add(work, Ordering::Relaxed) + work;
        (self.tell)(&StudyProgress { done, total: self.total, message });
    }

    fn model_path(&self, tools: &[ToolKind], variant: Variant) -> PathBuf {
        self.folder.path(&format!("models/{}.safetensors", model_name(tools, variant)))
    }

    /// Trains and evaluates the dynamics models of each tool set, the ablated ones last.
    fn models(&self) -> Result<Vec<ModelRow>, StudyError> {
        let variants = std::iter::once(Variant::Full).chain(self.plan.ablations());
        let models: Vec<(Variant, Vec<ToolKind>)> =
            variants.flat_map(|variant| self.plan.tool_sets().into_iter().map(move |tools| (variant, tools))).collect();
        models.into_par_iter().map(|(variant, tools)| self.model(&tools, variant)).collect()
    }

    fn model(&self, tools: &[ToolKind], variant: Variant) -> Result<ModelRow, StudyError> {
        let path = self.model_path(tools, variant);
        let name = model_name(tools, variant);
        let whole = model_work(self.plan, tools);
        let model = if path.exists() {
            self.advance(whole, format!("{name} model is there"));
            Model::load(&path)?
        } else {
            let model = self.train_model(tools, variant, whole)?;
            model.save(&path)?;
            model
        };
        let evaluation: Evaluation = self.folder.cached(&format!("models/{name}.json"), || {
            Ok(evaluate(&model, &self.plan.tasks, &self.plan.model_evaluation)?)
        })?;
        Ok(model_row(&evaluation, variant))
    }

    fn train_model(&self, tools: &[ToolKind], variant: Variant, whole: u64) -> Result<Model, StudyError> {
        let name = model_name(tools, variant);
        let (config, settings) = (variant.apply(self.plan.model.clone()), self.plan.model_training.clone());
        let mut training = Training::new(config, settings, tools, self.command)?;
        let mut told = 0;
        let ended = training.run(|_, now| {
            let until_now = whole * u64::from(now.epoch) / u64::from(now.epochs);
            if until_now > told + whole / 100 || now.epoch == now.epochs {
                self.advance(until_now - told, format!("{name} model, epoch {}, loss {:.4}", now.epoch, now.loss));
                told = until_now;
            }
            true
        });
        match ended {
            Ended::Diverged { epoch, reason } => Err(StudyError::Diverged { tools: name, epoch, reason }),
            Ended::Done | Ended::Stopped => Ok(training.model().clone()),
        }
    }

    /// The action priors of the hit counts: several builds for each task.
    fn priors(&self) -> Result<Vec<TaskPrior>, StudyError> {
        let tasks = self.plan.tasks.iter().map(|task| Arc::new(task.clone()));
        let builds: Vec<(Arc<Task>, u64)> =
            tasks.flat_map(|task| (0..self.plan.builds).map(move |build| (task.clone(), build))).collect();
        builds
            .into_par_iter()
            .map(|(task, build)| {
                let mut config = RunConfig::new(task.clone());
                config.prior =
                    PriorSource::ModelFile(self.model_path(&task.tool_set(), Variant::Full).display().to_string());
                config.seed = self.plan.seed + build;
                let name = format!("priors/{}-{}.json", task.name, config.seed);
                let prior: ActionPrior = self.folder.cached(&name, || {
                    // The build is never asked to stop.
                    Ok(build_prior(&config, |_| true)?.unwrap_or_else(|| ActionPrior::uniform(&task, config.seed)))
                })?;
                self.advance(work(SECONDS_PER_PRIOR), format!("clusters of {}", task.name));
                Ok((task, Arc::new(prior)))
            })
            .collect()
    }

    /// Figure 5's counts: guided play, seeds spread over the builds, and random play.
    fn hits(&self, priors: &[TaskPrior]) -> Result<Vec<HitsRow>, StudyError> {
        let mut counts: Vec<(Arc<Task>, Option<Arc<ActionPrior>>, u64)> = Vec::new();
        for task in &self.plan.tasks {
            let own: Vec<&TaskPrior> = priors.iter().filter(|(of, _)| **of == *task).collect();
            for n in 0..self.plan.hit_seeds {
                let (task, prior) = own[n as usize % own.len()];
                counts.push((task.clone(), Some(prior.clone()), self.plan.seed + n));
                counts.push((task.clone(), None, self.plan.seed + n));
            }
        }
        counts.into_par_iter().map(|(task, prior, seed)| self.count(&task, prior.as_deref(), seed)).collect()
    }

    fn count(&self, task: &Arc<Task>, prior: Option<&ActionPrior>, seed: u64) -> Result<HitsRow, StudyError> {
        let policy = if prior.is_some() { "guided" } else { "random" };
        let hits: Hits = self.folder.cached(&format!("hits/{}-{policy}-{seed}.json", task.name), || {
            Ok(match prior {
                Some(prior) => count_hits(task, &mut Guided(prior), self.plan.hit_episodes, seed),
                None => {
                    let mut rng = ChaCha8Rng::seed_from_u64(seed);
                    let mut actor = ActorNoise::untrained(task, &DdpgConfig::default(), &mut rng)?;
                    count_hits(task, &mut actor, self.plan.hit_episodes, seed)
                }
            })
        })?;
        Ok(HitsRow {
            task: task.name.clone(),
            policy: policy.to_owned(),
            seed,
            episodes: hits.episodes,
            goal: hits.goal,
            subgoals: hits.subgoals,
        })
    }

    /// Figure 6's trainings, each a run of its own.
    fn learning(&self, runs: Vec<PlannedRun>) -> Result<Vec<TrainedRun>, StudyError> {
        let failed: Mutex<Option<StudyError>> = Mutex::new(None);
        // A bridge hands the runs out in their order, so that the first seeds are done first.
        let mut done: Vec<(usize, TrainedRun)> = runs
            .into_iter()
            .enumerate()
            .par_bridge()
            .filter_map(|(index, run)| match self.train(run) {
                Ok(done) => Some((index, done)),
                // One failed training does not stop the others.
                Err(error) => {
                    failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    None
                }
            })
            .collect();
        done.sort_by_key(|(index, _)| *index);
        match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(done.into_iter().map(|(_, run)| run).collect()),
        }
    }

    fn train(&self, run: PlannedRun) -> Result<TrainedRun, StudyError> {
        let PlannedRun { mut config, model, proposed_subgoals, differences } = run;
        config.prior = PriorSource::ModelFile(self.model_path(&config.task.tool_set(), model).display().to_string());
        if proposed_subgoals {
            config.task = self.with_proposed_subgoals(&config)?;
        }
        let parts = [config.method.name().to_owned(), config.epsilon.to_string().replace(':', "_")];
        let parts = parts.into_iter().chain(differences.iter().map(|(key, value)| format!("{key}_{value}")));
        let arm = parts.collect::<Vec<_>>().join("-").replace(' ', "_");
        let name = format!("{}-{arm}-{}", config.task.name, config.seed);
        let path = self.folder.path("runs").join(&name);
        check_run(&path, &config)?;
        let directory = train_to_end(&path, &config, &Watch::default())
            .map_err(|source| StudyError::Training { run: name.clone(), source: Box::new(source) })?;
        self.advance(run_work(&config), name);
        let mut trained = TrainedRun::new(&config, &RunHistory::read(&directory)?);
        trained.row.settings = differences;
        Ok(trained)
    }

    /// The task of a run with as many subgoals as it has, proposed from its dynamics model.
    fn with_proposed_subgoals(&self, config: &RunConfig) -> Result<Arc<Task>, StudyError> {
        let RunConfig { task, seed, .. } = config;
        let subgoals = self.folder.cached(&format!("subgoals/{}-{seed}.json", task.name), || {
            let found = rollout_model(&config.prior, task)?;
            // Only uniform actions have no model.
            Ok(found.map_or_else(Vec::new, |(model, _)| {
                propose_subgoals(task, &*model, task.subgoals.len(), &config.guidance, *seed, |_| true)
            }))
        })?;
        Ok(Arc::new(Task { subgoals, ..(**task).clone() }))
    }

    fn figures(&self, report: &Report, priors: &[TaskPrior], runs: &[TrainedRun]) -> Result<(), StudyError> {
        let plan = self.plan;
        let bootstrap = Bootstrap { resamples: plan.resamples, ..Bootstrap::default() };
        let first_prior = |task: &Task| priors.iter().find(|(of, _)| **of == *task).map(|(_, prior)| prior.clone());
        self.figure("figure1", &launches(plan))?;
        if let Some(task) = plan.tasks.first()
            && let Some(prior) = first_prior(task)
        {
            self.figure("figure2", &relative_frames(task, &prior, plan.model.cutoff, plan.seed))?;
        }
        self.figure("figure3", &TaskGrid { tasks: plan.tasks.clone() })?;
        let sampled =
            plan.tasks.iter().filter_map(|task| Some(TaskActions::sample(task, &*first_prior(task)?, plan.seed)));
        self.figure("figure4", &ActionSamples { tasks: sampled.collect() })?;
        self.figure("figure5", &hits_figure(report, plan, &bootstrap)?)?;
        let of_paper: Vec<TrainedRun> = runs.iter().filter(|run| plan.is_of_paper(&run.row)).cloned().collect();
        self.figure("figure6", &learning_curves(&of_paper, &bootstrap, false)?)?;
        self.figure("figure6-greedy", &learning_curves(&of_paper, &bootstrap, true)?)?;
        let of_paper: Vec<LearningRow> = of_paper.into_iter().map(|run| run.row).collect();
        let finals = Learning(&of_paper).common_scores(FINAL)?;
        self.figure("performance-profile", &performance_profile(&finals, &bootstrap)?)?;
        self.figure("methods", &method_scores(&report.learning, &bootstrap)?)
    }

    fn figure(&self, name: &str, figure: &impl Figure) -> Result<(), StudyError> {
        let seeds: Vec<u64> = (self.plan.seed..self.plan.seed + self.plan.hit_seeds).collect();
        let provenance = Provenance::new(self.command, &seeds, config_hash(self.plan)?);
        Ok(figure.write_all(&self.folder.path("figures"), name, &provenance, self.dpi)?)
    }
}

/// A run that is there with other settings, as of another version of the program, is no part of
/// the study. The path of its model may be written differently.
fn check_run(path: &Path, config: &RunConfig) -> Result<(), StudyError> {
    let Ok(found) = RunDirectory::open(path).and_then(|directory| directory.config::<RunConfig>()) else {
        // What cannot be read, the training itself will tell of.
        return Ok(());
    };
    if (RunConfig { prior: config.prior.clone(), ..found }) == *config {
        return Ok(());
    }
    Err(StudyError::OtherRun { path: path.to_owned() })
}

/// File stem of a model.
fn model_name(tools: &[ToolKind], variant: Variant) -> String {
    match variant {
        Variant::Full => tool_set_name(tools),
        ablated => format!("{}-{}", tool_set_name(tools), ablated.name()),
    }
}

fn model_row(evaluation: &Evaluation, variant: Variant) -> ModelRow {
    let (one_step_error, rollout_error) = mean_errors(evaluation);
    ModelRow {
        structure: variant.label().to_owned(),
        tools: evaluation.launches.iter().map(|tool| tool.tool.to_string()).collect(),
        one_step_error,
        rollout_error,
    }
}
