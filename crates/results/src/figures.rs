//! Figures from runs: learning curves and scores of methods.

use std::slice;

use rayon::prelude::*;

use super::curve::height;
use super::groups::{AREA, Groups};
use super::row::{CURVE_POINTS, EVALUATIONS, LearningRow, TrainedRun};
use mge_figures::{
    Against, Curve, CurvePanel, LearningCurves, MethodScore, MethodScores, ScorePanel, Statistics, Success,
};
use mge_stats::aggregate::iqm;
use mge_stats::rolling::WINDOW;
use mge_stats::{Bootstrap, Estimate, StatsError, TaskScores};

/// The description of an interval over seeds in captions.
pub const INTERVAL: &str = "95 % bootstrap interval over seeds";

/// The title of the panel of scores over all tasks.
pub(super) const ALL_TASKS: &str = "All tasks";

/// A curve of a run.
type Points = fn(&TrainedRun) -> &[[f64; 2]];

/// Interquartile mean of the rolling success over seeds, of training or, against episodes, of the greedy evaluations, as
/// far as the shortest run of a group; one that its success ended keeps its last value as far as the longest. Against
/// actions, the success of a run is 0 before its first point. The points are those in the `shown` part of the axis, if one
/// is given.
///
/// # Errors
/// When a statistic cannot be computed.
pub fn learning_curves(
    runs: &[TrainedRun],
    bootstrap: &Bootstrap,
    measure: Success,
    against: Against,
    shown: Option<[f64; 2]>,
) -> Result<LearningCurves, StatsError> {
    let (window, points): (_, Points) = match (against, measure) {
        (Against::Episodes, Success::Training) => (WINDOW, |run| &run.training),
        (Against::Episodes, Success::Greedy) => (EVALUATIONS, |run| &run.greedy),
        (Against::Actions, _) => (WINDOW, |run| &run.actions),
        (Against::Charged, _) => (WINDOW, |run| &run.charged),
    };
    let (mut panels, mut seeds) = (Vec::new(), Vec::new());
    let (mut kept, mut cut) = (false, false);
    let groups = Groups::new(runs.iter().map(|run| &run.row));
    for task in &groups.tasks {
        let mut panel = CurvePanel { task: task.clone(), curves: Vec::new() };
        for label in &groups.labels {
            let of_group = || groups.indices(task, label).iter().map(|&index| &runs[index]);
            let curves: Vec<&[[f64; 2]]> = of_group().map(points).collect();
            let end = common_end(curves.iter().zip(of_group()).map(|(curve, run)| (last(curve), run.row.is_solved)));
            let lasts = || curves.iter().map(|curve| last(curve));
            kept |= lasts().any(|last| last < end);
            cut |= against == Against::Episodes && lasts().any(|last| last > end);
            let [from, to] = shown.map_or([0.0, end], |[from, to]| [from.max(0.0), to.min(end)]);
            let mut x: Vec<f64> = match curves.iter().max_by(|a, b| last(a).total_cmp(&last(b))) {
                Some(curve) if against == Against::Episodes => curve.iter().map(|[x, _]| *x).collect(),
                _ => (0..=CURVE_POINTS).map(|n| from + (to - from) * n as f64 / CURVE_POINTS as f64).collect(),
            };
            x.retain(|x| 0.0 < *x && from <= *x && *x <= to);
            if shown.is_some() {
                let (count, every) = (x.len(), x.len().div_ceil(CURVE_POINTS + 1).max(1));
                let mut left = (0..count).rev();
                x.retain(|_| left.next().is_some_and(|left| left.is_multiple_of(every)));
            }
            if !x.is_empty() {
                seeds.push(curves.len());
                panel.curves.push(summary_curve(label, x, &curves, bootstrap)?);
            }
        }
        panels.push(panel);
    }
    let statistics = interquartile_means(interval_over(&seeds, 1), &seeds);
    let remark = if kept { " A run that its success ended keeps its last value." } else { "" }.to_owned()
        + if cut { " A curve ends with its shortest run." } else { "" };
    let window = window.get();
    Ok(LearningCurves { measure, against, window, statistics, panels, remark, ..LearningCurves::default() })
}

/// Where a curve ends; 0 if it has no points.
fn last(curve: &[[f64; 2]]) -> f64 {
    curve.last().map_or(0.0, |[x, _]| *x)
}

