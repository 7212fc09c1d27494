//! The Runs screen: past and running runs, in groups of those that differ in the seed only. Actions apply to all
//! marked runs, or else to the selected run or group.

mod actions;
mod bulk;
mod columns;
mod filter;
mod line;
mod list;
mod preview;

use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use ratatui::prelude::*;

use super::pane::{self, hint, pane};
use super::{HitRegions, Ui};
use crate::tui::view::{RunGroup, RunSummary, ViewModel, scores_of};
pub use actions::{
    SINGLE, ask_for_columns, ask_for_filter, compare, edit_note, evaluate, fold, fork, mark, on_line, rename, watch,
};
pub use bulk::{delete, go_on, pause, stop};
use filter::Filter;
use line::{Line, LineKey};
use mge_base::text::printable;
use mge_stats::Bootstrap;
use mge_stats::aggregate::iqm;
use mge_task as task;
use mge_trainer::{RunConfig, config_keys};

/// State of the list of runs.
#[derive(Debug, Default)]
pub struct Runs {
    /// The selected line, and its row when it was selected; lines may have been inserted above it since.
    selected: Option<LineKey>,
    row: usize,
    filter: Filter,
    /// The highest success comes first, not the latest run.
    pub by_success: bool,
    /// The columns that are shown; those that fit if it is empty.
    pub columns: Vec<String>,
    /// The preview leaves out the curves.
    pub whole: bool,
    /// Runs whose group is shown with its runs one by one.
    unfolded: HashSet<PathBuf>,
    marked: HashSet<PathBuf>,
    /// The page of the settings in which two marked runs differ, counted on beyond the last one, until the marks change.
    pub page: usize,
}

/// Width from which a preview fits beside the list.
const BESIDE: u16 = 110;
/// Lines above and below the selected one whose curves are read.
const AROUND: usize = 60;

/// The settings of runs of this version.
static SETTINGS: LazyLock<Vec<String>> =
    LazyLock::new(|| config_keys(&RunConfig::new(Arc::new(task::shipped().swap_remove(0)))));

impl Runs {
    /// The row of the selected line. If it no longer exists, the other line with its run: a group that it has joined, or
    /// what is left of a group; else the row where it was or the last one.
    fn selected_row(&self, lines: &[Line]) -> usize {
        let row_of = |(is_group, run): &LineKey| {
            let row = |is_group: bool| lines.iter().position(|line| line.group.is_some() == is_group && line.has(run));
            row(*is_group).or_else(|| row(!is_group))
        };
        let known = self.selected.as_ref().and_then(row_of);
        known.unwrap_or(self.row.min(lines.len().saturating_sub(1)))
    }

    /// Whether the run is marked.
    pub fn is_marked(&self, run: &RunSummary) -> bool {
        self.marked.contains(&run.path)
    }

    /// The marked runs.
    pub fn marked<'a>(&self, view: &'a ViewModel) -> Vec<&'a RunSummary> {
        view.runs.iter().map(|run| &**run).filter(|run| self.is_marked(run)).collect()
    }

    /// Selects the line of a run, also one that is not listed yet, or of its group, unless it is to be `alone`.
    pub fn follow(&mut self, run: &Path, alone: bool) {
        self.unfolded.extend(alone.then(|| run.to_owned()));
        self.selected = Some((false, run.to_owned()));
    }

    /// Ends the filter, or else removes all marks; false if there is neither.
    pub fn leave(&mut self) -> bool {
        if !self.filter.text.is_empty() {
            self.filter = Filter::default();
            return true;
        }
        self.page = 0;
        !std::mem::take(&mut self.marked).is_empty()
    }

    fn select_of(&mut self, lines: &[Line], row: usize) {
        (self.selected, self.row) = (lines.get(row).map(Line::key), row);
    }

    /// Selects the line that `line` returns for the rows of the selected and the last one.
    pub fn select_line(&mut self, ui: &Ui, line: impl Fn(usize, usize) -> usize) {
        let lines = list::lines(self, ui);
        self.select_of(&lines, line(self.selected_row(&lines), lines.len().saturating_sub(1)));
    }

    /// Whether the line in a row of the list is the selected one.
    pub fn is_selected(&self, ui: &Ui, row: usize) -> bool {
        self.selected_row(&list::lines(self, ui)) == row
    }

    /// The runs that actions apply to: the marked ones, or else those of the selected line.
    pub fn acted_on<'a>(&self, ui: &Ui<'a>) -> Vec<&'a RunSummary> {
        let marked = self.marked(ui.view);
        if !marked.is_empty() {
            return marked;
        }
        let lines = list::lines(self, ui);
        lines.get(self.selected_row(&lines)).map_or_else(Vec::new, |line| line.runs.clone())
    }
}

