//! The Runs screen: past and running runs.

use std::collections::HashSet;
use std::path::PathBuf;
use std::time::Duration;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::pane::{hint, pane};
use super::status::{bar, state_colour};
use super::{HitRegions, Ui};
use crate::run::RunState;
use crate::tui::actions::{Action, Context};
use crate::tui::effect::Effect;
use crate::tui::layers::{Confirm, Layer, Prompt};
use crate::tui::view::{Level, RunSummary, ViewModel, span};
use crate::tui::widgets::columns::{self, shortened};
use crate::workbench::command;

/// State of the list of runs.
#[derive(Debug, Default)]
pub struct Runs {
    /// The selected run, and where it was in the list; another may have come before it since.
    selected: Option<PathBuf>,
    row: usize,
    filter: String,
    marked: HashSet<PathBuf>,
    since_look: Duration,
}

/// Time between two looks at the folder of runs, where others may be at work, too.
const LOOK: Duration = Duration::from_secs(2);

impl Runs {
    /// Lets time pass; true when the folder should be looked at again.
    pub fn is_time_to_look(&mut self, elapsed: Duration) -> bool {
        self.since_look += elapsed;
        let due = self.since_look >= LOOK;
        if due {
            self.since_look = Duration::ZERO;
        }
        due
    }

    /// Shows only runs whose line has this text.
    pub fn filter(&mut self, text: String) {
        self.filter = text;
        (self.selected, self.row) = (None, 0);
    }

    /// The row of the selected run among those shown; near where it was if it is gone.
    fn selected_row(&self, runs: &[&RunSummary]) -> usize {
        let known = self.selected.as_ref().and_then(|path| runs.iter().position(|run| run.path == *path));
        known.unwrap_or(self.row.min(runs.len().saturating_sub(1)))
    }

    /// Whether the run is marked for comparing.
    pub fn is_marked(&self, run: &RunSummary) -> bool {
        self.marked.contains(&run.path)
    }

    /// Ends the filter; false if there is none.
    pub fn leave(&mut self) -> bool {
        !std::mem::take(&mut self.filter).is_empty()
    }

    /// The runs in the list, the latest first.
    fn listed<'a>(&self, view: &'a ViewModel) -> Vec<&'a RunSummary> {
        let filter = self.filter.to_lowercase();
        let matches = |run: &&RunSummary| filter.is_empty() || words(run).to_lowercase().contains(&filter);
        view.runs.iter().rev().map(|run| &**run).filter(matches).collect()
    }

    /// Selects the run in a row of the list.
    pub fn select(&mut self, view: &ViewModel, row: usize) {
        let path = self.listed(view).get(row).map(|run| run.path.clone());
        (self.selected, self.row) = (path, row);
    }

    /// Whether the run in a row of the list is the selected one.
    pub fn is_selected(&self, view: &ViewModel, row: usize) -> bool {
        let runs = self.listed(view);
        row < runs.len() && self.selected_row(&runs) == row
    }
}

fn words(run: &RunSummary) -> String {
    format!("{} {} {} seed {} {}", run.name, run.task, run.method, run.seed, run.state_word())
}

/// Draws the screen.
pub fn draw(state: &Runs, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let mut title = format!("runs in {}", view.settings.folder.display());
    if !state.filter.is_empty() {
        title = format!("{title} · with `{}`, esc shows all", state.filter);
    }
    if view.runs_unread > 0 && !view.runs.is_empty() {
        title = format!("{title} · {} more are being read", view.runs_unread);
    }
    let inside = pane(&title, area, theme, buffer);
    let runs = state.listed(view);
    if runs.is_empty() {
        let key = |action, context| ui.key(action, context);
        let text = if view.runs_unread > 0 {
            "The runs in this folder are being read.".to_owned()
        } else if state.filter.is_empty() {
            let (train, open) = (key(Action::Train, Context::Everywhere), key(Action::OpenRun, Context::Runs));
            format!("There are no runs in this folder yet. {train} trains one; {open} opens one from elsewhere.")
        } else {
            "No run has this text. Escape shows all.".to_owned()
        };
        return hint(&text, inside, theme, buffer);
    }
    let columns = Columns::of(usize::from(inside.width));
    let header = columns.line("  ", ["run", "state", "episodes", "success", "left", "task, method, seed"]);
    buffer.set_stringn(inside.x, inside.y, header, usize::from(inside.width), theme.faint());
    let rows = Rect { y: inside.y + 1, height: inside.height - 1, ..inside };
    let selected = state.selected_row(&runs);
    let first = (selected + 1).saturating_sub(usize::from(rows.height));
    regions.set_rows(rows, first);
    for (y, (index, run)) in (rows.y..rows.bottom()).zip(runs.iter().enumerate().skip(first)) {
        row(state, ui, run, index == selected, Rect { y, height: 1, ..rows }, buffer);
    }
}

/// Columns of the word for a run's state.
const STATE: usize = 11;

/// What has room in a line of the list.
struct Columns {
    /// Columns of the name.
    name: usize,
    /// A bar shows how much of the episodes is done.
    bar: bool,
    /// The time left is shown.
    left: bool,
    /// Task, method and seed are shown.
    about: bool,
}

impl Columns {
    fn of(width: usize) -> Self {
        let (bar, left) = (width >= 90, width >= 70);
        // Mark, state, episodes, success and time left, with the spaces between them.
        let others = 3 + 1 + STATE + 1 + if bar { 18 } else { 11 } + 8 + if left { 11 } else { 0 };
        Self { name: width.saturating_sub(others).clamp(8, 40), bar, left, about: width >= 130 }
    }

