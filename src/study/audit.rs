//! What a task asks of exploration: random play must hardly solve it, play guided by
//! the true physics must.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::hits::{ActorNoise, Guided, Hits, Uniform, count_hits};
use crate::agent::DdpgConfig;
use crate::guidance::{self, GuidanceConfig, TruePhysics};
use crate::task::Task;
use crate::validation::ValidationError;

/// One way of exploring one task.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AuditRow {
    /// Name of the task.
    pub task: String,
    /// `uniform`, `actor + OU` or `guided by true physics`.
    pub exploration: String,
    /// Hits, one entry a seed.
    pub hits: Vec<Hits>,
}

/// Plays a task in three ways with several seeds each. Guided play gets clusters of its
/// own for every seed.
///
/// # Errors
/// When the default learner is misconfigured.
pub fn audit(task: &Arc<Task>, episodes: u32, seeds: u64) -> Result<Vec<AuditRow>, ValidationError> {
    let played: Vec<[Hits; 3]> = (0..seeds)
        .into_par_iter()
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut actor = ActorNoise::untrained(task, &DdpgConfig::default(), &mut rng)?;
            let prior = guidance::build(task, &TruePhysics, "true physics", &GuidanceConfig::default(), seed, |_| true);
            let guided = prior.map(|prior| count_hits(task, &mut Guided(&prior), episodes, seed));
            Ok([
                count_hits(task, &mut Uniform, episodes, seed),
                count_hits(task, &mut actor, episodes, seed),
                // The build was never asked to stop.
                guided.unwrap_or(Hits { episodes: 0, goal: 0, subgoals: Vec::new() }),
            ])
        })
        .collect::<Result<_, ValidationError>>()?;
    let ways = ["uniform", "actor + OU", "guided by true physics"];
    Ok(ways
        .into_iter()
        .enumerate()
        .map(|(way, exploration)| AuditRow {
            task: task.name.clone(),
            exploration: exploration.to_owned(),
            hits: played.iter().map(|seed| seed[way].clone()).collect(),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task;

    #[test]
    fn random_play_hardly_solves_the_tasks_and_truly_guided_play_does() {
        for task in task::shipped() {
            let rows = audit(&Arc::new(task), 200, 1).unwrap();
            let [uniform, actor, guided] = [0, 1, 2].map(|way: usize| rows[way].hits[0].goal);
            let findable = ["task1", "task3"].contains(&rows[0].task.as_str());
            let most = if findable { 8 } else { 1 };
            assert!(uniform <= most && actor <= most, "{}: {uniform} and {actor}", rows[0].task);
            assert!(guided >= 10, "{}: {guided}", rows[0].task);
        }
    }
}
