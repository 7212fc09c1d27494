//! The terminal: turns keys and mouse into commands, and the session into cells.
//!
//! [`run()`] holds the event loop. [`App`](app::App) is everything the screen knows of its own; it
//! reads the session as plain [`facts`] and changes it only through lines of the command
//! language, both by way of the [`desk`], so that screens can be tested without a session.
//! The table of [`actions`] feeds the key map, the footer, the help and the palette.
//! [`scene`], [`chart`] and [`raster`] draw; [`screens`] put them together; [`layers`] lie over them.

mod actions;
mod app;
mod chart;
mod columns;
mod desk;
mod facts;
mod graphics;
mod handles;
mod key;
mod keymap;
mod layers;
mod manual;
mod metric;
mod mouse;
mod perform;
mod playback;
mod preview;
mod raster;
mod rate;
mod rescue;
mod run;
mod scene;
mod screens;
#[cfg(unix)]
mod signals;
mod still;
mod terminal;
mod text_input;
mod theme;

pub use key::KeyError;
pub use keymap::KeymapError;
pub use manual::{KeyHelp, keys};
pub use run::{Leaving, Options, TuiError, run};
pub use still::Still;
pub use terminal::TerminalError;

#[cfg(test)]
mod testing;
