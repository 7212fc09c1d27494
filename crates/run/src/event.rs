//! Events of a run, shared by all readers.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::number;
use mge_base::identity::Origin;
use mge_base::text::counted;

/// One finished episode: a row of `metrics.csv` and the body of [`Event::EpisodeFinished`].
///
/// Every number and Boolean except `episode` is a [`Metric`](super::Metric) of the same name, which
/// documents its unit, meaning and formula. Contains no times, so the same seed gives the same bytes.
/// Learning metrics are `None` until the first update.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeRecord {
    /// Number of this episode, counted from 1.
    pub episode: u64,
    /// [`Metric::Actions`](super::Metric::Actions).
    pub steps: u64,
    /// [`Metric::EnvironmentSteps`](super::Metric::EnvironmentSteps).
    pub environment_steps: u64,
    /// [`Metric::Return`](super::Metric::Return).
    #[serde(rename = "return", with = "number::required")]
    pub return_: f32,
    /// [`Metric::Goal`](super::Metric::Goal).
    pub goal: bool,
    /// [`Metric::Subgoals`](super::Metric::Subgoals).
    pub subgoals: u32,
    /// [`Metric::SubgoalsTotal`](super::Metric::SubgoalsTotal).
    pub subgoals_total: u32,
    /// [`Metric::Guided`](super::Metric::Guided).
    pub guided: bool,
    /// [`Metric::Epsilon`](super::Metric::Epsilon).
    #[serde(with = "number::required")]
    pub epsilon: f32,
    /// [`Metric::Noise`](super::Metric::Noise).
    #[serde(with = "number::required")]
    pub noise_sigma: f32,
    /// [`Metric::CriticLoss`](super::Metric::CriticLoss).
    #[serde(with = "number::optional")]
    pub critic_loss: Option<f32>,
    /// [`Metric::MeanQ`](super::Metric::MeanQ).
    #[serde(with = "number::optional")]
    pub mean_q: Option<f32>,
    /// [`Metric::MaxQ`](super::Metric::MaxQ).
    #[serde(with = "number::optional")]
    pub max_q: Option<f32>,
    /// [`Metric::ActorLoss`](super::Metric::ActorLoss).
    #[serde(with = "number::optional")]
    pub actor_loss: Option<f32>,
    /// [`Metric::Saturation`](super::Metric::Saturation).
    #[serde(with = "number::optional")]
    pub action_saturation: Option<f32>,
    /// [`Metric::Success`](super::Metric::Success).
    #[serde(with = "number::required")]
    pub rolling_success: f64,
    /// [`Metric::Terminated`](super::Metric::Terminated).
    pub terminated: bool,
    /// [`Metric::Truncated`](super::Metric::Truncated).
    pub truncated: bool,
    /// Why it ended, as named by the environment, such as `goal` or `left the screen`.
    pub end: String,
    /// [`Metric::Placed`](super::Metric::Placed).
    pub placed: u32,
    /// [`Metric::Blocked`](super::Metric::Blocked).
    pub blocked: u32,
    /// [`Metric::ChargedActions`](super::Metric::ChargedActions); none in logs of earlier versions.
    #[serde(default)]
    pub charged_actions: Option<u64>,
}

/// Results of the practice before the first episode.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Practised {
    /// Number of rollouts towards each practised stage, in order.
    pub rollouts: Vec<u32>,
    /// Number of these that reached it.
    pub reached: Vec<u32>,
    /// Number of actions in the environment.
    pub actions: u64,
}

