//! Trains a run in its directory to its end: prior, episodes, evaluations, checkpoints,
//! and user controls.

mod controls;

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;

use super::config::RunConfig;
use super::error::{Result, TrainerError};
use super::panic_message;
use super::trace::Trace;
use super::training::Training;
use super::watch::{LiveView, Phase, Watch};
use mge_base::identity::{Origin, version};
use mge_base::stop::Pieces;
use mge_guidance::ActionPrior;
use mge_nn::processor;
use mge_run::{
    Checkpoint, CheckpointName, EpisodeRecord, Event, Practised, RequestReader, RunDirectory, RunError, RunHistory,
    RunWriter,
};

pub use controls::Control;
use controls::Next;

/// How a training ended without error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// All episodes are done, or it has the success of its stop rule.
    Finished,
    /// Stopped by a control.
    Stopped,
}

/// Trains the run in `directory` to its end, from its newest checkpoint if it has one.
/// The recorded results depend only on the configuration and on the controls received.
///
/// # Errors
/// When the run is in use, its files cannot be used, or the learner diverges. Errors of the training itself are also
/// recorded in the run.
pub fn train(directory: &RunDirectory, controls: &Receiver<Control>, watch: &Watch) -> Result<Ending> {
    // Create the reader before locking, so that no request is missed that is sent once the lock is held.
    let requests = directory.requests();
    // Lock before reading anything, because another process may be writing it.
    let lock = directory.lock()?;
    let config = RunConfig::of(directory)?;
    check_settings_and_model(&config)?;
    let (checkpoint, mut problems) = directory.newest_checkpoint()?;
    if checkpoint.is_none() && config.fork.is_some() {
        // A run without a checkpoint starts over with an empty log, which a fork cannot do.
        let reason =
            "the run is a fork, and the checkpoint from which it continues is missing: fork the other run again";
        return Err(TrainerError::Refused(reason.to_owned()));
    }
    let episode = checkpoint.as_ref().map_or(0, |checkpoint| checkpoint.episode);
    let writer = RunWriter::locked(directory, lock, episode)?;
    if let Some(checkpoint) = &checkpoint {
        directory.checkpoints().complete(&config.checkpoints, checkpoint)?;
    }
    // An unreadable `best` is replaced by the next one.
    let best = directory.checkpoints().best_score().err();
    problems.extend(best.filter(|best| problems.iter().all(|known| known.to_string() != best.to_string())));
    let of_checkpoint = |problem: &RunError| format!("a checkpoint cannot be used: {problem}");
    let problems = problems.iter().map(of_checkpoint).collect();
    watch.set_episode(episode);
    let mut run_loop = RunLoop {
        writer,
        controls,
        requests,
        watch,
        received: VecDeque::new(),
        pause_after: None,
        problems,
        warned: None,
        pieces: Pieces::default(),
        score: checkpoint.as_ref().and_then(|checkpoint| checkpoint.score),
        is_saved: false,
        is_changed: false,
    };
    let outcome = record_panic(&mut run_loop, |run_loop| run_loop.start(config, checkpoint.as_ref()));
    let outcome = outcome.map_err(|error| run_loop.explained(error));
    watch.phase.set(Phase::Ended);
    if let Err(error) = &outcome {
        run_loop.fail(error);
    }
    outcome
}

/// Checks that a run can be continued with `config`, without changing anything.
///
/// # Errors
/// When its newest checkpoint or its metrics cannot be used.
pub fn check_continuation(directory: &RunDirectory, config: &RunConfig) -> Result<()> {
    check_settings_and_model(config)?;
    let (Some(checkpoint), _) = directory.newest_checkpoint()? else { return Ok(()) };
    Training::resume(config.clone(), &checkpoint)?;
    Ok(RunHistory::read(directory).map(drop)?)
}

/// Checks that this version has all settings of a run, and that its own model is there, even if its clusters are saved.
fn check_settings_and_model(config: &RunConfig) -> Result<()> {
    config.check_supported()?;
    config.model_bytes().map(drop)
}

