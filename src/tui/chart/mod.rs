//! Curves over episodes: axes, series, and the part of them one looks at.

mod axes;
mod curve;
mod decimated;
mod legend;
mod range;

pub use axes::{Axes, Scale, number};
pub use curve::{Curve, Plot, draw};
pub use decimated::Kept;
pub use legend::shortenings;
pub use range::{Range, Window};