/// Where the curve of a group ends, given where that of each run does and whether its success ended it: with the
/// shortest that was not ended so or has no points, or else with the longest.
fn common_end(runs: impl Iterator<Item = (f64, bool)> + Clone) -> f64 {
    let longest = runs.clone().map(|(last, _)| last).fold(0.0, f64::max);
    runs.filter(|(last, is_solved)| !is_solved || *last == 0.0).map(|(last, _)| last).fold(longest, f64::min)
}

/// Area under the curve of every method on every task and, if all methods were trained on
/// several tasks, over these. The reference is the method with that label, or else the usual baseline.
///
/// # Errors
/// When a statistic cannot be computed.
pub fn method_scores(
    rows: &[LearningRow],
    bootstrap: &Bootstrap,
    reference: Option<&str>,
) -> Result<MethodScores, StatsError> {
    let groups = Groups::new(rows);
    let panel = |title: &str, tasks: &[String]| {
        let has_runs = |label: &&String| tasks.iter().all(|task| !groups.indices(task, label).is_empty());
        let score = |label: &String| {
            let scores = groups.scores(tasks, label, AREA)?;
            let runs = if tasks.len() == 1 { scores.all().collect() } else { Vec::new() };
            Ok(MethodScore { label: label.clone(), estimate: bootstrap.stratified(&scores, iqm)?, runs })
        };
        let methods = groups.labels.iter().filter(has_runs).map(score).collect::<Result<_, StatsError>>()?;
        Ok::<_, StatsError>(ScorePanel { task: title.to_owned(), methods })
    };
    let of_task = |task: &String| panel(task, slice::from_ref(task));
    let mut panels: Vec<ScorePanel> = groups.tasks.iter().map(of_task).collect::<Result<_, _>>()?;
    let seeds: Vec<usize> = panels.iter().flat_map(|panel| &panel.methods).map(|method| method.runs.len()).collect();
    let tasks = groups.common_tasks();
    if tasks.len() > 1 {
        panels.push(panel(if tasks.len() == panels.len() { ALL_TASKS } else { "Common tasks" }, &tasks)?);
    }
    Ok(MethodScores {
        measure: format!("area under the curve of the success rate (last {WINDOW} episodes), 0 to 1"),
        statistics: interquartile_means(interval_over(&seeds, panels.len()), &seeds),
        reference: reference.or(groups.baseline()).map(str::to_owned),
        panels,
        legend: groups.legend(),
    })
}

/// What the intervals of this many runs on each of several tasks are over.
fn interval_over(seeds: &[usize], tasks: usize) -> &'static str {
    match (seeds.iter().max(), tasks) {
        (Some(1), 1) => "",
        (Some(1), _) => "95 % bootstrap interval over tasks",
        (_, 1) => INTERVAL,
        _ => "95 % bootstrap interval over seeds, stratified by task",
    }
}

/// The statistics of interquartile means over these numbers of seeds.
fn interquartile_means(interval: &str, seeds: &[usize]) -> Statistics {
    Statistics {
        centre: "Interquartile mean".to_owned(),
        interval: interval.to_owned(),
        seeds: seeds.iter().copied().max().unwrap_or(0),
        fewest_seeds: seeds.iter().copied().min(),
    }
}

