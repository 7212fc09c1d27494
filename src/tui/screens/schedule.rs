//! The Schedule screen: the epsilon threshold, drawn and edited.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};

use super::Hits;
use super::edit::direction;
use super::frame::pane;
use crate::guidance::EpsilonSchedule;
use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::chart::{Axes, Scale, Window};
use crate::tui::facts::Level;
use crate::tui::handles;
use crate::tui::raster::Raster;
use crate::tui::theme::Marker;

/// Columns at which a point is still hit with the mouse.
const NEAR: f32 = 4.0;

/// State of the editor.
#[derive(Debug, Default)]
pub struct Schedule {
    /// The schedule as edited; None if it is the one in use.
    pub draft: Option<EpsilonSchedule>,
    /// The selected point.
    pub point: usize,
}

impl Schedule {
    /// The schedule as edited, or the one in use.
    pub fn shown(&self, in_use: &EpsilonSchedule) -> EpsilonSchedule {
        self.draft.clone().unwrap_or_else(|| in_use.clone())
    }
}

/// Episodes the plot shows: those of the next run, and all points.
fn span(app: &App) -> u32 {
    let settings = &app.desk.facts().settings;
    let shown = app.schedule.shown(&settings.epsilon);
    let last = handles::points(&shown).last().map_or(0, |point| point.0);
    (settings.episodes as u32).max(last.saturating_add(last / 20)).max(10)
}

/// Draws the screen.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let shown = app.schedule.shown(&facts.settings.epsilon);
    let title = format!("epsilon threshold · {} · {shown}", handles::kind(&shown));
    let inside = pane(&title, area, theme, buffer);
    let text = explanation(app);
    let lines = crate::tui::layers::wrap(&text, usize::from(inside.width.saturating_sub(2)));
    let rows = (lines.len() as u16).min(inside.height / 3);
    let plot = Rect { x: inside.x + 1, y: inside.y + 1, width: inside.width - 2, height: inside.height - rows - 2 };
    let window = Window { from: 0.0, to: span(app) as f32 };
    if let Some(axes) = Axes::draw(plot, window, [0.0, 1.0], Scale::Linear, theme, buffer) {
        let mut raster = Raster::new(axes.plot, theme.marker);
        if app.schedule.draft.is_some() {
            trace(&facts.settings.epsilon, &axes, theme.dim, &mut raster);
        }
        trace(&shown, &axes, theme.accent, &mut raster);
        raster.render(buffer);
        progress(app, &axes, buffer);
        points(app, &shown, &axes, buffer);
        hits.schedule = Some(axes);
    }
    for (y, line) in (inside.bottom() - rows..inside.bottom()).zip(lines) {
        buffer.set_stringn(inside.x + 1, y, line, usize::from(inside.width), theme.faint());
    }
}

fn trace(schedule: &EpsilonSchedule, axes: &Axes, colour: ratatui::style::Color, raster: &mut Raster) {
    let size = raster.size();
    let columns = size[0] as usize;
    let at = |column: usize| {
        let x = axes.x.from + (axes.x.to - axes.x.from) * column as f32 / (columns.max(2) - 1) as f32;
        axes.dot(size, x, schedule.threshold(x as u32))
    };
    for column in 1..columns {
        raster.line(at(column - 1), at(column), colour);
    }
}

/// A line at the episode of the running training.
fn progress(app: &App, axes: &Axes, buffer: &mut Buffer) {
    let run = app.desk.facts().current_run().filter(|run| run.active);
    let Some(column) = run.and_then(|run| axes.column(run.done as f32)) else { return };
    let bar = if app.theme.marker == Marker::Ascii { "|" } else { "┊" };
    for row in axes.plot.top()..axes.plot.bottom() {
        buffer.set_string(column, row, bar, Style::new().fg(app.theme.good));
    }
}

fn points(app: &App, shown: &EpsilonSchedule, axes: &Axes, buffer: &mut Buffer) {
    let height = f32::from(axes.plot.height);
    let (mark, chosen) = if app.theme.marker == Marker::Ascii { ("o", "@") } else { ("○", "●") };
    for (index, (episode, value)) in handles::points(shown).into_iter().enumerate() {
        let Some(column) = axes.column(episode as f32) else { continue };
        let row = axes.plot.y + (axes.dot([1.0, height], episode as f32, value)[1] as u16).min(axes.plot.height - 1);
        let selected = index == app.schedule.point;
        let style = Style::new().fg(app.theme.warn).add_modifier(Modifier::BOLD);
        buffer.set_string(column, row, if selected { chosen } else { mark }, style);
        if selected {
            let text = format!(" {episode}: {value:.2} ");
            let width = text.len() as u16;
            let x = if column + 1 + width < axes.plot.right() { column + 1 } else { column.saturating_sub(width) };
            buffer.set_string(x, row, text, app.theme.selected());
        }
    }
}

