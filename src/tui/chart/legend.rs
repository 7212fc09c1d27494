//! Title and legend of a chart: the names of its curves with their latest values or those at the crosshair.

use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::axes::number;
use super::plot::{Curve, Plot};
use crate::tui::widgets::columns;
use crate::tui::widgets::theme::Theme;

/// Least width of a name in columns; in a wide chart it has half of the width.
const NAME: usize = 24;
/// Columns reserved for the count of curves that do not fit.
const COUNT: usize = 10;

/// Title and legend, on as many lines as they need, at most a fifth of the area and one more. Curves that do not fit
/// are counted.
pub fn legend(plot: &Plot, area: Rect, theme: &Theme) -> Vec<Line<'static>> {
    let most = usize::from(area.height / 5).max(1) + usize::from(area.height >= 6);
    let mut lines = vec![Line::styled(columns::shortened(plot.title, usize::from(area.width), false), theme.strong())];
    if let Some([_, at]) = plot.crosshair {
        lines[0].push_span(Span::styled(format!("  episode {at:.0}"), theme.faint()));
    }
    let named: Vec<&Curve> = plot.curves.iter().filter(|curve| !curve.values.is_empty()).collect();
    for (index, curve) in named.iter().enumerate() {
        let left = named.len() - index;
        let name = columns::shortened(&curve.name, NAME.max(usize::from(area.width / 2)), true);
        let colon = if name.is_empty() { "" } else { ": " };
        let text = format!("  {name}{colon}{}", number(curve.value(plot.crosshair.map(|[x, _]| x))));
        let fits = |line: &Line, lines: usize| {
            let count = if lines == most && left > 1 { COUNT } else { 0 };
            line.width() + columns::width(&text) + count <= usize::from(area.width)
        };
        if lines.len() < most && !lines.last().is_some_and(|line| fits(line, lines.len())) {
            lines.push(Line::default());
        }
        let count = lines.len();
        let Some(line) = lines.last_mut() else { break };
        if !fits(line, count) {
            line.push_span(Span::styled(format!("  +{left} more"), theme.faint()));
            break;
        }
        line.push_span(Span::styled(text, Style::new().fg(curve.colour)));
    }
    lines
}
