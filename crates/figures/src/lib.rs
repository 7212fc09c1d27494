//! Publication figures: pure functions from data to pixels, SVG and CSV.
//!
//! Every figure is a plain data struct that implements [`Figure`]; equal data gives equal bytes. The structs hold
//! only numbers (positions normalised, as everywhere outside physics), so that any code with the numbers can draw the
//! figure. Non-finite values are missing: they leave gaps and never break an axis. Figures without data are drawn as
//! empty panels with a message.
//!
//! A figure draws in points on a [`Canvas`], whose shapes and texts plotters writes as SVG. PNG is rendered from
//! that SVG with the bundled typefaces (`assets/fonts/`), so that both look the same and no system library or font is
//! needed.
//!
//! ```
//! use mge_figures::{Curve, CurvePanel, Figure, LearningCurves, Provenance};
//!
//! let curve = Curve { label: "DDPG".into(), x: vec![0.0, 100.0], y: vec![0.0, 0.8], ..Curve::default() };
//! let panels = vec![CurvePanel { task: "task1".into(), curves: vec![curve] }];
//! let figure = LearningCurves { panels, ..LearningCurves::default() };
//! let svg = figure.to_svg(&Provenance::new("my-program", &[1], ""));
//! assert!(svg.starts_with("<svg") && svg.contains("my-program"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

mod actions;
mod axes;
mod bars;
mod canvas;
mod curves;
mod data;
mod error;
mod font;
mod geometry;
mod hits;
mod launches;
mod layout;
mod methods;
mod moment;
mod output;
mod plot_style;
mod provenance;
mod relative;
mod render;
mod scene;
mod style;
mod table;
mod tasks;
#[cfg(test)]
mod tests;
mod xml;

pub use actions::{ActionSamples, TaskActions};
pub use axes::{labelled_ticks, value_labels};
pub use canvas::{Canvas, Pen, TextFormat, svg};
pub use curves::{Against, CurvePanel, LearningCurves, Success};
pub use data::{Curve, Statistics, text_of};
pub use error::FigureError;
pub use font::{Family, lacking};
pub use geometry::{Rect, tool_outline};
pub use hits::{HitBars, PolicyHits, TaskHits};
pub use launches::{Launches, ToolLaunches};
pub use methods::{MethodScore, MethodScores, ScorePanel};
pub use moment::Moment;
pub use output::{EXTENSIONS, Figure, PICTURE, check_all, encode};
pub use plot_style::PlotStyle;
pub use provenance::Provenance;
pub use relative::{Edge, Instant, RelativeFrames};
pub use render::rgb;
pub use scene::Mover;
pub use style::{Color, DEFAULT_DPI};
pub use style::{colors, series, shade};
pub use tasks::TaskGrid;
