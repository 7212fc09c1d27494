//! The Runs screen: past and running runs, in groups of those that differ in the seed only. Actions apply to all
//! marked runs, or else to the selected run or group.

mod bulk;
mod columns;
mod filter;
mod line;
mod list;
mod preview;

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::Widget;

use super::curves::CurvesState;
use super::pane::{self, hint, pane, system_line};
use super::{HitRegions, Ui};
use crate::tui::actions::UiAction;
use crate::tui::effect::Effect;
use crate::tui::layers::Prompt;
use crate::tui::view::{Level, RunGroup, RunSummary, ViewModel};
pub use bulk::stop;
use columns::Column;
use filter::Filter;
use line::{Line, LineKey};
use list::Sort;
use mge_base::paths::expanded;
use mge_run::RunState;
use mge_task as task;
use mge_trainer::{RunConfig, config_keys};
use mge_workbench::command;

/// State of the list of runs.
#[derive(Debug, Default)]
pub struct Runs {
    /// The selected line, and its row when it was selected; lines may have been inserted above it since.
    selected: Option<LineKey>,
    row: usize,
    filter: Filter,
    sort: Sort,
    reversed: bool,
    /// Groups whose runs are shown one by one.
    unfolded: HashSet<LineKey>,
    marked: HashSet<PathBuf>,
    /// The chosen columns; None for the default ones.
    columns: Option<Vec<Column>>,
    since_look: Duration,
}

/// Interval between scans of the folder of runs, which other processes may change, too.
const SCAN_INTERVAL: Duration = Duration::from_secs(2);
/// Width from which a preview fits beside the list.
const BESIDE: u16 = 110;
/// Lines above and below the selected one whose curves are read.
const AROUND: usize = 60;

/// Whether a column or a condition may name it as a setting: `tools`, or a JSON path such as `ddpg.gamma`, which may be
/// of a run of another version.
fn is_setting(name: &str) -> bool {
    static NAMES: LazyLock<Vec<String>> =
        LazyLock::new(|| config_keys(&RunConfig::new(Arc::new(task::shipped().swap_remove(0)))));
    name.contains('.') || NAMES.iter().any(|known| known == name)
}

impl Runs {
    /// Advances time; true when the folder should be scanned again. Then also removes the marks of runs that no longer
    /// exist.
    pub fn is_scan_due(&mut self, elapsed: Duration, view: &ViewModel) -> bool {
        self.since_look += elapsed;
        let due = self.since_look >= SCAN_INTERVAL;
        if due {
            self.since_look = Duration::ZERO;
            let known: HashSet<&PathBuf> = view.runs.iter().map(|run| &run.path).collect();
            self.marked.retain(|path| known.contains(path));
        }
        due
    }

    /// Lists only the runs that a filter accepts.
    ///
    /// # Errors
    /// What is wrong with the filter.
    pub fn filter(&mut self, text: &str) -> Result<(), String> {
        self.filter = Filter::parse(text)?;
        (self.selected, self.row) = (None, 0);
        Ok(())
    }

    /// Shows these columns.
    ///
    /// # Errors
    /// The first word that is not a column.
    pub fn show_columns(&mut self, text: &str) -> Result<(), String> {
        self.columns = columns::parse(text)?;
        Ok(())
    }

    /// The row of the selected line; if it no longer exists, the row where it was or the last one.
    fn selected_row(&self, lines: &[Line]) -> usize {
        let known = self.selected.as_ref().and_then(|key| lines.iter().position(|line| line.key() == *key));
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

    /// Ends the filter, or else removes all marks; false if there is neither.
    pub fn leave(&mut self) -> bool {
        if !self.filter.is_empty() {
            self.filter = Filter::default();
            return true;
        }
        !std::mem::take(&mut self.marked).is_empty()
    }

    /// Selects the line in a row of the list.
    pub fn select(&mut self, ui: &Ui, row: usize) {
        self.select_of(&list::lines(self, ui), row);
    }

    fn select_of(&mut self, lines: &[Line], row: usize) {
        (self.selected, self.row) = (lines.get(row).map(Line::key), row);
    }

    /// Whether the line in a row of the list is the selected one.
    pub fn is_selected(&self, ui: &Ui, row: usize) -> bool {
        self.selected_row(&list::lines(self, ui)) == row
    }

    /// The runs that actions apply to: the marked ones, or else those of the selected line.
    fn acted_on<'a>(&self, ui: &Ui<'a>) -> Vec<&'a RunSummary> {
        let marked = self.marked(ui.view);
        if !marked.is_empty() {
            return marked;
        }
        let lines = list::lines(self, ui);
        lines.get(self.selected_row(&lines)).map_or_else(Vec::new, Line::runs)
    }
}

