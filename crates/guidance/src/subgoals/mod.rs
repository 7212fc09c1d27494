//! Subgoals proposed by the program (the paper's future work): regions through which rollouts pass that come near the
//! goal, and that the ball does not reach by itself.
//!
//! A dynamics model predicts how well guided play does with many candidates; few real rollouts check the best ones.

mod candidate;
mod check;
mod regions;

use std::cmp::Ordering;

use rand_chacha::ChaCha8Rng;

use mge_base::stop::Stop;
use mge_base::streams::Stream;
use mge_dynamics::Result;
use mge_task::{Region, Task};

use self::candidate::Candidate;
use self::check::Check;
use super::build::Prediction;
use super::config::GuidanceConfig;
use super::rollout::RolloutModel;

/// Number of candidates after which the search ends. The last batch of proposals may exceed it.
pub const TRIALS: usize = 12;
/// Maximum number of next subgoals proposed for one candidate.
const BRANCHES: usize = 4;
/// Maximum number of batches of [`GuidanceConfig::model_rollouts`] for a stage of a candidate with subgoals.
const MAX_ROUNDS: usize = 4;
/// The search ends at a candidate that needs at most this many rollouts.
const GOOD_ENOUGH_ROLLOUTS: f32 = 4.0;
/// Number of real actions after which no further candidate is checked.
const MAX_ACTIONS: usize = 300;

/// Chosen subgoals, and how well guided play does with them.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSubgoals {
    /// The subgoals; empty if guided play does best without any.
    pub subgoals: Vec<Region>,
    /// The smallest share, over all stages, of the real rollouts towards a stage that reached it.
    pub least_reached: f32,
    /// Number of candidates that were predicted.
    pub candidates: usize,
    /// Number of actions in the real environment.
    pub actions: usize,
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
/// [region](Prediction::regions) on the way to the goal from the states in which the last one is predicted to be reached.
/// Of a candidate, the model predicts how often rollouts from its clusters reach each stage from the previous one. The
/// candidates that need the fewest rollouts to reach every stage once, one after the other, are then checked with a few
/// rollouts in the real environment, as long as these have taken fewer than 300 actions. The search ends early at a
/// candidate that needs at most four rollouts. If no candidate is predicted to reach the goal, it is repeated with
/// rollouts that may last as long as an episode, whatever [`GuidanceConfig::longest_horizon`] says. `progress` is called
/// with the number of candidates tried so far.
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
    let mut config = GuidanceConfig { longest_horizon: config.horizon, ..config.clone() };
    let mut search = Search::new(Prediction { model, config: &config, seed, stop }, task, count, &mut progress)?;
    let longest = task.rules.max_actions as usize;
    if search.is_hopeless() && longest > config.horizon {
        config.longest_horizon = longest;
        search = Search::new(Prediction { model, config: &config, seed, stop }, task, count, &mut progress)?;
    }
    Ok(search.choose(&config))
}

/// The candidates of a search.
struct Search {
    /// Candidates, and what real rollouts with them reached.
    tried: Vec<(Candidate, Option<Check>)>,
    /// Draws of the real rollouts.
    rng: ChaCha8Rng,
    /// Real actions so far.
    actions: usize,
}

impl Search {
    /// Predicts candidates until one of them is good enough.
    fn new(prediction: Prediction<'_>, task: &Task, count: usize, progress: &mut impl FnMut(usize)) -> Result<Self> {
        progress(0);
        let Prediction { config, seed, .. } = prediction;
        let most_model_rollouts = config.most_model_rollouts.min(MAX_ROUNDS * config.model_rollouts);
        let brief = &GuidanceConfig { most_model_rollouts, ..config.clone() };
        let of_successors = Prediction { config: brief, ..prediction };
        let mut search = Self { tried: Vec::new(), rng: Stream::Trial.of(seed), actions: 0 };
        let mut open = Vec::new();
        search.add(prediction.root(task)?, config);
        if count > 0 {
            open.push(0);
        }
        while search.tried.len() < TRIALS && !search.is_good_enough() {
            let promise = |index: &usize| search.tried[*index].0.promise();
            let next = (0..open.len()).max_by(|a, b| promise(&open[*a]).total_cmp(&promise(&open[*b])));
            let Some(next) = next else { break };
            let parent = search.tried[open.remove(next)].0.clone();
            let starts = parent.goal_starts();
            if starts.is_empty() {
                continue;
            }
            let number = parent.subgoals().len() + 1;
            let rng = &mut Stream::Proposal { attempt: search.tried.len(), number }.of(seed);
            for region in of_successors.regions(&parent.task, &starts, BRANCHES, rng)? {
                progress(search.tried.len().min(TRIALS - 1));
                if number < count {
                    open.push(search.tried.len());
                }
                search.add(of_successors.successor(&parent, region)?, config);
            }
        }
        Ok(search)
    }

    /// Adds a candidate, and checks it if it may be good enough.
    fn add(&mut self, candidate: Candidate, config: &GuidanceConfig) {
        let is_promising = candidate.rollouts() <= GOOD_ENOUGH_ROLLOUTS;
        self.tried.push((candidate, None));
        if is_promising {
            self.check(self.tried.len() - 1, config);
        }
    }

