//! A candidate: subgoals, and how well guided play is predicted to do with them.

use std::sync::Arc;

use rand::Rng;

use crate::build::Prediction;
use crate::prior::StagePrior;
use mge_base::streams::Stream;
use mge_dynamics::{Result, Rollout};
use mge_env::{Action, Environment, Snapshot};
use mge_physics::BallState;
use mge_task::{Region, Task};

/// Guided rollouts in the model that evaluate a stage.
const ROLLOUTS: usize = 100;
/// Share of the rollouts reaching a subgoal above which a larger share does not make it more promising.
const SUFFICIENT_REACHED_SHARE: f32 = 0.1;

/// Subgoals, and how well guided play is predicted to do with them.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    /// The task with these subgoals.
    pub task: Arc<Task>,
    /// The clusters of each subgoal, and last of the goal.
    pub stages: Vec<StagePrior>,
    /// For each stage, the share of the guided rollouts from the previous one that reached it.
    pub reached: Vec<f32>,
    /// Least distance to the goal, normalised: the mean over the nearest tenth of the rollouts towards it.
    pub nearest: f32,
    /// The states in which the last subgoal was reached.
    arrivals: Vec<Arrival>,
}

/// A predicted state in which a stage begins, whatever the task's subgoals are.
#[derive(Debug, Clone)]
struct Arrival {
    actions: u32,
    placed: Vec<Action>,
    ball: BallState,
}

impl Arrival {
    fn of(state: &Snapshot) -> Self {
        Self { actions: state.actions, placed: state.placed.to_vec(), ball: state.ball() }
    }

    /// The state at the end of a rollout from this one.
    fn after(&self, rollout: &Rollout) -> Option<Self> {
        let placed = rollout.actions.iter().filter(|action| action.placed).map(|action| action.action);
        Some(Self {
            actions: self.actions + rollout.actions.len() as u32,
            placed: self.placed.iter().copied().chain(placed).collect(),
            ball: *rollout.balls.last()?,
        })
    }
}

/// The prediction of one stage.
struct Predicted {
    prior: StagePrior,
    /// Guided rollouts, and the indices of the states from which they start.
    rollouts: Vec<Rollout>,
    from: Vec<usize>,
}

impl Predicted {
    fn share(&self) -> f32 {
        let hits = self.rollouts.iter().filter(|rollout| rollout.hit).count();
        hits as f32 / self.rollouts.len().max(1) as f32
    }
}

impl Prediction<'_> {
    /// The candidate without subgoals.
    pub(super) fn root(&self, task: &Task) -> Result<Candidate> {
        let task = Arc::new(task.clone().with_subgoals(Vec::new()));
        let start = Arrival::of(Environment::new(task.clone()).snapshot());
        self.towards_goal(Candidate {
            task,
            stages: Vec::new(),
            reached: Vec::new(),
            nearest: f32::INFINITY,
            arrivals: vec![start],
        })
    }

    /// The candidate with one more subgoal.
    pub(super) fn successor(&self, parent: &Candidate, region: Region) -> Result<Candidate> {
        let subgoals = [parent.subgoals(), &[region]].concat();
        let stage = parent.subgoals().len();
        let task = Arc::new(Task { subgoals, ..Task::clone(&parent.task) });
        let stages = parent.stages[..stage].to_vec();
        let next = Candidate { task, stages, reached: parent.reached[..stage].to_vec(), ..parent.clone() };
        let predicted = self.stage(&next, stage)?;
        let hits = predicted.rollouts.iter().zip(&predicted.from).filter(|(rollout, _)| rollout.hit);
        let arrivals = hits.filter_map(|(rollout, &from)| parent.arrivals[from].after(rollout));
        let arrivals = arrivals.filter(|arrival| arrival.actions < next.task.rules.max_actions).collect();
        self.towards_goal(Candidate { arrivals, ..next }.with(predicted))
    }

    /// The candidate with the prediction of its last stage.
    fn towards_goal(&self, candidate: Candidate) -> Result<Candidate> {
        let predicted = self.stage(&candidate, candidate.subgoals().len())?;
        let goal = candidate.task.goal.position;
        let distance = |[x, y]: &[f32; 2]| (x - goal[0]).hypot(y - goal[1]);
        let least = |rollout: &Rollout| rollout.path.iter().map(distance).fold(f32::INFINITY, f32::min);
        let mut distances: Vec<f32> = predicted.rollouts.iter().map(least).collect();
        distances.sort_by(f32::total_cmp);
        distances.truncate(distances.len().div_ceil(10));
        let nearest = match distances.len() {
            0 => f32::INFINITY,
            count => distances.iter().sum::<f32>() / count as f32,
        };
        Ok(Candidate { nearest, ..candidate.with(predicted) })
    }

    /// Clusters for a stage, and guided rollouts towards it; none if nothing arrives where it begins.
    fn stage(&self, candidate: &Candidate, stage: usize) -> Result<Predicted> {
        let starts = candidate.starts(stage);
        if starts.is_empty() {
            return Ok(Predicted { prior: StagePrior::default(), rollouts: Vec::new(), from: Vec::new() });
        }
        let mut rng = Stream::PriorStage(stage).of(self.seed);
        let prior = self.imagine(&candidate.task, &starts, &mut rng)?;
        let horizon = prior.longer_horizon.unwrap_or(self.config.horizon);
        let from: Vec<usize> = (0..ROLLOUTS).map(|_| rng.gen_range(0..starts.len())).collect();
        let sequences: Vec<Vec<Action>> =
            from.iter().map(|_| (0..horizon).map(|_| prior.sample(&mut rng)).collect()).collect();
        let states: Vec<&Snapshot> = from.iter().map(|&index| &starts[index]).collect();
        Ok(Predicted { rollouts: self.model.rollouts(&states, &sequences, self.stop)?, prior, from })
    }
}

