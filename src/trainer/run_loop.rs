//! A training from its directory to its end: prior, episodes, evaluations, checkpoints,
//! and what a person asks for in between.

mod controls;

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;

use super::config::RunConfig;
use super::panic_message;
use super::prior::{PriorError, build_prior};
use super::trace::Trace;
use super::training::{Training, TrainingError};
use super::watch::{LiveView, Phase, Watch};
use crate::guidance::ActionPrior;
use crate::run::{
    Checkpoint, CheckpointAction, CheckpointName, EpisodeRecord, Event, Practised, RequestReader, RetentionContext,
    RunDirectory, RunError, RunWriter, what_to_keep,
};
use crate::stop::{Stop, or_left_behind};

pub use controls::Control;
use controls::Next;

/// How a training ended without an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// All episodes are done.
    Finished,
    /// A control asked for it.
    Stopped,
}

/// Why a training ended early.
#[derive(Debug, thiserror::Error)]
pub enum TrainerError {
    /// The run's files.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The loop.
    #[error(transparent)]
    Training(#[from] TrainingError),
    /// The action prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
}

/// Trains the run in `directory` to its end, from its newest checkpoint if it has one.
/// Files, and with them everything that is seen of the run, depend only on its
/// configuration and on the controls received.
///
/// # Errors
/// When the run is in use, its files cannot be used, or the learner diverges; all but
/// the first are also recorded in the run.
pub fn train(directory: &RunDirectory, controls: &Receiver<Control>, watch: &Watch) -> Result<Ending, TrainerError> {
    // What is asked once the lock is held is asked of this process.
    let requests = directory.requests();
    // Before anything is read: another process may be about to write it.
    let lock = directory.lock()?;
    let config: RunConfig = directory.config()?;
    let (checkpoint, mut problems) = match directory.checkpoints().names()?.is_empty() {
        true => (None, Vec::new()),
        false => directory.checkpoints().load_newest().map(|(newest, problems)| (Some(newest), problems))?,
    };
    if checkpoint.is_none() && config.fork.is_some() {
        // A run that begins again loses its log, and a fork cannot begin again.
        return Err(TrainingError::ForkedFromNothing.into());
    }
    let mut writer =
        RunWriter::locked(directory, lock, checkpoint.as_ref().map_or(0, |checkpoint| checkpoint.episode))?;
    if let Some(checkpoint) = &checkpoint {
        let is_finished = checkpoint.episode >= u64::from(config.episodes);
        writer.finish_checkpoint(&config.checkpoints, checkpoint, is_finished)?;
    }
    let store = directory.checkpoints();
    // A `best` that cannot be read is replaced by the next.
    let best_score = store.best_score().unwrap_or_else(|problem| {
        problems.push(problem);
        None
    });
    for problem in &problems {
        writer.note(&format!("a checkpoint cannot be used: {problem}"))?;
    }
    let existing = store.names()?;
    watch.set_episode(checkpoint.as_ref().map_or(0, |checkpoint| checkpoint.episode));
    let mut run_loop = RunLoop {
        writer,
        controls,
        requests,
        watch,
        received: VecDeque::new(),
        pause_after: None,
        best_score,
        existing,
        is_slow: true,
        score: checkpoint.as_ref().and_then(|checkpoint| checkpoint.score),
        is_saved: checkpoint.is_some(),
        is_changed: false,
    };
    let outcome = record_panic(&mut run_loop, |run_loop| {
        let training = match &checkpoint {
            Some(checkpoint) => Training::resume(config, checkpoint)?,
            None => {
                let prior = run_loop.build_prior(&config)?;
                if let Some(reason) = run_loop.stop_received() {
                    run_loop.writer.record(&Event::Stopped { episode: 0, reason })?;
                    return Ok(Ending::Stopped);
                }
                Training::new(config, prior)?
            }
        };
        run_loop.run(training)
    });
    let outcome = outcome.map_err(|error| run_loop.explained(error));
    watch.set_phase(Phase::Ended);
    if let Err(error) = &outcome {
        run_loop.fail(error);
    }
    outcome
}

/// Does the work; a panic in it is recorded as the run's end before it is passed on.
fn record_panic<T>(run_loop: &mut RunLoop<'_>, work: impl FnOnce(&mut RunLoop<'_>) -> T) -> T {
    match catch_unwind(AssertUnwindSafe(|| work(run_loop))) {
        Ok(outcome) => outcome,
        Err(panic) => {
            run_loop.fail(&format_args!("the training panicked: {}", panic_message(&*panic)));
            resume_unwind(panic)
        }
    }
}

/// What an episode has come to.
pub(super) struct Played {
    pub record: EpisodeRecord,
    trace: Trace,
    /// What came of practice, if it preceded the episode, and the action prior after it.
    practised: Option<(Practised, Arc<ActionPrior>)>,
    /// The action prior, if the episode changed it.
    refined: Option<Arc<ActionPrior>>,
    /// The evaluation, if one was due.
    evaluated: Option<Event>,
}

