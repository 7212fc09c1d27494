//! A line of the list: a run, or a group of runs that differ in the seed only.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ratatui::style::Style;

use super::super::status::state_colour;
use crate::tui::view::{RunGroup, RunSummary, scores_of};
use crate::tui::widgets::columns::shortened_label;
use crate::tui::widgets::theme::Theme;
use mge_run::RunState;
use mge_stats::aggregate::iqm;

/// The identity of a line: whether it is a group, and the folder of one of its runs. The label of a group and its runs
/// may change at any time.
pub type LineKey = (bool, PathBuf);

/// A line of the list: a run, or a group of several.
#[derive(Clone, Default)]
pub struct Line<'a> {
    /// Its runs that are listed, at least one.
    pub runs: Vec<&'a RunSummary>,
    /// What it is a line of, if not of a run.
    pub group: Option<&'a RunGroup>,
    /// The number of the runs of the group that are not listed.
    pub hidden: usize,
    /// It is a run below the line of its unfolded group.
    pub is_below: bool,
}

impl<'a> Line<'a> {
    /// Its identity, for the selection.
    pub fn key(&self) -> LineKey {
        (self.group.is_some(), self.runs[0].path.clone())
    }

    /// Whether it is the run in a folder, or has it.
    pub fn has(&self, run: &Path) -> bool {
        self.runs.iter().any(|of_line| of_line.path == run)
    }

    /// The note on its run; a group has none.
    pub fn note(&self) -> &str {
        if self.group.is_some() { "" } else { &self.runs[0].note }
    }

    /// Its run in the most urgent state.
    pub fn foremost(&self) -> &'a RunSummary {
        self.runs.iter().min_by_key(|run| urgency(run)).unwrap_or(&self.runs[0])
    }

    /// The name that the user gave the run, or its folder; of a group also the task, if there are several.
    pub fn name(&self, several_tasks: bool) -> String {
        match self.group {
            None => self.runs[0].name.clone(),
            Some(group) if several_tasks => format!("{}: {}", group.task, group.name),
            Some(group) => group.name.clone(),
        }
    }

    /// Its name, shortened to `columns`; a group's with its task if there are several, and the number of its runs;
    /// what most groups have is left out first. Says which runs were changed during the training.
    pub fn named(&self, columns: usize, several_tasks: bool, labels: &BTreeSet<&str>) -> String {
        let some = |is_so: fn(&RunSummary) -> bool, word| match self.runs.iter().filter(|run| is_so(run)).count() {
            0 => String::new(),
            _ if self.group.is_none() => format!(" ({word})"),
            all if all == self.runs.len() => format!(", {word}"),
            count => format!(", {count} {word}"),
        };
        let some = some(|run| run.changed.is_some(), "changed") + &some(|run| run.elsewhere, "elsewhere");
        let after = if self.group.is_some() { format!(" ({}{some})", self.runs.len()) } else { some };
        let before = if self.is_below { "  " } else { "" };
        let run = self.runs[0];
        let seed = run.given_name().filter(|_| self.is_below).map(|_| format!(", seed {}", run.config.seed));
        let name = self.name(several_tasks) + &seed.unwrap_or_default();
        let room = columns.saturating_sub(before.len() + after.len());
        format!("{before}{}{after}", shortened_label(&name, labels, room))
    }

    /// Episodes done and episodes in all.
    pub fn progress(&self) -> [u64; 2] {
        self.runs.iter().fold([0, 0], |[done, all], run| [done + run.done, all + run.episodes()])
    }

    /// Success rate; a group's is the interquartile mean, if all its runs are listed.
    pub fn success(&self) -> Option<f64> {
        match self.group {
            None => self.runs[0].success,
            Some(_) if self.hidden > 0 => None,
            Some(_) => scores_of(&self.runs).map(|scores| iqm(&scores)),
        }
    }

    /// Episodes a second: of its runs that are being trained together, or of a single run on the whole.
    pub fn speed(&self) -> Option<f64> {
        if self.group.is_none() { self.runs[0].speed() } else { self.together(RunSummary::rate) }
    }

    /// The sum over its runs that are being trained; those of which it is not known yet count as the others do.
    fn together(&self, speed: fn(&RunSummary) -> Option<f64>) -> Option<f64> {
        let running = self.runs.iter().copied().filter(|run| run.state == RunState::Running);
        let speeds: Vec<Option<f64>> = running.map(speed).collect();
        let known = speeds.iter().flatten().count();
        (known > 0).then(|| speeds.iter().flatten().sum::<f64>() * speeds.len() as f64 / known as f64)
    }

    /// Seconds until all its runs that are being trained or wait for it are finished, at the pace of the former together.
    pub fn seconds_left(&self) -> Option<f64> {
        let left = |run: &RunSummary| run.episodes().saturating_sub(run.done) as f64;
        let waits = |run: &&RunSummary| run.queued || run.state == RunState::Running;
        Some(self.runs.iter().copied().filter(waits).map(left).sum::<f64>() / self.together(RunSummary::pace)?)
    }

    /// The most urgent state of its runs with the number of runs in it, and its style.
    pub fn state(&self, theme: &Theme) -> (String, Style) {
        let first = self.foremost();
        let style = Style::new().fg(state_colour(&first.state, theme));
        if self.group.is_none() {
            return (first.state_word().to_owned(), style);
        }
        let mut count = self.runs.iter().filter(|run| run.state_word() == first.state_word()).count().to_string();
        if self.runs.iter().any(|run| run.state == RunState::Paused) && first.state == RunState::Running {
            count += &format!(" of {}", self.runs.len());
        }
        (format!("{count} {}", first.state_word()), style)
    }
}

/// Rank of the state of a run, 0 for the most urgent.
pub fn urgency(run: &RunSummary) -> usize {
    match run.state {
        RunState::Failed(_) => 0,
        RunState::Running => 1,
        _ if run.queued => 2,
        RunState::Paused => 3,
        RunState::Interrupted | RunState::Stopped(_) => 4,
        RunState::NotStarted => 5,
        RunState::Finished => 6,
    }
}
