//! Data types shared by figures.

use mge_stats::Estimate;

/// How centres and intervals were computed, for captions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// The centre, such as "interquartile mean".
    pub centre: String,
    /// The interval, such as "95 % stratified bootstrap interval"; empty when there is none.
    pub interval: String,
    /// Number of seeds per estimate; the largest if they differ.
    pub seeds: usize,
    /// The smallest number of seeds per estimate, if they differ.
    pub fewest_seeds: Option<usize>,
}

impl Statistics {
    /// A sentence for the note of a figure, such as "Interquartile mean of 5 seeds; bars: 95 % ...".
    pub(super) fn caption(&self, mark: &str) -> String {
        let seeds = match self.fewest_seeds.filter(|fewest| *fewest != self.seeds) {
            Some(fewest) => format!("{fewest} to {} seeds", self.seeds),
            None if self.seeds == 1 => "1 seed".to_owned(),
            None => format!("{} seeds", self.seeds),
        };
        let centre = format!("{} of {seeds}", self.centre);
        if self.interval.is_empty() { centre } else { format!("{centre}; {mark}: {}", self.interval) }
    }
}

/// A line with a band. Non-finite values are missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Its label in the legend. Curves with equal labels have equal colours in all panels.
    pub label: String,
    /// Positions on the x axis, increasing.
    pub x: Vec<f64>,
    /// Values.
    pub y: Vec<f64>,
    /// Lower ends of the intervals; empty when there are none.
    pub low: Vec<f64>,
    /// Upper ends of the intervals; empty when there are none.
    pub high: Vec<f64>,
}

impl Curve {
    /// The curve of estimates at these positions; without a band if none has an interval.
    pub fn new(label: &str, x: Vec<f64>, estimates: &[Estimate]) -> Self {
        let column = |of: fn(&Estimate) -> f64| estimates.iter().map(of).collect();
        let bound = |of| if estimates.iter().any(Estimate::has_interval) { column(of) } else { Vec::new() };
        let (y, low, high) = (column(|e| e.value), bound(|e| e.lower), bound(|e| e.upper));
        Self { label: label.to_owned(), x, y, low, high }
    }

    pub(super) fn is_empty(&self) -> bool {
        !self.x.iter().zip(&self.y).any(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// The text of a label in a legend of pairs of both; the label itself if it is not there.
pub fn text_of<'l>(legend: &'l [(String, String)], label: &'l str) -> &'l str {
    legend.iter().find(|(known, _)| known == label).map_or(label, |(_, text)| text)
}

/// The distinct labels, in order of appearance.
pub(super) fn labels<'c>(curves: impl IntoIterator<Item = &'c str>) -> Vec<&'c str> {
    let mut labels = Vec::new();
    for label in curves {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
}
