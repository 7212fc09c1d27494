//! The epsilon threshold as a function of the episode (paper, sections 4.3 and 5.4).

use std::str::FromStr;

use derive_more::Display;
use serde::{Deserialize, Serialize};

use mge_base::text::counted;

/// The threshold as a function of the episode. Its text form is the EPSILON SPEC of the command line.
#[derive(Debug, Clone, Display, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum EpsilonSchedule {
    /// `0.1`: the same in every episode.
    #[display("{_0}")]
    Constant(f32),
    /// `linear:FROM:TO:EPISODES`: linear over EPISODES, then constant.
    #[display("linear:{from}:{to}:{episodes}")]
    Linear { from: f32, to: f32, episodes: u32 },
    /// `exp:FROM:TO:FACTOR`: the distance to TO shrinks by FACTOR every episode.
    #[display("exp:{from}:{to}:{factor}")]
    Exponential { from: f32, to: f32, factor: f32 },
    /// `step:FROM:FACTOR:EPISODES`: multiplied by FACTOR every EPISODES episodes.
    #[display("step:{from}:{factor}:{episodes}")]
    Step { from: f32, factor: f32, episodes: u32 },
    /// `points:0=0.8,1000=0.3,3000=0`: linear between points.
    #[display("points:{}", points_text(_0))]
    Points(Vec<(u32, f32)>),
    /// `need:CLUSTERS:NOISE:ATTEMPTS`: depends on need instead of time, separately for each stage.
    /// The need of a stage is the share of failures among its last ATTEMPTS greedy attempts, where
    /// attempts not yet made count as failures. At the beginning of a stage, actions are drawn from
    /// its clusters with probability CLUSTERS times the need, the actor acts with noise with
    /// probability NOISE times the need, and otherwise without noise: a greedy attempt.
    #[display("need:{clusters}:{noise}:{attempts}")]
    Need { clusters: f32, noise: f32, attempts: u32 },
}

/// A text is not a valid schedule.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "epsilon `{text}`: {problem}; write 0.1, linear:0.8:0.05:2000, exp:0.8:0.05:0.999, step:0.8:0.5:500, points:0=0.8,1000=0.3 or need:0.25:0.25:10"
)]
pub struct ScheduleError {
    text: String,
    problem: String,
}

impl EpsilonSchedule {
    /// The threshold in an episode, counted from 0; always within [0, 1]. For `Need`, its maximum.
    pub fn threshold(&self, episode: u32) -> f32 {
        let value = match self {
            Self::Constant(value) => *value,
            Self::Linear { from, to, episodes } => {
                let share = (episode as f32 / *episodes as f32).min(1.0);
                from + (to - from) * share
            }
            Self::Exponential { from, to, factor } => to + (from - to) * factor.powf(episode as f32),
            Self::Step { from, factor, episodes } => from * factor.powf((episode / episodes) as f32),
            Self::Points(points) => interpolate(points, episode),
            Self::Need { clusters, .. } => *clusters,
        };
        value.clamp(0.0, 1.0)
    }

    /// A description for legends: `0.5 to 0 over 1,000 episodes`.
    pub fn describe(&self) -> String {
        match self {
            Self::Constant(value) => value.to_string(),
            Self::Linear { from, to, episodes } => format!("{from} to {to} over {} episodes", thousands(*episodes)),
            Self::Exponential { from, to, factor } => format!("{from} to {to} by the factor {factor} per episode"),
            Self::Step { from, factor, episodes } => {
                format!("{from}, times {factor} every {} episodes", thousands(*episodes))
            }
            Self::Points(points) => format!("drawn ({})", counted(points.len(), "point")),
            Self::Need { clusters, noise, attempts } => {
                format!("by need, {clusters} clusters and {noise} noise, over {attempts} greedy attempts")
            }
        }
    }

    /// If the schedule would still change after a run of `episodes` episodes: where it is heading, in words, and its
    /// value then. An exponential one counts as at its end once a quarter of the distance is left.
    pub fn unreached(&self, episodes: u32) -> Option<(String, f32)> {
        let end = self.threshold(episodes);
        let wanted = match self {
            Self::Linear { from, to, episodes: over } if *over > episodes && from != to => format!("not {to}"),
            Self::Exponential { from, to, factor } if from != to && factor.powf(episodes as f32) > 0.25 => {
                format!("not near {to}")
            }
            Self::Step { from, factor, episodes: every } if *every >= episodes && *factor < 1.0 && *from > 0.0 => {
                "before its first step".to_owned()
            }
            Self::Points(points) => {
                let (at, value) = points.last().filter(|(at, value)| *at > episodes && *value != end)?;
                format!("not {value} as at episode {at}")
            }
            _ => return None,
        };
        // Four digits: interpolation has rounding errors.
        Some((wanted, format!("{end:.3e}").parse().unwrap_or(end)))
    }

