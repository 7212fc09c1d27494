//! The terminal: turns keys and mouse into commands, and the session into cells.
//!
//! [`run()`] holds the event loop. [`actions`] is the table of what a key can ask for; with the key
//! map of [`input`] it feeds the footer, the help and the palette. [`view`] is what the screens
//! show, as plain data, and the session behind it. The [`screens`] draw it with [`scene`],
//! [`chart`] and [`widgets`], and [`layers`] lie over them; both answer with [effects](effect),
//! which [`app`] carries out. [`terminal`] owns the terminal itself: modes, input and signals.

mod actions;
mod app;
mod chart;
mod effect;
mod fuzz;
mod input;
mod layers;
mod run;
mod scene;
mod screens;
mod still;
mod terminal;
mod view;
mod widgets;

pub use actions::{KeyHelp, keys};
pub use fuzz::interface;
pub use input::Keymap;
pub use run::{Leaving, Notify, Options, run};
pub use still::Still;

#[cfg(test)]
use app::testing;
