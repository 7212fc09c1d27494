//! The whole study, in one folder: the paper's figures, and trainings from noisy starts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::StudyError;
use super::figures::{hits as hits_figure, launches, relative_frames};
use super::folder::Folder;
use super::hits::{ActorNoise, Guided, count_hits};
use super::plan::{Part, PlannedRun, StudyPlan};
use super::report::{HitRow, ModelRow, Report};
use mge_agent::DdpgConfig;
use mge_base::atomic::Target;
use mge_base::stop::Stop;
use mge_dynamics::{Evaluation, Model, Progress, TrainingOutcome, Variant, evaluate, tool_set_name, train_to_file};
use mge_figures::{ActionSamples, Figure, Provenance, TaskActions, TaskGrid};
use mge_guidance::{ActionPrior, InterruptibleModel, propose_subgoals};
use mge_physics::ToolKind;
use mge_results::figures::{Success, learning_curves, method_scores, performance_profile, step_curves};
use mge_results::{FINAL, FoundRun, Groups, LearningRow, Settings, TrainedRun, read_runs};
use mge_run::{RunDirectory, config_hash};
use mge_task::Task;
use mge_trainer::batch::{self, Batch, BatchProgress, Job, JobHandle, train_to_end};
use mge_trainer::{ModelFile, PriorSource, RunConfig, build_prior, rollout_model};

/// Weights of progress: the approximate cost of the other pieces of a study, in training episodes.
const EPISODES_PER_EPOCH: f64 = 4.0;
const EPISODES_PER_PRIOR: u64 = 250;
const COUNTED_EPISODES_PER_EPISODE: u64 = 8;

/// Runs the study of `plan` in `folder`, or the missing parts of it. `command` reproduces it; figures
/// have `dpi` dots per inch.
///
/// # Errors
/// The first failure; completed parts are kept, and the next call continues.
pub fn reproduce(
    plan: &StudyPlan,
    folder: impl Into<Target>,
    command: &str,
    dpi: u32,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Report, StudyError> {
    let folder = folder.into();
    let folder = Folder(&folder);
    folder.claim(&plan.foundation(), &["models", "priors", "hits", "subgoals", "runs", "figures"], "report.md")?;
    let study = Study { plan, folder, command, dpi, interrupt: batch.interrupt };
    let jobs = study.jobs()?;
    let mut progress = StudyProgress { total: jobs.work(), done: 0, on_progress };
    let models = progress.run(batch, &jobs.models)?;
    let priors = progress.run(batch, &jobs.priors)?;
    let hits = progress.run(batch, &study.counts(&priors))?;
    progress.run(batch, &jobs.runs)?;
    let trained = study.trained()?;
    let rows = |is_shown: fn(Part) -> bool| trained.of(is_shown).into_iter().map(|run| run.row).collect();
    let (learning, noisy_starts) = (rows(|part| part != Part::NoisyStarts), rows(|part| part == Part::NoisyStarts));
    let report = Report { version: Report::VERSION, hits, learning, noisy_starts, models };
    study.figures(&report, &priors, &trained)?;
    folder.write_json("report.json", &report)?;
    let text = report.to_markdown(plan, command)?;
    folder.write_report("report.md", &text)?;
    Ok(report)
}

type StudyJob<'a, T> = Job<'a, T, StudyError>;

/// The total size of some jobs.
fn work_of<T>(jobs: &[StudyJob<'_, T>]) -> u64 {
    jobs.iter().map(|job| job.size).sum()
}

/// Combines the progress of consecutive batches into that of the whole study.
struct StudyProgress<'a> {
    done: u64,
    total: u64,
    on_progress: &'a mut dyn FnMut(&BatchProgress<'_>),
}

impl StudyProgress<'_> {
    fn run<T: Send>(&mut self, batch: &Batch<'_>, jobs: &[StudyJob<'_, T>]) -> Result<Vec<T>, StudyError> {
        let outcomes = batch.run(jobs, &mut |now| {
            (self.on_progress)(&BatchProgress { done: self.done + now.done, total: self.total, ..*now });
        })?;
        self.done += work_of(jobs);
        Ok(batch::all(outcomes)?)
    }
}

#[derive(Clone, Copy)]
struct Study<'a> {
    plan: &'a StudyPlan,
    folder: Folder<'a>,
    command: &'a str,
    dpi: u32,
    interrupt: &'a Stop,
}

/// The jobs of a study that can be created from its plan alone. Each kind needs the files written by the
/// kinds before it.
struct Jobs<'a> {
    models: Vec<StudyJob<'a, ModelRow>>,
    priors: Vec<StudyJob<'a, TaskPrior>>,
    runs: Vec<StudyJob<'a, ()>>,
    counts: u64,
}

