//! Charts of curves over episodes: axes, legend, curves and the visible range.

mod axes;
mod curve;
mod decimated;
mod legend;
mod plot;
mod range;

pub use axes::{Axes, Scale};
pub use curve::draw;
pub use plot::{Curve, Plot};
pub use range::{Range, Window};