    /// Plays real rollouts with a candidate, if there are actions left.
    fn check(&mut self, index: usize, config: &GuidanceConfig) {
        let left = MAX_ACTIONS.saturating_sub(self.actions);
        if left > 0 {
            let check = Check::of(&self.tried[index].0, config.horizon, left, &mut self.rng);
            self.actions += check.actions;
            self.tried[index].1 = Some(check);
        }
    }

    /// Whether a checked candidate is good enough.
    fn is_good_enough(&self) -> bool {
        let checked = self.tried.iter().filter_map(|(candidate, check)| Some(check.as_ref()?.rollouts(candidate)));
        checked.fold(f32::INFINITY, f32::min) <= GOOD_ENOUGH_ROLLOUTS
    }

    /// Whether no candidate is predicted to reach the goal.
    fn is_hopeless(&self) -> bool {
        self.tried.iter().all(|(candidate, _)| candidate.rollouts().is_infinite())
    }

    /// The best of the checked candidates. Checks those that are predicted best, as long as there are actions left.
    fn choose(mut self, config: &GuidanceConfig) -> ChosenSubgoals {
        let predicted = |index: &usize| (self.tried[*index].0.rollouts(), self.tried[*index].0.nearest);
        let mut order: Vec<usize> = (0..self.tried.len()).collect();
        order.sort_by(|a, b| compare(predicted(a), predicted(b)));
        for index in order {
            if self.tried[index].1.is_none() && !self.is_good_enough() {
                self.check(index, config);
            }
        }
        let rank = |(candidate, check): &(Candidate, Option<Check>)| {
            (check.as_ref().map_or(f32::INFINITY, |check| check.rollouts(candidate)), candidate.nearest)
        };
        let best = self.tried.iter().min_by(|a, b| compare(rank(a), rank(b)));
        // There is at least the candidate without subgoals.
        let (best, check) = best.expect("a candidate");
        let least_reached = check.as_ref().map_or(0.0, |check| check.least_reached(best));
        let (candidates, actions) = (self.tried.len(), self.actions);
        ChosenSubgoals { subgoals: best.subgoals().to_vec(), least_reached, candidates, actions }
    }
}

/// The order of candidates: by the rollouts that they need, then by their distance to the goal.
fn compare(a: (f32, f32), b: (f32, f32)) -> Ordering {
    a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TruePhysics;
    use mge_dynamics::DynamicsError;
    use mge_task::load;

    fn choose(task: &Task, count: usize, config: &GuidanceConfig) -> ChosenSubgoals {
        choose_subgoals(task, &TruePhysics, count, config, 0, &Stop::default(), |_| ()).unwrap()
    }

    #[test]
    fn the_chosen_subgoals_make_a_rarely_reached_goal_more_reachable() {
        let config = GuidanceConfig { most_model_rollouts: 5000, ..Default::default() };
        let task = load("task6").unwrap();
        let without = choose(&task, 0, &config);
        let choice = choose(&task, 2, &config);
        assert!(choice.least_reached > without.least_reached, "{choice:?} {without:?}");
        assert!(choice.candidates > 1 && !choice.subgoals.is_empty());
        assert!((1..=MAX_ACTIONS + config.horizon).contains(&choice.actions), "{choice:?}");
        assert_eq!(choose(&task, 0, &config), without, "the same seed, the same choice");
    }

    #[test]
    fn if_guided_play_needs_no_subgoals_the_search_ends_at_once() {
        let mut task = load("task1").unwrap();
        task.goal.radius = 12.0;
        let choice = choose(&task, 2, &GuidanceConfig::default());
        assert_eq!((choice.subgoals.len(), choice.candidates), (0, 1));
        assert!(choice.least_reached > 0.0);
    }

    #[test]
    fn a_goal_far_away_is_found_by_longer_rollouts() {
        let task = load("task1").unwrap();
        let config = GuidanceConfig { horizon: 2, longest_horizon: 2, most_model_rollouts: 1200, ..Default::default() };
        let brief = GuidanceConfig { horizon: 2, ..config.clone() };
        let stop = Stop::default();
        let prediction = Prediction { model: &TruePhysics, config: &brief, seed: 0, stop: &stop };
        assert!(Search::new(prediction, &task, 0, &mut |_| ()).unwrap().is_hopeless());
        assert!(choose(&task, 0, &config).least_reached > 0.0);
    }

    #[test]
    fn if_no_subgoals_are_wanted_only_play_without_them_is_tried() {
        let choice = choose(&load("task6").unwrap(), 0, &GuidanceConfig::default());
        assert_eq!((choice.subgoals.len(), choice.candidates), (0, 1));
    }

    #[test]
    fn the_choice_can_be_stopped() {
        let stop = Stop::default();
        stop.request();
        let task = load("task1").unwrap();
        let choice = choose_subgoals(&task, &TruePhysics, 2, &GuidanceConfig::default(), 0, &stop, |_| ());
        assert!(matches!(choice, Err(DynamicsError::Stopped(_))));
    }
}
