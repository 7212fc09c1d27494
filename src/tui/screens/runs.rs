//! The Runs screen: past and running runs.

use std::collections::HashSet;
use std::path::PathBuf;
use std::time::Duration;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::Hits;
use super::frame::{hint, pane, shortened};
use super::status::{bar, state_colour};
use crate::run::RunState;
use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::columns;
use crate::tui::facts::{Level, RunFacts};
use crate::tui::layers::{Deed, Layer, Prompt, Then};
use crate::tui::rate::span;

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
    fn selected_row(&self, runs: &[&RunFacts]) -> usize {
        let known = self.selected.as_ref().and_then(|path| runs.iter().position(|run| run.path == *path));
        known.unwrap_or(self.row.min(runs.len().saturating_sub(1)))
    }

    /// Whether the run is marked for comparing.
    pub fn is_marked(&self, run: &RunFacts) -> bool {
        self.marked.contains(&run.path)
    }

    /// Ends the filter; false if there is none.
    pub fn leave(&mut self) -> bool {
        !std::mem::take(&mut self.filter).is_empty()
    }
}

/// The runs in the list, the latest first.
fn listed(app: &App) -> Vec<&RunFacts> {
    let matches = |run: &&RunFacts| words(run).to_lowercase().contains(&app.runs.filter.to_lowercase());
    app.desk.facts().runs.iter().rev().filter(matches).collect()
}

fn words(run: &RunFacts) -> String {
    format!("{} {} {} seed {} {}", run.name, run.task, run.method, run.seed, run.state_word())
}

/// Draws the screen.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let mut title = format!("runs in {}", facts.settings.folder.display());
    if !app.runs.filter.is_empty() {
        title = format!("{title} · with `{}`, esc shows all", app.runs.filter);
    }
    let inside = pane(&title, area, theme, buffer);
    let runs = listed(app);
    if runs.is_empty() {
        let key = |action, context| app.keymap.key_for(action, context);
        let text = if app.runs.filter.is_empty() {
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
    let selected = app.runs.selected_row(&runs);
    let first = (selected + 1).saturating_sub(usize::from(rows.height));
    hits.rows = Some((rows, first));
    for (y, (index, run)) in (rows.y..rows.bottom()).zip(runs.iter().enumerate().skip(first)) {
        row(app, run, index == selected, Rect { y, height: 1, ..rows }, buffer);
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
    /// The time left is told.
    left: bool,
    /// Task, method and seed are told.
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

fn row(app: &App, run: &RunFacts, selected: bool, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let style = if selected { theme.selected() } else { Style::new() };
    let watched = app.desk.facts().current_run().is_some_and(|current| current.path == run.path);
    let mark = [if app.runs.is_marked(run) { "*" } else { " " }, if watched { ">" } else { " " }].concat();
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
pub fn perform(app: &mut App, action: Action) {
    let runs = listed(app);
    let last = runs.len().saturating_sub(1);
    let selected = app.runs.selected_row(&runs);
    let path = runs.get(selected).map(|run| (run.path.clone(), run.opened));
    let quoted = |path: &PathBuf| shell_words::quote(&path.display().to_string()).into_owned();
    match (action, path) {
        (Action::Up, _) => select(app, selected.saturating_sub(1)),
        (Action::Down, _) => select(app, (selected + 1).min(last)),
        (Action::First, _) => select(app, 0),
        (Action::Last, _) => select(app, last),
        (Action::Filter, _) => {
            let prompt = Prompt::new("show runs with", "part of a name, task, method or state", "", Then::Filter);
            app.layers.push(Layer::Prompt(prompt));
        }
        (Action::OpenRun, _) => {
            let then = Then::Path("open".to_owned());
            app.layers.push(Layer::Prompt(Prompt::new("open a run", "path of its folder", "", then)));
        }
        (_, None) => app.say(Level::Info, "there is no run in the list"),
        (Action::Confirm, Some((path, _))) => watch(app, &format!("open {}", quoted(&path))),
        (Action::DeleteRun, Some((path, _))) => {
            let text =
                format!("{} and everything in it is deleted from the disk. This cannot be undone.", path.display());
            let deed = Deed::Line(format!("delete {}", quoted(&path)));
            app.ask("delete the run?", text, vec![('y', "delete it", deed)]);
        }
        (Action::Continue, Some((path, _))) => app.line(&format!("continue {}", quoted(&path))),
        (Action::Evaluate, Some((path, _))) => {
            app.line(&format!("open {}", quoted(&path)));
            app.line("evaluate");
        }
        (Action::Mark, Some((path, opened))) => mark(app, path, opened),
        _ => {}
    }
}

/// Selects the run in a row of the list.
pub fn select(app: &mut App, row: usize) {
    let path = listed(app).get(row).map(|run| run.path.clone());
    (app.runs.selected, app.runs.row) = (path, row);
}

/// Whether the run in a row of the list is the selected one.
pub fn is_selected(app: &App, row: usize) -> bool {
    let runs = listed(app);
    row < runs.len() && app.runs.selected_row(&runs) == row
}

/// Watches a run and says where it is seen.
fn watch(app: &mut App, line: &str) {
    app.line(line);
    if app.notice.as_ref().is_some_and(|notice| notice.level == Level::Error) {
        return;
    }
    if let Some(run) = app.desk.facts().current_run() {
        let key = |action| app.keymap.key_for(action, Context::Scene);
        let (before, after) = (key(Action::PreviousEpisode), key(Action::NextEpisode));
        let text = format!("watching {}: 4 shows its curves, 1 its episodes ({before} and {after})", run.name);
        app.say(Level::Good, text);
    }
}

/// Marks a run for comparing, or takes the mark away; a marked run is read.
fn mark(app: &mut App, path: PathBuf, opened: bool) {
    if app.runs.marked.remove(&path) {
        return;
    }
    if !opened {
        let watched = app.desk.facts().current_run().map(|run| run.path.clone());
        app.line(&format!("open {}", shell_words::quote(&path.display().to_string())));
        if let Some(watched) = watched {
            app.line(&format!("open {}", shell_words::quote(&watched.display().to_string())));
        }
    }
    let compare = app.keymap.key_for(Action::Compare, Context::Curves);
    app.runs.marked.insert(path);
    app.say(
        Level::Info,
        format!("{} marked: {compare} on the Training screen (4) shows them together", app.runs.marked.len()),
    );
}
