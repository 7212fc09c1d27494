//! The Schedule screen: the epsilon threshold, drawn and edited.

use ratatui::prelude::*;

use super::pane::{lines, pane};
use super::{HitRegion, HitRegions, Ui};
use crate::tui::chart::{Axes, Scale, Window};
use crate::tui::effect::Effect;
use crate::tui::view::{RunSummary, ViewModel};
use crate::tui::widgets::canvas;
use mge_guidance::EpsilonSchedule;
use mge_run::RunState;
use mge_workbench::command;

/// Greatest distance, in columns, at which the mouse selects a point.
const NEAR: u16 = 4;

/// The points by which a schedule is edited, in order: episode and threshold.
type Points = Vec<(u32, f32)>;

/// State of the editor.
#[derive(Debug, Clone, Default)]
pub struct Schedule {
    /// The points as edited; None if the schedule is the one in use.
    draft: Option<Points>,
    /// The selected point.
    point: usize,
    /// Earlier drafts, the latest last.
    before: Vec<Option<Points>>,
}

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

    /// Like [`Schedule::change`], as a step that can be undone.
    fn edit(&mut self, view: &ViewModel, edit: impl FnOnce(&mut Points, usize) -> usize) {
        self.before.push(self.draft.clone());
        self.change(view, edit);
    }

    /// Changes the points; `edit` gets the index of the selected one, and returns that of the one to select.
    fn change(&mut self, view: &ViewModel, edit: impl FnOnce(&mut Points, usize) -> usize) {
        let mut points = self.points(view);
        let selected = self.point.min(points.len() - 1);
        self.point = edit(&mut points, selected);
        self.draft = Some(points).filter(|points| *points != in_use(view));
    }

    /// The schedule as edited, or the one in use.
    pub fn shown(&self, view: &ViewModel) -> EpsilonSchedule {
        self.draft.clone().map_or_else(|| view.settings.epsilon.clone(), EpsilonSchedule::Points)
    }

    /// Its points.
    fn points(&self, view: &ViewModel) -> Points {
        self.draft.clone().unwrap_or_else(|| in_use(view))
    }
}

/// The points of a hand-drawn schedule that approximates the one in use.
fn in_use(view: &ViewModel) -> Points {
    /// Points that replace a curve.
    const SAMPLES: u32 = 8;
    let (schedule, episodes) = (&view.settings.epsilon, view.settings.episodes.max(1));
    let points = match schedule {
        EpsilonSchedule::Constant(_) | EpsilonSchedule::Need { .. } => schedule.to_points(episodes, 2),
        EpsilonSchedule::Linear { from, to, episodes } => vec![(0, *from), (*episodes, *to)],
        _ => schedule.to_points(episodes, SAMPLES),
    };
    points.into_iter().map(|(episode, value)| (episode, rounded(value))).collect()
}

fn rounded(value: f32) -> f32 {
    (value.clamp(0.0, 1.0) * 1000.0).round() / 1000.0
}

/// Moves a point, between its neighbours and not beyond the `end` of the run.
fn move_point(points: &mut Points, index: usize, episode: f32, value: f32, end: u32) {
    let low = index.checked_sub(1).map_or(0, |before| points[before].0.saturating_add(1));
    let high = points.get(index + 1).map_or(end.max(points[index].0), |after| after.0.saturating_sub(1));
    points[index] = ((episode.round() as u32).clamp(low, high.max(low)), rounded(value));
}

/// Adds a point, or replaces the one at the same episode, and returns its index.
fn insert_point(points: &mut Points, episode: u32, value: f32) -> usize {
    let at = points.partition_point(|point| point.0 < episode);
    match points.get_mut(at) {
        Some(point) if point.0 == episode => point.1 = rounded(value),
        _ => points.insert(at, (episode, rounded(value))),
    }
    at
}

/// Episodes the plot shows: those of the next run, and all points.
fn span(state: &Schedule, view: &ViewModel) -> u32 {
    let last = state.points(view).last().map_or(0, |point| point.0);
    view.settings.episodes.max(last.saturating_add(last / 20)).max(10)
}

