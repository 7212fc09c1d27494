//! An epsilon schedule as movable points on a plot.

use mge_guidance::EpsilonSchedule;

/// The points by which a schedule is edited: episode and threshold.
pub fn points(schedule: &EpsilonSchedule) -> Vec<(u32, f32)> {
    match schedule {
        EpsilonSchedule::Constant(value) => vec![(0, *value)],
        EpsilonSchedule::Linear { from, to, episodes } => vec![(0, *from), (*episodes, *to)],
        EpsilonSchedule::Exponential { from, to, factor } => {
            let half = half_life(*factor);
            vec![(0, *from), (half, (from + to) / 2.0), (half.saturating_mul(6), *to)]
        }
        EpsilonSchedule::Step { from, factor, episodes } => vec![(0, *from), (*episodes, from * factor)],
        EpsilonSchedule::Points(points) => points.clone(),
        EpsilonSchedule::Need { clusters, .. } => vec![(0, *clusters)],
    }
}

/// The schedule with one point moved to an episode and a threshold; a coordinate that the point cannot change is
/// ignored.
pub fn move_point(schedule: &EpsilonSchedule, index: usize, episode: u32, value: f32) -> EpsilonSchedule {
    let value = rounded(value);
    let mut moved = schedule.clone();
    match &mut moved {
        EpsilonSchedule::Constant(constant) => *constant = value,
        EpsilonSchedule::Linear { from, to, episodes } => match index {
            0 => *from = value,
            _ => (*to, *episodes) = (value, episode.max(1)),
        },
        EpsilonSchedule::Exponential { from, to, factor } => match index {
            0 => *from = value,
            1 => *factor = factor_of_half_life(episode),
            _ => *to = value,
        },
        EpsilonSchedule::Step { from, factor, episodes } => match index {
            0 => *from = value,
            _ => {
                *factor = if *from > 0.0 { (value / *from).clamp(0.0, 1.0) } else { 1.0 };
                *episodes = episode.max(1);
            }
        },
        EpsilonSchedule::Points(points) => {
            let low = index.checked_sub(1).and_then(|before| points.get(before)).map_or(0, |p| p.0.saturating_add(1));
            let high = points.get(index + 1).map_or(u32::MAX, |after| after.0.saturating_sub(1));
            if let Some(point) = points.get_mut(index) {
                *point = (episode.clamp(low, high.max(low)), value);
            }
        }
        EpsilonSchedule::Need { clusters, noise, .. } => *clusters = value.min(rounded(1.0 - *noise)),
    }
    moved
}

/// The schedule as a hand-drawn one with another point after the point `after`, and the index of the new point.
pub fn add_point(schedule: &EpsilonSchedule, episodes: u32, after: usize) -> (EpsilonSchedule, usize) {
    let points = drawn(schedule, episodes);
    let after = after.min(points.len() - 1);
    let from = points[after].0;
    let episode = match points.get(after + 1) {
        Some((next, _)) => from + next.saturating_sub(from) / 2,
        None => from.saturating_add((episodes / 4).max(1)),
    };
    insert_point(points, episode, schedule.threshold(episode))
}

/// A hand-drawn schedule with another point, and its index. A point at the same episode is replaced.
pub fn insert_point(mut points: Vec<(u32, f32)>, episode: u32, value: f32) -> (EpsilonSchedule, usize) {
    let at = points.partition_point(|point| point.0 < episode);
    match points.get_mut(at) {
        Some(point) if point.0 == episode => point.1 = rounded(value),
        _ => points.insert(at, (episode, rounded(value))),
    }
    (EpsilonSchedule::Points(points), at)
}

/// The points of a hand-drawn schedule that approximates this one.
fn drawn(schedule: &EpsilonSchedule, episodes: u32) -> Vec<(u32, f32)> {
    let points = match schedule {
        EpsilonSchedule::Constant(value) | EpsilonSchedule::Need { clusters: value, .. } => {
            vec![(0, *value), (episodes.max(1), *value)]
        }
        EpsilonSchedule::Linear { .. } | EpsilonSchedule::Points(_) => points(schedule),
        EpsilonSchedule::Exponential { .. } | EpsilonSchedule::Step { .. } => schedule.to_points(episodes, 8),
    };
    points.into_iter().map(|(episode, value)| (episode, rounded(value))).collect()
}