/// The interquartile mean over the seeds, with its interval, at each of these places.
fn summary_curve(label: &str, x: Vec<f64>, seeds: &[&[[f64; 2]]], bootstrap: &Bootstrap) -> Result<Curve, StatsError> {
    let estimate = |x: &f64| {
        let values: Vec<f64> = seeds.iter().map(|seed| height(seed, *x)).collect();
        bootstrap.stratified(&TaskScores::of_one_task(&values)?, iqm)
    };
    let estimates: Vec<Estimate> = x.par_iter().map(estimate).collect::<Result<_, _>>()?;
    Ok(Curve::new(label, x, &estimates))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mge_run::RunHistory;
    use mge_stats::efficiency::efficiency;
    use mge_trainer::{Method, RunConfig};

    #[test]
    fn method_scores_have_the_baseline_of_reports_as_reference() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let row = |method| {
            let config = RunConfig::default_for(task.clone(), method);
            let efficiency = efficiency(&[true, false, true], WINDOW);
            LearningRow { episodes: 3, efficiency, ..LearningRow::new(&config, &RunHistory::default()) }
        };
        let rows = [Method::DdpgMgeAdaptive, Method::Ddpg].map(row);
        let scores = method_scores(&rows, &Bootstrap::default(), None).unwrap();
        assert_eq!((scores.panels[0].methods[0].label.as_str(), scores.reference.as_deref()), {
            ("adaptive DDPG-MGE", Some("DDPG"))
        });
    }

    #[test]
    fn a_run_that_its_success_ended_keeps_its_last_value() {
        let run = |seed: u64, is_solved: bool, training: &[[f64; 2]]| TrainedRun {
            row: LearningRow { task: "task1".into(), method: "ddpg".into(), seed, is_solved, ..Default::default() },
            training: training.to_vec(),
            greedy: Vec::new(),
            actions: training.iter().map(|[x, y]| [10.0 * x, *y]).collect(),
            charged: Vec::new(),
        };
        let mut runs = [run(0, true, &[[1.0, 0.8]]), run(1, true, &[[1.0, 0.0], [2.0, 0.4], [3.0, 0.8]])];
        let bootstrap = Bootstrap { resamples: 10, ..Bootstrap::default() };
        let drawn = |runs: &[TrainedRun], against| {
            let figure = learning_curves(runs, &bootstrap, Success::Training, against, None).unwrap();
            (figure.panels[0].curves[0].clone(), figure.remark)
        };
        let (curve, remark) = drawn(&runs, Against::Episodes);
        assert!(curve.y.iter().zip([0.4, 0.6, 0.8]).all(|(y, expected)| (y - expected).abs() < 1e-12), "{curve:?}");
        assert_eq!(
            (&*curve.x, &*remark),
            (&[1.0, 2.0, 3.0][..], " A run that its success ended keeps its last value.")
        );
        let (curve, _) = drawn(&runs, Against::Actions);
        assert!(curve.x.last() == Some(&30.0) && (curve.y[99] - 0.8).abs() < 1e-12, "{curve:?}");
        runs[0].row.is_solved = false;
        let (curve, remark) = drawn(&runs, Against::Episodes);
        assert_eq!((curve.x.len(), &*remark), (1, " A curve ends with its shortest run."));
    }

    #[test]
    fn success_against_charged_actions_begins_after_what_is_charged_before_training() {
        let run = |method: &str, seed: u64, actions: &[[f64; 2]], charged: f64| TrainedRun {
            row: LearningRow {
                task: "task1".to_owned(),
                method: method.to_owned(),
                epsilon: "0".to_owned(),
                seed,
                episodes: 2,
                ..LearningRow::default()
            },
            training: Vec::new(),
            greedy: Vec::new(),
            actions: actions.to_vec(),
            charged: actions.iter().map(|[x, y]| [x + charged, *y]).collect(),
        };
        let runs = [
            run("ddpg", 0, &[[100.0, 0.0], [200.0, 1.0]], 0.0),
            run("ddpg", 1, &[[100.0, 0.0], [400.0, 1.0]], 0.0),
            run("ddpg-uniform", 0, &[[100.0, 0.5], [200.0, 1.0]], 1000.0),
        ];
        let bootstrap = Bootstrap { resamples: 10, ..Bootstrap::default() };
        let figure = learning_curves(&runs, &bootstrap, Success::Training, Against::Charged, None).unwrap();
        let [plain, charged] = &figure.panels[0].curves[..] else { panic!("two curves: {figure:?}") };
        // As far as the shorter run: both have begun to learn.
        let at = |curve: &Curve, x: f64| curve.y[curve.x.iter().position(|at| (at - x).abs() < 1e-9).unwrap()];
        assert_eq!(plain.x.last(), Some(&200.0));
        assert_eq!(at(plain, 100.0), 0.0);
        assert!((at(plain, 200.0) - (1.0 + 1.0 / 3.0) / 2.0).abs() < 1e-12);
        assert_eq!((charged.x.last(), at(charged, 1200.0)), (Some(&1200.0), 1.0));
        assert_eq!(at(charged, 996.0), 0.0, "nothing is reached before training begins");
        assert_eq!(figure.against, Against::Charged);
        let own = learning_curves(&runs, &bootstrap, Success::Training, Against::Actions, None).unwrap();
        assert_eq!((own.panels[0].curves[1].x.last(), own.against), (Some(&200.0), Against::Actions));
    }
}
