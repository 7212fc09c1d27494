//! Regions that may become subgoals: rollouts that come near the goal pass them, and the ball does not reach them by
//! itself.

use rand_chacha::ChaCha8Rng;

use crate::build::Prediction;
use mge_dynamics::{Result, Rollout};
use mge_env::Snapshot;
use mge_physics::{Ball, SCREEN};
use mge_task::{Region, Task};

/// Share of the rollouts whose paths are considered: those that come nearest to the goal.
const CONSIDERED_SHARE: f32 = 0.05;
/// Smallest share of random rollouts that must reach a proposed subgoal; exploration would hardly find
/// rarer ones. `SUFFICIENT_REACHED` such rollouts are always sufficient.
const MIN_REACHED: f32 = 0.01;
const SUFFICIENT_REACHED: usize = 6;
/// Largest such share: a region that is reached more often needs no reward.
const MAX_REACHED: f32 = 0.12;
/// The earliest region is proposed among those passed at least this often, relative to the one passed most.
const MIN_RELATIVE_PASSES: f32 = 0.6;
/// Grid spacing of the candidates, normalised.
const SPACING: f32 = 0.05;
/// Minimum distance between two regions proposed for the same subgoal, normalised.
const MIN_SEPARATION: f32 = 0.15;

impl Prediction<'_> {
    /// Up to `most` regions on the way from `starts`, states of `task`, to its goal, the best first; no two are close to
    /// each other.
    ///
    /// # Errors
    /// When the model cannot predict the task, or `stop` is requested.
    pub fn regions(&self, task: &Task, starts: &[Snapshot], most: usize, rng: &mut ChaCha8Rng) -> Result<Vec<Region>> {
        let (mut rollouts, mut found) = (Vec::new(), Vec::new());
        // As for clusters, make more rollouts while they yield nothing.
        while found.is_empty() && (rollouts.is_empty() || rollouts.len() < self.config.most_model_rollouts) {
            rollouts.extend(self.random_rollouts(starts, rng)?);
            while found.len() < most
                && let Some(region) = best_region(task, &rollouts, &found)
            {
                found.push(region);
            }
        }
        Ok(found)
    }
}

