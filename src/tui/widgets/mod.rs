//! General drawing components: colours, dots, text, popups.

pub mod columns;
pub mod layout;
pub mod list;
pub mod popup;
pub mod preview;
pub mod raster;
pub mod text_input;
pub mod theme;