/// Draws the screen.
pub fn draw(state: &Schedule, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let Ui { view, theme, .. } = *ui;
    let shown = state.shown(view);
    let title = format!("epsilon threshold · {shown}");
    let inside = pane(&title, area, theme, buffer);
    let text = explanation(state, ui);
    let text = Text::from_iter(lines(&text, inside.width.saturating_sub(2), theme.faint()));
    let rows = Constraint::Length((text.height() as u16).min(inside.height / 3));
    let [_, plot, _, below] =
        Layout::vertical([Constraint::Length(1), Constraint::Fill(1), Constraint::Length(1), rows])
            .areas(inside.inner(Margin::new(1, 0)));
    let window = Window { from: 0.0, to: span(state, ui.view) as f32 };
    if let Some(axes) = Axes::draw(plot, (window, (1.0, "episode")), [0.0, 1.0], Scale::Linear, theme, buffer) {
        canvas::draw(axes.plot, theme.marker, axes.bounds(), buffer, |context| {
            if state.draft.is_some() {
                canvas::path(context, &trace(&view.settings.epsilon, &axes), theme.dim);
            }
            canvas::path(context, &trace(&shown, &axes), theme.accent);
        });
        if let Some(run) = taker(ui) {
            axes.bar(run.done as f32, Style::new().fg(theme.good), buffer);
        }
        points(state, ui, &axes, buffer);
        regions.push((axes.plot, HitRegion::Schedule(axes)));
    }
    text.render(below, buffer);
}

/// A schedule as a line over all columns of dots.
fn trace(schedule: &EpsilonSchedule, axes: &Axes) -> Vec<[f32; 2]> {
    let columns = 2 * axes.plot.width;
    let episode = |column: u16| axes.x.to * f32::from(column) / f32::from(columns);
    (0..=columns).map(episode).map(|episode| [episode, schedule.threshold(episode as u32)]).collect()
}

fn points(state: &Schedule, ui: &Ui, axes: &Axes, buffer: &mut Buffer) {
    for (index, (episode, value)) in state.points(ui.view).into_iter().enumerate() {
        let (Some(column), Some(row)) = (axes.column(episode as f32), axes.row(value)) else { continue };
        let selected = index == state.point;
        let style = Style::new().fg(ui.theme.warn).add_modifier(Modifier::BOLD);
        buffer.set_string(column, row, if selected { "●" } else { "○" }, style);
        if selected {
            let text = format!(" {episode}: {} ", rounded(value));
            let width = text.len() as u16;
            let x = if column + 1 + width < axes.plot.right() { column + 1 } else { column.saturating_sub(width) };
            buffer.set_string(x, row, text, ui.theme.selected());
        }
    }
}

/// The run that takes a schedule that is applied: the watched one while it is in training, here or in another program.
fn taker<'a>(ui: &Ui<'a>) -> Option<&'a RunSummary> {
    ui.subject.run().filter(|run| run.active || matches!(run.state, RunState::Running | RunState::Paused))
}

fn explanation(state: &Schedule, ui: &Ui) -> String {
    let settings = &ui.view.settings;
    let method = settings.method;
    let usage = match (&state.draft, taker(ui)) {
        _ if !method.uses("epsilon") => format!("Not used by the method of the next run: {}.", method.label()),
        (None, Some(run)) if run.config.epsilon != settings.epsilon => {
            format!("Of the next run. {} has {}; one applied here is for both.", run.name, run.config.epsilon)
        }
        (None, _) => "This schedule is in use.".to_owned(),
        (Some(_), Some(run)) => {
            let name = &run.name;
            format!("Not in use yet: {{apply}} uses it in {name}, from its next episode on, and in the next run.")
        }
        (Some(_), None) if matches!(settings.epsilon, EpsilonSchedule::Need { .. }) => {
            "Not in use: the next run explores by need, unless {apply} replaces that by this schedule.".to_owned()
        }
        (Some(_), None) => "Not in use yet: {apply} uses it.".to_owned(),
    };
    let back = if state.draft.is_some() { " {discard} goes back." } else { "" };
    let meaning = match state.shown(ui.view) {
        EpsilonSchedule::Need { .. } => {
            "In each stage, actions come from the action clusters with this probability times its need (share of \
             failures)."
        }
        _ => "In each episode, with this probability, actions come from the action clusters instead of the policy.",
    };
    let help = "{next-point} selects a point, arrows or the mouse move it, {add-point} or a click adds one, {delete-point} deletes it; {epsilon} types another schedule.";
    ui.text(&format!("{usage}{back} {meaning} {help}"))
}

/// Moves the selected point to an episode and a threshold.
pub fn drag(state: &mut Schedule, view: &ViewModel, episode: f32, value: f32) {
    state.change(view, |points, selected| {
        move_point(points, selected, episode, value, view.settings.episodes);
        selected
    });
}

/// Selects the point nearest to a place on the plot; if none is near, adds one there.
pub fn pick(state: &mut Schedule, view: &ViewModel, axes: &Axes, column: u16, row: u16) {
    let distance = |(episode, value): &(u32, f32)| {
        let x = axes.column(*episode as f32).unwrap_or(axes.plot.right());
        let y = axes.row(*value).unwrap_or(axes.plot.bottom());
        x.abs_diff(column) + 2 * y.abs_diff(row)
    };
    state.edit(view, |points, selected| {
        let nearest = (0..points.len()).min_by_key(|index| distance(&points[*index])).unwrap_or(selected);
        match distance(&points[nearest]) > NEAR {
            true => {
                insert_point(points, (axes.x_at(column).round() as u32).min(view.settings.episodes), axes.y_at(row))
            }
            false => nearest,
        }
    });
}

