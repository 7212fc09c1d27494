//! Which proposed subgoals are used: those with which guided play in the real environment does best.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::build::build_stages;
use super::config::GuidanceConfig;
use super::prior::ActionPrior;
use super::proposal::propose_subgoals;
use super::rollout::RolloutModel;
use crate::dynamics::DynamicsError;
use crate::env::Environment;
use crate::physics::to_normalised;
use crate::streams::Stream;
use crate::task::{Region, Task};

/// Proposals, at most.
pub const PROPOSALS: usize = 8;
/// Real rollouts from the last subgoal towards the goal in which a candidate is tried.
const ROLLOUTS: usize = 100;
/// Share of real rollouts that reach their stage, at every stage, which is enough: no other candidate is
/// looked for.
const ENOUGH: f32 = 0.1;
/// How many times as many rollouts are made after a proposal found no place.
const MORE: usize = 4;

/// Subgoals, and how well guided play gets along with them.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSubgoals {
    /// The subgoals; none where guided play does best without.
    pub subgoals: Vec<Region>,
    /// Of the real rollouts towards a stage the share that reached it, at the stage where it is least.
    pub least_reached: f32,
    /// Candidates that were tried.
    pub candidates: usize,
}

impl ChosenSubgoals {
    /// Whether there are no subgoals, and guided play does not reach the goal without them.
    pub fn is_failure(&self) -> bool {
        self.subgoals.is_empty() && self.least_reached == 0.0
    }
}

/// What to say of a [failure](ChosenSubgoals::is_failure).
pub const NO_SUBGOALS: &str = "no place was found that helps the ball on its way to the goal";

/// Proposes up to `count` subgoals for the task, whose present ones are ignored. Candidates are no
/// subgoals at all, then every [proposal](propose_subgoals) and its beginnings. Clusters are built for
/// each, and rollouts in the real environment guided by them show how often each stage is reached from
/// the one before. The first candidate that reaches every stage often is chosen, or else the one whose
/// hardest stage is reached most often, or which comes nearest to the goal.
/// `progress` is called with the number of proposals made before.
///
/// # Errors
/// When the model cannot predict the task, or [is stopped](RolloutModel::is_stopped).
pub fn choose_subgoals(
    task: &Task,
    model: &dyn RolloutModel,
    count: usize,
    config: &GuidanceConfig,
    seed: u64,
    mut progress: impl FnMut(usize),
) -> Result<ChosenSubgoals, DynamicsError> {
    let mut config = config.clone();
    let mut tried = Vec::new();
    let mut candidates = 1;
    progress(0);
    let mut best = (Trial::of(task, &[], model, &config, seed)?, Vec::new());
    for attempt in 0..PROPOSALS {
        if best.0.least_reached >= ENOUGH {
            break;
        }
        progress(attempt);
        let proposal = propose_subgoals(task, model, count, &config, seed, &tried)?;
        tried.push(proposal.first().copied());
        if proposal.is_empty() {
            if tried.iter().filter(|first| first.is_none()).count() > 1 {
                break;
            }
            // Places that are reached seldom need many rollouts.
            config.model_rollouts *= MORE;
        }
        for length in 1..=proposal.len() {
            let trial = Trial::of(task, &proposal[..length], model, &config, seed)?;
            candidates += 1;
            if trial.is_better_than(&best.0) {
                best = (trial, proposal[..length].to_vec());
            }
        }
    }
    Ok(ChosenSubgoals { subgoals: best.1, least_reached: best.0.least_reached, candidates })
}

/// How guided play gets along with a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trial {
    /// As of [`ChosenSubgoals`].
    least_reached: f32,
    /// Mean distance to the goal, normalised, at its least in the tenth of the last rollouts that came
    /// nearest.
    nearest: f32,
}