/// An event of a run.
///
/// # Order
///
/// Every process that trains the run writes
///
/// 1. [`Started`](Event::Started), once, in a new run followed by [`Practised`](Event::Practised) if there was practice;
/// 2. any number of times, in the order of `episode`: [`EpisodeFinished`](Event::EpisodeFinished),
///    then, if they apply to that episode, [`Evaluated`](Event::Evaluated), then
///    [`Checkpointed`](Event::Checkpointed). Anywhere between these there may be a
///    [`ScheduleChanged`](Event::ScheduleChanged), a [`ClustersChanged`](Event::ClustersChanged), a
///    [`NeedsChanged`](Event::NeedsChanged), a [`Warned`](Event::Warned), or a [`Paused`](Event::Paused)
///    that is followed by [`Resumed`](Event::Resumed) before the next `EpisodeFinished`;
/// 3. exactly one of [`Finished`](Event::Finished), [`Stopped`](Event::Stopped) and
///    [`Failed`](Event::Failed), and nothing after it. If it is missing and no process holds
///    the run's lock, the process exited unexpectedly.
///
/// `Checkpointed` is written after the checkpoint is safely on disk, with all its copies. A run that
/// stops or pauses when no checkpoint is due is saved as well, but without the event, unless the
/// checkpoint includes a change made since the episode, such as another schedule. A process that
/// resumes a run first removes everything after the `Checkpointed` of its checkpoint. If the previous
/// process was killed before it wrote that event, it completes the checkpoint and writes the event. If
/// the checkpoint has no event, it removes everything from the `Stopped` or `Paused` on. Then it begins
/// at 1. So an interrupted run has the same events as an uninterrupted one, plus a `Started` for each
/// time it was resumed.
///
/// `episode` is always the number of episodes finished so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Event {
    /// A process begins to train the run.
    Started {
        /// Program, processor and models.
        #[serde(flatten)]
        origin: Origin,
        /// Name of the task.
        task: String,
        /// Name of the method.
        method: String,
        /// Master seed.
        seed: u64,
        /// Total number of episodes of the run.
        episodes: u64,
        /// Episodes already finished: 0 for a new run, the checkpoint's episode after a resume.
        episode: u64,
        /// What was wrong with the files, such as checkpoints that could not be used.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        problems: Vec<String>,
        /// What differs from the origin of the earlier episodes, so that the results may differ from those of an
        /// uninterrupted run.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        changes: Vec<String>,
    },
    /// The agent practised before its first episode.
    Practised(Practised),
    /// An episode ended.
    EpisodeFinished(EpisodeRecord),
    /// The greedy policy was evaluated.
    Evaluated {
        /// Episodes finished so far.
        episode: u64,
        /// Evaluation episodes.
        episodes: u64,
        /// Fraction of them that reached the goal.
        #[serde(with = "number::required")]
        success: f64,
        /// Their mean return.
        #[serde(with = "number::required")]
        mean_return: f64,
    },
    /// A checkpoint is on disk.
    Checkpointed {
        /// Episodes finished so far.
        episode: u64,
        /// Names under which it was saved, such as `last` and `best`.
        names: Vec<String>,
    },
    /// Training pauses.
    Paused {
        /// Episodes finished so far.
        episode: u64,
    },
    /// Training continues after a pause.
    Resumed {
        /// Episodes finished so far.
        episode: u64,
    },
    /// Another epsilon schedule applies from the next episode on.
    ScheduleChanged {
        /// Episodes finished so far.
        episode: u64,
        /// The schedule in text form, such as `linear:0.8:0.05:2000`.
        schedule: String,
    },
    /// Another action prior applies from the next episode on.
    ClustersChanged {
        /// Episodes finished so far.
        episode: u64,
        /// Number of clusters of each stage, the goal last.
        clusters: Vec<u32>,
        /// Whether a user gave them; otherwise the training built or refined them itself. Earlier versions did not
        /// write it.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        given: bool,
    },
    /// The needs for exploration have changed; only with an epsilon schedule by need.
    NeedsChanged {
        /// Episodes finished so far.
        episode: u64,
        /// Share of the latest greedy attempts at each stage that failed, the goal last; empty once epsilon no longer
        /// depends on need.
        needs: Vec<f32>,
    },
    /// Something was wrong that does not end the run, such as a request that cannot be carried out.
    Warned {
        /// Episodes finished so far.
        episode: u64,
        /// What was wrong, in one line.
        problem: String,
    },
    /// All episodes are done.
    Finished {
        /// Episodes finished.
        episode: u64,
    },
    /// The run was ended early; it can be resumed.
    Stopped {
        /// Episodes finished so far.
        episode: u64,
        /// Who or what requested it.
        reason: String,
    },
    /// An error ended the run; it can be resumed from its last checkpoint.
    Failed {
        /// Episodes finished so far.
        episode: u64,
        /// The error, in one line.
        reason: String,
    },
}

