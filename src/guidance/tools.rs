//! Guidance for agents that choose among tools: random tools at random places, rolled out in the true
//! physics, and clusters of the rewarding ones over places and tools.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::clusters::{Cluster, cluster_points};
use super::config::GuidanceConfig;
use super::prior::{ActionPrior, StagePrior};
use crate::env::{
    Action, ActionSet, Choice, Environment, Placement, Snapshot, TOOL_FEATURES, tool_embedding, uniform_action,
};
use crate::physics::{ObjectId, ToolSplit, World};
use crate::stop::Stop;
use crate::streams::Stream;
use crate::task::Task;

/// What predicts the rollouts of tools, by its name in a prior.
const MODEL: &str = "true physics";
/// Rollouts between two looks at whether to stop.
const PIECE: usize = 250;

/// The tools of a cluster of rewarding actions: the normal distribution of their embeddings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToolCluster {
    /// Mean of each number.
    pub mean: Vec<f32>,
    /// Standard deviation of each number.
    pub std: Vec<f32>,
}

/// A tool of the catalogue and where it was placed.
type Placed = (Action, usize);

/// What a rollout has come to: its rewarding actions if it reached a stage, and its last state.
struct Rolled {
    rewarding: Option<Vec<Placed>>,
    last: Snapshot,
}

/// Builds the prior of a task in which the agent chooses among these tools, stage by stage: rollouts of
/// random actions in the true physics, of which those that reach a stage say which of their tools a ball
/// touched. The next stage is rolled out from where they ended. `progress` is called before each stage with
/// its number. None once `stop` is requested.
pub fn build_among(
    task: &Arc<Task>,
    tools: ToolSplit,
    config: &GuidanceConfig,
    seed: u64,
    mut progress: impl FnMut(usize),
    stop: &Stop,
) -> Option<ActionPrior> {
    let numbers = tools.tools();
    // Nothing is observed: rollouts need no slots.
    let set = ActionSet::of_catalogue(&numbers);
    let mut env = Environment::new(task.clone()).with_slots(0).with_action_set(set);
    env.reset(&mut Stream::PriorStart.of(seed));
    let mut starts = vec![env.snapshot().clone()];
    let mut prior = ActionPrior { model: MODEL.to_owned(), config: config.clone(), ..ActionPrior::uniform(task, seed) };
    for stage in 0..task.stage_count() {
        progress(stage);
        let mut rng = Stream::PriorStage(stage).of(seed);
        let rolled = roll_out(&env, &numbers, config, &starts, &mut rng, stop)?;
        prior.stages[stage] = stage_prior(&rolled, config, &rng);
        let can_go_on = |wanted: bool| {
            let ends = rolled.iter().filter(|rollout| rollout.last.end().is_none());
            ends.filter(|rollout| !wanted || rollout.last.stage() > stage).map(|rollout| rollout.last.clone()).collect()
        };
        let reached: Vec<Snapshot> = can_go_on(true);
        let next = if reached.is_empty() { can_go_on(false) } else { reached };
        if !next.is_empty() {
            starts = next;
        }
    }
    Some(prior)
}

/// Rollouts of random actions from these states. None once `stop` is requested.
fn roll_out(
    env: &Environment,
    numbers: &[usize],
    config: &GuidanceConfig,
    starts: &[Snapshot],
    rng: &mut ChaCha8Rng,
    stop: &Stop,
) -> Option<Vec<Rolled>> {
    // A u64 draw is the same on machines of every word size.
    let index = |count: usize, rng: &mut ChaCha8Rng| rng.gen_range(0..count as u64) as usize;
    let mut drawn = Vec::with_capacity(config.model_rollouts);
    for _ in 0..config.model_rollouts {
        let start = index(starts.len(), rng);
        let choices =
            (0..config.horizon).map(|_| Choice { tool: index(numbers.len(), rng), place: uniform_action(rng) });
        drawn.push((start, choices.collect::<Vec<Choice>>()));
    }
    let mut rolled = Vec::with_capacity(drawn.len());
    for piece in drawn.chunks(PIECE) {
        if stop.is_requested() {
            return None;
        }
        let one = |(start, choices): &(usize, Vec<Choice>)| rollout(env.clone(), &starts[*start], choices, numbers);
        rolled.par_extend(piece.par_iter().map(one));
    }
    Some(rolled)
}

/// Plays choices until a stage is reached or the episode is over.
fn rollout(mut env: Environment, start: &Snapshot, choices: &[Choice], numbers: &[usize]) -> Rolled {
    env.restore(start);
    let fixed = env.task().tools.len();
    let before = start.placed().len();
    let mut placed: Vec<(Placed, bool)> = Vec::new();
    for choice in choices {
        let mut touched = Vec::new();
        let note = |world: &World| {
            touched.extend(world.touches().iter().filter_map(|touch| match touch.object {
                ObjectId::Tool(tool) => tool.checked_sub(fixed + before),
                _ => None,
            }));
        };
        let Ok(step) = env.step_watched(*choice, note) else { break };
        if step.placement == Placement::Placed {
            placed.push(((choice.place, numbers[choice.tool]), false));
        }
        for tool in touched {
            if let Some((_, is_touched)) = placed.get_mut(tool) {
                *is_touched = true;
            }
        }
        if step.reached_stage() {
            let rewarding = placed.into_iter().filter_map(|(action, is_touched)| is_touched.then_some(action));
            return Rolled { rewarding: Some(rewarding.collect()), last: env.snapshot().clone() };
        }
        if step.end.is_some() {
            break;
        }
    }
    Rolled { rewarding: None, last: env.snapshot().clone() }
}

