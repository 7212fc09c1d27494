//! The Schedule screen: the epsilon threshold, drawn and edited.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Margin, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::Text;
use ratatui::widgets::Widget;

use super::pane::{lines, pane};
use super::{HitRegion, HitRegions, Ui, schedule_points};
use crate::tui::chart::{Axes, Scale, Window};
use crate::tui::effect::Effect;
use crate::tui::view::{RunSummary, ViewModel};
use crate::tui::widgets::canvas;
use mge_guidance::EpsilonSchedule;
use mge_workbench::command;

/// Greatest distance, in columns, at which the mouse selects a point.
const NEAR: u16 = 4;

/// State of the editor.
#[derive(Debug, Default)]
pub struct Schedule {
    /// The schedule as edited; None if it is the one in use.
    draft: Option<EpsilonSchedule>,
    /// The selected point.
    point: usize,
    /// Earlier drafts, the latest last.
    before: Vec<Option<EpsilonSchedule>>,
}

/// Maximum number of edits that can be undone.
const MAX_UNDO: usize = 1000;

impl Schedule {
    /// Whether the schedule differs from the one in use.
    pub fn is_edited(&self) -> bool {
        self.draft.is_some()
    }

    /// Undoes the latest edit; false if there is none.
    pub fn undo(&mut self) -> bool {
        while let Some(before) = self.before.pop() {
            if before != self.draft {
                self.draft = before;
                return true;
            }
        }
        false
    }

    /// Goes back to the schedule in use.
    pub fn discard(&mut self) {
        (self.draft, self.before) = (None, Vec::new());
    }

    /// Keeps the present draft, for undo.
    fn remember(&mut self) {
        if self.before.len() == MAX_UNDO {
            self.before.remove(0);
        }
        self.before.push(self.draft.clone());
    }

    fn change(&mut self, schedule: EpsilonSchedule, in_use: &EpsilonSchedule) {
        self.draft = Some(schedule).filter(|schedule| schedule != in_use);
        let shown = self.shown(in_use);
        self.point = self.point.min(schedule_points::points(&shown).len() - 1);
    }

    /// The schedule as edited, or the one in use.
    fn shown(&self, in_use: &EpsilonSchedule) -> EpsilonSchedule {
        self.draft.clone().unwrap_or_else(|| in_use.clone())
    }
}

/// Episodes the plot shows: those of the next run, and all points.
fn span(state: &Schedule, view: &ViewModel) -> u32 {
    let settings = &view.settings;
    let shown = state.shown(&settings.epsilon);
    let last = schedule_points::points(&shown).last().map_or(0, |point| point.0);
    settings.episodes.max(last.saturating_add(last / 20)).max(10)
}

/// Draws the screen.
pub fn draw(state: &Schedule, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let shown = state.shown(&view.settings.epsilon);
    let title = format!("epsilon threshold · {} · {shown}", schedule_points::kind(&shown));
    let inside = pane(&title, area, theme, buffer);
    let text = explanation(state, ui);
    let text = Text::from_iter(lines(&text, inside.width.saturating_sub(2), theme.faint()));
    let rows = Constraint::Length((text.height() as u16).min(inside.height / 3));
    let [_, plot, _, below] =
        Layout::vertical([Constraint::Length(1), Constraint::Fill(1), Constraint::Length(1), rows])
            .areas(inside.inner(Margin::new(1, 0)));
    let window = Window { from: 0.0, to: span(state, ui.view) as f32 };
    if let Some(axes) = Axes::draw(plot, (window, 1.0), [0.0, 1.0], Scale::Linear, theme, buffer) {
        canvas::draw(axes.plot, theme.marker, axes.bounds(), buffer, |context| {
            if state.draft.is_some() {
                canvas::path(context, &trace(&view.settings.epsilon, &axes), theme.dim);
            }
            canvas::path(context, &trace(&shown, &axes), theme.accent);
        });
        progress(ui, &axes, buffer);
        points(state, ui, &shown, &axes, buffer);
        regions.add(axes.plot, HitRegion::Schedule(axes));
    }
    text.render(below, buffer);
}

