//! What a run will cost, from what the latest ones have cost.

use std::sync::Arc;

use super::{RunSummary, XAxis};
use mge_trainer::Method;

/// Most runs that count.
const MEASURED: usize = 5;
/// The latest runs among which they are looked for: a folder may hold thousands, and screens ask often.
const RECENT: usize = 500;

/// The latest runs that tell what one of `episodes` costs: those of a method on a task, else on any task, else of the
/// methods that learn as it does, or not. They got at least half as far, because the first episodes, before the networks
/// learn, cost little time.
pub fn comparable<'a>(runs: &'a [Arc<RunSummary>], task: &str, method: Method, episodes: u64) -> Vec<&'a RunSummary> {
    let recent = runs.iter().rev().take(RECENT).map(|run| &**run);
    let kinship = |run: &&RunSummary| match &run.config {
        config if config.method == method && config.task.name == task => 0,
        config if config.method == method => 1,
        config => 2 + u8::from(config.method.learns() != method.learns()),
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

/// The seconds that an episode of the rest of a run will take, as others tell: theirs, times how much slower the run was
/// than they were in its latest quarter (the machine may be busier).
pub(super) fn rest(run: &RunSummary, others: &[&RunSummary]) -> Option<f64> {
    let (done, own) = (run.done, run.curves.pace());
    median(others.iter().filter_map(|other| {
        let [episodes, seconds] = other.curves.between(done, other.curves.last_episode() as u64)?;
        let theirs = other.curves.between(done - done / 4, done).filter(|[_, seconds]| *seconds > 0.0);
        let slower = own.zip(theirs).map_or(1.0, |(own, [episodes, seconds])| episodes / seconds / own);
        Some(slower * seconds / episodes)
    }))
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}
