//! Ablation: the contribution of each part of the method.

use super::Figure;
use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, Pen};
use super::data::Statistics;
use super::geometry::clip_polyline;
use super::layout::note;
use super::style::{BLUE, GREY, INK, LABEL_SIZE, MARGIN, SINGLE_COLUMN, SKY, THIN_WIDTH};
use super::table::Table;
use mge_stats::Estimate;

/// One measure for the full method and for variants of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ablation {
    /// What is measured, with its unit.
    pub measure: String,
    /// How runs were summarised.
    pub statistics: Statistics,
    /// The variants; the first is the full method, with which the others are compared.
    pub variants: Vec<Variant>,
}

/// A variant and its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// What differs from the full method.
    pub label: String,
    /// The measure.
    pub estimate: Estimate,
}

impl Ablation {
    fn bar(&self, canvas: &Canvas<'_>, plot: &Plot<'_, '_>, row: usize) {
        let (y, estimate) = ((self.variants.len() - row) as f64, self.variants[row].estimate);
        if !estimate.value.is_finite() {
            return;
        }
        let corners = [[0.0, -0.36], [estimate.value, -0.36], [estimate.value, 0.36], [0.0, 0.36]];
        canvas.fill(&corners.map(|[x, dy]| plot.at(x, y + dy)), if row == 0 { BLUE } else { SKY });
        if estimate.has_interval() {
            let pen = Pen::new(INK, THIN_WIDTH);
            let ends = [plot.at(estimate.lower, y), plot.at(estimate.upper, y)];
            canvas.line(&ends, pen);
            ends.iter().for_each(|[x, y]| canvas.line(&[[*x, y - 1.5], [*x, y + 1.5]], pen));
        }
    }

    fn x_axis(&self) -> Axis {
        let values: Vec<f64> = self.variants.iter().flat_map(|variant| variant.estimate.values()).collect();
        if values.iter().any(|value| *value < 0.0) {
            Axis::around(&self.measure, values.into_iter().chain([0.0]), 6)
        } else {
            Axis::from_zero(&self.measure, values, 6)
        }
    }
}

impl Figure for Ablation {
    fn size(&self) -> [f64; 2] {
        [SINGLE_COLUMN, 2.2 * LABEL_SIZE * self.variants.len().max(3) as f64 + 55.0]
    }

    fn draw(&self, canvas: &Canvas<'_>) {
        let page = canvas.page().inset(MARGIN);
        if self.variants.is_empty() {
            return canvas.placeholder(page, "no variants");
        }
        let rect = note(
            canvas,
            page,
            &format!("{}. Dashed: {}.", self.statistics.caption("error bars"), self.variants[0].label),
        );
        let rows = self.variants.len();
        let ticks = self.variants.iter().enumerate().map(|(n, variant)| ((rows - n) as f64, variant.label.clone()));
        let y = Axis::with_ticks("", 0.4, rows as f64 + 0.6, ticks.collect());
        let plot = Plot::new(canvas, rect, &Frame { title: "", grid: false, square: false }, self.x_axis(), y);
        (0..rows).for_each(|row| self.bar(canvas, &plot, row));
        let reference = self.variants[0].estimate.value;
        let line = [plot.at(reference, 0.4), plot.at(reference, rows as f64 + 0.6)];
        clip_polyline(&line, &plot.rect)
            .iter()
            .for_each(|part| canvas.line(part, Pen::new(GREY, THIN_WIDTH).dashed(&[2.4, 1.8])))
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["measure", "variant", "value", "low", "high", "seeds"]);
        for variant in &self.variants {
            let [value, low, high] = variant.estimate.values();
            table.push(&[&self.measure, &variant.label, &value, &low, &high, &self.statistics.seeds]);
        }
        table
    }
}
