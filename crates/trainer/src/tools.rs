//! Adapter between an agent, which handles vectors, and an environment in which it may choose among tools.
//!
//! An agent with the task's own tool has one of two [observations](Observation), which the environment gives.
//!
//! An agent that chooses among tools observes the scene as described by the environment (objects and
//! progress), followed by the catalogue numbers of the action set's tools, which its networks do not see. Its
//! actions are a position and the [embedding](tool_embedding) of a tool. See [`Options`] for the choice.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;

use super::config::RunConfig;
use super::parts::Observation;
use mge_agent::{Ddpg, Options};
use mge_base::streams;
use mge_env::{ActionSet, Choice, Environment, TOOL_FEATURES, tool_embedding};
use mge_guidance::ActionPrior;
use mge_physics::{ACTION_SET, NO_OP, Tool, ToolSplit, to_units};
use mge_task::Task;

/// Number of tools placed by the agent, the newest ones, that it observes besides the objects of the scene.
const PLACED_SEEN: usize = 8;
/// Length of a position.
const PLACE: usize = 2;

/// Lengths of an agent's vectors, and its options.
pub(super) struct Space {
    /// Length of an observation.
    pub observation: usize,
    /// Length of an action.
    pub action: usize,
    /// The tools, if it chooses among tools.
    pub options: Option<Options>,
}

impl Space {
    /// The space of a run's agent.
    pub fn of(config: &RunConfig) -> Self {
        let env = environment(config.task.clone(), config.observation, config.tools);
        let observation = observed(&env).len();
        match config.tools {
            None => Self { observation, action: PLACE, options: None },
            Some(_) => {
                let options = options(config.tool_candidates);
                Self { observation, action: PLACE + TOOL_FEATURES, options: Some(options) }
            }
        }
    }
}

/// The environment of a run, with action sets drawn from `tools`, if given.
pub(super) fn environment(task: Arc<Task>, observation: Observation, tools: Option<ToolSplit>) -> Environment {
    let env = with_slots_for_all(task);
    match tools {
        Some(split) => env.with_tools(split),
        None => observation.applied_to(env),
    }
}

/// The environment of an episode in which the agent chose among these tools of the catalogue; with the task's
/// own tool if there are none.
pub(super) fn environment_with_tools(task: Arc<Task>, tools: &[usize]) -> Environment {
    let env = with_slots_for_all(task);
    if tools.is_empty() { env } else { env.with_action_set(ActionSet::of_catalogue(tools)) }
}

/// An environment with slots for all objects of the task and the newest placed tools.
fn with_slots_for_all(task: Arc<Task>) -> Environment {
    let slots = task.parts().len() + PLACED_SEEN;
    Environment::new(task).with_slots(slots)
}

/// What an agent observes in the environment.
pub fn observed(env: &Environment) -> Vec<f32> {
    let mut observation = env.observation();
    if let Some(set) = env.action_set() {
        observation.truncate(observation.len() - ACTION_SET * TOOL_FEATURES);
        observation.extend(offer(set));
    }
    observation
}

/// Whether the agent's observations have the length of those on a task, which need not be one it was trained on.
pub fn can_play(agent: &Ddpg, observation: Observation, task: &Arc<Task>) -> bool {
    let tools = agent.options().map(|_| ToolSplit::All);
    observed(&environment(task.clone(), observation, tools)).len() == agent.observation_len()
}

/// The choice that an agent's action denotes: the nearest tool of the action set.
pub(super) fn choice(agent: &Ddpg, env: &Environment, action: &[f32]) -> Choice {
    let place = [action[0], action[1]];
    match (agent.options(), env.action_set()) {
        // Before the first reset the set is empty; ACTION_SET is then the number of no tool.
        (Some(options), Some(set)) => {
            let offer: Vec<f32> = offer(set).collect();
            Choice { tool: options.nearest(&offer, &action[PLACE..]).unwrap_or(ACTION_SET), place }
        }
        _ => place.into(),
    }
}

