//! The metrics of an episode, in one table.
//!
//! The table defines the columns of `metrics.csv` and the fields of an event, the tags of TensorBoard and
//! the curves on screen. The glossary below is generated from it.
//!
#![doc = include_str!("../metrics.md")]

use super::event::EpisodeRecord;

/// The direction in which a metric should move as an agent learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// More is better.
    Higher,
    /// Less is better.
    Lower,
    /// Neither is better.
    Neutral,
}

/// The description of a metric: a row of the table.
#[derive(Clone, Copy, Debug)]
pub struct MetricInfo {
    /// Column of `metrics.csv` and field of the event; for a derived metric, just a name.
    pub name: &'static str,
    /// Title of its curve.
    pub title: &'static str,
    /// Unit of its values, such as `actions`; empty for a dimensionless number.
    pub unit: &'static str,
    /// The direction in which it should move.
    pub direction: Direction,
    /// Range of its axis, if its values are bounded.
    pub range: Option<[f32; 2]>,
    /// Tag in TensorBoard, if it is shown there.
    pub tag: Option<&'static str>,
    /// How it is computed.
    pub formula: &'static str,
    /// What it means and what to watch for.
    pub meaning: &'static str,
    /// Its value in an episode's record; `None` if there is none yet.
    pub value: fn(&EpisodeRecord) -> Option<f64>,
}

