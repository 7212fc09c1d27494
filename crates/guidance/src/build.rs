//! Builds the action prior from subgoal to subgoal (paper, section 4.2, steps 1 to 4).

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::clusters::cluster;
use super::config::{GuidanceConfig, StartStates};
use super::prior::{ActionPrior, StagePrior};
use super::rollout::RolloutModel;
use mge_base::stop::Stop;
use mge_base::streams::Stream;
use mge_dynamics::{DynamicsError, Result, Rollout};
use mge_env::{Action, Environment, Snapshot, uniform_action};
use mge_task::Task;

/// The states in which real rollouts towards a stage ended, without those of ended episodes.
#[derive(Debug, Default)]
pub struct EndStates {
    /// Those in which the stage was reached.
    pub reached: Vec<Snapshot>,
    /// Those of all rollouts.
    pub last: Vec<Snapshot>,
}

/// Builds the prior of a task stage by stage. `progress` is called before each stage with its index.
///
/// Each stage has its own random stream, so the work of one stage does not affect the draws of another.
///
/// # Errors
/// When the model cannot predict the task, or `stop` is requested.
pub fn build(
    task: &Arc<Task>,
    model: &dyn RolloutModel,
    config: &GuidanceConfig,
    seed: u64,
    stop: &Stop,
    progress: impl FnMut(usize),
) -> Result<ActionPrior> {
    let prior = ActionPrior::uniform(task, config, seed);
    let mut env = Environment::new(task.clone());
    let explored = task.stage_count() - 1;
    let rollouts = config.environment_rollouts.div_ceil(explored.max(1));
    build_with(prior, task, Some(model), stop, progress, |prior, stage, starts, rng| {
        // No stage follows the last one.
        if stage == explored {
            return Ok(EndStates::default());
        }
        prior.stages[stage].environment_rollouts = rollouts;
        Ok(explore(&mut env, prior, stage, starts, stop, rng))
    })
}

/// Builds the clusters of `prior` stage by stage from rollouts in `model`, by its settings and seed; without a model,
/// they stay as they are. `progress` is called before each stage with its index. `play` then makes the real rollouts
/// (step 3): it is given the prior, in which it may change the clusters of the stage, the stage, the start states and
/// the random stream of the stage. From the states that it returns the rollouts towards the next stage start; if there
/// are none, from the same states as before.
///
/// # Errors
/// When the model cannot predict the task, or `stop` is requested; those of `play`.
pub fn build_with<E: From<DynamicsError>>(
    mut prior: ActionPrior,
    task: &Arc<Task>,
    model: Option<&dyn RolloutModel>,
    stop: &Stop,
    mut progress: impl FnMut(usize),
    mut play: impl FnMut(&mut ActionPrior, usize, &[Snapshot], &mut ChaCha8Rng) -> Result<EndStates, E>,
) -> Result<ActionPrior, E> {
    let config = prior.config.clone();
    let mut env = Environment::new(task.clone());
    env.reset(&mut Stream::PriorStart.of(prior.seed));
    let mut starts = vec![env.snapshot().clone()];
    if let Some(model) = model {
        prior = prior.of_model(model);
    }
    for stage in 0..task.stage_count() {
        progress(stage);
        let mut rng = Stream::PriorStage(stage).of(prior.seed);
        if let Some(model) = model {
            let prediction = Prediction { model, config: &config, seed: prior.seed, stop };
            prior.stages[stage] = prediction.imagine(task, &starts, &mut rng)?;
        }
        let EndStates { reached, last } = play(&mut prior, stage, &starts, &mut rng)?;
        stop.check().map_err(DynamicsError::from)?;
        let wanted = if config.start_states == StartStates::Last || reached.is_empty() { last } else { reached };
        if !wanted.is_empty() {
            starts = wanted;
        }
    }
    Ok(prior)
}

/// Predictions of a model, by the settings and the seed of a build.
#[derive(Clone, Copy)]
pub(super) struct Prediction<'a> {
    pub model: &'a dyn RolloutModel,
    pub config: &'a GuidanceConfig,
    pub seed: u64,
    pub stop: &'a Stop,
}

impl Prediction<'_> {
    /// Step 2: rolls out random actions in the model and clusters the rewarding ones. Makes more rollouts
    /// while too few reach the stage, and longer ones if none does.
    pub fn imagine(&self, task: &Task, starts: &[Snapshot], rng: &mut ChaCha8Rng) -> Result<StagePrior> {
        let mut stage = StagePrior::default();
        let mut config = self.config.clone();
        let longest = config.longest_horizon.min(task.rules.max_actions as usize);
        let mut most = config.most_model_rollouts;
        loop {
            let rollouts = Prediction { config: &config, ..*self }.random_rollouts(starts, rng)?;
            stage.environment_actions += self.model.environment_actions(&rollouts);
            stage.actions.extend(rollouts.iter().flat_map(|rollout| config.rewarding.actions_of(rollout)));
            stage.model_rollouts += rollouts.len();
            stage.model_hits += rollouts.iter().filter(|rollout| rollout.hit).count();
            if stage.model_hits >= config.least_hits {
                break;
            }
            if stage.model_rollouts >= most {
                if stage.model_hits > 0 || config.horizon >= longest {
                    break;
                }
                config.horizon = (2 * config.horizon).min(longest);
                stage.longer_horizon = Some(config.horizon);
                most += config.most_model_rollouts;
            }
        }
        stage.clusters = cluster(&stage.actions, &config, rng)?;
        Ok(stage)
    }

    /// Rollouts of random actions, each from one of `starts`.
    pub fn random_rollouts(&self, starts: &[Snapshot], rng: &mut ChaCha8Rng) -> Result<Vec<Rollout>> {
        let GuidanceConfig { model_rollouts, horizon, .. } = *self.config;
        let chosen: Vec<&Snapshot> = (0..model_rollouts).map(|_| &starts[rng.gen_range(0..starts.len())]).collect();
        let sequences: Vec<Vec<Action>> =
            chosen.iter().map(|_| (0..horizon).map(|_| uniform_action(rng)).collect()).collect();
        self.model.rollouts(&chosen, &sequences, self.stop)
    }
}

/// Step 3: plays actions from the clusters in the real environment. Ends early once `stop` is requested.
fn explore(
    env: &mut Environment,
    prior: &mut ActionPrior,
    stage: usize,
    starts: &[Snapshot],
    stop: &Stop,
    rng: &mut ChaCha8Rng,
) -> EndStates {
    let mut ends = EndStates::default();
    let horizon = prior.horizon(stage);
    let built = &mut prior.stages[stage];
    for _ in stop.until(0..built.environment_rollouts) {
        env.restore(&starts[rng.gen_range(0..starts.len())]);
        for _ in 0..horizon {
            if env.step(built.sample(rng)).is_err() {
                break;
            }
            built.environment_actions += 1;
            if env.snapshot().stage() > stage {
                break;
            }
        }
        let end = env.snapshot();
        if end.end().is_none() {
            ends.last.push(end.clone());
        }
        if end.stage() > stage && end.end().is_none() {
            ends.reached.push(end.clone());
        }
    }
    built.environment_hits = ends.reached.len();
    ends
}
