//! Vectorised environments of one task, each with its own random numbers.

use rayon::prelude::*;

use super::action_set::{ActionSet, Choice};
use super::environment::Environment;
use mge_base::stop::Stop;
use mge_base::streams::Stream;
use mge_physics::{ACTION_SET, ToolSplit};

mod player;
mod state;
#[cfg(test)]
mod tests;

use player::Player;
pub use player::{Autoreset, Ended, Info, Outcome};
pub use state::State;

/// Minimum number of environments per thread: a step takes microseconds, about as long as handing over one
/// environment.
const AT_ONCE: usize = 16;
/// Fewer environments than this stay on the caller's thread.
pub const FEW: usize = 4 * AT_ONCE;

/// Why environments cannot be stepped, reset or restored. Nothing has changed in that case.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VectorError {
    /// An environment has no episode, or it is over and is not reset automatically.
    #[error("the episode of environment {index} {problem}: reset that environment before the next step")]
    ResetNeeded {
        /// Which one.
        index: usize,
        /// What is wrong with its episode.
        problem: &'static str,
    },
    /// There is no environment with this index.
    #[error("there is no environment {index}: there are {count}, numbered from 0")]
    NoSuchEnvironment {
        /// The index.
        index: usize,
        /// Number of environments.
        count: usize,
    },
    /// An action is not possible, or a state belongs to another environment.
    #[error("{0}")]
    Refused(String),
}

/// Environments of one task. Results do not depend on the number of threads.
#[derive(Debug, Clone)]
pub struct VectorEnvironment {
    /// What each of them was before its first reset.
    template: Environment,
    autoreset: Autoreset,
    players: Vec<Player>,
    observation_len: usize,
    /// Ends resets and steps early.
    stop: Stop,
}

impl VectorEnvironment {
    /// `count` environments like this one; each needs a reset before its first step.
    pub fn new(template: Environment, count: usize, autoreset: Autoreset) -> Self {
        let (env, rng) = (template.clone(), Stream::Episode.of(0));
        let player = Player { env, rng, begun: false, actions: Vec::new(), outcome: Outcome::default() };
        let (players, observation_len) = (vec![player; count], template.observation_len());
        Self { template, autoreset, players, observation_len, stop: Stop::default() }
    }

    /// What each of them was before its first reset, with its task, its tools and the parts of its observations.
    pub fn template(&self) -> &Environment {
        &self.template
    }

    /// Ends resets and steps early once `stop` is requested. Only some environments have then changed: see
    /// [`forget_episodes`](Self::forget_episodes).
    pub fn stop_on(&mut self, stop: &Stop) {
        self.stop = stop.clone();
    }

    /// Makes a reset of each environment necessary.
    pub fn forget_episodes(&mut self) {
        self.players.iter_mut().for_each(|player| player.begun = false);
    }

    /// Number of environments.
    pub fn count(&self) -> usize {
        self.players.len()
    }

    /// Length of one observation.
    pub fn observation_len(&self) -> usize {
        self.observation_len
    }

    /// Size of an action set, the no-op included; None if agents have the task's own tool.
    pub fn tool_count(&self) -> Option<usize> {
        self.template.split().map(|_| ACTION_SET)
    }

    /// The action sets by environment; empty if agents have the task's own tool.
    pub fn action_sets(&self) -> impl Iterator<Item = &ActionSet> {
        self.players.iter().filter_map(|player| player.env.action_set())
    }

    /// The results of the latest reset or step, by environment.
    pub fn outcomes(&self) -> impl ExactSizeIterator<Item = &Outcome> + Clone {
        self.players.iter().map(|player| &player.outcome)
    }

    /// Starts an episode in each environment selected by `mask` (in all if None), and writes the observations of
    /// those environments. A seed restarts an environment's random numbers: one seed gives the same episodes as `mge
    /// env serve --seed`. Without a seed the environment continues its own.
    ///
    /// `observations` has one row per environment.
    pub fn reset(&mut self, seeds: &[Option<u64>], mask: Option<&[bool]>, observations: &mut [f32]) {
        let rows = observations.chunks_mut(self.observation_len);
        for (index, ((player, seed), row)) in self.players.iter_mut().zip(seeds).zip(rows).enumerate() {
            if self.stop.is_requested() || mask.is_some_and(|mask| !mask[index]) {
                continue;
            }
            if let Some(seed) = seed {
                player.rng = Stream::Episode.of(*seed);
            }
            row.copy_from_slice(&player.reset());
        }
    }

