//! Plays episodes with a policy that does not learn.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;

use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_env::{Action, Environment};
use mge_task::Task;

/// Plays episodes, with the actions that `act` chooses, until `keep_going`, called after each of them, returns false.
///
/// # Errors
/// When `stop` is requested first.
pub fn play(
    task: &Arc<Task>,
    mut act: impl FnMut(&Environment, &mut ChaCha8Rng) -> Action,
    seed: u64,
    stop: &Stop,
    mut keep_going: impl FnMut(&Environment) -> bool,
) -> Result<(), Stopped> {
    let mut rng = Stream::Episode.of(seed);
    let mut env = Environment::new(task.clone());
    loop {
        env.reset(&mut rng);
        loop {
            stop.check()?;
            let action = act(&env, &mut rng);
            if env.step_without_observation(action).map_or(true, |step| step.end.is_some()) {
                break;
            }
        }
        if !keep_going(&env) {
            return Ok(());
        }
    }
}
