//! Curves of success against actions, and the area under them.

use std::collections::HashMap;

use super::row::TrainedRun;

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
    let area: f64 = points.windows(2).map(|pair| (pair[1][0] - pair[0][0]) * (pair[0][1] + pair[1][1]) / 2.0).sum();
    // The sum of nothing is -0.
    area / end + 0.0
}

/// Gives every run the area under its curve of success against charged actions, with an equal budget for all runs on a
/// task: as many as the shortest curve of a whole training has, or else the longest curve. The first of each pair says
/// whether the run is a whole training. Others keep their last success: those that ended at a success rate, and those of
/// methods that do not learn, of which a few episodes are enough.
pub(super) fn score_equal_budgets(runs: &mut [(bool, &mut TrainedRun)]) {
    let end = |run: &TrainedRun| run.charged.last().map_or(0.0, |[actions, _]| *actions);
    let mut budgets: HashMap<String, (bool, f64)> = HashMap::new();
    for (is_whole, run) in runs.iter() {
        let (known, budget) = budgets.entry(run.row.task.clone()).or_default();
        *budget = match (*known, is_whole) {
            (true, true) => budget.min(end(run)),
            (false, true) => end(run),
            (true, false) => *budget,
            (false, false) => budget.max(end(run)),
        };
        *known |= is_whole;
    }
    for (_, run) in runs {
        let budget = budgets.get(&run.row.task).map(|(_, budget)| *budget);
        let budget = budget.filter(|budget| *budget > 0.0 && !run.charged.is_empty());
        run.row.charged_area = budget.map(|budget| mean_height(&run.charged, budget));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LearningRow;

    #[test]
    fn the_area_counts_what_is_charged_and_the_budget_is_that_of_the_shortest_training() {
        let run = |task: &str, charged: &[[f64; 2]]| TrainedRun {
            row: LearningRow { task: task.to_owned(), ..LearningRow::default() },
            training: Vec::new(),
            greedy: Vec::new(),
            actions: Vec::new(),
            charged: charged.to_vec(),
        };
        let mut runs = [
            (true, run("task1", &[[0.0, 0.0], [100.0, 1.0], [200.0, 1.0]])),
            (true, run("task1", &[[100.0, 0.0], [200.0, 1.0], [1000.0, 1.0]])),
            (false, run("task1", &[[20.0, 0.5], [50.0, 0.5]])),
            (false, run("task2", &[[20.0, 0.5], [50.0, 0.5]])),
            (true, run("task3", &[])),
        ];
        score_equal_budgets(&mut runs.iter_mut().map(|(is_whole, run)| (*is_whole, run)).collect::<Vec<_>>());
        let areas: Vec<Option<f64>> = runs.iter().map(|(_, run)| run.row.charged_area).collect();
        assert_eq!(areas, [Some(0.75), Some(0.25), Some(0.45), Some(0.3), None]);
    }
}
