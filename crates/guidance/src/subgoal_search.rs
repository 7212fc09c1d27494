//! Chooses the subgoals with which guided play in the real environment does best. Used for subgoals that a
//! user asks for; [`propose_subgoals`](super::propose_subgoals) is faster.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::build::build_stages;
use super::config::GuidanceConfig;
use super::prior::ActionPrior;
use super::proposal::propose_regions;
use super::rollout::RolloutModel;
use mge_base::stop::Stop;
use mge_base::streams::Stream;
use mge_dynamics::Result;
use mge_env::{Environment, Snapshot};
use mge_physics::to_normalised;
use mge_task::{Region, Task};

/// Number of candidates after which the search ends. The last batch of proposals may exceed it.
pub const TRIALS: usize = 12;
/// Maximum number of next subgoals proposed for one candidate.
const BRANCHES: usize = 4;
/// Real rollouts from the last subgoal towards the goal that evaluate a candidate.
const ROLLOUTS: usize = 100;
/// Maximum number of batches of [`GuidanceConfig::model_rollouts`] for a stage of a candidate with subgoals.
const MAX_ROUNDS: usize = 4;
/// The search ends at a candidate that [needs](Candidate::rollouts) at most this many real rollouts.
const GOOD_ENOUGH_ROLLOUTS: f32 = 4.0;
/// Share of real rollouts reaching a subgoal above which a larger share does not make it more promising.
const SUFFICIENT_REACHED_SHARE: f32 = 0.1;

/// Chosen subgoals, and how well guided play does with them.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSubgoals {
    /// The subgoals; empty if guided play does best without any.
    pub subgoals: Vec<Region>,
    /// The smallest share, over all stages, of the real rollouts towards a stage that reached it.
    pub least_reached: f32,
    /// Number of candidates that were tried.
    pub candidates: usize,
}

impl ChosenSubgoals {
    /// Whether there are no subgoals, and guided play does not reach the goal without them.
    pub fn is_failure(&self) -> bool {
        self.subgoals.is_empty() && self.least_reached == 0.0
    }
}

/// The message for a [failure](ChosenSubgoals::is_failure).
pub const NO_SUBGOALS: &str = "no subgoal was found that makes the goal easier to reach";

/// Chooses up to `count` subgoals for the task and ignores its present ones. This is a best-first search. The
/// first candidate has no subgoals. The successors of a candidate have one more subgoal: a
/// [region](propose_regions) on the way to the goal from the states in which real rollouts reached the last one.
/// To evaluate a candidate, clusters are built, and guided rollouts in the real environment measure how often each
/// stage is reached from the previous one. The best candidate needs the fewest rollouts to reach every stage once,
/// one stage after the other; ties go to the one that comes nearest to the goal. The search ends early at a
/// candidate that needs at most four rollouts. If no candidate reaches the goal, the search is repeated with rollouts
/// that may last as long as an episode, whatever [`GuidanceConfig::longest_horizon`] says. `progress` is called with
/// the number of candidates tried so far.
///
/// # Errors
/// When the model cannot predict the task, or `stop` is requested.
pub fn choose_subgoals(
    task: &Task,
    model: &dyn RolloutModel,
    count: usize,
    config: &GuidanceConfig,
    seed: u64,
    stop: &Stop,
    mut progress: impl FnMut(usize),
) -> Result<ChosenSubgoals> {
    let with = |longest_horizon| GuidanceConfig { longest_horizon, ..config.clone() };
    let found = search(task, model, count, &with(config.horizon), seed, stop, &mut progress)?;
    let longest = task.rules.max_actions as usize;
    if found.least_reached > 0.0 || longest <= config.horizon {
        return Ok(found);
    }
    let again = search(task, model, count, &with(longest), seed, stop, &mut progress)?;
    Ok(if again.least_reached > 0.0 { again } else { found })
}

