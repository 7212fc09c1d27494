//! What the scene shows.

use educe::Educe;
use image::{ImageBuffer, Luma};
use ratatui::style::Color;

use super::object::Objects;
use crate::tui::view::playback::PlaybackFrame;
use crate::tui::widgets::theme::Theme;
use mge_env::Action;
use mge_guidance::{ActionPrior, StagePrior};
use mge_physics::Tool;
use mge_task::Object;

/// Which overlays to show on the scene.
#[derive(Debug, Clone, Copy, Educe, PartialEq, Eq)]
#[educe(Default)]
pub struct Overlays {
    /// Means and one- and two-sigma ellipses of the action clusters.
    #[educe(Default = true)]
    pub clusters: bool,
    /// The rewarding actions behind the clusters.
    pub samples: bool,
    /// The critic's value of every action.
    pub critic: bool,
    /// Where the actor would place the tool.
    pub actor: bool,
    /// The model's prediction from the current action on.
    pub model: bool,
    /// The legend of the symbols.
    pub legend: bool,
}

/// A function of the action's position, sampled on a grid with the first row at the top.
pub type Heat = ImageBuffer<Luma<f32>, Vec<f32>>;

/// The smallest and largest finite value of a heat map; None if no value is finite.
pub(super) fn range(heat: &Heat) -> Option<[f32; 2]> {
    let finite = || heat.iter().copied().filter(|value| value.is_finite());
    Some([finite().reduce(f32::min)?, finite().reduce(f32::max)?])
}

/// A tool held over the scene, not placed yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Ghost {
    /// Its normalised position.
    pub action: Action,
    /// The tool at that position.
    pub tool: Tool,
    /// Why it cannot be placed there, if it cannot.
    pub refusal: Option<String>,
    /// The ball's normalised path as the chosen model predicts it.
    pub predicted: Vec<[f32; 2]>,
}

/// Everything to draw.
pub struct Content<'a> {
    /// The task and its proposed subgoals.
    pub objects: Objects<'a>,
    /// The state of the episode.
    pub frame: &'a PlaybackFrame,
    /// Which overlays to show.
    pub overlays: Overlays,
    /// The action clusters, and whether they are out of date.
    pub prior: Option<(&'a ActionPrior, bool)>,
    /// The critic's value of every action.
    pub heat: Option<&'a Heat>,
    /// The tool that the actor would place, at its position.
    pub choice: Option<Tool>,
    /// The normalised path that the model predicts from the current action on.
    pub predicted: &'a [[f32; 2]],
    /// The normalised path that the ball really took in that time.
    pub truth: &'a [[f32; 2]],
    /// The selected object.
    pub selected: Option<Object>,
    /// The tool in hand.
    pub ghost: Option<&'a Ghost>,
}

impl Content<'_> {
    /// The colour of a stage's clusters: the colour of its subgoal, or of the goal.
    pub(super) fn stage(&self, stage: usize, theme: &Theme) -> Color {
        if stage == self.objects.task.subgoals.len() { theme.goal } else { theme.stage(stage) }
    }

    /// The clusters of the stages shown, with their colours.
    pub(super) fn stages(&self, theme: &Theme) -> impl Iterator<Item = (Color, &StagePrior)> {
        let is_stale = self.prior.is_some_and(|(_, stale)| stale);
        let all = self.prior.into_iter().flat_map(|(prior, _)| prior.stages.iter().enumerate());
        all.map(move |(index, stage)| (if is_stale { theme.dim } else { self.stage(index, theme) }, stage))
    }
}
