//! Results over the seeds, of dynamics models and of counts of hits: their report.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::results::{Kind, Results, common_kind, kind_of, results_of};
use crate::error::{ExperimentError, Result};
use mge_base::atomic::Target;
use mge_base::json;
use mge_base::markdown;
use mge_results::{ReportFolder, find_runs};
use mge_stats::{Bootstrap, Estimate, StatsError, TaskScores, aggregate};

/// The finished work of a sweep in groups, which differ only in the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// The groups, in the order of their first rows.
    pub groups: Vec<Group>,
    /// Names of the settings in which they differ.
    settings: Vec<String>,
    /// Names of what was measured.
    measures: Vec<String>,
    /// Decimals of a mean: none of counts, four of errors and shares.
    decimals: usize,
}

/// Work that differs only in the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// The settings, by name.
    pub settings: Vec<(String, String)>,
    /// Number of models or counts.
    pub count: usize,
    /// The mean of each measure over the seeds with its interval, by name; none if it is undefined for all of them.
    pub measures: Vec<(String, Option<Estimate>)>,
}

impl Group {
    /// The value of a setting.
    pub fn setting(&self, name: &str) -> Option<&str> {
        self.settings.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// The estimates of the measures whose names begin like this, as far as they are defined.
    pub fn measures_like(&self, prefix: &str) -> Vec<Estimate> {
        self.measures
            .iter()
            .filter(|(name, _)| name.starts_with(prefix))
            .filter_map(|(_, estimate)| *estimate)
            .collect()
    }
}

impl Summary {
    /// The summary of the finished rows.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn new(results: &Results, bootstrap: &Bootstrap) -> Result<Self, StatsError> {
        let (settings, measures) = (results.settings.clone(), results.measures.clone());
        let mut rows: Vec<(Choice, Vec<&Row>)> = Vec::new();
        for row in results.rows.iter().filter(|row| row["state"] != "not finished") {
            let own = settings.iter().map(|name| (name.clone(), json::text(&row[name]))).collect();
            match rows.iter_mut().find(|(known, _)| *known == own) {
                Some((_, rows)) => rows.push(row),
                None => rows.push((own, vec![row])),
            }
        }
        let group = |(settings, rows): (Choice, Vec<&Row>)| {
            let estimate = |name: &String| {
                let values: Vec<f64> = rows.iter().filter_map(|row| row[name].as_f64()).collect();
                let mean = || bootstrap.stratified(&TaskScores::new(vec![values.clone()])?, aggregate::mean);
                Ok((name.clone(), (!values.is_empty()).then(mean).transpose()?))
            };
            let measures = measures.iter().map(estimate).collect::<Result<_, StatsError>>()?;
            Ok(Group { settings, count: rows.len(), measures })
        };
        let groups = rows.into_iter().map(group).collect::<Result<_, StatsError>>()?;
        Ok(Self { groups, settings, measures, decimals: if results.kind == "hits" { 0 } else { 4 } })
    }

    /// The summary as a Markdown table.
    pub fn to_markdown(&self) -> String {
        let (settings, measures) = (self.settings.iter(), self.measures.iter());
        let mut text =
            markdown::header(settings.map(String::as_str).chain(["seeds"]).chain(measures.map(String::as_str)));
        for Group { settings, count, measures } in &self.groups {
            let mean = |estimate: Estimate| estimate.text(self.decimals);
            let cells = measures.iter().map(|(_, estimate)| estimate.map_or_else(|| "none".to_owned(), mean));
            let first = settings.iter().map(|(_, value)| value.clone()).chain([count.to_string()]);
            text += &markdown::row(first.chain(cells));
        }
        text + "\n"
    }
}

/// The values of settings, by name.
type Choice = Vec<(String, String)>;
/// A row of results.
type Row = BTreeMap<String, Value>;

/// Writes `report.md` and `report.json` of the models or counts in `folders` to `out`. `command` reproduces them. Returns
/// the number of those that are left out, as they are not finished, damaged, or not of the kind of the first; None if that
/// is a training.
///
/// # Errors
/// When none is finished, or a file cannot be read or written or is of another origin.
pub fn report_measured(
    folders: &[PathBuf],
    out: &Target,
    bootstrap: &Bootstrap,
    command: &str,
) -> Result<Option<usize>> {
    let paths = find_runs(folders)?;
    let (all, kind) = (paths.len(), common_kind(&paths));
    if kind == Kind::Agent {
        return Ok(None);
    }
    let folder = ReportFolder::new(out.clone())?;
    let own: Vec<PathBuf> = paths.into_iter().filter(|path| kind_of(path).map_or(true, |it| it == kind)).collect();
    let (results, damaged) = results_of(&own)?;
    let summary = Summary::new(&results, bootstrap)?;
    if summary.groups.is_empty() {
        return Err(damaged.unwrap_or_else(|| {
            let all = results.rows.len();
            ExperimentError::Refused(format!("none of {all} is finished: the command of their sweep continues them"))
        }));
    }
    let damaged = damaged.map_or_else(String::new, |error| format!("Left out, as it is damaged: {error}.\n\n"));
    let left_out = all - summary.groups.iter().map(|group| group.count).sum::<usize>();
    let version = mge_base::identity::version();
    let markdown = format!(
        "# Results over seeds\n\n{}. Mean over the seeds with its 95 % bootstrap interval; errors in normalised units (the screen is 2 wide), hits in episodes.\n\n{damaged}{}",
        markdown::made_by(command, version),
        summary.to_markdown()
    );
    let _alone = folder.hold()?;
    let report = json!({
        "version": 1, "command": command, "mge_version": version, "kind": results.kind, "rows": results.rows,
    });
    folder.write(&report, &markdown)?;
    Ok(Some(left_out))
}
