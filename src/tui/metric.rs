//! The numbers of an episode that have a curve.

use crate::run::EpisodeRecord;

/// A number of each episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Share of the last 100 episodes that reached the goal.
    Success,
    /// Sum of the rewards of the episode.
    Return,
    /// Subgoals reached, of all.
    Subgoals,
    /// Mean squared Bellman error.
    CriticLoss,
    /// Minus the mean Q of the actor's own actions.
    ActorLoss,
    /// Mean Q over the minibatches.
    MeanQ,
    /// Share of the actor's outputs at the edge of the action space.
    Saturation,
    /// Epsilon threshold.
    Epsilon,
    /// Standard deviation of the exploration noise.
    Noise,
    /// Actions in the episode.
    Actions,
}

impl Metric {
    /// The values of an episode, in the order of [`Metric::ALL`]; NaN for what there is not.
    pub fn values(record: &EpisodeRecord) -> [f32; Self::ALL.len()] {
        let share = f64::from(record.subgoals) / f64::from(record.subgoals_total.max(1));
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        Self::ALL.map(|metric| {
            (match metric {
                Self::Success => record.rolling_success,
                Self::Return => record.return_,
                Self::Subgoals => share,
                Self::CriticLoss => number(record.critic_loss),
                Self::ActorLoss => number(record.actor_loss),
                Self::MeanQ => number(record.mean_q),
                Self::Saturation => number(record.action_saturation),
                Self::Epsilon => record.epsilon,
                Self::Noise => record.noise_sigma,
                Self::Actions => record.steps as f64,
            }) as f32
        })
    }

    /// All of them, in the order of the screens.
    pub const ALL: [Self; 10] = [
        Self::Success,
        Self::Return,
        Self::Subgoals,
        Self::CriticLoss,
        Self::ActorLoss,
        Self::MeanQ,
        Self::Saturation,
        Self::Epsilon,
        Self::Noise,
        Self::Actions,
    ];

    /// Title of its curve.
    pub fn title(self) -> &'static str {
        match self {
            Self::Success => "success rate (last 100)",
            Self::Return => "return",
            Self::Subgoals => "hits by subgoal",
            Self::CriticLoss => "critic loss",
            Self::ActorLoss => "actor loss",
            Self::MeanQ => "mean Q",
            Self::Saturation => "action saturation",
            Self::Epsilon => "epsilon",
            Self::Noise => "exploration noise",
            Self::Actions => "actions in an episode",
        }
    }

    /// The range its axis always shows, if there is one.
    pub fn range(self) -> Option<[f32; 2]> {
        matches!(self, Self::Success | Self::Subgoals | Self::Saturation | Self::Epsilon).then_some([0.0, 1.0])
    }
}

/// One value an episode for every metric; NaN where there is none.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    values: [Vec<f32>; Metric::ALL.len()],
}

impl Curves {
    /// The values of a metric, the first episode first.
    pub fn get(&self, metric: Metric) -> &[f32] {
        &self.values[metric as usize]
    }

    /// Adds an episode: a value for each metric, in the order of [`Metric::ALL`].
    pub fn push(&mut self, values: [f32; Metric::ALL.len()]) {
        for (curve, value) in self.values.iter_mut().zip(values) {
            curve.push(value);
        }
    }

    /// Forgets all but the first `episodes` episodes.
    pub fn truncate(&mut self, episodes: usize) {
        self.values.iter_mut().for_each(|curve| curve.truncate(episodes));
    }

    /// Episodes.
    pub fn episodes(&self) -> usize {
        self.values[0].len()
    }
}
