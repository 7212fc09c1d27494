//! The sample-efficiency table, for people.

use std::fmt::Write as _;

use super::groups::{AREA, FINAL, Groups, HELD, scores};
use super::row::LearningRow;
use crate::markdown;
use crate::stats::aggregate::{iqm, mean};
use crate::stats::rolling::WINDOW;
use crate::stats::{Bootstrap, Estimate, StatsError};

impl Groups<'_> {
    /// The sample-efficiency table in Markdown, one row for each group, with the text that explains it.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn write_table(&self, text: &mut String, bootstrap: &Bootstrap) -> Result<(), StatsError> {
        let Some(baseline) = self.baseline() else { return Ok(()) };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "Area under the curve of the rolling success (window {WINDOW}), final rolling success, and least rolling success over the last quarter of the episodes (what is held): interquartile mean with its interval; of the area also the mean. Episodes to 50 % and 80 %: median over the seeds that reached it, and how many did. Probability of improvement over {} in the area under the curve, with its interval.\n",
            markdown::text(baseline)
        );
        let better = format!("P(better than {baseline})");
        *text += &markdown::header([
            "task",
            "method",
            "seeds",
            "area",
            "mean area",
            "final",
            "held",
            "to 50 %",
            "to 80 %",
            "greedy at the end",
            &better,
        ]);
        for task in self.tasks() {
            for label in self.labels() {
                let Some(area) = self.summary(task, label, baseline, AREA, bootstrap)? else { continue };
                let runs = self.of(task, label);
                let interquartile =
                    |score| Ok::<_, StatsError>(format_share(bootstrap.stratified(&scores(runs, score)?, iqm)?));
                *text += &markdown::row([
                    task.clone(),
                    label.clone(),
                    runs.len().to_string(),
                    format_share(area.iqm),
                    format_share(area.mean),
                    interquartile(FINAL)?,
                    interquartile(HELD)?,
                    reached(runs.iter().map(|row| row.efficiency.episodes_to_50)),
                    reached(runs.iter().map(|row| row.efficiency.episodes_to_80)),
                    greedy_mean(runs)?,
                    area.improvement.map_or_else(String::new, format_share),
                ]);
            }
        }
        text.push('\n');
        Ok(())
    }
}

/// Mean success of the last greedy evaluations; nothing for a method that has none.
fn greedy_mean(rows: &[&LearningRow]) -> Result<String, StatsError> {
    if rows.iter().all(|row| row.greedy_success.is_none()) {
        return Ok(String::new());
    }
    Ok(format!("{:.2}", mean(&scores(rows, |row| row.greedy_success)?)))
}

/// A share with its interval, to two digits.
pub(super) fn format_share(estimate: Estimate) -> String {
    format!("{:.2} [{:.2}, {:.2}]", estimate.value, estimate.lower, estimate.upper)
}

/// Median of the runs that reached it, and how many of all did.
fn reached(episodes: impl Iterator<Item = Option<u64>>) -> String {
    let all: Vec<Option<u64>> = episodes.collect();
    let mut there: Vec<u64> = all.iter().flatten().copied().collect();
    there.sort_unstable();
    let middle = there.len() / 2;
    let median = match there.len() {
        0 => return format!("never (0/{})", all.len()),
        odd if odd % 2 == 1 => there[middle],
        _ => (there[middle - 1] + there[middle]).div_ceil(2),
    };
    format!("{median} ({}/{})", there.len(), all.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn episodes_to_a_threshold_are_the_median_of_the_runs_that_reached_it() {
        let check = |episodes: &[Option<u64>], expected: &str| assert_eq!(reached(episodes.iter().copied()), expected);
        check(&[Some(900), Some(100), Some(200)], "200 (3/3)");
        check(&[Some(900), None, Some(100), Some(200)], "200 (3/4)");
        check(&[Some(900), Some(100), Some(301), Some(200)], "251 (4/4)");
        check(&[None, None], "never (0/2)");
    }
}
