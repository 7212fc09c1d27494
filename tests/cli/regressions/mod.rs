//! Faults that real use brought to light, one module for each kind. Each module names the place in the code where its
//! kind is decided.

mod completeness;
mod filesystems;
mod identity;
mod recorded_sessions;
mod removal;
mod results;
mod signals;
mod silent_misuse;
#[cfg(unix)]
mod terminal_input;
mod text_and_paths;
