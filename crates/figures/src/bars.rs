//! Grouped bars with intervals.

use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, TextFormat};
use super::geometry::Rect;
use super::style::{LABEL_SIZE, SMALL_SIZE, Series, TICK_LENGTH};
use mge_stats::Estimate;

/// A cluster of bars: one group per member, one bar per series.
pub struct BarCluster {
    /// Name below the members.
    pub label: String,
    /// Name of each member (may be empty), and its bars in the order of the series.
    pub members: Vec<(String, Vec<Estimate>)>,
}

/// Gap between clusters and between members, in widths of a bar.
const CLUSTER_GAP: f64 = 1.2;
const MEMBER_GAP: f64 = 0.5;

/// A member of a cluster with the x position of its left edge, in bar widths.
struct Placed<'b> {
    name: &'b str,
    bars: &'b [Estimate],
    left: f64,
}

/// Draws clusters of bars side by side, those of each member in the order of `series`. `title` is above the plot, and `label` at its y axis. Space for names of members is reserved even if there are none, so that
/// adjacent plots align.
pub fn grouped_bars(
    canvas: &Canvas,
    rect: Rect,
    [title, label]: [&str; 2],
    clusters: &[BarCluster],
    series: &[Series],
) {
    let mut x = CLUSTER_GAP / 2.0;
    let (mut placed, mut names) = (Vec::new(), Vec::new());
    for cluster in clusters {
        let start = x;
        for (n, (name, bars)) in cluster.members.iter().enumerate() {
            x += if n > 0 { MEMBER_GAP } else { 0.0 };
            placed.push(Placed { name, bars, left: x });
            x += bars.len() as f64;
        }
        names.push(((start + x) / 2.0, cluster.label.as_str()));
        x += CLUSTER_GAP;
    }
    let end = (x - CLUSTER_GAP / 2.0).max(1.0);
    let values = placed.iter().flat_map(|member| member.bars).flat_map(Estimate::values);
    let named = placed.iter().any(|member| !member.name.is_empty());
    let (rect, _) = rect.split_bottom(2.6 * SMALL_SIZE + TICK_LENGTH - 1.4 * SMALL_SIZE);
    let frame = Frame { title, grid: true, square: false };
    let axis = Axis::with_ticks("", 0.0, end, Vec::new());
    let plot = Plot::new(canvas, rect, &frame, axis, Axis::from_zero(label, values, 6));
    for member in &placed {
        for ((n, bar), series) in member.bars.iter().enumerate().zip(series) {
            let x = member.left + n as f64 + 0.5;
            plot.bar(x, 0.92, *bar, series.color);
        }
        let [x, y] =
            [plot.at(member.left + member.bars.len() as f64 / 2.0, 0.0)[0], plot.rect.bottom + 0.9 * SMALL_SIZE];
        canvas.text([x, y], member.name, TextFormat::SMALL.centered());
    }
    let line = plot.rect.bottom + if named { 0.9 * SMALL_SIZE + 1.3 * LABEL_SIZE } else { LABEL_SIZE };
    names.into_iter().for_each(|(x, name)| canvas.text([plot.at(x, 0.0)[0], line], name, TextFormat::SMALL.centered()))
}