impl Candidate {
    pub fn subgoals(&self) -> &[Region] {
        &self.task.subgoals
    }

    /// The states from which the rollouts towards the goal start.
    pub fn goal_starts(&self) -> Vec<Snapshot> {
        self.starts(self.subgoals().len())
    }

    fn starts(&self, stage: usize) -> Vec<Snapshot> {
        let state = |arrival: &Arrival| {
            let Arrival { actions, placed, ball } = arrival;
            Snapshot::predicted(self.task.clone(), *actions, placed, stage, *ball)
        };
        self.arrivals.iter().map(state).collect()
    }

    fn with(mut self, predicted: Predicted) -> Self {
        self.reached.push(predicted.share());
        self.stages.push(predicted.prior);
        self
    }

    /// Predicted number of rollouts until every stage is reached once, one after the other; infinite if a stage is
    /// never reached.
    pub fn rollouts(&self) -> f32 {
        rollouts(&self.reached)
    }

    /// How promising it is to add a subgoal: greater if the present ones are reached often enough and play comes
    /// near the goal.
    pub fn promise(&self) -> f32 {
        least(&self.reached[..self.subgoals().len()]).min(SUFFICIENT_REACHED_SHARE) / SUFFICIENT_REACHED_SHARE
            - self.nearest
    }
}

/// Expected number of rollouts until every stage is reached once, from the share that reaches each.
pub(super) fn rollouts(shares: &[f32]) -> f32 {
    shares.iter().map(|share| share.recip()).sum()
}

/// The smallest of some shares; 1 if there are none.
pub(super) fn least(shares: &[f32]) -> f32 {
    shares.iter().copied().fold(1.0, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GuidanceConfig, TruePhysics};
    use mge_base::stop::Stop;

    #[test]
    fn a_subgoal_that_is_reached_on_the_way_makes_a_candidate_promising() {
        let (config, stop) = (GuidanceConfig::default(), Stop::default());
        let prediction = Prediction { model: &TruePhysics, config: &config, seed: 0, stop: &stop };
        let task = mge_task::load("task6").unwrap();
        let root = prediction.root(&task).unwrap();
        assert_eq!((root.stages.len(), root.goal_starts().len()), (1, 1));
        let next = prediction.successor(&root, task.subgoals[0]).unwrap();
        assert_eq!((next.subgoals(), next.stages.len(), next.reached.len()), (&task.subgoals[..1], 2, 2));
        let starts = next.goal_starts();
        assert!(!starts.is_empty() && starts.iter().all(|state| state.stage() == 1 && state.actions > 0));
        let unreachable = Region { position: [0.89, 0.89], radius: 0.5 };
        let lost = prediction.successor(&root, unreachable).unwrap();
        assert!(lost.goal_starts().is_empty() && lost.rollouts().is_infinite());
        assert!(lost.promise() < next.promise());
    }

    #[test]
    fn fewer_rollouts_are_expected_if_every_stage_is_reached_more_often() {
        assert_eq!((rollouts(&[0.5, 0.25]), least(&[0.5, 0.25])), (6.0, 0.25));
        assert!(rollouts(&[0.5, 0.25]) < rollouts(&[0.16]) && rollouts(&[0.17]) < rollouts(&[0.5, 0.25]));
        assert!(rollouts(&[0.5, 0.0]).is_infinite());
    }
}