/// All that an episode computes, before anything of it is written.
pub(super) fn play(training: &mut Training) -> Result<Played, TrainingError> {
    let practised = training.practise()?.zip(training.prior().cloned());
    let (record, trace) = training.run_episode()?;
    let refined = training.refine();
    let evaluation = training.config().evaluation;
    let is_due = training.config().method.learns()
        && evaluation.every > 0
        && training.episode().is_multiple_of(u64::from(evaluation.every));
    let evaluated = is_due.then(|| training.evaluate(evaluation.episodes)).transpose()?;
    Ok(Played { record, trace, practised, refined, evaluated })
}

struct RunLoop<'a> {
    writer: RunWriter,
    controls: &'a Receiver<Control>,
    /// What other processes ask.
    requests: RequestReader,
    watch: &'a Watch,
    /// Controls that came while clusters were built.
    received: VecDeque<Control>,
    /// Pause when this many episodes are done.
    pause_after: Option<u64>,
    /// Score of the checkpoint called `best`.
    best_score: Option<f64>,
    /// The checkpoints there are.
    existing: Vec<CheckpointName>,
    /// The next episode may take long.
    is_slow: bool,
    /// Score of the networks, if the latest episode evaluated them.
    score: Option<f64>,
    /// The checkpoint `last` is of the latest episode.
    is_saved: bool,
    /// The schedule or the prior was changed since the checkpoint.
    is_changed: bool,
}

