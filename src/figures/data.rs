//! The numbers figures are made of.

use crate::stats::Estimate;

/// How intervals and centres were computed, as said in captions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// The centre, such as "interquartile mean".
    pub centre: String,
    /// The interval, such as "95 % stratified bootstrap interval"; empty when there is none.
    pub interval: String,
    /// Number of seeds behind each estimate, or the most.
    pub seeds: usize,
    /// The fewest seeds behind an estimate, where not all have the same number.
    pub fewest_seeds: Option<usize>,
}

impl Statistics {
    /// One line for the foot of a figure, such as "Interquartile mean of 5 seeds; bars: 95 % ...".
    pub(super) fn caption(&self, mark: &str) -> String {
        let seeds = match self.fewest_seeds.filter(|fewest| *fewest != self.seeds) {
            Some(fewest) => format!("{fewest} to {} seeds", self.seeds),
            None if self.seeds == 1 => "1 seed".to_owned(),
            None => format!("{} seeds", self.seeds),
        };
        let centre =
            if self.centre.is_empty() { format!("n = {seeds}") } else { format!("{} of {seeds}", self.centre) };
        if self.interval.is_empty() { centre } else { format!("{centre}; {mark}: {}", self.interval) }
    }
}

/// A line with a band: values by position on the x axis. Not finite means missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// What it shows, as in the legend. Equal labels have equal colours in all panels.
    pub label: String,
    /// Positions on the x axis, increasing.
    pub x: Vec<f64>,
    /// Values.
    pub y: Vec<f64>,
    /// Lower ends of the intervals; empty when there are none.
    pub low: Vec<f64>,
    /// Upper ends of the intervals; empty when there are none.
    pub high: Vec<f64>,
    /// Number of values at the start that are means over a window not yet full.
    pub partial: usize,
}

impl Curve {
    /// The curve of estimates at these positions.
    pub fn new(label: &str, x: Vec<f64>, estimates: &[Estimate]) -> Self {
        let column = |of: fn(&Estimate) -> f64| estimates.iter().map(of).collect();
        let (y, low, high) = (column(|e| e.value), column(|e| e.lower), column(|e| e.upper));
        Self { label: label.to_owned(), x, y, low, high, partial: 0 }
    }

    pub(super) fn is_empty(&self) -> bool {
        !self.x.iter().zip(&self.y).any(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// Labels of the curves, each once, in order of appearance.
pub(super) fn labels<'c>(curves: impl IntoIterator<Item = &'c str>) -> Vec<&'c str> {
    let mut labels = Vec::new();
    for label in curves {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
}
