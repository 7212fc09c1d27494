//! Faults that real use brought to light, one module for each kind. Each module names the place in the code where its
//! kind is decided.

#[path = "../program/mod.rs"]
#[allow(dead_code, reason = "shared: each test file needs a part of it")]
mod program;

mod completeness;
mod filesystems;
mod identity;
mod recorded_sessions;
mod removal;
mod results;
mod signals;
mod silent_misuse;
mod terminal_input;
mod text_and_paths;
