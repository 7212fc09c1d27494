//! Evaluation of the greedy policy.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;

use super::{Training, TrainingError};
use crate::parts::Observation;
use crate::tools::{choice, environment, observed};
use crate::trace::Trace;
use mge_agent::Ddpg;
use mge_base::streams::Stream;
use mge_physics::ToolSplit;
use mge_run::{Event, Source};
use mge_task::Task;

impl Training {
    /// Evaluates the greedy policy over `episodes` episodes without noise, clusters or learning, with several tasks on
    /// those whose turn it is.
    ///
    /// # Errors
    /// When a stop is requested.
    pub fn evaluate(&mut self, episodes: u32) -> Result<Event, TrainingError> {
        let mut rng = self.progress.streams.evaluation.clone();
        let (success, mean_return) = self.greedy(episodes, &mut rng, |number| self.evaluated_task(number))?;
        self.progress.streams.evaluation = rng;
        Ok(Event::Evaluated { episode: self.progress.episode, episodes: u64::from(episodes), success, mean_return })
    }

    /// The score that decides whether a checkpoint becomes `best`: the mean return of the greedy policy, which was
    /// `mean_return` in the evaluation just made. If episodes differ and these were too few, it is that of enough
    /// episodes instead. These are the same for every checkpoint of the run, so that none is best by luck.
    ///
    /// # Errors
    /// When a stop is requested.
    pub fn score(&self, mean_return: f64) -> Result<f64, TrainingError> {
        let varies = |task: &Arc<Task>| task.rules.start_noise > 0.0 || !task.shifts.is_empty();
        let count = self.task_count();
        let episodes_vary = count > 1
            || self.config.tools.is_some()
            || self.config.evaluation.tools.is_some()
            || varies(self.env.loaded_task());
        if !episodes_vary || (count == 1 && self.config.evaluation.episodes >= JUDGED) {
            return Ok(mean_return);
        }
        let mut rng = Stream::Judgement.of(self.config.seed);
        let task = |number| self.loaded_task((u64::from(number) * count / u64::from(JUDGED)) as usize);
        Ok(self.greedy(JUDGED, &mut rng, task)?.1)
    }

    /// Success and mean return of the greedy policy over some episodes.
    fn greedy<'a>(
        &'a self,
        episodes: u32,
        rng: &mut ChaCha8Rng,
        task: impl Fn(u32) -> &'a Arc<Task>,
    ) -> Result<(f64, f64), TrainingError> {
        let tools = self.config.evaluation.tools.or(self.config.tools);
        let (mut successes, mut total) = (0u32, 0.0f64);
        for number in 0..episodes {
            self.stop.check()?;
            let trace = greedy_episode(task(number), self.config.observation, tools, self.learner.ddpg(), rng);
            successes += u32::from(trace.reached_goal());
            total += f64::from(trace.total_reward());
        }
        let count = f64::from(episodes.max(1));
        Ok((f64::from(successes) / count, total / count))
    }
}

/// Number of episodes that decide whether a checkpoint becomes `best`, if episodes differ.
const JUDGED: u32 = 20;

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
