//! The scene drawn in cells: the task to scale, one frame of an episode, and overlays.

mod content;
mod draw;
mod legend;
mod object;
mod picture;
#[cfg(test)]
mod tests;
mod view;

pub use content::{Content, Ghost, Heat, Overlays};
pub use draw::draw;
pub use legend::legend;
pub use object::Objects;
pub use picture::{picture, task_picture};
pub use view::View;
