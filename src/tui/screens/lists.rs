//! The Models, Figures and Log screens: lines of which one is selected.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::frame::{hint, level_style, pane};
use super::{Hits, Tab};
use crate::tui::action::{Action, Context};
use crate::tui::app::App;

/// The selected line of each screen; the Log counts from its end.
#[derive(Debug, Default)]
pub struct Lists {
    /// Of the Models screen.
    pub model: usize,
    /// Of the Figures screen.
    pub figure: usize,
    /// Of the Log screen, 0 for the latest line.
    pub log: usize,
}

/// Kind of a figure, its explanation.
const FIGURES: [(&str, &str, &str); 5] = [
    ("scene", "png", "the task's scene"),
    ("clusters", "png", "the action clusters over the scene"),
    ("learning", "png", "rolling success of all runs that are open"),
    ("dashboard", "png", "everything logged of the watched run"),
    ("episode", "gif", "the greedy episode of the watched run, or the one played by hand, animated"),
];

/// Draws the screen.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    match app.tab {
        Tab::Models => models(app, area, buffer, hits),
        Tab::Figures => figures(app, area, buffer, hits),
        _ => log(app, area, buffer),
    }
}

fn models(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let inside = pane("what predicts the rollouts behind the clusters", area, &app.theme, buffer);
    hits.rows = Some((inside, 0));
    for (y, (index, model)) in (inside.y..inside.bottom()).zip(facts.models.iter().enumerate()) {
        let mark = if model.name == facts.settings.model { ">" } else { " " };
        let text = format!("{mark} {:<12} {}", model.name, model.about);
        line(app, &text, index == app.lists.model, inside, y, Style::new(), buffer);
    }
    let text = "Enter chooses a model for the next clusters. `mge dynamics train --tools box,bucket --out models/mine.safetensors` trains another one; models in the folder models/ are listed here.";
    let below = Rect {
        y: inside.y + facts.models.len() as u16,
        height: inside.height.saturating_sub(facts.models.len() as u16),
        ..inside
    };
    hint(text, below, &app.theme, buffer);
}

fn figures(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let inside = pane("figures", area, theme, buffer);
    hits.rows = Some((inside, 0));
    for (y, (index, (kind, format, about))) in (inside.y..inside.bottom()).zip(FIGURES.iter().enumerate()) {
        let text = format!("  {kind:<10} {format}  {about}");
        line(app, &text, index == app.lists.figure, inside, y, Style::new(), buffer);
    }
    let top = inside.y + FIGURES.len() as u16 + 1;
    let below = Rect { y: top.min(inside.bottom()), height: inside.bottom().saturating_sub(top), ..inside };
    if facts.figures.is_empty() {
        let all = app.keymap.key_for(Action::Export, Context::Everywhere);
        let text = format!(
            "Nothing exported yet. Enter exports the selected figure, {all} all there is something for, into the folder figures/."
        );
        return hint(&text, below, theme, buffer);
    }
    for (y, path) in (below.y..below.bottom()).zip(facts.figures.iter().rev()) {
        let text = format!("  wrote {}", path.display());
        buffer.set_stringn(below.x, y, text, usize::from(below.width), Style::new().fg(theme.good));
    }
}

fn log(app: &App, area: Rect, buffer: &mut Buffer) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let inside = pane("log", area, theme, buffer);
    if facts.log.is_empty() {
        return hint(
            "Nothing has happened yet. Everything you do and everything a run tells appears here.",
            inside,
            theme,
            buffer,
        );
    }
    let width = usize::from(inside.width);
    let end = facts.log.len() - app.lists.log.min(facts.log.len() - 1);
    let wrapped = facts.log[..end].iter().rev().flat_map(|entry| {
        let (mark, style) = level_style(entry.level, theme);
        let lines = crate::tui::layers::wrap(&format!("{mark}{}", entry.text), width);
        lines.into_iter().rev().map(move |text| (text, style))
    });
    let mut lines: Vec<(String, Style)> = wrapped.take(usize::from(inside.height)).collect();
    lines.reverse();
    for (y, (text, style)) in (inside.y..inside.bottom()).zip(lines) {
        buffer.set_stringn(inside.x, y, text, width, style);
    }
}

fn line(app: &App, text: &str, selected: bool, area: Rect, y: u16, style: Style, buffer: &mut Buffer) {
    let width = usize::from(area.width);
    let style = if selected { app.theme.selected() } else { style };
    buffer.set_stringn(area.x, y, format!("{text:width$}"), width, style);
}

/// What an action does on these screens.
pub fn perform(app: &mut App, action: Action) {
    let facts = app.desk.facts();
    let (selected, last, latest_first) = match app.tab {
        Tab::Models => (&mut app.lists.model, facts.models.len().saturating_sub(1), false),
        Tab::Figures => (&mut app.lists.figure, FIGURES.len() - 1, false),
        _ => (&mut app.lists.log, facts.log.len().saturating_sub(1), true),
    };
    let now = (*selected).min(last);
    let (back, on) = if latest_first { (Action::Down, Action::Up) } else { (Action::Up, Action::Down) };
    let (far_back, far_on) =
        if latest_first { (Action::FarDown, Action::FarUp) } else { (Action::FarUp, Action::FarDown) };
    let (first, end) = if latest_first { (Action::Last, Action::First) } else { (Action::First, Action::Last) };
    if action == back {
        *selected = now.saturating_sub(1);
    } else if action == on {
        *selected = (now + 1).min(last);
    } else if action == far_back {
        *selected = now.saturating_sub(10);
    } else if action == far_on {
        *selected = (now + 10).min(last);
    } else if action == first {
        *selected = 0;
    } else if action == end {
        *selected = last;
    } else if action == Action::Confirm {
        choose(app, now);
    }
}

fn choose(app: &mut App, index: usize) {
    match app.tab {
        Tab::Models => {
            if let Some(model) = app.desk.facts().models.get(index) {
                let line = format!("model {}", shell_words::quote(&model.name));
                app.line(&line);
            }
        }
        Tab::Figures => {
            let (kind, format, _) = FIGURES[index];
            app.export(kind, format);
        }
        _ => {}
    }
}
