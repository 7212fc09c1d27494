//! The Figures screen: figures to look at, to compose and to export.

pub mod composer;

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::{Row, Widget};

use super::lists::Lists;
use super::pane::{hint, lines, pane};
use super::runs::Runs;
use super::{HitRegion, HitRegions, Screens, Ui};
use crate::tui::by_address::ByAddress;
use crate::tui::view::ViewModel;
use crate::tui::widgets::layout::WIDE;
use crate::tui::widgets::list;
use crate::tui::widgets::preview::PreviewRequest;
use crate::tui::widgets::theme::Depth;
use mge_base::paths::fitting;
use mge_results::Composition;
use mge_workbench::{Command, FigureKind, command};

/// What a figure shows, in one line.
fn about(kind: FigureKind) -> &'static str {
    match kind {
        FigureKind::Scene => "the task's scene",
        FigureKind::Clusters => "the action clusters over the scene",
        FigureKind::Learning => "success of all runs, or the marked ones",
        FigureKind::Dashboard => "all logged metrics of the watched run",
        FigureKind::Episode => "the greedy episode, or one played by hand",
    }
}

/// Width of the list in the wide layout.
const LIST: u16 = 56;

/// Draws the screen: the list at the left or above, the selected figure beside or below.
pub fn draw(screens: &Screens, ui: &Ui, covered: bool, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let composer = Some(&screens.lists.composer).filter(|composer| composer.is_open());
    let rows = FigureKind::ALL.len() as u16 + 2;
    let [mut list, picture] = if area.width >= WIDE {
        Layout::horizontal([Constraint::Length(LIST), Constraint::Fill(1)]).areas(area)
    } else {
        // In the narrow layout the composer replaces the list.
        let rows = composer.map_or(rows, |composer| (composer.height() + 2).min(area.height / 2));
        Layout::vertical([Constraint::Length(rows), Constraint::Fill(1)]).areas(area)
    };
    if let Some(composer) = composer {
        let mut place = list;
        if area.width >= WIDE {
            let own = composer.height() + 2;
            [list, place] = Layout::vertical([Constraint::Length(rows), Constraint::Fill(1)]).areas(list);
            listed(&screens.lists, ui, list, buffer, &mut HitRegions::default());
            let [above, below] = Layout::vertical([Constraint::Length(own), Constraint::Fill(1)]).areas(place);
            line(screens, ui, below, buffer);
            place = above;
        }
        let runs = screens.lists.composer.composition(&screens.runs, ui).runs.len();
        composer.draw(runs, ui, place, buffer, regions);
    } else {
        listed(&screens.lists, ui, list, buffer, regions);
    }
    let kind = selected(&screens.lists);
    let inside = pane(kind.name(), picture, ui.theme, buffer);
    regions.add(inside, HitRegion::Preview);
    if let Err(reason) = screens.preview.draw(kind.name(), covered, inside, ui.theme, buffer) {
        hint(&reason, inside, ui.theme, buffer);
    }
}

/// Draws the script line that makes the figure.
fn line(screens: &Screens, ui: &Ui, area: Rect, buffer: &mut Buffer) {
    let inside = pane("in a script", area, ui.theme, buffer);
    let command = export(FigureKind::Learning, "pdf", &screens.lists, &screens.runs, ui);
    let keys = ui.text("{export-figure} exports it as PNG, {export-svg} as SVG, {export-pdf} as PDF");
    let written = ui.view.figures.last().map_or_else(String::new, |path| format!("wrote {}", path.display()));
    let text = lines(&command.to_string(), inside.width, Style::new())
        .chain(lines(&format!("\n{keys}"), inside.width, ui.theme.faint()))
        .chain(lines(&written, inside.width, Style::new().fg(ui.theme.good)));
    Text::from_iter(text).render(inside, buffer);
}

/// The command that exports a figure in a format.
pub fn export(kind: FigureKind, format: &str, lists: &Lists, runs: &Runs, ui: &Ui) -> Command {
    let view = ui.view;
    let composition = composition(kind, lists, runs, ui);
    // A figure of one run is named after it: figures of several runs on one task do not overwrite each other.
    let of_run = match kind {
        FigureKind::Dashboard => true,
        FigureKind::Episode => view.hand.trace.steps.is_empty(),
        FigureKind::Scene | FigureKind::Clusters | FigureKind::Learning => false,
    };
    let about: Option<&str> = match kind {
        FigureKind::Learning => common_task(&composition, ui),
        _ => Some(view.watched_run().filter(|_| of_run).map_or(&*view.task.name, |run| &*run.name)),
    };
    command::Figure { composition, ..command::Figure::with_defaults(kind, &path_of(kind, about, format)) }.into()
}

