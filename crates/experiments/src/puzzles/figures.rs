//! Figures of a bench: the share of puzzles solved against episodes, and a profile of the final success.

use super::results::{BenchResults, GROUPS, SOLVED};
use mge_base::text::counted;
use mge_figures::{Curve, CurvePanel, LearningCurves, PerformanceProfile, Statistics, SuccessMeasure};
use mge_results::{FINAL, Groups, LearningRow, figures};
use mge_stats::rolling::WINDOW;
use mge_stats::{Bootstrap, StatsError, TaskScores};

/// Number of steps of a curve.
const STEPS: u64 = 50;

impl BenchResults {
    /// The share of puzzles that each method has solved, against episodes: of all puzzles, and by the success of
    /// uniform play.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub(super) fn solved_curves(&self, bootstrap: &Bootstrap) -> Result<LearningCurves, StatsError> {
        let of_group = |group: Option<usize>| -> Vec<&LearningRow> {
            let is_in = |row: &&LearningRow| group.is_none() || self.difficulty(row) == group;
            self.runs.iter().filter(is_in).collect()
        };
        let mut panels = vec![self.panel("all", &of_group(None), bootstrap)?];
        for (group, (_, name)) in GROUPS.iter().enumerate() {
            let rows = of_group(Some(group));
            if !rows.is_empty() {
                panels.push(self.panel(name, &rows, bootstrap)?);
            }
        }
        Ok(LearningCurves {
            measure: SuccessMeasure::Solved(SOLVED),
            window: WINDOW.get(),
            statistics: self.over_puzzles(),
            panels,
            ..LearningCurves::default()
        })
    }

    fn panel(&self, name: &str, rows: &[&LearningRow], bootstrap: &Bootstrap) -> Result<CurvePanel, StatsError> {
        let groups = Groups::new(rows.iter().copied());
        let x: Vec<f64> = (0..=STEPS).map(|step| (self.episodes * step) as f64 / STEPS as f64).collect();
        let mut curves = Vec::new();
        for label in groups.labels() {
            let share = |episodes: f64| {
                let is_solved =
                    |row: &&LearningRow| row.efficiency.episodes_to_80.is_some_and(|count| count as f64 <= episodes);
                let values = of_puzzles(&groups, label, |rows| {
                    Some(rows.iter().filter(|row| is_solved(row)).count() as f64 / rows.len() as f64)
                });
                bootstrap.mean(&values)
            };
            let estimates = x.iter().map(|episodes| share(*episodes)).collect::<Result<Vec<_>, _>>()?;
            curves.push(Curve::new(label, x.clone(), &estimates));
        }
        Ok(CurvePanel { task: format!("{name} ({})", counted(groups.tasks().len(), "puzzle")), curves })
    }

    /// The share of puzzles on which the mean final success of a method is above each threshold.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub(super) fn profile(&self, bootstrap: &Bootstrap) -> Result<PerformanceProfile, StatsError> {
        let groups = Groups::new(&self.runs);
        let scores = |label: &String| {
            let mean = |rows: &[&LearningRow]| {
                let scores: Vec<f64> = rows.iter().filter_map(|row| FINAL(row)).collect();
                (!scores.is_empty()).then(|| scores.iter().sum::<f64>() / scores.len() as f64)
            };
            Ok((label.clone(), TaskScores::of_one_task(&of_puzzles(&groups, label, mean))?))
        };
        let methods = groups.labels().iter().map(scores).collect::<Result<Vec<_>, StatsError>>()?;
        let statistics = self.over_puzzles();
        Ok(PerformanceProfile { statistics, ..figures::performance_profile(&methods, bootstrap)? })
    }

    /// Intervals are over puzzles, not over the seeds of each.
    fn over_puzzles(&self) -> Statistics {
        let groups = Groups::new(&self.runs);
        let pairs = || groups.tasks().iter().flat_map(|task| groups.labels().iter().map(move |label| (task, label)));
        let counts = || pairs().map(|(task, label)| groups.of(task, label).len()).filter(|count| *count > 0);
        Statistics {
            centre: "Puzzles, each the mean".to_owned(),
            interval: "95 % bootstrap interval over puzzles".to_owned(),
            seeds: counts().max().unwrap_or(0),
            fewest_seeds: counts().min(),
        }
    }
}

/// A value of each puzzle on which a method was trained, from its trainings on it.
fn of_puzzles(groups: &Groups<'_>, label: &str, value: impl Fn(&[&LearningRow]) -> Option<f64>) -> Vec<f64> {
    let trainings = groups.tasks().iter().map(|task| groups.of(task, label));
    trainings.filter(|rows| !rows.is_empty()).filter_map(value).collect()
}
