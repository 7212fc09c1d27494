//! Layers over the screen. The top layer receives the keys until it is closed.

mod help;
mod palette;
mod prompt;
mod question;
mod tools;
mod tour;

pub use help::Help;
pub use palette::{Arguments, CommandPalette};
pub use prompt::Prompt;
pub use question::Question;
pub use tools::{ToolItem, ToolPalette, tool_in_words};
pub use tour::Tour;
