//! Planning with a model instead of learning: the cross-entropy method over action
//! sequences. With a single iteration it is random shooting.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::clusters::clipped_normal;
use super::rollout::RolloutModel;
use mge_base::stop::Stop;
use mge_base::validation::{Setting, ValidationError, check_settings};
use mge_dynamics::{Result, Rollout};
use mge_env::{Action, Snapshot, uniform_action};

/// Settings of the planner.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlannerConfig {
    /// Model rollouts per iteration.
    pub rollouts: usize,
    /// Iterations; 1 is random shooting.
    pub iterations: usize,
    /// Number of best rollouts of an iteration to which the next iteration's distribution is fitted.
    pub elites: usize,
    /// Actions in a rollout.
    pub horizon: usize,
    /// Least standard deviation of the distribution, normalised.
    pub std_floor: f32,
}

impl Default for PlannerConfig {
    fn default() -> Self {
        Self { rollouts: 64, iterations: 3, elites: 8, horizon: 8, std_floor: 0.02 }
    }
}

/// The numeric settings of [`PlannerConfig`].
pub const SETTINGS: [Setting; 5] = [
    Setting::count("rollouts", 1, 10_000, "model rollouts of an iteration"),
    Setting::count("iterations", 1, 1000, "iterations; 1 is random shooting"),
    Setting::count("elites", 1, 10_000, "best rollouts of an iteration, at most all of them"),
    Setting::count("horizon", 1, 100, "actions in a rollout"),
    Setting::number("std_floor", 0.0, 1.0, "least standard deviation of the distribution, normalised"),
];

impl PlannerConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), ValidationError> {
        check_settings(self, &SETTINGS)?;
        if self.elites > self.rollouts {
            let message = format_args!("is {}, but must be at most planner.rollouts, {}", self.elites, self.rollouts);
            return Err(ValidationError::new("elites", message));
        }
        Ok(())
    }
}

/// Normal distributions of the actions of a plan, as (mean, std) of x and y for each step.
struct Plan(Vec<[(f32, f32); 2]>);

/// The first action of the best sequence found: the one that reaches the next stage
/// soonest or, if none does, passes nearest to it. Also returns the number of actions that the rollouts took in the
/// environment, if the model is the true physics.
///
/// # Errors
/// When the model cannot predict the task, or `stop` is requested.
pub fn plan(
    model: &dyn RolloutModel,
    from: &Snapshot,
    config: &PlannerConfig,
    stop: &Stop,
    rng: &mut ChaCha8Rng,
) -> Result<(Action, u64)> {
    let starts = vec![from; config.rollouts];
    let target = from.task.stages()[from.stage().min(from.reached.len())].position;
    let mut best: Option<(f32, Vec<Action>)> = None;
    let mut fitted: Option<Plan> = None;
    let mut taken = 0;
    for _ in 0..config.iterations {
        let sequences: Vec<Vec<Action>> = (0..config.rollouts)
            .map(|_| match &fitted {
                Some(plan) => plan.sample(rng),
                None => (0..config.horizon).map(|_| uniform_action(rng)).collect(),
            })
            .collect();
        let rollouts = model.rollouts(&starts, &sequences, stop)?;
        taken += model.environment_actions(&rollouts);
        let costs = rollouts.iter().map(|rollout| cost(rollout, target));
        let mut ranked: Vec<(f32, Vec<Action>)> = costs.zip(sequences).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked.truncate(config.elites);
        fitted = Some(Plan::fit(&ranked, config));
        let first = ranked.swap_remove(0);
        if best.as_ref().is_none_or(|(least, _)| first.0 < *least) {
            best = Some(first);
        }
    }
    // There is at least one iteration of at least one rollout of at least one action.
    Ok((best.map_or([0.0; 2], |(_, sequence)| sequence[0]), taken))
}

/// The cost of a rollout: below 0 if it reaches its stage, the lower the sooner; otherwise the least
/// distance to the stage, normalised.
fn cost(rollout: &Rollout, target: [f32; 2]) -> f32 {
    if rollout.hit {
        return -1.0 / (1.0 + rollout.path.len() as f32);
    }
    rollout.path.iter().map(|[x, y]| (x - target[0]).hypot(y - target[1])).fold(f32::INFINITY, f32::min)
}

impl Plan {
    fn fit(elites: &[(f32, Vec<Action>)], config: &PlannerConfig) -> Self {
        let count = elites.len() as f32;
        let distribution = |step: usize, axis: usize| {
            let values = || elites.iter().map(move |(_, sequence)| sequence[step][axis]);
            let mean = values().sum::<f32>() / count;
            let variance = values().map(|value| (value - mean).powi(2)).sum::<f32>() / count;
            (mean, variance.sqrt().max(config.std_floor))
        };
        Self((0..config.horizon).map(|step| [distribution(step, 0), distribution(step, 1)]).collect())
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Vec<Action> {
        self.0.iter().map(|step| step.map(|(mean, std)| clipped_normal(mean, std, rng))).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng;
    use rand::SeedableRng;
    use rand_distr::StandardNormal;

    use super::*;

    #[test]
    fn a_hit_costs_less_than_any_miss_and_a_miss_costs_its_least_distance() {
        let hit = |points: usize| Rollout { path: vec![[0.5; 2]; points], hit: true, ..Rollout::default() };
        assert_eq!((cost(&hit(3), [0.0; 2]), cost(&hit(1), [0.0; 2])), (-0.25, -0.5));
        let miss = Rollout { path: vec![[0.9, 0.9], [0.2, 0.5], [0.8, -0.3]], ..Rollout::default() };
        assert_eq!(cost(&miss, [0.5, 0.1]), 0.5);
    }

    #[test]
    fn a_plan_has_the_mean_and_deviation_of_its_elites_step_by_step() {
        let elites = [(0.0, vec![[0.1, -0.5], [0.0, 0.0]]), (0.5, vec![[0.5, -0.1], [0.0, 0.0]])];
        let config = PlannerConfig { horizon: 2, std_floor: 0.02, ..PlannerConfig::default() };
        let plan = Plan::fit(&elites, &config);
        let near = |(mean, std): (f32, f32), expected: [f32; 2]| {
            assert!((mean - expected[0]).abs() < 1e-6 && (std - expected[1]).abs() < 1e-6, "{mean} {std}");
        };
        near(plan.0[0][0], [0.3, 0.2]);
        near(plan.0[0][1], [-0.3, 0.2]);
        near(plan.0[1][0], [0.0, 0.02]);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut normals = rng.clone();
        let sampled = plan.sample(&mut rng);
        let expected = plan.0[0].map(|(mean, std)| mean + std * normals.sample::<f32, _>(StandardNormal));
        assert_eq!((sampled[0], sampled.len()), (expected, 2));
    }
}
