//! The whole picture: tabs, screen, message and footer, and where things were drawn, for the mouse.

use ratatui::prelude::*;
use ratatui::widgets::Clear;

use super::edit::tool_text;
use super::pane::{level_style, lines};
use super::{Screens, Ui, figures, log, models, runs, schedule, training, workbench};
use crate::tui::actions::{Context, Entry, Tab};
use crate::tui::chart::Axes;
use crate::tui::input;
use crate::tui::layers::some_of;
use crate::tui::scene::View;
use crate::tui::view::{Level, RunSummary};
use crate::tui::widgets::columns;
use crate::tui::widgets::layout::{MIN_SIZE, body};
use mge_run::{Metric, RunState};
use mge_task::{Object, Part};

/// The regions of a drawing.
pub type HitRegions = Vec<(Rect, HitRegion)>;

/// Something that reacts to the mouse.
#[derive(Debug, Clone, Copy)]
pub enum HitRegion {
    /// A tab.
    Tab(Tab),
    /// A hint in the last line.
    Hint(&'static Entry),
    /// The scene.
    Scene(View),
    /// The schedule's plot.
    Schedule(Axes),
    /// A row of a list.
    Row(usize),
    /// A curve.
    Chart(Axes, Metric),
    /// The picture of a figure.
    Preview,
}

/// The rows of a list.
pub(super) fn row_regions(drawn: Vec<(Rect, usize)>) -> impl Iterator<Item = (Rect, HitRegion)> {
    drawn.into_iter().map(|(area, index)| (area, HitRegion::Row(index)))
}

/// Width from which the names of all tabs fit.
const TABS: u16 = 80;

/// What is shown around and over the screen.
pub struct Chrome<'a> {
    /// The screen being shown.
    pub tab: Tab,
    /// The contexts in which keys are looked up now, the innermost first.
    pub contexts: &'a [Context],
    /// The message above the footer, and its severity.
    pub message: Option<(Level, &'a str)>,
    /// Whether a layer covers the screen.
    pub covered: bool,
}

/// Draws everything but the layers; returns the regions for the mouse.
pub fn draw_frame(ui: &Ui, screens: &Screens, chrome: &Chrome, area: Rect, buffer: &mut Buffer) -> HitRegions {
    if area.width < MIN_SIZE.0 || area.height < MIN_SIZE.1 {
        let text = format!("terminal too small: {}x{}, at least 60x20 is needed", area.width, area.height);
        Text::from_iter(lines(&text, area.width, Style::new())).render(area, buffer);
        return HitRegions::new();
    }
    let mut regions = HitRegions::new();
    tabs(ui, chrome.tab, Rect { height: 1, ..area }, buffer, &mut regions);
    let message = message(ui, screens, chrome, area);
    let rows = message.height() as u16;
    // A second line covers the lower frame of the panels, so that they stay as they are.
    let body = Rect { height: body(area).height - if rows > 2 { rows - 1 } else { 0 }, ..body(area) };
    match chrome.tab {
        Tab::Scene => workbench::draw(ui, screens, body, buffer, &mut regions),
        Tab::Edit => workbench::draw_edit(ui, &screens.scene, body, buffer, &mut regions),
        Tab::Schedule => schedule::draw(&screens.schedule, ui, body, buffer, &mut regions),
        Tab::Training => training::draw(ui, screens, body, buffer, &mut regions),
        Tab::Runs => runs::draw(&screens.runs, ui, body, buffer, &mut regions),
        Tab::Models => models::draw(screens.model, ui, body, buffer, &mut regions),
        Tab::Figures => figures::draw(screens, ui, chrome.covered, body, buffer, &mut regions),
        Tab::Log => log::draw(&screens.log, ui, body, buffer),
    }
    let below = Rect { y: area.bottom() - 1 - rows, height: rows, ..area };
    Clear.render(below, buffer);
    message.render(below, buffer);
    footer(ui, screens, chrome, Rect { y: area.bottom() - 1, height: 1, ..area }, buffer, &mut regions);
    regions
}

/// The lines between screen and footer: the message, or else what is known of what the cursor is on.
fn message(ui: &Ui, screens: &Screens, chrome: &Chrome, area: Rect) -> Text<'static> {
    let Some((level, text)) = chrome.message else {
        let text = columns::shortened(&explanation(ui, screens, chrome.tab), usize::from(area.width), false);
        return Text::styled(text, ui.theme.faint());
    };
    let (mark, style) = level_style(level, ui.theme);
    let text = lines(&format!("{mark}{text}"), area.width, style);
    Text::from_iter(text.take(usize::from(area.height / 3)))
}

