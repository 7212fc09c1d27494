//! Keys: their text form, and what they do.

mod key;
mod keymap;

pub use key::{Key, KeyError};
pub use keymap::{entry, fill, hints};
