//! Curves over episodes: axes, series, and the part of them one looks at.

mod axes;
mod curve;
mod range;

pub use axes::{Axes, Scale, number};
pub use curve::{Curve, Plot, draw};
pub use range::{Range, Window};
