//! Gymnasium's view of a task: reset, step, snapshot, restore.

use std::sync::Arc;

use rand::Rng;

use super::action::{Action, EpisodeOver, Placement, Step};
use super::episode::Snapshot;
use super::observation::{observation_len, observe};
use crate::physics::{BallState, World};
use crate::task::Task;

/// A task being played.
#[derive(Debug, Clone)]
pub struct Environment {
    task: Arc<Task>,
    shift: [f32; 2],
    now: Snapshot,
}

impl Environment {
    /// The environment of a task, at its start without noise.
    pub fn new(task: Arc<Task>) -> Self {
        Self::shifted(task, [0.0; 2])
    }

    /// The environment of a task at a start that noise has shifted, as
    /// [`Environment::shift`] reported it for an earlier episode.
    pub fn shifted(task: Arc<Task>, shift: [f32; 2]) -> Self {
        let now = Snapshot::new(&task, shift);
        Self { task, shift, now }
    }

    /// How far noise has shifted the start of the present episode, normalised.
    pub fn shift(&self) -> [f32; 2] {
        self.shift
    }

    /// The task being played.
    pub fn task(&self) -> &Arc<Task> {
        &self.task
    }

    /// Starts an episode and returns its first observation.
    pub fn reset(&mut self, rng: &mut impl Rng) -> Vec<f32> {
        let noise = self.task.rules.start_noise;
        self.shift = if noise > 0.0 { [0; 2].map(|_| rng.gen_range(-noise..=noise)) } else { [0.0; 2] };
        self.now = Snapshot::new(&self.task, self.shift);
        self.observation()
    }

    /// Everything that changes during an episode.
    pub fn snapshot(&self) -> &Snapshot {
        &self.now
    }

    /// Goes on from a snapshot of an environment of the same task.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.now.clone_from(snapshot);
    }

    /// The current observation.
    pub fn observation(&self) -> Vec<f32> {
        let stages = self.task.stage_count();
        let mut observation = Vec::with_capacity(observation_len(&self.task));
        observe(self.now.world(), self.task.tools.len(), self.now.stage(), stages, &mut observation);
        observation
    }

    /// Places the tool if it may be placed, then lets the world run for one action
    /// interval.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step(&mut self, action: Action) -> Result<Step, EpisodeOver> {
        self.step_watched(action, |_| {})
    }

    /// Like [`Environment::step`]; `watch` sees the world after every physics step.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step_watched(&mut self, action: Action, mut watch: impl FnMut(&World)) -> Result<Step, EpisodeOver> {
        if self.now.end().is_some() {
            return Err(EpisodeOver);
        }
        let mut step = self.begin_step(action);
        for _ in 0..self.task.rules.steps_per_action {
            self.now.advance(&self.task, &mut step);
            watch(self.now.world());
        }
        self.finish_step(&mut step);
        Ok(step)
    }

    /// An imagined step: places the tool if it may be placed, then puts the ball where a
    /// model predicts it after the action. `hit` says that it reached the next stage on the
    /// way. The rules are those of [`step`](Self::step).
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step_predicted(&mut self, action: Action, ball: BallState, hit: bool) -> Result<Step, EpisodeOver> {
        if self.now.end().is_some() {
            return Err(EpisodeOver);
        }
        let mut step = self.begin_step(action);
        self.now.set_ball(ball);
        if hit {
            self.now.reach_stage(&self.task, &mut step);
        }
        self.finish_step(&mut step);
        Ok(step)
    }

    fn begin_step(&mut self, action: Action) -> Step {
        let placement = self.now.place(&self.task, action);
        let blocked = if placement == Placement::Placed { 0.0 } else { self.task.rules.rewards.blocked };
        Step {
            observation: Vec::new(),
            reward: self.task.rules.rewards.step + blocked,
            terminated: false,
            truncated: false,
            end: None,
            placement,
            subgoals: Vec::new(),
            goal: false,
            touched: Vec::new(),
        }
    }

    fn finish_step(&mut self, step: &mut Step) {
        self.now.finish_action(&self.task, step);
        step.observation = self.observation();
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::env::{EndReason, uniform_action};
    use crate::task;

    #[test]
    fn an_imagined_step_with_the_true_outcome_is_the_step() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        for task in task::shipped() {
            let stages = task.stage_count();
            let mut real = Environment::new(Arc::new(task));
            for _ in 0..300 {
                let mut imagined = real.clone();
                let stage = real.snapshot().stage();
                let action = uniform_action(&mut rng);
                let step = real.step(action).unwrap();
                let hits = step.subgoals.len() + usize::from(step.goal);
                assert!(stage + hits <= stages);
                // A prediction ends at the first stage it reaches.
                if hits <= 1 && step.end != Some(EndReason::Standstill) {
                    let predicted = imagined.step_predicted(action, real.snapshot().ball(), hits == 1).unwrap();
                    assert_eq!(predicted, Step { touched: Vec::new(), ..step.clone() });
                }
                if step.end.is_some() {
                    real.reset(&mut rng);
                }
            }
        }
    }
}
