//! The history of a run, read from its log: episodes, evaluations, the latest event.

use std::num::NonZeroUsize;

use serde::Serialize;

use super::event::{EpisodeRecord, Event, Practised};
use super::reader::for_each_event;
use super::retention::CheckpointName;
use super::series::{Numbered, Series};
use super::{Result, RunDirectory, RunError, RunState};

/// A greedy evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EvaluationRecord {
    /// Episodes finished before it.
    pub episode: u64,
    /// Fraction of its episodes that reached the goal.
    pub success: f64,
    /// Mean return of its episodes.
    pub mean_return: f64,
}

impl Numbered for EpisodeRecord {
    fn episode(&self) -> u64 {
        self.episode
    }
}

impl Numbered for EvaluationRecord {
    fn episode(&self) -> u64 {
        self.episode
    }
}

/// Everything that readers of the log show of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunHistory {
    /// The finished episodes, in order.
    pub records: Series<EpisodeRecord>,
    /// The time of training at the end of each of them.
    pub times: Series<TrainingTime>,
    /// The greedy evaluations, in order.
    pub evaluations: Series<EvaluationRecord>,
    /// The need for exploration of each stage, the goal last; empty if epsilon does not depend on need.
    pub needs: Vec<f32>,
    /// Results of the practice before the first episode, if there was any.
    pub practised: Option<Practised>,
    /// Interventions in order: see [`Event::is_intervention`].
    pub interventions: Vec<Event>,
    /// The latest event from which the state of the run follows, such as its pause.
    pub last: Option<Event>,
    /// The time of the first event, in seconds since 1970.
    pub began: Option<f64>,
    /// The seconds of training so far, and the time of the latest event.
    clock: (f64, f64),
}

/// The time of training at the end of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingTime {
    /// The number of the episode.
    pub episode: u64,
    /// Seconds since the run began, without its pauses and the time in which no process trained it.
    pub seconds: f64,
}

impl Numbered for TrainingTime {
    fn episode(&self) -> u64 {
        self.episode
    }
}

impl RunHistory {
    /// A history with bounded memory, for following runs of any length: at most `most` episodes and as
    /// many evaluations, see [`Series::bounded`].
    pub fn bounded(most: NonZeroUsize) -> Self {
        let (records, times, evaluations) = (Series::bounded(most), Series::bounded(most), Series::bounded(most));
        Self { records, times, evaluations, ..Self::default() }
    }

    /// The whole history of a run on disk.
    ///
    /// # Errors
    /// As [`read_events`](super::read_events); [`RunError::LogTooShort`] if the log does not reach the checkpoint `last`.
    pub fn read(directory: &RunDirectory) -> Result<Self> {
        let mut history = Self::default();
        for_each_event(&directory.events_path(), |logged| history.add(logged.time, &logged.event))?;
        let last = history.records.last().map_or(0, |record| record.episode);
        let saved = directory.checkpoints().episode_of(CheckpointName::Last);
        if let Some(checkpoint) = saved.filter(|saved| *saved > last)
            && !directory.is_locked()?
        {
            return Err(RunError::LogTooShort { path: directory.events_path(), last, checkpoint });
        }
        Ok(history)
    }

