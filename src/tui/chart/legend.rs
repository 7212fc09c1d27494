//! Title and legend of a chart: the names of its curves with their latest values or those at the crosshair.

use std::collections::BTreeSet;

use ratatui::prelude::*;

use super::plot::{Curve, Plot};
use crate::tui::widgets::columns;
use crate::tui::widgets::theme::Theme;
use mge_base::text::number;

/// Least width of a name in columns; in a wide chart it has half of the width.
const NAME: usize = 24;
/// Least height of a chart whose curves are named, and of its plot.
const NAMED: u16 = 10;

/// Title and legend, on as many lines as they need and leave the plot its room. Names are cut only if they do not fit. In
/// a small chart, curves of which not all can be named have their values only: a large one names them. Curves that do
/// not fit are counted.
pub fn legend(plot: &Plot, area: Rect, theme: &Theme) -> Vec<Line<'static>> {
    let few = usize::from(area.height / 5).max(1) + usize::from(area.height >= 6);
    let most = few.max(area.height.saturating_sub(NAMED).into());
    let width = usize::from(area.width);
    let least = NAME.max(width / 2);
    for room in [width, least] {
        let (lines, left) = entries(plot, room, area, most, theme);
        if left == 0 || (room == least && area.height >= NAMED) {
            return lines;
        }
    }
    entries(plot, 0, area, most, theme).0
}

/// Title and legend on at most this many lines, with names of at most `room` columns, and the number of curves that do
/// not fit.
fn entries(plot: &Plot, room: usize, area: Rect, most: usize, theme: &Theme) -> (Vec<Line<'static>>, usize) {
    let mut lines = vec![Line::styled(columns::shortened(plot.title, usize::from(area.width), false), theme.strong())];
    if let Some([_, at]) = plot.crosshair {
        lines[0].push_span(Span::styled(format!("  episode {at:.0}"), theme.faint()));
    }
    let all = plot.curves.iter().filter(|curve| !curve.values.is_empty());
    let names: BTreeSet<&str> = plot.curves.iter().map(|curve| curve.name).collect();
    let text = |curve: &Curve| {
        // What sets the curves apart is kept.
        let name = columns::shortened_label(curve.name, &names, room);
        let value = number(curve.value(plot.crosshair.map(|[x, _]| x)));
        // Below the title, a number alone looks like one of the axis.
        let is_below = columns::width(plot.title) + value.len() + 2 > usize::from(area.width);
        let name = if name.is_empty() && is_below { "value".to_owned() } else { name };
        if name.is_empty() || room == 0 { format!("  {value}") } else { format!("  {name}: {value}") }
    };
    let texts: Vec<(String, Color)> = all.map(|curve| (text(curve), curve.colour)).collect();
    for (index, (text, colour)) in texts.iter().enumerate() {
        let left = texts.len() - index;
        let rest = format!("  +{left} {}", plot.more);
        let after = || texts[index + 1..].iter().map(|(text, _)| columns::width(text)).sum();
        let fits = |line: &Line, lines: usize| {
            let reserved = if lines == most { columns::width(&rest).min(after()) } else { 0 };
            line.width() + columns::width(text) + reserved <= usize::from(area.width)
        };
        if lines.len() < most && !fits(&lines[lines.len() - 1], lines.len()) {
            lines.push(Line::default());
        }
        let last = lines.len() - 1;
        if !fits(&lines[last], lines.len()) {
            lines[last].push_span(Span::styled(rest, theme.faint()));
            return (lines, left);
        }
        lines[last].push_span(Span::styled(text.clone(), Style::new().fg(*colour)));
    }
    (lines, 0)
}
