//! What a run will cost, from what the latest ones have cost.

use std::sync::Arc;

use super::{RunSummary, XAxis};
use mge_trainer::Method;

/// Most runs that count.
const MEASURED: usize = 5;
/// The latest runs among which they are looked for: a folder may hold thousands, and screens ask often.
const RECENT: usize = 500;

/// The latest runs that tell what one of `episodes` costs, those of a method on a task, or else any: they got at least
/// half as far, because the first episodes, before the networks learn, cost little time.
pub fn comparable<'a>(runs: &'a [Arc<RunSummary>], task: &str, method: Method, episodes: u64) -> Vec<&'a RunSummary> {
    let recent = || runs.iter().rev().take(RECENT).map(|run| &**run);
    let all = || recent().filter(|run| run.done > 0 && 2 * run.done >= episodes);
    let is_own = |run: &&RunSummary| run.config.task.name == task && run.config.method == method;
    let own: Vec<_> = all().filter(is_own).take(MEASURED).collect();
    if own.is_empty() { all().take(MEASURED).collect() } else { own }
}

/// The medians of the charged actions and seconds of an episode of runs; `None` before any of them has been read.
pub fn cost_of_an_episode(runs: &[&RunSummary]) -> Option<[f64; 2]> {
    let median = |axis: XAxis| {
        let cost = |run: &&RunSummary| {
            Some(*run.curves.positions(axis).last()? as f64 / *run.curves.episodes().last()? as f64)
        };
        let mut all: Vec<f64> = runs.iter().filter_map(cost).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    Some([median(XAxis::Charged)?, median(XAxis::Time)? / 1000.0])
}
