//! Charts of curves over episodes: axes, legend, curves and the visible range.

mod axes;
mod cache;
mod curve;
mod decimated;
mod legend;
mod range;

pub use axes::{Axes, Scale, number};
pub use cache::ChartCache;
pub use curve::{Curve, Plot, draw};
pub use legend::shortenings;
pub use range::{Range, Window};
