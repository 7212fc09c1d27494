//! Charts of runs and groups, and their state, for the Training screen, the Scene screen and the preview of a run.

use std::borrow::Cow;

use educe::Educe;
use ratatui::prelude::*;

use super::{HitRegion, HitRegions, Ui};
use crate::tui::chart::{Curve, Plot, Range, Scale, Window, draw as draw_chart};
use crate::tui::view::{Curves, GroupCurves, RunGroup, RunSummary, ViewModel, XAxis};
use crate::tui::widgets::theme::Theme;
use mge_base::text::number;
use mge_run::Metric;
use mge_stats::rolling::WINDOW;

/// State of the curves.
#[derive(Debug, Educe)]
#[educe(Default)]
pub struct CurvesState {
    /// The episodes shown.
    pub range: Range,
    /// The episode whose values are shown, and which the scene shows.
    pub crosshair: Option<f32>,
    /// The episode under the mouse; its values are shown instead of those at the crosshair.
    pub hovered: Option<f32>,
    /// The selected curve.
    #[educe(Default = Metric::CURVES[0])]
    pub selected: Metric,
    /// What the curves are drawn against. Windows and the crosshair are of episodes.
    pub axis: XAxis,
    /// Whether only the selected curve is shown.
    pub alone: bool,
    /// Whether several runs are shown, not only the watched one.
    pub comparing: bool,
    /// Whether runs that differ in the seed only are one curve.
    #[educe(Default = true)]
    pub folded: bool,
}

/// Number of episodes over which values are averaged.
const SMOOTHING: usize = 10;

impl CurvesState {
    /// Removes the crosshair, or else shows all curves again, or ends a comparison; false if there is nothing to leave.
    pub fn leave(&mut self) -> bool {
        self.crosshair.take().is_some() || std::mem::take(&mut self.alone) || std::mem::take(&mut self.comparing)
    }

    /// Moves the crosshair to the past episode that is shown, or removes it when the past is left. On a screen that is
    /// not the one `here`, there is none before it is put there.
    pub fn follow(&mut self, before: Option<u64>, now: Option<u64>, here: bool) {
        if before != now {
            self.crosshair = now.filter(|_| here || self.crosshair.is_some()).map(|episode| episode as f32);
        }
    }

    /// What the selected curve means, in one line.
    pub(super) fn explanation(&self) -> String {
        if self.selected == Metric::Success {
            return format!("Share of the last {WINDOW} episodes that reached the goal; greedy: ● all, ○ none");
        }
        let meaning = self.selected.info().meaning.trim();
        meaning.split_inclusive(". ").next().unwrap_or_default().trim().to_owned()
    }

    /// Selects the curve that is `by` after the selected one.
    pub fn select_neighbour(&mut self, by: isize) {
        let count = Metric::CURVES.len();
        let now = Metric::CURVES.iter().position(|drawn| *drawn == self.selected).unwrap_or(0);
        self.selected = Metric::CURVES[(now + count).wrapping_add_signed(by) % count];
    }

    /// Smoothing of a metric: none for the success rate, which is a mean already, and for schedules, which are exact.
    pub(super) fn smoothing(metric: Metric) -> usize {
        match metric {
            Metric::Success | Metric::Epsilon | Metric::Noise => 1,
            _ => SMOOTHING,
        }
    }
}

/// Something with a curve: a run, with its group if that has several runs, or a whole group.
#[derive(Clone, Copy)]
pub enum Shown<'a> {
    /// A run.
    Run(&'a RunSummary, Option<&'a RunGroup>),
    /// A group.
    Group(&'a RunGroup, &'a GroupCurves),
}

impl<'a> Shown<'a> {
    /// A run as it is shown alone.
    pub fn run(run: &'a RunSummary, view: &'a ViewModel) -> Self {
        Self::Run(run, view.groups.of(&run.path))
    }

    /// Its task, its name in the legend, and those in place of one that something else on the task has, too.
    fn names(&self) -> (&'a str, Vec<String>) {
        match self {
            Self::Run(run, _) => {
                let seeded = format!("{}, seed {}", run.name, run.config.seed);
                (&run.config.task.name, vec![run.name.clone(), seeded, run.path.display().to_string()])
            }
            Self::Group(group, _) => (&group.task, vec![group.name.clone()]),
        }
    }

    fn color(&self) -> mge_figures::Color {
        match self {
            Self::Run(_, Some(group)) | Self::Group(group, _) => group.color,
            // It has not been grouped yet.
            Self::Run(run, None) => mge_figures::series(&[&run.label])[0].color,
        }
    }