    /// Adds the next event, written at a time in seconds.
    pub fn add(&mut self, time: f64, event: &Event) {
        self.began.get_or_insert(time);
        let (mut seconds, before) = self.clock;
        // What precedes the other events is training, unless they are changes during a pause.
        let is_training = !matches!(event, Event::Started { .. } | Event::Resumed { .. })
            && !matches!(self.last, Some(Event::Paused { .. }));
        if is_training {
            seconds += (time - before).max(0.0);
        }
        match event {
            // A run that is resumed after an interruption repeats the episodes after its checkpoint.
            Event::Started { episode, .. } => {
                self.records.truncate(*episode);
                self.times.truncate(*episode);
                seconds = self.times.last().map_or(0.0, |last| last.seconds);
                self.evaluations.truncate(*episode);
                self.interventions.retain(|earlier| earlier.episode() <= *episode);
            }
            Event::EpisodeFinished(record) => {
                self.records.push(record.clone());
                self.times.push(TrainingTime { episode: record.episode, seconds });
            }
            Event::Evaluated { episode, success, mean_return, .. } => self.evaluations.push(EvaluationRecord {
                episode: *episode,
                success: *success,
                mean_return: *mean_return,
            }),
            Event::Practised(practised) => self.practised = Some(practised.clone()),
            Event::NeedsChanged { needs, .. } => self.needs.clone_from(needs),
            _ => {}
        }
        self.clock = (seconds, time);
        if event.is_intervention() {
            self.interventions.push(event.clone());
        }
        if RunState::after(event, true).is_some() {
            self.last = Some(event.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_of_practice_are_kept() {
        let practised = Practised { rollouts: vec![50, 25], reached: vec![43, 25], actions: 700 };
        let mut history = RunHistory::default();
        history.add(0.0, &Event::Practised(practised.clone()));
        history.add(0.0, &Event::EpisodeFinished(EpisodeRecord { episode: 1, ..Default::default() }));
        assert_eq!(history.practised, Some(practised));
    }

    #[test]
    fn the_time_of_training_has_no_pauses_and_no_repeated_episodes() {
        let finished = |episode| Event::EpisodeFinished(EpisodeRecord { episode, ..Default::default() });
        let mut history = RunHistory::default();
        for (time, event) in [
            (100.0, started(0)),
            (103.0, finished(1)),
            (104.0, Event::Paused { episode: 1 }),
            (130.0, Event::ScheduleChanged { episode: 1, schedule: "0.1".into() }),
            (150.0, Event::Resumed { episode: 1 }),
            (151.0, finished(2)),
            (160.0, finished(3)),
            (500.0, started(2)),
            (502.0, finished(3)),
        ] {
            history.add(time, &event);
        }
        let times: Vec<_> = history.times.iter().map(|time| (time.episode, time.seconds)).collect();
        assert_eq!(times, [(1, 3.0), (2, 5.0), (3, 7.0)]);
    }

    fn started(episode: u64) -> Event {
        Event::Started {
            origin: Default::default(),
            task: "task1".into(),
            method: "ddpg".into(),
            seed: 0,
            episodes: 9,
            episode,
            problems: Vec::new(),
            changes: Vec::new(),
        }
    }

    #[test]
    fn a_resumed_run_repeats_no_episode() {
        let finished = |episode| Event::EpisodeFinished(EpisodeRecord { episode, ..Default::default() });
        let mut history = RunHistory::default();
        for event in [started(0), finished(1), finished(2), finished(3), started(2), finished(3), finished(4)] {
            history.add(0.0, &event);
        }
        let episodes: Vec<u64> = history.records.iter().map(|record| record.episode).collect();
        assert_eq!(episodes, [1, 2, 3, 4]);
        assert_eq!(history.last, Some(finished(4)));
        let evaluated = |episode| Event::Evaluated { episode, episodes: 2, success: 0.5, mean_return: episode as f64 };
        for event in [evaluated(4), finished(5), evaluated(5), started(4)] {
            history.add(0.0, &event);
        }
        let kept = EvaluationRecord { episode: 4, success: 0.5, mean_return: 4.0 };
        assert_eq!(*history.evaluations, [kept], "the evaluation of a repeated episode is discarded");
        assert_eq!(history.records.len(), 4);
        let changed = |episode| Event::ScheduleChanged { episode, schedule: "0.1".into() };
        for event in [changed(4), finished(5), changed(5), Event::Resumed { episode: 5 }, started(4)] {
            history.add(0.0, &event);
        }
        assert_eq!(history.interventions, [started(2), started(4), changed(4), started(4)]);
        history.add(0.0, &Event::Paused { episode: 4 });
        history.add(0.0, &changed(4));
        assert_eq!(history.last, Some(Event::Paused { episode: 4 }), "a change does not end a pause");
    }
}
