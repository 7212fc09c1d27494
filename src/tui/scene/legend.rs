//! The legend of the symbols in the scene, and the scale of the critic's heat map.

use ratatui::prelude::*;

use super::content::{Content, range};
use crate::tui::widgets::theme::Theme;
use mge_base::text::number;
use mge_trainer::Source;

/// The signs that are visible, with their meanings.
pub fn legend(content: &Content, theme: &Theme) -> Vec<Line<'static>> {
    let [disc, circle, block, outline, line, dots, mean] = ["●", "○", "■", "□", "─", "··", "+"];
    let task = content.objects.task;
    let frame = content.frame;
    let placed = |from: Source| frame.placed.iter().any(|(_, source)| *source == from);
    let others = frame.placed.iter().any(|(_, source)| *source != Source::Clusters);
    let (overlays, stale) = (content.overlays, content.prior.is_some_and(|(_, stale)| stale));
    let clusters = content.prior.is_some() && overlays.clusters;
    let has_marker_subgoals = task.marker.as_ref().is_some_and(|marker| !marker.subgoals.is_empty());
    let all: [(bool, &str, &str, Color); 20] = [
        (true, disc, "ball", theme.ball),
        (task.marker.is_some(), circle, "marker: sets the ball in motion", theme.ball),
        (has_marker_subgoals, circle, "subgoals of the marker", theme.dim),
        (!task.balls.is_empty(), circle, "other balls", theme.ball),
        (!task.boxes.is_empty(), outline, "moving boxes", theme.ball),
        (!frame.trail.is_empty(), dots, "where the ball was", theme.trail),
        (!task.subgoals.is_empty(), "1", "subgoals, in their order", theme.stage(0)),
        (true, "G", "goal", theme.goal),
        (!content.objects.proposed.is_empty(), "1?", "proposed subgoals", theme.warn),
        (!task.tools.is_empty(), block, "tools of the scene", theme.tool),
        (others, block, "placed by policy, planner or hand", theme.placed),
        (placed(Source::Clusters), block, "placed from the clusters", theme.stage(0)),
        (frame.blocked.is_some(), outline, "blocked: it would touch something", theme.bad),
        (clusters && !stale, mean, "action clusters: mean, 1 and 2 deviations", theme.stage(0)),
        (clusters && stale, mean, "action clusters that are out of date", theme.dim),
        (content.prior.is_some() && overlays.samples, dots, "rewarding actions behind the clusters", theme.stage(0)),
        (
            content.heat.is_some() && overlays.critic,
            block,
            "critic: the value of placing the tool there",
            theme.heat(0.7),
        ),
        (overlays.actor && content.choice.is_some(), outline, "where the actor would place the tool", theme.warn),
        (!content.predicted.is_empty(), line, "what the model predicts", theme.accent),
        (!content.truth.is_empty(), dots, "what really happened then", theme.good),
    ];
    let sign = |(_, sign, text, colour): (bool, &str, &str, Color)| {
        Line::from(vec![Span::styled(format!("{sign:<2} "), Style::new().fg(colour)), Span::raw(text.to_owned())])
    };
    all.into_iter().filter(|(is_shown, ..)| *is_shown).map(sign).collect()
}

/// The colour scale of the heat map, from its smallest to its largest value, if it is shown.
pub fn scale(content: &Content, theme: &Theme) -> Option<Line<'static>> {
    let [low, high] = range(content.heat.filter(|_| content.overlays.critic)?)?;
    let mut spans = vec![Span::raw(format!("critic {} ", number(low)))];
    spans.extend((0..=8).map(|step| Span::styled(" ", Style::new().bg(theme.heat(step as f32 / 8.0)))));
    spans.push(Span::raw(format!(" {}", number(high))));
    Some(Line::from(spans))
}