    /// Takes one action in each environment: a position, or a [`Choice`] of a tool and a position. The observations
    /// are written to `observations`, which has one row per environment; the rest is in [`outcomes`](Self::outcomes).
    /// Many environments share the threads of the current rayon pool.
    ///
    /// # Errors
    /// When any environment cannot take its action; then none has taken one.
    pub fn step<A>(&mut self, actions: &[A], observations: &mut [f32]) -> Result<(), VectorError>
    where
        A: Into<Choice> + Copy + Sync,
    {
        self.check(actions)?;
        let Self { autoreset, observation_len, ref mut players, ref stop, .. } = *self;
        let take = |((player, row), action): ((&mut Player, &mut [f32]), &A)| {
            if !stop.is_requested() {
                player.step((*action).into(), autoreset, row);
            }
        };
        if players.len() < FEW {
            players.iter_mut().zip(observations.chunks_mut(observation_len)).zip(actions).for_each(take);
        } else {
            let rows = observations.par_chunks_mut(observation_len);
            players.par_iter_mut().zip(rows).zip(actions).with_min_len(AT_ONCE).for_each(take);
        }
        Ok(())
    }

    fn check<A: Into<Choice> + Copy>(&self, actions: &[A]) -> Result<(), VectorError> {
        for (index, (player, action)) in self.players.iter().zip(actions).enumerate() {
            let Choice { tool, place: action } = (*action).into();
            if !player.begun {
                return Err(VectorError::ResetNeeded { index, problem: "has not begun" });
            }
            if self.autoreset == Autoreset::Disabled && player.is_over() {
                return Err(VectorError::ResetNeeded { index, problem: "is over" });
            }
            let count = player.env.action_set().map_or(1, ActionSet::len);
            let refused = |problem| Err(VectorError::Refused(format!("the action of environment {index} {problem}")));
            if !action.iter().all(|value| value.is_finite()) {
                return refused(format!("is {action:?}: actions are finite numbers, and are clipped to [-1, 1]"));
            }
            if tool >= count {
                return refused(format!("asks for tool {tool}, but its {count} tools are numbered from 0"));
            }
        }
        Ok(())
    }

    /// The state of an environment.
    ///
    /// # Errors
    /// When there is no such environment.
    pub fn state(&self, index: usize) -> Result<State, VectorError> {
        let missing = VectorError::NoSuchEnvironment { index, count: self.players.len() };
        self.players.get(index).cloned().map(State).ok_or(missing)
    }

    /// Restores a state, possibly that of another environment, and writes the observation.
    ///
    /// # Errors
    /// When there is no such environment, or the state belongs to another task or to other tools.
    pub fn restore(&mut self, index: usize, state: &State, observation: &mut [f32]) -> Result<(), VectorError> {
        let [found, wanted] = [&state.0.env, &self.template];
        if found.loaded_task() != wanted.loaded_task() || found.split() != wanted.split() {
            let name = |env: &Environment| {
                format!("`{}` with {} tools", env.loaded_task().name, env.split().map_or("its own", ToolSplit::name))
            };
            let [found, wanted] = [found, wanted].map(name);
            return Err(VectorError::Refused(format!(
                "the state is of task {found}, but the environment plays {wanted}"
            )));
        }
        let count = self.players.len();
        let player = self.players.get_mut(index).ok_or(VectorError::NoSuchEnvironment { index, count })?;
        let mut restored = state.0.clone();
        restored.outcome = Outcome { info: restored.info(None), ..Outcome::default() };
        *player = restored;
        observation.copy_from_slice(&player.env.observation());
        Ok(())
    }

    /// The environment with this index.
    pub fn environment(&self, index: usize) -> Option<&Environment> {
        self.players.get(index).map(|player| &player.env)
    }
}
