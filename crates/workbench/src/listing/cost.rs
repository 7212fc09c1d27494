//! What a run will cost, from what the latest ones have cost.

use std::sync::Arc;

use super::{Curves, RunSummary, XAxis};
use mge_run::Metric;
use mge_trainer::Method;

/// Most runs that count.
const MEASURED: usize = 5;
/// The latest runs among which they are looked for: a folder may hold thousands, and screens ask often.
const RECENT: usize = 500;

/// The latest runs that tell what one of `episodes` costs: those of a method on a task, else on any task, else of the
/// methods that learn as it does, or not. They got at least half as far, because the first episodes, before the networks
/// learn, cost little time. Without action clusters there is no model to train.
pub fn comparable<'a>(runs: &'a [Arc<RunSummary>], task: &str, method: Method, episodes: u64) -> Vec<&'a RunSummary> {
    let recent = runs.iter().rev().take(RECENT).map(|run| &**run);
    let kind = |method: Method| [method.learns(), method.has_clusters()];
    let kinship = |run: &&RunSummary| match &run.config {
        config if config.method == method && config.task.name == task => 0,
        config if config.method == method => 1,
        config => 2 + u8::from(kind(config.method) != kind(method)),
    };
    let mut all: Vec<_> = recent.filter(|run| run.done > 0 && 2 * run.done >= episodes && kinship(run) < 3).collect();
    let closest = all.iter().map(kinship).min();
    all.retain(|run| Some(kinship(run)) == closest);
    all.truncate(MEASURED);
    all
}

/// The medians of the charged actions and seconds of an episode of runs; `None` before any of them has been read.
pub fn cost_of_an_episode(runs: &[&RunSummary]) -> Option<[f64; 2]> {
    let of_one = |axis: XAxis| {
        let last = runs.iter().filter_map(|run| Some((*run.curves.positions(axis).last()?, run.curves.last_episode())));
        median(last.map(|(position, episode)| position as f64 / episode as f64))
    };
    Some([of_one(XAxis::Charged)?, of_one(XAxis::Time)? / 1000.0])
}

/// Least seconds in which a run is compared with another one, and those that the other one took.
const LEAST: [f64; 2] = [1.0, 0.1];

/// The seconds that an episode of the rest of a run will take, as others of its method on its task tell: theirs, times how
/// much slower its actions were so far (the machine may be busier). Networks learn from a certain action on, not from a
/// certain episode on. None before that is known.
pub(super) fn rest(run: &RunSummary, others: &[&RunSummary]) -> Option<f64> {
    let actions = run.latest(Metric::EnvironmentSteps)? as u64;
    let took = |curves: &Curves, least: f64| {
        curves.between(XAxis::Actions, 0, actions).map(|[_, seconds]| seconds).filter(|seconds| *seconds >= least)
    };
    let own = took(&run.curves, LEAST[0])?;
    let same = |other: &&&RunSummary| {
        (other.config.method, &other.config.task.name) == (run.config.method, &run.config.task.name)
    };
    median(others.iter().filter(same).filter_map(|other| {
        let [episodes, seconds] =
            other.curves.between(XAxis::Episodes, run.done, other.curves.last_episode() as u64)?;
        Some(own / took(&other.curves, LEAST[1])? * seconds / episodes)
    }))
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::RunState;
    use mge_trainer::RunConfig;

    /// A run whose networks learn from an action on, which takes the time of each from 1 ms to `slow` seconds.
    fn run(method: Method, actions_an_episode: u64, episodes: u64, slow: f32) -> RunSummary {
        let mut curves = Curves::default();
        let mut seconds = 0.0;
        for episode in 1..=episodes {
            let actions = episode * actions_an_episode;
            seconds += actions_an_episode as f32 * if actions > 500 { slow } else { 0.001 };
            curves.push(episode, seconds, Metric::KEPT.map(|_| actions as f32));
        }
        let config = RunConfig::default_for(Arc::new(mge_task::load("task1").unwrap()), method);
        let config = RunConfig { episodes: 1000, ..config };
        let new = RunSummary::new("run".as_ref(), Arc::new(config), RunState::Running);
        RunSummary { done: episodes, curves: Arc::new(curves), ..new }
    }

    #[test]
    fn the_time_left_is_that_of_others_on_a_machine_that_may_be_busier() {
        let known = run(Method::Ddpg, 10, 1000, 0.01);
        let told = |run: &RunSummary| rest(run, &[&known]).map(|seconds| (seconds * 100.0).round() / 100.0);
        // Their networks learn from the 50th episode on, its from the 100th on: that is no difference.
        assert_eq!(told(&run(Method::Ddpg, 5, 200, 0.01)), Some(0.1));
        assert_eq!(told(&run(Method::Ddpg, 5, 200, 0.03)), Some(0.28));
        assert_eq!(told(&run(Method::Ddpg, 5, 80, 0.01)), None, "too short to tell how busy the machine is");
        assert_eq!(told(&run(Method::DdpgUniform, 5, 200, 0.01)), None, "another method learns at another pace");
        let all = [Arc::new(run(Method::DdpgMge, 10, 1000, 1.0)), Arc::new(known)];
        let found =
            |method| comparable(&all, "task1", method, 1000).iter().map(|it| it.config.method).collect::<Vec<_>>();
        assert_eq!(found(Method::DdpgAdaptive), [Method::Ddpg], "without a model, as it is");
    }
}