/// An episode that takes longer is abandoned when a stop is asked for. The copy and the thread that make
/// it possible take a small part of this.
const SLOW: Duration = Duration::from_millis(100);
/// Time in which an episode may notice by itself that a stop was asked for. One that does not, because
/// an update of large networks goes on, is left to its thread.
const PATIENCE: Duration = Duration::from_millis(100);
impl RunLoop<'_> {
    /// The prior of a new run, if it is guided. A request to stop ends it.
    fn build_prior(&mut self, config: &RunConfig) -> Result<Option<Arc<ActionPrior>>, TrainerError> {
        if !config.is_guided() {
            return Ok(None);
        }
        let stages = config.task.stage_count();
        let on_stage = |stage| self.watch.set_phase(Phase::BuildingPrior { stage, stages });
        let prior = build_prior(config, on_stage, self.watch.stop())?;
        Ok(prior.map(Arc::new))
    }

    fn run(&mut self, mut training: Training) -> Result<Ending, TrainerError> {
        let config = training.config();
        let started = Event::Started {
            mge_version: env!("CARGO_PKG_VERSION").to_owned(),
            task: config.task.name.clone(),
            method: config.method.name().to_owned(),
            seed: config.seed,
            episodes: u64::from(config.episodes),
            episode: training.episode(),
        };
        self.writer.record(&started)?;
        self.watch.set_prior(training.prior().cloned());
        self.watch.set_episode(training.episode());
        match training.prior().cloned() {
            Some(prior) if training.episode() == 0 => self.record_prior(&prior, 0)?,
            prior => self.restore_prior(prior.as_deref())?,
        }
        if training.episode() == 0 {
            self.record_needs(&training, &[])?;
        }
        self.watch.set_phase(Phase::Training);
        training.show_phase(self.watch.phase_sign());
        while !training.is_finished() {
            if let Next::Stop(reason) = self.handle_controls(&mut training)? {
                self.save_now(&training)?;
                self.writer.record(&Event::Stopped { episode: training.episode(), reason })?;
                return Ok(Ending::Stopped);
            }
            self.episode(&mut training)?;
        }
        self.writer.record(&Event::Finished { episode: training.episode() })?;
        Ok(Ending::Finished)
    }

    /// An episode and what follows from it; none if it is abandoned for a stop that was asked for.
    fn episode(&mut self, training: &mut Training) -> Result<(), TrainerError> {
        let needs = training.needs();
        let begun = Instant::now();
        let played = if self.is_slow { self.play_or_stop(training) } else { Some(play(training)) };
        self.is_slow = begun.elapsed() > SLOW;
        let Some(played) = played else { return Ok(()) };
        let Played { record, trace, practised, refined, evaluated } = played?;
        (self.is_saved, self.score) = (false, None);
        if let Some((practised, prior)) = practised {
            self.writer.record(&Event::Practised(practised))?;
            self.record_prior(&prior, 0)?;
        }
        self.watch.set_episode(record.episode);
        self.writer.record(&Event::EpisodeFinished(record))?;
        self.record_needs(training, &needs)?;
        self.writer.keep(&trace.played())?;
        self.watch.offer(|| LiveView {
            trace: Arc::new(trace),
            ddpg: Arc::new(training.ddpg().clone()),
            prior: training.prior().cloned(),
        });
        if let Some(prior) = refined {
            self.record_prior(&prior, training.episode())?;
            self.watch.set_prior(Some(prior));
        }
        if let Some(event) = evaluated {
            if let Event::Evaluated { mean_return, .. } = event {
                self.score = Some(mean_return);
            }
            self.writer.record(&event)?;
        }
        self.save_due(training)
    }

    /// As [`play`], with a copy of the training. None if it was abandoned for a stop that was asked
    /// for: the training is what it was before.
    fn play_or_stop(&self, training: &mut Training) -> Option<Result<Played, TrainingError>> {
        let stop = self.watch.stop();
        let mut copy = training.clone();
        copy.obey(stop);
        let work = move || {
            let played = play(&mut copy);
            (played, copy)
        };
        let (played, mut after) = or_left_behind(|| stop.is_requested(), PATIENCE, work)?;
        if matches!(played, Err(TrainingError::Stopped)) {
            return None;
        }
        after.obey(&Stop::default());
        *training = after;
        Some(played)
    }

    /// Writes the checkpoints that are due.
    fn save_due(&mut self, training: &Training) -> Result<(), TrainerError> {
        let (episode, score, best_score) = (training.episode(), self.score, self.best_score);
        let closing = training.is_finished();
        let moment = RetentionContext { episode, score, best_score, closing, existing: &self.existing };
        let actions = what_to_keep(&training.config().checkpoints, &moment);
        if actions.is_empty() {
            return Ok(());
        }
        let checkpoint = self.checkpoint(training)?;
        self.writer.checkpoint(&actions, &checkpoint)?;
        (self.is_saved, self.is_changed) = (true, false);
        if actions.contains(&CheckpointAction::Save(CheckpointName::Best)) {
            self.best_score = score;
        }
        self.existing = self.writer.directory().checkpoints().names()?;
        Ok(())
    }

    fn checkpoint(&self, training: &Training) -> Result<Checkpoint, TrainerError> {
        let mut checkpoint = training.checkpoint()?;
        // Without it the next `best` would have nothing to be better than.
        checkpoint.score = self.score;
        Ok(checkpoint)
    }

    /// Saves the training as it is, if it is not: it ends or pauses here, and nothing may be lost.
    fn save_now(&mut self, training: &Training) -> Result<(), TrainerError> {
        if self.is_saved && !self.is_changed {
            return Ok(());
        }
        let checkpoint = self.checkpoint(training)?;
        match self.is_changed {
            true => self.writer.checkpoint(&[CheckpointAction::Save(CheckpointName::Last)], &checkpoint)?,
            false => self.writer.save_last(&checkpoint)?,
        }
        self.existing = self.writer.directory().checkpoints().names()?;
        (self.is_saved, self.is_changed) = (true, false);
        Ok(())
    }

    /// Saves the prior beside the log and records that it holds from now on.
    fn record_prior(&mut self, prior: &ActionPrior, episode: u64) -> Result<(), TrainerError> {
        self.write_prior(&prior.to_json())?;
        let clusters = prior.stages.iter().map(|stage| stage.clusters.len() as u32).collect();
        Ok(self.writer.record(&Event::ClustersChanged { episode, clusters })?)
    }

    /// Records the need for exploration if it is another than before.
    fn record_needs(&mut self, training: &Training, before: &[f32]) -> Result<(), RunError> {
        match training.needs() {
            needs if needs == before => Ok(()),
            needs => self.writer.record(&Event::NeedsChanged { episode: training.episode(), needs }),
        }
    }

    /// Makes the saved prior that of the checkpoint: a later one may have been saved since.
    fn restore_prior(&self, prior: Option<&ActionPrior>) -> Result<(), RunError> {
        let directory = self.writer.directory();
        match prior.map(ActionPrior::to_json) {
            wanted if wanted == directory.read_prior().unwrap_or_default() => Ok(()),
            Some(text) => self.write_prior(&text),
            None => {
                let path = directory.prior_path();
                std::fs::remove_file(&path).map_err(RunError::io("remove", &path))
            }
        }
    }

    fn write_prior(&self, text: &str) -> Result<(), RunError> {
        let path = self.writer.directory().prior_path();
        crate::atomic::write(&path, text.as_bytes()).map_err(RunError::io("write", &path))
    }

    /// The error, or what explains it: in a folder that is moved or deleted anything may fail first.
    fn explained(&self, error: TrainerError) -> TrainerError {
        let is_missing = matches!(&error, TrainerError::Run(cause) if cause.is_not_found());
        match self.writer.check_in_place() {
            Ok(()) if is_missing => RunError::Gone(self.writer.directory().path().to_owned()).into(),
            Ok(()) => error,
            Err(gone) => gone.into(),
        }
    }

    /// Records the error as the run's end. If even that fails, the error itself is
    /// what the caller gets to see.
    fn fail(&mut self, error: &dyn std::fmt::Display) {
        let _ = self.writer.record(&Event::Failed { episode: self.watch.episode(), reason: error.to_string() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::RunState;

    #[test]
    fn a_panic_is_the_runs_recorded_end() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(crate::task::load("task1").unwrap()));
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
            best_score: None,
            existing: Vec::new(),
            is_slow: false,
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