/// Folders of the runs whose curves are needed, those of the selected line first; and the folder whose files are
/// needed, if a single run is selected.
pub fn wanted(state: &Runs, ui: &Ui) -> (Vec<PathBuf>, Option<PathBuf>) {
    let lines = list::lines(state, ui);
    let selected = state.selected_row(&lines);
    let around = selected.saturating_sub(AROUND)..lines.len().min(selected + AROUND);
    let shown = lines.get(selected).into_iter().chain(&lines[around]);
    let mut known = HashSet::new();
    let wanted = shown.flat_map(Line::runs).filter(|run| known.insert(&run.path)).map(|run| run.path.clone()).collect();
    let previewed = match lines.get(selected) {
        Some(Line::Run(run, _)) => Some(run.path.clone()),
        _ => None,
    };
    (wanted, previewed)
}

/// Draws the screen.
pub fn draw(state: &Runs, curves: &CurvesState, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let lines = list::lines(state, ui);
    let selected = state.selected_row(&lines);
    let mut area = area;
    // Details in the preview beside the list are not repeated below it.
    let mut details = lines.get(selected).map_or_else(String::new, about);
    if let Some(line) = lines.get(selected).filter(|_| area.width >= BESIDE) {
        let share = Constraint::Percentage(58);
        let [left, right] = Layout::horizontal([share, Constraint::Fill(1)]).areas(area);
        preview::draw(ui, curves, line, &details, right, buffer);
        details.clear();
        area = left;
    }
    let is_reading = ui.view.runs_unread > 0 && !ui.view.runs.is_empty();
    let inside = pane(&title(state, ui, is_reading), area, ui.theme, buffer);
    system_line(ui.view, area, ui.theme, buffer);
    if lines.is_empty() {
        return hint(&ui.text(nothing(state, ui.view)), inside, ui.theme, buffer);
    }
    let details = match details.is_empty() {
        true => Text::default(),
        false => Text::from_iter(pane::lines(&details, inside.width, Style::new())),
    };
    let height = (details.height() as u16).min(inside.height / 3);
    let room = inside.height - height;
    // The curve gets the rows that the list does not need, at most half of all.
    let curve = room.saturating_sub(lines.len() as u16 + 1).min(room / 2);
    let curve = if curve >= preview::CHART { curve } else { 0 };
    let heights = [Constraint::Fill(1), Constraint::Length(curve), Constraint::Length(height)];
    let [rows, middle, below] = Layout::vertical(heights).areas(inside);
    if let Some(line) = lines.get(selected).filter(|_| curve > 0) {
        // The preview, if it is shown, already has the curve of the line.
        match height > 0 {
            true => preview::chart(ui, curves, line, middle, buffer),
            false => preview::comparison(ui, curves, &lines, line, middle, buffer),
        }
    }
    details.render(below, buffer);
    list::draw(state, &lines, selected, ui, rows, buffer, regions);
}

fn title(state: &Runs, ui: &Ui, is_reading: bool) -> String {
    let mut title = format!("runs in {}", ui.view.folder.display());
    if !state.marked.is_empty() {
        title = format!("{title} · {} marked", state.marked.len());
    }
    if !state.filter.is_empty() {
        title = format!("{title} · with `{}`, esc shows all", state.filter.text());
    }
    if state.sort != Sort::Latest || state.reversed {
        let order = if state.reversed { ", reversed" } else { "" };
        title = format!("{title} · by {}{order}", state.sort.name());
    }
    if ui.view.runs_damaged > 0 {
        title = format!("{title} · {} damaged: {}", ui.view.runs_damaged, ui.text("{screen-log} tells why"));
    }
    if is_reading {
        title = format!("{title} · {} more are being read", ui.view.runs_unread);
    }
    title
}