    fn line(&self, mark: &str, [run, state, episodes, success, left, about]: [&str; 6]) -> String {
        let (name, count) = (self.name, if self.bar { 18 } else { 11 });
        let left = if self.left { format!("  {left:>9}") } else { String::new() };
        let about = if self.about { format!("  {about:<32}") } else { String::new() };
        format!("{mark} {} {state:<STATE$} {episodes:<count$} {success:>7}{left}{about}", columns::padded(run, name))
    }
}

fn row(state: &Runs, ui: &Ui, run: &RunSummary, selected: bool, area: Rect, buffer: &mut Buffer) {
    let theme = ui.theme;
    let style = if selected { theme.selected() } else { Style::new() };
    let watched = ui.subject.run().is_some_and(|current| current.path == run.path);
    let mark = [if state.is_marked(run) { "*" } else { " " }, if watched { ">" } else { " " }].concat();
    let success = run.success.map_or_else(|| "-".to_owned(), |s| format!("{:.0} %", 100.0 * s));
    let left = run.seconds_left().map_or_else(String::new, span);
    let width = usize::from(area.width);
    let columns = Columns::of(width);
    let bar = if columns.bar { bar(run.done, run.episodes, 6, theme) + " " } else { String::new() };
    let progress = format!("{bar}{}/{}", run.done, run.episodes);
    let name = shortened(&run.name, columns.name, true);
    let about = format!("{}, {}, {}", run.task, run.method, run.seed);
    let text = columns.line(&mark, [&name, run.state_word(), &progress, &success, &left, &about]);
    buffer.set_stringn(area.x, area.y, columns::padded(&text, width), width, style);
    if !selected {
        let start = columns.name as u16 + 4;
        let state = Rect { x: area.x + start, width: STATE as u16, ..area }.intersection(area);
        buffer.set_style(state, Style::new().fg(state_colour(&run.state, theme)));
    } else if let RunState::Failed(reason) | RunState::Stopped(reason) = &run.state {
        let room = width.saturating_sub(columns::width(&text) + 2);
        let x = area.right() - room as u16;
        buffer.set_stringn(x, area.y, reason, room, style);
    }
}

/// What an action does on this screen.
pub fn perform(state: &mut Runs, ui: &Ui, action: Action) -> Vec<Effect> {
    let runs = state.listed(ui.view);
    let last = runs.len().saturating_sub(1);
    let selected = state.selected_row(&runs);
    let row = match action {
        Action::Up => Some(selected.saturating_sub(1)),
        Action::Down => Some((selected + 1).min(last)),
        Action::First => Some(0),
        Action::Last => Some(last),
        _ => None,
    };
    if let Some(row) = row {
        state.select(ui.view, row);
        return Vec::new();
    }
    match (action, runs.get(selected)) {
        (Action::Filter, _) => {
            let read = |text: &str| Ok(Effect::Filter(text.to_owned()));
            let prompt = Prompt::new("show runs with", "part of a name, task, method or state", "", read);
            vec![Effect::Open(Layer::Prompt(prompt))]
        }
        (Action::OpenRun, _) => {
            let read = |path: &str| Ok(Effect::apply(command::Open(path.into())));
            vec![Effect::Open(Layer::Prompt(Prompt::new("open a run", "path of its folder", "", read)))]
        }
        (_, None) => vec![Effect::info("there is no run in the list")],
        (Action::Confirm, Some(run)) => watch(run, ui),
        (Action::DeleteRun, Some(run)) => vec![ask_to_delete(run)],
        (Action::Continue, Some(run)) => vec![Effect::apply(command::Continue(Some(run.path.clone())))],
        (Action::Evaluate, Some(run)) => {
            vec![Effect::apply(command::Open(run.path.clone())), Effect::apply(command::Evaluate)]
        }
        (Action::Mark, Some(run)) => mark(state, run, ui),
        _ => Vec::new(),
    }
}

fn ask_to_delete(run: &RunSummary) -> Effect {
    let text = format!("{} and everything in it is deleted from the disk. This cannot be undone.", run.path.display());
    let delete = Effect::apply(command::Delete(run.path.clone()));
    Effect::Open(Layer::Confirm(Confirm::new("delete the run?", text, vec![('y', "delete it", delete)])))
}

/// Watches a run and says where it is seen.
fn watch(run: &RunSummary, ui: &Ui) -> Vec<Effect> {
    let key = |action| ui.key(action, Context::Scene);
    let (before, after) = (key(Action::PreviousEpisode), key(Action::NextEpisode));
    let text = format!("watching {}: 4 shows its curves, 1 its episodes ({before} and {after})", run.name);
    vec![Effect::apply(command::Open(run.path.clone())), Effect::Say(Level::Good, text)]
}

/// Marks a run for comparing, or takes the mark away; a marked run is read. The watched run stays.
fn mark(state: &mut Runs, run: &RunSummary, ui: &Ui) -> Vec<Effect> {
    if state.marked.remove(&run.path) {
        return Vec::new();
    }
    let mut effects = Vec::new();
    if !run.opened {
        effects.push(Effect::apply(command::Open(run.path.clone())));
        effects.extend(ui.subject.run().map(|watched| Effect::apply(command::Open(watched.path.clone()))));
    }
    state.marked.insert(run.path.clone());
    let compare = ui.key(Action::Compare, Context::Curves);
    let count = state.marked.len();
    effects.push(Effect::info(format!("{count} marked: {compare} on the Training screen (4) shows them together")));
    effects
}
