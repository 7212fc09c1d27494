//! Audit of the tasks: random play must hardly ever solve a task, and play guided by the true
//! physics must solve it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::StudyError;
use super::hits::{ActorNoise, Guided, HitCounts, Uniform, count_hits};
use mge_agent::DdpgConfig;
use mge_guidance::{self as guidance, GuidanceConfig, InterruptibleModel, TruePhysics};
use mge_task::Task;
use mge_trainer::batch::{self, Batch, BatchProgress, Job};

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
const EXPLORATIONS: [&str; 3] = ["uniform", "actor + OU", "guided by true physics"];

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
) -> Result<Vec<AuditRow>, StudyError> {
    let jobs: Vec<_> = tasks.iter().flat_map(|task| (0..seeds).map(move |seed| job(task, episodes, seed))).collect();
    let played = batch::all(batch.run(&jobs, on_progress)?)?;
    let rows = tasks.iter().enumerate().flat_map(|(number, task)| {
        let of_task = &played[number * seeds as usize..(number + 1) * seeds as usize];
        EXPLORATIONS.into_iter().enumerate().map(move |(way, exploration)| AuditRow {
            task: task.name.clone(),
            exploration: exploration.to_owned(),
            hits: of_task.iter().map(|seed| seed[way].clone()).collect(),
        })
    });
    Ok(rows.collect())
}

/// The job that plays one seed of one task with all kinds of exploration.
fn job(task: &Arc<Task>, episodes: u32, seed: u64) -> Job<'_, [HitCounts; EXPLORATIONS.len()], StudyError> {
    let name = format!("{}, seed {seed}", task.name);
    Job::new(name.clone(), EXPLORATIONS.len() as u64 * u64::from(episodes), move |handle| {
        handle.report(name.clone());
        let stop = handle.stop();
        let uniform = count_hits(task, &mut Uniform, episodes, seed, stop)?;
        handle.set_done(u64::from(episodes));
        let mut actor = ActorNoise::untrained(task, &DdpgConfig::default(), seed)?;
        let actor = count_hits(task, &mut actor, episodes, seed, stop)?;
        handle.set_done(2 * u64::from(episodes));
        let model = InterruptibleModel::new(&TruePhysics, stop);
        let prior = guidance::build(task, &model, &GuidanceConfig::default(), seed, |_| ())?;
        let guided = count_hits(task, &mut Guided(&prior), episodes, seed, stop)?;
        Ok(Some([uniform, actor, guided]))
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