/// The earliest region, not close to any of `others`, that many of the rollouts nearest to the goal pass on their
/// way there.
fn best_region(task: &Task, rollouts: &[Rollout], others: &[Region]) -> Option<Region> {
    let goal = task.goal.position;
    let touched = |rollout: &&Rollout| rollout.actions.iter().any(|action| action.touched);
    let mut near: Vec<(f32, &[[f32; 2]])> =
        rollouts.iter().filter(touched).map(|r| path_towards(goal, &r.path)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate((rollouts.len() as f32 * CONSIDERED_SHARE).ceil() as usize);

    let share = |count: usize, of: usize| count as f32 / of.max(1) as f32;
    let free: Vec<&Rollout> = rollouts.iter().filter(|rollout| !touched(rollout)).collect();
    let score = |region: &Region| {
        let count = rollouts.iter().filter(|r| passes(&r.path, region)).count();
        let reached = share(count, rollouts.len());
        let freely = share(free.iter().filter(|r| passes(&r.path, region)).count(), free.len());
        ((reached >= MIN_REACHED || count >= SUFFICIENT_REACHED) && reached <= MAX_REACHED && freely < reached / 2.0)
            .then_some(())?;
        let passed: Vec<usize> = near.iter().filter_map(|(_, path)| first_pass(path, region)).collect();
        Some((passed.len(), share(passed.iter().sum(), passed.len())))
    };
    let regions = candidates(task, near.iter().flat_map(|(_, path)| path.iter()));
    let is_new =
        |region: &Region| others.iter().all(|other| distance(region.position, other.position) > MIN_SEPARATION);
    let scored: Vec<((usize, f32), Region)> =
        regions.into_iter().filter(is_new).filter_map(|region| Some((score(&region)?, region))).collect();
    let most = scored.iter().map(|((passed, _), _)| *passed).max()?;
    let often = scored
        .into_iter()
        .filter(|((passed, _), _)| *passed > 0 && *passed as f32 >= MIN_RELATIVE_PASSES * most as f32);
    // The earlier a region is passed, the more height and time are left for the rest of the way.
    often.min_by(|a, b| a.0.1.total_cmp(&b.0.1)).map(|(_, region)| region)
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Least distance to the goal, and the path up to that point.
fn path_towards(goal: [f32; 2], path: &[[f32; 2]]) -> (f32, &[[f32; 2]]) {
    let nearest = path.iter().map(|point| distance(*point, goal)).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map_or((f32::INFINITY, path), |(index, least)| (least, &path[..=index]))
}

/// Regions on a grid that the points pass, away from the goal and the edges.
fn candidates<'a>(task: &Task, points: impl Iterator<Item = &'a [f32; 2]>) -> Vec<Region> {
    let mut cells: Vec<[i32; 2]> = points.map(|point| point.map(|value| (value / SPACING).round() as i32)).collect();
    cells.sort_unstable();
    cells.dedup();
    let radius = task.goal.radius;
    let region = |cell: [i32; 2]| Region { position: cell.map(|value| value as f32 * SPACING), radius };
    let apart = |region: &Region| {
        distance(region.position, task.goal.position) * SCREEN / 2.0 > 2.0 * (radius + Ball::default().radius)
            && region.position.iter().all(|value| value.abs() <= 0.9)
    };
    cells.into_iter().map(region).filter(apart).collect()
}

fn passes(path: &[[f32; 2]], region: &Region) -> bool {
    first_pass(path, region).is_some()
}

/// Index of the first point of the path at which a ball touches the region.
fn first_pass(path: &[[f32; 2]], region: &Region) -> Option<usize> {
    let reach = (region.radius + Ball::default().radius) * 2.0 / SCREEN;
    path.iter().position(|point| distance(*point, region.position) <= reach)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::GuidanceConfig;
    use mge_base::stop::Stop;
    use mge_base::streams::Stream;
    use mge_dynamics::RolloutAction;
    use mge_env::Environment;

    /// task1 without subgoals, with its goal at the bottom right.
    fn task() -> Task {
        let mut task = mge_task::load("task1").unwrap();
        task.subgoals.clear();
        task.goal.position = [0.8, -0.8];
        task.goal.radius = 4.0;
        task
    }

    fn rollout(touched: bool, path: &[[f32; 2]]) -> Rollout {
        let action = RolloutAction { action: [0.0; 2], placed: true, touched };
        Rollout { actions: vec![action], path: path.to_vec(), ..Rollout::default() }
    }

    const HIGH: [f32; 2] = [-0.5, 0.5];
    const LOW: [f32; 2] = [-0.2, 0.1];
    const GOAL: [f32; 2] = [0.8, -0.8];
    const ELSEWHERE: [f32; 2] = [-0.8, -0.8];

    /// The region proposed for 100 rollouts: `near` reach the goal through two places, `free` pass the higher
    /// place without touching a tool, and the others pass neither.
    fn proposed(near: usize, free: usize) -> Option<[f32; 2]> {
        let mut rollouts = vec![rollout(true, &[ELSEWHERE]); 50 - near];
        rollouts.extend(vec![rollout(true, &[HIGH, LOW, GOAL, ELSEWHERE]); near]);
        rollouts.extend(vec![rollout(false, &[HIGH]); free]);
        rollouts.extend(vec![rollout(false, &[ELSEWHERE]); 50 - free]);
        best_region(&task(), &rollouts, &[]).map(|region| region.position)
    }

    fn is_near(found: Option<[f32; 2]>, expected: [f32; 2]) -> bool {
        found.is_some_and(|found| distance(found, expected) < 1e-3)
    }

    #[test]
    fn the_earliest_region_is_proposed_that_is_rarely_passed_and_not_without_tools() {
        assert!(is_near(proposed(8, 0), HIGH), "the earlier of two");
        assert!(is_near(proposed(12, 0), HIGH), "12 of 100 are not too many");
        assert_eq!(proposed(13, 0), None, "13 of 100 need no subgoal");
        assert!(is_near(proposed(1, 0), HIGH), "1 of 100 is enough");
        assert_eq!(proposed(0, 0), None);
        // 4 % without tools are less than half of 10 %; 6 % are more than half of 11 %.
        assert!(is_near(proposed(8, 2), HIGH));
        assert!(is_near(proposed(8, 3), LOW), "the ball gets to the other by itself");
    }

    #[test]
    fn an_earlier_region_is_not_proposed_if_few_of_the_best_rollouts_pass_it() {
        let detour = [-0.6, -0.3];
        let with = |detours: usize| {
            let mut rollouts = vec![rollout(true, &[ELSEWHERE]); 87];
            // Passed earlier and more often, but not by the nearest 5 of 100.
            rollouts.extend(vec![rollout(true, &[[0.0, 0.8], ELSEWHERE]); 8]);
            rollouts.extend(vec![rollout(true, &[detour, LOW, GOAL]); detours]);
            rollouts.extend(vec![rollout(true, &[HIGH, LOW, GOAL]); 5 - detours]);
            best_region(&task(), &rollouts, &[]).map(|region| region.position)
        };
        assert!(is_near(with(3), detour), "three of five are often enough");
        assert!(is_near(with(2), HIGH));
    }

    #[test]
    fn regions_proposed_for_one_subgoal_are_apart() {
        let task = Arc::new(Task { subgoals: Vec::new(), ..mge_task::load("task6").unwrap() });
        let start = [Environment::new(task.clone()).snapshot().clone()];
        let propose = |most| {
            let mut rng = Stream::Proposal { attempt: 1, number: 1 }.of(0);
            let config = GuidanceConfig::default();
            let (model, stop) = (&crate::TruePhysics, &Stop::default());
            Prediction { model, config: &config, seed: 0, stop }.regions(&task, &start, most, &mut rng).unwrap()
        };
        let found = propose(3);
        assert_eq!((found.len(), &propose(1)[..]), (3, &found[..1]));
        for (index, region) in found.iter().enumerate() {
            let others = found[..index].iter();
            assert!(
                others.clone().all(|other| distance(region.position, other.position) > MIN_SEPARATION),
                "{found:?}"
            );
        }
    }

    #[test]
    fn a_path_is_cut_where_it_is_nearest_to_the_goal() {
        let path = [HIGH, LOW, [0.5, -0.4], ELSEWHERE];
        let (distance, towards) = path_towards(GOAL, &path);
        assert_eq!((distance, towards), (0.5, &path[..3]));
        assert_eq!(path_towards(GOAL, &[]), (f32::INFINITY, &[][..]));
    }

    #[test]
    fn candidates_are_distinct_and_away_from_the_goal_and_the_edges() {
        let found = |points: &[[f32; 2]]| -> Vec<[i32; 2]> {
            let regions = candidates(&task(), points.iter());
            regions.iter().map(|region| region.position.map(|value| (value * 100.0).round() as i32)).collect()
        };
        assert_eq!(found(&[[0.02, 0.52], [-0.02, 0.48], [0.03, 0.5]]), [[0, 50], [5, 50]]);
        assert_eq!(found(&[[0.85, 0.85], [-0.96, 0.0], [0.0, 0.96]]), [[85, 85]]);
        // A ball of radius 4 and a goal of radius 4 must be 16 units, 0.381, apart.
        assert_eq!(found(&[[0.8, -0.45], [0.8, -0.4], [0.45, -0.8], [0.4, -0.8]]), [[40, -80], [80, -40]]);
    }

    #[test]
    fn a_region_is_passed_where_the_ball_first_touches_it() {
        let region = Region { position: [0.5, 0.25], radius: 4.4 };
        // 8.4 units are 0.2 of the normalised scene.
        let path = [[0.0, 0.25], [0.29, 0.25], [0.31, 0.25], [0.5, 0.25]];
        assert_eq!(first_pass(&path, &region), Some(2));
        assert_eq!(first_pass(&[[0.5, 0.46], [0.5, 0.44]], &region), Some(1));
        assert!(!passes(&path[..2], &region) && passes(&path, &region));
    }
}
