//! The columns of the list after mark, name and state.

use std::collections::BTreeSet;

use super::super::Ui;
use super::super::status::bar;
use super::line::Line;
use super::{check_setting, is_setting};
use crate::tui::view::{RunSummary, span};
use crate::tui::widgets::theme::Theme;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::text::printable;

/// A column.
#[derive(Debug, Clone)]
pub enum Column {
    /// One that every list can show.
    Common(&'static CommonColumn),
    /// A setting by its JSON path.
    Setting(String),
}

/// A column that every list can show.
#[derive(Debug)]
pub struct CommonColumn {
    heading: &'static str,
    width: u16,
    /// Width of the list from which it is one of the default columns.
    from: u16,
    is_number: bool,
    /// Its text for a line of the list, whose first run is given, too: the runs of a group differ only in the seed.
    cell: fn(&Line, &RunSummary, &Theme) -> String,
}

/// Shown only if it is chosen.
const CHOSEN: u16 = u16::MAX;

const COMMON: [CommonColumn; 10] = [
    common("episodes", 18, 60, false, |line, _, theme| episodes(line, theme)),
    common("success", 7, 0, true, |line, _, _| percent(line.success())),
    common("interval", 9, 100, true, |line, _, _| interval(line)),
    common("remaining", 10, 110, true, |line, _, _| line.seconds_left().map_or_else(String::new, span)),
    common("seed", 6, CHOSEN, true, |line, _, _| seeds(line)),
    common("task", 12, CHOSEN, false, |_, first, _| first.config.task.name.clone()),
    common("method", 14, CHOSEN, false, |_, first, _| first.config.method.name().to_owned()),
    common("epsilon", 20, CHOSEN, false, |_, first, _| epsilon(first)),
    common("tags", 14, CHOSEN, false, |_, first, _| printable(&first.tags.join(" ")).to_string()),
    common("note", 24, CHOSEN, false, |_, first, _| printable(&first.note).to_string()),
];

const fn common(
    heading: &'static str,
    width: u16,
    from: u16,
    is_number: bool,
    cell: fn(&Line, &RunSummary, &Theme) -> String,
) -> CommonColumn {
    CommonColumn { heading, width, from, is_number, cell }
}

/// The default columns of a list of this width.
pub fn defaults(width: u16) -> Vec<Column> {
    COMMON.iter().filter(|column| column.from < CHOSEN && width >= column.from).map(Column::Common).collect()
}

/// The names of all columns that are not settings.
pub fn names() -> [&'static str; COMMON.len()] {
    COMMON.each_ref().map(|column| column.heading)
}

/// Reads the names of columns and the JSON paths of settings, separated by spaces or commas.
///
/// # Errors
/// The first word that is neither.
pub fn parse(text: &str) -> Result<Vec<Column>, String> {
    let read = |word: &str| match COMMON.iter().find(|column| column.heading == word) {
        Some(common) => Ok(Column::Common(common)),
        None if is_setting(word) => Ok(Column::Setting(word.to_owned())),
        None => {
            Err(format!("`{word}` is not one of {} or a setting{}", names().join(", "), did_you_mean(names(), word)))
        }
    };
    text.split([' ', ',']).filter(|word| !word.is_empty()).map(read).collect()
}

/// Checks the settings among columns, given those in which runs differ.
///
/// # Errors
/// The first that no run has.
pub fn check_settings(columns: &[Column], differing: &BTreeSet<String>) -> Result<(), String> {
    columns.iter().try_for_each(|column| match column {
        Column::Common(_) => Ok(()),
        Column::Setting(path) => check_setting(path, differing),
    })
}

impl Column {
    /// Its name.
    pub fn heading(&self) -> &str {
        match self {
            Self::Common(common) => common.heading,
            Self::Setting(path) => path,
        }
    }

    /// Its width.
    pub fn width(&self) -> u16 {
        match self {
            Self::Common(common) => common.width,
            Self::Setting(path) => (path.len() as u16).clamp(6, 24),
        }
    }

    /// Whether its text is at the right.
    pub fn is_number(&self) -> bool {
        !matches!(self, Self::Common(CommonColumn { is_number: false, .. }))
    }

    /// Its text for a line of the list; empty for a setting that the method does not use.
    pub fn cell(&self, line: &Line, ui: &Ui) -> String {
        let runs = line.runs();
        let Some(first) = runs.first() else { return String::new() };
        match self {
            Self::Common(common) => (common.cell)(line, first, ui.theme),
            Self::Setting(path) => {
                let value = ui.view.groups.setting(first, path);
                value.map_or_else(String::new, |value| printable(&json::text(value)).into_owned())
            }
        }
    }
}

/// The seeds of a line, whose runs are sorted by them.
fn seeds(line: &Line) -> String {
    match line.runs().as_slice() {
        [least, .., greatest] if least.config.seed < greatest.config.seed => {
            format!("{}-{}", least.config.seed, greatest.config.seed)
        }
        runs => runs.first().map_or_else(String::new, |run| run.config.seed.to_string()),
    }
}

fn epsilon(run: &RunSummary) -> String {
    if run.config.method.uses("epsilon") { run.config.epsilon.describe() } else { String::new() }
}

fn episodes(line: &Line, theme: &Theme) -> String {
    let [done, all] = line.progress();
    format!("{} {done}/{all}", bar(done, all, 6, theme))
}

/// The interval of the success of a group; that of one seed would be a point.
fn interval(line: &Line) -> String {
    match line {
        Line::Group(group, _) if group.seeds() > 1 => group
            .success
            .map_or_else(String::new, |success| format!("{:.0}-{:.0} %", 100.0 * success.lower, 100.0 * success.upper)),
        _ => String::new(),
    }
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}