fn explanation(app: &App) -> String {
    let key = |action| app.keymap.key_for(action, Context::Schedule);
    let state = match &app.schedule.draft {
        None => "This schedule is in use.".to_owned(),
        Some(_) => format!("Not in use yet: {} uses it, {} goes back.", key(Action::Confirm), key(Action::Discard)),
    };
    format!(
        "{state} In each episode, with this probability, actions come from the action clusters instead of the policy. \
         {} selects a point, arrows or the mouse move it, {} (hand-drawn: a click) adds one, {} deletes it, {} changes the kind; {} types it.",
        key(Action::NextPoint),
        key(Action::AddPoint),
        key(Action::DeletePoint),
        key(Action::Kind),
        app.keymap.key_for(Action::Epsilon, Context::Everywhere),
    )
}

/// Moves the selected point to an episode and a threshold.
pub fn drag(app: &mut App, episode: f32, value: f32) {
    let shown = app.schedule.shown(&app.desk.facts().settings.epsilon);
    let index = app.schedule.point.min(handles::points(&shown).len() - 1);
    let moved = handles::move_point(&shown, index, episode.round().max(0.0) as u32, value);
    change(app, moved);
}

/// Selects the point nearest to a place on the plot; where none is near, a hand-drawn
/// schedule gets another.
pub fn pick(app: &mut App, axes: &Axes, column: u16, row: u16) {
    let shown = app.schedule.shown(&app.desk.facts().settings.epsilon);
    let height = f32::from(axes.plot.height);
    let distance = |(episode, value): &(u32, f32)| {
        let x = axes.column(*episode as f32).unwrap_or(axes.plot.right());
        let y = f32::from(axes.plot.y) + axes.dot([1.0, height], *episode as f32, *value)[1];
        f32::from(x.abs_diff(column)) + 2.0 * (y - f32::from(row)).abs()
    };
    let points = handles::points(&shown);
    let nearest = (0..points.len()).min_by(|a, b| distance(&points[*a]).total_cmp(&distance(&points[*b])));
    app.schedule.point = nearest.unwrap_or(0);
    let far = nearest.is_none_or(|nearest| distance(&points[nearest]) > NEAR);
    if far && matches!(shown, EpsilonSchedule::Points(_)) {
        let episode = axes.x_at(column).round().max(0.0) as u32;
        let (schedule, added) = handles::insert_point(&shown, episode, axes.y_at(row));
        change(app, schedule);
        app.schedule.point = added;
    }
}

fn change(app: &mut App, schedule: EpsilonSchedule) {
    let in_use = &app.desk.facts().settings.epsilon;
    app.schedule.draft = Some(schedule).filter(|schedule| schedule != in_use);
    let shown = app.schedule.shown(in_use);
    app.schedule.point = app.schedule.point.min(handles::points(&shown).len() - 1);
}

/// What an action does on this screen.
pub fn perform(app: &mut App, action: Action) {
    let episodes = app.desk.facts().settings.episodes as u32;
    let shown = app.schedule.shown(&app.desk.facts().settings.epsilon);
    let points = handles::points(&shown);
    let index = app.schedule.point.min(points.len() - 1);
    if let Some([right, up]) = direction(action, 0.01, 0.1) {
        let (episode, value) = points[index];
        let episode = episode as f32 + right * span(app) as f32;
        let moved = handles::move_point(&shown, index, episode.round().max(0.0) as u32, value + up);
        return change(app, moved);
    }
    match action {
        Action::NextPoint => app.schedule.point = (index + 1) % points.len(),
        Action::PreviousPoint => app.schedule.point = (index + points.len() - 1) % points.len(),
        Action::AddPoint => {
            let (schedule, added) = handles::add_point(&shown, episodes, index);
            change(app, schedule);
            app.schedule.point = added;
        }
        Action::DeletePoint if !matches!(shown, EpsilonSchedule::Points(_)) => {
            let key = app.keymap.key_for(Action::AddPoint, Context::Schedule);
            app.say(Level::Info, format!("only a hand-drawn schedule has points to delete; {key} makes it one"));
        }
        Action::DeletePoint => change(app, handles::delete_point(&shown, index)),
        Action::Kind => change(app, handles::next_kind(&shown, episodes)),
        Action::Discard => app.schedule.draft = None,
        Action::Confirm => {
            app.line(&format!("epsilon {shown}"));
            app.schedule.draft = None;
        }
        _ => {}
    }
}
