//! The Runs screen: past and running runs.

use std::collections::HashSet;
use std::path::PathBuf;
use std::time::Duration;

use ratatui::buffer::Buffer;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::{Row, Table, Widget};

use super::lists::select;
use super::pane::{hint, lines, pane};
use super::status::{bar, state_colour};
use super::{HitRegions, Ui};
use crate::run::RunState;
use crate::tui::actions::Action;
use crate::tui::effect::Effect;
use crate::tui::layers::{Prompt, Question};
use crate::tui::view::{Level, RunSummary, ViewModel, span};
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::list;
use crate::tui::widgets::theme::Theme;
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

    /// Watches the selected run, if that is another one than the watched.
    pub fn watch_selected(&self, ui: &Ui) -> Vec<Effect> {
        let runs = self.listed(ui.view);
        let selected = runs.get(self.selected_row(&runs));
        let other = selected.filter(|run| ui.subject.run().is_none_or(|watched| watched.path != run.path));
        other.map(|run| Effect::apply(command::Open(run.path.clone()))).into_iter().collect()
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
    let mut title = format!("runs in {}", view.folder.display());
    if !state.filter.is_empty() {
        title = format!("{title} · with `{}`, esc shows all", state.filter);
    }
    if view.runs_unread > 0 && !view.runs.is_empty() {
        title = format!("{title} · {} more are being read", view.runs_unread);
    }
    let inside = pane(&title, area, theme, buffer);
    let runs = state.listed(view);
    if runs.is_empty() {
        let text = if view.runs_unread > 0 {
            "The runs in this folder are being read."
        } else if state.filter.is_empty() {
            "There are no runs in this folder yet. {train} trains one; {open-run} opens one from elsewhere."
        } else {
            "No run has this text. Escape shows all."
        };
        return hint(&ui.text(text), inside, theme, buffer);
    }
    let selected = state.selected_row(&runs);
    let details = runs.get(selected).map_or_else(String::new, |run| about(run));
    let details = Text::from_iter(lines(&details, inside.width, Style::new()));
    let height = Constraint::Length((details.height() as u16).min(inside.height / 3));
    let [header, rows, below] = Layout::vertical([Constraint::Length(1), Constraint::Fill(1), height]).areas(inside);
    details.render(below, buffer);
    let shown: Vec<&Column> = COLUMNS.iter().filter(|column| inside.width >= column.from).collect();
    let taken: u16 = shown.iter().map(|column| column.width + 1).sum();
    let name = inside.width.saturating_sub(taken).min(NAME);
    let width = |column: &&Column| Constraint::Length(if column.width == 0 { name } else { column.width });
    let widths: Vec<Constraint> = shown.iter().map(width).collect();
    let headings = shown.iter().map(|column| Text::from(column.heading).alignment(column.alignment));
    Table::new([Row::new(headings).style(theme.faint())], &widths).render(header, buffer);
    let row = |index: usize| {
        let run = runs[index];
        let watched = ui.subject.run().is_some_and(|current| current.path == run.path);
        let mark = [if state.is_marked(run) { "*" } else { " " }, if watched { ">" } else { " " }].concat();
        Row::new(shown.iter().map(|column| match column.heading {
            "" => Text::from(mark.clone()),
            "run" => Text::from(shortened(&run.name, usize::from(name), true)),
            "state" => Text::styled(run.state_word(), Style::new().fg(state_colour(&run.state, theme))),
            _ => Text::from((column.cell)(run, theme)).alignment(column.alignment),
        }))
    };
    regions.add_rows(list::draw(runs.len(), Some(selected), row, &widths, rows, theme, buffer));
}

/// A column of the list.
struct Column {
    heading: &'static str,
    /// Columns of the terminal; 0 for what the others leave.
    width: u16,
    /// Columns of the list from which on there is room for it.
    from: u16,
    alignment: Alignment,
    cell: fn(&RunSummary, &Theme) -> String,
}

/// Columns of a run's name at most.
const NAME: u16 = 40;

/// Columns of the list; mark, name and state are drawn in ways of their own.
const COLUMNS: [Column; 7] = [
    column("", 2, 0, Alignment::Left, |_, _| String::new()),
    column("run", 0, 0, Alignment::Left, |_, _| String::new()),
    column("state", 11, 0, Alignment::Left, |_, _| String::new()),
    column("episodes", 18, 50, Alignment::Left, |run, theme| {
        format!("{} {}/{}", bar(run.done, run.episodes, 6, theme), run.done, run.episodes)
    }),
    column("success", 7, 0, Alignment::Right, |run, _| {
        run.success.map_or_else(|| "-".to_owned(), |success| format!("{:.0} %", 100.0 * success))
    }),
    column("left", 10, 70, Alignment::Right, |run, _| run.seconds_left().map_or_else(String::new, span)),
    column("task, method, seed", 32, 130, Alignment::Left, |run, _| {
        format!(" {}, {}, {}", run.task, run.method, run.seed)
    }),
];

const fn column(
    heading: &'static str,
    width: u16,
    from: u16,
    alignment: Alignment,
    cell: fn(&RunSummary, &Theme) -> String,
) -> Column {
    Column { heading, width, from, alignment, cell }
}

/// What there is to know of the selected run.
fn about(run: &RunSummary) -> String {
    let reason = match &run.state {
        RunState::Failed(reason) | RunState::Stopped(reason) => format!(": {reason}"),
        _ => String::new(),
    };
    let done = format!("{} of {} episodes", run.done, run.episodes);
    format!("{}: {}, {}, seed {}, {done}, {}{reason}", run.name, run.task, run.method, run.seed, run.state_word())
}

/// What an action does on this screen.
pub fn perform(state: &mut Runs, ui: &Ui, action: Action) -> Vec<Effect> {
    let runs = state.listed(ui.view);
    let selected = state.selected_row(&runs);
    if let Some(row) = select(action, selected, runs.len().saturating_sub(1)) {
        state.select(ui.view, row);
        return Vec::new();
    }
    match (action, runs.get(selected)) {
        (Action::Filter, _) => {
            let read = |text: &str| Ok(Effect::Filter(text.to_owned()));
            let prompt = Prompt::new("show runs with", "part of a name, task, method or state", "", read);
            vec![Effect::open(prompt)]
        }
        (Action::OpenRun, _) => {
            let read = |path: &str| Ok(Effect::apply(command::Open(path.into())));
            vec![Effect::open(Prompt::new("open a run", "path of its folder", "", read))]
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
    Effect::open(Question::warning("delete the run?", text, vec![('y', "delete it", delete)]))
}

/// Watches a run and says where it is seen.
fn watch(run: &RunSummary, ui: &Ui) -> Vec<Effect> {
    let places = ui.text(
        "{screen-training} shows its curves, {screen-scene} its episodes ({previous-episode} and {next-episode})",
    );
    let text = format!("watching {}: {places}", run.name);
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
    let together = ui.text("{compare} on the Training screen ({screen-training}) shows them together");
    effects.push(Effect::info(format!("{} marked: {together}", state.marked.len())));
    effects
}
