//! Guidance for agents that choose among tools: random tools at random positions are rolled out in a model or the
//! true physics, and rewarding actions are clustered over positions and tools.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::clusters::clipped_normal;
use super::config::GuidanceConfig;
use super::prior::{ActionPrior, StagePrior};
use super::rollout::TruePhysics;
use super::tool_rollout::{ToolModel, ToolRollout};
use mge_base::stop::Stop;
use mge_base::streams::{Stream, index};
use mge_dynamics::Result;
use mge_env::{Action, ActionSet, Choice, Environment, Snapshot, tool_embedding, uniform_action};
use mge_physics::ToolSplit;
use mge_task::Task;

/// Rollouts between two checks for a stop request.
const ROLLOUTS_PER_STOP_CHECK: usize = 250;

/// A rollout to make: the index of its start state, and its choices.
type Drawn = (usize, Vec<Choice>);

/// Builds the prior of a task in which the agent chooses among these tools, stage by stage. Random actions are rolled
/// out; those whose tool a ball touched in a rollout that reached the stage are clustered. The next stage starts from
/// the final states of real rollouts: with the true physics, of the same rollouts; with a model, of as many as
/// [`environment_rollouts`](GuidanceConfig::environment_rollouts) allows, repeated in the environment, first those
/// predicted to reach the stage. `progress` is called before each stage with its index.
///
/// # Errors
/// When the model cannot predict the task or one of the tools, or `stop` is requested.
pub fn build_with_tools(
    task: &Arc<Task>,
    tools: ToolSplit,
    model: &dyn ToolModel,
    config: &GuidanceConfig,
    seed: u64,
    mut progress: impl FnMut(usize),
    stop: &Stop,
) -> Result<ActionPrior> {
    let numbers = tools.tools();
    // Rollouts ignore observations, so they need no slots.
    let set = ActionSet::of_catalogue(&numbers);
    let mut env = Environment::new(task.clone()).with_slots(0).with_action_set(set);
    env.reset(&mut Stream::PriorStart.of(seed));
    let mut starts = vec![env.snapshot().clone()];
    let mut prior = ActionPrior::uniform(task, config, seed).of_model(model);
    let stages = task.stage_count();
    for stage in 0..stages {
        progress(stage);
        let mut rng = Stream::PriorStage(stage).of(seed);
        let drawn = draw(config, starts.len(), numbers.len(), &mut rng);
        let rolled = roll_out(&env, model, &starts, &drawn, stop)?;
        let mut built = stage_prior(&drawn, &rolled, &numbers, config, &rng)?;
        let hits: Vec<bool> = rolled.iter().map(|rollout| rollout.hit).collect();
        let real: Option<Vec<Snapshot>> = rolled.into_iter().map(|rollout| rollout.end).collect();
        let ends = match real {
            Some(ends) => ends,
            None if stage + 1 == stages => Vec::new(),
            None => {
                let allowed = config.environment_rollouts.div_ceil(stages - 1);
                let chosen = likeliest(drawn, &hits, allowed);
                let played = roll_out(&env, &TruePhysics, &starts, &chosen, stop)?;
                let ends: Vec<Snapshot> = played.into_iter().filter_map(|rollout| rollout.end).collect();
                built.environment_rollouts = ends.len();
                built.environment_hits = ends.iter().filter(|end| is_unfinished(end) && end.stage() > stage).count();
                ends
            }
        };
        prior.stages[stage] = built;
        let ends: Vec<Snapshot> = ends.into_iter().filter(is_unfinished).collect();
        let any_reached = ends.iter().any(|end| end.stage() > stage);
        let next: Vec<Snapshot> = ends.into_iter().filter(|end| !any_reached || end.stage() > stage).collect();
        if !next.is_empty() {
            starts = next;
        }
    }
    Ok(prior)
}

fn is_unfinished(end: &Snapshot) -> bool {
    end.end().is_none()
}

/// Up to `most` of the rollouts, those that hit first.
fn likeliest(drawn: Vec<Drawn>, hits: &[bool], most: usize) -> Vec<Drawn> {
    let mut chosen: Vec<(&bool, Drawn)> = hits.iter().zip(drawn).collect();
    chosen.sort_by_key(|(hit, _)| !**hit);
    chosen.into_iter().map(|(_, drawn)| drawn).take(most).collect()
}

/// Random rollouts: each has a random one of `starts` states and random choices among `tools` tools.
fn draw(config: &GuidanceConfig, starts: usize, tools: usize, rng: &mut ChaCha8Rng) -> Vec<Drawn> {
    let choice = |rng: &mut ChaCha8Rng| Choice { tool: index(rng, tools), place: uniform_action(rng) };
    let one = |_| (index(rng, starts), (0..config.horizon).map(|_| choice(rng)).collect());
    (0..config.model_rollouts).map(one).collect()
}

/// Makes the drawn rollouts with a model, unless `stop` is requested.
fn roll_out(
    env: &Environment,
    model: &dyn ToolModel,
    starts: &[Snapshot],
    drawn: &[Drawn],
    stop: &Stop,
) -> Result<Vec<ToolRollout>> {
    let mut rolled = Vec::with_capacity(drawn.len());
    for piece in drawn.chunks(ROLLOUTS_PER_STOP_CHECK) {
        stop.check()?;
        let from: Vec<&Snapshot> = piece.iter().map(|(start, _)| &starts[*start]).collect();
        let sequences: Vec<Vec<Choice>> = piece.iter().map(|(_, choices)| choices.clone()).collect();
        rolled.extend(model.tool_rollouts(env, &from, &sequences)?);
    }
    Ok(rolled)
}

