//! Evaluation of the greedy policy.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;

use super::{Training, TrainingError};
use crate::agent::Ddpg;
use crate::physics::ToolSplit;
use crate::run::{Event, Source};
use crate::task::Task;
use crate::trainer::parts::Observation;
use crate::trainer::tools::{choice, environment, observed};
use crate::trainer::trace::Trace;

impl Training {
    /// Evaluates the greedy policy over `episodes` episodes without noise, clusters or learning, with several tasks on
    /// those whose turn it is.
    ///
    /// # Errors
    /// When a stop is requested.
    pub fn evaluate(&mut self, episodes: u32) -> Result<Event, TrainingError> {
        let tools = self.config.evaluation.tools.or(self.config.tools);
        let (mut successes, mut total) = (0u32, 0.0f64);
        for number in 0..episodes {
            self.stop.check()?;
            let task = self.evaluated_task(number).clone();
            let rng = &mut self.progress.streams.evaluation;
            let trace = greedy_episode(&task, self.config.observation, tools, self.learner.ddpg(), rng);
            successes += u32::from(trace.reached_goal());
            total += f64::from(trace.total_reward());
        }
        let count = f64::from(episodes.max(1));
        Ok(Event::Evaluated {
            episode: self.progress.episode,
            episodes: u64::from(episodes),
            success: f64::from(successes) / count,
            mean_return: total / count,
        })
    }
}

/// Plays one episode of the policy without noise; `rng` draws its start. An agent that chooses among tools gets an
/// action set of `tools`; others use the task's own tool.
pub fn greedy_episode(
    task: &Arc<Task>,
    observation: Observation,
    tools: Option<ToolSplit>,
    ddpg: &Ddpg,
    rng: &mut ChaCha8Rng,
) -> Trace {
    let tools = tools.filter(|_| ddpg.options().is_some());
    let mut env = environment(task.clone(), observation, tools);
    env.reset(rng);
    let mut trace = Trace::begin(&env, 0);
    loop {
        let action = ddpg.act(&observed(&env));
        let choice = choice(ddpg, &env, &action);
        if trace.step(&mut env, choice, Source::Policy).is_err() {
            return trace;
        }
    }
}