impl Jobs<'_> {
    fn work(&self) -> u64 {
        work_of(&self.models) + work_of(&self.priors) + self.counts + work_of(&self.runs)
    }
}

/// The results of all trainings.
struct Trained(Vec<(Part, TrainedRun)>);

impl Trained {
    /// Those of some parts.
    fn of(&self, is_shown: fn(Part) -> bool) -> Vec<TrainedRun> {
        self.0.iter().filter(|(part, _)| is_shown(*part)).map(|(_, run)| run.clone()).collect()
    }
}

/// A prior for hit counts.
type TaskPrior = (Arc<Task>, Arc<ActionPrior>);

impl<'a> Study<'a> {
    fn jobs(self) -> Result<Jobs<'a>, StudyError> {
        let plan = self.plan;
        let variants = std::iter::once(Variant::Full).chain(plan.ablations());
        let models =
            variants.flat_map(|variant| plan.tool_sets().into_iter().map(move |tools| self.model_job(tools, variant)));
        let tasks = plan.tasks.iter().map(|task| Arc::new(task.clone()));
        let priors =
            tasks.flat_map(|task| (0..plan.builds).map(move |build| self.prior_job(task.clone(), plan.seed + build)));
        let counts = 2 * plan.tasks.len() as u64 * plan.hit_seeds * self.count_work();
        let runs = plan.runs()?.into_iter().map(|run| self.run_job(run));
        Ok(Jobs { models: models.collect(), priors: priors.collect(), runs: runs.collect(), counts })
    }

    fn count_work(self) -> u64 {
        u64::from(self.plan.hit_episodes) / COUNTED_EPISODES_PER_EPISODE
    }

    /// The counts of figure 5: guided play, with the seeds distributed over the cluster builds, and random play.
    fn counts(self, priors: &[TaskPrior]) -> Vec<StudyJob<'a, HitRow>> {
        let mut counts = Vec::new();
        for task in &self.plan.tasks {
            let own: Vec<&TaskPrior> = priors.iter().filter(|(of, _)| **of == *task).collect();
            for n in 0..self.plan.hit_seeds {
                let (task, prior) = own[n as usize % own.len()];
                let count = |prior| self.count_job(task.clone(), prior, self.plan.seed + n);
                counts.extend([count(Some(prior.clone())), count(None)]);
            }
        }
        counts
    }

    fn model_path(self, tools: &[ToolKind], variant: Variant) -> PathBuf {
        self.folder.path(&format!("models/{}.safetensors", model_name(tools, variant)))
    }

    fn figures(self, report: &Report, priors: &[TaskPrior], trained: &Trained) -> Result<(), StudyError> {
        let plan = self.plan;
        let (bootstrap, trainings) = (plan.bootstrap(), plan.learning_seeds);
        let first_prior = |task: &Task| priors.iter().find(|(of, _)| **of == *task).map(|(_, prior)| prior.clone());
        self.figure("figure1", 1, &launches(plan, self.interrupt)?)?;
        if let Some(task) = plan.tasks.first()
            && let Some(prior) = first_prior(task)
        {
            self.figure("figure2", 1, &relative_frames(task, &prior, plan.model.cutoff, plan.seed))?;
        }
        self.figure("figure3", 1, &TaskGrid { tasks: plan.tasks.clone() })?;
        let sampled =
            plan.tasks.iter().filter_map(|task| Some(TaskActions::sample(task, &*first_prior(task)?, plan.seed)));
        self.figure("figure4", 1, &ActionSamples { tasks: sampled.collect() })?;
        self.figure("figure5", plan.hit_seeds, &hits_figure(report, plan, &bootstrap)?)?;
        let of_paper = trained.of(|part| part == Part::Paper);
        self.figure("figure6", trainings, &learning_curves(&of_paper, &bootstrap, Success::Training)?)?;
        self.figure("figure6-greedy", trainings, &learning_curves(&of_paper, &bootstrap, Success::Greedy)?)?;
        let of_paper: Vec<LearningRow> = of_paper.into_iter().map(|run| run.row).collect();
        let finals = Groups::new(&of_paper).common_scores(FINAL)?;
        self.figure("performance-profile", trainings, &performance_profile(&finals, &bootstrap)?)?;
        self.figure("methods", trainings, &method_scores(&report.learning, &bootstrap, None)?)?;
        let noisy = trained.of(|part| part == Part::NoisyStarts);
        self.figure("noisy-starts", trainings, &learning_curves(&noisy, &bootstrap, Success::Training)?)?;
        self.figure("noisy-starts-steps", trainings, &step_curves(&noisy, &bootstrap)?)?;
        self.figure("noisy-starts-methods", trainings, &method_scores(&report.noisy_starts, &bootstrap, None)?)
    }

    /// Writes a figure of the results of the first `seeds` seeds.
    fn figure(self, name: &str, seeds: u64, figure: &impl Figure) -> Result<(), StudyError> {
        self.interrupt.check()?;
        let seeds: Vec<u64> = (self.plan.seed..self.plan.seed + seeds).collect();
        let provenance = Provenance::new(self.command, &seeds, config_hash(self.plan)?);
        Ok(figure.write_all(&self.folder.0.join("figures"), name, &provenance, self.dpi)?)
    }

    /// The job that trains and evaluates a dynamics model.
    fn model_job(self, tools: Vec<ToolKind>, variant: Variant) -> StudyJob<'a, ModelRow> {
        let (plan, name) = (self.plan, format!("{} model", model_name(&tools, variant)));
        let size = (EPISODES_PER_EPOCH * f64::from(plan.model_training.epochs) * tools.len() as f64 / 2.0) as u64;
        Job::new(name.clone(), size, move |handle| {
            let path = self.model_path(&tools, variant);
            let model = match path.exists() {
                true => Model::load(&path)?,
                false => {
                    let trained = self.train(&path, &tools, variant, handle.stop(), |now| {
                        handle.set_done(size * u64::from(now.epoch) / u64::from(now.epochs));
                        handle.report(format!("{name}, epoch {}, loss {:.4}", now.epoch, now.loss));
                    })?;
                    let Some(model) = trained else { return Ok(None) };
                    model
                }
            };
            let file = format!("models/{}.json", model_name(&tools, variant));
            let evaluation = self.folder.cached(&file, || {
                Ok(Some(evaluate(&model, &plan.tasks, &plan.model_evaluation, handle.stop(), &mut |now| {
                    handle.report(format!("{name}, evaluation {} of {}", now.done + 1, now.total));
                })?))
            })?;
            Ok(evaluation.map(|evaluation| model_row(&evaluation, variant)))
        })
    }

    /// Trains a dynamics model; None if it was stopped.
    fn train(
        self,
        path: &Path,
        tools: &[ToolKind],
        variant: Variant,
        stop: &Stop,
        on_progress: impl FnMut(&Progress),
    ) -> Result<Option<Model>, StudyError> {
        let (config, settings) = (variant.apply(self.plan.model.clone()), self.plan.model_training.clone());
        let trained = train_to_file(path, config, settings, tools, self.command, stop, on_progress)?;
        match &trained.ended {
            TrainingOutcome::Stopped => return Ok(None),
            TrainingOutcome::Done => trained.remove_checkpoint(),
            TrainingOutcome::Diverged { epoch, reason } => {
                let tools = model_name(tools, variant);
                return Err(StudyError::Diverged { tools, epoch: *epoch, reason: reason.clone() });
            }
        }
        Ok(Some(trained.model().clone()))
    }

    /// The job that builds the action prior of a task for the hit counts.
    fn prior_job(self, task: Arc<Task>, seed: u64) -> StudyJob<'a, TaskPrior> {
        let name = format!("clusters of {}", task.name);
        Job::new(name.clone(), EPISODES_PER_PRIOR, move |handle| {
            handle.report(name.clone());
            let model = self.model_path(&task.tool_set(), Variant::Full);
            let prior = PriorSource::ModelFile(model.into()).identified();
            let config = RunConfig { prior, seed, ..RunConfig::new(task.clone()) };
            let prior = self.folder.cached(&format!("priors/{}-{seed}.json", task.name), || {
                Ok(Some(build_prior(&config, |_| (), handle.stop())?))
            })?;
            Ok(prior.map(|prior| (task.clone(), Arc::new(prior))))
        })
    }

    /// The job of one hit count: of guided play with a prior, otherwise of random play.
    fn count_job(self, task: Arc<Task>, prior: Option<Arc<ActionPrior>>, seed: u64) -> StudyJob<'a, HitRow> {
        let policy = if prior.is_some() { "guided" } else { "random" };
        let name = format!("{}-{policy}-{seed}", task.name);
        Job::new(name.clone(), self.count_work(), move |handle| {
            handle.report(format!("hits of {name}"));
            let episodes = self.plan.hit_episodes;
            let hits = self.folder.cached(&format!("hits/{name}.json"), || {
                Ok(Some(match &prior {
                    Some(prior) => count_hits(&task, &mut Guided(prior), episodes, seed, handle.stop())?,
                    None => {
                        let mut actor = ActorNoise::untrained(&task, &DdpgConfig::default(), seed)?;
                        count_hits(&task, &mut actor, episodes, seed, handle.stop())?
                    }
                }))
            })?;
            Ok(hits.map(|hits| HitRow { task: task.name.clone(), policy: policy.to_owned(), seed, hits }))
        })
    }

    /// The job of one training, a separate run.
    fn run_job(self, run: PlannedRun) -> StudyJob<'a, ()> {
        let name = run_name(&run);
        Job::new(name.clone(), u64::from(run.config.episodes), move |handle| {
            let PlannedRun { mut config, arm } = run.clone();
            if arm.part != Part::NoisyStarts {
                let model = self.model_path(&config.task.tool_set(), arm.model);
                config.prior = PriorSource::ModelFile(model.into()).identified();
            }
            if arm.proposed_subgoals {
                let Some(task) = self.with_proposed_subgoals(&config, handle)? else { return Ok(None) };
                config.task = task;
            }
            handle.report(name.clone());
            let path = self.run_path(&name);
            check_run(&path, &config)?;
            train_to_end(&path, &config, handle)
                .map_err(|source| StudyError::Training { run: name.clone(), source: Box::new(source) })
        })
    }

    fn run_path(self, name: &str) -> PathBuf {
        self.folder.path("runs").join(name)
    }

    /// The results of all trainings, which are finished.
    fn trained(self) -> Result<Trained, StudyError> {
        let planned = self.plan.runs()?;
        let paths: Vec<PathBuf> = planned.iter().map(|run| self.run_path(&run_name(run))).collect();
        let of_arm = |(found, PlannedRun { arm, .. }): (FoundRun, PlannedRun)| {
            let settings = arm.differences().into_iter().map(|(key, value)| (key, value.into())).collect();
            let row = LearningRow { settings, implied: Settings::new(), ..found.trained.row };
            (arm.part, TrainedRun { row, ..found.trained })
        };
        Ok(Trained(read_runs(&paths)?.into_iter().zip(planned).map(of_arm).collect()))
    }

    /// The task of a run with its subgoals replaced by the same number, proposed with the run's dynamics model. None
    /// if it was stopped.
    fn with_proposed_subgoals(self, config: &RunConfig, handle: &JobHandle) -> Result<Option<Arc<Task>>, StudyError> {
        let RunConfig { task, seed, .. } = config;
        let subgoals = self.folder.cached(&format!("subgoals/{}-{seed}.json", task.name), || {
            let found = rollout_model(&config.prior, task)?;
            // Only the uniform source has no model.
            let Some(model) = found else { return Ok(Some(Vec::new())) };
            let model = InterruptibleModel::new(&*model, handle.stop());
            Ok(Some(propose_subgoals(task, &model, task.subgoals.len(), &config.guidance, *seed)?))
        })?;
        Ok(subgoals.map(|subgoals| Arc::new(Task { subgoals, ..(**task).clone() })))
    }
}

