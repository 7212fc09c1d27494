//! Curves of success against actions, and the area under them.

use std::collections::HashMap;

use super::row::TrainedRun;
use mge_trainer::Method;

/// The value of a curve at `x`, interpolated linearly; 0 before the first point, constant after the last.
pub(super) fn height(curve: &[[f64; 2]], x: f64) -> f64 {
    let after = curve.partition_point(|point| point[0] <= x);
    match (after.checked_sub(1).map(|before| curve[before]), curve.get(after)) {
        (None, _) => 0.0,
        (Some([_, y]), None) => y,
        (Some([x0, y0]), Some([x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
    }
}

/// The mean height of a curve up to `end`.
fn mean_height(curve: &[[f64; 2]], end: f64) -> f64 {
    let inner = curve.iter().copied().filter(|point| point[0] < end);
    let points: Vec<[f64; 2]> = inner.chain([[end, height(curve, end)]]).collect();
    points.windows(2).map(|pair| (pair[1][0] - pair[0][0]) * (pair[0][1] + pair[1][1]) / 2.0).sum::<f64>() / end
}

/// Gives every run the area under its curve of success against charged actions, with an equal budget for all runs on a
/// task: as many as the shortest curve of a method that learns has. Other methods do not change, so that a few episodes
/// of them are enough.
pub(super) fn score_equal_budgets(runs: &mut [&mut TrainedRun]) {
    let end = |run: &TrainedRun| run.charged.last().map(|[actions, _]| *actions);
    let learns = |run: &TrainedRun| Method::ALL.iter().any(|method| method.name() == run.row.method && method.learns());
    let mut budgets: HashMap<(String, bool), f64> = HashMap::new();
    for run in runs.iter() {
        if let Some(end) = end(run) {
            let budget = budgets.entry((run.row.task.clone(), learns(run))).or_insert(end);
            *budget = budget.min(end);
        }
    }
    for run in runs {
        let of = |learns| budgets.get(&(run.row.task.clone(), learns));
        let budget = of(true).or(of(false)).filter(|budget| **budget > 0.0 && !run.charged.is_empty());
        run.row.charged_area = budget.map(|budget| mean_height(&run.charged, *budget));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LearningRow;

    #[test]
    fn the_area_counts_what_is_charged_and_the_budget_is_that_of_the_shortest_training() {
        let run = |task: &str, method: &str, charged: &[[f64; 2]]| TrainedRun {
            row: LearningRow { task: task.to_owned(), method: method.to_owned(), ..LearningRow::default() },
            training: Vec::new(),
            greedy: Vec::new(),
            actions: Vec::new(),
            charged: charged.to_vec(),
        };
        let mut runs = [
            run("task1", "ddpg", &[[0.0, 0.0], [100.0, 1.0], [200.0, 1.0]]),
            run("task1", "ddpg-mge", &[[100.0, 0.0], [200.0, 1.0], [1000.0, 1.0]]),
            run("task1", "planning", &[[20.0, 0.5], [50.0, 0.5]]),
            run("task2", "planning", &[[20.0, 0.5], [50.0, 0.5]]),
            run("task2", "ddpg", &[]),
        ];
        score_equal_budgets(&mut runs.iter_mut().collect::<Vec<_>>());
        let areas: Vec<Option<f64>> = runs.iter().map(|run| run.row.charged_area).collect();
        assert_eq!(areas, [Some(0.75), Some(0.25), Some(0.45), Some(0.3), None]);
    }
}