/// A schedule as a line over all columns of dots.
fn trace(schedule: &EpsilonSchedule, axes: &Axes) -> Vec<[f32; 2]> {
    let columns = 2 * axes.plot.width;
    let episode = |column: u16| axes.x.to * f32::from(column) / f32::from(columns);
    (0..=columns).map(episode).map(|episode| [episode, schedule.threshold(episode as u32)]).collect()
}

/// A line at the episode of the running training.
fn progress(ui: &Ui, axes: &Axes, buffer: &mut Buffer) {
    let run = ui.subject.run().filter(|run| run.active);
    let Some(column) = run.and_then(|run| axes.column(run.done as f32)) else { return };
    let bar = ui.theme.symbol("┊", "|");
    for row in axes.plot.top()..axes.plot.bottom() {
        buffer.set_string(column, row, bar, Style::new().fg(ui.theme.good));
    }
}

fn points(state: &Schedule, ui: &Ui, shown: &EpsilonSchedule, axes: &Axes, buffer: &mut Buffer) {
    let (mark, chosen) = (ui.theme.symbol("○", "o"), ui.theme.symbol("●", "@"));
    for (index, (episode, value)) in schedule_points::points(shown).into_iter().enumerate() {
        let (Some(column), Some(row)) = (axes.column(episode as f32), axes.row(value)) else { continue };
        let selected = index == state.point;
        let style = Style::new().fg(ui.theme.warn).add_modifier(Modifier::BOLD);
        buffer.set_string(column, row, if selected { chosen } else { mark }, style);
        if selected {
            let text = format!(" {episode}: {value:.2} ");
            let width = text.len() as u16;
            let x = if column + 1 + width < axes.plot.right() { column + 1 } else { column.saturating_sub(width) };
            buffer.set_string(x, row, text, ui.theme.selected());
        }
    }
}

fn explanation(state: &Schedule, ui: &Ui) -> String {
    let settings = &ui.view.settings;
    let method = settings.method;
    let usage = match &state.draft {
        None if !method.uses("epsilon") => format!("Not used by the method of the next run: {}.", method.label()),
        None => "This schedule is in use.".to_owned(),
        Some(_) => "Not in use yet: {apply} uses it, {discard} goes back.".to_owned(),
    };
    let meaning = match state.shown(&settings.epsilon) {
        EpsilonSchedule::Need { .. } => {
            let now = ui.subject.run().and_then(RunSummary::needs_text);
            let now = now.map_or_else(String::new, |needs| format!(": now {needs}"));
            format!(
                "In each stage, actions come from the action clusters with this probability times its need (share of \
                 failures{now})."
            )
        }
        _ => "In each episode, with this probability, actions come from the action clusters instead of the policy."
            .to_owned(),
    };
    let help = "{next-point} selects a point, arrows or the mouse move it, {add-point} (hand-drawn: a click) adds one, {delete-point} deletes it, {kind} changes the kind; {epsilon} types it.";
    ui.text(&format!("{usage} {meaning} {help}"))
}

/// Moves the selected point to an episode and a threshold.
pub fn drag(state: &mut Schedule, view: &ViewModel, episode: f32, value: f32) {
    let in_use = &view.settings.epsilon;
    let shown = state.shown(in_use);
    let index = state.point.min(schedule_points::points(&shown).len() - 1);
    let moved = schedule_points::move_point(&shown, index, episode.round().max(0.0) as u32, value);
    state.change(moved, in_use);
}