fn nothing(state: &Runs, view: &ViewModel) -> &'static str {
    if view.runs_unread > 0 {
        "The runs in this folder are being read."
    } else if state.filter.is_empty() {
        "There are no runs in this folder yet. {train} trains one; {open-run} opens one from elsewhere."
    } else {
        "No run matches this filter. Escape shows all."
    }
}

/// A summary of a line.
fn about(line: &Line) -> String {
    match line {
        Line::Run(run, _) => about_run(run),
        Line::Group(group, runs) => about_group(group, runs),
    }
}

fn about_run(run: &RunSummary) -> String {
    let reason = match &run.state {
        RunState::Failed(reason) | RunState::Stopped(reason) | RunState::Incomplete(reason) => format!(": {reason}"),
        _ => String::new(),
    };
    let done = format!("{} of {} episodes", run.done, run.episodes());
    let fork = run.config.fork.as_ref().map_or_else(String::new, |fork| format!(", {fork}"));
    let state = run.state_word();
    let work = run.preparing.as_ref().map_or_else(String::new, |work| format!(": {work}"));
    let (tasks, method, seed) = (run.tasks_in_words(), run.config.method.name(), run.config.seed);
    format!("{}: {tasks}, {method}, seed {seed}, {done}, {state}{work}{reason}{fork}", run.name)
}

fn about_group(group: &RunGroup, runs: &[&RunSummary]) -> String {
    // The runs are ordered by seed.
    let mut seeds: Vec<String> = runs.iter().map(|run| run.config.seed.to_string()).collect();
    seeds.dedup();
    let word = if seeds.len() == 1 { "seed" } else { "seeds" };
    let mut text = format!("{} on {}, {word} {}", group.label, group.task, seeds.join(", "));
    if runs.len() > seeds.len() {
        text = format!("{text} in {} runs, of which the longest of each seed counts", runs.len());
    }
    if let Some(success) = group.success {
        let [value, lower, upper] = success.values().map(|share| 100.0 * share);
        text = format!("{text}: success {value:.0} %");
        if group.seeds() > 1 {
            text = format!("{text} (interquartile mean, 95 % interval {lower:.0} to {upper:.0} %)");
        }
    }
    match group.improvement {
        Some(improvement) => {
            let [value, lower, upper] = improvement.values().map(|share| 100.0 * share);
            format!("{text}, above the baseline with probability {value:.0} % ({lower:.0} to {upper:.0} %)")
        }
        None if group.is_baseline => format!("{text}, the baseline of the others"),
        None => text,
    }
}

