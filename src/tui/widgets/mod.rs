//! General drawing components: colours, shapes, text, popups.

pub mod canvas;
pub mod columns;
pub mod layout;
pub mod list;
pub mod popup;
pub mod preview;
pub mod text_input;
pub mod theme;
