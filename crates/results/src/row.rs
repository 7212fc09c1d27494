//! Training results, one row per run.

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use super::settings::Settings;
use mge_guidance::EpsilonSchedule;
use mge_run::RunHistory;
use mge_stats::efficiency::{Efficiency, efficiency};
use mge_stats::rolling::{WINDOW, rolling_mean};
use mge_trainer::RunConfig;

/// The results of one training.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LearningRow {
    /// Name of the task.
    pub task: String,
    /// Name of the method, such as `ddpg-mge`.
    pub method: String,
    /// The epsilon schedule; 0 for a method without one, and where it has no effect.
    pub epsilon: String,
    /// Whether this is not the schedule that its method has by default.
    #[serde(skip)]
    pub own_epsilon: bool,
    /// Whether its success ended it.
    #[serde(skip)]
    pub is_solved: bool,
    /// The threshold after the last of its episodes, if the schedule would go on then.
    #[serde(skip)]
    pub end: Option<String>,
    /// Its other settings that are not the defaults of its method and in which the runs it is compared with differ, by JSON
    /// path, with its effective values.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub settings: Settings,
    /// Those that are the defaults of its method; labels leave them out.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub implied: Settings,
    /// The name that users gave the run; empty if they gave none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Master seed.
    pub seed: u64,
    /// Number of episodes trained.
    pub episodes: u64,
    /// Episodes to thresholds, area under the curve, final success.
    #[serde(flatten)]
    pub efficiency: Efficiency,
    /// Number of actions, in its episodes and in practice, until 80 % of the last window reached the goal.
    #[serde(default)]
    pub actions_to_80: Option<u64>,
    /// Number of charged actions until then: also those for the clusters, the model and the subgoals.
    #[serde(default)]
    pub charged_to_80: Option<u64>,
    /// Area under the curve of the rolling success against charged actions, 0 to 1, up to the same number of actions
    /// for all runs on the task that it is compared with.
    #[serde(default)]
    pub charged_area: Option<f64>,
    /// Number of all charged actions.
    #[serde(default)]
    pub charged_actions: Option<u64>,
    /// Number of actions in the real environment outside its episodes and practice: for the clusters and the model. This
    /// and the other charged actions are missing in runs of earlier versions, which did not count them.
    #[serde(default, alias = "charged")]
    pub charged_outside: Option<u64>,
    /// Mean success of the greedy evaluations in the last tenth of the run.
    pub greedy_success: Option<f64>,
}

/// The data of a training for figures: its results and curves, without its long history.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedRun {
    /// Its results.
    pub row: LearningRow,
    /// Numbers of episodes and the rolling success after them.
    pub training: Vec<[f64; 2]>,
    /// Numbers of episodes and the mean success of the latest greedy evaluations.
    pub greedy: Vec<[f64; 2]>,
    /// Numbers of actions in episodes and practice, and the rolling success after them.
    pub actions: Vec<[f64; 2]>,
    /// Numbers of charged actions and the rolling success after them.
    pub charged: Vec<[f64; 2]>,
}

/// Maximum number of points of a learning curve.
pub(super) const CURVE_POINTS: usize = 100;
/// Maximum number of points of a learning curve of which a part is shown.
const FINE_POINTS: usize = 1000;
/// Maximum number of points of the curve of greedy evaluations.
const GREEDY_POINTS: usize = 1000;
/// Number of greedy evaluations averaged in a point, as a single one is often 0 or 1.
pub(super) const EVALUATIONS: NonZeroUsize = NonZeroUsize::new(10).unwrap();

impl TrainedRun {
    /// The run with this configuration and history.
    pub fn new(config: &RunConfig, history: &RunHistory) -> Self {
        Self::with_points(config, history, CURVE_POINTS)
    }

    /// The same run with more points, between which the moving averages of `smooth` points span as much.
    pub(super) fn refined(self, config: &RunConfig, history: &RunHistory, smooth: &mut usize) -> Self {
        let fine = Self::with_points(config, history, FINE_POINTS);
        // A single point is not smoothed.
        if *smooth > 1 {
            *smooth *= fine.training.len().div_ceil(self.training.len().max(1));
        }
        Self { row: self.row, ..fine }
    }

