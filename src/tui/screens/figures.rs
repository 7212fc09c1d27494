//! The Figures screen: figures to look at, to compose and to export. For terminals that show no pictures, they are drawn in
//! cells, at the size of the pane.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ratatui::prelude::*;
use ratatui::widgets::Row;

use super::pane::{hint, lines, pane};
use super::{HitRegion, HitRegions, Screens, Ui, row_regions};
use crate::tui::app::App;
use crate::tui::chart::{Curve, Plot, Scale, Window, draw as draw_chart};
use crate::tui::effect::Effect;
use crate::tui::layers::{Form, Value};
use crate::tui::scene::task_picture;
use crate::tui::widgets::layout::{WIDE, grid};
use crate::tui::widgets::list;
use crate::tui::widgets::preview::PreviewRequest;
use crate::tui::widgets::theme::Theme;
use mge_base::paths::{fitting, suffix};
use mge_figures::{EXTENSIONS, Figure, LearningCurves};
use mge_results::{Composition, OPTIONS};
use mge_workbench::listing::RunSummary;
use mge_workbench::{Command, FigureKind, command};

/// What a figure shows, in one line.
fn about(kind: FigureKind) -> &'static str {
    match kind {
        FigureKind::Scene => "the task's scene",
        FigureKind::Clusters => "the action clusters over the scene",
        FigureKind::Learning => "success of all runs, or the marked ones",
    }
}

/// Width of the list in the wide layout.
const LIST: u16 = 56;

/// Draws the screen: the list at the left or above, the selected figure beside or below.
pub fn draw(screens: &Screens, ui: &Ui, covered: bool, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let [list, picture] = if area.width >= WIDE {
        Layout::horizontal([Constraint::Length(LIST), Constraint::Fill(1)]).areas(area)
    } else {
        let rows = FigureKind::ALL.len() as u16 + 2;
        Layout::vertical([Constraint::Length(rows), Constraint::Fill(1)]).areas(area)
    };
    listed(screens, ui, list, buffer, regions);
    let kind = selected(screens);
    let inside = pane(kind.name(), picture, ui.theme, buffer);
    regions.push((inside, HitRegion::Preview));
    match screens.preview.draw(kind, covered, inside, buffer) {
        Ok(None) => {}
        Ok(Some((wanted, figure))) => in_cells(wanted, figure, inside, ui.theme, buffer),
        Err(reason) => hint(&reason, inside, ui.theme, buffer),
    }
}

/// The command that exports a figure in a format.
pub fn export(kind: FigureKind, format: &str, screens: &Screens, ui: &Ui) -> Command {
    let composition = composition(kind, screens, ui);
    command::Figure { composition, ..command::Figure::with_defaults(kind, &file(kind, format, screens, ui)) }.into()
}

/// The file to which a figure is exported.
pub fn file(kind: FigureKind, format: &str, screens: &Screens, ui: &Ui) -> PathBuf {
    let name = match kind {
        FigureKind::Learning if !screens.file.is_empty() => format!("{}.{format}", screens.file),
        FigureKind::Learning => format!("{}.{format}", kind.name()),
        _ => fitting(&ui.view.task.name, &format!("-{}.{format}", kind.name())),
    };
    Path::new("figures").join(name)
}

/// Whether the figure of learning curves shows the run in a folder.
fn is_shown(composition: &Composition, run: &Path) -> bool {
    composition.runs.is_empty() || composition.runs.iter().any(|shown| shown == run)
}

fn composition(kind: FigureKind, screens: &Screens, ui: &Ui) -> Composition {
    match kind {
        FigureKind::Learning => {
            let marked = screens.runs.marked(ui.view).into_iter().map(|run| run.path.clone()).collect();
            Composition { runs: marked, ..screens.composition.clone() }
        }
        _ => Composition::default(),
    }
}

fn listed(screens: &Screens, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let theme = ui.theme;
    let inside = pane("figures", area, theme, buffer);
    let row = |index: usize| {
        let kind = FigureKind::ALL[index];
        Row::new([kind.name(), about(kind)])
    };
    let (count, widths) = (FigureKind::ALL.len(), [Constraint::Length(10), Constraint::Fill(1)]);
    let figure = Some(screens.figure);
    regions.extend(row_regions(list::draw(count, figure, row, &widths, inside, theme, buffer)));
    let [_, below] = Layout::vertical([Constraint::Length(count as u16 + 1), Constraint::Fill(1)]).areas(inside);
    if below.height == 0 {
        return;
    }
    let mut text: Vec<Line> = Vec::new();
    if selected(screens) == FigureKind::Learning {
        let command = export(FigureKind::Learning, "png", screens, ui);
        text.extend(lines(&format!("in a script: {command}\n\n"), below.width, Style::new()));
    }
    let written = ui.view.figures.iter().rev().map(|path| format!("wrote {}", path.display()));
    text.extend(written.flat_map(|line| lines(&line, below.width, Style::new().fg(theme.good))));
    if text.is_empty() {
        return hint(&ui.text(EXPLANATION), below, theme, buffer);
    }
    Text::from(text).render(below, buffer);
}