/// Generates the enum, whose doc comments are the `meaning`s, and the table from one list.
macro_rules! metrics {
    ($($(#[doc = $meaning:literal])+ $metric:ident: $name:literal, $title:literal, $unit:literal, $direction:ident,
       $range:expr, $tag:expr, $formula:literal, $value:expr;)+) => {
        /// A metric of an episode.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Metric {
            $($(#[doc = $meaning])+ $metric,)+
        }

        impl Metric {
            /// All of them, in the order of the columns of `metrics.csv`.
            pub const ALL: &[Self] = &[$(Self::$metric),+];

            /// Its row of the table.
            pub fn info(self) -> &'static MetricInfo {
                static TABLE: &[MetricInfo] = &[$(MetricInfo {
                    name: $name,
                    title: $title,
                    unit: $unit,
                    direction: Direction::$direction,
                    range: $range,
                    tag: $tag,
                    formula: $formula,
                    meaning: concat!($($meaning),+),
                    value: $value,
                }),+];
                &TABLE[self as usize]
            }
        }
    };
}

const SHARE: Option<[f32; 2]> = Some([0.0, 1.0]);

fn zero_or_one(value: bool) -> Option<f64> {
    Some(f64::from(u8::from(value)))
}

// One row per metric: name, title, unit, direction, range, tag; formula, value.
metrics! {
    /// Actions of the episode.
    Actions: "steps", "actions in an episode", "actions", Neutral, None, Some("train/steps"),
        "T", |record| Some(record.steps as f64);
    /// Actions of the whole run so far, those of practice included.
    EnvironmentSteps: "environment_steps", "actions so far", "actions", Neutral, None, Some("train/environment_steps"),
        "Σ T", |record| Some(record.environment_steps as f64);
    /// Rewards of the episode, not discounted.
    Return: "return", "return", "reward", Higher, None, Some("train/return"),
        "Σ r", |record| Some(record.return_.into());
    /// Whether the goal was reached.
    Goal: "goal", "goal reached", "", Higher, SHARE, Some("train/goal"),
        "1 if reached, else 0", |record| zero_or_one(record.goal);
    /// Subgoals reached.
    Subgoals: "subgoals", "subgoals reached", "subgoals", Higher, None, Some("train/subgoals"),
        "count", |record| Some(record.subgoals.into());
    /// Subgoals of the task.
    SubgoalsTotal: "subgoals_total", "subgoals of the task", "subgoals", Neutral, None, None,
        "count", |record| Some(record.subgoals_total.into());
    /// Whether any action was drawn from the action clusters.
    Guided: "guided", "guided episode", "", Neutral, SHARE, Some("train/guided"),
        "1 if any, else 0", |record| zero_or_one(record.guided);
    /// Threshold of guided exploration: probability that actions come from clusters.
    Epsilon: "epsilon", "epsilon", "share", Neutral, SHARE, Some("train/epsilon"),
        "the schedule at this episode; by need: its mean over the stages", |record| Some(record.epsilon.into());
    /// Standard deviation of a kick of the exploration noise.
    Noise: "noise_sigma", "exploration noise", "normalised", Neutral, None, Some("train/noise_sigma"),
        "`ou.sigma` times the scale of `noise_decay`", |record| Some(record.noise_sigma.into());
    /// Mean squared Bellman error. Growth: the critic diverges.
    CriticLoss: "critic_loss", "critic loss", "reward²", Lower, None, Some("loss/critic"),
        "1/N Σ (Q(s, a) - y)², y = clamp(r + γ (1 - d) Q'(s', μ'(s')))", |record| record.critic_loss.map(f64::from);
    /// Value of the actions in the minibatches. Above the greatest possible return: overestimation.
    MeanQ: "mean_q", "mean Q", "reward", Neutral, None, Some("train/mean_q"),
        "1/N Σ Q(s, a)", |record| record.mean_q.map(f64::from);
    /// Greatest value of an action in the episode's minibatches. Shows overestimation sooner.
    MaxQ: "max_q", "greatest Q", "reward", Neutral, None, Some("train/max_q"),
        "max Q(s, a)", |record| record.max_q.map(f64::from);
    /// Minus the value that the actor expects of its own actions. With imitation, it is in units of its mean
    /// magnitude, and the weighted distance from the imitated actions is added.
    ActorLoss: "actor_loss", "actor loss", "reward", Lower, None, Some("loss/actor"),
        "-1/N Σ Q(s, μ(s))", |record| record.actor_loss.map(f64::from);
    /// Share of the actor's outputs at the edge of the action space. Near 1: the actor is stuck at
    /// its bounds, where tanh passes no gradient.
    Saturation: "action_saturation", "action saturation", "share", Lower, SHARE, Some("train/action_saturation"),
        "share of components of μ(s) with magnitude above 0.99", |record| record.action_saturation.map(f64::from);
    /// Share of the last 100 episodes, or of all so far, that reached the goal.
    Success: "rolling_success", "success rate (last 100)", "share", Higher, SHARE, Some("train/success_rolling"),
        "mean of `goal` over the window", |record| Some(record.rolling_success);
    /// Whether the episode ended by the task's own rules.
    Terminated: "terminated", "ended by the rules", "", Neutral, SHARE, None,
        "1 if so, else 0", |record| zero_or_one(record.terminated);
    /// Whether the episode ended by the limit of actions.
    Truncated: "truncated", "ended by the limit of actions", "", Neutral, SHARE, None,
        "1 if so, else 0", |record| zero_or_one(record.truncated);
    /// Tools placed.
    Placed: "placed", "tools placed", "tools", Neutral, None, None,
        "count", |record| Some(record.placed.into());
    /// Actions that were blocked or invalid, so that no tool was placed.
    Blocked: "blocked", "blocked actions", "actions", Lower, None, Some("train/blocked"),
        "count", |record| Some(record.blocked.into());
    /// Every action in the environment that the run has cost so far: those of its episodes and of practice, the real
    /// rollouts for its clusters and plans, the launches of its dynamics model, and the search for the task's subgoals.
    ChargedActions: "charged_actions", "charged actions", "actions", Neutral, None, None,
        "Σ T + rollouts + launches + search", |record| record.charged_actions.map(|charged| charged as f64);
    /// Share of the task's subgoals that were reached; derived, no column of its own.
    SubgoalShare: "subgoal_share", "hits by subgoal", "share", Higher, SHARE, None,
        "`subgoals` / `subgoals_total`", |record| Some(f64::from(record.subgoals) / f64::from(record.subgoals_total.max(1)));
}

impl Metric {
    /// The metrics that are kept for curves: those that are drawn, and those that they can be drawn against.
    pub const KEPT: [Self; 12] = [
        Self::Success,
        Self::Return,
        Self::SubgoalShare,
        Self::CriticLoss,
        Self::ActorLoss,
        Self::MeanQ,
        Self::Saturation,
        Self::Epsilon,
        Self::Noise,
        Self::Actions,
        Self::EnvironmentSteps,
        Self::ChargedActions,
    ];

    /// The metrics with a curve on screen, in this order: the first of those that are kept.
    pub const CURVES: [Self; 10] = *Self::KEPT.first_chunk().unwrap();

    /// Its value in an episode; NaN if there is none yet.
    pub fn of(self, record: &EpisodeRecord) -> f64 {
        (self.info().value)(record).unwrap_or(f64::NAN)
    }

    /// Title of its curve.
    pub fn title(self) -> &'static str {
        self.info().title
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::Value;

    use super::*;

    fn record() -> EpisodeRecord {
        EpisodeRecord {
            episode: 3,
            steps: 5,
            environment_steps: 17,
            return_: 2.5,
            goal: true,
            subgoals: 1,
            subgoals_total: 4,
            guided: true,
            epsilon: 0.25,
            noise_sigma: 0.125,
            critic_loss: Some(0.5),
            mean_q: Some(-1.5),
            max_q: Some(3.0),
            actor_loss: Some(1.75),
            action_saturation: Some(0.0625),
            rolling_success: 0.75,
            terminated: true,
            truncated: false,
            end: "goal".into(),
            placed: 2,
            blocked: 6,
            charged_actions: Some(170),
        }
    }

    /// A field that is missing in the table would be missing from all curves and tags; a row that
    /// reads another field would be shown under a wrong name.
    #[test]
    fn table_and_record_agree_field_by_field() {
        let Value::Object(fields) = serde_json::to_value(record()).unwrap() else { panic!("a record is an object") };
        let number = |value: &Value| value.as_f64().or(value.as_bool().map(|flag| f64::from(u8::from(flag))));
        let written = fields.iter().filter(|(name, _)| *name != "episode");
        let written: Vec<(&str, f64)> =
            written.filter_map(|(name, value)| Some((name.as_str(), number(value)?))).collect();
        let columns = Metric::ALL.iter().filter(|metric| **metric != Metric::SubgoalShare);
        let table: Vec<(&str, f64)> = columns.map(|metric| (metric.info().name, metric.of(&record()))).collect();
        assert_eq!(table, written);
        assert_eq!(Metric::SubgoalShare.of(&record()), 0.25);
    }

    #[test]
    fn metrics_without_a_value_are_nan() {
        for metric in [Metric::CriticLoss, Metric::MeanQ, Metric::MaxQ, Metric::ActorLoss, Metric::Saturation] {
            assert!(metric.of(&EpisodeRecord::default()).is_nan(), "{metric:?}");
        }
    }

    #[test]
    fn names_titles_and_tags_are_unique() {
        let of = |text: fn(&MetricInfo) -> &'static str| -> BTreeSet<_> {
            Metric::ALL.iter().map(|metric| text(metric.info())).collect()
        };
        assert_eq!(of(|info| info.name).len(), Metric::ALL.len());
        assert_eq!(of(|info| info.title).len(), Metric::ALL.len());
        let tags: Vec<_> = Metric::ALL.iter().filter_map(|metric| metric.info().tag).collect();
        assert_eq!(tags.iter().collect::<BTreeSet<_>>().len(), tags.len());
        assert!(tags.iter().all(|tag| tag.starts_with("train/") || tag.starts_with("loss/")));
    }

    /// The text of the glossary page.
    fn glossary() -> String {
        let mut text = "# Metrics\n\n\
            One value an episode, in the columns of `metrics.csv`, the events of `events.jsonl` and the curves.\n\
            Symbols: observation s, action a, reward r, next observation s', terminated d, actor μ, critic Q,\n\
            targets μ' and Q', batch size N, discount γ; actions of μ and μ' are those that acting takes, within\n\
            [-1, 1]. Losses, Q and saturation are means over the updates of the episode (the greatest Q: their\n\
            maximum), each over the minibatch before the networks change, and\n\
            empty until the first update. The columns `episode` and `end` are the number of the episode, from 1, and why it \
            ended: `goal`, `left the screen`, `marker left the screen`, `standstill` or `out of actions`.\n\n\
            | name | title | unit | better | formula | meaning | TensorBoard |\n|---|---|---|---|---|---|---|\n"
            .to_owned();
        for metric in Metric::ALL {
            let MetricInfo { name, title, unit, direction, formula, meaning, tag, .. } = metric.info();
            let direction = match direction {
                Direction::Higher => "higher",
                Direction::Lower => "lower",
                Direction::Neutral => "",
            };
            let tag = tag.map(|tag| format!("`{tag}`")).unwrap_or_default();
            text +=
                &format!("| `{name}` | {title} | {unit} | {direction} | {formula} | {} | {tag} |\n", meaning.trim());
        }
        text
    }

    /// `MGE_UPDATE_GOLDEN=1 cargo test metric` regenerates the page.
    #[test]
    fn the_glossary_page_matches_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/metrics.md");
        if std::env::var_os("MGE_UPDATE_GOLDEN").is_some() {
            std::fs::write(path, glossary()).unwrap();
        }
        assert_eq!(std::fs::read_to_string(path).unwrap(), glossary());
    }
}