/// What an action does on this screen.
pub fn perform(state: &mut Runs, ui: &Ui, action: UiAction) -> Vec<Effect> {
    let lines = list::lines(state, ui);
    let selected = state.selected_row(&lines);
    if let Some(row) = action.line(selected, lines.len().saturating_sub(1)) {
        state.select_of(&lines, row);
        return Vec::new();
    }
    match action {
        UiAction::Filter => {
            let read = |text: &str| Ok(Effect::Filter(text.to_owned()));
            let hint = "words, task:4 method:ddpg-mge state:running tag:paper epsilon<0.2 success>=0.5 seed=3";
            return vec![Effect::open(Prompt::new("show runs with", hint, state.filter.text(), read))];
        }
        UiAction::Columns => {
            let read = |text: &str| Ok(Effect::Columns(text.to_owned()));
            let now = state.columns.clone().unwrap_or_else(columns::defaults);
            let now: Vec<String> = now.into_iter().map(|column| column.heading).collect();
            let hint = format!(
                "{}, or settings in which runs differ, such as ddpg.gamma; none for the default ones",
                columns::names()
            );
            return vec![Effect::open(Prompt::new("columns", hint, now.join(" "), read))];
        }
        UiAction::OpenRun => {
            let read = |path: &str| Ok(Effect::apply(command::Open(expanded(path))));
            return vec![Effect::open(Prompt::new("open a run", "path of its folder", "", read))];
        }
        UiAction::Sort => {
            let place = Sort::ALL.iter().position(|sort| *sort == state.sort).unwrap_or(0);
            state.sort = Sort::ALL[(place + 1) % Sort::ALL.len()];
            return vec![Effect::info(format!("sorted by {}", state.sort.name()))];
        }
        UiAction::Reverse => {
            state.reversed = !state.reversed;
            return Vec::new();
        }
        _ => {}
    }
    let Some(line) = lines.get(selected) else { return vec![Effect::info("there is no run in the list")] };
    match action {
        UiAction::Confirm => watch(line, ui),
        UiAction::Fold => fold(state, &lines, line, ui),
        UiAction::Mark => mark(state, line, ui),
        UiAction::PinBaseline => match line {
            Line::Group(group, _) => vec![Effect::PinBaseline(group.label.clone())],
            Line::Run(run, _) => match ui.view.groups.of(&run.path) {
                Some(group) => vec![Effect::PinBaseline(group.label.clone())],
                None => vec![Effect::info("the runs are still being grouped")],
            },
        },
        UiAction::Evaluate => match line.runs().as_slice() {
            [run] => vec![Effect::apply(command::Open(run.path.clone())), Effect::apply(command::Evaluate)],
            _ => {
                vec![Effect::info(ui.text("only a single run can be evaluated: {fold-group} shows those of the group"))]
            }
        },
        UiAction::Compare => {
            if state.marked.is_empty() {
                state.marked.extend(line.runs().iter().map(|run| run.path.clone()));
            }
            compare_marked(state, ui)
        }
        UiAction::Fork => match line.runs().as_slice() {
            [run] => vec![Effect::apply(command::Open(run.path.clone())), ask_to_fork(run, run.done)],
            _ => vec![Effect::info(ui.text("only a single run can be forked: {fold-group} shows those of the group"))],
        },
        UiAction::EditNote => edit_note(line.runs()[0]),
        UiAction::EditTags => edit_tags(&state.acted_on(ui)),
        _ => bulk::act_on_all(&state.acted_on(ui), ui, action),
    }
}

/// Shows the marked runs together. If there are two, one is watched, to show its episodes beside the other's.
fn compare_marked(state: &Runs, ui: &Ui) -> Vec<Effect> {
    let marked = state.acted_on(ui);
    let watch = match marked.as_slice() {
        [first, second] if !ui.is_watched(first) && !ui.is_watched(second) => Some(first.path.clone()),
        _ => None,
    };
    watch.map(|path| Effect::apply(command::Open(path))).into_iter().chain([Effect::Compare]).collect()
}

/// Watches a run, or the first of a group, and reports where it is shown.
fn watch(line: &Line, ui: &Ui) -> Vec<Effect> {
    let run = line.runs()[0];
    let places = ui.text(
        "{screen-training} shows its curves, {screen-scene} its episodes ({previous-episode} and {next-episode})",
    );
    let text = format!("watching {}: {places}", run.name);
    vec![Effect::apply(command::Open(run.path.clone())), Effect::ShowMessage(Level::Good, text)]
}

/// Unfolds or folds a group: that of the selected line, or the one that its run belongs to.
fn fold(state: &mut Runs, lines: &[Line], line: &Line, ui: &Ui) -> Vec<Effect> {
    let key = match line {
        Line::Group(..) => Some(line.key()),
        Line::Run(run, _) => {
            let group = ui.view.groups.of(&run.path);
            group.map(|group| LineKey::Group(group.task.clone(), group.label.clone()))
        }
    };
    let Some((row, key)) = key.and_then(|key| Some((lines.iter().position(|line| line.key() == key)?, key))) else {
        return vec![Effect::info("a group of runs that differ in the seed only can be folded")];
    };
    if !state.unfolded.remove(&key) {
        state.unfolded.insert(key);
    }
    state.select_of(lines, row);
    Vec::new()
}

/// Marks or unmarks the runs of a line.
fn mark(state: &mut Runs, line: &Line, ui: &Ui) -> Vec<Effect> {
    let runs = line.runs();
    if runs.iter().all(|run| state.is_marked(run)) {
        runs.iter().for_each(|run| _ = state.marked.remove(&run.path));
        return Vec::new();
    }
    state.marked.extend(runs.iter().map(|run| run.path.clone()));
    let together = ui.text("actions apply to all of them; {compare-runs} shows their curves together");
    vec![Effect::info(format!("{} marked: {together}", state.marked.len()))]
}