const EXPLANATION: &str = "Nothing exported yet: the keys in the last row export the selected figure into the folder figures/. {compose} composes the learning figure.";

/// The selected figure.
pub fn selected(screens: &Screens) -> FigureKind {
    FigureKind::ALL[screens.figure.min(FigureKind::ALL.len() - 1)]
}

/// The preview to draw. None while there is no room for one.
pub fn wanted(screens: &Screens, ui: &Ui, regions: &HitRegions) -> Option<PreviewRequest> {
    let (area, _) = regions.iter().find(|(area, it)| matches!(it, HitRegion::Preview) && !area.is_empty())?;
    let kind = selected(screens);
    let composition = composition(kind, screens, ui);
    Some(PreviewRequest {
        kind,
        task: ui.view.task.clone(),
        prior: ui.view.prior.clone(),
        progress: progress(kind, &composition, ui),
        room: [area.width, area.height],
        composition,
    })
}

/// A hash of the runs that a figure shows, of their names and finished episodes.
fn progress(kind: FigureKind, composition: &Composition, ui: &Ui) -> u64 {
    let mut hasher = DefaultHasher::new();
    ui.subject.run().map(|run| (&run.path, run.done)).hash(&mut hasher);
    if kind == FigureKind::Learning {
        for run in ui.view.runs.iter().filter(|run| is_shown(composition, &run.path)) {
            let group = ui.view.groups.of(&run.path).map(|group| (&group.name, &group.label));
            (&run.path, run.done, &run.name, group).hash(&mut hasher);
        }
    }
    hasher.finish()
}

/// Selects the learning figure and asks for its options, and for the name of its file.
pub fn compose(screens: &mut Screens, ui: &Ui) -> Vec<Effect> {
    let labels = labels(screens, ui);
    screens.figure = FigureKind::ALL.iter().position(|kind| *kind == FigureKind::Learning).unwrap_or(0);
    let file = Some(("file", screens.file.clone())).filter(|(_, name)| !name.is_empty());
    let options = screens.composition.options().into_iter().chain(file).map(|(key, value)| format!("{key}={value}"));
    let runs = ui.text("The runs are those marked on the Runs screen ({screen-runs}), or all.");
    let exports = ui.text("{export-figure} exports it as PNG, {export-svg} as SVG");
    let completions = completions(&labels);
    // The labels are not all known before all runs have been read.
    let is_known = ui.view.runs_unread == 0 && !labels.is_empty();
    let prompt = Form::prompt("compose the learning figure", runs, shell_words::join(options), move |text| {
        let words = shell_words::split(text).map_err(|error| error.to_string())?;
        let pair = |word| str::split_once(word, '=').ok_or_else(|| format!("`{word}`: write KEY=VALUE"));
        let options = words.iter().map(|word| pair(word)).collect::<Result<Vec<_>, _>>()?;
        let (files, options): (Vec<_>, Vec<_>) = options.into_iter().partition(|(key, _)| *key == "file");
        let file = files.last().map_or_else(String::new, |(_, name)| (*name).to_owned());
        if file.contains(['/', '\\']) || EXTENSIONS.contains(&suffix(file.as_ref()).as_str()) {
            return Err(format!("`{file}`: write a name without folder and suffix, which the export adds"));
        }
        let composition = Composition::default().with_options(options)?;
        is_known.then(|| composition.by_label(&labels)).transpose().map_err(|error| error.to_string())?;
        let report = Effect::info(format!("composed: {}; {exports}", if text.is_empty() { "as usual" } else { text }));
        let change = |app: &mut App| (app.screens.composition, app.screens.file) = (composition, file);
        Ok(Effect::all(vec![Effect::call(change), report]))
    });
    vec![Effect::open(prompt.completing(completions))]
}

/// The labels of the curves, those of the marked runs, or else of all, with their texts in the legend and their runs.
fn labels(screens: &Screens, ui: &Ui) -> Vec<(String, String)> {
    let composition = composition(FigureKind::Learning, screens, ui);
    let shown = ui.view.runs.iter().filter(|run| is_shown(&composition, &run.path));
    let entry = |run: &Arc<RunSummary>| {
        let group = ui.view.groups.of(&run.path)?;
        Some([&group.name, &run.name].map(|name| (group.label.clone(), name.clone())))
    };
    shown.filter_map(entry).flatten().collect::<BTreeSet<_>>().into_iter().collect()
}

/// The options of the learning figure, and their values where there are few.
fn completions(labels: &[(String, String)]) -> Vec<Value> {
    let keys = OPTIONS.iter().filter(|(name, _)| *name != "runs");
    let keys = keys.map(|(name, about)| Value::new(format!("{name}="), *about));
    let file = Value::new("file=", "name of the figure in the folder figures, without its suffix");
    let values = ["success=greedy", "against=actions", "against=charged", "width=single", "bands=off"];
    let curves = labels.iter().map(|(_, name)| Value::new(format!("curve={}", shell_words::quote(name)), "a curve"));
    keys.chain([file]).chain(values.map(|value| Value::new(value, ""))).chain(curves).collect()
}

/// Least columns of a panel beside another.
const PANEL: u16 = 44;

