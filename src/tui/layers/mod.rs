//! Layers over the screen. The top layer receives the keys until it is closed.

mod form;
mod palette;
mod picker;
mod question;
mod search;

pub use form::{DEFAULT, Field, Form};
pub use palette::{Arguments, CommandPalette, Value};
pub use picker::{Item, Picker};
pub use question::{Question, some_of};
