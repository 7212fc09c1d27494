//! MGE Workbench: intuitive-physics puzzles, learned dynamics models and DDPG with
//! model-guided exploration, in the terminal and headless.
//!
//! The rooms, in the direction in which data flows (nothing knows what comes after it):
//! [`physics`] → [`task`] → [`mod@env`] → [`dynamics`] → [`guidance`] → [`trainer`] → [`workbench`]
//! → [`tui`]; [`nn`] and [`agent`] know vectors only, [`run`] is what a run is on disk,
//! [`stats`], [`figures`], [`evidence`], [`study`] and [`sweep`] turn runs into evidence.

pub mod agent;
pub mod atomic;
pub mod batch;
pub mod bench;
pub mod cli;
pub mod dynamics;
pub mod env;
pub mod evidence;
pub mod figures;
pub mod guidance;
pub mod json;
pub mod markdown;
pub mod nn;
pub mod physics;
pub mod protocol;
pub mod run;
pub mod spelling;
pub mod stats;
pub mod streams;
pub mod study;
pub mod sweep;
pub mod task;
pub mod text;
pub mod trainer;
pub mod tui;
pub mod validation;
pub mod workbench;