/// The name of a training and its folder.
fn run_name(PlannedRun { config, arm }: &PlannedRun) -> String {
    let parts = [config.method.name().to_owned(), config.epsilon.to_string().replace(':', "_")];
    let parts = parts.into_iter().chain(arm.differences().into_iter().map(|(key, value)| format!("{key}_{value}")));
    let arm_name = parts.collect::<Vec<_>>().join("-").replace(' ', "_");
    let noisy = if arm.part == Part::NoisyStarts { "-noisy" } else { "" };
    format!("{}-{arm_name}{noisy}-{}", config.task.name, config.seed)
}

/// Refuses an existing run with other settings, such as one of another version of the program, or with another model.
fn check_run(path: &Path, config: &RunConfig) -> Result<(), StudyError> {
    let Ok(mut found) = RunDirectory::open(path).and_then(|directory| RunConfig::of(&directory)) else {
        // The training itself reports what cannot be read.
        return Ok(());
    };
    found.prior = found.prior.identified();
    if matches!(&found.prior, PriorSource::ModelFile(ModelFile { id: None, .. })) {
        // A run of an earlier version, whose study has been moved since.
        found.prior = config.prior.clone();
    }
    if found.trains_as(config) { Ok(()) } else { Err(StudyError::OtherRun { path: path.to_owned() }) }
}

/// File stem of a model.
fn model_name(tools: &[ToolKind], variant: Variant) -> String {
    match variant {
        Variant::Full => tool_set_name(tools),
        ablated => format!("{}-{}", tool_set_name(tools), ablated.name()),
    }
}

fn model_row(evaluation: &Evaluation, variant: Variant) -> ModelRow {
    let (one_step_error, rollout_error) = evaluation.mean_errors();
    ModelRow {
        structure: variant.label().to_owned(),
        tools: evaluation.launches.iter().map(|tool| tool.tool.to_string()).collect(),
        one_step_error,
        rollout_error,
    }
}