/// Draws the figure that was asked for: curves as charts, and the scene as on its screen.
fn in_cells(wanted: &PreviewRequest, figure: &dyn Figure, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    if let Some(figure) = figure.curves() {
        return curves(figure, area, theme, buffer);
    }
    let prior = wanted.prior.as_deref().filter(|_| wanted.kind == FigureKind::Clusters);
    task_picture(&wanted.task, prior, area, theme, buffer);
}

/// Draws the panels of learning curves.
fn curves(figure: &LearningCurves, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    let columns = usize::from(area.width / PANEL).clamp(1, figure.panels.len().max(1));
    let rows = figure.panels.len().div_ceil(columns);
    let (entries, has_bands) = figure.entries();
    for (panel, place) in figure.panels.iter().zip(grid(area, columns, rows)) {
        let [low, high] = figure.style.y.unwrap_or([0.0, 100.0]);
        let percent = |values: &Vec<f64>| -> Vec<f32> {
            let visible = |value: f64| if (low..=high).contains(&value) { value as f32 } else { f32::NAN };
            values.iter().map(|value| visible(100.0 * value)).collect()
        };
        let look = |curve: &mge_figures::Curve| {
            let (_, text, color) = entries.iter().find(|(label, ..)| *label == curve.label)?;
            let x: Vec<u64> = curve.x.iter().map(|x| x.round() as u64).collect();
            Some((*text, *color, x, [&curve.y, &curve.low, &curve.high].map(percent)))
        };
        let data: Vec<_> = panel.curves.iter().filter_map(look).collect();
        let curves = data.iter().map(|(name, color, x, [y, low, high])| Curve {
            name,
            colour: theme.visible(*color),
            episodes: x,
            values: y,
            band: Some([&**low, high]).filter(|_| has_bands && low.len() == y.len()),
            smoothing: 1,
            partial: 0,
            evaluations: &[],
        });
        let last = data.iter().filter_map(|(_, _, x, _)| x.last().copied()).max().unwrap_or(1);
        let [from, to] = figure.style.x.unwrap_or([0.0, last as f64]);
        let plot = Plot {
            title: &format!("{}: success rate (%)", panel.task),
            curves: curves.collect(),
            x: Window { from: from as f32, to: to as f32 },
            y: Some([low as f32, high as f32]),
            scale: Scale::Linear,
            unit: (1.0, figure.against.label()),
            crosshair: None,
            more: "more",
            empty: "no finished episodes",
        };
        draw_chart(&plot, Rect { width: place.width.saturating_sub(1), ..place }, theme, buffer);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::tui::widgets::theme::{Depth, Marker, Palette};
    use mge_figures::{Against, Color, CurvePanel, PlotStyle, TaskGrid};

    fn drawn(kind: FigureKind, figure: &dyn Figure) -> (Vec<String>, Buffer) {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let composition = mge_results::Composition::default();
        let wanted = PreviewRequest { kind, composition, task, prior: None, progress: 0, room: [60, 20] };
        let mut buffer = Buffer::empty(Rect::new(0, 0, 60, 20));
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
        in_cells(&wanted, figure, buffer.area, &theme, &mut buffer);
        let rows = buffer.content.chunks(60).map(|row| row.iter().map(|cell| cell.symbol()).collect());
        (rows.collect(), buffer)
    }

    #[test]
    fn learning_curves_are_a_chart_with_axes_ticks_and_legend() {
        let curve = |label: &str, last: f64| mge_figures::Curve {
            label: label.to_owned(),
            x: vec![100.0, 200.0, 400.0],
            y: vec![0.0, 0.5, last],
            ..mge_figures::Curve::default()
        };
        let curves = vec![curve("DDPG", 0.25), curve("other", 1.0)];
        let figure = LearningCurves {
            against: Against::Charged,
            panels: vec![CurvePanel { task: "task1".to_owned(), curves }],
            legend: vec![("other".to_owned(), "ours".to_owned()), ("DDPG".to_owned(), "DDPG".to_owned())],
            colors: vec![("other".to_owned(), Color(200, 100, 0, 1.0))],
            style: PlotStyle { x: Some([0.0, 400.0]), y: Some([0.0, 60.0]), ..PlotStyle::default() },
            ..LearningCurves::default()
        };
        let (rows, buffer) = drawn(FigureKind::Learning, &figure);
        let text = rows.join("\n");
        for part in ["task1: success rate (%)", "DDPG: 25", "ours: ", "charged actions", " 300 ", "60│", "20│"] {
            assert!(text.contains(part), "`{part}` is not on\n{text}");
        }
        let ours = ratatui::style::Color::Rgb(200, 100, 0);
        assert!(buffer.content.iter().filter(|cell| cell.fg == ours).count() > 20, "in its colour\n{text}");
    }

    #[test]
    fn a_scene_is_drawn_as_on_its_screen() {
        let figure = TaskGrid { tasks: vec![mge_task::load("task1").unwrap()] };
        let text = drawn(FigureKind::Scene, &figure).0.concat();
        assert!(text.contains('G') && text.contains('1') && text.contains('⣿'), "{text}");
    }
}
