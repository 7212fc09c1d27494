//! Title and legend of a chart: the names of its curves with their latest values or those at the crosshair.

use std::cell::OnceCell;
use std::collections::HashSet;

use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::axes::number;
use super::decimated::place;
use super::plot::{Curve, Plot};
use crate::tui::widgets::columns;
use crate::tui::widgets::theme::Theme;

/// Widths in columns to which names may be shortened.
const SHORT: [usize; 4] = [24, 16, 12, 8];

/// The widths to which the names of curves can be shortened without two becoming equal, widest first. Only
/// widths below the longest name count.
pub fn shortenings(names: &[&str]) -> Vec<usize> {
    let longest = names.iter().map(|name| columns::width(name)).max().unwrap_or(0);
    let different: HashSet<&str> = names.iter().copied().collect();
    let are_different = |size: &usize| {
        let mut seen = HashSet::new();
        different.iter().all(|name| seen.insert(columns::shortened(name, *size, false)))
    };
    SHORT.into_iter().filter(|size| *size < longest).take_while(are_different).collect()
}

/// Limits of a legend.
#[derive(Clone, Copy)]
struct Sizes {
    /// Maximum width of a name in columns.
    name: usize,
    /// The word before the crosshair's episode.
    word: &'static str,
    /// Additional lines.
    lines: usize,
}

/// A curve in the legend.
struct Entry<'a> {
    curve: &'a Curve<'a>,
    /// The formatted value, computed on first use.
    value: OnceCell<String>,
}

impl Entry<'_> {
    fn value(&self, crosshair: Option<f32>) -> &str {
        let Curve { values, episodes, .. } = self.curve;
        let read = || match crosshair {
            None => values.iter().rev().copied().find(|value| value.is_finite()),
            Some(at) => values.get(place(episodes, at.round() as u64)).copied(),
        };
        self.value.get_or_init(|| read().map_or_else(|| "-".to_owned(), number))
    }
}

/// Title and legend. If there is not enough room, names are shortened, then a line is added; curves that still do not
/// fit are counted.
pub fn legend(plot: &Plot, area: Rect, theme: &Theme) -> Vec<Line<'static>> {
    let named = plot.curves.iter().filter(|curve| !curve.values.is_empty());
    let all: Vec<Entry> = named.map(|curve| Entry { curve, value: OnceCell::new() }).collect();
    let whole = Sizes { name: usize::MAX, word: "episode", lines: 0 };
    let shortened = plot.shortenings.iter().map(|name| Sizes { name: *name, ..whole });
    let short = Sizes { name: plot.shortenings.last().copied().unwrap_or(usize::MAX), word: "at", lines: 0 };
    let more = (area.height >= 6).then_some(Sizes { lines: 1, ..short });
    let mut found = entries(plot, &all, whole, area, theme);
    for sizes in shortened.chain([short]).chain(more) {
        if found.1 == 0 {
            break;
        }
        let other = entries(plot, &all, sizes, area, theme);
        if other.1 < found.1 {
            found = other;
        }
    }
    found.0
}

/// Title and legend, and the number of curves that do not fit.
fn entries(plot: &Plot, all: &[Entry], sizes: Sizes, area: Rect, theme: &Theme) -> (Vec<Line<'static>>, usize) {
    /// Columns reserved for the count of curves that do not fit.
    const COUNT: usize = 10;
    let mut lines = vec![Line::styled(plot.title.to_owned(), theme.strong())];
    if let Some(at) = plot.crosshair {
        lines[0].push_span(Span::styled(format!("  {} {at:.0}", sizes.word), theme.faint()));
    }
    let most = usize::from(area.height / 5).max(1) + sizes.lines;
    let mut taken = lines[0].width();
    let mut left = all.len();
    for entry in all {
        let name = columns::shortened(&entry.curve.name, sizes.name, false);
        let text = format!("  {name} {}", entry.value(plot.crosshair));
        let width = columns::width(&text);
        let has_room = |taken: usize, lines: usize| {
            let count = if lines == most && left > 1 { COUNT } else { 0 };
            taken + width + count <= usize::from(area.width)
        };
        if !has_room(taken, lines.len()) && lines.len() < most {
            lines.push(Line::default());
            taken = 0;
        }
        let fits = has_room(taken, lines.len());
        let Some(line) = lines.last_mut() else { break };
        if !fits && plot.curves.len() == 1 {
            break;
        }
        if !fits {
            line.push_span(Span::styled(format!("  +{left} more"), theme.faint()));
            break;
        }
        line.push_span(Span::styled(text, Style::new().fg(entry.curve.colour)));
        taken += width;
        left -= 1;
    }
    (lines, left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_shortened_as_long_as_they_differ() {
        assert_eq!(shortenings(&["one", "two"]), [0usize; 0], "short names are not shortened");
        assert_eq!(shortenings(&["the first of two names", "a second one of them"]), [16, 12, 8]);
        let seeds = ["ddpg.gamma 0.905, seed 1", "ddpg.gamma 0.905, seed 2"];
        assert_eq!(shortenings(&seeds), [0usize; 0], "they have the same beginning");
        assert_eq!(shortenings(&["the same name twice", "the same name twice"]), [16, 12, 8]);
    }
}
