//! The columns of the list after mark, name and state.

use std::collections::BTreeSet;

use super::super::Ui;
use super::filter;
use super::line::Line;
use crate::tui::view::{RunSummary, span};
use crate::tui::widgets::columns::width;
use jiff::{Timestamp, tz::TimeZone};
use mge_base::json;
use mge_base::text::{number, printable};
use mge_run::Metric;

/// The text of a column for a line, given the heading, if there is one.
type Cell = fn(&Line, &Ui, &str) -> Option<String>;

/// A column.
#[derive(Clone)]
pub struct Column {
    /// Its name.
    pub heading: String,
    /// Its width.
    pub width: u16,
    /// Its text for a line of the list.
    pub cell: Cell,
}

/// Room of success and episodes, beside which a name is not shortened.
pub const FIRST: u16 = 19;

/// Those that are not settings, the most important ones first.
const COMMON: [(&str, u16, Cell); 7] = [
    ("success", 7, |line, _, _| Some(line.success().map_or("-".into(), |share| format!("{:.0} %", 100.0 * share)))),
    ("episodes", 10, |line, _, _| {
        let whole = line.progress().map(|count| count.to_string()).join("/");
        Some(if whole.len() > 10 { line.progress().map(|count| number(count as f32)).join("/") } else { whole })
    }),
    ("time left", 9, |line, _, _| line.seconds_left().map(span)),
    ("charged", 8, |line, _, _| {
        let actions = total(line, |run| Some(run.latest(Metric::ChargedActions)?.into()))?.round();
        Some(if actions < 1e8 { actions.to_string() } else { number(actions as f32) })
    }),
    ("duration", 9, |line, _, _| total(line, RunSummary::seconds).map(span)),
    // When the first run began, in local time.
    ("start", 11, |line, _, _| {
        let first = line.runs.iter().filter_map(|run| run.began).reduce(f64::min)?;
        let first = Timestamp::from_second(first as i64).ok()?.to_zoned(TimeZone::system());
        Some(first.strftime("%m-%d %H:%M").to_string())
    }),
    ("speed", 9, |line, _, _| {
        let rate = line.speed()?;
        Some(if rate < 1.0 { format!("{:.1}/min", 60.0 * rate) } else { format!("{rate:.1}/s") })
    }),
];

/// The columns that fit into `room`: the `chosen` ones, or those that say something of some line: settings in which the
/// runs differ, in at most half of it, then the others.
pub fn fitting(chosen: &[String], lines: &[Line], room: u16, ui: &Ui) -> Vec<Column> {
    let common = COMMON.map(|(heading, width, cell)| Column { heading: heading.into(), width, cell });
    let fitting = |columns: Vec<Column>, room: &mut u16| -> Vec<Column> {
        let fits = |column: &Column| {
            let is_told = |line: &Line| !chosen.is_empty() || (column.cell)(line, ui, &column.heading).is_some();
            let left = room.checked_sub(column.width + 1).filter(|_| lines.iter().any(is_told));
            *room = left.unwrap_or(*room);
            left.is_some()
        };
        columns.into_iter().filter(fits).collect()
    };
    if !chosen.is_empty() {
        let column = |name: &String| {
            let common = common.iter().find(|column| column.heading.replace(' ', "-") == *name);
            common.cloned().unwrap_or_else(|| of_setting(name, lines, ui))
        };
        return fitting(chosen.iter().map(column).collect(), &mut { room });
    }
    let [success, others @ ..] = common;
    let room = room.saturating_sub(success.width + 1);
    let mut half = room / 2;
    let settings = fitting(settings(lines, ui), &mut half);
    let others = fitting(others.into(), &mut (room - room / 2 + half));
    settings.into_iter().chain([success]).chain(others).collect()
}

/// What the columns of time and cost say of a line, which may have no room for them.
pub fn costs(line: &Line, ui: &Ui) -> Vec<String> {
    let sum = |heading: &str| if line.group.is_some() && heading != "start" { " in all" } else { "" };
    let told = |(name, _, cell): &(&str, u16, Cell)| Some(format!("{name} {}{}", cell(line, ui, name)?, sum(name)));
    COMMON[2..].iter().filter_map(told).collect()
}

/// Columns of the settings in which runs of the list differ.
fn settings(lines: &[Line], ui: &Ui) -> Vec<Column> {
    let own = lines.iter().filter_map(|line| ui.view.groups.settings(&line.foremost().path));
    let mut paths: BTreeSet<&str> = own.flat_map(|settings| settings.keys().map(String::as_str)).collect();
    paths.extend(["epsilon", "method"]);
    paths.remove("episodes");
    let varies = |path: &&str| lines.iter().any(|line| setting(line, ui, path) != setting(&lines[0], ui, path));
    paths.into_iter().filter(varies).map(|path| of_setting(path, lines, ui)).collect()
}

/// The column of a setting, or of what else the filter knows.
fn of_setting(path: &str, lines: &[Line], ui: &Ui) -> Column {
    let values = lines.iter().filter_map(|line| setting(line, ui, path)).map(|value| width(&value));
    Column { heading: path.into(), width: values.fold(path.len().max(8), usize::max).min(16) as u16, cell: setting }
}

/// The columns that can be chosen, each by one word, and what they are.
pub fn known() -> impl Iterator<Item = [&'static str; 2]> + Clone {
    let times = [["time-left", "time until it is finished"], ["start", "when it began"]];
    filter::known().map(|[name, _, about]| [name, about]).chain(times)
}

/// The value of a setting, unless the method does not use it.
pub fn setting(line: &Line, ui: &Ui, path: &str) -> Option<String> {
    let run = line.foremost();
    match path {
        "epsilon" => run.config.method.uses(path).then(|| run.config.epsilon.describe()),
        "seed" | "name" | "folder" | "note" if line.group.is_some() => None,
        _ => filter::value(run, path, ui).map(|value| printable(&json::text(&value)).into_owned()),
    }
}

/// The sum over the runs of a line, if it is known of all of them.
fn total(line: &Line, of: impl Fn(&RunSummary) -> Option<f64>) -> Option<f64> {
    line.runs.iter().copied().map(of).sum()
}