/// The tool that an agent's action places, at its position; none for the no-op.
pub fn chosen_tool(agent: &Ddpg, env: &Environment, action: &[f32]) -> Option<Tool> {
    let Choice { tool, place } = choice(agent, env, action);
    match env.action_set() {
        Some(set) => Some(set.tools().nth(tool)??.at(to_units(place.map(f64::from)))),
        None => Some(env.task().placeable.tool(place)),
    }
}

/// An exploratory action drawn from a prior: a position and, if the agent chooses among tools, the tool of the set
/// nearest to the one drawn from the prior, or a random tool if the prior has none.
pub(super) fn explored(agent: &Ddpg, env: &Environment, prior: &ActionPrior, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let stage = env.snapshot().stage();
    let (Some(options), Some(set)) = (agent.options(), env.action_set()) else {
        return prior.sample(stage, rng).to_vec();
    };
    let (place, point) = prior.sample_with_tool(stage, rng);
    let index = match point {
        Some(point) => options.nearest(&offer(set).collect::<Vec<f32>>(), &point),
        None => Some(streams::index(rng, set.len().max(1))),
    };
    let tool = index.and_then(|index| set.numbers().nth(index)).unwrap_or(NO_OP);
    [&place[..], options.embedding(tool).unwrap_or(&[])].concat()
}

/// The tool numbers of an action set as in an observation, padded with -1.
fn offer(set: &ActionSet) -> impl Iterator<Item = f32> {
    set.numbers().map(|number| number as f32).chain(std::iter::repeat(-1.0)).take(ACTION_SET)
}

/// All tools of the catalogue, including the no-op.
fn options(candidates: usize) -> Options {
    let embeddings = (0..=NO_OP).filter_map(tool_embedding).flatten().copied().collect();
    Options::new(TOOL_FEATURES, embeddings, ACTION_SET, candidates)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::{Method, Training};
    use mge_guidance::GuidanceConfig;

    fn training() -> (Training, Environment) {
        let task = Arc::new(mge_task::load("create/Push").unwrap());
        let mut config = RunConfig::default_with(task.clone(), Method::Ddpg, Some(ToolSplit::Train));
        config.ddpg.hidden = 8;
        let mut env = environment(task, config.observation, Some(ToolSplit::Test));
        env.reset(&mut ChaCha8Rng::seed_from_u64(5));
        (Training::new(config, None).unwrap(), env)
    }

    #[test]
    fn every_tool_of_a_set_is_found_by_its_embedding() {
        let (training, env) = training();
        let options = training.ddpg().options().unwrap();
        assert!(options.embeddings().iter().all(|value| (-1.0..=1.0).contains(value)));
        for (index, number) in env.action_set().unwrap().numbers().enumerate() {
            let action = [&[0.5, -0.5], options.embedding(number).unwrap()].concat();
            let choice = choice(training.ddpg(), &env, &action);
            assert_eq!(choice, Choice { tool: index, place: [0.5, -0.5] }, "tool {number}");
        }
    }

    #[test]
    fn observations_end_with_the_tools_on_offer_and_the_agent_takes_one_of_them() {
        let (training, env) = training();
        let observation = observed(&env);
        assert_eq!(observation.len(), training.ddpg().observation_len());
        let numbers: Vec<usize> = observation[observation.len() - ACTION_SET..].iter().map(|n| *n as usize).collect();
        assert_eq!(numbers, env.start().tools);
        let action = training.ddpg().act(&observation);
        let tool = choice(training.ddpg(), &env, &action).tool;
        let embedding = training.ddpg().options().unwrap().embedding(numbers[tool]).unwrap();
        assert_eq!(&action[PLACE..], embedding, "the tool itself, not something near it");
    }

    #[test]
    fn random_tools_come_from_the_set() {
        let (training, env) = training();
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let prior = ActionPrior::uniform(env.task(), &GuidanceConfig::default(), 0);
        let mut seen = [0; ACTION_SET];
        for _ in 0..4000 {
            let action = explored(training.ddpg(), &env, &prior, &mut rng);
            seen[choice(training.ddpg(), &env, &action).tool] += 1;
        }
        // 100 expected, standard deviation 10.
        assert!(seen.iter().all(|count| (60..140).contains(count)), "{seen:?}");
    }
}
