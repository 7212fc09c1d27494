//! The composer of the learning-curve figure: its style, and the names and order of its curves. The figure shows the
//! runs marked on the Runs screen, or all in the folder.

use std::path::PathBuf;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::Row;

use super::super::pane::pane;
use super::super::runs::Runs;
use super::super::{HitRegions, Ui};
use crate::tui::effect::Effect;
use crate::tui::layers::Prompt;
use crate::tui::view::RunSummary;
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::list;
use mge_figures::Against;
use mge_results::figures::Success;
use mge_results::{Composition, LearningRow, distinguish};

/// State of the composer.
#[derive(Debug, Default)]
pub struct Composer {
    /// Whether it has the keyboard focus.
    open: bool,
    row: usize,
    /// The composition without runs and curves.
    composition: Composition,
    /// The marked runs to which `curves` belong.
    marked: Vec<PathBuf>,
    curves: Vec<Curve>,
    /// Whether the curves were edited.
    touched: bool,
}

/// A curve of the figure.
#[derive(Debug, Clone, PartialEq)]
struct Curve {
    label: String,
    name: Option<String>,
    hidden: bool,
}

/// Number of rows of options, above those of curves.
const OPTIONS: usize = 6;
/// A step of the font's size, in points.
const STEP: f64 = 0.5;

impl Composer {
    /// Whether it has the keyboard focus.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Gives up the keyboard focus; false if it did not have it.
    pub fn leave(&mut self) -> bool {
        std::mem::take(&mut self.open)
    }

    /// Takes the keyboard focus. If other runs are marked than before, edits of curves are discarded.
    pub(super) fn open(&mut self, runs: &Runs, ui: &Ui) {
        self.open = true;
        let marked = runs.marked(ui.view);
        let labels = labels(&marked, ui);
        let marked: Vec<PathBuf> = marked.into_iter().map(|run| run.path.clone()).collect();
        if std::mem::replace(&mut self.marked, marked.clone()) != marked {
            self.curves.clear();
            self.touched = false;
        }
        self.curves.retain(|curve| labels.contains(&curve.label));
        for label in labels {
            if self.curves.iter().all(|curve| curve.label != label) {
                self.curves.push(Curve { label, name: None, hidden: false });
            }
        }
        let has = |label: &String| self.curves.iter().any(|curve| curve.label == *label);
        self.composition.reference = self.composition.reference.take().filter(has);
        self.row = self.row.min(self.last());
    }

    fn last(&self) -> usize {
        OPTIONS + self.curves.len() - 1
    }

    /// Selects a row.
    pub fn select(&mut self, row: usize) {
        self.row = row.min(self.last());
    }

    /// Renames a curve; an empty name restores its label.
    pub fn name(&mut self, label: &str, name: &str) {
        if let Some(curve) = self.curves.iter_mut().find(|curve| curve.label == label) {
            curve.name = Some(name.to_owned()).filter(|name| !name.is_empty() && name != label);
            self.touched = true;
        }
    }

    /// The composition of the marked runs, or of all.
    pub fn composition(&self, runs: &Runs, ui: &Ui) -> Composition {
        let marked: Vec<PathBuf> = runs.marked(ui.view).into_iter().map(|run| run.path.clone()).collect();
        if marked != self.marked {
            return Composition { runs: marked, reference: None, ..self.composition.clone() };
        }
        // Until curves are edited, none is listed, so that curves of later runs are shown, too.
        let shown = self.curves.iter().filter(|curve| self.touched && !curve.hidden);
        let curves = shown.map(|curve| (curve.label.clone(), curve.name.clone())).collect();
        Composition { runs: marked, curves, ..self.composition.clone() }
    }

    /// Selects the row that `line` returns for the selected and the last one.
    pub(in super::super) fn select_line(&mut self, line: impl Fn(usize, usize) -> usize) {
        self.row = line(self.row, self.last());
    }

    /// Sets the selected option to its next or previous value.
    pub fn change(&mut self, forward: bool) {
        let Composition { reference, success, against, style, .. } = &mut self.composition;
        match self.row {
            0 => style.single = !style.single,
            1 => {
                let font = style.font() + if forward { STEP } else { -STEP };
                *style = style.with_font(font).unwrap_or(*style);
            }
            2 => style.logarithmic = !style.logarithmic,
            3 => {
                *success = if *success == Success::Training { Success::Greedy } else { Success::Training };
                // Evaluations have no number of environment steps.
                *against = Against::Episodes;
            }
            4 => {
                *against = if *against == Against::Episodes { Against::Steps } else { Against::Episodes };
                *success = Success::Training;
            }
            5 => {
                let labels: Vec<&String> = self.curves.iter().map(|curve| &curve.label).collect();
                // None comes before the first label and after the last.
                let now = reference.as_ref().and_then(|now| labels.iter().position(|label| *label == now));
                let next = match (now, forward) {
                    (None, true) => Some(0),
                    (None, false) => labels.len().checked_sub(1),
                    (Some(now), true) => Some(now + 1),
                    (Some(now), false) => now.checked_sub(1),
                };
                *reference = next.and_then(|next| labels.get(next)).map(|label| (*label).clone());
            }
            _ => {}
        }
    }