impl Event {
    /// The epsilon schedule that it sets.
    pub fn schedule(&self) -> Option<&str> {
        if let Self::ScheduleChanged { schedule, .. } = self { Some(schedule) } else { None }
    }

    /// Whether the event changes the course of the run or shows an interruption: another schedule, other
    /// clusters, a pause, a resume by another process. The initial events of a run do not count.
    pub fn is_intervention(&self) -> bool {
        match self {
            Event::Started { episode, .. } | Event::ClustersChanged { episode, .. } => *episode > 0,
            Event::ScheduleChanged { .. } | Event::Paused { .. } => true,
            _ => false,
        }
    }

    /// The record of the episode, if it tells that one has finished.
    pub fn record(&self) -> Option<&EpisodeRecord> {
        match self {
            Event::EpisodeFinished(record) => Some(record),
            _ => None,
        }
    }

    /// Number of episodes finished when this happened.
    pub fn episode(&self) -> u64 {
        match self {
            Event::EpisodeFinished(record) => record.episode,
            Event::Practised(_) => 0,
            Event::Started { episode, .. }
            | Event::Evaluated { episode, .. }
            | Event::Checkpointed { episode, .. }
            | Event::Paused { episode }
            | Event::Resumed { episode }
            | Event::ScheduleChanged { episode, .. }
            | Event::ClustersChanged { episode, .. }
            | Event::NeedsChanged { episode, .. }
            | Event::Warned { episode, .. }
            | Event::Finished { episode }
            | Event::Stopped { episode, .. }
            | Event::Failed { episode, .. } => *episode,
        }
    }
}

impl fmt::Display for Event {
    /// One line of text, as in `log.txt`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Event::Started { origin, task, method, seed, episodes, episode, problems, changes } => {
                write!(f, "mge {}: {method} on {task}, seed {seed}, ", origin.mge_version)?;
                match episode < episodes {
                    true => write!(f, "episodes {} to {episodes}", episode + 1)?,
                    false => write!(f, "no episode left of {episodes}")?,
                }
                problems.iter().try_for_each(|problem| write!(f, "; {problem}"))?;
                match changes.join("; ") {
                    changes if changes.is_empty() => Ok(()),
                    changes => write!(f, "; results may differ from those of an uninterrupted run: {changes}"),
                }
            }
            Event::Practised(Practised { rollouts, reached, actions }) => {
                write!(f, "practice: {reached:?} of {rollouts:?} rollouts reached their stage, {actions} actions")
            }
            Event::EpisodeFinished(record) => write!(
                f,
                "episode {}: return {:.2}, subgoals {}/{}, {}, success {:.0} %",
                record.episode,
                record.return_,
                record.subgoals,
                record.subgoals_total,
                record.end,
                100.0 * record.rolling_success
            ),
            Event::Evaluated { episode, episodes, success, mean_return } => {
                let reached = if *episodes == 1 {
                    format!("{success:.0} of 1 episodes")
                } else {
                    format!("{:.0} % of {episodes} episodes", 100.0 * success)
                };
                write!(
                    f,
                    "episode {episode}: greedy policy reaches the goal in {reached}, mean return {mean_return:.2}"
                )
            }
            Event::Checkpointed { episode, names } => {
                write!(f, "episode {episode}: checkpoint saved as {}", names.join(", "))
            }
            Event::Paused { episode } => write!(f, "episode {episode}: paused"),
            Event::Resumed { episode } => write!(f, "episode {episode}: resumed"),
            Event::ScheduleChanged { episode, schedule } => {
                write!(f, "episode {episode}: epsilon is now {schedule}")
            }
            Event::ClustersChanged { episode, clusters, .. } => {
                write!(f, "episode {episode}: new action clusters, {clusters:?} by stage")
            }
            Event::NeedsChanged { episode, needs } if needs.is_empty() => {
                write!(f, "episode {episode}: epsilon no longer depends on need")
            }
            Event::NeedsChanged { episode, needs } => {
                write!(f, "episode {episode}: need for exploration {needs:.2?} by stage")
            }
            Event::Warned { problem, .. } => f.write_str(problem),
            Event::Finished { episode } => write!(f, "finished after {}", counted(*episode, "episode")),
            Event::Stopped { episode, reason } => write!(f, "stopped after {}: {reason}", counted(*episode, "episode")),
            Event::Failed { episode, reason } => write!(f, "failed after {}: {reason}", counted(*episode, "episode")),
        }
    }
}