/// The clusters of a stage's rewarding actions.
fn stage_prior(rolled: &[Rolled], config: &GuidanceConfig, rng: &ChaCha8Rng) -> StagePrior {
    let rewarding: Vec<Placed> =
        rolled.iter().flat_map(|rollout| rollout.rewarding.iter().flatten().copied()).collect();
    let points: Vec<Vec<f32>> = rewarding
        .iter()
        .map(|(place, number)| [&place[..], tool_embedding(*number).map_or(&[][..], |it| &it[..])].concat())
        .collect();
    let clusters = cluster_points(&points, config.clusters, config.std_floor, rng);
    StagePrior {
        clusters: clusters.iter().map(|(cluster, _)| *cluster).collect(),
        tools: clusters.into_iter().map(|(_, members)| of_tools(&points, &members)).collect(),
        actions: rewarding.into_iter().map(|(place, _)| place).collect(),
        model_rollouts: rolled.len(),
        model_hits: rolled.iter().filter(|rollout| rollout.rewarding.is_some()).count(),
        ..StagePrior::default()
    }
}

/// Mean and standard deviation of the tools of some actions, at least one.
fn of_tools(points: &[Vec<f32>], members: &[usize]) -> ToolCluster {
    let count = members.len() as f32;
    let mean_of = |column: usize, of: &dyn Fn(f32) -> f32| {
        members.iter().map(|member| of(points[*member][2 + column])).sum::<f32>() / count
    };
    let mean: Vec<f32> = (0..TOOL_FEATURES).map(|column| mean_of(column, &|value| value)).collect();
    let variance = |(column, mean): (usize, &f32)| mean_of(column, &|value| (value - mean).powi(2));
    let std = mean.iter().enumerate().map(variance).map(f32::sqrt).collect();
    ToolCluster { mean, std }
}

impl ToolCluster {
    /// Whether its numbers can be those of tools.
    pub(super) fn is_possible(&self) -> bool {
        let within = |low: f32, values: &[f32]| values.iter().all(|value| (low..=1.0).contains(value));
        let lengths = [self.mean.len(), self.std.len()];
        lengths == [TOOL_FEATURES; 2] && within(-1.0, &self.mean) && within(0.0, &self.std)
    }
}

impl ActionPrior {
    /// A place for a stage and the point of a tool, as [`tool_embedding`] has them: a cluster drawn by weight,
    /// then its normal distributions. No tool is nearer than others where the prior knows none.
    pub fn sample_with_tool(&self, stage: usize, rng: &mut impl Rng) -> (Action, Option<Vec<f32>>) {
        let known = self.stages.get(stage).filter(|stage| !stage.tools.is_empty());
        let Some(stage) = known else { return (self.sample(stage, rng), None) };
        let mut share: f32 = rng.r#gen();
        let drawn = stage.clusters.iter().zip(&stage.tools).find(|(cluster, _)| {
            share -= cluster.weight;
            share < 0.0
        });
        // What rounding leaves over belongs to the last.
        let drawn = drawn.or_else(|| stage.clusters.last().zip(stage.tools.last()));
        let Some((cluster, tools)): Option<(&Cluster, &ToolCluster)> = drawn else {
            return (uniform_action(rng), None);
        };
        let place = cluster.sample(rng);
        let number = |(mean, std): (&f32, &f32)| {
            let normal: f32 = StandardNormal.sample(rng);
            (mean + std * normal).clamp(-1.0, 1.0)
        };
        (place, Some(tools.mean.iter().zip(&tools.std).map(number).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config() -> GuidanceConfig {
        GuidanceConfig { model_rollouts: 1500, ..GuidanceConfig::default() }
    }

    #[test]
    fn places_and_tools_that_are_rewarding_are_sampled_and_one_seed_gives_one_prior() {
        let task = Arc::new(crate::task::load("create/GoalTest").unwrap());
        let build = || build_among(&task, ToolSplit::Train, &config(), 3, |_| (), &Stop::default()).unwrap();
        let prior = build();
        assert_eq!(prior, build());
        let stage = &prior.stages[0];
        assert!(stage.model_hits > 0 && stage.clusters.len() == stage.tools.len(), "{} hits", stage.model_hits);
        let text = prior.to_json();
        assert_eq!(ActionPrior::parse(&text, "p", &task).unwrap(), prior);
        let mut rng = Stream::Guidance.of(1);
        for _ in 0..20 {
            let (place, tool) = prior.sample_with_tool(0, &mut rng);
            assert!(place.iter().chain(&tool.unwrap()).all(|value| (-1.0..=1.0).contains(value)));
        }
        let text = text.replacen("\"tools\": [", "\"tools\": [{\"mean\":[],\"std\":[]},", 1);
        assert!(ActionPrior::parse(&text, "p", &task).is_err(), "another number of clusters");
    }

    #[test]
    fn a_stop_ends_it() {
        let (task, stop) = (Arc::new(crate::task::load("create/Push").unwrap()), Stop::default());
        stop.request();
        assert_eq!(build_among(&task, ToolSplit::Train, &config(), 3, |_| (), &stop), None);
    }
}