fn search(
    task: &Task,
    model: &dyn RolloutModel,
    count: usize,
    config: &GuidanceConfig,
    seed: u64,
    stop: &Stop,
    progress: &mut impl FnMut(usize),
) -> Result<ChosenSubgoals> {
    progress(0);
    let most_model_rollouts = config.most_model_rollouts.min(MAX_ROUNDS * config.model_rollouts);
    let brief = GuidanceConfig { most_model_rollouts, ..config.clone() };
    // Candidates, and whether their successors have been tried.
    let mut tried = vec![(Candidate::of(task, &[], model, config, seed, stop)?, count == 0)];
    while tried.len() < TRIALS && tried.iter().all(|(candidate, _)| candidate.rollouts() > GOOD_ENOUGH_ROLLOUTS) {
        let open = tried.iter_mut().filter(|(_, is_done)| !is_done);
        let Some((parent, is_done)) = open.max_by(|a, b| a.0.promise().total_cmp(&b.0.promise())) else { break };
        *is_done = true;
        let parent = parent.clone();
        let rng = &mut Stream::Proposal { attempt: tried.len(), number: parent.subgoals().len() + 1 }.of(seed);
        for region in propose_regions(&parent.task, model, &parent.starts, BRANCHES, &brief, stop, rng)? {
            progress(tried.len().min(TRIALS - 1));
            let subgoals = [parent.subgoals(), &[region]].concat();
            let is_last = subgoals.len() == count;
            tried.push((Candidate::of(task, &subgoals, model, &brief, seed, stop)?, is_last));
        }
    }
    let candidates = tried.len();
    let better = |best: Candidate, other: Candidate| if other.is_better_than(&best) { other } else { best };
    // There is at least the candidate without subgoals.
    let best = tried.into_iter().map(|(candidate, _)| candidate).reduce(better).expect("a candidate");
    Ok(ChosenSubgoals { subgoals: best.subgoals().to_vec(), least_reached: best.least_reached(), candidates })
}

/// Subgoals, and how well guided play does with them.
#[derive(Debug, Clone)]
struct Candidate {
    /// The task with these subgoals.
    task: Arc<Task>,
    /// For each subgoal, and last the goal, the share of the real rollouts towards it that reached it.
    reached: Vec<f32>,
    /// Least distance to the goal, normalised: the mean over the nearest tenth of the rollouts towards it.
    nearest: f32,
    /// Start states of the rollouts towards the goal.
    starts: Vec<Snapshot>,
}

impl Candidate {
    fn of(
        task: &Task,
        subgoals: &[Region],
        model: &dyn RolloutModel,
        config: &GuidanceConfig,
        seed: u64,
        stop: &Stop,
    ) -> Result<Self> {
        let task = Arc::new(Task { subgoals: subgoals.to_vec(), ..task.clone() });
        let (prior, starts) = build_stages(&task, model, config, seed, stop, |_| ())?;
        let mut rng = Stream::Trial.of(seed);
        let mut env = Environment::new(task.clone());
        let mut goals = 0;
        let mut distances: Vec<f32> = Vec::with_capacity(ROLLOUTS);
        for _ in 0..ROLLOUTS {
            env.restore(&starts[rng.gen_range(0..starts.len())]);
            distances.push(play(&mut env, &prior, prior.horizon(subgoals.len()), &mut rng));
            goals += usize::from(env.snapshot().goal_reached());
        }
        distances.sort_by(f32::total_cmp);
        let nearest = &distances[..ROLLOUTS.div_ceil(10)];
        let stages = prior.stages[..subgoals.len()].iter();
        let shares = stages.map(|stage| stage.environment_hits as f32 / stage.environment_rollouts as f32);
        Ok(Self {
            task,
            reached: shares.chain([goals as f32 / ROLLOUTS as f32]).collect(),
            nearest: nearest.iter().sum::<f32>() / nearest.len() as f32,
            starts,
        })
    }

    fn subgoals(&self) -> &[Region] {
        &self.task.subgoals
    }

    /// The smallest of the shares [`reached`](Self::reached).
    fn least_reached(&self) -> f32 {
        least(&self.reached)
    }

    /// Expected number of rollouts until every stage was reached once, one after the other; infinite if a stage
    /// was never reached.
    fn rollouts(&self) -> f32 {
        self.reached.iter().map(|share| share.recip()).sum()
    }

    /// How promising it is to add a subgoal: greater if the present ones are reached often enough and play comes
    /// near the goal.
    fn promise(&self) -> f32 {
        least(&self.reached[..self.subgoals().len()]).min(SUFFICIENT_REACHED_SHARE) / SUFFICIENT_REACHED_SHARE
            - self.nearest
    }

    fn is_better_than(&self, other: &Self) -> bool {
        self.rollouts() < other.rollouts() || self.rollouts() == other.rollouts() && self.nearest < other.nearest
    }
}

/// The smallest of some shares; 1 if there are none.
fn least(shares: &[f32]) -> f32 {
    shares.iter().copied().fold(1.0, f32::min)
}