/// An event with the time when it was written: a line of `events.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoggedEvent {
    /// Seconds since 1970-01-01 UTC.
    pub time: f64,
    /// The event.
    #[serde(flatten)]
    pub event: Event,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(event: Event, line: &str) {
        let logged = LoggedEvent { time: 1.5, event };
        let text = serde_json::to_string(&logged).unwrap();
        assert_eq!(text, line);
        assert_eq!(serde_json::from_str::<LoggedEvent>(&text).unwrap(), logged);
    }

    #[test]
    fn practice_is_counted_by_stage() {
        let practised = Practised { rollouts: vec![25, 20], reached: vec![3, 4], actions: 70 };
        let line = Event::Practised(practised).to_string();
        assert_eq!(line, "practice: [3, 4] of [25, 20] rollouts reached their stage, 70 actions");
    }

    #[test]
    fn lines_of_text_count_episodes_and_name_stages() {
        let evaluated = |episodes, success| Event::Evaluated { episode: 10, episodes, success, mean_return: 12.04 };
        let needs = |needs| Event::NeedsChanged { episode: 4, needs };
        for (event, line) in [
            (Event::Finished { episode: 1 }, "finished after 1 episode"),
            (Event::Stopped { episode: 0, reason: "asked".into() }, "stopped after 0 episodes: asked"),
            (evaluated(1, 1.0), "episode 10: greedy policy reaches the goal in 1 of 1 episodes, mean return 12.04"),
            (
                evaluated(50, 0.5),
                "episode 10: greedy policy reaches the goal in 50 % of 50 episodes, mean return 12.04",
            ),
            (needs(vec![0.05, 1.0]), "episode 4: need for exploration [0.05, 1.00] by stage"),
            (needs(Vec::new()), "episode 4: epsilon no longer depends on need"),
        ] {
            assert_eq!(event.to_string(), line);
        }
    }

    #[test]
    fn lines_keep_their_format() {
        check(
            Event::Started {
                origin: Origin { mge_version: "0.1.0".into(), ..Origin::default() },
                task: "task1".into(),
                method: "ddpg-mge".into(),
                seed: 7,
                episodes: 100,
                episode: 0,
                problems: Vec::new(),
                changes: Vec::new(),
            },
            r#"{"time":1.5,"type":"started","mge_version":"0.1.0","task":"task1","method":"ddpg-mge","seed":7,"episodes":100,"episode":0}"#,
        );
        check(
            Event::Evaluated { episode: 10, episodes: 5, success: 0.4, mean_return: f64::INFINITY },
            r#"{"time":1.5,"type":"evaluated","episode":10,"episodes":5,"success":0.4,"mean_return":"inf"}"#,
        );
        check(
            Event::NeedsChanged { episode: 4, needs: vec![0.05, 1.0] },
            r#"{"time":1.5,"type":"needs_changed","episode":4,"needs":[0.05,1.0]}"#,
        );
        check(Event::Paused { episode: 3 }, r#"{"time":1.5,"type":"paused","episode":3}"#);
        check(
            Event::EpisodeFinished(EpisodeRecord {
                episode: 2,
                steps: 20,
                environment_steps: 31,
                return_: -0.25,
                critic_loss: Some(0.5),
                end: "time limit".into(),
                truncated: true,
                ..Default::default()
            }),
            r#"{"time":1.5,"type":"episode_finished","episode":2,"steps":20,"environment_steps":31,"return":-0.25,"goal":false,"subgoals":0,"subgoals_total":0,"guided":false,"epsilon":0.0,"noise_sigma":0.0,"critic_loss":0.5,"mean_q":null,"max_q":null,"actor_loss":null,"action_saturation":null,"rolling_success":0.0,"terminated":false,"truncated":true,"end":"time limit","placed":0,"blocked":0,"charged_actions":null}"#,
        );
    }

    #[test]
    fn unknown_types_are_refused_by_name() {
        let error = serde_json::from_str::<LoggedEvent>(r#"{"time":1.0,"type":"exploded"}"#).unwrap_err().to_string();
        assert!(error.contains("exploded"), "{error}");
    }
}