fn rounded(value: f32) -> f32 {
    (value.clamp(0.0, 1.0) * 1000.0).round() / 1000.0
}

/// The schedule without a point; the only remaining point is kept.
pub fn delete_point(schedule: &EpsilonSchedule, index: usize) -> EpsilonSchedule {
    let mut schedule = schedule.clone();
    if let EpsilonSchedule::Points(points) = &mut schedule
        && points.len() > 1
        && index < points.len()
    {
        points.remove(index);
    }
    schedule
}

/// A schedule of the next kind, as close to this one as possible.
pub fn next_kind(schedule: &EpsilonSchedule, episodes: u32) -> EpsilonSchedule {
    let episodes = episodes.max(2);
    let (from, to) = (schedule.threshold(0), schedule.threshold(episodes));
    match schedule {
        EpsilonSchedule::Constant(_) => EpsilonSchedule::Linear { from, to: 0.0, episodes: episodes / 2 },
        EpsilonSchedule::Linear { episodes, .. } => {
            EpsilonSchedule::Exponential { from, to, factor: factor_of_half_life(episodes / 4) }
        }
        EpsilonSchedule::Exponential { .. } => {
            EpsilonSchedule::Step { from, factor: 0.5, episodes: (episodes / 4).max(1) }
        }
        EpsilonSchedule::Step { .. } => EpsilonSchedule::Points(drawn(schedule, episodes)),
        EpsilonSchedule::Points(_) => {
            EpsilonSchedule::Need { clusters: from, noise: rounded((1.0 - from).min(0.25)), attempts: 20 }
        }
        EpsilonSchedule::Need { .. } => EpsilonSchedule::Constant(from),
    }
}

/// Name of the kind.
pub fn kind(schedule: &EpsilonSchedule) -> &'static str {
    match schedule {
        EpsilonSchedule::Constant(_) => "constant",
        EpsilonSchedule::Linear { .. } => "linear",
        EpsilonSchedule::Exponential { .. } => "exponential",
        EpsilonSchedule::Step { .. } => "step",
        EpsilonSchedule::Points(_) => "hand-drawn",
        EpsilonSchedule::Need { .. } => "by need",
    }
}

/// 1 for the factors 0 and 1, which have none.
fn half_life(factor: f32) -> u32 {
    (0.5f32.ln() / factor.ln()).round().clamp(1.0, 1e6) as u32
}

