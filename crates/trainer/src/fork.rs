//! Forks: runs that continue from an episode of another run with other settings.
//!
//! The state of the other run at that episode is either in a checkpoint or is recomputed from the
//! nearest earlier one, because trainings are reproducible. Every repeated episode is compared with
//! the log of the other run.

use std::path::Path;
use std::sync::Arc;

use super::config::RunConfig;
use super::error::{Result, TrainerError};
use super::parts::{Fork, PastTask};
use super::prior::build_prior;
use super::run_loop::play;
use super::training::Training;
use mge_base::stop::Stop;
use mge_run::{Branch, Event, RunDirectory, RunHistory};
use mge_task::Task;

impl RunConfig {
    /// The configuration of a fork that continues from `episode` of the run in the folder `run`, whose
    /// configuration is `before`. `self` already includes `changes`.
    #[must_use]
    pub fn forked(self, before: &Self, run: &str, episode: u32, changes: Vec<String>) -> Self {
        let known = before.fork.iter().flat_map(|fork| &fork.tasks).filter(|past| past.until <= episode);
        let mut tasks: Vec<PastTask> = known.cloned().collect();
        if before.task != self.task {
            tasks.push(PastTask { until: episode, task: before.task.clone() });
        }
        let extended_from = self.extended_from.filter(|_| self.episodes == before.episodes);
        Self { extended_from, fork: Some(Fork { run: run.to_owned(), episode, changes, tasks }), ..self }
    }

    /// The configuration with the schedule that was set last during the training, given the events of its log; None if
    /// there is no other than its own. A fork with its own schedule does not keep that of the run that it comes from.
    pub fn in_force(&self, events: &[Event]) -> Option<Self> {
        let own = self.fork.iter().find(|fork| fork.changes.iter().any(|change| change.starts_with("epsilon=")));
        let first = own.map_or(0, |fork| u64::from(fork.episode));
        let is_kept = |event: &&Event| matches!(event, Event::ScheduleChanged { episode, .. } if *episode >= first);
        let epsilon = events.iter().rev().find(is_kept)?.schedule()?.parse().ok()?;
        Some(Self { epsilon, ..self.clone() })
    }

    /// The task on which an episode, counted from 1, was played.
    pub fn task_of(&self, episode: u64) -> &Arc<Task> {
        let mut past = self.fork.iter().flat_map(|fork| &fork.tasks);
        past.find(|past| episode <= u64::from(past.until)).map_or(&self.task, |past| &past.task)
    }
}

/// Creates a run in `place` that continues from `source` with `config`; `config.fork` names the episode.
/// `progress` receives the numbers of episodes repeated so far and to be repeated in total.
///
/// # Errors
/// When the episode cannot be reproduced, or the learned state cannot be used with the new settings; then
/// nothing remains on disk.
pub fn fork(
    source: &RunDirectory,
    place: &Path,
    config: RunConfig,
    progress: impl Fn(u64, u64),
    stop: &Stop,
) -> Result<RunDirectory> {
    let episode = config.fork.as_ref().map_or(0, |fork| u64::from(fork.episode));
    let old = RunConfig::of(source)?;
    old.check_supported()?;
    let done = RunHistory::read(source)?.records.len() as u64;
    if done < episode {
        return Err(TrainerError::Refused(format!("the run has {done} episodes, not {episode}")));
    }
    let branch = Branch::new(source, place, episode)?;
    let mut training = begin(source, &old, episode, stop)?;
    training.stop_on(stop);
    repeat(&mut training, &branch, episode, progress)?;
    let mut prior = training.prior().cloned();
    let clusters_change = old.task != config.task || !old.has_model_of(&config) || old.guidance != config.guidance;
    // Practice is still to come, and builds them.
    let is_practised = training.episode() == 0 && config.practises();
    if clusters_change {
        prior = None;
    }
    if config.is_guided() && prior.is_none() && !is_practised {
        prior = Some(Arc::new(build_prior(&config, |_| (), stop)?));
    }
    stop.check()?;
    let config = config.identified();
    let model = config.model_bytes()?;
    let checkpoint = training.forked(config.clone(), prior)?.checkpoint()?;
    Ok(branch.finish(&config, model.as_deref(), &checkpoint)?)
}

/// The training at the latest checkpoint that is not after `episode`, or a new one if there is none. A fork's own
/// checkpoints begin at its first episode: an earlier one is of the run that it comes from, with other settings.
fn begin(source: &RunDirectory, config: &RunConfig, episode: u64, stop: &Stop) -> Result<Training> {
    let store = source.checkpoints();
    let first = config.fork.as_ref().map_or(0, |fork| u64::from(fork.episode));
    let nearest = store.episodes()?.into_iter().rfind(|(at, _)| (first..=episode).contains(at));
    if nearest.is_none() && config.fork.is_some() {
        let remedy = "fork the run that it comes from";
        return Err(TrainerError::Refused(format!(
            "no checkpoint of this fork is as early as episode {episode}: {remedy}"
        )));
    }
    let checkpoint = nearest.map(|(_, name)| store.load(name)).transpose()?;
    Training::begin(config.clone(), checkpoint.as_ref(), |_| (), stop)
}

/// Continues a training to `episode` and checks every episode against the log of the branch.
fn repeat(training: &mut Training, branch: &Branch, episode: u64, progress: impl Fn(u64, u64)) -> Result<()> {
    let first = training.episode();
    let mut history = RunHistory::default();
    // Times are of no use here.
    branch.events().for_each(|event| history.add(0.0, event));
    for event in &history.interventions {
        // Refinements that are due are recomputed, and earlier changes are part of the checkpoint.
        if let Event::ClustersChanged { episode, given, .. } = *event
            && episode > first
            && (given || !training.config.is_refined_after(episode))
        {
            return Err(TrainerError::Refused(format!(
                "the run was given other clusters after episode {episode}, which are not kept: fork it before that, or \
                 at the episode of a later checkpoint"
            )));
        }
    }
    loop {
        let now = training.episode();
        for event in history.interventions.iter().filter(|event| event.episode() == now) {
            if let Event::ScheduleChanged { schedule, .. } = event
                && let Ok(schedule) = schedule.parse()
            {
                training.set_schedule(schedule);
            }
        }
        if now >= episode {
            return Ok(());
        }
        progress(now - first, episode - first);
        let record = play(training)?.record;
        if history.records.get(now as usize) != Some(&record) {
            return Err(TrainerError::Refused(format!(
                "episode {} differs when it is repeated: the run was trained by another version of the program or on \
                 another kind of machine; fork it at the episode of a checkpoint",
                now + 1
            )));
        }
    }
}
