//! Keys: their text form and the key map.

mod key;
mod keymap;

pub use key::{Key, KeyError};
pub use keymap::{Keymap, KeymapError};