/// Runs `work`; records a panic as the run's end before resuming it.
fn record_panic<T>(run_loop: &mut RunLoop<'_>, work: impl FnOnce(&mut RunLoop<'_>) -> T) -> T {
    match catch_unwind(AssertUnwindSafe(|| work(run_loop))) {
        Ok(outcome) => outcome,
        Err(panic) => {
            run_loop.fail(&format_args!("the training panicked: {}", panic_message(&*panic)));
            run_loop.watch.phase.set(Phase::Ended);
            resume_unwind(panic)
        }
    }
}

/// The results of an episode.
pub(super) struct EpisodeOutcome {
    pub record: EpisodeRecord,
    trace: Trace,
    /// The results of practice, if it preceded the episode, and the action prior after it.
    practised: Option<(Practised, Arc<ActionPrior>)>,
    /// The action prior, if the episode changed it.
    refined: Option<Arc<ActionPrior>>,
    /// The evaluation, if one was due, and the score that decides about `best`.
    evaluated: Option<(Event, f64)>,
}

/// Computes an episode without writing any files.
pub(super) fn play(training: &mut Training) -> Result<EpisodeOutcome> {
    let practised = training.practise()?.zip(training.prior().cloned());
    let (record, trace) = training.run_episode()?;
    let refined = training.refine()?;
    let is_due = training.is_evaluated_after(training.episode());
    let evaluated = is_due.then(|| training.evaluate(training.config.evaluation.episodes)).transpose()?;
    let evaluated = match evaluated {
        Some(event @ Event::Evaluated { mean_return, .. }) => Some((event, training.score(mean_return)?)),
        _ => None,
    };
    Ok(EpisodeOutcome { record, trace, practised, refined, evaluated })
}

struct RunLoop<'a> {
    writer: RunWriter,
    controls: &'a Receiver<Control>,
    /// Requests of other processes.
    requests: RequestReader,
    watch: &'a Watch,
    /// Controls received but not yet handled.
    received: VecDeque<Control>,
    /// Pause when this many episodes are done.
    pause_after: Option<u64>,
    /// What was wrong with the files, such as checkpoints that could not be used.
    problems: Vec<String>,
    /// The latest problem with a request.
    warned: Option<String>,
    /// Ends long episodes.
    pieces: Pieces,
    /// Score of the networks, if they were evaluated at the latest episode.
    score: Option<f64>,
    /// A checkpoint of the latest episode, and of these logs, is saved.
    is_saved: bool,
    /// The schedule or the prior was changed since the checkpoint.
    is_changed: bool,
}