/// Asks at which episode, and with what changes, a run is forked.
pub fn ask_to_fork(run: &RunSummary, episode: u64) -> Effect {
    let hint = "the episode, and what to change there: epsilon=0.1 ddpg.gamma=0.95 episodes=4000; task=edited takes \
                the task as it is edited";
    Effect::open(Prompt::arguments("fork", format!("fork {}", run.name), hint, format!("{episode} ")))
}

fn edit_note(run: &RunSummary) -> Vec<Effect> {
    let folder = run.path.clone();
    let read = move |text: &str| Ok(Effect::apply(command::Note { folder: folder.clone(), text: text.to_owned() }));
    vec![Effect::open(Prompt::new(format!("note on {}", run.name), "kept in the run's folder", run.note.clone(), read))]
}

fn edit_tags(runs: &[&RunSummary]) -> Vec<Effect> {
    let folders: Vec<PathBuf> = runs.iter().map(|run| run.path.clone()).collect();
    let read = move |text: &str| {
        let tags: Vec<String> = text.split([' ', ',']).filter(|tag| !tag.is_empty()).map(str::to_owned).collect();
        let tag = |folder: &PathBuf| Effect::apply(command::Tag { folder: folder.clone(), tags: tags.clone() });
        Ok(Effect::All(folders.iter().map(tag).collect()))
    };
    let title = if let [run] = runs { format!("tags of {}", run.name) } else { format!("tags of {} runs", runs.len()) };
    let on_all = |tag: &&String| runs.iter().all(|run| run.tags.contains(tag));
    let now: Vec<&str> =
        runs.first().map_or(&[][..], |run| &run.tags).iter().filter(on_all).map(String::as_str).collect();
    let hint = "words with spaces between them; the filter finds tag:WORD";
    vec![Effect::open(Prompt::new(title, hint, now.join(" "), read))]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::tui::testing::grouped;
    use crate::tui::view::Grouping;

    /// The description of three runs in a row, one of the groups of the view.
    fn about_three(view: &mut ViewModel, first: usize) -> String {
        view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default(), None));
        let runs: Vec<&RunSummary> = view.runs[first..first + 3].iter().map(|run| &**run).collect();
        about_group(view.groups.of(&runs[0].path).unwrap(), &runs)
    }

    #[test]
    fn marks_of_vanished_runs_are_removed() {
        let mut view = grouped();
        let mut state = Runs { marked: view.runs[..2].iter().map(|run| run.path.clone()).collect(), ..Runs::default() };
        let vanished = view.runs.remove(0);
        assert!(state.is_scan_due(SCAN_INTERVAL, &view));
        assert!(!state.is_marked(&vanished) && state.is_marked(&view.runs[0]));
    }

    #[test]
    fn a_group_is_described_with_its_probability_to_be_above_the_baseline() {
        let mut view = grouped();
        Arc::make_mut(&mut view.runs[0]).success = Some(0.0);
        let about = about_three(&mut view, 0);
        assert!(about.contains("above the baseline with probability 67 %"), "{about}");
        let about = about_three(&mut view, 3);
        assert!(about.ends_with("the baseline of the others"), "{about}");
        for run in &mut view.runs[..3] {
            Arc::make_mut(run).done = 0;
        }
        let about = about_three(&mut view, 0);
        assert!(about.ends_with("on task1, seeds 0, 1, 2"), "none of its runs has begun: {about}");
        view.runs.drain(..3);
        let about = about_three(&mut view, 0);
        assert!(about.ends_with("to 25 %)"), "there is no other group: {about}");
        let config = view.runs[0].config.clone();
        for run in &mut view.runs {
            Arc::make_mut(run).config = config.clone();
        }
        let about = about_three(&mut view, 0);
        let expected = "seed 0 in 3 runs, of which the longest of each seed counts: success 25 %";
        assert!(about.ends_with(expected), "{about}");
    }
}