    /// Whether guidance is never used.
    pub fn is_zero(&self) -> bool {
        match self {
            Self::Constant(value) => *value == 0.0,
            Self::Linear { from, to, .. } | Self::Exponential { from, to, .. } => *from == 0.0 && *to == 0.0,
            Self::Step { from, .. } => *from == 0.0,
            Self::Points(points) => points.iter().all(|(_, value)| *value == 0.0),
            Self::Need { clusters, .. } => *clusters == 0.0,
        }
    }

    /// The schedule sampled at up to `count` points over `episodes` episodes, for editing. A schedule of
    /// points is returned unchanged.
    pub fn to_points(&self, episodes: u32, count: u32) -> Vec<(u32, f32)> {
        if let Self::Points(points) = self {
            return points.clone();
        }
        let count = count.max(2);
        let mut points: Vec<(u32, f32)> = (0..count)
            .map(|i| (u64::from(episodes) * u64::from(i) / u64::from(count - 1)) as u32)
            .map(|episode| (episode, self.threshold(episode)))
            .collect();
        points.dedup_by_key(|point| point.0);
        points
    }
}

/// A count with commas between thousands.
fn thousands(count: u32) -> String {
    let digits = count.to_string();
    let groups: Vec<&[u8]> = digits.as_bytes().rchunks(3).rev().collect();
    groups.iter().map(|group| String::from_utf8_lossy(group)).collect::<Vec<_>>().join(",")
}

fn interpolate(points: &[(u32, f32)], episode: u32) -> f32 {
    let after = points.partition_point(|(at, _)| *at <= episode);
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some((from, a)), Some((to, b))) => a + (b - a) * (episode - from) as f32 / (to - from) as f32,
        (Some((_, value)), None) => value,
        (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

impl FromStr for EpsilonSchedule {
    type Err = ScheduleError;

    fn from_str(text: &str) -> Result<Self, ScheduleError> {
        parse(text.trim()).map_err(|problem| ScheduleError { text: text.to_owned(), problem })
    }
}

fn parse(text: &str) -> Result<EpsilonSchedule, String> {
    let (kind, rest) = text.split_once(':').unwrap_or(("", text));
    let fields: Vec<&str> = rest.split(':').collect();
    match (kind, fields.as_slice()) {
        ("", [value]) => Ok(EpsilonSchedule::Constant(threshold(value)?)),
        ("linear", [from, to, episodes]) => {
            Ok(EpsilonSchedule::Linear { from: threshold(from)?, to: threshold(to)?, episodes: count(episodes)? })
        }
        ("exp", [from, to, factor]) => {
            Ok(EpsilonSchedule::Exponential { from: threshold(from)?, to: threshold(to)?, factor: threshold(factor)? })
        }
        ("step", [from, factor, episodes]) => {
            Ok(EpsilonSchedule::Step { from: threshold(from)?, factor: threshold(factor)?, episodes: count(episodes)? })
        }
        ("points", [points]) => Ok(EpsilonSchedule::Points(parse_points(points)?)),
        ("need", [clusters, noise, attempts]) => {
            let (clusters, noise) = (threshold(clusters)?, threshold(noise)?);
            if clusters + noise > 1.0 {
                return Err(format!("the sum of {clusters} and {noise} exceeds 1"));
            }
            Ok(EpsilonSchedule::Need { clusters, noise, attempts: count(attempts)? })
        }
        ("linear" | "exp" | "step" | "need", _) => Err(format!("`{kind}` takes three numbers")),
        _ => Err("unknown kind of schedule".to_owned()),
    }
}

fn parse_points(text: &str) -> Result<Vec<(u32, f32)>, String> {
    let mut points = Vec::new();
    for point in text.split(',') {
        let (episode, value) = point.split_once('=').ok_or_else(|| format!("`{point}` is not EPISODE=THRESHOLD"))?;
        let episode = episode.trim().parse().map_err(|_| format!("`{episode}` is not an episode number"))?;
        if points.last().is_some_and(|(last, _)| *last >= episode) {
            return Err(format!("episodes must increase, but {episode} does not"));
        }
        points.push((episode, threshold(value)?));
    }
    Ok(points)
}

fn threshold(text: &str) -> Result<f32, String> {
    let value: f32 = text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(format!("{value} is not between 0 and 1")) }
}

fn count(text: &str) -> Result<u32, String> {
    match text.trim().parse() {
        Ok(0) | Err(_) => Err(format!("`{text}` is not a positive number")),
        Ok(count) => Ok(count),
    }
}

/// The text form of points.
fn points_text(points: &[(u32, f32)]) -> String {
    points.iter().map(|(at, value)| format!("{at}={value}")).collect::<Vec<_>>().join(",")
}

impl TryFrom<String> for EpsilonSchedule {
    type Error = ScheduleError;

    fn try_from(text: String) -> Result<Self, ScheduleError> {
        text.parse()
    }
}

