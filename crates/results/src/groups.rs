//! Groups rows of runs by task and label.

use std::collections::{BTreeSet, HashMap};

use super::error::ResultsError;
use super::row::LearningRow;
use mge_base::spelling::did_you_mean;
use mge_stats::aggregate::{iqm, mean};
use mge_stats::comparison::improvement_interval;
use mge_stats::{Bootstrap, Estimate, StatsError, TaskScores};
use mge_trainer::Method;

/// A score of a run; None if the run has none.
pub type Score = fn(&LearningRow) -> Option<f64>;

/// Area under the curve of the rolling success, 0 to 1.
pub const AREA: Score = |row| row.efficiency.auc;
/// Area under the curve of the rolling success against charged actions, 0 to 1.
pub const CHARGED_AREA: Score = |row| row.charged_area;
/// Rolling success at the end, 0 to 1.
pub const FINAL: Score = |row| row.efficiency.final_success;
/// Minimum rolling success over the last quarter of the episodes, 0 to 1.
pub const HELD: Score = |row| row.efficiency.held_success;

/// The most names that an error lists.
const LISTED: usize = 12;

/// The label with this text among labels with their texts, first those in a legend, or this label itself.
///
/// # Errors
/// [`ResultsError::NoLabel`], [`ResultsError::SharedName`].
pub(super) fn label_of(legend: &[(String, String)], text: &str) -> Result<String, ResultsError> {
    let called = |is: fn(&(String, String)) -> &str| -> Vec<&str> {
        let labels = legend.iter().filter(|entry| is(entry) == text).map(|(label, _)| &**label);
        labels.collect::<BTreeSet<_>>().into_iter().collect()
    };
    match (&called(|(label, _)| label)[..], &called(|(_, shown)| shown)[..]) {
        ([label, ..], _) | ([], [label]) => return Ok((*label).to_owned()),
        ([], []) => {}
        ([], labels) => return Err(ResultsError::SharedName { name: text.to_owned(), labels: labels.join("; ") }),
    }
    let mut known: Vec<&str> = legend.iter().map(|(_, shown)| &**shown).collect();
    let mut hint = did_you_mean(known.iter().copied(), text);
    if hint.is_empty() {
        known.truncate(LISTED);
        hint = format!(": use one of {}", known.join("; "));
    }
    Err(ResultsError::NoLabel { label: text.to_owned(), hint })
}

/// Rows of runs in groups. A group is the runs on one task with one label, which differ only in the
/// seed.
#[derive(Debug, Clone)]
pub struct Groups<'a> {
    /// Labels in order of appearance.
    pub labels: Vec<String>,
    /// Names of the tasks in order of appearance.
    pub tasks: Vec<String>,
    rows: Vec<&'a LearningRow>,
    /// The indices of the rows of each group, by those of its task and label.
    by_key: HashMap<(usize, usize), Vec<usize>>,
}

/// A score of one group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupSummary {
    /// Interquartile mean of the score, with its interval.
    pub iqm: Estimate,
    /// Mean of the score, with its interval.
    pub mean: Estimate,
    /// Probability that a run of the group has a higher score than a run of the baseline on the
    /// same task. None for the baseline itself, or if the baseline has no runs there.
    pub improvement: Option<Estimate>,
}

impl<'a> Groups<'a> {
    /// Groups rows.
    pub fn new(rows: impl IntoIterator<Item = &'a LearningRow>) -> Self {
        let mut groups = Self { labels: Vec::new(), tasks: Vec::new(), rows: Vec::new(), by_key: HashMap::new() };
        for (index, row) in rows.into_iter().enumerate() {
            let key = (index_or_push(&mut groups.tasks, &row.task), index_or_push(&mut groups.labels, &row.label()));
            groups.rows.push(row);
            groups.by_key.entry(key).or_default().push(index);
        }
        let Self { rows, by_key, .. } = &mut groups;
        by_key.values_mut().for_each(|group| group.sort_by_key(|index| rows[*index].seed));
        groups
    }

    /// Labels, each with its text in a legend: runs that users gave a [common name](common_name) have that.
    pub fn legend(&self) -> Vec<(String, String)> {
        let text = |label: &String| {
            let rows = self.tasks.iter().flat_map(|task| self.of(task, label));
            (label.clone(), common_name(rows.map(|row| &*row.name)).unwrap_or(label).to_owned())
        };
        let mut legend: Vec<(String, String)> = self.labels.iter().map(text).collect();
        let texts: Vec<String> = legend.iter().map(|(_, text)| text.clone()).collect();
        // Of two with one name, both have their labels, too.
        for (label, text) in &mut legend {
            if texts.iter().filter(|other| **other == *text).count() > 1 {
                *text = format!("{text}, {label}");
            }
        }
        legend
    }

