//! Publication figures: pure functions from data to pixels, SVG and the numbers behind.
//!
//! Every figure is a plain data struct that implements [`Figure`]; equal data gives
//! equal bytes. The structs hold numbers only (positions normalised, as everywhere
//! outside physics), so that anything that has the numbers can draw the figure. Values
//! that are not finite are missing: they leave gaps, never break an axis. Figures
//! without data are drawn as empty panels that say so.
//!
//! A figure draws in points on a [`Canvas`], which is a plotters drawing area of any
//! backend. PNGs come from an anti-aliasing backend with the bundled typeface
//! (`assets/fonts/`), so that no system library or font is needed.

mod ablation;
mod actions;
mod animation;
mod axes;
mod bars;
mod canvas;
mod curves;
mod dashboard;
mod data;
mod font;
mod geometry;
mod hits;
mod launches;
mod layout;
mod methods;
mod model_error;
mod output;
mod provenance;
mod raster;
mod relative;
mod scene;
mod style;
mod table;
mod tasks;
#[cfg(test)]
mod tests;

pub use ablation::{Ablation, Variant};
pub use actions::{ActionSamples, TaskActions};
pub use animation::{Animation, Moment};
pub use curves::{CurvePanel, LearningCurves, PerformanceProfile, Progress};
pub use dashboard::Dashboard;
pub use data::{Curve, Estimate, Statistics};
pub use hits::{Hits, PolicyHits, TaskHits};
pub use launches::{Launches, ToolLaunches};
pub use methods::{MethodScore, MethodScores, ScorePanel};
pub use model_error::{ModelError, Predictor};
pub use output::{Figure, FigureError};
pub use provenance::Provenance;
pub use relative::{Edge, Instant, RelativeFrames};
pub use style::DEFAULT_DPI;
pub use tasks::TaskGrid;