/// The paused runs that the key resumes; if others go on, it pauses them.
fn paused<'a>(ui: &Ui<'a>, screens: &Screens, tab: Tab) -> Vec<&'a RunSummary> {
    let acted_on = screens.acted_on(ui, tab);
    let goes_on = acted_on.iter().any(|run| run.state == RunState::Running);
    acted_on.into_iter().filter(|run| !goes_on && run.state == RunState::Paused).collect()
}

/// One line about what the cursor is on.
fn explanation(ui: &Ui, screens: &Screens, tab: Tab) -> String {
    let paused = paused(ui, screens, tab);
    if !paused.is_empty() {
        return ui.text("paused: {pause} resumes ") + &some_of(paused.iter().map(|run| run.name.clone()));
    }
    match tab {
        Tab::Scene | Tab::Edit => {
            // Another task may lack it.
            let selected = screens.scene.selected().and_then(|it| Some((it, ui.view.objects().position(it)?)));
            let Some((object, [x, y])) = selected else { return screens.scene.missing(ui.subject).join("; ") };
            let name = match object {
                Object::Part(Part::Tool(index)) => {
                    ui.view.task.tools.get(index).map_or_else(String::new, |tool| tool_text(&tool.tool(), true))
                }
                object => ui.view.objects().name(object),
            };
            // During hand play, the keys are those of the tool.
            let keys = ui.text(": arrows or the mouse move it, {coordinates} types x and y");
            let keys = if screens.scene.hand.is_some() { "" } else { &*keys };
            format!("{name} at x {x:.2}, y {y:.2}{keys}")
        }
        Tab::Training => screens.curves.explanation(),
        Tab::Runs => runs::EXPLANATION.to_owned(),
        Tab::Models => models::COLUMNS.to_owned(),
        Tab::Schedule | Tab::Figures | Tab::Log => String::new(),
    }
}

fn tabs(ui: &Ui, shown: Tab, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let Ui { view, theme, .. } = *ui;
    let mut x = area.x;
    for (index, tab) in Tab::ALL.into_iter().enumerate() {
        let number = index + 1;
        let name = if area.width >= TABS || tab == shown { format!("{} ", tab.name()) } else { String::new() };
        let text = format!(" {number} {name}");
        let style = if tab == shown { theme.strong().add_modifier(Modifier::REVERSED) } else { theme.faint() };
        let (end, _) = buffer.set_stringn(x, area.y, &text, text.len(), style);
        regions.push((Rect { x, width: end - x, ..area }, HitRegion::Tab(tab)));
        x = end;
    }
    let mark = if view.dirty { " (edited)" } else { "" };
    let text = format!("{}{mark} ", view.task.name);
    let width = columns::width(&text) as u16;
    let bold = Style::new().add_modifier(Modifier::BOLD);
    if x + width < area.right() {
        buffer.set_string(area.right() - width, area.y, text, bold);
    } else if view.dirty {
        buffer.set_string(area.right() - 2, area.y, "*", bold);
    }
}

fn footer(ui: &Ui, screens: &Screens, chrome: &Chrome, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let theme = ui.theme;
    let resumes = !paused(ui, screens, chrome.tab).is_empty();
    let word = |entry: &'static Entry| if entry.name == "pause" && resumes { "resume" } else { entry.hint };
    let mut put = |x: u16, key: &str, entry: &'static Entry| {
        let (after, _) = buffer.set_stringn(x, area.y, key, key.len(), theme.strong());
        buffer.set_stringn(after + 1, area.y, word(entry), word(entry).len(), theme.faint());
        regions.push((Rect { x, width: hint_width(key, word(entry)) - 2, ..area }, HitRegion::Hint(entry)));
    };
    let mut hints = input::hints(chrome.contexts);
    hints.retain(|(_, entry)| !entry.verb.starts_with("proposal ") || !ui.view.proposed.is_empty());
    // The key for help is always shown, at the right.
    let (always, others): (Vec<_>, Vec<_>) = hints.into_iter().partition(|(_, entry)| entry.name == "help");
    let mut end = area.right();
    for (key, entry) in always {
        end = end.saturating_sub(hint_width(key, word(entry)) - 2).max(area.x);
        put(end, key, entry);
    }
    let mut x = area.x;
    for (key, entry) in others {
        let width = hint_width(key, word(entry));
        if x + width > end {
            break;
        }
        put(x, key, entry);
        x += width;
    }
}

/// Columns of a key and its word, with the space after them.
fn hint_width(key: &str, word: &str) -> u16 {
    (key.chars().count() + word.len() + 3) as u16
}