/// Plays up to `actions` actions from the clusters. Returns the least distance to the goal, normalised.
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
    use crate::TruePhysics;
    use mge_dynamics::DynamicsError;
    use mge_task::load;

    fn choose(task: &Task) -> ChosenSubgoals {
        choose_subgoals(task, &TruePhysics, 2, &GuidanceConfig::default(), 0, &Stop::default(), |_| ()).unwrap()
    }

    fn without_subgoals(task: &Task) -> Candidate {
        Candidate::of(task, &[], &TruePhysics, &GuidanceConfig::default(), 0, &Stop::default()).unwrap()
    }

    #[test]
    fn the_chosen_subgoals_make_a_rarely_reached_goal_more_reachable() {
        let task = load("task6").unwrap();
        let without = without_subgoals(&task).least_reached();
        let choice = choose(&task);
        assert!(choice.least_reached > 2.0 * without, "{choice:?} {without:?}");
        assert!(choice.candidates > 1 && !choice.subgoals.is_empty());
        assert_eq!(choose(&task), choice, "the same seed, the same choice");
    }

    #[test]
    fn if_guided_play_needs_no_subgoals_the_search_ends_at_once() {
        let mut task = load("task1").unwrap();
        task.goal.radius = 12.0;
        let choice = choose(&task);
        assert_eq!((choice.subgoals.len(), choice.candidates), (0, 1));
        assert!(choice.least_reached >= 1.0 / GOOD_ENOUGH_ROLLOUTS);
    }

    #[test]
    fn a_goal_far_away_is_found_by_longer_rollouts() {
        let task = load("task1").unwrap();
        let config = GuidanceConfig { horizon: 2, longest_horizon: 2, most_model_rollouts: 1200, ..Default::default() };
        let short = search(&task, &TruePhysics, 0, &config, 0, &Stop::default(), &mut |_| ()).unwrap();
        let choice = choose_subgoals(&task, &TruePhysics, 0, &config, 0, &Stop::default(), |_| ()).unwrap();
        assert!(short.is_failure() && choice.least_reached > 0.0, "{short:?} {choice:?}");
    }

    #[test]
    fn if_no_subgoals_are_wanted_only_play_without_them_is_tried() {
        let task = load("task6").unwrap();
        let choice =
            choose_subgoals(&task, &TruePhysics, 0, &GuidanceConfig::default(), 0, &Stop::default(), |_| ()).unwrap();
        assert_eq!((choice.subgoals.len(), choice.candidates), (0, 1));
    }

    #[test]
    fn fewer_rollouts_are_better_and_then_a_shorter_distance() {
        let task = load("task1").unwrap();
        let like = without_subgoals(&task);
        let candidate = |goal, nearest| Candidate { reached: vec![goal], nearest, ..like.clone() };
        assert!(candidate(0.2, 0.5).is_better_than(&candidate(0.1, 0.1)));
        assert!(candidate(0.1, 0.1).is_better_than(&candidate(0.1, 0.2)));
        assert!(!candidate(0.1, 0.1).is_better_than(&candidate(0.1, 0.1)));
        assert!(!candidate(0.1, 0.1).is_better_than(&candidate(0.2, 0.2)));
        assert!(!candidate(0.0, 0.2).is_better_than(&candidate(0.0, 0.1)), "none is reached: the distance counts");
        let with_subgoal = |subgoal, goal| Candidate {
            task: Arc::new(Task { subgoals: task.subgoals[..1].to_vec(), ..task.clone() }),
            reached: vec![subgoal, goal],
            ..like.clone()
        };
        assert_eq!((with_subgoal(0.5, 0.25).rollouts(), with_subgoal(0.5, 0.25).least_reached()), (6.0, 0.25));
        assert!(with_subgoal(0.5, 0.25).is_better_than(&candidate(0.16, 0.1)), "6 rollouts for 6.25");
        assert!(candidate(0.17, 0.1).is_better_than(&with_subgoal(0.5, 0.25)));
        assert!(with_subgoal(0.2, 0.0).promise() > with_subgoal(0.05, 0.9).promise(), "it is reached often enough");
        assert_eq!(with_subgoal(0.2, 0.0).promise(), with_subgoal(0.9, 0.0).promise(), "more often is no better");
        assert!(candidate(0.0, 0.1).promise() > candidate(0.0, 0.2).promise(), "the nearer is more promising");
    }

    #[test]
    fn the_choice_can_be_stopped() {
        let stop = Stop::default();
        stop.request();
        let task = load("task1").unwrap();
        let choice = choose_subgoals(&task, &TruePhysics, 2, &GuidanceConfig::default(), 0, &stop, |_| ());
        assert!(matches!(choice, Err(DynamicsError::Stopped)));
    }
}
