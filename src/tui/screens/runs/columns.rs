//! The columns of the list after mark, name and state.

use super::super::status::bar;
use super::line::Line;
use crate::tui::view::span;
use crate::tui::widgets::theme::Theme;

/// A column.
#[derive(Debug)]
pub struct Column {
    /// Its name.
    pub heading: &'static str,
    /// Its width.
    pub width: u16,
    /// Width of the list from which it is shown.
    from: u16,
    /// Whether its text is at the right.
    pub is_number: bool,
    /// Its text for a line of the list.
    pub cell: fn(&Line, &Theme) -> String,
}

const COLUMNS: [Column; 3] = [
    column("episodes", 18, 60, false, episodes),
    column("success", 7, 0, true, |line, _| percent(line.success())),
    column("remaining", 10, 110, true, |line, _| line.seconds_left().map_or_else(String::new, span)),
];

const fn column(
    heading: &'static str,
    width: u16,
    from: u16,
    is_number: bool,
    cell: fn(&Line, &Theme) -> String,
) -> Column {
    Column { heading, width, from, is_number, cell }
}

/// The columns of a list of this width.
pub fn of_width(width: u16) -> Vec<&'static Column> {
    COLUMNS.iter().filter(|column| width >= column.from).collect()
}

fn episodes(line: &Line, theme: &Theme) -> String {
    let [done, all] = line.progress();
    format!("{} {done}/{all}", bar(done, all, 6, theme))
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}
