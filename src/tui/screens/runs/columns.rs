//! The columns of the list of runs.

use ratatui::layout::Alignment;

use super::super::Ui;
use super::super::status::bar;
use super::is_setting;
use super::line::Line;
use crate::tui::view::{Curves, RunGroup, span};
use crate::tui::widgets::theme::{Marker, Theme};
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::text::printable;
use mge_run::Metric;

/// A column after mark, name and state.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name, and its heading.
    pub heading: String,
    /// Its width.
    pub width: u16,
    /// Width of the list from which it is one of the default columns.
    pub from: u16,
    /// The alignment of its text.
    pub alignment: Alignment,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Episodes,
    Success,
    Interval,
    Better,
    Left,
    Curve,
    Seed,
    Task,
    Method,
    Epsilon,
    Tags,
    Note,
    /// A setting by its JSON path, which is the heading.
    Setting,
}

/// Every column that is not a setting: name, width, width of the list from which it is a default column, whether it is
/// numeric, and kind.
const ALL: [(&str, u16, u16, bool, Kind); 12] = [
    ("episodes", 18, 60, false, Kind::Episodes),
    ("success", 7, 0, true, Kind::Success),
    ("interval", 9, 100, true, Kind::Interval),
    ("better", 7, 88, true, Kind::Better),
    ("left", 10, 110, true, Kind::Left),
    ("curve", 12, 84, false, Kind::Curve),
    ("seed", 6, u16::MAX, true, Kind::Seed),
    ("task", 12, u16::MAX, false, Kind::Task),
    ("method", 14, u16::MAX, false, Kind::Method),
    ("epsilon", 20, u16::MAX, false, Kind::Epsilon),
    ("tags", 14, u16::MAX, false, Kind::Tags),
    ("note", 24, u16::MAX, false, Kind::Note),
];

/// The default columns, for a list that is wide enough.
pub fn defaults() -> Vec<Column> {
    ALL.iter().filter(|(_, _, from, ..)| *from < u16::MAX).map(column).collect()
}

fn column((heading, width, from, is_number, kind): &(&str, u16, u16, bool, Kind)) -> Column {
    let alignment = if *is_number { Alignment::Right } else { Alignment::Left };
    Column { heading: (*heading).to_owned(), width: *width, from: *from, alignment, kind: *kind }
}

/// The names of all columns that are not settings.
pub fn names() -> String {
    ALL.map(|(name, ..)| name).join(" ")
}

/// Reads the names of columns and the JSON paths of settings, separated by spaces or commas. None if there are none,
/// for the default columns.
///
/// # Errors
/// The first word that is neither.
pub fn parse(text: &str) -> Result<Option<Vec<Column>>, String> {
    let read = |word: &str| {
        if let Some(known) = ALL.iter().find(|(name, ..)| *name == word) {
            return Ok(Column { from: 0, ..column(known) });
        }
        if is_setting(word) {
            let width = (word.len() as u16).clamp(6, 24);
            let heading = word.to_owned();
            return Ok(Column { heading, width, from: 0, alignment: Alignment::Right, kind: Kind::Setting });
        }
        let known = ALL.map(|(name, ..)| name);
        Err(format!("`{word}` is not one of {} or a setting{}", known.join(", "), did_you_mean(known, word)))
    };
    let columns = text.split([' ', ',']).filter(|word| !word.is_empty()).map(read).collect::<Result<Vec<_>, _>>()?;
    Ok(Some(columns).filter(|columns| !columns.is_empty()))
}

impl Column {
    /// Its text for a line of the list.
    pub fn cell(&self, line: &Line, ui: &Ui) -> String {
        let runs = line.runs();
        // The runs of a group differ only in the seed: all other settings are those of the first.
        let Some(first) = runs.first() else { return String::new() };
        match self.kind {
            Kind::Episodes => {
                let [done, all] = line.progress();
                format!("{} {done}/{all}", bar(done, all, 6, ui.theme))
            }
            Kind::Success => percent(line.success()),
            Kind::Interval => match line {
                // The interval of one seed would be a point.
                Line::Group(group, _) if group.seeds() > 1 => group.success.map_or_else(String::new, |success| {
                    format!("{:.0}-{:.0} %", 100.0 * success.lower, 100.0 * success.upper)
                }),
                _ => String::new(),
            },
            Kind::Better => match line {
                Line::Group(RunGroup { is_baseline: true, .. }, _) => "base".to_owned(),
                _ => line.improvement().map_or_else(String::new, |improvement| percent(Some(improvement.value))),
            },
            Kind::Left => line.seconds_left().map_or_else(String::new, span),
            Kind::Curve => sparkline(line.curves(), usize::from(self.width), ui.theme),
            Kind::Seed => match runs.as_slice() {
                // The runs of a group are sorted by seed.
                [least, .., greatest] if least.config.seed < greatest.config.seed => {
                    format!("{}-{}", least.config.seed, greatest.config.seed)
                }
                _ => first.config.seed.to_string(),
            },
            Kind::Task => first.config.task.name.clone(),
            Kind::Method => first.config.method.name().to_owned(),
            Kind::Epsilon if first.config.method.uses("epsilon") => first.config.epsilon.describe(),
            Kind::Epsilon => String::new(),
            Kind::Tags => printable(&first.tags.join(" ")).to_string(),
            Kind::Note => printable(&first.note).to_string(),
            // Empty for a setting that the method does not use.
            Kind::Setting => {
                let found = ui.view.groups.setting(first, &self.heading);
                found.map_or_else(String::new, |value| printable(&json::text(value)).into_owned())
            }
        }
    }
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}

/// The success rate over the episodes so far, as a sparkline.
fn sparkline(curves: Option<&Curves>, width: usize, theme: &Theme) -> String {
    let heights: &[&str] = match theme.marker {
        Marker::Ascii => &["_", ".", "-", "=", "#"],
        _ => &["▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"],
    };
    let Some(values) = curves.map(|curves| curves.get(Metric::Success)).filter(|values| !values.is_empty()) else {
        return String::new();
    };
    let at = |place: usize| values[((place + 1) * values.len() / width).max(1) - 1];
    let height = |value: f32| ((value.clamp(0.0, 1.0) * heights.len() as f32) as usize).min(heights.len() - 1);
    (0..width).map(|place| heights[height(at(place))]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::widgets::theme::{Depth, Palette};

    #[test]
    fn a_sparkline_has_as_many_steps_as_the_terminal_has_characters() {
        let mut curves = Curves::default();
        for episode in 1..=4_u8 {
            curves.push(u64::from(episode), Metric::CURVES.map(|_| f32::from(episode) / 4.0));
        }
        for (marker, shown) in [(Marker::Braille, "▃▅▇█"), (Marker::Ascii, ".-=#")] {
            assert_eq!(sparkline(Some(&curves), 4, &Theme::new(Palette::Dark, Depth::True, marker)), shown);
        }
    }

    #[test]
    fn columns_are_read_by_name_and_mistakes_explained() {
        let read = |text: &str| {
            let columns = parse(text)?;
            Ok::<_, String>(columns.map(|columns| columns.into_iter().map(|it| it.heading).collect::<Vec<_>>()))
        };
        assert_eq!(read("seed, ddpg.gamma prior").unwrap().unwrap(), ["seed", "ddpg.gamma", "prior"]);
        assert_eq!(read(" "), Ok(None));
        assert!(read("sucess").unwrap_err().contains("did you mean `success`?"));
        assert!(defaults().iter().all(|column| column.heading != "seed"));
    }
}
