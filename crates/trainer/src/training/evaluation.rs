//! Evaluation of the greedy policy.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;

use super::Training;
use crate::error::Result;
use crate::trace::Trace;
use mge_agent::Ddpg;
use mge_base::streams::Stream;
use mge_env::{Action, Environment};
use mge_run::{Event, Source};
use mge_task::Task;

impl Training {
    /// Evaluates the greedy policy over `episodes` episodes without noise, clusters or learning.
    ///
    /// # Errors
    /// When a stop is requested.
    pub fn evaluate(&mut self, episodes: u32) -> Result<Event> {
        let mut rng = self.progress.streams.evaluation.clone();
        let (success, mean_return) = self.greedy(episodes, &mut rng)?;
        self.progress.streams.evaluation = rng;
        Ok(Event::Evaluated { episode: self.progress.episode, episodes: u64::from(episodes), success, mean_return })
    }

    /// The score that decides whether a checkpoint becomes `best`: the mean return of the greedy policy, which was
    /// `mean_return` in the evaluation just made. If episodes differ and these were too few, it is that of enough
    /// episodes instead. These are the same for every checkpoint of the run, so that none is best by luck.
    ///
    /// # Errors
    /// When a stop is requested.
    pub fn score(&self, mean_return: f64) -> Result<f64> {
        let task = self.env.loaded_task();
        let episodes_vary = task.rules.start_noise > 0.0 || !task.shifts.is_empty();
        if !episodes_vary || self.config.evaluation.episodes >= JUDGED {
            return Ok(mean_return);
        }
        Ok(self.greedy(JUDGED, &mut Stream::Judgement.of(self.config.seed))?.1)
    }

    /// Success and mean return of the greedy policy over some episodes.
    fn greedy(&self, episodes: u32, rng: &mut ChaCha8Rng) -> Result<(f64, f64)> {
        let (mut successes, mut total) = (0u32, 0.0f64);
        for _ in 0..episodes {
            self.stop.check()?;
            let trace = greedy_episode(self.env.loaded_task(), &self.learner.ddpg, rng);
            successes += u32::from(trace.reached_goal());
            total += f64::from(trace.total_reward());
        }
        let count = f64::from(episodes.max(1));
        Ok((f64::from(successes) / count, total / count))
    }
}

/// Number of episodes that decide whether a checkpoint becomes `best`, if episodes differ.
const JUDGED: u32 = 20;

/// Plays one episode of the policy without noise; `rng` draws its start.
pub fn greedy_episode(task: &Arc<Task>, ddpg: &Ddpg, rng: &mut ChaCha8Rng) -> Trace {
    let mut env = Environment::new(task.clone());
    let mut observation = env.reset(rng);
    let mut trace = Trace::begin(&env, 0);
    loop {
        if trace.step(&mut env, action_of(&ddpg.act(&observation)), Source::Policy).is_err() {
            return trace;
        }
        observation = env.observation();
    }
}

/// The action that an agent's vector denotes.
pub(super) fn action_of(vector: &[f32]) -> Action {
    [vector[0], vector[1]]
}