/// Folders of the runs whose curves are needed, those of the selected line first.
pub fn wanted(state: &Runs, ui: &Ui) -> Vec<PathBuf> {
    let lines = list::lines(state, ui);
    let selected = state.selected_row(&lines);
    let around = selected.saturating_sub(AROUND)..lines.len().min(selected + AROUND);
    let shown = lines.get(selected).into_iter().chain(&lines[around]).flat_map(|line| &line.runs).copied();
    let all = ui.view.runs.iter().map(|run| &**run).filter(|_| state.filter.needs_curves());
    let mut known = HashSet::new();
    shown.chain(all).filter(|run| known.insert(&run.path)).map(|run| run.path.clone()).collect()
}

/// Draws the screen.
pub fn draw(state: &Runs, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let lines = list::lines(state, ui);
    let selected = state.selected_row(&lines);
    let mut area = area;
    // Details in the preview beside the list are not repeated below it.
    let mut details = lines.get(selected).map_or_else(String::new, |line| about(line, ui));
    if let Some(line) = lines.get(selected).filter(|_| area.width >= BESIDE) {
        let share = Constraint::Percentage(62);
        let [left, right] = Layout::horizontal([share, Constraint::Fill(1)]).areas(area);
        preview::draw(ui, line, &details, state.whole, right, buffer);
        details.clear();
        area = left;
    } else if let Some(line) = lines.get(selected).filter(|line| !line.note().is_empty()) {
        details = format!("{details}; note: {}", printable(line.note()));
    }
    let inside = pane(&title(state, ui), area, ui.theme, buffer);
    if lines.is_empty() {
        return hint(&ui.text(nothing(state, ui.view)), inside, ui.theme, buffer);
    }
    let details = Text::from_iter(pane::lines(&details, inside.width, Style::new()));
    let height = Constraint::Length((details.height() as u16).min(inside.height / 3));
    let [rows, below] = Layout::vertical([Constraint::Fill(1), height]).areas(inside);
    details.render(below, buffer);
    list::draw(state, &lines, selected, ui, rows, buffer, regions);
}

fn title(state: &Runs, ui: &Ui) -> String {
    let marked = state.marked(ui.view).len();
    let is_unread = |run: &&Arc<RunSummary>| run.done > 0 && run.curves.last_episode() == 0;
    let unread = ui.view.runs.iter().filter(|_| state.filter.needs_curves()).filter(is_unread).count();
    let forking = ui.view.forking.as_ref().map(|(command, share)| {
        let share = share.map_or_else(String::new, |share| format!(", {:.0} %", 100.0 * share));
        format!("making `{command}`{share}")
    });
    let (damaged, left) = (ui.view.damaged.len(), ui.view.runs_unread);
    let parts = [
        Some(format!("runs in {}", ui.view.folder.display())),
        (marked > 0).then(|| format!("{marked} marked")),
        (!state.filter.text.is_empty()).then(|| format!("with `{}`, esc shows all", state.filter.text)),
        (unread > 0).then(|| format!("not known of {unread}, whose logs are not read")),
        state.by_success.then(|| "by success".to_owned()),
        forking,
        (damaged > 0).then(|| ui.text(&format!("{damaged} damaged: {{screen-log}} tells why"))),
        (left > 0 && !ui.view.runs.is_empty()).then(|| format!("{left} more are being read")),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" · ")
}

fn nothing(state: &Runs, view: &ViewModel) -> &'static str {
    if view.runs_unread > 0 {
        "The runs in this folder are being read."
    } else if state.filter.text.is_empty() {
        "There are no runs in this folder yet. {train} trains one; {open-run} opens one from elsewhere."
    } else {
        "No run matches this filter. Escape shows all."
    }
}

/// What the marks and columns of the list mean.
pub const EXPLANATION: &str = "> watched, * marked; success: latest episodes (groups: interquartile mean)";

/// A summary of a line.
fn about(line: &Line, ui: &Ui) -> String {
    let text = match line.group {
        None => about_run(line.runs[0]),
        Some(group) => about_group(group, &line.runs, line.hidden),
    };
    [vec![text], columns::costs(line, ui)].concat().join("; ")
}

