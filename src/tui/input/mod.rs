//! Keys: how they are written, and which of them asks for what.

mod key;
mod keymap;

pub use key::{Key, KeyError};
pub use keymap::{Keymap, KeymapError};