    /// What is done with the selected curve, if the selected row is one.
    fn on_curve(&mut self, change: impl FnOnce(&mut Self, usize) -> Option<Effect>) -> Vec<Effect> {
        let none = || Some(Effect::info("select a curve below the options first"));
        self.row.checked_sub(OPTIONS).map_or_else(none, |place| change(self, place)).into_iter().collect()
    }

    /// Shows the selected curve, or leaves it out.
    pub fn show_or_hide(&mut self) -> Vec<Effect> {
        self.on_curve(|composer, place| {
            let shown = composer.curves.iter().filter(|curve| !curve.hidden).count();
            if shown == 1 && !composer.curves[place].hidden {
                return Some(Effect::info("a figure has at least one curve"));
            }
            composer.curves[place].hidden ^= true;
            composer.touched = true;
            None
        })
    }

    /// Asks for another name of the selected curve.
    pub fn ask_for_name(&mut self) -> Vec<Effect> {
        self.on_curve(|composer, place| {
            let Curve { label, name, .. } = composer.curves[place].clone();
            let of = label.clone();
            let read = move |name: &str| {
                let (label, name) = (of.clone(), name.to_owned());
                Ok(Effect::call(move |app| app.screens.lists.composer.name(&label, &name)))
            };
            let hint = format!("name of {label} in the legend; empty for the default");
            Some(Effect::open(Prompt::new("name of the curve", hint, name.unwrap_or(label), read)))
        })
    }

    /// Moves the selected curve one earlier or later in the legend.
    pub fn reorder(&mut self, later: bool) -> Vec<Effect> {
        self.on_curve(|composer, place| {
            let other = if later { place + 1 } else { place.wrapping_sub(1) };
            if other < composer.curves.len() {
                composer.curves.swap(place, other);
                (composer.row, composer.touched) = (OPTIONS + other, true);
            }
            None
        })
    }

    /// Rows that it needs inside its pane.
    pub(super) fn height(&self) -> u16 {
        (OPTIONS + self.curves.len()) as u16
    }

    /// Draws options and curves.
    pub(super) fn draw(&self, runs: usize, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
        let of = match runs {
            0 => "all runs in the folder".to_owned(),
            1 => "the marked run".to_owned(),
            _ => format!("the {runs} marked runs"),
        };
        let inside = pane(&format!("compose · {of}"), area, ui.theme, buffer);
        let Composition { reference, success, against, style, .. } = &self.composition;
        let options = [
            ("width", if style.single { "single column" } else { "double column" }.to_owned()),
            ("font", format!("{} points", style.font())),
            ("axis", if style.logarithmic { "logarithmic" } else { "linear" }.to_owned()),
            ("success", if *success == Success::Greedy { "greedy evaluations" } else { "training" }.to_owned()),
            ("against", if *against == Against::Steps { "environment steps" } else { "episodes" }.to_owned()),
            ("reference", reference.clone().unwrap_or_else(|| "none".to_owned())),
        ];
        let name = usize::from(inside.width.saturating_sub(OPTION + 1));
        let row = |index: usize| match index.checked_sub(OPTIONS).map(|place| (place, &self.curves[place])) {
            None => {
                let (option, value) = &options[index];
                Row::new([Text::from(*option), Text::from(shortened(value, name, false))])
            }
            Some((place, curve)) => {
                let before = self.curves[..place].iter().filter(|curve| !curve.hidden).count();
                let number = if curve.hidden { "  -".to_owned() } else { format!("{:>3}", before + 1) };
                let text = match &curve.name {
                    Some(name) => format!("{name} ({})", curve.label),
                    None => curve.label.clone(),
                };
                let style = if curve.hidden { ui.theme.faint() } else { Style::new() };
                Row::new([Text::from(number), Text::styled(shortened(&text, name, false), style)])
            }
        };
        let widths = [Constraint::Length(OPTION), Constraint::Fill(1)];
        let count = usize::from(self.height());
        regions.add_rows(list::draw(count, Some(self.row), row, &widths, inside, ui.theme, buffer));
    }
}

/// Width of the column of option names.
const OPTION: u16 = 10;

/// The labels of the curves of these runs, or of all runs if none is marked, as in reports.
fn labels(marked: &[&RunSummary], ui: &Ui) -> Vec<String> {
    let all: Vec<&RunSummary> =
        if marked.is_empty() { ui.view.runs.iter().map(|run| &**run).collect() } else { marked.to_vec() };
    let mut rows: Vec<LearningRow> = all.iter().map(|run| LearningRow::so_far(&run.config, run.done, None)).collect();
    distinguish(all.iter().map(|run| &*run.config).zip(&mut rows).collect());
    let mut labels: Vec<String> = Vec::new();
    for row in rows.iter().filter(|row| row.episodes > 0) {
        let label = row.label();
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
}
