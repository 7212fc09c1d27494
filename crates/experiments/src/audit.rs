//! Audit of the tasks: random play must hardly ever solve a task, and play guided by the true
//! physics must solve it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{ExperimentError, all_finished};
use crate::hits::{HitCounts, Policy};
use crate::sweep::HitJob;
use mge_task::Task;
use mge_trainer::PriorSource;
use mge_trainer::batch::{Batch, BatchProgress, Job};

/// One kind of exploration of one task.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AuditRow {
    /// Name of the task.
    pub task: String,
    /// `uniform`, `actor + OU` or `guided by true physics`.
    pub exploration: String,
    /// Hit counts, one entry per seed.
    pub hits: Vec<HitCounts>,
}

/// The kinds of exploration, in the order of the rows.
const EXPLORATIONS: [(Policy, &str); 3] =
    [(Policy::Uniform, "uniform"), (Policy::Random, "actor + OU"), (Policy::Guided, "guided by true physics")];

/// Plays each task with every kind of exploration and seed; returns one row per task and kind. Guided play
/// builds new clusters for every seed.
///
/// # Errors
/// When an agent or clusters cannot be built, or the batch cannot be run or is interrupted.
pub fn audit(
    tasks: &[Arc<Task>],
    episodes: u32,
    seeds: u64,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Vec<AuditRow>, ExperimentError> {
    let (mut rows, mut jobs) = (Vec::new(), Vec::new());
    for task in tasks {
        for (policy, exploration) in EXPLORATIONS {
            rows.push(AuditRow { task: task.name.clone(), exploration: exploration.to_owned(), hits: Vec::new() });
            let (task, prior) = (task.clone(), PriorSource::TruePhysics);
            let count = HitJob { task, policy, prior, build: 0, episodes, seed: 0 };
            jobs.extend((0..seeds).map(|seed| job(HitJob { build: seed, seed, ..count.clone() })));
        }
    }
    let mut played = all_finished(batch.run(&jobs, on_progress)?)?.into_iter();
    rows.iter_mut().for_each(|row| row.hits.extend(played.by_ref().take(seeds as usize)));
    Ok(rows)
}

fn job<'a>(count: HitJob) -> Job<'a, HitCounts, ExperimentError> {
    let name = format!("{}, {}, seed {}", count.task.name, count.policy, count.seed);
    Job::new(name.clone(), count.episodes.into(), move |handle| {
        handle.report(name.clone());
        count.count(handle.stop()).map(Some)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_base::stop::Stop;
    use mge_task as task;

    #[test]
    fn random_play_hardly_solves_the_tasks_and_truly_guided_play_does() {
        let tasks: Vec<Arc<Task>> = task::shipped().into_iter().map(Arc::new).collect();
        let interrupt = Stop::default();
        let rows = audit(&tasks, 200, 1, &Batch { threads: 2, interrupt: &interrupt }, &mut |_| {}).unwrap();
        assert_eq!(rows.len(), EXPLORATIONS.len() * tasks.len());
        for rows in rows.chunks(EXPLORATIONS.len()) {
            let [uniform, actor, guided] = [0, 1, 2].map(|way: usize| rows[way].hits[0].goal);
            let findable = ["task1", "task3"].contains(&rows[0].task.as_str());
            let most = if findable { 8 } else { 1 };
            assert!(uniform <= most && actor <= most, "{}: {uniform} and {actor}", rows[0].task);
            assert!(guided >= 10, "{}: {guided}", rows[0].task);
        }
    }
}