/// Selects the point nearest to a place on the plot; if none is near, adds one to a hand-drawn schedule.
pub fn pick(state: &mut Schedule, view: &ViewModel, axes: &Axes, column: u16, row: u16) {
    state.remember();
    let in_use = &view.settings.epsilon;
    let shown = state.shown(in_use);
    let distance = |(episode, value): &(u32, f32)| {
        let x = axes.column(*episode as f32).unwrap_or(axes.plot.right());
        let y = axes.row(*value).unwrap_or(axes.plot.bottom());
        x.abs_diff(column) + 2 * y.abs_diff(row)
    };
    let points = schedule_points::points(&shown);
    let nearest = (0..points.len()).min_by_key(|index| distance(&points[*index]));
    state.point = nearest.unwrap_or(0);
    let far = nearest.is_none_or(|nearest| distance(&points[nearest]) > NEAR);
    if far && matches!(shown, EpsilonSchedule::Points(_)) {
        let episode = axes.x_at(column).round().max(0.0) as u32;
        let (schedule, added) = schedule_points::insert_point(points, episode, axes.y_at(row));
        state.change(schedule, in_use);
        state.point = added;
    }
}

/// The schedule shown and the index of the selected point, before an edit that can be undone.
fn begin_edit(state: &mut Schedule, ui: &Ui) -> (EpsilonSchedule, usize) {
    state.remember();
    let shown = state.shown(&ui.view.settings.epsilon);
    let index = state.point.min(schedule_points::points(&shown).len() - 1);
    (shown, index)
}

/// Moves the selected point in a direction.
pub fn move_by(state: &mut Schedule, ui: &Ui, [right, up]: [f32; 2], far: bool) -> Vec<Effect> {
    let (shown, index) = begin_edit(state, ui);
    let (episode, value) = schedule_points::points(&shown)[index];
    let step = if far { 0.1 } else { 0.01 };
    let episode = episode as f32 + step * right * span(state, ui.view) as f32;
    let moved = schedule_points::move_point(&shown, index, episode.round().max(0.0) as u32, value + step * up);
    state.change(moved, &ui.view.settings.epsilon);
    Vec::new()
}

/// Selects the point that is `by` after the selected one.
pub fn select_neighbour(state: &mut Schedule, ui: &Ui, by: isize) {
    let count = schedule_points::points(&state.shown(&ui.view.settings.epsilon)).len();
    state.point = (state.point.min(count - 1) + count).wrapping_add_signed(by) % count;
}

/// Adds a point after the selected one.
pub fn add_point(state: &mut Schedule, ui: &Ui) {
    let (shown, index) = begin_edit(state, ui);
    let (schedule, added) = schedule_points::add_point(&shown, ui.view.settings.episodes, index);
    state.change(schedule, &ui.view.settings.epsilon);
    state.point = added;
}

/// Deletes the selected point of a hand-drawn schedule.
pub fn delete_point(state: &mut Schedule, ui: &Ui) -> Vec<Effect> {
    let (shown, index) = begin_edit(state, ui);
    if !matches!(shown, EpsilonSchedule::Points(_)) {
        let text = "only a hand-drawn schedule has points to delete; {add-point} makes it one";
        return vec![Effect::info(ui.text(text))];
    }
    state.change(schedule_points::delete_point(&shown, index), &ui.view.settings.epsilon);
    Vec::new()
}

/// Changes to the next kind of schedule.
pub fn next_kind(state: &mut Schedule, ui: &Ui) {
    let (shown, _) = begin_edit(state, ui);
    state.change(schedule_points::next_kind(&shown, ui.view.settings.episodes), &ui.view.settings.epsilon);
}

/// Uses the schedule as edited.
pub fn apply(state: &mut Schedule, ui: &Ui) -> Vec<Effect> {
    let shown = state.shown(&ui.view.settings.epsilon);
    state.discard();
    vec![Effect::apply(command::Epsilon(shown))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::testing::empty;

    #[test]
    fn dragging_a_removed_point_moves_the_last_one() {
        let mut view = empty();
        view.settings.epsilon = "points:0=0.8,1500=0.1".parse().unwrap();
        let mut state = Schedule { point: 5, ..Schedule::default() };
        drag(&mut state, &view, 700.0, 0.5);
        assert_eq!(state.draft.unwrap().to_string(), "points:0=0.8,700=0.5");
    }
}