impl From<EpsilonSchedule> for String {
    fn from(schedule: EpsilonSchedule) -> String {
        schedule.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_are_described_in_words() {
        for (text, words) in [
            ("0.1", "0.1"),
            ("linear:0.5:0:1000", "0.5 to 0 over 1,000 episodes"),
            ("exp:0.8:0.05:0.999", "0.8 to 0.05 by the factor 0.999 per episode"),
            ("step:0.8:0.5:500", "0.8, times 0.5 every 500 episodes"),
            ("need:0.5:0.25:20", "by need, 0.5 clusters and 0.25 noise, over 20 greedy attempts"),
            ("points:0=0.8,1234567=0.3", "drawn (2 points)"),
        ] {
            assert_eq!(text.parse::<EpsilonSchedule>().unwrap().describe(), words);
        }
    }

    fn at(spec: &str, episode: u32) -> f32 {
        spec.parse::<EpsilonSchedule>().unwrap().threshold(episode)
    }

    #[test]
    fn thresholds_follow_their_formula() {
        assert_eq!(at("0.1", 12345), 0.1);
        assert_eq!(at("linear:0.8:0.4:100", 50), 0.6);
        assert_eq!(at("linear:0.8:0.4:100", 5000), 0.4);
        assert_eq!(at("linear:0.8:0.4:100", 0), 0.8);
        for (episode, power) in [(0, 1.0), (1, 0.5), (2, 0.25)] {
            assert!((at("exp:0.8:0.1:0.5", episode) - (0.1 + 0.7 * power)).abs() < 1e-6);
        }
        for (episode, threshold) in [(0, 0.8), (9, 0.8), (10, 0.4), (19, 0.4), (20, 0.2), (25, 0.2)] {
            assert_eq!(at("step:0.8:0.5:10", episode), threshold, "{episode}");
        }
        assert_eq!(at("points:10=0.8,20=0.4", 0), 0.8);
        assert!((at("points:10=0.8,20=0.4", 15) - 0.6).abs() < 1e-6);
        for (episode, threshold) in [(9, 0.8), (10, 0.8), (11, 0.76), (20, 0.4), (21, 0.4), (99, 0.4)] {
            assert!((at("points:10=0.8,20=0.4", episode) - threshold).abs() < 1e-6, "{episode}");
        }
    }

    #[test]
    fn any_schedule_becomes_points_on_its_curve() {
        let schedule: EpsilonSchedule = "linear:0.8:0.2:100".parse().unwrap();
        let [first, second, third] = schedule.to_points(200, 3)[..] else { panic!("three points") };
        assert_eq!((first, second.0, third), ((0, 0.8), 100, (200, second.1)));
        assert!((second.1 - 0.2).abs() < 1e-6);
        assert_eq!(schedule.to_points(1, 5).iter().map(|(episode, _)| *episode).collect::<Vec<_>>(), [0, 1]);
        let points = EpsilonSchedule::Points(vec![(3, 0.5), (7, 0.25)]);
        assert_eq!(points.to_points(100, 3), [(3, 0.5), (7, 0.25)]);
    }

    #[test]
    fn guidance_is_off_only_if_every_threshold_is_0() {
        for (spec, off) in [
            ("0", true),
            ("0.1", false),
            ("linear:0:0:10", true),
            ("linear:0:0.1:10", false),
            ("exp:0.1:0:0.5", false),
            ("step:0:0.5:10", true),
            ("points:0=0,5=0", true),
            ("points:0=0,5=0.1", false),
            ("need:0:0.5:20", true),
            ("need:0.1:0.5:20", false),
        ] {
            assert_eq!(spec.parse::<EpsilonSchedule>().unwrap().is_zero(), off, "{spec}");
        }
    }

    #[test]
    fn text_form_round_trips() {
        for spec in [
            "0",
            "0.1",
            "linear:0.8:0.05:2000",
            "exp:0.8:0.05:0.999",
            "step:0.8:0.5:500",
            "points:0=0.8,1000=0.3,3000=0",
            "need:0.5:0.25:20",
        ] {
            assert_eq!(spec.parse::<EpsilonSchedule>().unwrap().to_string(), spec);
        }
    }

    #[test]
    fn errors_name_the_problem() {
        for (spec, problem) in [
            ("1.5", "not between 0 and 1"),
            ("NaN", "not between 0 and 1"),
            ("linear:0.8:0.1", "takes three numbers"),
            ("linear:0.8:0.1:0", "positive number"),
            ("need:0.5:0.25:0", "positive number"),
            ("need:0.5", "takes three numbers"),
            ("need:0.75:0.5:20", "exceeds 1"),
            ("points:5=0.1,5=0.2", "must increase"),
            ("points:", "not EPISODE=THRESHOLD"),
            ("cosine:1", "unknown kind"),
        ] {
            let error = spec.parse::<EpsilonSchedule>().unwrap_err().to_string();
            assert!(error.contains(problem), "{spec}: {error}");
        }
    }
}