impl Trial {
    fn of(
        task: &Task,
        subgoals: &[Region],
        model: &dyn RolloutModel,
        config: &GuidanceConfig,
        seed: u64,
    ) -> Result<Self, DynamicsError> {
        let task = Arc::new(Task { subgoals: subgoals.to_vec(), ..task.clone() });
        let (prior, starts) = build_stages(&task, model, "", config, seed, |_| ())?;
        let mut rng = Stream::Trial.of(seed);
        let mut env = Environment::new(task);
        let mut goals = 0;
        let mut distances: Vec<f32> = Vec::with_capacity(ROLLOUTS);
        for _ in 0..ROLLOUTS {
            env.restore(&starts[rng.gen_range(0..starts.len())]);
            distances.push(play(&mut env, &prior, config.horizon, &mut rng));
            goals += usize::from(env.snapshot().goal_reached());
        }
        distances.sort_by(f32::total_cmp);
        let nearest = &distances[..ROLLOUTS.div_ceil(10)];
        let subgoals = prior.stages[..subgoals.len()].iter();
        let reached = subgoals.map(|stage| stage.environment_hits as f32 / stage.environment_rollouts as f32);
        Ok(Self {
            least_reached: reached.fold(goals as f32 / ROLLOUTS as f32, f32::min),
            nearest: nearest.iter().sum::<f32>() / nearest.len() as f32,
        })
    }

    fn is_better_than(&self, other: &Self) -> bool {
        self.least_reached > other.least_reached
            || self.least_reached == other.least_reached && self.nearest < other.nearest
    }
}

/// Plays at most `actions` actions from the clusters. Returns the least distance to the goal, normalised.
fn play(env: &mut Environment, prior: &ActionPrior, actions: usize, rng: &mut ChaCha8Rng) -> f32 {
    let [x, y] = env.task().goal.position;
    let mut least = f32::INFINITY;
    for _ in 0..actions {
        let action = prior.sample(env.snapshot().stage(), rng);
        let step = env.step_watched(action, |world| {
            let ball = to_normalised(world.ball(0).position);
            least = least.min((ball[0] - x).hypot(ball[1] - y));
        });
        if step.map_or(true, |step| step.end.is_some()) {
            break;
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guidance::{Stoppable, TruePhysics};
    use crate::stop::Stop;
    use crate::task::load;

    fn choose(task: &Task) -> ChosenSubgoals {
        choose_subgoals(task, &TruePhysics, 2, &GuidanceConfig::default(), 0, |_| ()).unwrap()
    }

    #[test]
    fn the_chosen_subgoals_reach_a_goal_that_play_without_them_seldom_does() {
        let task = load("task6").unwrap();
        let without = Trial::of(&task, &[], &TruePhysics, &GuidanceConfig::default(), 0).unwrap();
        let choice = choose(&task);
        assert!(choice.least_reached > 2.0 * without.least_reached, "{choice:?} {without:?}");
        assert!(choice.candidates > 1 && !choice.subgoals.is_empty());
        assert_eq!(choose(&task), choice, "the same seed, the same choice");
    }

    #[test]
    fn where_guided_play_needs_no_subgoals_none_is_looked_for() {
        let choice = choose(&load("task1").unwrap());
        assert_eq!((choice.subgoals.len(), choice.candidates), (0, 1));
        assert!(choice.least_reached >= ENOUGH);
    }

    #[test]
    fn a_later_proposal_begins_elsewhere() {
        let (task, config) = (load("task6").unwrap(), GuidanceConfig::default());
        let mut tried = Vec::new();
        for _ in 0..3 {
            let proposal = propose_subgoals(&task, &TruePhysics, 1, &config, 0, &tried).unwrap();
            let [x, y] = proposal[0].position;
            for other in tried.iter().flatten() {
                let Region { position, .. } = other;
                assert!((x - position[0]).hypot(y - position[1]) > 0.1, "{tried:?} {proposal:?}");
            }
            tried.push(Some(proposal[0]));
        }
    }

    #[test]
    fn stages_reached_more_often_are_better_and_then_a_shorter_distance() {
        let trial = |least_reached, nearest| Trial { least_reached, nearest };
        assert!(trial(0.2, 0.5).is_better_than(&trial(0.1, 0.1)));
        assert!(trial(0.1, 0.1).is_better_than(&trial(0.1, 0.2)));
        assert!(!trial(0.1, 0.1).is_better_than(&trial(0.1, 0.1)));
        assert!(!trial(0.1, 0.1).is_better_than(&trial(0.2, 0.2)));
    }

    #[test]
    fn the_choice_ends_when_it_is_asked_to() {
        let stop = Stop::default();
        stop.request();
        let stopped = Stoppable::new(&TruePhysics, &stop);
        let choice = choose_subgoals(&load("task1").unwrap(), &stopped, 2, &GuidanceConfig::default(), 0, |_| ());
        assert!(matches!(choice, Err(DynamicsError::Stopped)));
    }
}