    /// Its curves; those of a group are the interquartile means.
    pub fn curves(&self) -> &'a Curves {
        match self {
            Self::Run(run, _) => &run.curves,
            Self::Group(_, curves) => &curves.middle,
        }
    }

    fn band(&self, metric: Metric) -> Option<[&'a [f32]; 2]> {
        match self {
            Self::Run(..) => None,
            Self::Group(_, curves) => Some([curves.low.get(metric), curves.high.get(metric)]),
        }
    }

    fn evaluations(&self) -> &'a [(u64, f32)] {
        match self {
            Self::Run(run, _) => &run.evaluations,
            Self::Group(..) => &[],
        }
    }
}

/// Draws charts of some runs and groups.
pub struct Charts<'a> {
    state: &'a CurvesState,
    shown: Vec<Shown<'a>>,
    /// Names that set the curves apart; empty if there is only one curve.
    pub names: Vec<String>,
    colours: Vec<Color>,
    /// The episodes that the crosshair and the window are of.
    reference: Positions<'a>,
    ui: &'a Ui<'a>,
}

impl<'a> Charts<'a> {
    /// Charts of these, over the same episodes.
    pub fn new(state: &'a CurvesState, shown: Vec<Shown<'a>>, ui: &'a Ui<'a>) -> Self {
        let all: Vec<(&str, Vec<String>)> = shown.iter().map(Shown::names).collect();
        let names = all.iter().map(|(task, names)| {
            let is_own = |name: &&String| all.iter().filter(|(on, all)| on == task && all.contains(name)).count() == 1;
            let is_alone = all.iter().all(|(other, _)| other == task);
            let name = names.iter().find(is_own).unwrap_or(&names[0]);
            if is_alone { name.clone() } else { format!("{task}: {name}") }
        });
        let names = if shown.len() > 1 { names.collect() } else { vec![String::new()] };
        let colours = colours(&shown, ui.theme);
        let reference = reference(&shown, state.axis, ui);
        Self { state, shown, names, colours, reference, ui }
    }

    /// The curves that have one value throughout, the same for all that is shown, with that value.
    pub fn constants(&self) -> Vec<(Metric, String)> {
        let constant = |metric: &Metric| {
            let values = self.shown.iter().flat_map(|shown| shown.curves().get(*metric));
            let mut values = values.filter(|value| value.is_finite());
            let first = *values.next().unwrap_or(&f32::NAN);
            values.all(|value| *value == first).then(|| (*metric, number(first)))
        };
        let is_begun = episodes(&self.shown) > 0;
        Metric::CURVES.iter().filter(|_| is_begun).filter_map(constant).collect()
    }

    /// The episode at the crosshair, or under the mouse.
    pub fn crosshair(&self) -> Option<f32> {
        self.state.hovered.or(self.state.crosshair)
    }

    /// The place of an episode on the x axis.
    fn x_of(&self, episode: f32) -> f32 {
        self.reference.at(episode.round() as u64) as f32
    }

    /// The value of a metric of everything shown at the place of an episode, in the order of the legend.
    pub fn values_at(&self, metric: Metric, episode: f32) -> String {
        let x = self.x_of(episode) as u64;
        let value = |shown: &Shown| {
            let place = shown.curves().positions(self.state.axis).partition_point(|known| *known < x);
            number(shown.curves().get(metric).get(place).copied().unwrap_or(f32::NAN))
        };
        self.shown.iter().map(value).collect::<Vec<_>>().join(" / ")
    }