/// Clusters a stage's rewarding actions.
fn stage_prior(
    drawn: &[Drawn],
    rolled: &[ToolRollout],
    numbers: &[usize],
    config: &GuidanceConfig,
    rng: &ChaCha8Rng,
) -> Result<StagePrior> {
    let hits = || drawn.iter().zip(rolled).filter(|(_, rollout)| rollout.hit);
    let points: Vec<Vec<f32>> = hits()
        .flat_map(|((_, choices), rollout)| {
            config.rewarding.of(&rollout.actions).into_iter().map(|index| choices[index])
        })
        .map(|Choice { tool, place }| {
            let tool = tool_embedding(numbers[tool]).map_or(&[][..], |tool| &tool[..]);
            [&place[..], tool].concat()
        })
        .collect();
    let mut stage = StagePrior { model_rollouts: rolled.len(), model_hits: hits().count(), ..StagePrior::default() };
    stage.cluster(&points, config, rng)?;
    Ok(stage)
}

impl ActionPrior {
    /// A random position and a point in the space of [`tool_embedding`] for a stage: a cluster is drawn by weight, then
    /// both from its normal distributions. There is no point if the stage has no tools.
    pub fn sample_with_tool(&self, stage: usize, rng: &mut impl Rng) -> (Action, Option<Vec<f32>>) {
        let known = self.stages.get(stage).filter(|stage| !stage.tools.is_empty());
        let Some(stage) = known else { return (self.sample(stage, rng), None) };
        let drawn = stage.draw(rng).and_then(|index| stage.clusters.get(index).zip(stage.tools.get(index)));
        let Some((cluster, tools)) = drawn else { return (uniform_action(rng), None) };
        let place = cluster.sample(rng);
        let number = |(mean, std): (&f32, &f32)| clipped_normal(*mean, *std, rng);
        (place, Some(tools.mean.iter().zip(&tools.std).map(number).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_dynamics::{DynamicsError, Model, ModelConfig, ToolSet, TrainConfig, Training};
    use mge_task::{Region, SubgoalCheck};

    fn config() -> GuidanceConfig {
        GuidanceConfig { model_rollouts: 1500, ..GuidanceConfig::default() }
    }

    #[test]
    fn rewarding_positions_and_tools_are_sampled_and_a_seed_determines_the_prior() {
        let task = Arc::new(mge_task::load("create/GoalTest").unwrap());
        let build = || {
            let prior = build_with_tools(&task, ToolSplit::Train, &TruePhysics, &config(), 3, |_| (), &Stop::default());
            prior.unwrap()
        };
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
    fn a_learned_model_proposes_tools_and_positions_and_continues_from_real_states() {
        // A level with a subgoal that a falling ball passes.
        let mut task = mge_task::load("create/GoalTest").unwrap();
        task.subgoals = vec![Region { position: [-0.7, -0.45], radius: 4.0 }];
        task.rules.subgoal_check = SubgoalCheck::AnyStep;
        let (model, task) = (learned(), Arc::new(task));
        let config = GuidanceConfig { model_rollouts: 600, environment_rollouts: 40, ..GuidanceConfig::default() };
        let build = || build_with_tools(&task, ToolSplit::Train, &model, &config, 3, |_| (), &Stop::default());
        let prior = build().unwrap();
        assert_eq!(prior, build().unwrap());
        assert_eq!(prior.model, "create");
        let stage = &prior.stages[0];
        assert!(stage.model_hits > 0 && !stage.tools.is_empty(), "{} hits", stage.model_hits);
        assert_eq!((stage.environment_rollouts, prior.stages[1].environment_rollouts), (40, 0));
        assert!(stage.environment_hits > 0);
        let mut rng = Stream::Guidance.of(1);
        let (place, tool) = prior.sample_with_tool(0, &mut rng);
        assert!(place.iter().chain(&tool.unwrap()).all(|value| (-1.0..=1.0).contains(value)));
        let push = Arc::new(mge_task::load("create/Push").unwrap());
        let refused = build_with_tools(&push, ToolSplit::Train, &model, &config, 3, |_| (), &Stop::default());
        assert!(matches!(refused, Err(DynamicsError::OtherMovers { .. })));
        let shipped = mge_dynamics::shipped("bucket-box").unwrap();
        let refused = build_with_tools(&task, ToolSplit::Train, &*shipped, &config, 3, |_| (), &Stop::default());
        assert!(matches!(refused, Err(DynamicsError::UnseenEdge { .. })));
    }

    /// A barely trained model of all tools.
    fn learned() -> Model {
        let tools: ToolSet = "create".parse().unwrap();
        let config = tools.apply(ModelConfig { layers: 2, width: 16, embedding: 8, ..ModelConfig::default() });
        let settings = TrainConfig {
            observations: 20,
            validation: 1,
            epochs: 30,
            batch: 32,
            learning_rate: 3e-3,
            ..TrainConfig::default()
        };
        let mut training = Training::new(config, settings, tools.kinds(), "test", &Stop::default()).unwrap();
        training.run(&Stop::default(), |_, _| true);
        training.model().clone()
    }

    #[test]
    fn rollouts_that_hit_are_played_first() {
        let drawn: Vec<Drawn> = (0..5).map(|index| (index, Vec::new())).collect();
        let chosen = likeliest(drawn, &[false, true, false, true, false], 3);
        assert_eq!(chosen.iter().map(|(index, _)| *index).collect::<Vec<_>>(), [1, 3, 0]);
    }

    #[test]
    fn a_build_can_be_stopped() {
        let (task, stop) = (Arc::new(mge_task::load("create/Push").unwrap()), Stop::default());
        stop.request();
        let prior = build_with_tools(&task, ToolSplit::Train, &TruePhysics, &config(), 3, |_| (), &stop);
        assert!(matches!(prior, Err(mge_dynamics::DynamicsError::Stopped)));
    }
}
