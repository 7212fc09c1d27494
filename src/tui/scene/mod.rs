//! The scene in cells: the task to scale, what happens in it and what lies over it.

mod draw;
mod legend;
mod object;
mod picture;
mod view;

pub use draw::{Content, Ghost, Heat, Overlays, draw};
pub use object::{Object, Objects};
pub use picture::picture;
pub use view::View;
