//! The terminal: turns keys and mouse into commands, and the session into cells.
//!
//! [`run()`] holds the event loop. [`actions`] is the table of actions; together with the key map of
//! [`input`] it feeds the footer, the help and the palette. [`view`] holds the view model, which is
//! plain data, and the session behind it. The [`screens`] draw the view model with [`scene`],
//! [`chart`] and [`widgets`]; [`layers`] are drawn over them. Both return [effects](effect), which
//! [`app`] carries out. [`terminal`] owns the terminal: modes, input and signals.

mod actions;
mod app;
mod chart;
mod effect;
#[cfg(any(test, fuzzing))]
#[path = "../../fuzz/interface.rs"]
mod fuzz;
mod input;
mod layers;
mod offscreen;
mod run;
mod scene;
mod screens;
mod terminal;
mod view;
mod widgets;

pub use actions::{Entry, entries};
pub use app::App;
#[cfg(any(test, fuzzing))]
pub use fuzz::interface;
pub use run::{ExitReason, Options, run};
pub use terminal::Notify;

#[cfg(test)]
use app::testing;
