//! The terminal: panes, widgets, key map, theme.

mod action;
mod chart;
mod desk;
mod facts;
mod key;
mod keymap;
mod metric;
mod playback;
mod raster;
mod rate;
mod scene;
#[cfg(unix)]
mod signals;
mod terminal;
mod text_input;
mod theme;