    /// The rows of one group, ordered by seed; empty if there is no such group.
    pub fn of(&self, task: &str, label: &str) -> Vec<&'a LearningRow> {
        self.indices(task, label).iter().map(|index| self.rows[*index]).collect()
    }

    /// The indices of one group's rows among all rows, ordered by seed, on which its intervals depend.
    pub fn indices(&self, task: &str, label: &str) -> &[usize] {
        let key = index_of(&self.tasks, task).zip(index_of(&self.labels, label));
        key.and_then(|key| self.by_key.get(&key)).map_or(&[], Vec::as_slice)
    }

    /// The number of runs in each group.
    pub(super) fn sizes(&self) -> impl Iterator<Item = usize> {
        self.by_key.values().map(Vec::len)
    }

    /// Tasks on which every label has runs.
    pub fn common_tasks(&self) -> Vec<String> {
        let common = |task: &&String| self.labels.iter().all(|label| !self.indices(task, label).is_empty());
        self.tasks.iter().filter(common).cloned().collect()
    }

    /// Scores of a label on these tasks.
    ///
    /// # Errors
    /// When the label has no run on one of them.
    pub fn scores(&self, tasks: &[String], label: &str, score: Score) -> Result<TaskScores, StatsError> {
        let of_task = |task: &String| Ok(scores(&self.of(task, label), score)?.all().collect::<Vec<f64>>());
        TaskScores::new(tasks.iter().map(of_task).collect::<Result<_, StatsError>>()?)
    }

    /// The label that others are compared with: the first of plain DDPG with the fewest settings that are not its
    /// defaults, or else the first label.
    pub fn baseline(&self) -> Option<&str> {
        let runs = |label: &&String| self.tasks.iter().find_map(|task| self.of(task, label).first().copied());
        let is_plain = |label: &&String| runs(label).is_some_and(|row| row.method == Method::Ddpg.name());
        let unusual = |label: &&String| runs(label).map_or(usize::MAX, |row| row.settings.len());
        let plain = self.labels.iter().filter(is_plain).min_by_key(unusual);
        plain.or(self.labels.first()).map(String::as_str)
    }

    /// A score of one group, compared with the group of the label `baseline` on the same task. None if
    /// the group has no runs.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn summary(
        &self,
        task: &str,
        label: &str,
        baseline: &str,
        score: Score,
        bootstrap: &Bootstrap,
    ) -> Result<Option<GroupSummary>, StatsError> {
        let (runs, base) = (self.of(task, label), self.of(task, baseline));
        if runs.is_empty() {
            return Ok(None);
        }
        let of_runs = scores(&runs, score)?;
        let improvement = match label != baseline && !base.is_empty() {
            true => Some(improvement_interval(&of_runs, &scores(&base, score)?, bootstrap)?),
            false => None,
        };
        Ok(Some(GroupSummary {
            iqm: bootstrap.stratified(&of_runs, iqm)?,
            mean: bootstrap.stratified(&of_runs, mean)?,
            improvement,
        }))
    }
}

/// The name of runs that users gave these names, empty for none: that of a single run, or else the only one, if several
/// have it.
pub fn common_name<'a>(names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let names: Vec<&str> = names.collect();
    let given: Vec<&str> = names.iter().copied().filter(|name| !name.is_empty()).collect();
    let (first, others) = given.split_first()?;
    let is_common = others.iter().all(|name| name == first) && (names.len() == 1 || !others.is_empty());
    is_common.then_some(first)
}

fn index_of(names: &[String], name: &str) -> Option<usize> {
    names.iter().position(|known| known == name)
}

fn index_or_push(names: &mut Vec<String>, name: &str) -> usize {
    index_of(names, name).unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    })
}

/// Scores of runs on one task; a run without a score counts as 0.
///
/// # Errors
/// When there are no runs.
pub(super) fn scores(rows: &[&LearningRow], score: Score) -> Result<TaskScores, StatsError> {
    TaskScores::of_one_task(&rows.iter().map(|row| score(row).unwrap_or(0.0)).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_stats::efficiency::Efficiency;

    fn row(task: &str, method: &str, seed: u64, auc: Option<f64>) -> LearningRow {
        LearningRow {
            task: task.to_owned(),
            method: method.to_owned(),
            epsilon: "0".to_owned(),
            seed,
            episodes: 10,
            efficiency: Efficiency { auc, final_success: auc, ..Efficiency::default() },
            ..LearningRow::default()
        }
    }

    #[test]
    fn a_name_that_two_curves_share_is_not_guessed() {
        let legend = [("DDPG", "mine"), ("DDPG, ddpg.gamma 0.9", "mine"), ("open loop", "other")];
        let legend = legend.map(|(label, shown)| (label.to_owned(), shown.to_owned()));
        let of = |text| label_of(&legend, text).map_err(|error| error.to_string());
        assert_eq!([of("DDPG"), of("other")], [Ok("DDPG".to_owned()), Ok("open loop".to_owned())]);
        let shared = "several runs are called `mine`: give one by its label, DDPG; DDPG, ddpg.gamma 0.9";
        assert_eq!(of("mine"), Err(shared.to_owned()));
    }

    #[test]
    fn runs_that_differ_only_in_the_seed_are_one_group_with_its_statistics() {
        let rows = [
            row("task1", "ddpg-uniform", 0, Some(0.75)),
            row("task1", "ddpg", 0, Some(0.25)),
            row("task1", "ddpg-uniform", 1, Some(0.25)),
            row("task1", "ddpg", 1, None),
            row("task2", "ddpg", 0, Some(1.0)),
        ];
        let groups = Groups::new(&rows);
        let (bootstrap, baseline) = (Bootstrap::default(), groups.baseline().unwrap());
        assert_eq!((baseline, &groups.tasks[..]), ("DDPG", ["task1", "task2"].map(str::to_owned).as_slice()));
        assert_eq!(groups.common_tasks(), ["task1"]);
        let summary = |task: &str, label: &str| groups.summary(task, label, baseline, AREA, &bootstrap).unwrap();
        let label = &groups.labels[0];
        let better = summary("task1", label).unwrap();
        assert_eq!((better.mean.value, better.iqm.value), (0.5, 0.5));
        // 0.75 beats 0.25 and nothing; 0.25 beats nothing and ties with 0.25.
        assert_eq!(better.improvement.map(|estimate| estimate.value), Some(0.875));
        let base = summary("task1", "DDPG").unwrap();
        assert_eq!(base.improvement, None);
        assert_eq!(base.mean.value, 0.125, "a run without a score counts as 0");
        assert_eq!(summary("task2", label), None);
        let all = groups.scores(&groups.common_tasks(), "DDPG", AREA).unwrap();
        assert_eq!(all.tasks(), [[0.25, 0.0]]);
    }
}