/// Moves the selected point in a direction.
pub fn move_by(state: &mut Schedule, ui: &Ui, [right, up]: [f32; 2], far: bool) -> Vec<Effect> {
    let step = if far { 0.1 } else { 0.01 };
    let episodes = step * right * span(state, ui.view) as f32;
    state.edit(ui.view, |points, selected| {
        let (episode, value) = points[selected];
        move_point(points, selected, episode as f32 + episodes, value + step * up, ui.view.settings.episodes);
        selected
    });
    Vec::new()
}

/// Selects the point that is `by` after the selected one.
pub fn select_neighbour(state: &mut Schedule, ui: &Ui, by: isize) {
    let count = state.points(ui.view).len();
    state.point = (state.point.min(count - 1) + count).wrapping_add_signed(by) % count;
}

/// Adds a point between the selected one and the next, or the end of the run.
pub fn add_point(state: &mut Schedule, ui: &Ui) -> Vec<Effect> {
    let (shown, points) = (state.shown(ui.view), state.points(ui.view));
    let selected = state.point.min(points.len() - 1);
    let (from, next) = (points[selected].0, points.get(selected + 1));
    let room = next.map_or(ui.view.settings.episodes, |next| next.0).saturating_sub(from);
    if room <= u32::from(next.is_some()) {
        let text = "no episode of the run is left after this point: {next-point} selects another one";
        return vec![Effect::info(ui.text(text))];
    }
    let episode = from + room.div_ceil(2);
    state.edit(ui.view, |points, _| insert_point(points, episode, shown.threshold(episode)));
    Vec::new()
}

/// Deletes the selected point, unless it is the only one.
pub fn delete_point(state: &mut Schedule, ui: &Ui) -> Vec<Effect> {
    if state.points(ui.view).len() == 1 {
        return vec![Effect::info("the only point is not deleted: it can be moved")];
    }
    state.edit(ui.view, |points, selected| {
        points.remove(selected);
        selected.min(points.len() - 1)
    });
    Vec::new()
}

/// Uses the schedule as edited.
pub fn apply(state: &Schedule, ui: &Ui) -> Vec<Effect> {
    vec![Effect::apply(command::Epsilon(state.shown(ui.view)))]
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
        assert_eq!(state.draft.unwrap(), [(0, 0.8), (700, 0.5)]);
    }

    fn edited(in_use: &str, edit: impl FnOnce(&mut Points, usize) -> usize) -> (String, usize) {
        let mut view = empty();
        view.settings.epsilon = in_use.parse().unwrap();
        let mut state = Schedule { point: 1, ..Schedule::default() };
        state.change(&view, edit);
        (state.shown(&view).to_string(), state.point)
    }

    #[test]
    fn a_point_stays_between_its_neighbours() {
        for (episode, value, expected) in [
            (150.0, 0.5, "points:0=0.8,150=0.5,200=0"),
            (999.0, 0.5, "points:0=0.8,199=0.5,200=0"),
            (-9.0, 0.3333, "points:0=0.8,1=0.333,200=0"),
            (100.0, 2.0, "points:0=0.8,100=1,200=0"),
        ] {
            let moved = edited("points:0=0.8,100=0.4,200=0", |points, selected| {
                move_point(points, selected, episode, value, 1500);
                selected
            });
            assert_eq!(moved, (expected.to_owned(), 1));
        }
    }

    #[test]
    fn points_are_inserted_or_replaced_at_an_episode() {
        for (episode, expected, index) in [
            (400, "points:0=0.8,400=0.5,1000=0", 1),
            (2000, "points:0=0.8,1000=0,2000=0.5", 2),
            (1000, "points:0=0.8,1000=0.5", 1),
        ] {
            let inserted = edited("linear:0.8:0:1000", |points, _| insert_point(points, episode, 0.5));
            assert_eq!(inserted, (expected.to_owned(), index));
        }
    }

    #[test]
    fn points_lie_on_their_schedule() {
        for spec in ["0.5", "linear:0.8:0:1000", "exp:0.8:0.1:0.99", "step:0.8:0.5:500", "points:0=0.8,100=0.4"] {
            let mut view = empty();
            view.settings.epsilon = spec.parse().unwrap();
            for (episode, value) in in_use(&view) {
                assert!((view.settings.epsilon.threshold(episode) - value).abs() < 0.001, "{spec} at {episode}");
            }
        }
    }
}