/// The path of a figure of a task or run, or of all runs.
pub fn path_of(kind: FigureKind, about: Option<&str>, format: &str) -> PathBuf {
    let name = format!("{}.{format}", kind.name());
    Path::new("figures").join(about.map_or_else(|| name.clone(), |about| fitting(about, &format!("-{name}"))))
}

/// Whether the figure of learning curves shows the run in a folder.
fn is_shown(composition: &Composition, run: &Path) -> bool {
    composition.runs.is_empty() || composition.runs.iter().any(|shown| shown == run)
}

/// The task of all runs that the figure of learning curves shows; None if there are several.
fn common_task<'a>(composition: &Composition, ui: &Ui<'a>) -> Option<&'a str> {
    let view: &'a ViewModel = ui.view;
    let shown = view.runs.iter().filter(|run| run.done > 0 && is_shown(composition, &run.path));
    let mut tasks = shown.map(|run| run.config.task.name.as_str());
    let first = tasks.next()?;
    tasks.all(|task| task == first).then_some(first)
}

fn composition(kind: FigureKind, lists: &Lists, runs: &Runs, ui: &Ui) -> Composition {
    match kind {
        FigureKind::Learning => lists.composer.composition(runs, ui),
        _ => Composition::default(),
    }
}

fn listed(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let theme = ui.theme;
    let inside = pane("figures", area, theme, buffer);
    let row = |index: usize| {
        let kind = FigureKind::ALL[index];
        Row::new([kind.name(), about(kind)])
    };
    let (count, widths) = (FigureKind::ALL.len(), [Constraint::Length(10), Constraint::Fill(1)]);
    regions.add_rows(list::draw(count, Some(lists.figure), row, &widths, inside, theme, buffer));
    let [_, below] = Layout::vertical([Constraint::Length(count as u16 + 1), Constraint::Fill(1)]).areas(inside);
    let written = ui.view.figures.iter().rev().map(|path| format!("wrote {}", path.display()));
    let text = Text::from_iter(written).style(Style::new().fg(theme.good));
    if text.height() > 0 {
        return text.render(below, buffer);
    }
    if below.height == 0 {
        return;
    }
    let text = "Nothing exported yet. {export-figure} exports the selected figure as PNG (the episode as GIF), {export-svg} as SVG, {export-pdf} as PDF, {export} every figure that has data, into the folder figures/. {compose} composes the learning figure.";
    hint(&ui.text(text), below, theme, buffer);
}

/// The selected figure.
pub fn selected(lists: &Lists) -> FigureKind {
    FigureKind::ALL[lists.figure.min(FigureKind::ALL.len() - 1)]
}

/// The selected figure, its composition, and the preview to draw. None while there is no room for a preview.
pub fn wanted(
    lists: &Lists,
    runs: &Runs,
    ui: &Ui,
    regions: &HitRegions,
) -> Option<(FigureKind, Composition, PreviewRequest)> {
    let (area, _) =
        regions.all().iter().find(|(area, region)| matches!(region, HitRegion::Preview) && !area.is_empty())?;
    let kind = selected(lists);
    let composition = composition(kind, lists, runs, ui);
    let grey = ui.theme.depth == Depth::None;
    let wanted = PreviewRequest {
        kind: kind.name(),
        options: composition.options(),
        task: ByAddress(ui.view.task.clone()),
        prior: ui.view.prior.clone().map(ByAddress),
        progress: progress(kind, &composition, ui),
        room: [area.width, area.height],
        grey,
    };
    Some((kind, composition, wanted))
}

/// A hash of the runs that a figure shows and of their finished episodes.
fn progress(kind: FigureKind, composition: &Composition, ui: &Ui) -> u64 {
    let mut hasher = DefaultHasher::new();
    ui.subject.run().map(|run| (&run.path, run.done)).hash(&mut hasher);
    if kind == FigureKind::Learning {
        for run in ui.view.runs.iter().filter(|run| is_shown(composition, &run.path)) {
            (&run.path, run.done).hash(&mut hasher);
        }
    }
    hasher.finish()
}

/// Gives the keyboard focus to the composer, or takes it away.
pub fn compose(screens: &mut Screens, ui: &Ui) {
    let lists = &mut screens.lists;
    if !lists.composer.leave() {
        lists.figure = FigureKind::ALL.iter().position(|kind| *kind == FigureKind::Learning).unwrap_or(0);
        lists.composer.open(&screens.runs, ui);
    }
}
