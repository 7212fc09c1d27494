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

/// A line of the list.
#[derive(Clone)]
pub enum Line<'a> {
    /// A run, and whether it is below the line of its unfolded group.
    Run(&'a RunSummary, bool),
    /// A group, those of its runs that are listed, and the number of the others.
    Group(&'a RunGroup, Vec<&'a RunSummary>, usize),
}

impl<'a> Line<'a> {
    /// Its identity, for the selection.
    pub fn key(&self) -> LineKey {
        (self.is_group(), self.runs()[0].path.clone())
    }

    pub fn is_group(&self) -> bool {
        matches!(self, Self::Group(..))
    }

    /// Whether it is the run in a folder, or has it.
    pub fn has(&self, run: &Path) -> bool {
        self.runs().iter().any(|of_line| of_line.path == run)
    }

    /// Its runs.
    pub fn runs(&self) -> Vec<&'a RunSummary> {
        match self {
            Self::Run(run, _) => vec![run],
            Self::Group(_, runs, _) => runs.clone(),
        }
    }

    /// Its run in the most urgent state.
    pub fn foremost(&self) -> &'a RunSummary {
        match self {
            Self::Run(run, _) => run,
            // A listed group has at least one listed run.
            Self::Group(_, runs, _) => runs.iter().min_by_key(|run| urgency(run)).unwrap_or(&runs[0]),
        }
    }

    /// The name that the user gave the run, or its folder; of a group also the task, if there are several.
    pub fn name(&self, several_tasks: bool) -> String {
        match self {
            Self::Run(run, _) => run.name.clone(),
            Self::Group(group, ..) if several_tasks => format!("{}: {}", group.task, group.name),
            Self::Group(group, ..) => group.name.clone(),
        }
    }

    /// Its name, shortened to `columns`; a group's with its task if there are several, and the number of its runs;
    /// what most groups have is left out first. Says which runs were changed during the training.
    pub fn named(&self, columns: usize, several_tasks: bool, labels: &BTreeSet<&str>) -> String {
        let changed = self.runs().iter().filter(|run| run.changed.is_some()).count();
        let elsewhere = self.runs().iter().filter(|run| run.elsewhere).count();
        let (before, name, after) = match self {
            Self::Run(run, is_below) => {
                let changed = if changed > 0 { " (changed)" } else { "" };
                let place = if elsewhere > 0 { " (elsewhere)" } else { "" };
                let seed = run.given_name().filter(|_| *is_below).map(|_| format!(", seed {}", run.config.seed));
                let name = self.name(several_tasks) + &seed.unwrap_or_default();
                (if *is_below { "  " } else { "" }, name, [changed, place].concat())
            }
            Self::Group(_, runs, _) => {
                let some = |count, word| match count {
                    0 => String::new(),
                    all if all == runs.len() => format!(", {word}"),
                    _ => format!(", {count} {word}"),
                };
                let some = some(changed, "changed") + &some(elsewhere, "elsewhere");
                ("", self.name(several_tasks), format!(" ({}{some})", runs.len()))
            }
        };
        let room = columns.saturating_sub(before.len() + after.len());
        format!("{before}{}{after}", shortened_label(&name, labels, room))
    }

    /// Episodes done and episodes in all.
    pub fn progress(&self) -> [u64; 2] {
        self.runs().iter().fold([0, 0], |[done, all], run| [done + run.done, all + run.episodes()])
    }

    /// Success rate; a group's is the interquartile mean, if all its runs are listed.
    pub fn success(&self) -> Option<f64> {
        match self {
            Self::Run(run, _) => run.success,
            Self::Group(_, runs, 0) => scores_of(runs).map(|scores| iqm(&scores)),
            Self::Group(..) => None,
        }
    }

    /// Episodes a second: of its runs that are being trained together, or of a single run on the whole.
    pub fn speed(&self) -> Option<f64> {
        if let Self::Run(run, _) = self { run.speed() } else { self.together(RunSummary::rate) }
    }

    /// The sum over its runs that are being trained; those of which it is not known yet count as the others do.
    fn together(&self, speed: fn(&RunSummary) -> Option<f64>) -> Option<f64> {
        let running = self.runs().into_iter().filter(|run| run.state == RunState::Running);
        let speeds: Vec<Option<f64>> = running.map(speed).collect();
        let known = speeds.iter().flatten().count();
        (known > 0).then(|| speeds.iter().flatten().sum::<f64>() * speeds.len() as f64 / known as f64)
    }

    /// Seconds until all its runs that are being trained or wait for it are finished, at the pace of the former together.
    pub fn seconds_left(&self) -> Option<f64> {
        let left = |run: &RunSummary| run.episodes().saturating_sub(run.done) as f64;
        let waits = |run: &&RunSummary| run.queued || run.state == RunState::Running;
        Some(self.runs().into_iter().filter(waits).map(left).sum::<f64>() / self.together(RunSummary::pace)?)
    }

    /// The most urgent state of its runs with the number of runs in it, and its style.
    pub fn state(&self, theme: &Theme) -> (String, Style) {
        let runs = self.runs();
        let style = |run: &RunSummary| Style::new().fg(state_colour(&run.state, theme));
        if let [run] = runs.as_slice() {
            return (run.state_word().to_owned(), style(run));
        }
        let first = self.foremost();
        let mut count = runs.iter().filter(|run| run.state_word() == first.state_word()).count().to_string();
        if runs.iter().any(|run| run.state == RunState::Paused) && first.state == RunState::Running {
            count += &format!(" of {}", runs.len());
        }
        (format!("{count} {}", first.state_word()), style(first))
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