impl RunLoop<'_> {
    /// Trains from a checkpoint, or from the beginning, with new action priors.
    fn start(&mut self, config: RunConfig, checkpoint: Option<&Checkpoint>) -> Result<Ending> {
        let on_phase = |phase| self.watch.phase.set(phase);
        let made = config.make_model(&self.writer.directory, on_phase, &self.watch.stop);
        let begin = |()| Training::begin(config, checkpoint, on_phase, &self.watch.stop);
        let training = match made.and_then(begin) {
            Err(TrainerError::Stopped(_)) => None,
            training => Some(training?),
        };
        let stop = if checkpoint.is_none() { self.stop_received() } else { None };
        let (Some(training), true) = (training, stop.is_none()) else {
            let reason = stop.unwrap_or_else(|| "interrupted".to_owned());
            let episode = checkpoint.map_or(0, |checkpoint| checkpoint.episode);
            self.writer.record(&Event::Stopped { episode, reason })?;
            return Ok(Ending::Stopped);
        };
        self.run(training)
    }

    fn run(&mut self, mut training: Training) -> Result<Ending> {
        let config = &training.config;
        let (mge_version, processor) = (version().to_owned(), processor());
        let origin = Origin { mge_version, processor, models: config.model_id().into_iter().collect() };
        let started = Event::Started {
            changes: self.writer.origin.as_ref().map_or_else(Vec::new, |before| origin.changes(before)),
            origin,
            task: config.task.name.clone(),
            method: config.method.name().to_owned(),
            seed: config.seed,
            episodes: u64::from(config.episodes),
            episode: training.episode(),
            problems: std::mem::take(&mut self.problems),
        };
        self.writer.record(&started)?;
        self.watch.set_prior(training.prior().cloned());
        self.watch.set_episode(training.episode());
        match training.prior().cloned() {
            Some(prior) if training.episode() == 0 => self.record_prior(prior, 0, false)?,
            prior => self.restore_prior(prior.as_deref())?,
        }
        if training.episode() == 0 {
            self.record_needs(&training, &[])?;
        }
        self.watch.phase.set(Phase::Training);
        training.phase = self.watch.phase.clone();
        // Pauses do not count.
        let mut trained = Duration::ZERO;
        while !training.is_finished() {
            let limit = training.config.stop.minutes;
            if let Some(minutes) = limit.filter(|minutes| trained.as_secs_f64() >= 60.0 * minutes) {
                let reason = format!("after {minutes} minutes, as `stop.minutes` says");
                self.received.push_back(Control::Stop { reason });
            }
            if let Next::Stop(reason) = self.handle_controls(&mut training)? {
                self.save_now(&training)?;
                self.writer.record(&Event::Stopped { episode: training.episode(), reason })?;
                return Ok(Ending::Stopped);
            }
            let begun = Instant::now();
            self.episode(&mut training)?;
            trained += begun.elapsed();
        }
        self.save_now(&training)?;
        self.writer.record(&Event::Finished { episode: training.episode() })?;
        Ok(Ending::Finished)
    }

    /// Plays an episode and records its results; records nothing if a stop abandons it.
    fn episode(&mut self, training: &mut Training) -> Result<()> {
        let needs = training.needs();
        self.pieces.is_slow |= training.may_take_longer();
        let played = self.pieces.run(training, &self.watch.stop, |training, stop| {
            training.stop_on(stop);
            let played = play(training);
            (!matches!(played, Err(TrainerError::Stopped(_)))).then_some(played)
        });
        let Some(played) = played else { return Ok(()) };
        let EpisodeOutcome { record, trace, practised, refined, evaluated } = played?;
        (self.is_saved, self.score) = (false, None);
        if let Some((practised, prior)) = practised {
            self.writer.record(&Event::Practised(practised))?;
            self.record_prior(prior, 0, false)?;
        }
        self.watch.set_episode(record.episode);
        self.writer.record(&Event::EpisodeFinished(record))?;
        self.record_needs(training, &needs)?;
        self.writer.record_actions(&trace.played())?;
        self.watch.offer(|| LiveView {
            trace: Arc::new(trace),
            ddpg: Arc::new(training.ddpg().clone()),
            prior: training.prior().cloned(),
        });
        if let Some(prior) = refined {
            self.record_prior(prior, training.episode(), false)?;
        }
        if let Some((event, score)) = evaluated {
            self.score = Some(score);
            self.writer.record(&event)?;
        }
        self.save_due(training)
    }

    /// Writes the checkpoints that are due.
    fn save_due(&mut self, training: &Training) -> Result<()> {
        let policy = &training.config.checkpoints;
        let store = self.writer.directory.checkpoints();
        let due = store.due(policy, training.episode(), self.score, training.is_finished());
        if !due.is_empty() {
            self.writer.checkpoint(&due, policy.periodic_kept, &self.checkpoint(training)?)?;
            (self.is_saved, self.is_changed) = (true, false);
        }
        Ok(())
    }

    fn checkpoint(&self, training: &Training) -> Result<Checkpoint> {
        let mut checkpoint = training.checkpoint()?;
        // The next `best` is compared with this score.
        checkpoint.score = self.score;
        Ok(checkpoint)
    }

    /// Saves the current state unless it is already saved, because the training ends or pauses here.
    fn save_now(&mut self, training: &Training) -> Result<()> {
        if self.is_saved && !self.is_changed {
            return Ok(());
        }
        let checkpoint = self.checkpoint(training)?;
        let kept = training.config.checkpoints.periodic_kept;
        match self.is_changed {
            true => self.writer.checkpoint(&[CheckpointName::Last], kept, &checkpoint)?,
            false => self.writer.save(&[CheckpointName::Last], kept, &checkpoint)?,
        }
        (self.is_saved, self.is_changed) = (true, false);
        Ok(())
    }

    /// Saves and shows the prior, and records that it is used from now on; `given` says whether it is a user's.
    fn record_prior(&mut self, prior: Arc<ActionPrior>, episode: u64, given: bool) -> Result<()> {
        self.write_prior(&prior.to_json())?;
        let clusters = prior.stages.iter().map(|stage| stage.clusters.len() as u32).collect();
        self.watch.set_prior(Some(prior));
        Ok(self.writer.record(&Event::ClustersChanged { episode, clusters, given })?)
    }

    /// Records the needs for exploration if they have changed.
    fn record_needs(&mut self, training: &Training, before: &[f32]) -> Result<(), RunError> {
        match training.needs() {
            needs if needs == before => Ok(()),
            needs => self.writer.record(&Event::NeedsChanged { episode: training.episode(), needs }),
        }
    }

    /// Restores the saved prior to that of the checkpoint, because a later one may have been saved since.
    fn restore_prior(&self, prior: Option<&ActionPrior>) -> Result<(), RunError> {
        let directory = &self.writer.directory;
        match prior.map(ActionPrior::to_json) {
            text if text == directory.read_prior().unwrap_or_default() => Ok(()),
            Some(text) => self.write_prior(&text),
            None => {
                let path = directory.prior_path();
                std::fs::remove_file(&path).map_err(RunError::io("remove", &path))
            }
        }
    }

    fn write_prior(&self, text: &str) -> Result<(), RunError> {
        let path = self.writer.directory.prior_path();
        mge_base::atomic::write(&path, text.as_bytes()).map_err(RunError::io("write", &path))
    }

    /// The error, or its cause: if the folder was moved or deleted, any operation may be the first to fail.
    fn explained(&self, error: TrainerError) -> TrainerError {
        let is_missing = matches!(&error, TrainerError::Run(cause) if cause.is_not_found());
        match self.writer.check_in_place() {
            Ok(()) if is_missing => RunError::Moved(self.writer.directory.path().to_owned()).into(),
            Ok(()) => error,
            Err(gone) => gone.into(),
        }
    }

    /// Records the error as the run's end. If this fails as well, the caller still returns the
    /// original error.
    fn fail(&mut self, error: &dyn std::fmt::Display) {
        for problem in std::mem::take(&mut self.problems) {
            let _ = self.writer.record(&Event::Warned { episode: self.watch.episode(), problem });
        }
        let _ = self.writer.record(&Event::Failed { episode: self.watch.episode(), reason: error.to_string() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::RunState;

    #[test]
    fn a_panic_is_recorded_as_the_end_of_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let directory = RunDirectory::create(folder.path().join("run"), &config).unwrap();
        let (_sender, controls) = crossbeam_channel::unbounded();
        let watch = Watch::default();
        let writer = RunWriter::open(&directory, 0).unwrap();
        let mut run_loop = RunLoop {
            writer,
            controls: &controls,
            requests: directory.requests(),
            watch: &watch,
            received: VecDeque::new(),
            pause_after: None,
            problems: Vec::new(),
            warned: None,
            pieces: Pieces::default(),
            score: None,
            is_saved: false,
            is_changed: false,
        };
        let work = || record_panic(&mut run_loop, |_| -> () { panic!("on purpose") });
        assert!(catch_unwind(AssertUnwindSafe(work)).is_err());
        drop(run_loop);
        let state = directory.status().unwrap().state;
        assert_eq!(state, RunState::Failed("the training panicked: on purpose".into()));
    }
}