    fn with_points(config: &RunConfig, history: &RunHistory, points: usize) -> Self {
        let row = LearningRow::new(config, history);
        // Finished runs of a group have points at the same episodes, whether or not their success ended them.
        let is_unfinished = row.episodes < config.episodes.into() && !row.is_solved;
        let planned = if is_unfinished { 0 } else { config.episodes as usize };
        let every = history.records.len().max(planned).div_ceil(points).max(1);
        // And the last episode of a run that its success ended.
        let last = row.episodes;
        let is_shown = |episode: u64| episode.is_multiple_of(every as u64) || (row.is_solved && episode == last);
        let records = || history.records.iter().filter(|record| is_shown(record.episode));
        let successes: Vec<f64> = history.evaluations.iter().map(|evaluation| evaluation.success).collect();
        let planned = config.episodes.checked_div(config.evaluation.every).unwrap_or(0) as usize;
        let greedy_every = successes.len().max(planned).div_ceil(GREEDY_POINTS).max(1);
        let greedy = history.evaluations.iter().zip(rolling_mean(&successes, EVALUATIONS));
        let greedy = greedy.skip(greedy_every - 1).step_by(greedy_every);
        Self {
            training: records().map(|record| [record.episode as f64, record.rolling_success]).collect(),
            greedy: greedy.map(|(evaluation, success)| [evaluation.episode as f64, success]).collect(),
            actions: records().map(|record| [record.environment_steps as f64, record.rolling_success]).collect(),
            charged: records()
                .filter_map(|record| Some([record.charged_actions? as f64, record.rolling_success]))
                .collect(),
            row,
        }
    }
}

impl LearningRow {
    /// The row of a run with this configuration and history, before
    /// [`distinguish`](super::settings::distinguish) adds settings.
    pub fn new(config: &RunConfig, history: &RunHistory) -> Self {
        let successes: Vec<bool> = history.records.iter().map(|record| record.goal).collect();
        let last = history.records.last();
        let is_solved = last.is_some_and(|last| config.is_solved(last.episode, last.rolling_success));
        let end = if is_solved { successes.len() as u64 } else { config.episodes.into() };
        let last_tenth = end * 9 / 10;
        let greedy = history.evaluations.iter().filter(|evaluation| evaluation.episode > last_tenth);
        let greedy: Vec<f64> = greedy.map(|evaluation| evaluation.success).collect();
        let efficiency = efficiency(&successes, WINDOW);
        // Without clusters, exploration by need adds noise where it is needed, and all other schedules are the same.
        let by_need = matches!(config.epsilon, EpsilonSchedule::Need { .. });
        let has_schedule = config.method.uses("epsilon") && (config.method.has_clusters() || by_need);
        let at_80 = efficiency.episodes_to_80.map(|episodes| &history.records[episodes as usize - 1]);
        Self {
            task: config.task.name.clone(),
            method: config.method.name().to_owned(),
            epsilon: if has_schedule { config.epsilon.to_string() } else { "0".to_owned() },
            own_epsilon: config.epsilon != RunConfig::default_for(config.task.clone(), config.method).epsilon,
            is_solved,
            end: config.epsilon.unreached(config.episodes).map(|(_, end)| end.to_string()),
            seed: config.seed,
            episodes: successes.len() as u64,
            efficiency,
            actions_to_80: at_80.map(|record| record.environment_steps),
            charged_to_80: at_80.and_then(|record| record.charged_actions),
            charged_actions: last.and_then(|record| record.charged_actions),
            // Charged, but not taken in episodes or practice.
            charged_outside: last
                .and_then(|record| Some(record.charged_actions?.saturating_sub(record.environment_steps))),
            greedy_success: (!greedy.is_empty()).then(|| greedy.iter().sum::<f64>() / greedy.len() as f64),
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mge_run::EvaluationRecord;

    #[test]
    fn the_curve_of_many_evaluations_is_thinned_evenly() {
        let mut config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        config.evaluation.every = 1;
        for (evaluations, [first, last, points]) in [(1000, [1.0, 1000.0, 1000.0]), (2500, [3.0, 2499.0, 833.0])] {
            config.episodes = evaluations;
            let mut history = RunHistory::default();
            for episode in 1..=u64::from(evaluations) {
                history.evaluations.push(EvaluationRecord { episode, success: 1.0, mean_return: 0.0 });
            }
            let greedy = TrainedRun::new(&config, &history).greedy;
            assert_eq!([greedy[0][0], greedy[greedy.len() - 1][0], greedy.len() as f64], [first, last, points]);
        }
    }
}