    /// Draws the chart of a metric.
    pub fn draw(&self, metric: Metric, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
        let (axis, smoothing) = (self.state.axis, CurvesState::smoothing(metric));
        let axes: Vec<Positions<'_>> = self.shown.iter().map(|shown| Positions::of(shown.curves(), axis)).collect();
        let greedy = self.shown.iter().zip(&axes).map(|(shown, axis)| match metric {
            Metric::Success => shown.evaluations().iter().map(|(episode, value)| (axis.at(*episode), *value)).collect(),
            _ => Vec::new(),
        });
        let greedy: Vec<Vec<(u64, f32)>> = greedy.collect();
        let curves = self.shown.iter().zip(&self.names).zip(&self.colours).enumerate();
        let curves = curves.map(|(index, ((shown, name), colour))| Curve {
            name,
            colour: *colour,
            episodes: &axes[index].positions,
            values: shown.curves().get(metric),
            band: shown.band(metric),
            // Of a long run, whose episodes are thinned, fewer values.
            smoothing: (smoothing * shown.curves().episodes().len() / shown.curves().last_episode().max(1)).max(1),
            // The first values of the success rate are means of fewer episodes.
            partial: if metric == Metric::Success { axes[index].at(WINDOW.get() as u64 - 1) } else { 0 },
            evaluations: &greedy[index],
        });
        let empty = match self.shown.first() {
            Some(Shown::Run(RunSummary { preparing: Some(it), .. }, _)) => {
                format!("before the first episode: {it}")
            }
            Some(Shown::Run(run, _)) if run.done > 0 => "its log is being read".to_owned(),
            Some(Shown::Run(run, _)) => format!("no episodes yet: {}", run.state_word()),
            _ => self.ui.text("no episodes yet: {train} trains"),
        };
        let averaged = if smoothing == 1 { String::new() } else { format!(", mean of {smoothing}") };
        let scale = if metric == Metric::CriticLoss { Scale::Log } else { Scale::Linear };
        let log = if scale == Scale::Log { ", log" } else { "" };
        let window = self.state.range.window(episodes(&self.shown));
        let x = match (axis, self.state.range) {
            (XAxis::Episodes, _) => window,
            (_, Range::Whole) => {
                let last = axes.iter().filter_map(|of| of.positions.last()).max().map_or(0, |last| *last);
                Window { from: 0.0, to: last.max(10) as f32 }
            }
            _ => Window { from: self.x_of(window.from), to: self.x_of(window.to) },
        };
        let has_groups = self.shown.iter().any(|shown| matches!(shown, Shown::Group(..)));
        // The place of an episode of a group.
        let mean = if has_groups && axis != XAxis::Episodes { "mean " } else { "" };
        let (size, name) = if axis == XAxis::Time { time_unit(x.to) } else { (1.0, axis.name()) };
        let title = format!("{}{averaged}{log}", metric.title());
        let more = self.ui.text(if self.state.alone { "more" } else { "more: {large} on screen {screen-training}" });
        let plot = Plot {
            title: &title,
            curves: curves.collect(),
            x,
            unit: (size, &format!("{mean}{name}")),
            y: metric.info().range,
            scale,
            crosshair: self.crosshair().map(|episode| [self.x_of(episode), episode]),
            more: &more,
            empty: &empty,
        };
        if let Some(axes) = draw_chart(&plot, area, self.ui.theme, buffer) {
            regions.push((axes.plot, HitRegion::Chart(axes, metric)));
        }
    }
}

/// A unit for times up to some milliseconds: its milliseconds and its name.
fn time_unit(last: f32) -> (f32, &'static str) {
    match last / 60e3 {
        ..10.0 => (1e3, "seconds"),
        ..600.0 => (60e3, "minutes"),
        _ => (3.6e6, "hours"),
    }
}

/// Where the episodes of the watched run are on the x axis, or else of what has most episodes.
pub fn reference<'a>(shown: &[Shown<'a>], axis: XAxis, ui: &Ui) -> Positions<'a> {
    let is_watched = |shown: &&Shown| matches!(shown, Shown::Run(run, _) if ui.is_watched(run));
    let longest = || shown.iter().max_by_key(|shown| shown.curves().last_episode());
    let chosen = shown.iter().find(is_watched).or_else(longest);
    chosen.map_or_else(Positions::default, |chosen| Positions::of(chosen.curves(), axis))
}

/// Where the episodes of a curve are on the x axis.
#[derive(Default)]
pub struct Positions<'a> {
    episodes: &'a [u64],
    positions: Cow<'a, [u64]>,
}

impl<'a> Positions<'a> {
    fn of(curves: &'a Curves, axis: XAxis) -> Self {
        Self { episodes: curves.episodes(), positions: curves.positions(axis) }
    }

    /// The position of an episode: that of the last one kept up to it.
    fn at(&self, episode: u64) -> u64 {
        if matches!(self.positions, Cow::Borrowed(_)) {
            return episode;
        }
        let kept = self.episodes.partition_point(|known| *known <= episode);
        kept.checked_sub(1).map_or(0, |last| self.positions[last])
    }

    /// The episode at a position, or the next one that is kept.
    pub fn episode_at(&self, position: f32) -> f32 {
        if matches!(self.positions, Cow::Borrowed(_)) {
            return position;
        }
        let place = self.positions.partition_point(|known| (*known as f32) < position);
        self.episodes.get(place).or(self.episodes.last()).map_or(0.0, |episode| *episode as f32)
    }
}

/// The colours of runs and groups: those of their groups, in shades if several are of one group.
pub fn colours(shown: &[Shown], theme: &Theme) -> Vec<Color> {
    let own: Vec<mge_figures::Color> = shown.iter().map(Shown::color).collect();
    let before = |index: usize| own[..index].iter().filter(|color| **color == own[index]).count();
    (0..own.len()).map(|index| theme.visible(mge_figures::shade(own[index], before(index)))).collect()
}

/// Episodes of the longest curve.
pub fn episodes(shown: &[Shown]) -> usize {
    shown.iter().map(|shown| shown.curves().last_episode()).max().unwrap_or(0)
}
