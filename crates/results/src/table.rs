//! The sample-efficiency table.

use std::fmt::Write as _;

use super::comparison::GREEDY;
use super::groups::{AREA, CHARGED_AREA, FINAL, Groups, HELD, scores};
use super::row::LearningRow;
use mge_base::markdown;
use mge_figures::text_of;
use mge_stats::aggregate::iqm;
use mge_stats::rolling::WINDOW;
use mge_stats::{Bootstrap, StatsError};

impl Groups<'_> {
    /// Writes the sample-efficiency table in Markdown, one row per group, after an explanation. Groups are compared
    /// with those labelled `baseline`.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn write_table(&self, text: &mut String, baseline: &str, bootstrap: &Bootstrap) -> Result<(), StatsError> {
        let legend = self.legend();
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "Area under the curve of the rolling success (window {WINDOW}), final rolling success, and least rolling success over the last quarter of the episodes (what is held): interquartile mean with its interval; of the area also the mean, and how many seeds hold 80 %. The charged area is that over charged actions, which include practice, rollouts for clusters, the search for subgoals and the launches that the dynamics model learned from; all runs on a task have the same budget of them, that of the shortest whole training reported here. Episodes to 50 % and 80 %, from the 100th on: median over the seeds that reached it, and how many did; so are charged actions to 80 %, and in brackets those of episodes and practice alone. Probability of improvement over {} in the charged area, with its interval.\n",
            markdown::text(text_of(&legend, baseline))
        );
        let better = format!("P(better than {})", text_of(&legend, baseline));
        *text += &markdown::header([
            "task",
            "method",
            "seeds",
            "charged area",
            "area",
            "mean area",
            "final",
            "held",
            "hold 80 %",
            "to 50 %",
            "to 80 %",
            "charged to 80 %",
            GREEDY,
            &better,
        ]);
        for task in &self.tasks {
            for label in &self.labels {
                let Some(area) = self.summary(task, label, baseline, AREA, bootstrap)? else { continue };
                let charged = self.summary(task, label, baseline, CHARGED_AREA, bootstrap)?;
                let runs = self.of(task, label);
                let interquartile =
                    |score| Ok::<_, StatsError>(bootstrap.stratified(&scores(&runs, score)?, iqm)?.text(2));
                *text += &markdown::row([
                    task.clone(),
                    text_of(&legend, label).to_owned(),
                    runs.len().to_string(),
                    interquartile(CHARGED_AREA)?,
                    area.iqm.text(2),
                    area.mean.text(2),
                    interquartile(FINAL)?,
                    interquartile(HELD)?,
                    holding_80(&runs),
                    reached(runs.iter().map(|row| row.efficiency.episodes_to_50)),
                    reached(runs.iter().map(|row| row.efficiency.episodes_to_80)),
                    charged_to_80(&runs),
                    greedy_mean(&runs),
                    charged.and_then(|charged| charged.improvement).map_or_else(String::new, |share| share.text(2)),
                ]);
            }
        }
        text.push('\n');
        Ok(())
    }
}

/// Mean success of the last greedy evaluations of the runs that have any; empty if none has.
fn greedy_mean(rows: &[&LearningRow]) -> String {
    let evaluated: Vec<f64> = rows.iter().filter_map(|row| row.greedy_success).collect();
    let mean = evaluated.iter().sum::<f64>() / evaluated.len() as f64;
    if evaluated.is_empty() { String::new() } else { format!("{mean:.2}") }
}

/// How many of the runs held 80 % over the last quarter of their episodes.
pub(super) fn holding_80(rows: &[&LearningRow]) -> String {
    let holding = rows.iter().filter(|row| HELD(row).is_some_and(|held| held >= 0.8)).count();
    format!("{holding}/{}", rows.len())
}

/// Median over the runs that reached the threshold, and how many of all runs did.
fn reached(episodes: impl Iterator<Item = Option<u64>>) -> String {
    let all: Vec<Option<u64>> = episodes.collect();
    let there: Vec<u64> = all.iter().flatten().copied().collect();
    let median = rounded_median(&there).map_or_else(|| "never".to_owned(), |median| median.to_string());
    format!("{median} ({}/{})", there.len(), all.len())
}

/// Median charged actions of the runs that reached 80 %, how many did, and the median of those of episodes and practice.
fn charged_to_80(rows: &[&LearningRow]) -> String {
    let own: Vec<u64> = rows.iter().filter_map(|row| row.actions_to_80).collect();
    let all = reached(rows.iter().map(|row| row.charged_to_80));
    rounded_median(&own).map_or_else(|| all.clone(), |own| format!("{all} [{own}]"))
}

/// The median, rounded up; None without values.
fn rounded_median(values: &[u64]) -> Option<u64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some((lower + upper).div_ceil(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_stats::efficiency::Efficiency;

    #[test]
    fn episodes_to_a_threshold_are_the_median_of_the_runs_that_reached_it() {
        let check = |episodes: &[Option<u64>], expected: &str| assert_eq!(reached(episodes.iter().copied()), expected);
        check(&[Some(900), Some(100), Some(200)], "200 (3/3)");
        check(&[Some(900), None, Some(100), Some(200)], "200 (3/4)");
        check(&[Some(900), Some(100), Some(301), Some(200)], "251 (4/4)");
        check(&[None, None], "never (0/2)");
    }

    #[test]
    fn runs_that_fall_below_80_percent_do_not_hold_it() {
        let row = |held_success| {
            let efficiency = Efficiency { final_success: Some(1.0), held_success, ..Efficiency::default() };
            LearningRow { efficiency, ..LearningRow::default() }
        };
        assert_eq!(holding_80(&[Some(0.8), Some(0.79), None].map(row).each_ref()), "1/3");
    }

    #[test]
    fn actions_to_a_threshold_are_given_with_and_without_charged_ones() {
        let row = |actions_to_80: Option<u64>, charged| LearningRow {
            actions_to_80,
            charged_to_80: actions_to_80.map(|actions| actions + charged),
            ..LearningRow::default()
        };
        let rows = [row(Some(300), 1000), row(None, 1000), row(Some(100), 2000)];
        assert_eq!(charged_to_80(&rows.each_ref()), "1700 (2/3) [200]");
        assert_eq!(charged_to_80(&rows[1..2].iter().collect::<Vec<_>>()), "never (0/1)");
    }
}