fn about_run(run: &RunSummary) -> String {
    let reason = run.state.reason().map_or_else(String::new, |reason| format!(": {reason}"));
    let done = format!("{} of {} episodes", run.done, run.episodes());
    let fork = run.config.fork.as_ref().map_or_else(String::new, |fork| format!(", {fork}"));
    let changed = run.changed.as_ref().map_or_else(String::new, |change| format!("; at {change}"));
    let state = run.state_word();
    let work = run.preparing.as_ref().map_or_else(String::new, |work| format!(": {work}"));
    let (tasks, method, seed) = (&run.config.task.name, run.config.method.name(), run.config.seed);
    let is_plain = run.name == run.folder() && !run.elsewhere;
    let folder = if is_plain { String::new() } else { format!(" ({})", run.path.display()) };
    format!("{}{folder}: {tasks}, {method}, seed {seed}, {done}, {state}{work}{reason}{fork}{changed}", run.name)
}

fn about_group(group: &RunGroup, runs: &[&RunSummary], hidden: usize) -> String {
    // The runs are ordered by seed.
    let mut seeds: Vec<String> = runs.iter().map(|run| run.config.seed.to_string()).collect();
    seeds.dedup();
    let word = if seeds.len() == 1 { "seed" } else { "seeds" };
    let label = if group.name == group.label { String::new() } else { format!(" ({})", group.label) };
    let mut text = format!("{}{label} on {}, {word} {}", group.name, group.task, seeds.join(", "));
    let changed: Vec<&str> = runs.iter().filter(|run| run.changed.is_some()).map(|run| &*run.name).collect();
    if !changed.is_empty() {
        text = format!("{text}, changed: {}", changed.join(", "));
    }
    let count = |word: &&str| runs.iter().filter(|run| run.state_word() == *word).count();
    let states = BTreeSet::from_iter(runs.iter().map(|run| run.state_word()));
    if states.len() > 1 {
        let states: Vec<String> = states.iter().map(|word| format!("{} {word}", count(word))).collect();
        text = format!("{text}; {}", states.join(", "));
    }
    if runs.len() > seeds.len() {
        text = format!("{text} in {} runs, of which the longest of each seed counts", runs.len());
    }
    if hidden > 0 {
        return format!("{text}: {hidden} of its {} runs are not listed", runs.len() + hidden);
    }
    let success = scores_of(runs).and_then(|scores| Bootstrap::default().stratified(&scores, iqm).ok());
    if let Some(success) = success {
        let [value, lower, upper] = success.values().map(|share| 100.0 * share);
        text = format!("{text}: success {value:.0} %");
        if success.has_interval() {
            text = format!("{text} (interquartile mean, 95 % interval {lower:.0} to {upper:.0} %)");
        }
        let furthest = runs.iter().map(|run| run.done).max();
        let ended: Vec<bool> =
            runs.iter().filter(|run| Some(run.done) != furthest).map(|run| run.is_solved()).collect();
        if ended.contains(&true) {
            text += "; those that their success ended keep their last value";
        }
        if ended.contains(&false) {
            let end = group.curves.as_ref().map_or(0, |curves| curves.middle.last_episode());
            text += &format!("; the curves, with their values, end at episode {end}, which half of them have reached");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::tui::testing::grouped;
    use crate::tui::view::Grouping;

    /// The description of three runs in a row, one of the groups of the view.
    fn about_three(view: &mut ViewModel, first: usize) -> String {
        view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
        let runs: Vec<&RunSummary> = view.runs[first..first + 3].iter().map(|run| &**run).collect();
        about_group(view.groups.of(&runs[0].path).unwrap(), &runs, 0)
    }

    #[test]
    fn a_group_is_described_with_its_seeds_and_success() {
        let mut view = grouped();
        for run in &mut view.runs[..3] {
            Arc::make_mut(run).done = 0;
        }
        let about = about_three(&mut view, 0);
        assert!(about.ends_with("on task1, seeds 0, 1, 2"), "none of its runs has begun: {about}");
        view.runs.drain(..3);
        let about = about_three(&mut view, 0);
        assert!(
            about.contains("to 25 %); the curves, with their values, end at episode"),
            "there is no other group: {about}"
        );
        let config = view.runs[0].config.clone();
        for run in &mut view.runs {
            Arc::make_mut(run).config = config.clone();
        }
        let about = about_three(&mut view, 0);
        let expected = "seed 0 in 3 runs, of which the longest of each seed counts: success 25 %";
        assert!(about.contains(expected), "{about}");
        let runs = [&*view.runs[0], &*view.runs[1]];
        let about = about_group(view.groups.of(&runs[0].path).unwrap(), &runs, 1);
        assert!(about.ends_with("1 of its 3 runs are not listed"), "not the success of all of them: {about}");
        for run in &mut view.runs {
            Arc::make_mut(&mut Arc::make_mut(run).config).stop.success = Some(0.1);
        }
        let about = about_three(&mut view, 0);
        assert!(about.ends_with("; those that their success ended keep their last value"), "{about}");
    }
}