fn factor_of_half_life(episodes: u32) -> f32 {
    let factor = 0.5f32.powf(1.0 / episodes.max(1) as f32);
    (factor * 1e5).round() / 1e5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule(spec: &str) -> EpsilonSchedule {
        spec.parse().unwrap()
    }

    #[test]
    fn moving_a_point_changes_what_it_stands_for() {
        for (before, index, episode, value, after) in [
            ("0.5", 0, 900, 0.7, "0.7"),
            ("linear:0.8:0:1000", 1, 500, 0.1, "linear:0.8:0.1:500"),
            ("linear:0.8:0:1000", 0, 500, 2.0, "linear:1:0:1000"),
            ("exp:0.8:0.1:0.999", 1, 100, 0.0, "exp:0.8:0.1:0.99309"),
            ("exp:0.8:0.1:0.999", 0, 100, 0.5, "exp:0.5:0.1:0.999"),
            ("exp:0.8:0.1:0.999", 2, 100, 0.25, "exp:0.8:0.25:0.999"),
            ("step:0.8:0.5:500", 0, 200, 0.4, "step:0.4:0.5:500"),
            ("step:0.8:0.5:500", 1, 200, 0.2, "step:0.8:0.25:200"),
            ("step:0:0.5:500", 1, 200, 0.0, "step:0:1:200"),
            ("points:0=0.8,100=0.4,200=0", 1, 150, 0.5, "points:0=0.8,150=0.5,200=0"),
            ("points:0=0.8,100=0.4,200=0", 1, 999, 0.5, "points:0=0.8,199=0.5,200=0"),
            ("points:0=0.8,100=0.4,200=0", 1, 0, 0.5, "points:0=0.8,1=0.5,200=0"),
            ("points:0=0.8,100=0.4", 7, 50, 0.5, "points:0=0.8,100=0.4"),
        ] {
            let moved = move_point(&schedule(before), index, episode, value);
            assert_eq!(moved.to_string(), after, "{before}");
        }
    }

    #[test]
    fn points_lie_on_their_schedule() {
        for spec in ["0.5", "linear:0.8:0:1000", "exp:0.8:0.1:0.99", "step:0.8:0.5:500", "points:0=0.8,100=0.4"] {
            let schedule = schedule(spec);
            for (episode, value) in points(&schedule) {
                assert!((schedule.threshold(episode) - value).abs() < 0.02, "{spec} at {episode}");
            }
        }
    }

    #[test]
    fn points_are_added_between_others_and_deleted() {
        let (added, index) = add_point(&schedule("linear:0.8:0:1000"), 1000, 0);
        assert_eq!((added.to_string().as_str(), index), ("points:0=0.8,500=0.4,1000=0", 1));
        let (after_last, index) = add_point(&schedule("points:0=0.8,1000=0.2"), 2000, 1);
        assert_eq!((after_last.to_string().as_str(), index), ("points:0=0.8,1000=0.2,1500=0.2", 2));
        let (full, index) = add_point(&schedule("points:0=0.8,1=0.2"), 2000, 0);
        assert_eq!((full.to_string().as_str(), index), ("points:0=0.8,1=0.2", 0), "there is no room between them");
        let last = schedule(&format!("points:0=0.8,{}=0.2", u32::MAX));
        assert_eq!(add_point(&last, 2000, 1), (last.clone(), 1), "there is no room after it");
        assert_eq!(delete_point(&added, 1).to_string(), "points:0=0.8,1000=0");
        assert_eq!(delete_point(&schedule("points:0=0.8"), 0).to_string(), "points:0=0.8");
        assert_eq!(delete_point(&full, 2), full, "there is no such point");
        let (between, index) = add_point(&schedule("points:0=0.8,1000=0.4,1500=0"), 2000, 1);
        assert_eq!((between.to_string().as_str(), index), ("points:0=0.8,1000=0.4,1250=0.2,1500=0", 2));
        let (_, index) = add_point(&schedule("exp:0.8:0.1:0.99"), 1, 2);
        assert_eq!(index, 2, "only two points are drawn over one episode");
    }

    #[test]
    fn points_are_inserted_or_replaced_at_an_episode() {
        let drawn = schedule("points:0=0.8,1000=0");
        let check = |episode, value, spec: &str, index| {
            let (schedule, at) = insert_point(points(&drawn), episode, value);
            assert_eq!((schedule.to_string().as_str(), at), (spec, index));
        };
        check(400, 0.3333, "points:0=0.8,400=0.333,1000=0", 1);
        check(2000, 2.0, "points:0=0.8,1000=0,2000=1", 2);
        check(1000, 0.5, "points:0=0.8,1000=0.5", 1);
    }

    #[test]
    fn every_kind_follows_another_and_can_be_parsed_again() {
        let mut now = schedule("0.8");
        let (mut kinds, mut specs) = (Vec::new(), Vec::new());
        for _ in 0..5 {
            kinds.push(kind(&now));
            specs.push(now.to_string());
            now = next_kind(&now, 2000);
            assert!(now.to_string().parse::<EpsilonSchedule>().is_ok(), "{now}");
        }
        assert_eq!(kinds, ["constant", "linear", "exponential", "step", "hand-drawn"]);
        assert_eq!(specs[..4], ["0.8", "linear:0.8:0:1000", "exp:0.8:0:0.99723", "step:0.8:0.5:500"]);
        for limit in ["exp:0.8:0.1:0", "exp:0.8:0.1:1"] {
            assert_eq!(points(&schedule(limit))[1].0, 1, "{limit}");
        }
    }
}
