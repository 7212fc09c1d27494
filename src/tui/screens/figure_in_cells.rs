//! Figures drawn in cells, at the size of the pane, for terminals that show no pictures.

use ratatui::prelude::*;

use crate::tui::chart::{Curve, Plot, Scale, Window, draw as draw_chart};
use crate::tui::scene::task_picture;
use crate::tui::widgets::layout::grid;
use crate::tui::widgets::preview::PreviewRequest;
use crate::tui::widgets::theme::Theme;
use mge_figures::{Figure, LearningCurves};
use mge_workbench::FigureKind;

/// Least columns of a panel beside another.
const PANEL: u16 = 44;

/// Draws the figure that was asked for: curves as charts, and the scene as on its screen.
pub fn in_cells(wanted: &PreviewRequest, figure: &dyn Figure, area: Rect, theme: &Theme, buffer: &mut Buffer) {
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
